// The data blocks of the page: the report, the roundabouts, the training figures and the recorded episodes.
//
// Episodes lie column by column: for each column and episode the difference to the frame before, as zigzag varint, all
// of it gzipped.

/** Rows of a CSV file as one array of numbers a column; a cell without a number is NaN. Null without a file or rows. */
function columnsOf(csv) {
  if (csv === null) return null;
  const lines = csv.split("\n").filter((line) => line.trim() !== "");
  if (lines.length < 2) return null;
  const rows = lines.slice(1).map((line) => line.split(","));
  const number = (cell) => (cell === undefined || cell.trim() === "" ? NaN : Number(cell));
  const columns = {};
  // Columns are found by name; a file with more or fewer of them is fine, a last row cut short is not.
  const names = lines[0].split(",");
  const complete = rows.filter((row) => row.length === names.length);
  names.forEach((name, index) => { columns[name.trim()] = complete.map((row) => number(row[index])); });
  return complete.length === 0 ? null : columns;
}

/** One array of numbers a column, all episodes one after the other, `columns` as [name, unit of the integers]. */
function decoded(bytes, columns, lengths) {
  const total = lengths.reduce((sum, length) => sum + length, 0);
  const found = {};
  let at = 0, index = 0;
  for (const [name, unit] of columns) {
    const values = (found[name] = new Float32Array(total));
    index = 0;
    for (const length of lengths) {
      let value = 0;
      for (const end = index + length; index < end; index++) {
        let word = 0, shift = 0, byte;
        do {
          byte = bytes[at++];
          word |= (byte & 0x7f) << shift;
          shift += 7;
        } while (byte & 0x80);
        value += (word >>> 1) ^ -(word & 1);
        values[index] = value * unit;
      }
    }
  }
  if (at !== bytes.length) throw new Error(`the recorded episodes hold ${bytes.length} bytes ${at} were expected`);
  return found;
}

/** Other vehicles of an episode: of each slot the values of the frames that are kept; null where there are none. */
function othersOf(page, episode) {
  const { ground, others } = page;
  if (others === null) return null;
  const { every, n_slots: nSlots, values } = ground.others, [from, to] = others.ends[episode.index];
  const n = Math.ceil((episode.n_frames - 1) / every) + 1;
  const columns = Array.from({ length: nSlots }, (_, slot) => values.map(([name, unit]) => [`${name}_${slot}`, unit])).flat();
  return { every, nSlots, n, last: episode.n_frames - 1, found: decoded(others.bytes.subarray(from, to), columns, [n]) };
}

/** The vehicles of a frame: between two that are kept they are interpolated, unless one of them lacks the vehicle. */
function othersAt(of, frame) {
  if (of === null) return [];
  const { every, nSlots, n, last, found } = of;
  const lower = Math.min(Math.floor(frame / every), n - 1), upper = Math.min(lower + 1, n - 1);
  const span = Math.min(upper * every, last) - lower * every, part = span <= 0 ? 0 : Math.min((frame - lower * every) / span, 1);
  const size = (look) => look >> 2;
  const vehicle = (slot) => {
    const [x, y, heading, looks] = ["x", "y", "heading", "look"].map((name) => found[`${name}_${slot}`]);
    const stays = size(looks[lower]) === size(looks[upper]) && Math.hypot(x[upper] - x[lower], y[upper] - y[lower]) < 8;
    const at = stays || part < 0.5 ? lower : upper, by = stays ? part : 0, next = stays ? upper : at;
    const look = looks[part < 0.5 ? lower : upper];
    return {
      x: x[at] + by * (x[next] - x[at]), y: y[at] + by * (y[next] - y[at]), heading: heading[at] + by * wrapped(heading[next] - heading[at]),
      length: (looks[at] >> 8) / 10, width: ((looks[at] >> 2) & 63) / 10, brakes: (look & 1) === 1, rude: (look & 2) === 2,
    };
  };
  return Array.from({ length: nSlots }, (_, slot) => vehicle(slot)).filter(({ length }) => 0 < length);
}

