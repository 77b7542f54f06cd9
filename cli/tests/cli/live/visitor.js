// Stands in place of the page's last script: visits the page as the test's plan says, and gives what it saw.

const asked = async (name) => new Uint8Array(await (await fetch(name)).arrayBuffer());
const give = (name, body) => fetch(name, { method: "POST", body });
const said = () => ({ words: byId("said").textContent, isBad: byId("said").className === "bad" });
const missing = () =>
  ({ kind: byId("missing").hidden ? null : byId("missing").dataset.kind, words: byId("missing").innerText });

/** The page with held trucks: nothing but roads is drawn. */
async function opened(live, choice) {
  const page = new App(live);
  await page.start(choice);
  page.play(false);
  return page;
}

/** Colours where the road, an island and a kerb are; and the theme's. */
async function pixels(live) {
  const page = await opened(live, { n: 8 }), [crowd] = page.crowds, seen = [];
  // What the page began with has not set out again.
  await page.between(() => crowd.batch.restart({ seed: 0 }));
  const at = async (road, point, width) => {
    page.lookAt(road, ...point, width);
    return (await page.pixelAt(...page.screenOf(road, ...point))).slice(0, 3);
  };
  for (const [road, { routes }] of page.world.facts.roads.entries()) {
    // The eighth waypoint lies on the approach, far from the kerbs.
    const { position } = page.world.waypoints(routes[0])[8];
    seen.push({ road: await at(road, position, 150), island: await at(road, [0, 0], 150) });
  }
  await page.stepBy(2);
  await page.pickTruck(0);
  const { truck, ranges } = crowd.row, { rays } = page.world.vehicle(truck.vehicle);
  const { n_trailer_rays: first } = live.facts.code, range = page.world.facts.sensor_range;
  const n = ranges.findIndex((reach, index) => first <= index && reach < 0.9 * range);
  const [c, s] = [Math.cos(truck.heading), Math.sin(truck.heading)];
  const turned = ([x, y]) => [c * x - s * y, s * x + c * y];
  const [mount, along] = [turned(rays[n].origin), turned(rays[n].direction)];
  const end = truck.position.map((part, axis) => part + mount[axis] + ranges[n] * along[axis]);
  const { road } = page.world.facts.routes[truck.route];
  await page.between(() => page.visit.leave());
  const kerb = await at(road, end, 150);
  await page.pickTruck(0);
  const middle = page.screenOf(road, ...crowd.trailerOf(truck));
  const trailer = (await page.pixelAt(...middle)).slice(0, 3);
  const colours = Object.fromEntries(["road", "solid", "kerb", "trailer"].map((name) => [name, page.colour(name)]));
  await give("pixels", JSON.stringify({ seen, kerb, trailer, colours }));
  page.gpu.destroy();
}

/** Colours of the theme, and at points of a road, `inwards` by half an edge of 2.5 pixels. After some steps of trucks that
 * set out at once, with a truck that is followed or none. */
async function colouring(live, { n, steps, followed, points, names }) {
  const page = await opened(live, { n, policy: -1 }), [crowd] = page.crowds, seen = [];
  await page.between(() => crowd.batch.restart({ seed: 0, atOnce: n }));
  if (0 < steps) await page.stepBy(steps);
  if (followed !== null) await page.pickTruck(followed);
  byId("rays").checked = false;
  // Nothing is moved on from its last step.
  page.setRate(1);
  for (const { road, point, inwards = [0, 0], width } of points) {
    page.lookAt(road, ...point, width);
    const at = point.map((part, axis) => part + 1.25 * page.stage.camera.pixel * inwards[axis]);
    seen.push((await page.pixelAt(...page.screenOf(road, ...at))).slice(0, 3));
  }
  const colours = Object.fromEntries(names.map((name) => [name, page.colour(name)]));
  await give("colouring", JSON.stringify({ seen, colours, legend: byId("legend").innerText }));
  page.gpu.destroy();
}

