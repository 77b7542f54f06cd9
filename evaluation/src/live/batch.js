// Trucks on one benchmark: their columns on the device, and the steps that they make.

/** Trucks that set out in each step, as a fraction of all: in one heap they would not be seen. */
const SETTING_OUT = 1 / 250;

class Batch {
  /** `n` trucks that are held until they set out. `routes` are those that episodes run on, without it all of the
   * benchmark; with `fixed` truck i drives routes[i] alone. `demand` is the index of the only one, without it episodes
   * draw theirs. */
  static async open(gpu, world, { n, seed = 0, routes = null, fixed = false, autoreset = "same_step", demand = null }) {
    const batch = new Batch(gpu, world, { n, routes, fixed, autoreset, demand });
    const { steps, begin } = world.facts;
    const names = [...new Set(["draw", ...steps[autoreset], ...begin])];
    const kernels = await gpu.kernels(names);
    for (const name of names) batch.kernels[name] = batch.bound(name, kernels[name]);
    batch.restart({ seed });
    return batch;
  }

  constructor(gpu, world, { n, routes, fixed, autoreset, demand }) {
    Object.assign(this, { gpu, world, n, autoreset, demand, live: gpu.live, code: gpu.live.facts.code });
    Object.assign(this, { kernels: {}, policy: null, acting: null, watched: [], own: null, busy: false });
    this.routes = routes ?? world.facts.routes.map((_, index) => index);
    this.ownAction = world.facts.n_actions;
    this.makeBuffers(fixed);
  }

  /** The batch's own buffers; the world's tables are shared. */
  makeBuffers(fixed) {
    const { gpu, n, code } = this;
    const { structs, columns, journal } = code;
    const hasRows = ({ kind, name }) =>
      kind === "column" && (this.world.facts.traffic || !columns[name].of_vehicles);
    this.columns = code.buffers.filter(hasRows).map(({ name }) => name);
    this.rowBytes = this.columns.reduce((sum, name) => sum + columns[name].bytes, 0);
    const facts = new DataView(new ArrayBuffer(structs.BatchFacts.size));
    const words = {
      n_envs: n,
      n_routes: this.routes.length,
      fixed: Number(fixed),
      autoreset: code.autoreset[this.autoreset],
      team: this.team(),
      group: 1,
    };
    writeWords(this.live, "BatchFacts", facts, 0, words);
    // Behind the benchmark's actions stands that of the truck that a person drives.
    const actions = this.world.bytes("actions");
    this.made = {
      actions: gpu.buffer("actions", actions.length + structs.Action.size, actions),
      batch: gpu.buffer("batch", facts.byteLength, facts, GPUBufferUsage.UNIFORM),
      choice: gpu.buffer("choice", 4 * this.routes.length, Uint32Array.from(this.routes)),
      streams: gpu.buffer("streams", n * structs.Stream.size),
      begins: gpu.buffer("begins", n * structs.BeginRow.size),
      tally: gpu.buffer("tally", 8 * (code.ended.length + 1)),
      journal: gpu.buffer("journal", journal.bytes),
      own: gpu.buffer("own", 4, Uint32Array.of(this.ownAction)),
    };
    if (this.demand !== null) {
      const lanes = this.world.lanesAt(this.demand);
      this.made.lanes = gpu.buffer("lanes", lanes.length, lanes);
    }
    for (const name of this.columns) this.made[name] = gpu.buffer(name, n * columns[name].bytes);
    this.buffers = { ...this.world.tables, ...this.made };
  }

  /** Trucks whose rays a workgroup shares. */
  team() {
    return this.code.teams.filter(([from]) => from <= this.n).at(-1)[1];
  }

  /** A kernel with its bind group and workgroups. */
  bound(name, { layout, pipeline }) {
    const { journal, buffers, workgroup, n_values: nValues, cars } = this.code;
    const isOwn = name in journal.kernels;
    const { bindings, threads } =
      isOwn ? { bindings: journal.kernels[name], threads: "truck" } : this.code.kernels[name];
    const pairs = bindings.map((binding) => [binding, this.buffers[buffers[binding].name]]);
    if (isOwn) pairs.push([journal.binding, this.buffers.journal]);
    const workgroups = {
      truck: Math.ceil(this.n / workgroup),
      value: Math.ceil((this.n * nValues) / workgroup),
      car: Math.ceil((this.n * cars.n) / workgroup),
      turn: Math.ceil((this.n * cars.turns) / workgroup),
      team: Math.ceil(this.n / this.team()),
    }[threads];
    return { pipeline, group: this.gpu.group(name, layout, pairs), workgroups };
  }

  close() {
    for (const buffer of Object.values(this.made)) buffer.destroy();
    this.acting?.close();
  }

