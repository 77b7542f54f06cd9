// The replay of one episode, with the figures of the current frame. A link ending in #20m/W-left-3/4/7.5 opens the
// fifth episode of that route at 7.5 s.

/** The figures of a frame: name, value, text. Each is also a small curve over the episode. */
const READINGS = [
  ["Speed", (now) => 3.6 * now.speed, (value) => `${decimal(value, 1)}${GAP}km/h`],
  ["Steer angle", (now) => toDegrees(now.steering), turnWords],
  ["Articulation", (now) => toDegrees(now.articulation), (value) => degrees(value, 1)],
  ["LTR, tractor", (now) => now.tractorTransfer, (value) => decimal(value, 2)],
  ["LTR, trailer", (now) => now.trailerTransfer, (value) => decimal(value, 2)],
  ["Tractor to kerb", (now) => now.tractorClearance, metres],
  ["Trailer to kerb", (now) => now.trailerClearance, metres],
  ["Lane distance", (now) => now.laneDistance, metres],
];

/** The names of an episode's vehicle and load; empty where the benchmark has one vehicle. */
const truckOf = ({ vehicle, load }) => (load === undefined ? "" : `${vehicle}, ${load}`);

class Replay {
  constructor(page) {
    this.page = page;
    this.clock = new Clock(page.ground.step, () => this.show(), () => Number(byId("rate").value));
    /** Called when another route is open. */
    this.onRoute = () => {};
    this.canvas = byId("scene");
    this.order = this.routesInOrder();
    this.fillRoutes();
    this.sayHowMany();
    this.listen();
    if (!this.openLink()) this.openRoute(this.order.flatMap(([, routes]) => routes).sort((a, b) => b.failed - a.failed)[0].route);
  }

  /** Roundabouts with their routes, those with most failures first. */
  routesInOrder() {
    const { ground, episodes } = this.page, found = new Map();
    ground.routes.forEach(({ name }, route) => {
      const own = episodes.filter((episode) => episode.route === route);
      if (own.length === 0) return;
      const group = roundaboutOf(name);
      found.set(group, [...(found.get(group) ?? []), { route, name, failed: own.filter((episode) => episode.failed).length, count: own.length }]);
    });
    for (const routes of found.values()) routes.sort((a, b) => b.failed - a.failed);
    return [...found];
  }

  fillRoutes() {
    const all = this.page.episodes.length === this.page.evaluation.episodes;
    byId("route").replaceChildren(...this.order.map(([group, routes]) => html("optgroup", { label: group }, ...routes.map(({ route, name, failed, count }) =>
      html("option", { value: route }, `${name}: ${failed === 0 ? "all" : count - failed} of ${count}${all ? "" : " here"} arrived`)))));
  }

  /** Says so where not every episode is here. */
  sayHowMany() {
    const { shown, episodes, evaluation } = this.page;
    byId("shown").hidden = episodes.length === evaluation.episodes;
    const failed = shown.failed === shown.ofFailed ? `all ${whole(shown.failed)} that failed` : `${whole(shown.failed)} of ${whole(shown.ofFailed)} that failed`;
    byId("shown").textContent = `${whole(episodes.length)} of ${whole(evaluation.episodes)} episodes are here: ${failed} and ${whole(shown.arrived)} of ${whole(shown.ofArrived)} that arrived, drawn evenly.`;
  }

  openRoute(route) {
    byId("route").value = route;
    const own = this.page.episodes.filter((episode) => episode.route === Number(route));
    this.listed = own.toSorted((a, b) => b.failed - a.failed || a.number - b.number);
    byId("episodes").replaceChildren(...this.listed.map((episode) => html("button", {
      type: "button", class: episode.failed ? "failed" : "", style: `--end: ${endColour(episode.ended)}`,
      "aria-label": `Episode ${episode.number}: ${endWords(episode.ended)}`,
      title: [truckOf(episode), `${endWords(episode.ended)} after ${decimal(episode.seconds, 1)} s`].filter(Boolean).join(": "),
      onclick: () => this.openEpisode(episode),
    }, (episode.failed ? "×" : "") + episode.number)));
    this.openEpisode(this.listed[0]);
    this.onRoute();
  }