/** What is said of trucks among vehicles: of one that is followed, of failures, and where all have one demand. */
async function among(live, { n, steps, demand }) {
  const page = await opened(live, { n, policy: -1 }), [crowd] = page.crowds, text = (id) => byId(id).innerText;
  await page.between(() => crowd.batch.restart({ seed: 0, atOnce: n }));
  await page.stepBy(1);
  await page.pickTruck(2);
  const followed = { words: text("truck-vehicles"), values: text("values-summary"), cars: crowd.row.cars.length };
  const sentence = text("sentence"), names = [...byId("values").querySelectorAll("span")].map(({ innerText }) => innerText);
  await page.between(() => page.visit.leave());
  for (let made = 1; made < steps; made += 1) await page.stepBy(1);
  const { failures } = crowd, listed = [...byId("failures").children].map(({ innerText }) => innerText);
  const met = failures.find((failure) => failure.met !== 0 && failure.episode === 0);
  await page.between(() => page.visit.driveAgain(crowd, met));
  page.play(false);
  while (page.visit.again.row.ended === 0) await page.stepBy(1);
  const again = text("truck-state");
  const offered = [...byId("demand").options].map(({ innerText }) => innerText);
  byId("demand").value = demand;
  byId("demand").dispatchEvent(new Event("change"));
  await page.between(() => {});
  await page.stepBy(2);
  await page.pickTruck(0);
  const chosen = text("truck-vehicles"), ends = text("ends");
  await give("among", JSON.stringify({ followed, names, sentence, failures, listed, again, offered, chosen, ends }));
  page.gpu.destroy();
}

/** Where points of a road are seen, whether a truck is found where it is seen, and how it is steered by the left key and
 * towards points to its left and to its right as they are seen. */
async function hand(live, { points }) {
  const page = await opened(live, { n: 8, policy: -1 }), [crowd] = page.crowds;
  await page.between(() => crowd.batch.restart({ seed: 0, atOnce: 8 }));
  const colours = [], look = async (point) => {
    page.lookAt(0, ...point, 60);
    colours.push((await page.pixelAt(...page.screenOf(0, ...point))).slice(0, 3));
  };
  await look(page.world.waypoints(0)[8].position);
  await page.stepBy(4);
  await page.pickTruck(1);
  byId("rays").checked = false;
  page.setRate(1);
  const { truck } = crowd.row, { sites } = crowd.picture;
  const position = sites.placed(truck.route, truck.position), found = await crowd.nearest(position, 2);
  const side = sites.placed(truck.route, [0, 1])[1] - sites.placed(truck.route, [0, 0])[1];
  // The rear of its cab.
  const ahead = crowd.rigOf(truck).tractor_body.front - 1.4;
  await look([Math.cos(truck.heading), Math.sin(truck.heading)].map((part, axis) => truck.position[axis] + ahead * part));
  const pixels = points.map((point) => page.screenOf(0, ...point));
  page.takeOver({ steering: 0, speed: 2 });
  page.play(false);
  const { driving } = page.visit, heading = side * truck.heading;
  driving.key("ArrowLeft", true);
  driving.update(0.1);
  driving.key("ArrowLeft", false);
  const byKey = driving.steering, mark = parseFloat(byId("hud-steering").firstElementChild.style.left);
  const towards = [1, -1].map((left) => driving.towards([
    position[0] + 30 * Math.cos(heading) - 10 * left * Math.sin(heading),
    position[1] + 30 * Math.sin(heading) + 10 * left * Math.cos(heading),
  ]));
  const theme = Object.fromEntries(["road", "tractor"].map((name) => [name, page.colour(name)]));
  await give("hand", JSON.stringify({ side, found, colours, theme, pixels, byKey, mark, towards }));
  page.gpu.destroy();
}

