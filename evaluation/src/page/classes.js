// How trucks drove, by vehicle and load: a row for each, below the vehicle's name.

/** A load's colour, the same on the whole page. */
const loadColour = (page, load) => `var(--load-${loadsOf(page).indexOf(load) % 6})`;

/** The loads of the report, in its order. */
const loadsOf = ({ evaluation }) => [...new Set((evaluation.classes ?? []).map(({ load }) => load))];

/** The load of an episode, also where the benchmark has one. */
const loadOf = ({ evaluation }, episode) => episode.load ?? evaluation.classes[0].load;

/** The words of a column, and what a class has in it. */
const CLASS_COLUMNS = [
  ["Arrived", (one) => {
    const [low, high] = wilson(one.arrived, one.episodes);
    return html("div", { class: "cell", title: overRoutes(one).slice(2) || undefined }, fractionBar(one.success, low, high, "var(--good)", 16), html("span", {}, `${whole(one.arrived)}/${whole(one.episodes)}  ${percent(one.success)}`));
  }],
  ["Rolled over", (one) => [whole(one.rolled_over), html("span", { class: "muted" }, ` to ${percent(one.rolled_over_high)}`)]],
  ["Peak LTR", (one) => [one.load_transfer_ratio_p50, one.load_transfer_ratio_p90, one.load_transfer_ratio_p99].map((ratio) => decimal(ratio, 2)).join(" | ")],
  ["Speed [km/h]", (one) => decimal(one.speed_mean_kmh, 1)],
  ["Time over feasible", (one) => (one.time_over_feasible_mean === null ? "\u2013" : decimal(one.time_over_feasible_mean, 2))],
  ["Lateral [g]", (one) => `${decimal(one.lateral_acceleration_p50, 2)} | ${decimal(one.lateral_acceleration_p95, 2)}`],
  ["Jerk [m/s³]", (one) => decimal(one.jerk_p95, 1)],
  ["Switches [1/s]", (one) => decimal(one.switches_per_second, 2)],
];

/** Shows the section if the report has figures by vehicle and load. */
function showClasses(page, replay) {
  const { classes = [] } = page.evaluation;
  byId("classes").hidden = classes.length === 0;
  if (classes.length === 0) return;
  const row = (one) => html("tr", { class: "class" },
    html("th", { scope: "row" }, html("i", { class: "swatch", style: `--swatch: ${loadColour(page, one.load)}` }), one.load),
    ...CLASS_COLUMNS.map(([, content]) => html("td", {}, ...[content(one)].flat())));
  const body = (vehicle) => {
    const rows = classes.filter((one) => one.vehicle === vehicle).map(row);
    const head = html("tr", { class: "group" }, html("th", { scope: "rowgroup", colspan: CLASS_COLUMNS.length + 1 }, vehicle));
    return html("tbody", {}, vehicle === "" ? null : head, ...rows);
  };
  byId("class-table").replaceChildren(
    html("caption", { class: "unseen" }, "How trucks drove, by vehicle and load"),
    html("thead", {}, html("tr", {}, html("th", { scope: "col" }, "Load"), ...CLASS_COLUMNS.map(([name]) => html("th", { scope: "col" }, name)))),
    ...[...new Set(classes.map(({ vehicle }) => vehicle))].map(body));
  if (replay !== undefined) showProfiles(page, replay);
}
