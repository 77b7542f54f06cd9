// Opened with #selftest the page checks itself and writes the result into the document, for a test that reads the
// document.

/** Each check throws when it does not hold. */
const CHECKS = {
  "every episode is there with the end that the report counts, or every failed one and a sample of the others": ({ page }) => {
    const { evaluation, episodes, ground, shown } = page, all = episodes.length === evaluation.episodes;
    same(byId("shown").hidden, all, "a line about episodes left out");
    if (all) for (const [name, count] of Object.entries(evaluation.ends)) same(episodes.filter((episode) => episode.ended === name).length, count, name);
    holds(0 < shown.arrived || evaluation.arrived === 0, "some that arrived");
    holds(byId("shown").textContent.startsWith(`${whole(episodes.length)} of ${whole(evaluation.episodes)} episodes`), "their number");
    for (const route of evaluation.routes) {
      const own = shownOn(page, route);
      const failed = own.filter((episode) => episode.failed).length, ofFailed = route.episodes - route.arrived;
      holds(failed <= ofFailed && own.length - failed <= route.arrived, route.name);
      if (all) same(own.length, route.episodes, route.name);
      if (shown.failed === shown.ofFailed) same(failed, ofFailed, route.name);
      if (own.length === route.episodes) for (const [name, count] of Object.entries(route.ends)) same(own.filter((episode) => episode.ended === name).length, count, route.name);
    }
    same(new Set(ground.routes.map((route) => route.name)).size, ground.routes.length, "routes of the replay");
  },
  "the recorded frames give the report's figures": ({ page }) => {
    const { evaluation, episodes, ground, columns } = page;
    if (episodes.length === evaluation.episodes) sameFigures(page, episodes, evaluation);
    for (const route of evaluation.routes) {
      const own = shownOn(page, route);
      if (0 < own.length && own.length === route.episodes) sameFigures(page, own, route, `${route.name}: `);
    }
    const ranges = Array.from({ length: ground.n_rays }, (_, ray) => columns["range_" + ray].reduce((most, value) => Math.max(most, value), 0));
    // A range is kept to 1/255 of the sensors' reach.
    holds(ranges.every((range) => 0 < range && range <= ground.vehicles[0].sensor_range * 1.002), "ranges within reach");
  },
  "groups hold every episode once, and a roundabout shows its routes": ({ page }) => {
    const { evaluation, ground } = page, many = ground.route_reports !== undefined;
    for (const id of ["groups", "routes-choice"]) same(byId(id).hidden, !many, id);
    const kinds = KINDS.map(([kind]) => kind).filter((kind) => evaluation.groups[kind] !== undefined);
    for (const kind of kinds) {
      const sum = (value) => evaluation.groups[kind].reduce((total, group) => total + value(group), 0);
      same(sum((group) => group.episodes), evaluation.episodes, kind);
      same(sum((group) => group.arrived), evaluation.arrived, kind);
      // Episodes of one route have several demands.
      if (kind !== "demand") same(sum((group) => group.routes), evaluation.routes.length, kind);
      close(sum((group) => group.episodes * group.lane_distance_mean) / evaluation.episodes, evaluation.lane_distance_mean, 1e-6, kind);
    }
    if (!many) return;
    const rows = document.querySelectorAll("#group-table tr.member").length;
    const worst = evaluation.groups.roundabout.filter((group) => 0 < failures(group)).length;
    same(rows, kinds.slice(0, -1).reduce((total, kind) => total + evaluation.groups[kind].length, 0) + Math.min(worst, MOST_ROUNDABOUTS), "rows of groups");
    const select = byId("roundabout"), listed = () => document.querySelectorAll("#route-table tr.route").length;
    same(select.options.length, evaluation.groups.roundabout.length + 1, "roundabouts to choose from");
    for (const group of [evaluation.groups.roundabout[0], evaluation.groups.roundabout.at(-1)]) {
      select.value = group.name;
      select.dispatchEvent(new Event("change"));
      same(listed(), group.routes, group.name);
    }
    select.value = "";
    select.dispatchEvent(new Event("change"));
    same(listed(), Math.min(evaluation.routes.filter((route) => 0 < failures(route)).length, MOST_ROUTES), "worst routes");
  },
  "every route has its row and every figure its chart": ({ page }) => {
    const rows = document.querySelectorAll("#route-table tr.route").length;
    if (page.ground.route_reports === undefined) same(rows, page.evaluation.routes.length);
    same(document.querySelectorAll("#route-table tr.route svg").length, 5 * rows, "5 charts a route");
    holds(byId("verdict").textContent.includes(percent(page.evaluation.success)), "headline");
    for (const other of page.report.also ?? []) holds(byId("figures").textContent.includes(`${other.benchmark}, ${other.split} routes`), "further evaluations");
    same(document.querySelectorAll("#figures thead th").length, comparable(page.evaluation) ? 2 : 1, "columns of the figures");
    same(document.querySelectorAll("#figures tbody td").length, (comparable(page.evaluation) ? 2 : 1) * document.querySelectorAll("#figures tbody tr").length, "cells");
    same(byId("study").hidden, !comparable(page.evaluation), "study hidden");
    const curves = [...document.querySelectorAll("#curves .curve")];
    const worst = page.report.training_routes?.worst?.length ?? 0;
    same(byId("training").hidden, page.metrics === null && worst === 0, "training section hidden");
    same(document.querySelectorAll("#training-route-table tbody tr").length, worst, "training routes");
    if (page.metrics !== null) {
      same(curves.length, curvesOf(page.report, page.metrics).length, "curves");
      byId("by-minutes").click();
      byId("by-steps").click();
      holds([...document.querySelectorAll("#curves .curve")].every((curve) => !curve.getAttribute("d").includes("NaN")), "curves without gaps");
    }
  },
  "the replay runs, stops and steps": async ({ replay }) => {
    const drawn = () => Array.from(replay.canvas.getContext("2d").getImageData(0, 0, replay.canvas.width, replay.canvas.height).data).reduce((sum, value, index) => (sum * 31 + value * (index % 251)) >>> 0, 7);
    const key = (name) => replay.canvas.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true }));
    // A browser without a screen may never ask for a picture: a timer stands in.
    replay.clock.onFrame = (callback) => setTimeout(callback, 16);
    replay.clock.seek(0);
    const start = drawn();
    key(" ");
    holds(replay.clock.playing, "space plays");
    for (let waited = 0; waited < 200 && replay.clock.frame < 2; waited++) await new Promise((done) => setTimeout(done, 20));
    holds(2 <= replay.clock.frame, `the replay advances: frame ${replay.clock.frame}`);
    key(" ");
    holds(!replay.clock.playing, "space pauses");
    holds(drawn() !== start, "another frame is another picture");
    const before = Math.round(replay.clock.frame);
    key("ArrowRight");
    same(replay.clock.frame, before + 1, "one frame on");
    byId("rays").click();
    const without = drawn();
    byId("rays").click();
    holds(drawn() !== without, "sensors are drawn");
    byId("scrub").value = replay.episode.n_frames - 1;
    byId("scrub").dispatchEvent(new Event("input"));
    same(replay.clock.frame, replay.episode.n_frames - 1, "the last frame");
  },
  "the replay shows the truck that was driven": ({ page, replay }) => {
    const { ground, episodes } = page, used = new Set(episodes.map((episode) => episode.rig));
    same(used.size, ground.vehicles.length, "vehicles, each of a shown episode");
    same(new Set(episodes.map(truckOf)).size, ground.classes?.length ?? 1, "vehicles and loads");
    for (const rig of used) {
      const episode = episodes.find((episode) => episode.rig === rig);
      same(sceneOf(page, episode).rig, rig, "the drawn truck");
      // A range is kept to 4 cm; the rays of a truck with other dimensions end beside the kerbs.
      const far = Math.max(...[0, 0.5, 0.8].map((part) => beyondKerbs(page, episode, Math.round(part * (episode.n_frames - 1)))));
      holds(far < 0.2, `rays of episode ${episode.number} end ${decimal(far, 2)} m beside the kerbs, less than 0.2 m`);
    }
    const shown = replay.episode;
    same(byId("truck").hidden, ground.classes === undefined, "a line with vehicle and load");
    same(byId("truck").textContent, truckOf(shown), "vehicle and load");
  },
  "vehicles and loads hold every episode once, with the figures of the frames": ({ page }) => {
    const { evaluation, episodes } = page, { classes = [] } = evaluation;
    same(byId("classes").hidden, classes.length === 0, "section hidden");
    if (classes.length === 0) return;
    same(document.querySelectorAll("#class-table tr.class").length, classes.length, "rows");
    for (const key of ["episodes", "arrived"]) same(classes.reduce((sum, one) => sum + one[key], 0), evaluation[key], key);
    if (episodes.length < evaluation.episodes) return;
    for (const one of classes) {
      const name = `${one.vehicle} ${one.load}`;
      const own = episodes.filter((episode) => (episode.vehicle ?? "") === one.vehicle && loadOf(page, episode) === one.load);
      same(own.length, one.episodes, name);
      same(own.filter((episode) => episode.ended === "rolled_over").length, one.rolled_over, `${name}: rolled over`);
      const peaks = own.map((episode) => Math.max(...framesOf(page, episode, "tractor_load_transfer").map(Math.abs), ...framesOf(page, episode, "trailer_load_transfer").map(Math.abs)));
      for (const [key, fraction] of [["p50", 0.5], ["p90", 0.9], ["p99", 0.99]]) close(quantile(peaks, fraction), one[`load_transfer_ratio_${key}`], 0.006, `${name}: load transfer ratio`);
      const speeds = own.flatMap((episode) => [...framesOf(page, episode, "speed")]);
      close((3.6 * speeds.reduce((sum, speed) => sum + speed, 0)) / speeds.length, one.speed_mean_kmh, 0.02, `${name}: speed`);
    }
  },
  "charts along the path have a line for each load and follow the replay": ({ page, replay }) => {
    if (page.evaluation.classes === undefined) return;
    const loads = loadsOf(page), count = () => Number(byId("profiles-note").textContent.match(/^[\d,]+/)[0].replace(",", ""));
    for (const route of new Set([page.episodes[0].route, page.episodes.at(-1).route])) {
      replay.openRoute(route);
      same(document.querySelectorAll("#profiles .curve").length, 3 * loads.length, "lines");
      same(count(), page.episodes.filter((episode) => !episode.failed && episode.route === route).length, "episodes of the route");
      holds([...document.querySelectorAll("#profiles .curve")].every((curve) => !curve.getAttribute("d").includes("NaN")), "lines without gaps");
    }
    byId("profiles-all").click();
    same(count(), page.shown.arrived, "episodes of all routes");
    byId("profiles-route").click();
    for (const episode of page.episodes.filter((episode) => !episode.failed).slice(0, 20)) {
      const { lengths, ring, ...line } = lineOfRoute(page, episode.route), { from, speeds } = profileOf(page, episode, { lengths, ring, ...line });
      // It passes the last waypoint and ends there; where it drives beside the lane's centre its way has another
      // length.
      close(from + ring[0] + speeds.length, lengths.at(-1), 6, `episode ${episode.number}: end of the route`);
      const time = speeds.reduce((sum, speed) => sum + 3.6 / speed, 0), slowest = 3.6 * Math.min(...framesOf(page, episode, "speed"));
      // Where it all but stands, whole metres do not tell for how long.
      if (slowest < 5) holds(time < 1.1 * episode.seconds, `episode ${episode.number}: time along the route`);
      else close(time, episode.seconds, 0.1 * episode.seconds, `episode ${episode.number}: time along the route`);
    }
  },
  "the interval over routes stands beside Wilson's where routes differ": ({ page }) => {
    const { evaluation } = page, words = overRoutes(evaluation);
    const differ = new Set(evaluation.routes.map(({ success }) => success)).size !== 1;
    same(words !== "", differ, "an interval over routes");
    holds(byId("verdict").textContent.endsWith(`${interval(evaluation.success_low, evaluation.success_high)}${words}`), "in the headline");
    holds(!differ || words.includes(percent(evaluation.success_high_over_routes)), words);
  },
  "failed episodes are listed first": ({ page, replay }) => {
    for (const route of page.ground.routes.keys()) {
      if (!page.episodes.some((episode) => episode.route === route)) continue;
      replay.openRoute(route);
      const failed = replay.listed.map((episode) => episode.failed);
      holds(failed.every((value, index) => index === 0 || !value || failed[index - 1]), page.ground.routes[route].name);
      same(byId("episodes").children.length, replay.listed.length);
    }
  },
};

