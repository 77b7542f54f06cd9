// A chart: lines over one horizontal axis with a grid of numbers, and one pointer for several charts.

const HEIGHT = 210, LEFT = 50, RIGHT = 10, TOP = 10, BOTTOM = 36;

/** A figure with its caption and an empty chart. `note` stands beside the caption where nothing is pointed at. */
function chartFigure(name, note, about) {
  const figure = html("figure", {}, html("figcaption", {}, name, html("span", {}, note)), svg("svg", { height: HEIGHT, role: "img", "aria-label": about }));
  figure.note = note;
  return figure;
}

/** Lowest and highest value of an axis. */
function axisEnds({ range, from = Infinity }, values) {
  const [low, high] = range ?? [Math.min(from, ...values), Math.max(...values)];
  return low < high ? [low, high] : [Number.isFinite(low) ? low - 1 : 0, Number.isFinite(high) ? high + 1 : 1];
}

/**
 * Draws lines into a figure for its current width.
 *
 * `across` is { from, to, tick, label }, `up` is { tick } with a `range` or the value `from` which it shows at least. A line
 * has `points`, [x, y] each, and may have a `colour` and be `dashed`. A band is { from, to, words } of the horizontal axis.
 */
function drawChart(figure, { across, up, lines, bands = [] }) {
  const width = Math.max(figure.clientWidth, 240), span = across.to - across.from || 1;
  const [low, high] = axisEnds(up, lines.flatMap(({ points }) => points.map(([, y]) => y)));
  const x = (value) => LEFT + ((width - LEFT - RIGHT) * (value - across.from)) / span;
  const y = (value) => HEIGHT - BOTTOM - ((HEIGHT - TOP - BOTTOM) * (value - low)) / (high - low);
  const behind = bands.flatMap(({ from, to, words }) => [
    svg("rect", { class: "band", x: x(from), width: Math.max(x(to) - x(from), 1), y: TOP, height: HEIGHT - TOP - BOTTOM }),
    svg("text", { x: x(from) + 5, y: TOP + 13 }, words),
  ]);
  const horizontal = ticks(low, high, 4).flatMap((value) => [
    svg("line", { class: "grid", x1: LEFT, x2: width - RIGHT, y1: y(value), y2: y(value) }),
    svg("text", { x: LEFT - 7, y: y(value) + 4, "text-anchor": "end" }, up.tick(value)),
  ]);
  const below = ticks(across.from, across.to, width < 420 ? 3 : 6).map((value) =>
    svg("text", { x: x(value), y: HEIGHT - BOTTOM + 17, "text-anchor": "middle" }, across.tick(value)));
  const label = svg("text", { x: width - RIGHT, y: HEIGHT - 3, "text-anchor": "end" }, across.label);
  const curves = lines.map(({ points, colour, dashed }) => svg("path", {
    class: dashed ? "curve dashed" : "curve", style: colour && `stroke: ${colour}`,
    d: points.map(([px, py], index) => `${index === 0 ? "M" : "L"}${x(px).toFixed(1)} ${y(py).toFixed(1)}`).join(""),
  }));
  const drawing = figure.querySelector("svg");
  drawing.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
  drawing.replaceChildren(...behind, ...horizontal, ...below, label, ...curves,
    svg("line", { class: "cursor", y1: TOP, y2: HEIGHT - BOTTOM, visibility: "hidden" }));
  figure.at = { x, valueAt: (px) => across.from + (span * (px - LEFT)) / (width - LEFT - RIGHT) };
}

/**
 * One pointer for several charts. `nearest` gives the value to point at for the one asked for, `words` what chart `index`
 * says there.
 */
function sharePointer(figures, nearest, words) {
  const point = (event) => {
    const { left } = event.currentTarget.getBoundingClientRect();
    const value = nearest(event.currentTarget.parentElement.at.valueAt(event.clientX - left));
    figures.forEach((figure, index) => {
      const cursor = figure.querySelector(".cursor"), at = figure.at.x(value);
      for (const [name, position] of [["x1", at], ["x2", at], ["visibility", "visible"]]) cursor.setAttribute(name, position);
      figure.querySelector("figcaption span").textContent = words(index, value);
    });
  };
  const leave = () => figures.forEach((figure) => {
    figure.querySelector(".cursor").setAttribute("visibility", "hidden");
    figure.querySelector("figcaption span").textContent = figure.note;
  });
  for (const figure of figures) {
    const drawing = figure.querySelector("svg");
    for (const kind of ["pointermove", "pointerdown"]) drawing.addEventListener(kind, point);
    drawing.addEventListener("pointerleave", leave);
  }
}
