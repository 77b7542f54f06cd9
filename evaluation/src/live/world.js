// A benchmark: its names, and its tables as buffers and as numbers.

class World {
  constructor(gpu, facts) {
    Object.assign(this, { gpu, facts, live: gpu.live });
    const uniform = new Set(
      this.live.facts.code.buffers.filter(({ access }) => access === "uniform").map(({ name }) => name),
    );
    this.kept = new Map();
    this.tables = {};
    const all = Object.keys(facts.tables).map((name) => [name, this.bytes(name)]);
    const most = Math.min(gpu.limits.maxStorageBufferBindingSize, gpu.limits.maxBufferSize);
    const large = all.find(([, bytes]) => most < bytes.length);
    if (large !== undefined) {
      const [table, size] = [large[0], large[1].length];
      throw new Error(
        `${facts.name} is too large for this browser's device: its table ${table} has ${whole(size)} bytes, ` +
          `at most ${whole(most)} fit; a benchmark with fewer roads is needed.`,
      );
    }
    for (const [name, bytes] of all) {
      this.tables[name] = gpu.buffer(
        name,
        bytes.length,
        bytes,
        uniform.has(name) ? GPUBufferUsage.UNIFORM : GPUBufferUsage.STORAGE,
      );
    }
  }

  /** A table's bytes. */
  bytes(table) {
    return this.live.sections(this.facts.tables[table]);
  }

  /** The table of lanes in which every episode has the demand of this index: that stands in place of the others. */
  lanesAt(demand) {
    const bytes = this.bytes("lanes").slice();
    for (const [first, words] of this.facts.traffic.levels) {
      const part = (level) => 4 * (first + level * words);
      const chosen = bytes.slice(part(demand), part(demand + 1));
      this.facts.traffic.demand.forEach((_, level) => bytes.set(chosen, part(level)));
    }
    return bytes;
  }

  /** A row of the table of vehicles: the fields of its rig, and its distance sensors. */
  vehicle(index) {
    this.vehicles ??= this.bytes("vehicles");
    const { size } = this.live.facts.code.structs.VehicleRow;
    return readStruct(this.live, "VehicleRow", this.vehicles, index * size);
  }

  /** Position and direction of each waypoint of a route. */
  waypoints(route) {
    if (!this.kept.has(route)) {
      this.roads ??= this.bytes("roads");
      const view = new DataView(this.roads.buffer, this.roads.byteOffset);
      const { route_rows: rows, row_bytes: width } = this.live.facts.code.roads;
      const [first, n] = [0, 4].map((offset) => view.getUint32(route * rows * width + offset, true));
      const waypoint = (_, index) => readStruct(this.live, "WaypointRow", this.roads, (first + index) * width);
      this.kept.set(route, Array.from({ length: n }, waypoint));
    }
    return this.kept.get(route);
  }

  /** Index of the action nearest to a steer angle (rad) and a speed, or change of the target speed (m/s). */
  nearestAction(steering, speed) {
    const far = ([angle, other]) => Math.abs(angle - steering) + Math.abs(other - speed);
    return this.facts.actions.reduce((best, action, index, all) => (far(action) < far(all[best]) ? index : best), 0);
  }
}