/** How far the rays of a frame that meet a kerb end from the nearest one, the farthest of them [m]. */
function beyondKerbs(page, episode, frame) {
  const { ground } = page, { rig } = episode, now = instant(page, episode, frame);
  const kerbs = ground.maps[ground.routes[episode.route].roundabout].drivable.map(pointsOf);
  const units = [[rig.trailer_rays, now.trailerX, now.trailerY, now.trailerHeading], [rig.tractor_rays, now.x, now.y, now.heading]];
  const rays = units.flatMap(([rays, ...pose]) => rays.map((ray) => [ray, ...pose]));
  return Math.max(0, ...rays.map(([[ox, oy, dx, dy], x, y, heading], index) => {
    const range = now.ranges[index], [ahead, left] = [ox + range * dx, oy + range * dy];
    const end = [x + ahead * Math.cos(heading) - left * Math.sin(heading), y + ahead * Math.sin(heading) + left * Math.cos(heading)];
    return range < 0.99 * rig.sensor_range ? Math.min(...kerbs.map((kerb) => toLoop(end, kerb))) : 0;
  }));
}

/** The distance from a point to a closed line. */
function toLoop([x, y], points) {
  return Math.min(...points.map(([ax, ay], index) => {
    const [bx, by] = points[(index + 1) % points.length], [ex, ey] = [bx - ax, by - ay];
    const part = Math.min(Math.max(((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey || 1), 0), 1);
    return Math.hypot(x - ax - part * ex, y - ay - part * ey);
  }));
}

/** The episodes of a route that are shown. */
const shownOn = ({ episodes, ground }, route) => {
  const index = ground.routes.findIndex(({ name }) => name === route.name);
  return episodes.filter((episode) => episode.route === index);
};

/** The values of a column after each step of an episode. */
const framesOf = ({ columns }, episode, name) => columns[name].subarray(episode.first + 1, episode.first + episode.n_frames);

/** Throws where the frames of all of a summary's episodes give other figures. */
function sameFigures(page, episodes, summary, of = "") {
  const frames = (episode, name) => framesOf(page, episode, name);
  const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
  // Lengths are kept to 1 cm, ratios to 0.01 and angles to 1e-4 rad.
  close(mean(episodes.map((episode) => mean(frames(episode, "lane_distance")))), summary.lane_distance_mean, 0.006, of + "distance to the lane centre");
  close(mean(episodes.map((episode) => episode.seconds)), summary.time_mean, 1e-4, of + "time");
  const peak = (name) => Math.max(...episodes.map((episode) => frames(episode, name).reduce((most, value) => Math.max(most, Math.abs(value)), 0)));
  close(Math.max(peak("tractor_load_transfer"), peak("trailer_load_transfer")), summary.load_transfer_ratio_peak, 0.006, of + "load transfer ratio");
  const articulation = Math.max(...episodes.map((episode) =>
    Math.max(...Array.from({ length: episode.n_frames }, (_, frame) => Math.abs(toDegrees(instant(page, episode, frame).articulation))))));
  close(articulation, summary.articulation_peak_deg, 0.02, of + "articulation");
}

function holds(truth, what) {
  if (!truth) throw new Error(`${what}: does not hold`);
}
function same(found, expected, what = "") {
  if (found !== expected) throw new Error(`${what}: ${found}, expected ${expected}`);
}
function close(found, expected, tolerance, what) {
  if (!(Math.abs(found - expected) <= tolerance)) throw new Error(`${what}: ${found}, expected ${expected}`);
}

/** Runs every check and writes a line for each. */
async function selftest(parts) {
  const lines = [];
  for (const [name, check] of Object.entries(CHECKS)) {
    try {
      await check(parts);
      lines.push(`holds: ${name}`);
    } catch (error) {
      lines.push(`fails: ${name}: ${error.message}`);
    }
  }
  lines.push(...troubles.map((trouble) => `fails: no error elsewhere: ${trouble}`));
  const outcome = lines.some((line) => line.startsWith("fails")) ? "failed" : "passed";
  document.body.append(html("pre", { id: "selftest" }, `selftest ${outcome}\n${lines.join("\n")}`));
}
