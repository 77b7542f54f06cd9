// A batch of trucks with what the page knows of it: its figures, the truck that is followed and how it drove.

/** Steps of the followed truck that are kept. */
const MOST_STEPS = 1024;
/** Time over which a speed is averaged (ms). */
const AVERAGED = 3000;

class Crowd {
  /** Policies that crowds have taken. */
  static taken = 0;

  /** A crowd on `world` driven by `policy`; `routes` are those that trucks draw from. */
  static async open({ picture, gpu, world, sites, options, policy }) {
    const made = new Crowd(), batch = await Batch.open(gpu, world, options);
    try {
      Object.assign(made, { batch, world, followed: null, row: null, steps: [], rigs: new Map() });
      await made.take(policy);
      made.picture = await BatchPicture.open(picture, batch, sites);
    } catch (error) {
      batch.close();
      throw error;
    }
    return made;
  }

  /** Takes a policy, without any figures of its own yet. */
  async take(policy) {
    await this.batch.setPolicy(policy).catch((error) => {
      throw new Error(`${policy.name} ${error.message}.`);
    });
    // Episodes that the visitor drove, at least in part, and what those begin with that he gave another load:
    // "truck/episode".
    Object.assign(this, { policy, driven: new Set(), loaded: new Map(), tally: null, failures: [], moments: [] });
    this.taken = Crowd.taken += 1;
  }

  /** All trucks begin again by this policy, from the same seed. */
  async driveBy(policy) {
    await this.take(policy);
    this.batch.restart();
    await this.follow(this.followed);
  }

  close() {
    this.closed = true;
    this.picture.close();
    this.batch.close();
  }

  /** Follows a truck, or none. */
  async follow(env) {
    this.followed = env;
    this.batch.watch(env === null ? [] : [env]);
    this.forgetSteps();
    this.row = env === null ? null : await this.batch.row(env);
    if (this.row) this.add(this.row);
  }

  forgetSteps() {
    this.steps = [];
    this.last = null;
    this.picture.setPath([]);
  }

  /** Makes `count` steps. */
  async advance(count) {
    const { rows } = await this.batch.advance(count);
    if (this.closed) return;
    const own = rows.filter((row) => row.env === this.followed);
    for (const row of own) {
      this.add(row);
      this.row = row;
      if (row.ended !== 0) this.last = { ended: row.ended };
    }
    if (0 < own.length) this.picture.setPath(this.steps.map((step) => step.points));
  }

  /** Keeps a step of the followed truck. */
  add(row) {
    // One that has not set out is nowhere.
    if (row.truck.held === 1 && row.truck.steps === 0) return;
    const before = this.steps.at(-1);
    if (before && before.episode !== row.truck.episode) this.steps = [];
    const { position, heading, episode } = row.truck, trailer = this.trailerOf(row.truck), rig = this.rigOf(row.truck);
    const front = [Math.cos, Math.sin].map((along, axis) => position[axis] + rig.wheelbase * along(heading));
    const last = this.steps.at(-1);
    const way = last ? last.way + Math.hypot(front[0] - last.front[0], front[1] - last.front[1]) : 0;
    this.steps.push({ row, episode, points: [...position, ...trailer], front, trailer, way });
    this.steps.at(-1).offTracking = offTrackingAt(this.steps, rig);
    if (MOST_STEPS < this.steps.length) this.steps.shift();
  }

  /** Middle of the trailer's axles (m). */
  trailerOf(truck) {
    return trailerMiddle(this.rigOf(truck), truck.position, truck.heading, truck.trailer_heading);
  }

  rigOf({ vehicle }) {
    if (!this.rigs.has(vehicle)) this.rigs.set(vehicle, this.world.vehicle(vehicle).rig);
    return this.rigs.get(vehicle);
  }

  /** The vehicles around the followed truck: how many, how many of them slow for it, and how many come (veh/h). */
  vehicles() {
    const { cars } = this.batch.code, { demand } = this.world.facts.traffic, words = this.row.cars;
    const slots = Array.from({ length: cars.n }, (_, slot) => slot);
    const isThere = (slot) => (words[slot * cars.words + cars.what] & cars.none) !== cars.none;
    const there = slots.filter(isThere), slow = there.filter((slot) => (words[cars.hindered] >>> slot) & 1);
    return { n: there.length, slow: slow.length, demand: demand[this.batch.demand ?? words[cars.level]] };
  }

