// A policy: a network from an observation to one value an action. On the device one kernel takes the observations of a
// batch where they lie and writes its actions.

class Policy {
  /** Reads a policy file's bytes. What is wrong with it is an error in words. */
  static read(live, name, bytes) {
    try {
      return Policy.parsed(live, name, bytes);
    } catch (error) {
      if (!(error instanceof TypeError || error instanceof RangeError)) throw error;
      throw new Error("is a damaged policy file: its description is of another form");
    }
  }

  static parsed(live, name, bytes) {
    const { policy: file, act, n_values: nValues, n_around: nAround, extras: known } = live.facts.code;
    if (file.most_bytes < bytes.length) throw new Error("is larger than any policy file");
    const { metadata, tensor } = readTensors(bytes);
    const text = metadata[file.key];
    if (text === undefined) throw new Error(`is not a policy file: its metadata has no entry “${file.key}”`);
    let description;
    try {
      description = JSON.parse(text);
    } catch {
      throw new Error("is a damaged policy file: its description is no JSON");
    }
    const {
      version,
      benchmark,
      actions,
      layers: nLayers,
      extras = [],
      vehicles = false,
      activation = act.activations[0],
      checksum,
    } = description;
    if (!file.versions.includes(version))
      throw new Error(
        `is a policy file of version ${version}; this page reads versions ${file.versions.join(" and ")}`,
      );
    const more = ["head", "squash", "values", "frames", "padding", "recurrent"].find((key) => key in description);
    if (more !== undefined)
      throw new Error(
        `has the key “${more}”: a page drives by layers over the values of one step, with an output an action`,
      );
    const isAction = (row) => Array.isArray(row) && row.length === 2 && row.every(Number.isFinite);
    if (!(1 <= nLayers && nLayers <= act.most_layers) || !(actions?.length > 0))
      throw new Error("is a damaged policy file: it has no layers, far too many, or no actions");
    if (!actions.every(isAction))
      throw new Error("is a damaged policy file: its action table has a row that is not a steer angle and a speed");
    const names = ["observation.mean", "observation.factor"];
    for (let index = 0; index < nLayers; index++) names.push(`actor.${index}.weight`, `actor.${index}.bias`);
    const tensors = names.map(tensor);
    const found = checksumOf([new TextEncoder().encode(unsigned(text)), ...tensors.map((one) => one.bytes)]);
    if (found !== checksum)
      throw new Error("is damaged: its checksum is not that of its contents; download it or train it again");
    if (!act.activations.includes(activation))
      throw new Error(`has the activation ${activation}; must be ${act.activations.join(" or ")}`);
    if (!extras.every((extra, index) => known[index]?.name === extra))
      throw new Error(`has the extras ${extras.join(", ")}, which this page does not know`);
    const all = tensors.map((one) => ({ ...one, values: new Float32Array(one.bytes.buffer) }));
    const endless = all.find(({ values }) => !values.every(Number.isFinite));
    if (endless !== undefined) throw new Error(`cannot drive: ${endless.name} has a number that is not finite`);
    const policy = new Policy({
      live,
      name,
      benchmark,
      actions,
      extras,
      vehicles,
      activation,
      mean: all[0].values,
      factor: all[1].values,
    });
    const nSeen = nValues + extras.length + (vehicles ? nAround : 0);
    policy.layers = Policy.layers(all.slice(2), nSeen, all.slice(0, 2));
    if (policy.layers.at(-1).nOutputs !== actions.length)
      throw new Error(
        `is of another shape: its last layer has ${policy.layers.at(-1).nOutputs} outputs, ` +
          `and its action table ${actions.length} actions`,
      );
    return policy;
  }

  /** The layers of a file's tensors, whose shapes must fit each other. */
  static layers(tensors, nValues, statistics) {
    const wrong = ({ name, shape }, needed) =>
      new Error(`is of another shape: ${name} is [${shape}]; [${needed}] is needed`);
    for (const one of statistics) if (String(one.shape) !== String([nValues])) throw wrong(one, [nValues]);
    const layers = [];
    let nInputs = nValues;
    for (let index = 0; index < tensors.length; index += 2) {
      const [weights, biases] = [tensors[index], tensors[index + 1]];
      const nOutputs = biases.values.length;
      if (String(biases.shape) !== String([nOutputs]) || nOutputs === 0) throw wrong(biases, ["a number an output"]);
      if (String(weights.shape) !== String([nInputs, nOutputs])) throw wrong(weights, [nInputs, nOutputs]);
      layers.push({ nInputs, nOutputs, weights: weights.values, biases: biases.values });
      nInputs = nOutputs;
    }
    return layers;
  }

  /** One of the page's own. */
  static shipped(live, index) {
    const { name, section } = live.facts.policies[index];
    return Policy.read(live, name, live.section(section));
  }

  constructor(parts) {
    Object.assign(this, parts);
  }

  /** Why it cannot drive on a benchmark, in words; null where it can. */
  check(world) {
    const { actions, extras, traffic } = world.facts;
    const listed = (names) => (names.length === 0 ? "none" : names.join(", "));
    if (listed(extras) !== listed(this.extras)) {
      const own = listed(this.extras);
      return `learned with other extras beside the observation: ${own}; ${world.facts.name} has ${listed(extras)}`;
    }
    // One that learned on empty roads drives among vehicles as well: it does not see them.
    if (this.vehicles && !traffic?.observed)
      return `reads what other vehicles do, which ${world.facts.name} does not observe`;
    const near = (a, b) => Math.abs(a - b) <= this.live.facts.code.policy.same_action * Math.max(Math.abs(a), 1);
    const same =
      this.actions.length === actions.length &&
      this.actions.every((action, index) => action.every((value, part) => near(value, actions[index][part])));
    if (same) return null;
    const [own, others] = [this.actions, actions].map((table) => this.described(table));
    return `learned with another action table: ${own}; ${world.facts.name} has ${others}`;
  }

