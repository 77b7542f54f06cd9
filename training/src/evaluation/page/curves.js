// Training curves over env steps or minutes, with one pointer for all of them.

const HEIGHT = 210, LEFT = 50, RIGHT = 10, TOP = 10, BOTTOM = 36;

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

/** Draws one curve into its figure for its current width. */
function drawCurve(figure, curve, metrics, axis) {
  const xs = axis === "minutes" ? metrics.seconds.map((seconds) => seconds / 60) : metrics.env_steps;
  const ys = metrics[curve.column];
  const points = xs.map((x, index) => [x, ys[index]]).filter(([x, y]) => Number.isFinite(x) && Number.isFinite(y));
  const width = Math.max(figure.clientWidth, 240), drawing = figure.querySelector("svg");
  const values = points.map(([, y]) => y), end = Math.max(...xs.filter(Number.isFinite), 0) || 1;
  let [low, high] = curve.range ?? [Math.min(curve.from ?? Infinity, ...values), Math.max(...values)];
  if (!(low < high)) [low, high] = [Number.isFinite(low) ? low - 1 : 0, Number.isFinite(high) ? high + 1 : 1];
  const x = (value) => LEFT + ((width - LEFT - RIGHT) * value) / end;
  const y = (value) => HEIGHT - BOTTOM - ((HEIGHT - TOP - BOTTOM) * (value - low)) / (high - low);
  const horizontal = ticks(low, high, 4).flatMap((value) => [
    svg("line", { class: "grid", x1: LEFT, x2: width - RIGHT, y1: y(value), y2: y(value) }),
    svg("text", { x: LEFT - 7, y: y(value) + 4, "text-anchor": "end" }, curve.tick(value)),
  ]);
  const along = ticks(0, end, width < 420 ? 3 : 6).map((value) =>
    svg("text", { x: x(value), y: HEIGHT - BOTTOM + 17, "text-anchor": "middle" }, axis === "minutes" ? String(+value.toFixed(2)) : value === 0 ? "0" : short(value)));
  const label = svg("text", { x: width - RIGHT, y: HEIGHT - 3, "text-anchor": "end" }, axis === "minutes" ? "minutes" : "env steps");
  const path = points.map(([px, py], index) => `${index === 0 ? "M" : "L"}${x(px).toFixed(1)} ${y(py).toFixed(1)}`).join("");
  drawing.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
  drawing.replaceChildren(...horizontal, ...along, label, svg("path", { class: "curve", d: path }),
    svg("line", { class: "cursor", y1: TOP, y2: HEIGHT - BOTTOM, visibility: "hidden" }));
  figure.at = { x, end, width, xs };
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
    return html("figure", {}, html("figcaption", {}, curve.name, html("span", {}, note)),
      svg("svg", { height: HEIGHT, role: "img", "aria-label": `${curve.name} over the training, ${note}` }));
  });
  box.replaceChildren(...figures);
  const draw = () => figures.forEach((figure, index) => drawCurve(figure, curves[index], metrics, axis));
  const notes = figures.map((figure) => figure.querySelector("figcaption span").textContent);
  const point = (event) => {
    const { left } = event.currentTarget.getBoundingClientRect(), { end, width, xs } = event.currentTarget.parentElement.at;
    const asked = ((event.clientX - left - LEFT) / (width - LEFT - RIGHT)) * end;
    const nearest = xs.reduce((best, value, index) => (Math.abs(value - asked) < Math.abs(xs[best] - asked) ? index : best), 0);
    figures.forEach((figure, index) => {
      const cursor = figure.querySelector(".cursor"), at = figure.at.x(figure.at.xs[nearest]), value = metrics[curves[index].column][nearest];
      for (const [name, position] of [["x1", at], ["x2", at], ["visibility", "visible"]]) cursor.setAttribute(name, position);
      const when = axis === "minutes" ? `${decimal(xs[nearest], 1)} min` : short(xs[nearest]);
      figure.querySelector("figcaption span").textContent = `${when}: ${Number.isFinite(value) ? curves[index].text(value) : "\u2013"}`;
    });
  };
  const leave = () => figures.forEach((figure, index) => {
    figure.querySelector(".cursor").setAttribute("visibility", "hidden");
    figure.querySelector("figcaption span").textContent = notes[index];
  });
  for (const figure of figures) {
    const drawing = figure.querySelector("svg");
    for (const kind of ["pointermove", "pointerdown"]) drawing.addEventListener(kind, point);
    drawing.addEventListener("pointerleave", leave);
  }
  for (const [id, name] of [["by-steps", "steps"], ["by-minutes", "minutes"]]) {
    byId(id).addEventListener("click", (event) => { axis = name; press(event.currentTarget.parentElement, event.currentTarget); draw(); });
  }
  new ResizeObserver(draw).observe(box);
  draw();
}