/** A truck that is taken over: steer angles of its steps, asked for beyond the lock; and after it is given back. */
async function wheel(live) {
  const page = await opened(live, { n: 8 }), [crowd] = page.crowds;
  await page.stepBy(4);
  await page.pickTruck(1);
  const { steer_max: lock, steer_rate: rate } = crowd.rigOf(crowd.row.truck);
  const { step, n_actions: nActions } = page.world.facts;
  // It stops, so that it hits nothing while its wheels turn.
  page.takeOver({ steering: 0, speed: 0 });
  page.play(false);
  await page.stepBy(50);
  const before = crowd.row.truck.steering, angles = [], actions = [];
  page.takeOver({ steering: 3, speed: 0 });
  const state = byId("truck-state").textContent;
  for (let n = 0; n < 26; n++) {
    await page.stepBy(1);
    angles.push(crowd.row.truck.steering);
    actions.push(crowd.row.action);
  }
  const { speed } = crowd.row.truck;
  page.giveBack();
  await page.stepBy(1);
  const after = { state: byId("truck-state").textContent, action: crowd.row.action };
  const most = rate * step;
  await give("wheel", JSON.stringify({ before, angles, actions, lock, most, nActions, speed, state, after }));
  page.gpu.destroy();
}

/** What each key does, pressed one after the other. */
async function keys(live) {
  const page = await opened(live, { n: 8 }), { visit } = page, all = {};
  await page.stepBy(4);
  const press = async (key, type = "keydown", target = document.body) => {
    target.dispatchEvent(new KeyboardEvent(type, { key, bubbles: true }));
    // What a key asks for is done between two frames.
    await page.between(() => {});
  };
  await press(" ");
  all.plays = page.playing;
  await press(" ");
  all.playsAgain = page.playing;
  await press("n");
  await press("n");
  all.followed = visit.focus.followed;
  await press("t");
  page.play(false);
  all.driving = visit.driving.isOn;
  await press("a");
  visit.update(0.5);
  all.left = visit.driving.steering;
  await press("a", "keyup");
  await press("d");
  visit.update(1);
  all.right = visit.driving.steering;
  await press("d", "keyup");
  // The load's slider has been used.
  await press("a", "keydown", byId("load"));
  await press("ArrowRight", "keydown", byId("load"));
  all.held = [...visit.driving.held];
  await press("a", "keyup");
  await press("s");
  const before = visit.driving.speed;
  visit.update(0.5);
  all.slower = before - visit.driving.speed;
  await press("s", "keyup");
  await press("Escape");
  all.drivingAfter = visit.driving.isOn;
  await press("Escape");
  all.focusAfter = visit.focus;
  await press("c");
  all.colouring = page.colouring;
  const { pixel } = page.stage.camera;
  await press("+");
  all.nearer = pixel / page.stage.camera.pixel;
  await press("?");
  all.help = byId("keys").open;
  await give("keys", JSON.stringify(all));
  page.gpu.destroy();
}

