// The figures of the followed truck as small charts: values that it observes, outputs of its policy.

/** Bars for groups of values: name, one bar a value. Bars of what can be negative grow from the middle. */
class ValueBars {
  constructor(groups) {
    this.bars = [];
    const rows = groups.map(({ name, doc, n, low, first }) => {
      const bars = Array.from({ length: n }, () => html("i"));
      this.bars.push(...bars.map((bar, index) => ({ bar, at: first + index, low })));
      const words = name.replaceAll("_", " ");
      const label = html("span", {}, n === 1 ? words : `${words} ×${n}`);
      const track = html("div", { class: low < 0 ? "signed" : "" }, ...bars);
      return html("div", { class: "values", title: doc }, label, track);
    });
    this.node = html("div", { role: "img" }, ...rows);
    this.groups = groups;
  }

  /** Shows values, in the order of the groups. */
  show(values) {
    for (const { bar, at, low } of this.bars) {
      const value = Math.min(Math.max(values[at], low), 1), size = `${(100 * Math.abs(value)) / (1 - low)}%`;
      bar.style.height = size;
      bar.style.bottom = low < 0 ? (value < 0 ? `calc(50% - ${size})` : "50%") : "0";
    }
    const listed = (first, n) => values.slice(first, first + n).map((value) => decimal(value, 2)).join(" ");
    const words = this.groups.map(({ name, first, n }) => `${name.replaceAll("_", " ")} ${listed(first, n)}`);
    this.node.setAttribute("aria-label", words.join(", "));
  }
}

/** Outputs of a policy: a column for each steer angle from left to right, a row for each speed from high to low. */
class OutputCells {
  constructor(actions) {
    const distinct = (at) => [...new Set(actions.map((action) => action[at]))].sort((a, b) => b - a);
    const [angles, speeds] = [distinct(0), distinct(1)];
    this.isOneRow = speeds.length === 1;
    this.cells = actions.map(([steering, speed]) => {
      const place = `grid-column: ${angles.indexOf(steering) + 1}; grid-row: ${speeds.indexOf(speed) + 1}`;
      return html("div", { style: place, class: "cell" }, html("i"));
    });
    this.words = actions.map(([steering, speed]) => {
      const angle = toDegrees(Math.abs(steering));
      const turn = angle < 0.05 ? "straight" : `${degrees(angle)} ${steering < 0 ? "right" : "left"}`;
      return this.isOneRow ? turn : `${turn}, ${decimal(3.6 * speed, 0)}${GAP}km/h`;
    });
    const style = `grid-template-columns: repeat(${angles.length}, 1fr)`;
    const name = this.isOneRow ? "outputs bars-only" : "outputs";
    this.node = html("div", { class: name, style, role: "img" }, ...this.cells);
  }

  /** Shows outputs, the largest of which is what the policy chooses. */
  show(outputs) {
    const high = Math.max(...outputs), low = Math.min(...outputs), best = outputs.indexOf(high);
    this.cells.forEach((cell, index) => {
      const fraction = (outputs[index] - low) / (high - low || 1);
      cell.firstChild.style.height = this.isOneRow ? `${4 + 96 * fraction}%` : "100%";
      cell.firstChild.style.opacity = this.isOneRow ? 1 : fraction ** 2;
      cell.classList.toggle("taken", index === best);
      cell.title = `${this.words[index]}: ${decimal(outputs[index], 2)}`;
    });
    this.node.setAttribute("aria-label", `Largest output: ${this.words[best]}`);
    return this.words[best];
  }
}

/** A value that stands for many: at most `most` of them, the last one among these. */
function thinned(values, most) {
  const every = Math.ceil(values.length / most), last = values.length - 1;
  return values.filter((_, index) => (last - index) % every === 0);
}
