// Opened with #selftest the page checks itself and writes the result into the document, for a test that reads the
// document.

/** Each check throws when it does not hold. */
const CHECKS = {
  "every episode is there with the end that the report counts": ({ page }) => {
    const { evaluation, episodes, ground } = page;
    same(episodes.length, evaluation.episodes);
    for (const [name, count] of Object.entries(evaluation.ends)) same(episodes.filter((episode) => episode.ended === name).length, count, name);
    for (const route of evaluation.routes) {
      const own = episodes.filter((episode) => ground.routes[episode.route].name === route.name);
      same(own.length, route.episodes, route.name);
      same(own.filter((episode) => !episode.failed).length, route.arrived, route.name);
    }
  },
  "the recorded frames give the report's figures": ({ page }) => {
    const { evaluation, episodes, columns, ground } = page;
    const frames = (episode, name) => columns[name].subarray(episode.first + 1, episode.first + episode.n_frames);
    const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
    // Lengths are kept to 1 cm, ratios to 0.01 and angles to 1e-4 rad.
    close(mean(episodes.map((episode) => mean(frames(episode, "lane_distance")))), evaluation.lane_distance_mean, 0.006, "distance to the lane centre");
    close(mean(episodes.map((episode) => episode.seconds)), evaluation.time_mean, 1e-6, "time");
    const peak = (name) => Math.max(...episodes.map((episode) => frames(episode, name).reduce((most, value) => Math.max(most, Math.abs(value)), 0)));
    close(Math.max(peak("tractor_load_transfer"), peak("trailer_load_transfer")), evaluation.load_transfer_ratio_peak, 0.006, "load transfer ratio");
    const articulation = Math.max(...episodes.map((episode) =>
      Math.max(...Array.from({ length: episode.n_frames }, (_, frame) => Math.abs(toDegrees(instant(page, episode, frame).articulation))))));
    close(articulation, evaluation.articulation_peak_deg, 0.02, "articulation");
    const ranges = Array.from({ length: ground.n_rays }, (_, ray) => columns["range_" + ray].reduce((most, value) => Math.max(most, value), 0));
    // A range is kept to 1/255 of the sensors' reach.
    holds(ranges.every((range) => 0 < range && range <= ground.vehicle.sensor_range * 1.002), "ranges within reach");
  },
  "every route has its row and every figure its chart": ({ page }) => {
    same(document.querySelectorAll("#route-table tr.route").length, page.evaluation.routes.length);
    holds(document.querySelectorAll("#route-table tr.route svg").length === 5 * page.evaluation.routes.length, "5 charts a route");
    holds(byId("verdict").textContent.includes(percent(page.evaluation.success)), "headline");
    same(document.querySelectorAll("#figures thead th").length, comparable(page.evaluation) ? 2 : 1, "columns of the figures");
    same(document.querySelectorAll("#figures tbody td").length, (comparable(page.evaluation) ? 2 : 1) * document.querySelectorAll("#figures tbody tr").length, "cells");
    same(byId("study").hidden, !comparable(page.evaluation), "study hidden");
    const curves = [...document.querySelectorAll("#curves .curve")];
    same(byId("training").hidden, page.metrics === null, "training section hidden");
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
    replay.onFrame = (callback) => setTimeout(callback, 16);
    replay.seek(0);
    const start = drawn();
    key(" ");
    holds(replay.playing, "space plays");
    for (let waited = 0; waited < 200 && replay.frame < 2; waited++) await new Promise((done) => setTimeout(done, 20));
    holds(2 <= replay.frame, `the replay advances: frame ${replay.frame}`);
    key(" ");
    holds(!replay.playing, "space pauses");
    holds(drawn() !== start, "another frame is another picture");
    const before = Math.round(replay.frame);
    key("ArrowRight");
    same(replay.frame, before + 1, "one frame on");
    byId("rays").click();
    const without = drawn();
    byId("rays").click();
    holds(drawn() !== without, "sensors are drawn");
    byId("scrub").value = replay.episode.n_frames - 1;
    byId("scrub").dispatchEvent(new Event("input"));
    same(replay.frame, replay.episode.n_frames - 1, "the last frame");
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
