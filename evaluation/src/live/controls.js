// What the visitor chooses: benchmark, road, policies, number of trucks, seed, time and colours; and the keys.

/** Speeds of time; 0 is as fast as the device goes. */
const RATES = [[0.25, "¼×"], [0.5, "½×"], [1, "1×"], [2, "2×"], [4, "4×"], [8, "8×"], [0, "fastest"]];
/** Numbers of trucks that are offered, and the one of a software device. */
const COUNTS = [64, 256, 512, 1024, 4096, 16384, 65536], FEW = 256;
/** What the picture's colours mean: the names of a ramp's colours in the theme, and its words. */
const COLOURINGS = [
  [["steer-right", "steer-straight", "steer-left"], "steers right", "left"],
  [["transfer-low", "transfer-low", "transfer-high"], "wheels loaded evenly", "lifting"],
  [["begun", "begun", "done"], "at its start", "at its exit"],
];
const KEYS = [
  ["Space", "pause, go on"], ["← ↑ → ↓", "move the picture; with the wheel taken, steer and change the speed"],
  ["+ −", "zoom"], ["0", "all roads"], ["N P", "follow the next truck, the one before"],
  ["T", "take the wheel, let it go"], ["A D W S", "steer left and right, faster, slower"],
  ["Esc", "let go; back to all"],
  ["C", "colours"], ["R", "sensors"], ["F", "the latest failure again"], ["?", "these keys"],
];

/** Whether the device, once it is open, has room for so many trucks: the widest columns are observations and extras. */
const hasRoom = (live, gpu, n) => {
  if (!gpu) return true;
  const widest = Math.max(...Object.values(live.facts.code.columns).map(({ bytes }) => bytes));
  return n * widest <= Math.min(gpu.limits.maxStorageBufferBindingSize, gpu.limits.maxBufferSize);
};

function option(value, text, selected = false) {
  return html("option", { value, selected }, text);
}

/** Fills a select and keeps what is chosen where it is still there. */
function fillSelect(id, pairs, chosen) {
  byId(id).replaceChildren(...pairs.map(([value, text]) => option(value, text, String(value) === String(chosen))));
}

/** The name of a benchmark, with the file that it came by or the roads that were baked for it. */
const worldWords = ({ name, file, on, copy }) =>
  `${name}${file ? ` of ${file}` : on ? ` on ${on}` : ""}${copy ? ` (${copy})` : ""}`;

/** Numbers a world where others have its name. */
function tellApart(others, world) {
  const n = others.filter((other) => worldWords({ ...other, copy: null }) === worldWords(world)).length;
  if (0 < n) world.copy = n + 1;
}

/** Roads to choose from: all, each split that has roads of its own, each road. The value is a split or an index. */
function roadChoices(world) {
  const roadsOf = (routes) => [...new Set(routes.map((route) => world.routes[route].road))];
  const parts = Object.entries(world.splits).filter(([, routes]) => routes.length < world.routes.length);
  const roads = 1 < world.roads.length ? world.roads.map(({ name }, index) => [index, name]) : [];
  return [["", roads.length === 0 ? world.roads[0].name : `all ${roads.length} roads`],
    ...parts.map(([name, routes]) => [name, `${name} routes, on ${roadsOf(routes).length}`]), ...roads];
}

/** The routes of a choice, and the roads that they are on. */
function chosenRoutes(world, choice) {
  const all = world.routes.map((_, index) => index);
  const routes = choice === "" ? all : (world.splits[choice] ?? world.roads[choice].routes);
  const roads = [...new Set(routes.map((route) => world.routes[route].road))];
  return { routes, roads, split: world.splits[choice] ? choice : null };
}