  /** Holds all trucks, to set out one after another, `atOnce` in each step. */
  restart({ seed = this.seed, atOnce = Math.max(1, Math.round(this.n * SETTING_OUT)) } = {}) {
    const { gpu, n, code } = this;
    Object.assign(this, { seed, atOnce, begun: 0, steps: 0 });
    const encoder = gpu.device.createCommandEncoder();
    for (const name of [...this.columns, "begins", "tally", "journal"]) encoder.clearBuffer(this.buffers[name]);
    gpu.device.queue.submit([encoder.finish()]);
    const { size, fields } = code.structs.Truck;
    const trucks = new Uint32Array((n * size) / 4);
    for (let at = fields.held.at / 4; at < trucks.length; at += size / 4) trucks[at] = 1;
    gpu.device.queue.writeBuffer(this.buffers.truck, 0, trucks);
    gpu.device.queue.writeBuffer(
      this.buffers.streams,
      0,
      Uint32Array.from({ length: 2 * n }, (_, index) => (index % 2 === 0 ? seed : index >> 1)),
    );
  }

  /** Lets a policy choose the actions; without one they are random. */
  async setPolicy(policy) {
    const acting = policy === null ? null : await policy.on(this);
    this.acting?.close();
    Object.assign(this, { policy, acting });
  }

  /** Trucks of which `advance` gives the rows after every step. */
  watch(envs) {
    this.watched = [...envs];
  }

  /** Lets a person drive a truck: a steer angle (rad) and a speed, or change of the target speed (m/s). */
  takeOver(env, { steering, speed }) {
    const { size } = this.code.structs.Action;
    const action = new DataView(new ArrayBuffer(size));
    writeWords(this.live, "Action", action, 0, { steering, speed });
    this.gpu.device.queue.writeBuffer(this.buffers.actions, this.ownAction * size, action);
    this.own = env;
  }

  giveBack() {
    this.own = null;
  }

  /** Makes `k` steps, and resolves when the device has made them: to the rows of the watched trucks after each. */
  async advance(k) {
    if (this.busy) throw new Error("the batch is still making its last steps");
    this.busy = true;
    const { queue } = this.gpu.device;
    const watched = this.watched;
    const size = k * watched.length * this.rowBytes;
    const usage = GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST;
    const rows = size === 0 ? null : this.gpu.device.createBuffer({ label: "rows", size, usage });
    const first = this.steps;
    try {
      let encoder = this.gpu.device.createCommandEncoder();
      for (let step = 0; step < k; step++) {
        if (this.begun < this.n) {
          queue.submit([encoder.finish()]);
          this.setOut();
          encoder = this.gpu.device.createCommandEncoder();
        }
        this.encodeStep(encoder);
        watched.forEach((env, index) =>
          this.encodeRow(encoder, env, rows, (step * watched.length + index) * this.rowBytes),
        );
        this.steps += 1;
      }
      queue.submit([encoder.finish()]);
      await (rows === null ? queue.onSubmittedWorkDone() : rows.mapAsync(GPUMapMode.READ));
      if (rows === null) return { rows: [] };
      const bytes = new Uint8Array(rows.getMappedRange().slice(0));
      const count = k * watched.length;
      const row = (_, index) =>
        this.rowOf(
          bytes,
          index * this.rowBytes,
          watched[index % watched.length],
          first + 1 + Math.floor(index / watched.length),
        );
      return { rows: Array.from({ length: count }, row) };
    } finally {
      rows?.destroy();
      this.busy = false;
    }
  }

  /** The next trucks set out. */
  setOut() {
    const end = Math.min(this.n, this.begun + this.atOnce);
    this.begin(Array.from({ length: end - this.begun }, (_, index) => ({ env: this.begun + index })));
    this.begun = end;
  }

  /** Begins an episode of some trucks: each with the truck `of` of the batch with `seed`, the number of its episode,
   * and a route and a start where they are not to be drawn. */
  begin(requests) {
    const { gpu, code, live } = this;
    const { BeginRow, Truck, Stream } = code.structs;
    const { queue } = gpu.device;
    const begins = new DataView(new ArrayBuffer(this.n * BeginRow.size));
    for (const { env, seed = null, of = env, episode = 0, route = null, start = null } of requests) {
      const bits = [
        ["begins", true],
        ["is_first", episode === 0],
        ["has_route", route !== null],
        ["has_start", start !== null],
      ];
      const what = bits.reduce((sum, [bit, is]) => sum + (is ? code.begin[bit] : 0), 0);
      writeWords(live, "BeginRow", begins, env * BeginRow.size, { what, route: route ?? 0, start: start ?? {} });
      if (seed !== null) queue.writeBuffer(this.buffers.streams, env * Stream.size, Uint32Array.of(seed, of));
      // The next episode is the one asked for.
      if (episode > 0)
        queue.writeBuffer(this.buffers.truck, env * Truck.size + Truck.fields.episode.at, Uint32Array.of(episode - 1));
    }
    queue.writeBuffer(this.buffers.begins, 0, begins);
    const encoder = gpu.device.createCommandEncoder();
    const pass = encoder.beginComputePass();
    this.dispatch(pass, this.world.facts.begin);
    pass.end();
    queue.submit([encoder.finish()]);
  }