/** The points of a line that is written as a point and differences, in centimetres [m]. */
function pointsOf(line) {
  const points = [];
  for (let index = 0, x = 0, y = 0; index < line.length; index += 2) {
    x += line[index];
    y += line[index + 1];
    points.push([x / 100, y / 100]);
  }
  return points;
}

/** How many episodes of how many are shown. */
function shownOf(evaluation, episodes) {
  const failed = episodes.filter((episode) => episode.failed).length;
  return { failed, ofFailed: evaluation.episodes - evaluation.arrived, arrived: episodes.length - failed, ofArrived: evaluation.arrived };
}

/** The roundabouts, and the recorded episodes with their columns. */
async function readEpisodes() {
  const ground = JSON.parse(new TextDecoder().decode(await inflated(block("ground"))));
  const bytes = await inflated(block("tracks")), lengths = ground.others?.bytes ?? [];
  let end = bytes.length - lengths.reduce((sum, length) => sum + length, 0);
  const columns = decoded(bytes.subarray(0, end), ground.columns, ground.episodes.map((episode) => episode.n_frames));
  const others = ground.others === undefined ? null : { bytes, ends: lengths.map((length) => [end, (end += length)]) };
  let first = 0;
  const episodes = ground.episodes.map((episode, index) => {
    const rig = ground.vehicles[episode.vehicle ?? 0], { vehicle, load } = ground.classes?.[episode.class] ?? {};
    const whole = { ...episode, index, rig, vehicle, load, first, failed: episode.ended !== "arrived", seconds: (episode.n_frames - 1) * ground.step };
    first += episode.n_frames;
    return whole;
  });
  return { ground, columns, others, episodes };
}

/** All data of the page. */
async function readPage() {
  const report = JSON.parse(block("report")), { ground, columns, others, episodes } = await readEpisodes();
  // Of thousands of routes the reports stand in the gzipped block.
  report.evaluation.routes ??= ground.route_reports;
  const { evaluation } = report;
  return { report, evaluation, ground, columns, others, episodes, shown: shownOf(evaluation, episodes), metrics: columnsOf(JSON.parse(block("metrics"))) };
}

/** The state of an episode at `frame`: linear interpolation between two frames. */
function instant(page, episode, frame) {
  const { columns, ground } = page, { rig } = episode;
  const last = episode.n_frames - 1;
  const at = Math.min(Math.max(frame, 0), last), lower = Math.min(Math.floor(at), Math.max(last - 1, 0)), part = at - lower;
  const here = episode.first + lower, next = here + Math.min(1, last);
  const between = (name) => columns[name][here] + part * (columns[name][next] - columns[name][here]);
  const turned = (name) => columns[name][here] + part * wrapped(columns[name][next] - columns[name][here]);
  const x = between("x"), y = between("y"), heading = turned("heading"), trailerHeading = turned("trailer_heading");
  const ranges = Array.from({ length: ground.n_rays }, (_, ray) => {
    const [a, b] = [columns["range_" + ray][here], columns["range_" + ray][next]];
    // A ray that jumps to another kerb is not interpolated.
    return Math.abs(b - a) < 3 ? a + part * (b - a) : part < 0.5 ? a : b;
  });
  const [trailerX, trailerY] = trailerMiddle(rig, [x, y], heading, trailerHeading);
  return {
    x, y, heading, trailerHeading, ranges,
    trailerX, trailerY,
    time: at * ground.step,
    steering: between("steering"), speed: between("speed"), laneDistance: between("lane_distance"),
    articulation: wrapped(heading - trailerHeading),
    tractorClearance: between("tractor_clearance"), trailerClearance: between("trailer_clearance"),
    tractorTransfer: between("tractor_load_transfer"), trailerTransfer: between("trailer_load_transfer"),
  };
}
