// Reads the data blocks and fills the page. An error is shown on the page.

const troubles = [];

function trouble(error) {
  troubles.push(String(error?.message ?? error));
  byId("trouble").hidden = false;
  byId("trouble").textContent = `A part of this page could not be shown: ${troubles.at(-1)}`;
}
window.addEventListener("error", (event) => trouble(event.error ?? event.message));
window.addEventListener("unhandledrejection", (event) => trouble(event.reason));

/** An error in one part leaves the others working. */
function attempt(part) {
  try {
    return part();
  } catch (error) {
    trouble(error);
    return undefined;
  }
}

const testing = location.hash === "#selftest";
try {
  const page = await readPage();
  attempt(() => showHeadline(page));
  const replay = attempt(() => new Replay(page));
  attempt(() => showRoutes(page, (name) => replay?.openName(name)));
  attempt(() => showClasses(page, replay));
  attempt(() => showTraining(page));
  attempt(() => showTrainingRoutes(page));
  byId("source").addEventListener("toggle", () => { byId("source").querySelector("pre").textContent = JSON.stringify(JSON.parse(block("report")), null, 2); }, { once: true });
  if (testing) await selftest({ page, replay });
} catch (error) {
  trouble(error);
  if (testing) document.body.append(html("pre", { id: "selftest" }, `selftest failed\nfails: the page is read: ${error.message}`));
}
