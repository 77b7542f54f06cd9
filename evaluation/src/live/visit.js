// What a visitor does with single trucks: follows one, drives it, loads it otherwise, lets a failure happen again.

class Visit {
  constructor(app) {
    Object.assign(this, { app, focus: null, again: null, driving: new Driving(), pointer: null });
    this.panel = new Followed(app.live);
  }

  get stage() {
    return this.app.stage;
  }

  /** Follows a truck of a crowd; in another pane the truck of the same index. */
  async pick(env, crowd = this.app.crowds[0]) {
    this.endAgain();
    this.giveBack();
    await Promise.all(this.app.crowds.map((one) => one.follow(env)));
    this.open(crowd);
    if (!this.stage.camera.goesAlong) this.stage.camera.follow();
  }

  /** Follows the next truck that has set out, or the one before. */
  async pickNext(by) {
    const crowd = this.again?.from ?? this.focus ?? this.app.crowds[0];
    // Before the first trucks are there.
    if (crowd === undefined || crowd.closed) return;
    const { batch, followed } = crowd;
    const n = Math.max(Math.min(batch.begun, batch.n), 1);
    await this.pick((((followed ?? -by) + by) % n + n) % n, this.again?.from ?? this.focus ?? undefined);
  }

  /** Shows the panel of a crowd's truck. */
  open(crowd) {
    this.focus = crowd;
    this.panel.open(crowd);
    this.showLoads();
    this.showState();
    showLegend(this.app);
  }

  /** Goes back to all roads. */
  async leave() {
    this.giveBack();
    this.endAgain();
    const { crowds } = this.app;
    await Promise.all(crowds.filter((crowd) => !crowd.closed).map((crowd) => crowd.follow(null)));
    this.open(null);
    if (0 < crowds.length) this.stage.fit();
  }

  /** Lets the wheel go, or else goes back to all. */
  async escape() {
    if (this.driving.isOn) this.giveBack();
    else await this.leave();
  }

  /** Takes the wheel of the followed truck, or of the first one that is seen; lets it go. */
  async toggleWheel() {
    if (this.driving.isOn) {
      this.giveBack();
      return;
    }
    // What happens again is not steered.
    if (this.again !== null) return;
    if (this.focus === null) await this.pickNext(1);
    if (this.focus !== null) this.takeOver();
  }

  /** Takes over the followed truck; `asked` is a steer angle (rad) and a target speed (m/s). */
  takeOver(asked) {
    if (!this.driving.isOn) {
      this.driving.takeOver(this.focus);
      this.app.play(true);
      // At another speed of time nobody could steer.
      if (1 < this.app.rate || this.app.rate === 0) this.app.setRate(1);
    }
    if (asked) this.driving.set(asked);
    this.showState();
    byId("picture").focus({ preventScroll: true });
    byId("stage").scrollIntoView({ block: "nearest" });
  }

  giveBack() {
    if (!this.driving.isOn) return;
    this.driving.giveBack();
    this.showState();
  }

  /** Follows keys and pointer for some seconds. */
  update(seconds) {
    if (!this.driving.isOn) return;
    this.driving.point = this.pointer && this.stage.pointAt(this.focus, this.pointer);
    this.driving.update(seconds);
  }

  /** Lets a failure happen again: a batch of one truck with the same stream, episode and policy. */
  async driveAgain(crowd, failure) {
    const { app } = this;
    if (crowd.closed) return;
    this.giveBack();
    this.endAgain();
    await Promise.all(app.crowds.map((one) => one.follow(null)));
    const { env, seed, episode } = failure;
    const options = { n: 1, seed, routes: app.routes, autoreset: "disabled", demand: crowd.batch.demand };
    const { picture, gpu, world, sites } = app;
    const again = await Crowd.open({ picture, gpu, world, sites, options, policy: crowd.policy });
    Object.assign(again, { from: crowd, failure });
    again.batch.begin([{ env: 0, seed, of: env, episode, ...crowd.loaded.get(`${env}/${episode}`) }]);
    // It has set out: its first episode is not to begin in the next step.
    again.batch.begun = 1;
    await again.follow(0);
    this.again = again;
    app.forgetWork();
    this.open(again);
    this.stage.camera.follow();
    app.play(true);
  }

  async latestFailure() {
    const seen = this.focus?.from ?? this.focus;
    const crowd = [seen, ...this.app.crowds].find((one) => one !== null && 0 < one.failures.length);
    if (crowd) await this.driveAgain(crowd, crowd.failures[0]);
    else this.app.say("No episode has failed yet.");
  }

  endAgain() {
    if (this.again === null) return;
    this.again.close();
    this.again = null;
    this.app.forgetWork();
  }

  /** The loads of the followed truck's vehicle, in the order of the benchmark. */
  loads() {
    const { world, row } = this.focus, { classes, vehicles } = world.facts;
    const { vehicle, load } = classes[vehicles[row.truck.vehicle]];
    const own = classes.flatMap((one, index) => (one.vehicle === vehicle ? [{ load: one.load, index }] : []));
    return { own, at: own.findIndex((one) => one.load === load) };
  }

