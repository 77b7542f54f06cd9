// Two episodes from the same start, side by side on one clock. With #selftest the page checks itself.

/** Episodes stand in pairs: that of the first side, then the other's. */
class Pairs {
  constructor(page, { first, names, differing }) {
    Object.assign(this, { page, first, names, frame: 0, playing: false });
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
    this.last = Math.max(...this.scenes.map(({ last }) => last));
    [this.first, this.names[index]].forEach((name, side) => { this.figures[side].querySelector("figcaption").textContent = name; });
    byId("scrub").max = this.last;
    this.seek(0);
  }

  seek(frame) {
    this.frame = Math.min(Math.max(frame, 0), this.last);
    this.show();
  }

  show() {
    const { step } = this.page.ground, options = { rays: byId("rays").checked, follow: byId("follow").checked };
    this.figures.forEach((figure, side) => {
      const episode = this.episodes[side], scene = this.scenes[side], frame = Math.min(this.frame, scene.last);
      drawScene(figure.querySelector("canvas"), scene, instant(this.page, episode, frame), frame, options);
      const ended = scene.last <= this.frame, words = figure.querySelector("p");
      words.textContent = ended ? `${endWords(episode.ended)} after ${decimal(episode.seconds, 1)}${GAP}s` : "drives";
      words.style.setProperty("--end", ended ? `var(--end-${episode.ended})` : "var(--track)");
    });
    byId("scrub").value = this.frame;
    byId("clock").textContent = `${decimal(this.frame * step, 1)} / ${decimal(this.last * step, 1)}${GAP}s`;
  }

  play(playing) {
    if (playing && this.last <= this.frame) this.seek(0);
    this.playing = playing;
    showPlaying(byId("play"), playing);
    let before = performance.now();
    const turn = (this.turnOfPlay = {});
    const tick = () => {
      // Another press has begun another loop.
      if (!this.playing || turn !== this.turnOfPlay) return;
      const time = performance.now();
      this.seek(this.frame + (time - before) / 1000 / this.page.ground.step);
      before = time;
      if (this.last <= this.frame) this.play(false);
      else requestAnimationFrame(tick);
    };
    if (playing) requestAnimationFrame(tick);
  }

  listen() {
    byId("pair").addEventListener("change", (event) => { this.play(false); this.open(Number(event.target.value)); });
    byId("play").addEventListener("click", () => this.play(!this.playing));
    byId("scrub").addEventListener("input", (event) => { this.play(false); this.seek(Number(event.target.value)); });
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
      this.seek(this.last);
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
