// Two episodes from the same start, side by side on one clock. With #selftest the page checks itself.

/** Episodes stand in pairs: that of the first side, then the other's. */
class Pairs {
  constructor(page, { first, names, differing }) {
    Object.assign(this, { page, first, names });
    this.figures = [...document.querySelectorAll(".pair figure")];
    byId("replay").hidden = names.length === 0;
    byId("note").textContent = differing === 0 ? "By the first file of each side the same episodes arrive."
      : names.length < differing ? `${whole(names.length)} of the ${whole(differing)} pairs from one start, by the first file of each side, of which one alone arrives.`
      : `${whole(differing)} pairs from one start, by the first file of each side, of which one alone arrives.`;
    if (names.length === 0) return;
    byId("pair").replaceChildren(...names.map((name, index) => {
      const [one, other] = this.episodesOf(index);
      const words = `${page.ground.routes[one.route].name}, episode ${one.number}: ${first} ${endWords(one.ended)}, ${name} ${endWords(other.ended)}`;
      return html("option", { value: index }, words);
    }));
    this.clock = new Clock(page.ground.step, () => this.show());
    this.listen();
    showSceneKeys(page);
    this.open(0);
  }

  episodesOf(index) {
    return this.page.episodes.slice(2 * index, 2 * index + 2);
  }

  open(index) {
    this.episodes = this.episodesOf(index);
    this.scenes = this.episodes.map((episode) => sceneOf(this.page, episode));
    // Both are seen in one frame, so that their places can be compared.
    const wider = (axis) => [Math.min(...this.scenes.map(({ bounds }) => bounds[axis][0])), Math.max(...this.scenes.map(({ bounds }) => bounds[axis][1]))];
    const bounds = [wider(0), wider(1)];
    for (const scene of this.scenes) scene.bounds = bounds;
    [this.first, this.names[index]].forEach((name, side) => { this.figures[side].querySelector("figcaption").textContent = name; });
    this.clock.open(Math.max(...this.scenes.map(({ last }) => last)), 0);
  }

  show() {
    const now = this.clock.frame, options = { rays: byId("rays").checked, follow: byId("follow").checked };
    this.figures.forEach((figure, side) => {
      const episode = this.episodes[side], scene = this.scenes[side], frame = Math.min(now, scene.last);
      drawScene(figure.querySelector("canvas"), scene, instant(this.page, episode, frame), frame, options);
      const ended = scene.last <= now, words = figure.querySelector("p");
      words.textContent = ended ? `${endWords(episode.ended)} after ${decimal(episode.seconds, 1)}${GAP}s` : "drives";
      words.style.setProperty("--end", ended ? `var(--end-${episode.ended})` : "var(--track)");
    });
  }

  listen() {
    byId("pair").addEventListener("change", (event) => { this.clock.play(false); this.open(Number(event.target.value)); });
    for (const id of ["rays", "follow"]) byId(id).addEventListener("change", () => this.show());
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.show());
    for (const { parentNode } of this.figures.map((figure) => figure.querySelector("canvas"))) new ResizeObserver(() => this.show()).observe(parentNode);
  }

  /** What is wrong with the page, a line each. */
  faults() {
    const faults = [];
    this.names.forEach((name, index) => {
      this.open(index);
      const [one, other] = this.episodes, start = this.episodes.map((episode) => instant(this.page, episode, 0));
      if (one.route !== other.route || one.number !== other.number) faults.push(`pair ${index}: other starts`);
      if (Math.hypot(start[0].x - start[1].x, start[0].y - start[1].y) > 0.01) faults.push(`pair ${index}: other poses`);
      if ((one.ended === "arrived") === (other.ended === "arrived")) faults.push(`pair ${index}: ${name} does not differ`);
      this.clock.seek(this.clock.last);
      const ends = this.figures.map((figure) => figure.querySelector("p").textContent);
      if (!this.episodes.every((episode, side) => ends[side].startsWith(endWords(episode.ended)))) faults.push(`pair ${index}: ${ends}`);
    });
    return faults;
  }
}

const testing = location.hash === "#selftest";
const outcome = (faults) => document.body.append(html("pre", { id: "selftest" }, `selftest ${faults.length === 0 ? "passed" : "failed"}\n${faults.join("\n")}`));
try {
  const pairs = new Pairs(await readEpisodes(), JSON.parse(block("pairs")));
  if (testing) outcome(pairs.faults());
} catch (error) {
  byId("trouble").hidden = false;
  byId("trouble").textContent = `The replay of this page could not be shown: ${error.message}`;
  if (testing) outcome([error.message]);
}
