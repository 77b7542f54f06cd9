// The page: what is chosen, which crowds there are, and the loop that steps and draws them.
//
// A frame's work is submitted when that of the frame before is done, so that nothing queues up on a slow device.

/** Figures are read this often (ms); work of a frame that is aimed at (ms), and most of it that time may ask for. */
const COUNT_EVERY = 500, FRAME_WORK = 20, MOST_WORK = 120;
/** Trucks that the page begins with. */
const MANY = 4096;
/** Reach of a click and of a finger (pixels); how long something stays said (ms). */
const REACH = 14, FINGER_REACH = 26, SAID_FOR = 6000;
/** A device that is lost says so at most this long after what comes of it (ms). */
const LOST_WITHIN = 100;
const COMPILING = "Compiling the shaders of the simulator for this device.";

class App extends Scripted {
  constructor(live) {
    super();
    this.live = live;
    this.policies = live.facts.policies.map(({ reported }, index) =>
      Object.assign(Policy.shipped(live, index), { reported }));
    Object.assign(this, { crowds: [], playing: true, rate: 2, debt: 0, colouring: 0, pending: {} });
    live.facts.worlds.forEach((world, index, all) => tellApart(all.slice(0, index), world));
    this.frames = Promise.resolve();
    this.learned = new Learned(this);
    this.baker = new Baker(this);
    this.visit = new Visit(this);
    this.failures = new FailureList((crowd, failure) => this.attempt(() => this.visit.driveAgain(crowd, failure)));
    const { seed } = live.facts;
    const world = Math.max(live.facts.worlds.findIndex((_, index) => this.canDrive(this.learned.last ?? -1, index)), 0);
    const policy = this.firstPolicy(world);
    // `atRandom` is whether no policy could drive: the visitor did not ask for random actions.
    this.chosen = { world, road: "", policy, atRandom: policy === -1, second: null, demand: null, n: MANY, seed };
    this.ready = new Promise((done) => (this.isReady = done));
    listenToChoices(this);
    listenToKeys(this);
    listenToFiles(this);
    listenToPointers(byId("picture"), this.visit);
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.picture?.paint());
    new ResizeObserver(() => this.resized()).observe(byId("picture"));
  }

  /** Opens the device and begins. `options` override what is chosen. What is asked for meanwhile waits. */
  start(options = {}) {
    const opened = this.opened(options);
    this.frames = opened.catch(() => {});
    return opened;
  }

  async opened(options) {
    // Where this fails, the next start has them.
    this.pending = { ...this.pending, ...options };
    byId("missing").hidden = true;
    this.keepSaying(COMPILING);
    // A device that failed goes, with all its memory.
    const failed = this.gpu;
    this.run = this.gpu = null;
    failed?.destroy();
    this.crowds = [];
    Object.assign(this.visit, { again: null, focus: null });
    let gpu;
    try {
      gpu = this.gpu = await openDevice(this.live);
      gpu.lost.then((message) => this.gpu === gpu && this.sayMissing("lost", message));
      gpu.failed.then((message) => this.fail(gpu, message));
      this.picture = new Picture(this.live, gpu);
      this.stage = new Stage(gpu, this.picture);
      if (isSoftware(gpu)) this.chosen.n = Math.min(this.chosen.n, FEW);
      await this.take(this.pending);
      if (!byId("missing").hidden) return;
      this.pending = {};
      // What is baked meanwhile stays said.
      if (byId("said").textContent === COMPILING) byId("said").hidden = true;
      this.isReady(this);
      this.loop();
    } catch (error) {
      if (error instanceof NoDevice) this.sayMissing(error.kind, error.message);
      else await this.fail(gpu, error.message);
    }
  }

  /** Says that a device failed, unless it is lost or another one is open. */
  async fail(gpu, message) {
    await Promise.race([gpu.lost, new Promise((next) => setTimeout(next, LOST_WITHIN))]);
    if (this.gpu === gpu && byId("missing").hidden) this.sayMissing("failed", message);
  }

  /** An error where no trucks are, and where they stand because the device is gone. */
  needDevice() {
    if (0 < this.crowds.length && byId("missing").hidden) return;
    throw new Error("No trucks can drive here: no graphics device is open.");
  }

  /** Says why nothing runs. */
  sayMissing(kind, message) {
    const [title, words] = MISSING[kind];
    this.run = null;
    if (kind === "failed") {
      // With fewer trucks it may go on.
      const { n } = { ...this.chosen, ...this.pending };
      this.pending.n = Math.min(n, Math.max(COUNTS[0], Math.floor(n / 4)));
    }
    byId("missing-title").textContent = title;
    byId("missing-words").textContent = kind === "webgpu" ? words : `${words} (${message})`;
    byId("missing").dataset.kind = kind;
    byId("said").hidden = true;
    byId("missing").hidden = false;
  }

  /** Says something for a while. */
  say(text, isBad = false) {
    const node = byId("said");
    node.textContent = text;
    node.className = isBad ? "bad" : "";
    node.hidden = false;
    clearTimeout(this.silence);
    this.silence = setTimeout(() => (node.hidden = true), SAID_FOR);
    return text;
  }

  /** Says something until something else is said. */
  keepSaying(text) {
    this.say(text);
    clearTimeout(this.silence);
  }

  /** Does something between two frames: no step is under way then. Without a device it is an error. */
  between(act) {
    const done = this.frames.then(() => {
      this.needDevice();
      return act();
    });
    this.frames = done.catch(() => {});
    return done;
  }

  /** Does something that a visitor asked for, between two frames. What goes wrong is said. */
  async attempt(act) {
    try {
      return await this.between(act);
    } catch (error) {
      return this.say(error.message, true);
    }
  }

  /** The index of the policy that drives first on a world: that of a training run, else the first that can; -1, random
   * actions, without one. */
  firstPolicy(world) {
    const { last } = this.learned;
    if (last !== null && this.canDrive(last, world)) return last;
    return this.policies.findIndex((_, index) => this.canDrive(index, world));
  }

  canDrive(policy, world) {
    return policy === -1 || this.policies[policy].check({ facts: this.live.facts.worlds[world] }) === null;
  }

  /** Takes a choice and begins with it. */
  async choose(change) {
    this.needDevice();
    return this.take(change);
  }

  async take(change) {
    const before = this.chosen, chosen = { ...before, ...change };
    if (change.policy !== undefined) chosen.atRandom = false;
    if (chosen.world !== before.world) {
      Object.assign(chosen, { road: change.road ?? "", demand: null });
      if (chosen.atRandom || !this.canDrive(chosen.policy, chosen.world)) {
        chosen.policy = this.firstPolicy(chosen.world);
        chosen.atRandom = chosen.policy === -1;
      }
      if (chosen.second !== null && !this.canDrive(chosen.second, chosen.world)) chosen.second = null;
    }
    this.chosen = chosen;
    try {
      await this.open();
    } catch (error) {
      // What drove before goes on.
      this.chosen = before;
      throw error;
    } finally {
      showChoices(this);
    }
  }

  /** Opens the crowds of what is chosen. Those before go when these are there. */
  async open() {
    const { chosen, gpu, picture } = this, world = await gpu.world(chosen.world);
    const { routes, roads, split } = chosenRoutes(world.facts, chosen.road);
    const shown = [chosen.policy, ...(chosen.second === null ? [] : [chosen.second])];
    this.stage.measure();
    const { clientWidth, clientHeight } = byId("picture");
    const sites = sitesOf(world.facts, roads, clientWidth / shown.length / Math.max(clientHeight, 1));
    const options = { n: chosen.n, seed: chosen.seed, routes, demand: chosen.demand };
    const made = [];
    try {
      for (const index of shown) {
        made.push(await Crowd.open({ picture, gpu, world, sites, options, policy: this.policies[index] ?? null }));
      }
    } catch (error) {
      made.forEach((crowd) => crowd.close());
      throw error;
    }
    await this.visit.leave();
    const old = this.crowds;
    Object.assign(this, { crowds: made, world, sites, routes, split });
    this.forgetWork();
    old.forEach((crowd) => crowd.close());
    this.stage.show(made);
    this.stage.fit();
    this.name();
    this.showFigures();
  }

  /** Forgets the last world, on which trucks do not drive. */
  forgetWorld(index) {
    this.live.facts.worlds.pop();
    this.gpu?.worlds.splice(index);
    showChoices(this);
  }

  /** The first crowd drives by another policy, and all trucks begin again from the same seed. The view stays. */
  async driveBy(index) {
    const { crowds, policies, visit } = this, [first, ...others] = crowds;
    if (index === this.chosen.policy) return;
    if (visit.again !== null) await visit.leave();
    visit.giveBack();
    await first.driveBy(policies[index]);
    for (const crowd of others) await crowd.driveBy(crowd.policy);
    this.chosen = { ...this.chosen, policy: index, atRandom: false };
    this.forgetWork();
    this.stage.show(crowds);
    visit.open(visit.focus);
    this.name();
    this.showFigures();
    showChoices(this);
  }

  /** The heading says how many trucks there are. */
  name() {
    const { crowds, chosen } = this, n = crowds.reduce((sum, { batch }) => sum + batch.n, 0);
    byId("heading").textContent = `${whole(n)} tractor-trailers drive roundabouts, live in this page`;
    const one = chosen.policy === -1 ? "random actions" : "the same learned policy";
    const by = chosen.second === null ? one : "one of two policies, the same start on both sides";
    const where = this.world.facts.traffic ? "among vehicles of its own" : "alone";
    byId("sentence").textContent = `Each drives ${where}, by ${by}. Click one and take the wheel.`;
  }

  /** Steps that `seconds` of the page are. */
  stepsOf(seconds) {
    const most = (work) => Math.min(Math.max(Math.floor(work / (this.stepWork ?? MOST_WORK)), 1), 64);
    // Until all trucks have set out, time runs as fast as it can.
    if (this.rate === 0 || this.isFilling) return most(FRAME_WORK);
    this.debt += (seconds * this.rate) / this.world.facts.step;
    const steps = Math.min(Math.floor(this.debt), most(MOST_WORK));
    // Time that the device cannot make up for is dropped.
    this.debt = Math.min(this.debt - steps, 1);
    return Math.max(steps, 0);
  }

  /** Other trucks move from now on: what a step took tells nothing of theirs. */
  forgetWork() {
    this.debt = 0;
    this.stepWork = undefined;
  }

  /** Whether trucks are still to set out while nobody looks at a single one. */
  get isFilling() {
    return this.visit.focus === null && this.crowds.some(({ batch }) => batch.begun < batch.n);
  }

  /** The crowds that move: a failure that is driven again stops the others. */
  get moving() {
    const { again } = this.visit;
    return again === null ? this.crowds : [again].filter(({ row }) => row.ended === 0);
  }

  /** Makes steps of everything that moves. */
  async steps(count) {
    const begun = performance.now(), { moving } = this;
    if (moving.length === 0) return;
    await Promise.all(moving.map((crowd) => crowd.advance(count)));
    const work = (performance.now() - begun) / count;
    this.stepWork = this.stepWork === undefined ? work : 0.8 * this.stepWork + 0.2 * work;
    this.visit.notice();
  }

  /** Runs until another loop begins or the device is lost. */
  async loop() {
    const run = (this.run = {});
    let before = performance.now(), counted = 0;
    const frame = () => new Promise((next) => requestAnimationFrame(next));
    try {
      for (;;) {
        await frame();
        if (this.run !== run) return;
        const now = performance.now(), seconds = Math.min((now - before) / 1000, 0.25);
        before = now;
        const count = this.playing ? this.stepsOf(seconds) : 0;
        if (this.playing) this.visit.update(seconds);
        // While nothing moves no figure changes.
        const isDue = 0 < count && COUNT_EVERY < now - counted;
        if (isDue) counted = now;
        await this.between(() => this.frame(count, isDue));
      }
    } catch (error) {
      if (this.run === run) await this.fail(this.gpu, error.message);
    }
  }

  /** Some steps, a picture, and now and then the figures. */
  async frame(steps, isDue) {
    if (0 < steps) await this.steps(steps);
    this.draw();
    this.visit.panel.show();
    if (isDue) await this.count();
    await this.gpu.device.queue.onSubmittedWorkDone();
  }

  async count() {
    for (const crowd of this.crowds) await crowd.count();
    this.showFigures();
  }

  showFigures() {
    showResults(this.live, this.crowds, this.split);
    this.failures.show(this.crowds);
  }

  get scene() {
    const since = this.rate === 0 || this.isFilling ? 0 : Math.min(this.debt, 1) * this.world.facts.step;
    return { again: this.visit.again, since, colouring: this.colouring, rays: byId("rays").checked };
  }

  draw() {
    this.stage.draw(this.scene);
  }

  resized() {
    if (!this.stage || this.crowds.length === 0) return;
    const { isFitted } = this.stage.camera;
    this.stage.measure();
    if (isFitted) this.stage.fit();
  }

  play(playing) {
    this.playing = playing;
    showPlaying(byId("play"), playing);
    if (!playing) this.crowds.forEach((crowd) => (crowd.moments = []));
    if (0 < this.crowds.length) this.showFigures();
  }

  setRate(rate) {
    this.rate = rate;
    this.debt = 0;
    byId("rate").value = rate;
  }

  setColouring(colouring) {
    this.colouring = colouring;
    byId("colouring").value = colouring;
    showLegend(this);
  }

  /** The index of a world that a policy can drive on, this one before all others. An error says why there is none. */
  worldFor(policy) {
    const { worlds } = this.live.facts, order = [this.chosen.world, ...worlds.keys()];
    const found = order.find((index) => policy.check({ facts: worlds[index] }) === null);
    if (found !== undefined) return found;
    // A benchmark with the same extras says best what is different.
    const nearest = worlds.find(({ extras }) => extras.join() === policy.extras.join()) ?? worlds[order[0]];
    throw new Error(`${policy.name} ${policy.check({ facts: nearest })}.`);
  }

  /** Adds a policy to those to choose from, and drives by it. */
  async addPolicy(policy, world) {
    this.policies.push(policy);
    try {
      await this.choose({ world, policy: this.policies.length - 1 });
    } catch (error) {
      this.policies.pop();
      showChoices(this);
      throw error;
    }
  }

  /** Takes a file that was dropped or chosen; what is said on the page. */
  async dropFile(name, bytes) {
    if (this.baker.takes(name)) return this.baker.file(name, bytes);
    if (isWorldFile(this.live, bytes)) this.baker.leave();
    return this.attempt(async () => this.say(await takeFile(this, name, bytes)));
  }
}
