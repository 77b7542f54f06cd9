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
  const columns = decoded(await inflated(block("tracks")), ground.columns, ground.episodes.map((episode) => episode.n_frames));
  let first = 0;
  const episodes = ground.episodes.map((episode) => {
    const rig = ground.vehicles[episode.vehicle ?? 0], { vehicle, load } = ground.classes?.[episode.class] ?? {};
    const whole = { ...episode, rig, vehicle, load, first, failed: episode.ended !== "arrived", seconds: (episode.n_frames - 1) * ground.step };
    first += episode.n_frames;
    return whole;
  });
  return { ground, columns, episodes };
}

/** All data of the page. */
async function readPage() {
  const report = JSON.parse(block("report")), { ground, columns, episodes } = await readEpisodes();
  // Of thousands of routes the reports stand in the gzipped block.
  report.evaluation.routes ??= ground.route_reports;
  const { evaluation } = report;
  return { report, evaluation, ground, columns, episodes, shown: shownOf(evaluation, episodes), metrics: columnsOf(JSON.parse(block("metrics"))) };
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
