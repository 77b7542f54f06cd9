// The data blocks of the page: facts as JSON, and sections of bytes, gzipped by kind.

/** Pairs of distances from their differences: live/packed.rs writes them. */
function pairsOf(planes) {
  const n = planes.length / 4;
  const pairs = new Uint32Array(n);
  const difference = (plane, index) => {
    const zigzag = planes[plane * n + index] | (planes[(plane + 1) * n + index] << 8);
    return (zigzag >>> 1) ^ -(zigzag & 1);
  };
  let [south, rise] = [0, 0];
  for (let index = 0; index < n; index++) {
    south += difference(0, index);
    rise += difference(2, index);
    pairs[index] = (south & 0xffff) | ((south + rise) << 16);
  }
  return new Uint8Array(pairs.buffer);
}

/** The bytes of each kind of sections, from lines of a kind and its base64. */
async function unpacked(lines) {
  const kinds = lines.map((line) => line.split(" ")).map(async ([kind, text]) => [kind, await inflated(text)]);
  return Object.fromEntries(await Promise.all(kinds));
}

/** What the page holds. */
class Live {
  constructor(facts, kinds, view) {
    this.facts = facts;
    this.places = facts.sections.map((place) => ({ ...place, kinds }));
    const { step, act, journal, picture } = facts.code.texts;
    /** Modules of WGSL by name. */
    this.code = {
      step: this.text(step),
      act: act.map((shapes) => shapes.map((parts) => this.text(parts))),
      journal: this.text(journal),
      picture: this.text(picture),
      view,
    };
  }

  /** The bytes of a section. */
  section(index) {
    const { kind, at, size, kinds } = this.places[index];
    const bytes = kinds[kind].subarray(at, at + size);
    return kind === "distances" ? pairsOf(bytes) : bytes;
  }

  /** The bytes of several sections, one after the other. */
  sections(indices) {
    const parts = indices.map((index) => this.section(index));
    const bytes = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
    let at = 0;
    for (const part of parts) {
      bytes.set(part, at);
      at += part.length;
    }
    return bytes;
  }

  text(parts) {
    return new TextDecoder().decode(this.sections(parts));
  }

  /** Adds the benchmark of a world file, and gives its index. What is wrong with the file is an error in words. */
  async addWorld(name, bytes) {
    const [head, facts, ...lines] = new TextDecoder().decode(bytes).trim().split("\n"), form = this.facts.world_file;
    if (!head.startsWith(`${form} `))
      throw new Error(`${name} is no world file of this page's form, ${form}; offtrack web --world writes one.`);
    let read;
    try {
      const checksum = checksumOf([new TextEncoder().encode(facts)]);
      if (head !== `${form} ${checksum}`) throw new Error("its facts are others");
      read = { ...JSON.parse(facts), kinds: await unpacked(lines) };
      const isWhole = ({ kind, at, size }) => at + size <= read.kinds[kind]?.length;
      if (!read.sections.every(isWhole)) throw new Error("a part is missing");
    } catch {
      throw new Error(`${name} is a damaged world file; download it or write it again.`);
    }
    return this.add(name, read);
  }

  /** Adds a benchmark that is in no block of the page, and gives its index. */
  add(name, { version, layout, world, sections, kinds }) {
    if (layout !== this.facts.layout) {
      throw new Error(
        `${name} was written by offtrack ${version}, this page by ${this.facts.version}; write both by one.`,
      );
    }
    const first = this.places.length;
    this.places.push(...sections.map((place) => ({ ...place, kinds })));
    const tables = Object.entries(world.tables).map(([table, indices]) => [
      table,
      indices.map((index) => first + index),
    ]);
    const able = (_, index) => Policy.shipped(this, index).check({ facts: world }) === null;
    const policies = this.facts.policies.map((_, index) => index).filter(able);
    return this.facts.worlds.push({ ...world, tables: Object.fromEntries(tables), policies }) - 1;
  }
}

/** Reads the data blocks. */
async function readLive() {
  const facts = JSON.parse(block("facts"));
  return new Live(facts, await unpacked(block("packed").split("\n")), block("view"));
}
