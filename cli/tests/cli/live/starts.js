// Visits of the page while it starts, where its device fails, and by its address; visitor.js chooses among them.

/** Errors that nobody caught. */
const uncaught = [];
window.addEventListener("error", ({ message }) => uncaught.push(message));
window.addEventListener("unhandledrejection", ({ reason }) => uncaught.push(String(reason)));

const later = (ms) => new Promise((next) => setTimeout(next, ms));
const isSeen = async (id) => {
  while (byId(id).hidden) await later(10);
};

/** Everything that a visitor may do before trucks drive. */
function handled() {
  for (const key of ["+", "ArrowLeft", "c", "f", "0", "Escape"])
    document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
  const { left, top } = byId("picture").getBoundingClientRect();
  const at = { pointerId: 1, clientX: left + 20, clientY: top + 20, bubbles: true };
  byId("picture").dispatchEvent(new WheelEvent("wheel", { ...at, deltaY: 100, cancelable: true }));
  byId("restart").click();
}

/** A start without an adapter, one while which everything is asked for, and ones after a device was lost or failed. */
async function starts(live) {
  const page = new App(live), real = GPU.prototype.requestAdapter, all = {};
  const state = () => ({ ...page.chosen, ...page.pending, ...missing() });
  GPU.prototype.requestAdapter = async () => null;
  await page.start({ n: 128, seed: 5 });
  handled();
  await page.frames;
  all.without = { ...state(), ...said() };
  try {
    page.lookAt(0, 0, 0, 10);
  } catch (error) {
    all.script = error.message;
  }
  GPU.prototype.requestAdapter = real;
  byId("again").click();
  handled();
  await page.ready;
  // What was asked for meanwhile is done.
  await page.between(() => {});
  all.begun = { ...state(), batch: page.crowds[0].batch.n, said: byId("said").textContent };
  page.gpu.device.destroy();
  await isSeen("missing");
  all.lost = state();
  await page.start({ n: 8 });
  page.gpu.buffer("too large", 2 * page.gpu.limits.maxBufferSize);
  await isSeen("missing");
  all.failed = state();
  await give("starts", JSON.stringify({ ...all, uncaught }));
}

/** What the page makes of its address and of another one, of worlds for which it has no policy, and of a choice while a
 * road is baked. The page has a benchmark whole, one for which it has no policy, and the first one's name again. */
async function address(live) {
  const page = new App(live), all = {}, { section } = page.baker;
  const follow = async (hash) => {
    const changed = new Promise((next) => window.addEventListener("hashchange", next, { once: true }));
    location.hash = hash;
    await changed;
  };
  const state = () => ({ n: page.crowds[0].batch.n, seed: page.chosen.seed, road: byId("road").selectedOptions[0].text });
  page.baker.section = null;
  await follow("n=1e2&seed=4294967296&benchmark=nope&road=wide/7/12&m=3");
  await followAddress(page);
  await page.between(() => {});
  all.wrong = said();
  page.baker.section = section;
  await follow("n=16&seed=3&road=20m");
  await page.between(() => {});
  all.changed = state();
  await follow("road=nope");
  all.unknown = said();
  page.play(false);

  const choose = async (change) => {
    await page.attempt(() => page.choose(change));
    return page.chosen.policy;
  };
  all.whole = byId("success-note").textContent;
  await choose({ world: 2 });
  all.narrowed = byId("success-note").textContent;
  all.listed = [...byId("benchmark").options].map(({ text }) => text);
  all.policies = [await choose({ world: 1 }), await choose({ world: 0 })];
  await choose({ policy: -1 });
  all.random = [await choose({ world: 1 }), await choose({ world: 0 })];

  // What is said for a while is said for 20 ms.
  const { setTimeout } = window;
  window.setTimeout = (act, ms) => setTimeout(act, ms / 300);
  page.baker.baked = () => new Promise((done) => (all.bake = done));
  byId("any-road").value = "wide/7/12";
  byId("bake").click();
  await new Promise((next) => setTimeout(next, 60));
  all.baking = { ...said(), isHidden: byId("said").hidden };
  window.setTimeout = setTimeout;
  byId("benchmark").value = 2;
  byId("benchmark").dispatchEvent(new Event("change"));
  all.bake({});
  await page.between(() => {});
  all.after = { world: page.chosen.world, isHidden: byId("said").hidden };

  page.gpu.worlds = [];
  page.gpu.limits = { maxStorageBufferBindingSize: 100_000, maxBufferSize: 100_000 };
  await choose({ world: 0 });
  all.large = said();
  await give("address", JSON.stringify({ ...all, uncaught }));
  page.gpu.destroy();
}

