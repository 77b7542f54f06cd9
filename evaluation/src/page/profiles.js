// Speed and load transfer along the path, by load: where trucks slowed down, and what it left them.
//
// A truck is as far along a route as the nearest point of the lane's centre to its drive axle. Distances count from
// where the route leaves its entry arm, so that routes can be laid over each other.

/** How far ahead on its route a truck is looked for from one frame to the next [m]. */
const AHEAD = 12;

/** A route's lane centre, the distance of each of its points from the first [m], the name of what lies between the arms,
    and where that begins and ends [m]. */
function lineOfRoute({ ground }, route) {
  const points = pointsOf(ground.routes[route].centre_line), lengths = [0];
  for (let index = 1; index < points.length; index++)
    lengths.push(lengths[index - 1] + Math.hypot(points[index][0] - points[index - 1][0], points[index][1] - points[index - 1][1]));
  const between = ground.maps[ground.routes[route].roundabout].between_arms;
  return { points, lengths, between, ring: [ground.approach, lengths.at(-1) - ground.departure] };
}

/** The distance along a route of each frame of an episode, which may begin anywhere and does not go back [m]. */
function stations({ columns }, episode, { points, lengths }) {
  let segment = 0, station = -Infinity;
  return Array.from({ length: episode.n_frames }, (_, frame) => {
    const x = columns.x[episode.first + frame], y = columns.y[episode.first + frame];
    let best = Infinity, found = station, on = segment;
    for (let index = segment; index + 1 < points.length && (frame === 0 || lengths[index] <= Math.max(station, 0) + AHEAD); index++) {
      const [ax, ay] = points[index], length = lengths[index + 1] - lengths[index];
      if (!(0 < length)) continue;
      const [ux, uy] = [(points[index + 1][0] - ax) / length, (points[index + 1][1] - ay) / length];
      // Before its beginning and after its end the route goes straight on.
      const from = index === 0 ? -Infinity : 0, to = index + 2 === points.length ? Infinity : length;
      const along = Math.min(Math.max((x - ax) * ux + (y - ay) * uy, from), to);
      const distance = Math.hypot(x - ax - along * ux, y - ay - along * uy);
      if (distance < best) [best, found, on] = [distance, lengths[index] + along, index];
    }
    [station, segment] = [Math.max(station, found), on];
    return station;
  });
}

/** Speed [km/h] and the larger load transfer ratio of an episode at each whole metre from the ring on, from metre `from`. */
function profileOf(page, episode, line) {
  const { columns } = page, at = stations(page, episode, line).map((station) => station - line.ring[0]);
  const speed = (frame) => 3.6 * columns.speed[episode.first + frame];
  const transfer = (frame) => Math.max(...["tractor", "trailer"].map((unit) => Math.abs(columns[`${unit}_load_transfer`][episode.first + frame])));
  const from = Math.ceil(at[0]), speeds = [], transfers = [];
  for (let metre = from, frame = 1; metre <= at.at(-1); metre++) {
    while (at[frame] < metre) frame++;
    const part = (metre - at[frame - 1]) / (at[frame] - at[frame - 1] || 1);
    speeds.push(speed(frame - 1) + part * (speed(frame) - speed(frame - 1)));
    transfers.push(transfer(frame - 1) + part * (transfer(frame) - transfer(frame - 1)));
  }
  return { from, speeds, transfers };
}

/** The value that a fraction of the values is at most: the nearest rank, as in the report. */
function quantile(values, fraction) {
  const sorted = values.toSorted((a, b) => a - b);
  return sorted[Math.min(Math.max(Math.ceil(fraction * sorted.length), 1), sorted.length) - 1];
}

/** A quantile of these profiles at each metre that at least half of them reach, as points of a line. */
function quantileLine(profiles, key, fraction) {
  if (profiles.length === 0) return [];
  const from = Math.min(...profiles.map((profile) => profile.from)), to = Math.max(...profiles.map((profile) => profile.from + profile[key].length));
  const points = [];
  for (let metre = from; metre < to; metre++) {
    const values = profiles.map((profile) => profile[key][metre - profile.from]).filter((value) => value !== undefined);
    if (profiles.length <= 2 * values.length) points.push([metre, quantile(values, fraction)]);
  }
  return points;
}

