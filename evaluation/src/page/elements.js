// Functions that make nodes of the page, and numbers in the page's format.

/** The element with this id. */
const byId = (id) => document.getElementById(id);

function filled(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false && value !== undefined) node.setAttribute(name, value);
  }
  // Text is always set as text: no name in a report can become markup.
  node.append(...children.filter((child) => child !== undefined && child !== null));
  return node;
}

/** An HTML element with attributes, listeners (`onclick` and the like) and children. */
const html = (tag, attributes = {}, ...children) => filled(document.createElement(tag), attributes, children);

/** The same in SVG. */
const svg = (tag, attributes = {}, ...children) => filled(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);

/** The narrow no-break space between a number and its unit. */
const GAP = "\u202f";

/** `value` with this number of decimals and a typographic minus sign. */
const decimal = (value, decimals) => value.toFixed(decimals).replace(/^-(?=.*[1-9])/, "\u2212").replace(/^-/, "");
const percent = (fraction) => decimal(100 * fraction, 1) + GAP + "%";
const metres = (value) => (value === null || value === undefined ? "\u2013" : decimal(value, 2) + GAP + "m");
const whole = (value) => Math.round(value).toLocaleString("en-GB");
const degrees = (value, decimals = 0) => decimal(value, decimals) + "°";

/** 4,268,160 as 4.27 M. */
function short(value) {
  const size = Math.abs(value);
  if (size >= 1e6) return +(value / 1e6).toFixed(2) + GAP + "M";
  if (size >= 1e4) return +(value / 1e3).toFixed(1) + GAP + "k";
  return whole(value);
}

/** An end code in words. */
const endWords = (name) => name.replaceAll("_", " ");

/** The 95 % Wilson interval of successes / trials, as the report's own. */
function wilson(successes, trials) {
  const z = 1.959964, p = successes / trials, square = (z * z) / trials;
  const centre = (p + square / 2) / (1 + square);
  const half = (z / (1 + square)) * Math.sqrt((p * (1 - p)) / trials + square / (4 * trials));
  return [Math.min(Math.max(centre - half, 0), p), Math.max(Math.min(centre + half, 1), p)];
}

/** About `count` round values within `low` to `high`. */
function ticks(low, high, count) {
  const rough = (high - low || 1) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((step) => rough <= step);
  const found = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n++) found.push(n * step + 0);
  return found;
}

/** A fraction of 0 to 1 as a bar on its track, with its interval. */
function fractionBar(fraction, low, high, colour, height) {
  const at = (value) => 100 * value + "%", middle = height / 2;
  const whisker = (x1, x2, y1, y2) => svg("line", { x1: at(x1), x2: at(x2), y1, y2, stroke: "var(--ink)", "stroke-width": 1.5 });
  return svg("svg", { height, "aria-hidden": "true" },
    svg("rect", { x: 0, width: "100%", height, rx: 3, fill: "var(--track)" }),
    svg("rect", { x: 0, width: at(fraction), height, rx: 3, fill: colour, "fill-opacity": 0.82 }),
    whisker(low, high, middle, middle), whisker(low, low, middle - 4, middle + 4), whisker(high, high, middle - 4, middle + 4));
}

/** The colours of the page's light or dark theme, by name. */
function colours() {
  const style = getComputedStyle(document.documentElement);
  return (name) => style.getPropertyValue("--" + name).trim();
}

/** A value over the episode with a line at the current frame. */
function sparkline(values) {
  const low = Math.min(...values, 0), high = Math.max(...values, low + 1e-3), last = Math.max(values.length - 1, 1);
  const y = (value) => 21 - (20 * (value - low)) / (high - low);
  // Where nothing is known there is no line.
  const isKnown = (frame) => (values[frame] ?? null) !== null;
  const path = values.map((value, frame) => isKnown(frame) ? `${isKnown(frame - 1) ? "L" : "M"}${((100 * frame) / last).toFixed(2)} ${y(value).toFixed(2)}` : "").join("");
  return svg("svg", { viewBox: "0 0 100 22", preserveAspectRatio: "none", "aria-hidden": "true" },
    svg("line", { class: "grid", x1: 0, x2: 100, y1: y(0), y2: y(0), "vector-effect": "non-scaling-stroke" }),
    svg("path", { class: "curve", d: path, "vector-effect": "non-scaling-stroke" }),
    svg("line", { class: "cursor", y1: 0, y2: 22, "vector-effect": "non-scaling-stroke" }));
}

/** Marks one button of a group as the pressed one. */
function press(group, pressed) {
  for (const button of group.querySelectorAll("button")) button.setAttribute("aria-pressed", String(button === pressed));
}

/** Entries of a legend: lines in colours of the theme, each with what it is. */
const lineKeys = (pairs) => pairs.map(([colour, words]) =>
  html("li", {}, html("i", { class: "thin", style: `--swatch: var(--${colour})` }), words));

/** Shows on the button of time whether it runs. */
function showPlaying(button, playing) {
  button.textContent = playing ? "❚❚" : "▶";
  button.setAttribute("aria-label", playing ? "Pause" : "Play");
}