  /** All trucks begin at once, without a step. */
  beginAll() {
    this.atOnce = this.n;
    this.setOut();
  }

  dispatch(pass, names) {
    for (const name of names) {
      const { pipeline, group, workgroups } = this.kernels[name];
      this.gpu.dispatch(pass, pipeline, group, workgroups);
    }
  }

  /** A step: actions are chosen, one may be a person's, and all trucks drive. */
  encodeStep(encoder) {
    const pass = encoder.beginComputePass();
    if (this.acting === null) this.dispatch(pass, ["draw"]);
    else this.acting.dispatch(pass);
    pass.end();
    if (this.own !== null) encoder.copyBufferToBuffer(this.buffers.own, 0, this.buffers.action, 4 * this.own, 4);
    const rest = encoder.beginComputePass();
    this.dispatch(rest, this.world.facts.steps[this.autoreset]);
    rest.end();
  }

  /** Copies a truck's row of every column. */
  encodeRow(encoder, env, rows, at) {
    for (const name of this.columns) {
      const { bytes } = this.code.columns[name];
      encoder.copyBufferToBuffer(this.buffers[name], env * bytes, rows, at, bytes);
      at += bytes;
    }
  }

  /** The values of a truck's row, by column. */
  rowOf(bytes, at, env, step) {
    const row = { env, step };
    for (const name of this.columns) {
      row[name] = readRow(this.live, name, bytes, at);
      at += this.code.columns[name].bytes;
    }
    return row;
  }

  /** A truck's row now. */
  async row(env) {
    const parts = this.columns.map((name) => {
      const { bytes } = this.code.columns[name];
      return [this.buffers[name], env * bytes, bytes];
    });
    const read = await this.gpu.read(parts);
    const bytes = new Uint8Array(this.rowBytes);
    read.reduce((at, part) => (bytes.set(new Uint8Array(part), at), at + part.byteLength), 0);
    return this.rowOf(bytes, 0, env, this.steps);
  }

  /** The bytes of a whole column. */
  async column(name) {
    return (await this.gpu.read([[this.buffers[name], 0, this.n * this.code.columns[name].bytes]]))[0];
  }

  /** Sums over all steps since the restart. */
  async tally() {
    const { ended: names, reward_units: units } = this.code;
    const [bytes] = await this.gpu.read([[this.buffers.tally, 0, 8 * (names.length + 1)]]);
    const sums = [...new BigInt64Array(bytes)];
    const ended = Object.fromEntries(names.map((name, index) => [name, Number(sums[index])]));
    const all = names.reduce((sum, name) => sum + ended[name], 0);
    const episodes = all - ended.running;
    return {
      env_steps: all,
      episodes,
      ended,
      success: ended.arrived / episodes,
      reward: Number(sums.at(-1)) / units,
      sums: sums.map(String),
    };
  }

  /** The latest failures since the restart, the latest first. */
  async failures() {
    const { journal, structs, ended } = this.code;
    const [bytes] = await this.gpu.read([[this.buffers.journal, 0, journal.bytes]]);
    const count = new Uint32Array(bytes, 0, 1)[0];
    const found = (_, index) => {
      const place = (count - 1 - index) % journal.room;
      const failure = readStruct(
        this.live,
        "Failure",
        new Uint8Array(bytes),
        journal.head + place * structs.Failure.size,
      );
      return { ...failure, ended: ended[failure.ended], seed: this.seed };
    };
    return Array.from({ length: Math.min(count, journal.room) }, found);
  }

  /** Layout and bind group of group 0 for a picture: where each buffer is visible, by its name. */
  group0(visibilities) {
    const { buffers, journal } = this.code;
    const bound = Object.entries(visibilities).map(([name, visibility]) => {
      const binding = name === "journal" ? journal.binding : buffers.findIndex((buffer) => buffer.name === name);
      const access = buffers[binding]?.access === "uniform" ? "uniform" : "read";
      return { name, binding, access, visibility };
    });
    const layout = this.gpu.layout("picture", bound);
    return {
      layout,
      group: this.gpu.group(
        "picture",
        layout,
        bound.map(({ name, binding }) => [binding, this.buffers[name]]),
      ),
    };
  }
}