/** Of each load the name, the colour, the number of episodes and the lines. `route` null means all routes. */
function loadLines(page, profiles, route) {
  const arrived = page.episodes.filter((episode) => !episode.failed && (route === null || episode.route === route));
  return loadsOf(page).map((load) => {
    const own = arrived.filter((episode) => loadOf(page, episode) === load).map(profiles), colour = loadColour(page, load);
    const line = (key, fraction, dashed = false) => ({ points: quantileLine(own, key, fraction), colour, dashed });
    return { load, colour, count: own.length, speed: line("speeds", 0.5), transfer: line("transfers", 0.5), high: line("transfers", 0.9, true) };
  });
}

/** Fills the charts, and fills them again for each route that the replay opens. */
function showProfiles(page, replay) {
  const lines = page.ground.routes.map((_, route) => lineOfRoute(page, route)), known = new Map();
  const profiles = (episode) => {
    if (!known.has(episode)) known.set(episode, profileOf(page, episode, lines[episode.route]));
    return known.get(episode);
  };
  const figures = [chartFigure("Speed, median [km/h]", "", "Median speed over the distance along the route, a line for each load"),
    chartFigure("LTR, median, and 90\u202f% dashed", "", "Load transfer ratio over the distance along the route, two lines for each load")];
  byId("profiles").replaceChildren(...figures);
  let all = false, loads = [];
  const draw = () => {
    const [xs, speeds] = [0, 1].map((axis) => loads.flatMap(({ speed }) => speed.points.map((point) => point[axis])));
    const across = { from: Math.min(0, ...xs), to: Math.max(1, ...xs), tick: (value) => decimal(value, 0), label: "m from the end of the entry arm" };
    const { ring: [begin, end], between } = lines[replay.episode.route];
    const bands = [all ? { from: 0, to: 0, words: "entry" } : { from: 0, to: end - begin, words: between }];
    // Whole steps of 5 km/h, so that a route's chart has numbers.
    const range = speeds.length === 0 ? undefined : [5 * Math.floor(Math.min(...speeds) / 5), 5 * Math.ceil(Math.max(...speeds) / 5)];
    const most = Math.max(1, ...loads.flatMap(({ high }) => high.points.map(([, y]) => y)));
    drawChart(figures[0], { across, bands, up: { tick: (value) => decimal(value, 0), range }, lines: loads.map(({ speed }) => speed) });
    drawChart(figures[1], { across, bands, up: { tick: (value) => decimal(value, 1), range: [0, most] }, lines: loads.flatMap(({ transfer, high }) => [transfer, high]) });
  };
  const fill = () => {
    loads = loadLines(page, profiles, all ? null : replay.episode.route);
    const name = page.ground.routes[replay.episode.route].name, n = loads.reduce((sum, { count }) => sum + count, 0);
    byId("profiles-note").textContent = all
      ? `${whole(n)} ${n === 1 ? "episode" : "episodes"} that arrived, on the ${whole(page.ground.routes.length)} routes of the replay.`
      : `${whole(n)} ${n === 1 ? "episode" : "episodes"} that arrived on ${name}, the route open in the replay.`;
    byId("profiles-legend").replaceChildren(...loads.map(({ load, colour, count }) =>
      html("li", {}, html("i", { class: "thin", style: `--swatch: ${colour}` }), `${load}: ${whole(count)} ${count === 1 ? "episode" : "episodes"}`)));
    draw();
  };
  const at = ({ points }, metre) => points.find(([x]) => x === metre)?.[1];
  sharePointer(figures, Math.round, (index, metre) => `${decimal(metre, 0)} m: ${loads.map(({ load, speed, transfer }) => {
    const value = at(index === 0 ? speed : transfer, metre);
    return value === undefined ? null : `${load} ${decimal(value, index === 0 ? 1 : 2)}`;
  }).filter((words) => words !== null).join(", ")}`);
  for (const [id, every] of [["profiles-route", false], ["profiles-all", true]]) {
    byId(id).addEventListener("click", (event) => { all = every; press(event.currentTarget.parentElement, event.currentTarget); fill(); });
  }
  replay.onRoute = () => { if (!all) fill(); };
  new ResizeObserver(draw).observe(byId("profiles"));
  fill();
}
