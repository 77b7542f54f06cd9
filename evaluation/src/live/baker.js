// Roads that are baked in the page: random ones by name, and those of files that are dropped on it.
//
// A worker bakes by the simulator as WebAssembly, so that the crowd drives on meanwhile. Each gets a worker of its own:
// what ends one, or takes too long, is over with it.

/** Names of roads that the baker draws, as a visitor may type them. */
const DISTRIBUTIONS = ["wide", "mixed"];
/** Most bytes of a file to bake. */
const MOST_BYTES = 64 << 20;

class Baker {
  constructor(app) {
    const { live } = app;
    Object.assign(this, { app, live, section: live.facts.baker, stop: null });
    for (const node of document.querySelectorAll(".baked")) node.hidden = !this.isThere;
    byId("no-baker").hidden = this.isThere;
    if (!this.isThere) return;
    byId("drop-here").textContent = "Drop a policy (.safetensors), a road or a benchmark (.toml), a map (.xodr) or a " +
      "world file";
    byId("drop-words").textContent = "Drop a policy, a road, a benchmark, an OpenDRIVE map or a world file on this " +
      "page, or";
    byId("file").accept += ",.toml,.xodr";
    const drive = () => this.drive(byId("any-road").value);
    byId("bake").addEventListener("click", drive);
    byId("any-road").addEventListener("keydown", ({ key }) => key === "Enter" && drive());
    byId("random").addEventListener("click", () => this.drive(randomName()));
    byId("ring").addEventListener("change", () => {
      const { name, bytes } = this.shown;
      this.file(name, bytes, Number(byId("ring").value));
    });
  }

  /** Whether the page can bake. */
  get isThere() {
    return this.section !== null;
  }

  /** Whether a file is one to bake. */
  takes(name) {
    return this.isThere && /\.(toml|xodr)$/i.test(name);
  }

  /** Drives on roads by their names, with commas between them. */
  drive(names) {
    const text = names.trim();
    byId("any-road").value = text;
    if (text === "") return this.app.say("A road's name is needed, such as wide/7/12 or mixed/3/0.", true);
    return this.take({ roads: text }, text);
  }

  /** Drives on what a file describes; of a map on the ring of this index. */
  file(name, bytes, ring = 0) {
    if (bytes.length === 0) return this.app.say(`${name} is empty.`, true);
    if (MOST_BYTES < bytes.length) return this.app.say(`${name} is larger than ${MOST_BYTES >> 20} MiB.`, true);
    return this.take({ file: { name, ring } }, name, bytes);
  }

  /** Bakes something and drives there. What is asked for later takes its place. What is said on the page. */
  async take(of, name, bytes = new Uint8Array()) {
    const { app, live } = this, begun = performance.now(), { source } = live.facts.worlds[app.chosen.world];
    const asked = { source, name, ring: of.file?.ring, bytes };
    this.leave();
    let isLeft = false;
    const stopped = new Promise((done) => (this.stop = () => done((isLeft = true)))), { stop } = this;
    try {
      const known = this.known(asked), baked = () => this.baked({ benchmark: source, of }, bytes, stopped);
      app.keepSaying(`Baking ${name}.`);
      const found = known === -1 ? await Promise.race([baked(), stopped]) : null;
      const seconds = (performance.now() - begun) / 1000;
      // What was chosen while this waited for a frame counts.
      await app.between(() => isLeft || (known === -1 ? this.driveOn(found, asked) : app.choose({ world: known })));
      if (isLeft) return null;
      const by = app.chosen.policy === -1 ? ", at random" : "";
      const when = known === -1 ? `; it was baked here in ${decimal(seconds, 2)}${GAP}s` : "";
      return app.say(`Trucks drive on ${name} now${by}${when}.`);
    } catch (error) {
      return isLeft ? null : app.say(error.message, true);
    } finally {
      if (this.stop === stop) this.stop = null;
    }
  }

  /** Breaks off what is being baked. */
  leave() {
    if (this.stop === null) return;
    this.stop();
    this.stop = null;
    byId("said").hidden = true;
  }

  /** The index of the world that was baked of the same; -1 without one. */
  known({ source, name, ring, bytes }) {
    const isSame = (other) => other.length === bytes.length && other.every((byte, index) => byte === bytes[index]);
    return this.live.facts.worlds.findIndex(({ baked, file }) => baked?.name === name && baked.ring === ring &&
      // A benchmark of a file is the same whatever drove before.
      (file || (baked.source.name === source.name && baked.source.text === source.text)) && isSame(baked.bytes));
  }

  /** What a worker bakes: facts, and the bytes of each kind of sections. Its error is the reader's. */
  async baked(asked, bytes, stopped) {
    this.module ??= await WebAssembly.compile(this.live.section(this.section));
    const address = URL.createObjectURL(new Blob([block("worker")], { type: "text/javascript" }));
    const worker = new Worker(address);
    stopped.then(() => worker.terminate());
    try {
      const { isBaked, result, failure } = await new Promise((done, fail) => {
        worker.onmessage = ({ data }) => done(data);
        worker.onerror = ({ message }) => fail(new Error(`A worker of the page does not start: ${message}`));
        worker.postMessage({ module: this.module, asked, bytes });
      });
      if (failure !== undefined) throw new Error(`The page could not bake it: ${failure}`);
      if (!isBaked) throw new Error(new TextDecoder().decode(result));
      return sectionsOf(result);
    } finally {
      worker.terminate();
      URL.revokeObjectURL(address);
    }
  }

  /** Adds what was baked and drives there. */
  async driveOn({ facts, kinds }, asked) {
    const { name, ring } = asked, index = this.live.add(name, { ...facts, kinds }), { worlds } = this.live.facts;
    const on = 0 < ring ? `${name}, ring ${ring + 1}` : name, baked = { ...asked, rings: facts.rings };
    Object.assign(worlds[index], facts.is_benchmark ? { file: name } : { on }, { baked });
    tellApart(worlds.slice(0, index), worlds[index]);
    try {
      await this.app.choose({ world: index });
    } catch (error) {
      // There may be no room for it.
      this.app.forgetWorld(index);
      throw error;
    }
  }

  /** Shows the rings of a map to choose from, where trucks drive on one. */
  show(world) {
    const { baked } = world, rings = 1 < baked?.rings.length ? baked.rings : [];
    this.shown = baked;
    const words = ({ centre, radius }, index) => [index,
      `${index + 1} of ${rings.length}, radius ${decimal(radius, 0)}${GAP}m, at ${centre.map(Math.round).join(", ")}`];
    fillSelect("ring", rings.map(words), baked?.ring);
    byId("ring").hidden = byId("ring-label").hidden = rings.length === 0;
  }
}

/** Facts and kinds of sections from a line of JSON and the bytes behind it. */
function sectionsOf(bytes) {
  let at = bytes.indexOf(10) + 1;
  const facts = JSON.parse(new TextDecoder().decode(bytes.subarray(0, at)));
  const kinds = facts.kinds.map(([kind, length]) => [kind, bytes.subarray(at, (at += length))]);
  return { facts, kinds: Object.fromEntries(kinds) };
}

/** The name of a random road. */
function randomName() {
  const below = (n) => Math.floor(Math.random() * n);
  return `${DISTRIBUTIONS[below(DISTRIBUTIONS.length)]}/${below(2 ** 32)}/${below(100)}`;
}
