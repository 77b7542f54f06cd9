// A row a route, grouped by roundabout: success with its interval, ends by code, distance to the lane centre, peak load
// transfer ratio and articulation. A table, so that each bar stands beside its number.

const METRICS = [["success", "Success"], ["ends", "Ends"], ["lane", "Lane"], ["transfer", "LTR"], ["articulation", "Articulation"]];

const ROUTES_CAPTION = "Success, ends, distance to the lane centre, peak load transfer ratio and peak articulation of each route";

const endColour = (name) => `var(--end-${name})`;

/** The roundabout of `20m/N-left-3`, and what is left of the name. */
const roundaboutOf = (route) => route.slice(0, Math.max(route.lastIndexOf("/"), 0));
const withinRoundabout = (route) => route.slice(route.lastIndexOf("/") + 1);

/** Routes grouped by roundabout, in the report's order. */
function grouped(routes) {
  const groups = new Map();
  for (const route of routes) {
    const name = roundaboutOf(route.name);
    groups.set(name, [...(groups.get(name) ?? []), route]);
  }
  return groups;
}

function figure(kind, drawing, text, number) {
  return html("td", { class: `figure ${kind}`, style: number && `--number: ${number}px` }, html("div", { class: "cell" }, drawing, html("span", {}, text)));
}

/** A value from 0 as a bar, with a mark for a second value and a line for a limit. */
function lengthBar(value, scale, { mark, limit } = {}) {
  const at = (value) => (100 * Math.min(Math.max(value / scale, 0), 1)).toFixed(2) + "%";
  const line = (value, colour) => svg("line", { x1: at(value), x2: at(value), y1: 1, y2: 15, stroke: colour, "stroke-width": 2 });
  return svg("svg", { height: 16, "aria-hidden": "true" },
    svg("rect", { x: 0, y: 3, width: "100%", height: 10, rx: 2, fill: "var(--track)" }),
    svg("rect", { x: 0, y: 3, width: at(value), height: 10, rx: 2, fill: "var(--accent)", "fill-opacity": 0.75 }),
    mark === undefined ? null : line(mark, "var(--ink)"),
    limit === undefined ? null : line(limit, "var(--end-tractor_collided)"));
}

function endsBar(ends, episodes) {
  let from = 0;
  const pieces = Object.entries(ends).filter(([, count]) => 0 < count).sort(([a], [b]) => (b === "arrived") - (a === "arrived"));
  return svg("svg", { height: 16, "aria-hidden": "true" }, ...pieces.map(([name, count]) => {
    const piece = svg("rect", { x: (100 * from) / episodes + "%", width: (100 * count) / episodes + "%", height: 16, fill: endColour(name) });
    from += count;
    return piece;
  }));
}

function endsText(ends) {
  const failures = Object.entries(ends).filter(([name, count]) => name !== "arrived" && 0 < count);
  return { count: failures.reduce((sum, [, count]) => sum + count, 0), words: failures.map(([name, count]) => `${count} ${endWords(name)}`).join(", ") };
}

function cells(summary, scales) {
  const failures = endsText(summary.ends);
  const ends = figure("ends", endsBar(summary.ends, summary.episodes), failures.count === 0 ? "all arrived" : `${failures.count} failed`, 76);
  ends.title = failures.words || "all arrived";
  // Of many episodes a whole per cent is many, and their numbers are wide.
  const many = 200 < summary.episodes, wide = 1000 <= summary.episodes;
  const success = figure("success", fractionBar(summary.success, summary.success_low, summary.success_high, "var(--good)", 16),
      `${summary.arrived}/${summary.episodes}  ${decimal(100 * summary.success, many ? 1 : 0)}${GAP}%`, wide ? 132 : many ? 112 : 92);
  if (summary.success_low_over_routes < summary.success_high_over_routes) success.title = overRoutes(summary).slice(2);
  return [
    success,
    ends,
    figure("lane", lengthBar(summary.lane_distance_mean, scales.lane, { mark: summary.lane_distance_max }), metres(summary.lane_distance_mean), 50),
    figure("transfer", lengthBar(summary.load_transfer_ratio_peak, scales.transfer, { limit: 1 }), decimal(summary.load_transfer_ratio_peak, 2), 34),
    figure("articulation", lengthBar(summary.articulation_peak_deg, scales.articulation), degrees(summary.articulation_peak_deg), 34),
  ];
}