/** Shows what is chosen. */
function showChoices(app) {
  const { live, gpu, chosen } = app, world = live.facts.worlds[chosen.world];
  fillSelect("benchmark", live.facts.worlds.map((one, index) => [index, worldWords(one)]), chosen.world);
  fillSelect("road", roadChoices(world), chosen.road);
  const demands = world.traffic?.demand ?? [];
  const each = demands.map((demand, index) => [index, `${whole(demand)} an hour`]);
  fillSelect("demand", [["", "drawn each episode"], ...each], chosen.demand ?? "");
  for (const node of [byId("demand"), byId("demand").labels[0]]) node.hidden = demands.length < 2;
  app.baker.show(world);
  const all = app.policies.map((policy, index) => [index, policyWords(policy)]);
  app.learned.show();
  const isOffered = ([index]) => app.canDrive(index, chosen.world) && !app.learned.hides(index);
  const policies = [...all.filter(isOffered), [-1, policyWords(null)]];
  fillSelect("policy", policies, chosen.policy);
  fillSelect("second", [["", "nothing"], ...policies], chosen.second ?? "");
  const counts = [...new Set([...COUNTS, chosen.n])].sort((a, b) => a - b).filter((n) => hasRoom(live, gpu, n));
  fillSelect("count", counts.map((n) => [n, whole(n)]), chosen.n);
  byId("seed").value = chosen.seed;
  fillSelect("rate", RATES, app.rate);
  showLegend(app);
}

/** Entries of a legend for areas that are there: colour, words, whether. */
const areaKeys = (all) => all.filter(([, , isThere]) => isThere).map(([colour, words]) =>
  html("li", {}, html("i", { style: `--swatch: var(--${colour})` }), words));

/** Says what the colours mean. */
function showLegend(app) {
  const [names, from, to] = COLOURINGS[app.colouring];
  const { classes, roads, traffic } = app.live.facts.worlds[app.chosen.world], hasLoads = 1 < classes.length;
  const ramp = names.map((name, n) => `--${"abc"[n]}: var(--${name})`).join("; ");
  const cross = (name) => html("i", { class: "cross", style: `--swatch: var(--end-${name})` }, "×");
  byId("legend").replaceChildren(
    html("li", {}, from, html("i", { class: "ramp", style: ramp }), to),
    ...(app.visit.focus ? [
      ...lineKeys([["tractor", "path of the tractor"], ["trailer", "of the trailer"], ["route", "route"],
        ["ray", "distance sensors"]]),
    ] : [
      html("li", {}, cross("tractor_collided"), "tractor hit a kerb"),
      html("li", {}, cross("trailer_collided"), "trailer did"),
      // Only loads that are drawn can stand high enough.
      ...(hasLoads ? [html("li", {}, cross("rolled_over"), "rolled over")] : []),
      ...(traffic ? [html("li", {}, cross("met_vehicle"), "met a vehicle")] : []),
    ]),
    ...areaKeys([["car", "car", traffic], ["van", traffic?.trailers ? "van, bus, truck" : "van", traffic?.vans],
      ["rude", "edge of who is rude", traffic?.rude],
      ["apron", "apron, for trailers alone", roads.some(({ apron }) => apron)]]));
}

