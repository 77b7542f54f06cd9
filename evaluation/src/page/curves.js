// Training curves over env steps or minutes, with one pointer for all of them.

function curvesOf(report, metrics) {
  const window = report.training_window === undefined ? "" : `, last ${whole(report.training_window)} episodes`;
  return [
    { column: "success", name: `Success${window}`, text: (value) => percent(value), tick: (value) => decimal(100 * value, 0) + GAP + "%", range: [0, 1] },
    { column: "validation_success", name: "Success on validation routes", text: (value) => percent(value), tick: (value) => decimal(100 * value, 0) + GAP + "%", range: [0, 1] },
    { column: "reward", name: `Mean reward of an episode${window}`, text: (value) => whole(value), tick: short },
    { column: "entropy", name: "Entropy of the policy [nat]", text: (value) => decimal(value, 3), tick: (value) => decimal(value, 1), from: 0 },
    { column: "value", name: "Q value, scaled reward", text: (value) => decimal(value, 2), tick: (value) => String(+value.toFixed(2)) },
  ].filter(({ column }) => (metrics[column] ?? []).some(Number.isFinite));
}

/** The column over env steps or minutes as a chart's horizontal values. */
const horizontal = (metrics, axis) => (axis === "minutes" ? metrics.seconds.map((seconds) => seconds / 60) : metrics.env_steps);

/** Draws one curve into its figure. */
function drawCurve(figure, curve, metrics, axis) {
  const xs = horizontal(metrics, axis), ys = metrics[curve.column];
  const points = xs.map((x, index) => [x, ys[index]]).filter(([x, y]) => Number.isFinite(x) && Number.isFinite(y));
  const tick = (value) => (axis === "minutes" ? String(+value.toFixed(2)) : value === 0 ? "0" : short(value));
  const across = { from: 0, to: Math.max(...xs.filter(Number.isFinite), 0) || 1, tick, label: axis === "minutes" ? "minutes" : "env steps" };
  drawChart(figure, { across, up: curve, lines: [{ points }] });
}

/** Shows the section if there are figures. */
function showTraining({ report, metrics }) {
  if (metrics === null || metrics.env_steps === undefined || metrics.seconds === undefined) return;
  byId("training").hidden = false;
  const curves = curvesOf(report, metrics), box = byId("curves");
  let axis = "steps";
  const figures = curves.map((curve) => {
    const last = metrics[curve.column].filter(Number.isFinite).at(-1);
    const note = last === undefined ? "" : `at the end ${curve.text(last)}`;
    return chartFigure(curve.name, note, `${curve.name} over the training, ${note}`);
  });
  box.replaceChildren(...figures);
  const draw = () => figures.forEach((figure, index) => drawCurve(figure, curves[index], metrics, axis));
  const nearest = (asked) => horizontal(metrics, axis).filter(Number.isFinite)
    .reduce((best, x) => (Math.abs(x - asked) < Math.abs(best - asked) ? x : best), Infinity);
  sharePointer(figures, nearest, (index, x) => {
    const value = metrics[curves[index].column][horizontal(metrics, axis).indexOf(x)];
    return `${axis === "minutes" ? `${decimal(x, 1)} min` : short(x)}: ${Number.isFinite(value) ? curves[index].text(value) : "\u2013"}`;
  });
  for (const [id, name] of [["by-steps", "steps"], ["by-minutes", "minutes"]]) {
    byId(id).addEventListener("click", (event) => { axis = name; press(event.currentTarget.parentElement, event.currentTarget); draw(); });
  }
  new ResizeObserver(draw).observe(box);
  draw();
}