  /** An action table in a few words. */
  described(actions) {
    const range = (part, factor) => {
      const values = actions.map((action) => action[part] * factor);
      return `${Math.min(...values).toFixed(1)} to ${Math.max(...values).toFixed(1)}`;
    };
    return `${actions.length} actions, ${range(0, 180 / Math.PI)} deg, ${range(1, 3.6)} km/h`;
  }

  /** One value an action for one observation, its extras and what is observed of other vehicles. */
  outputs(observation, extras, around) {
    const { limit } = this.live.facts.code.act;
    const seen = [
      ...observation,
      ...Array.from(extras).slice(0, this.extras.length),
      ...(this.vehicles ? around : []),
    ];
    let values = seen.map((value, index) =>
      Math.min(Math.max((value - this.mean[index]) * this.factor[index], -limit), limit),
    );
    this.layers.forEach(({ nInputs, nOutputs, weights, biases }, index) => {
      const sums = new Float64Array(nOutputs);
      for (let input = 0; input < nInputs; input++) {
        for (let output = 0; output < nOutputs; output++)
          sums[output] += values[input] * weights[input * nOutputs + output];
      }
      const isLast = index + 1 === this.layers.length;
      values = Array.from(sums, (sum, output) => this.activated(sum + biases[output], isLast));
    });
    return Float32Array.from(values);
  }

  activated(sum, isLast) {
    if (isLast) return sum;
    return this.activation === this.live.facts.code.act.activations[0] ? Math.max(sum, 0) : Math.tanh(sum);
  }

  /** The policy on a batch's device, acting for its trucks. */
  async on(batch) {
    const refusal = this.check(batch.world);
    if (refusal !== null) throw new Error(refusal);
    const { gpu, code } = batch;
    const widest = Math.max(...this.layers.map(({ nOutputs }) => nOutputs));
    const place = code.act.shapes.findIndex(({ width }) => widest <= width);
    if (place < 0)
      throw new Error(
        `is too wide for this page: a layer has ${widest} outputs, at most ${code.act.shapes.at(-1).width} fit`,
      );
    const own = this.packed();
    const largest = Math.min(gpu.limits.maxStorageBufferBindingSize, gpu.limits.maxBufferSize);
    if (largest < own.weights.byteLength) throw new Error("is too large for the device of this browser");
    const kind = Number(this.vehicles), buffers = code.act.buffers[kind];
    const bound = buffers.map(({ access }, binding) => ({ binding, access }));
    const module = await gpu.module(`act ${kind} ${place}`, this.live.code.act[kind][place]);
    const { layout, pipeline } = await gpu.kernel("act", module, "act", bound);
    const made = buffers
      .filter(({ name }) => name in own)
      .map(({ name, access }) => {
        const usage = access === "uniform" ? GPUBufferUsage.UNIFORM : GPUBufferUsage.STORAGE;
        return [name, gpu.buffer(name, own[name].byteLength, own[name], usage)];
      });
    const all = { ...batch.buffers, ...Object.fromEntries(made) };
    const group = gpu.group(
      "act",
      layout,
      buffers.map(({ name }, binding) => [binding, all[name]]),
    );
    const workgroups = Math.ceil(batch.n / code.act.shapes[place].tile);
    return {
      dispatch: (pass) => gpu.dispatch(pass, pipeline, group, workgroups),
      close: () => made.forEach(([, buffer]) => buffer.destroy()),
    };
  }

  /** Its numbers as the kernel reads them: rows of weights in columns of four, filled with zeros. */
  packed() {
    const { live } = this;
    const { structs, act } = live.facts.code;
    const fours = (n) => 4 * Math.ceil(n / 4);
    const sizes = this.layers.map(({ nInputs, nOutputs }) => (fours(nInputs) + 1) * fours(nOutputs));
    const weights = new Float32Array(sizes.reduce((sum, size) => sum + size, 0));
    const rows = new DataView(new ArrayBuffer(act.most_layers * structs.LayerRow.size));
    let at = 0;
    this.layers.forEach((layer, index) => {
      const [nInputs, width] = [fours(layer.nInputs), fours(layer.nOutputs)];
      const biases = at + nInputs * width;
      writeWords(live, "LayerRow", rows, index * structs.LayerRow.size, {
        n_inputs: nInputs,
        n_columns: width / 4,
        weights: at / 4,
        biases: biases / 4,
      });
      for (let input = 0; input < layer.nInputs; input++) {
        weights.set(layer.weights.subarray(input * layer.nOutputs, (input + 1) * layer.nOutputs), at + input * width);
      }
      weights.set(layer.biases, biases);
      at = biases + width;
    });
    const facts = new DataView(new ArrayBuffer(structs.Facts.size));
    const words = { n_values: this.mean.length, n_layers: this.layers.length, n_actions: this.actions.length };
    writeWords(live, "Facts", facts, 0, {
      ...words,
      is_tanh: Number(this.activation !== act.activations[0]),
      is_sampled: 0,
      seed: 0,
    });
    const normalisation = new Float32Array(2 * this.mean.length);
    this.mean.forEach((mean, index) => normalisation.set([mean, this.factor[index]], 2 * index));
    return { facts, layers: rows, normalisation, weights };
  }
}