  showLoads() {
    const found = this.focus?.row && !this.again ? this.loads() : { own: [] };
    byId("load-part").hidden = found.own.length < 2;
    if (found.own.length < 2) return;
    byId("load").max = found.own.length - 1;
    byId("load").value = found.at;
    byId("load-words").textContent = loadWords(found.own[found.at].load);
    byId("load").setAttribute("aria-valuetext", byId("load-words").textContent);
  }

  /** The followed truck begins its route again with another load, on the lane's centre. */
  async setLoad(at) {
    // The visitor may have gone back before the frame was done.
    if (this.focus === null) return;
    const { focus } = this, { world, row, followed } = focus, { vehicles } = world.facts;
    const wanted = this.loads().own[at].index, now = focus.rigOf(row.truck);
    const unlike = (vehicle) => {
      const rig = focus.rigOf({ vehicle });
      const names = ["wheelbase", "fifth_wheel", "trailer_wheelbase"];
      return names.reduce((sum, name) => sum + Math.abs(rig[name] - now[name]), 0);
    };
    const fitting = vehicles.flatMap((index, vehicle) => (index === wanted ? [vehicle] : []));
    const vehicle = fitting.reduce((best, one) => (unlike(one) < unlike(best) ? one : best));
    const start = { offset: 0, heading: 0, speed: 0, vehicle };
    const { episode, route } = row.truck;
    focus.batch.begin([{ env: followed, episode, route, start }]);
    focus.loaded.set(`${followed}/${episode}`, { route, start });
    focus.forgetSteps();
    focus.row = await focus.batch.row(followed);
    focus.add(focus.row);
    this.showLoads();
    this.panel.show(true);
  }

  /** Who drives, and how the last episode ended. */
  showState() {
    const { focus, again, driving } = this, on = driving.isOn;
    byId("stage").classList.toggle("steering", on);
    const wheel = on ? "Let go" : "Take the wheel";
    byId("wheel").textContent = wheel;
    byId("wheel").setAttribute("aria-pressed", String(on));
    byId("wheel").hidden = again !== null;
    byId("pick").textContent = focus === null || again !== null ? "Follow a truck" : wheel;
    byId("hud").hidden = !on;
    if (focus === null) return;
    const byPolicy = again ? this.againWords() : `Driven by ${policyWords(focus.policy)}${this.lastWords()}`;
    const text = on ? "You drive: A D or drag to steer, W S for speed" : byPolicy;
    const sentence = text[0].toUpperCase() + text.slice(1);
    if (byId("truck-state").textContent !== sentence) byId("truck-state").textContent = sentence;
  }

  /** How the truck's episode before this one ended. */
  lastWords() {
    const { last } = this.focus;
    return last === null ? "" : `; ${endWords(this.app.live.facts.code.ended[last.ended])} before`;
  }

  /** What has become of a failure that is driven again. */
  againWords() {
    const { failure, from, row, world } = this.again, code = this.app.live.facts.code.ended[row.ended];
    const seconds = (steps) => `${decimal(steps * world.facts.step, 1)}${GAP}s`;
    const yours = from.driven.has(`${failure.env}/${failure.episode}`), name = policyWords(from.policy);
    const before = `${endWords(failure.ended)} after ${seconds(failure.steps)}`;
    if (row.ended === 0) return yours ? `You: ${before}. ${name} now` : `Again: ${before}`;
    const same = code === failure.ended && row.truck.steps === failure.steps;
    const now = `${endWords(code)} after ${seconds(row.truck.steps)}`;
    return yours ? `You: ${before}. ${name}: ${now}` : `${now}${same ? ", as before" : ""}`;
  }

  /** Says in the panel how an episode of the followed truck has just ended. */
  notice() {
    const { focus } = this;
    if (focus === null) return;
    this.showState();
    if (focus.last === null || focus.last === this.noticed) return;
    this.noticed = focus.last;
    this.showLoads();
    const word = this.app.live.facts.code.ended[focus.last.ended];
    if (!this.driving.isOn) return;
    const isBad = word !== "arrived";
    this.app.say(`${isBad ? `The episode ended: ${endWords(word)}` : "You arrived"}. Another route begins.`, isBad);
  }

  /** A pointer is on the picture (pixels), or no more. */
  pointAt(at, count) {
    this.pointer = this.driving.isOn && count === 1 && at ? this.inPane(at).at : null;
  }

  isSteering() {
    return this.driving.isOn;
  }

  inPane(at) {
    return this.stage ? this.stage.inPane(at) : { at };
  }

  pan(right, down) {
    this.stage?.camera.move(right, down);
  }

  zoom(factor, at) {
    this.stage?.camera.zoom(factor, at);
  }

  /** A click follows the truck within reach of it (pixels). */
  async click(at, reach) {
    await this.app.attempt(async () => {
      const { crowd, at: pixel } = this.inPane(at);
      const env = await crowd.nearest(this.stage.pointAt(crowd, pixel), Math.max(reach * this.stage.camera.pixel, 3));
      if (env !== null) await this.pick(env, crowd);
    });
  }
}