/** Listens to everything that can be chosen. */
function listenToChoices(app) {
  const listen = (id, event, act) => byId(id).addEventListener(event, act);
  const on = (id, event, act) => listen(id, event, () => app.attempt(act));
  const value = (id) => byId(id).value;
  for (const id of ["benchmark", "road"]) listen(id, "change", () => app.baker.leave());
  on("benchmark", "change", () => app.choose({ world: Number(value("benchmark")) }));
  on("road", "change", () => app.choose({ road: value("road") }));
  on("demand", "change", () => app.choose({ demand: value("demand") === "" ? null : Number(value("demand")) }));
  on("policy", "change", () => app.choose({ policy: Number(value("policy")) }));
  on("second", "change", () => app.choose({ second: value("second") === "" ? null : Number(value("second")) }));
  on("count", "change", () => app.choose({ n: Number(value("count")) }));
  const seed = () => Math.min(Math.max(Math.trunc(Number(value("seed"))) || 0, 0), 2 ** 32 - 1);
  const reseed = () => app.choose({ seed: seed() });
  on("seed", "change", reseed);
  on("restart", "click", reseed);
  listen("play", "click", () => app.play(!app.playing));
  listen("rate", "change", () => app.setRate(Number(value("rate"))));
  listen("colouring", "change", () => app.setColouring(Number(value("colouring"))));
  listen("nearer", "click", () => app.visit.zoom(1.4));
  listen("farther", "click", () => app.visit.zoom(1 / 1.4));
  on("all", "click", () => app.visit.leave());
  on("pick", "click", () => {
    const { focus, again } = app.visit;
    return focus === null || again !== null ? app.visit.pickNext(1) : app.visit.toggleWheel();
  });
  on("wheel", "click", () => app.visit.toggleWheel());
  on("leave", "click", () => app.visit.leave());
  listen("let-go", "click", () => app.visit.giveBack());
  listen("slower", "click", () => app.visit.driving.change(-SPEED_STEP));
  listen("faster", "click", () => app.visit.driving.change(SPEED_STEP));
  on("load", "input", () => app.visit.setLoad(Number(value("load"))));
  listen("help", "click", () => byId("keys").showModal());
  listen("again", "click", () => app.start());
  // A browser may refuse it, as in a frame of another page; then the picture stays as it is.
  listen("whole", "click", () => byId("stage").requestFullscreen().catch((error) => app.say(error.message, true)));
  byId("whole").hidden = !document.fullscreenEnabled;
  byId("keys-list").replaceChildren(...KEYS.flatMap(([keys, words]) => [
    html("dt", {}, ...keys.split(" ").flatMap((key) => [html("kbd", {}, key), " "])), html("dd", {}, words),
  ]));
}

/** Listens to keys, wherever on the page they are not a control's own. */
function listenToKeys(app) {
  const atOnce = {
    " ": () => app.play(!app.playing), "+": () => app.visit.zoom(1.3), "-": () => app.visit.zoom(1 / 1.3),
    ArrowLeft: () => app.visit.pan(60, 0), ArrowRight: () => app.visit.pan(-60, 0),
    ArrowUp: () => app.visit.pan(0, 60), ArrowDown: () => app.visit.pan(0, -60),
    c: () => app.setColouring((app.colouring + 1) % COLOURINGS.length), r: () => byId("rays").click(),
    "?": () => byId("keys").showModal(),
  };
  const between = {
    0: () => app.visit.leave(), n: () => app.visit.pickNext(1), p: () => app.visit.pickNext(-1),
    t: () => app.visit.toggleWheel(), Escape: () => app.visit.escape(), f: () => app.visit.latestFailure(),
  };
  document.addEventListener("keydown", (event) => {
    const { tagName, type } = event.target, isSlider = type === "range";
    if (event.ctrlKey || event.metaKey || event.altKey || byId("keys").open) return;
    // Controls with keys of their own keep them.
    if ((tagName === "INPUT" && type !== "checkbox" && !isSlider) || tagName === "SELECT") return;
    if (isSlider && /^(Arrow|Home|End|Page)/.test(event.key)) return;
    if (event.key === " " && type === "checkbox") return;
    if ((event.key === " " || event.key === "Enter") && (tagName === "BUTTON" || tagName === "SUMMARY")) return;
    const key = event.key === "=" ? "+" : event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (app.visit.driving.key(event.key, true)) event.preventDefault();
    else if (atOnce[key] || between[key]) {
      event.preventDefault();
      if (atOnce[key]) atOnce[key]();
      else app.attempt(between[key]);
    }
  });
  document.addEventListener("keyup", (event) => app.visit.driving.key(event.key, false));
  // Keys that are released elsewhere would be held for ever.
  window.addEventListener("blur", () => app.visit.driving.held.clear());
}