/** What fingers do on the picture. The touches are the browser's own; between them the page goes on. */
async function touch(live) {
  const page = await opened(live, { n: 8 }), { camera } = page.stage, [crowd] = page.crowds, all = {};
  // As many steps have been made whenever the page was paused.
  await page.between(() => crowd.batch.restart({ seed: 0 }));
  await page.stepBy(8);
  const { width, height } = byId("picture").getBoundingClientRect();
  const devtools = (method, params) => give("devtools", JSON.stringify({ method, params }));
  // What the picture hears of them, which comes some time after the browser has taken them.
  const HEARD = { touchStart: "pointerdown", touchEnd: "pointerup" };
  const fingers = async (type, points = []) => {
    const { left, top } = byId("picture").getBoundingClientRect();
    const touchPoints = points.map(([x, y], id) => ({ x: left + x, y: top + y, id }));
    const come = new Promise((next) => (type in HEARD
      ? byId("picture").addEventListener(HEARD[type], next, { once: true }) : requestAnimationFrame(next)));
    await devtools("Input.dispatchTouchEvent", { type, touchPoints });
    await come;
  };
  await devtools("Emulation.setTouchEmulationEnabled", { enabled: true, maxTouchPoints: 5 });
  const [x, y] = [Math.round(width / 2), Math.round(height / 2)];
  // One finger, up by 100 pixels: the page would scroll.
  const before = [...camera.centre], { pixel } = camera;
  await fingers("touchStart", [[x, y]]);
  for (let way = 10; way <= 100; way += 10) await fingers("touchMove", [[x, y - way]]);
  await fingers("touchEnd");
  all.moved = camera.centre.map((centre, axis) => (centre - before[axis]) / pixel);
  all.scrolled = document.scrollingElement.scrollTop;
  all.canScroll = document.scrollingElement.scrollHeight - document.scrollingElement.clientHeight;
  all.followedAfterDrag = crowd.followed;
  // Two fingers, apart from 80 to 240 pixels.
  await fingers("touchStart", [[x - 40, y]]);
  await fingers("touchStart", [[x - 40, y], [x + 40, y]]);
  for (let way = 50; way <= 120; way += 10) await fingers("touchMove", [[x - way, y], [x + way, y]]);
  await fingers("touchEnd");
  all.nearer = pixel / camera.pixel;
  all.pageZoom = window.visualViewport.scale;
  all.followedAfterPinch = crowd.followed;
  // A finger beside a truck, out of reach of a mouse.
  const bytes = new DataView(await crowd.batch.column("truck")), { size, fields } = live.facts.code.structs.Truck;
  const route = bytes.getUint32(3 * size + fields.route.at, true);
  const position = [0, 4].map((more) => bytes.getFloat32(3 * size + fields.position.at + more, true));
  page.lookAt(page.world.facts.routes[route].road, ...position, 400);
  await fingers("touchStart", [[x, y - 20]]);
  await fingers("touchEnd");
  await page.between(() => {});
  all.followed = crowd.followed;
  // With the wheel taken a finger steers, to its side.
  page.takeOver();
  page.play(false);
  const { truck } = crowd.row, side = truck.heading + Math.PI / 2;
  await fingers("touchStart", [[x + 50 * Math.cos(side), y - 50 * Math.sin(side)]]);
  page.visit.update(0.5);
  all.steering = page.visit.driving.steering;
  await fingers("touchEnd");
  await give("touch", JSON.stringify(all));
  page.gpu.destroy();
}

/** What the page says to each file, and by which policy and where trucks then drive. */
async function files(live, { names }) {
  const page = await opened(live, { n: 8 }), all = [];
  for (const name of names) {
    await page.dropFile(name, await asked(name));
    const [{ policy, world, batch }] = page.crowds;
    await page.stepBy(2);
    all.push({ name, ...said(), policy: policy?.name ?? null, roads: world.facts.roads.length, begun: batch.begun });
  }
  await give("files", JSON.stringify(all));
  page.gpu.destroy();
}

/** Facts and words of what the baker makes of what is asked. */
async function bytes(live, { asked }) {
  const page = await opened(live, { n: 8 }), none = new Uint8Array();
  const { facts, kinds } = await page.baker.baked(asked, none, new Promise(() => {}));
  const wordsOf = ([kind, all]) => [kind, [...new Uint32Array(all.slice().buffer)]];
  await give("bytes", JSON.stringify({ facts, words: Object.fromEntries(Object.entries(kinds).map(wordsOf)) }));
  page.gpu.destroy();
}

/** What the page says to names in its box, to files, and to another ring of a map; and where trucks then drive. */
async function roads(live, { visits }) {
  const page = await opened(live, { n: 8 }), all = [];
  await page.stepBy(2);
  const isDone = () => !byId("said").hidden && !byId("said").textContent.startsWith("Baking");
  for (const { road, file, ring, benchmark } of visits) {
    if (benchmark !== undefined) await page.attempt(() => page.choose({ world: benchmark }));
    byId("said").hidden = true;
    if (file !== undefined) await page.dropFile(file, await asked(file));
    else if (ring !== undefined) {
      byId("ring").value = ring;
      byId("ring").dispatchEvent(new Event("change"));
    } else {
      byId("any-road").value = road;
      byId("bake").click();
    }
    while (!isDone()) await new Promise((next) => setTimeout(next, 50));
    await page.stepBy(2);
    const [{ policy, world, batch }] = page.crowds, [chosen] = byId("benchmark").selectedOptions;
    all.push({ ...said(), benchmark: chosen.textContent, policy: policy?.name ?? null, begun: batch.begun,
      bounds: world.facts.roads[0].bounds, listed: byId("benchmark").length, rings: byId("ring").checkVisibility() ? byId("ring").length : 0 });
  }
  await give("roads", JSON.stringify(all));
  page.gpu.destroy();
}