  /** Opens the route of this name and shows it. */
  openName(name) {
    this.openRoute(this.page.ground.routes.findIndex((route) => route.name === name));
    byId("replay").scrollIntoView({ block: "start" });
    this.canvas.focus({ preventScroll: true });
  }

  openEpisode(episode, seconds = 0) {
    this.episode = episode;
    this.scene = sceneOf(this.page, episode);
    press(byId("episodes"), byId("episodes").children[this.listed.indexOf(episode)]);
    byId("ending").textContent = `${episode.failed ? "Failed: " + endWords(episode.ended) : "Arrived"} after ${decimal(episode.seconds, 1)}${GAP}s`;
    byId("ending").style.setProperty("--end", endColour(episode.ended));
    byId("truck").hidden = episode.load === undefined;
    byId("truck").textContent = truckOf(episode);
    const moments = Array.from({ length: episode.n_frames }, (_, frame) => instant(this.page, episode, frame));
    byId("readings").replaceChildren(...READINGS.map(([name, value]) =>
      html("div", {}, html("dt", {}, name), html("dd", {}), sparkline(moments.map(value)))));
    this.clock.open(episode.n_frames - 1, Number((seconds / this.page.ground.step).toFixed(6)));
  }

  /** Opens the episode that the address names; false if it names none. */
  openLink() {
    // The last part of a route's name is no number, those before it may be.
    let hash = location.hash;
    try { hash = decodeURIComponent(hash); } catch { /* It was not written by this page. */ }
    const asked = hash.match(/^#(.+\/[^/]*[^/\d.][^/]*)\/(\d+)(?:\/(\d+(?:\.\d+)?))?$/);
    const route = asked && this.page.ground.routes.findIndex(({ name }) => name === asked[1]);
    const episode = asked && this.page.episodes.find((episode) => episode.route === route && episode.number === Number(asked[2]));
    if (!episode) return false;
    this.openRoute(route);
    this.openEpisode(episode, Number(asked[3] ?? 0));
    return true;
  }

  show() {
    const { page, episode, clock: { frame } } = this, now = instant(page, episode, frame);
    drawScene(this.canvas, this.scene, now, frame, { rays: byId("rays").checked, follow: byId("follow").checked });
    const along = (100 * frame) / Math.max(episode.n_frames - 1, 1);
    READINGS.forEach(([, value, words], index) => {
      const reading = byId("readings").children[index];
      reading.querySelector("dd").textContent = words(value(now));
      for (const end of ["x1", "x2"]) reading.querySelector(".cursor").setAttribute(end, along);
    });
  }

  /** The next episode of the list, or the previous one. */
  turn(by) {
    const index = this.listed.indexOf(this.episode) + by;
    if (0 <= index && index < this.listed.length) this.openEpisode(this.listed[index]);
  }

  onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const tag = event.target.tagName;
    // Controls with keys of their own keep them.
    if (tag === "SELECT" || tag === "SUMMARY" || (event.key === " " && (tag === "BUTTON" || event.target.type === "checkbox")) || (event.key.startsWith("Arrow") && tag === "INPUT" && event.target.type === "range")) return;
    const inside = byId("replay").contains(event.target), box = this.canvas.getBoundingClientRect();
    const visible = box.top < window.innerHeight && 0 < box.bottom;
    if (!inside && !(event.target === document.body && visible)) return;
    const actions = {
      " ": () => this.clock.play(!this.clock.playing), ArrowLeft: () => this.clock.move(event.shiftKey ? -10 : -1), ArrowRight: () => this.clock.move(event.shiftKey ? 10 : 1),
      // Outside the replay these two scroll the page.
      ...(inside ? { ArrowUp: () => this.turn(-1), ArrowDown: () => this.turn(1) } : {}),
    };
    if (!actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  }

  listen() {
    byId("route").addEventListener("change", (event) => this.openRoute(event.target.value));
    for (const id of ["rays", "follow"]) byId(id).addEventListener("change", () => this.show());
    document.addEventListener("keydown", (event) => this.onKey(event));
    window.addEventListener("hashchange", () => this.openLink());
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.show());
    new ResizeObserver(() => this.show()).observe(this.canvas);
    showSceneKeys(this.page);
  }
}