  /** -1 where the followed truck's road is mirrored back: what it does to the left is seen to the right. */
  get side() {
    return this.row === null ? 1 : this.picture.sites.sideOf(this.row.truck.route);
  }

  /** Where the followed truck is in the picture (m), moved on by `since` seconds as view.wgsl does it. */
  middle(since) {
    const { truck } = this.row, rig = this.rigOf(truck);
    const way = truck.held ? 0 : truck.speed * since, turn = (way * Math.tan(truck.steering)) / rig.wheelbase;
    const along = truck.heading + turn / 2, position = [way * Math.cos(along), way * Math.sin(along)]
      .map((moved, axis) => truck.position[axis] + moved);
    const trailer_heading = truck.trailer_heading +
      (way * Math.sin(truck.heading - truck.trailer_heading)) / rig.trailer_wheelbase;
    const trailer = this.trailerOf({ ...truck, position, heading: truck.heading + turn, trailer_heading });
    return this.picture.sites.placed(truck.route, position.map((at, axis) => 0.6 * at + 0.4 * trailer[axis]));
  }

  /** Reads the sums and the failures. */
  async count() {
    const [tally, failures] = [await this.batch.tally(), await this.batch.failures()];
    if (this.closed) return;
    Object.assign(this, { tally, failures });
    this.moments.push([performance.now(), tally.env_steps]);
    while (2 < this.moments.length && AVERAGED < this.moments.at(-1)[0] - this.moments[0][0]) this.moments.shift();
  }

  /** Env steps a second over the last seconds. */
  get speed() {
    if (this.moments.length < 2) return NaN;
    const [[t0, n0], [t1, n1]] = [this.moments[0], this.moments.at(-1)];
    return (1000 * (n1 - n0)) / (t1 - t0);
  }

  /** Index of the truck nearest to a point of the picture, within `reach`; null where there is none. All (m). */
  async nearest(point, reach) {
    const { onRoad } = this.picture.sites, { fields, size } = this.picture.picture.live.facts.code.structs.Truck;
    const bytes = new DataView(await this.batch.column("truck"));
    let found = null, least = reach;
    for (let env = 0; env < this.batch.n; env++) {
      const float = (name, more = 0) => bytes.getFloat32(env * size + fields[name].at + more, true);
      const word = (name) => bytes.getUint32(env * size + fields[name].at, true);
      if (word("held") === 1) continue;
      const [toX, toY] = onRoad(word("route"), point);
      // Also a click on the trailer finds the truck.
      const [x, y] = [float("position"), float("position", 4)], heading = float("trailer_heading");
      for (const back of [0, 4, 8]) {
        const away = Math.hypot(x - back * Math.cos(heading) - toX, y - back * Math.sin(heading) - toY);
        if (away < least) [found, least] = [env, away];
      }
    }
    return found;
  }
}

/** How far the trailer's axles are from the path of the tractor's front axle, as evaluations have it (m); null where the
 * path that is known does not reach back to them. */
function offTrackingAt(steps, { wheelbase, trailer_wheelbase }) {
  const { trailer: [x, y], way } = steps.at(-1), longest = 2 * (wheelbase + trailer_wheelbase);
  const first = steps.findLastIndex((step) => longest < way - step.way), path = steps.slice(Math.max(first, 0));
  const { front, row: { truck } } = path[0], begins = first < 0 && truck.steps === 0;
  // Before its start a truck came straight on.
  const before = begins ? [[Math.cos, Math.sin].map((along, axis) => front[axis] - longest * along(truck.heading))] : [];
  const points = [...before, ...path.map((step) => step.front)];
  let least = Infinity, isOutside = true;
  for (let n = 1; n < points.length; n++) {
    const [ax, ay] = points[n - 1], [bx, by] = points[n], [dx, dy] = [bx - ax, by - ay];
    const at = Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1e-9), 0), 1);
    const away = Math.hypot(ax + at * dx - x, ay + at * dy - y);
    if (away < least) [least, isOutside] = [away, n === 1 && at === 0];
  }
  return isOutside ? null : least;
}