/** The figures of several routes as those of one. */
function merged(routes) {
  const sum = (value) => routes.reduce((total, route) => total + value(route), 0);
  const most = (value) => Math.max(...routes.map(value));
  const episodes = sum((route) => route.episodes), arrived = sum((route) => route.arrived);
  const [success_low, success_high] = wilson(arrived, episodes);
  return {
    episodes, arrived, success: arrived / episodes, success_low, success_high,
    // Ends among vehicles stand where there was one.
    ends: Object.fromEntries([...new Set(routes.flatMap((route) => Object.keys(route.ends)))].map(
      (name) => [name, sum((route) => route.ends[name] ?? 0)])),
    lane_distance_mean: sum((route) => route.episodes * route.lane_distance_mean) / episodes,
    lane_distance_max: most((route) => route.lane_distance_max),
    load_transfer_ratio_peak: most((route) => route.load_transfer_ratio_peak),
    articulation_peak_deg: most((route) => route.articulation_peak_deg),
  };
}

/** The scales of all bars. */
function scalesOf({ routes }) {
  const most = (value) => routes.reduce((most, route) => Math.max(most, value(route)), 0);
  return {
    lane: Math.max(most((route) => route.lane_distance_max), 1),
    transfer: Math.max(1.05, most((route) => route.load_transfer_ratio_peak)),
    articulation: Math.max(45, most((route) => route.articulation_peak_deg)),
  };
}

/** The row of a route; its name opens its replay if one of its episodes is shown. */
function routeRow(page, route, name, scales, open) {
  const shown = page.ground.routes.some((other) => other.name === route.name);
  return html("tr", { class: "route" },
    html("th", { scope: "row" },
      shown ? html("button", { type: "button", class: "link", "aria-label": `Replay ${route.name}`, onclick: () => open(route.name) }, name) : html("span", { class: "label" }, name),
      route.own_lane_suffices ? html("span", { class: "tag" }, "own lane") : null),
    ...cells(route, scales));
}

/** A table of rows with these cells. */
function fillTable(table, caption, first, bodies) {
  const heads = ["Success, 95 % interval", "Ends", "Lane distance, mean | most", "Peak LTR, limit 1", "Peak articulation"];
  table.dataset.metric ??= "success";
  table.replaceChildren(
    html("caption", { class: "unseen" }, caption),
    html("thead", {}, html("tr", {}, html("th", { scope: "col", class: "name" }, first),
      ...heads.map((head, index) => html("th", { scope: "col", class: `figure ${METRICS[index][0]}` }, head)))),
    ...bodies);
}

/** Fills the tables; `open` is called with the name of the chosen route. */
function showRoutes(page, open) {
  const { evaluation } = page, scales = scalesOf(evaluation);
  const tables = [byId("route-table"), byId("group-table")];
  if (page.ground.route_reports === undefined) {
    const bodies = [...grouped(evaluation.routes)].map(([roundabout, members]) => html("tbody", {},
      html("tr", { class: "group" }, html("th", { scope: "rowgroup" }, roundabout), ...cells(merged(members), scales)),
      ...members.map((route) => routeRow(page, route, withinRoundabout(route.name), scales, open))));
    fillTable(tables[0], ROUTES_CAPTION, "Route", bodies);
  } else {
    showGroups(page, scales, open);
  }
  const segments = byId("metric");
  segments.replaceChildren(...METRICS.map(([name, words], index) => html("button", {
    type: "button", "aria-pressed": String(index === 0),
    onclick: (event) => { for (const table of tables) table.dataset.metric = name; press(segments, event.currentTarget); },
  }, words)));
  byId("ends-legend").replaceChildren(...Object.entries(evaluation.ends).filter(([name, count]) => 0 < count || name === "arrived").map(([name, count]) =>
    html("li", {}, html("i", { style: `--swatch: ${endColour(name)}` }), `${endWords(name)} ${whole(count)}`)));
}
