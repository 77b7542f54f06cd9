// Stands in place of the last script of a live page: brings it into a state, and posts the document that it is then,
// with the canvas as an image. A screenshot shows a canvas of WebGPU white.

const plan = await (await fetch("plan")).json();
const live = await readLive();
const page = new App(live);
await page.start(plan.chosen);
page.play(false);
const { batch } = page.crowds[0];
const steps = async (count) => {
  for (let made = 0; made < count; made += 5) await page.stepBy(Math.min(5, count - made));
};

/** Index of a truck that is `plan.along` steps into one of the routes whose names end so. */
async function chosenTruck() {
  const bytes = new DataView(await batch.column("truck")), { size, fields } = live.facts.code.structs.Truck;
  const word = (env, name) => bytes.getUint32(env * size + fields[name].at, true);
  const isIt = (env) => page.world.facts.routes[word(env, "route")].name.match(plan.route) &&
    word(env, "held") === 0 && Math.abs(word(env, "steps") - plan.along) <= 6;
  const found = Array.from({ length: batch.n }, (_, env) => env).find(isIt);
  if (found === undefined) throw new Error(`no truck is ${plan.along} steps into ${plan.route}`);
  return found;
}

try {
  await page.between(() => batch.restart({ seed: 0, atOnce: Math.ceil(batch.n / plan.filled) }));
  await steps(plan.steps);
  if (plan.followed) {
    await page.pickTruck(await chosenTruck());
    await steps(plan.followed);
  }
  for (const [asked, count] of plan.driven ?? []) {
    page.takeOver(asked);
    page.play(false);
    await steps(count);
  }
  // As it looks while it runs; each choice is an attribute only where the page wrote it.
  byId("play").textContent = "❚❚";
  for (const { options, selectedIndex } of document.querySelectorAll("select")) {
    [...options].forEach((one, index) => one.toggleAttribute("selected", index === selectedIndex));
  }
  byId("seed").setAttribute("value", byId("seed").value);
  const figures = `${byId("heading").textContent}; ${byId("success-of").textContent}: ${byId("success").textContent}`;
  await page.between(() => {
    page.draw();
    const seen = Object.assign(new Image(), { id: "picture", src: byId("picture").toDataURL() });
    byId("picture").replaceWith(seen);
  });
  document.querySelectorAll("script, noscript").forEach((node) => node.remove());
  await fetch("document", { method: "POST", body: document.documentElement.outerHTML });
  await fetch("done", { method: "POST", body: figures });
} catch (error) {
  await fetch("failed", { method: "POST", body: `${error.stack}` });
}