/** Whether roads can be typed, and whether the page says why not. */
async function unbaked(live) {
  const page = await opened(live, { n: 8 });
  const shown = { box: byId("any-road").checkVisibility(), note: byId("no-baker").checkVisibility() };
  await give("unbaked", JSON.stringify(shown));
  page.gpu.destroy();
}

/** How many trucks the page begins with on this device, and on one that calls itself a card. */
async function counts(live) {
  const begins = async () => {
    const page = await opened(live, {}), { n } = page.crowds[0].batch;
    page.gpu.destroy();
    return { n, heading: byId("heading").textContent };
  };
  const software = await begins();
  const info = { vendor: "nvidia", architecture: "hopper", description: "", isFallbackAdapter: false };
  Object.defineProperty(GPUAdapter.prototype, "info", { configurable: true, get: () => info });
  await give("counts", JSON.stringify({ software, card: await begins() }));
}

/** A failure of random actions, driven again. */
async function again(live) {
  const page = await opened(live, { n: 8, policy: -1 }), [crowd] = page.crowds;
  // One of a later episode than a truck's first; where there are loads, of one that the visitor chose.
  let isLater = ({ episode }) => 0 < episode;
  if (1 < page.world.facts.classes.length) {
    await page.stepBy(4);
    await page.pickTruck(1);
    const { own, at } = page.visit.loads(), { episode } = crowd.row.truck;
    await page.between(() => page.visit.setLoad((at + 1) % own.length));
    await page.between(() => page.visit.leave());
    isLater = (failure) => failure.env === 1 && failure.episode === episode;
  }
  while (!crowd.failures.some(isLater)) await page.stepBy(10);
  const failure = crowd.failures.find(isLater);
  await page.between(() => page.visit.driveAgain(crowd, failure));
  page.play(false);
  while (page.visit.again.row.ended === 0) await page.stepBy(1);
  const { truck: { steps, position } } = page.visit.again.row, state = byId("truck-state").textContent;
  await give("again", JSON.stringify({ state, failure, steps, position }));
  page.gpu.destroy();
}

/** A device that is lost, and the page that begins again. */
async function lost(live) {
  let lose;
  const losing = new Promise((done) => (lose = () => done({ reason: "unknown", message: "told by the test" })));
  Object.defineProperty(GPUDevice.prototype, "lost", { configurable: true, get: () => losing });
  const page = await opened(live, { n: 8 });
  const before = missing();
  lose();
  await new Promise((next) => setTimeout(next, 100));
  const during = missing();
  Object.defineProperty(GPUDevice.prototype, "lost", { configurable: true, get: () => new Promise(() => {}) });
  await page.start();
  await page.stepBy(2);
  await give("lost", JSON.stringify({ before, during, after: missing(), steps: page.crowds[0].batch.steps }));
}

/** A browser without WebGPU, or without an adapter. */
async function without(live, { hasApi }) {
  if (!hasApi) Object.defineProperty(navigator, "gpu", { configurable: true, value: undefined });
  await new App(live).start();
  await give("without", JSON.stringify(missing()));
}

const VISITS = {
  pixels, colouring, among, hand, wheel, keys, touch, files, bytes, roads, unbaked, counts, again, lost, without,
  starts, address,
};

try {
  const plan = JSON.parse(new TextDecoder().decode(await asked("plan")));
  const live = await readLive();
  await VISITS[plan.visit](live, plan);
  await give("done", "");
} catch (error) {
  await give("failed", `${error.stack}`);
}
