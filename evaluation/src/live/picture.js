// The picture of a world and its trucks: a pipeline for each layer over the buffers of the step.

/** Layers: entry points of view.wgsl and the buffers of the step that they read, by stage. */
const TRUCK = ["truck", "vehicles"], CARS = ["truck", "lanes", "cars"];
const LAYERS = {
  ground: ["ground", "ground_colour", { VERTEX: ["roads"], FRAGMENT: ["roads", "cells", "corners"] }],
  crosses: ["crosses", "mark_colour", { VERTEX: ["journal"] }],
  trucks: ["trucks", "body_colour", { VERTEX: [...TRUCK, "roads", "actions", "action", "progress"] }],
  route: ["route_line", "mark_colour", { VERTEX: ["truck", "roads", "progress"] }],
  paths: ["paths", "mark_colour", { VERTEX: ["truck"] }],
  rays: ["rays", "mark_colour", { VERTEX: [...TRUCK, "ranges", "params"] }],
  followed: ["followed_truck", "body_colour", { VERTEX: TRUCK }],
  wheels: ["wheels", "body_colour", { VERTEX: TRUCK }],
};
/** Those of other vehicles, where there are some. */
const VEHICLES = {
  others: ["others", "vehicle_colour", { VERTEX: CARS }],
  around: ["around_followed", "vehicle_colour", { VERTEX: CARS }],
};
/** Their trailers, where there may be some. */
const TRAILERS = {
  towed: ["trailers", "vehicle_colour", { VERTEX: CARS }],
  towedAround: ["trailers_around_followed", "vehicle_colour", { VERTEX: CARS }],
};
/** Trucks of a crowd whose vehicles are drawn at most; how opaque these are, and the number of trucks on a road from
 * which on they are paler, down to what eight bits of a colour still show. */
const MOST_AROUND = 8192, OTHERS = 0.6, FEW_OTHERS = 20, LEAST_OTHERS = 0.02;
/** Bytes of `View` and `Theme` in view.wgsl; most steps of a path that are drawn; no truck. */
const VIEW_BYTES = 48, THEME_BYTES = 496, MOST_POINTS = 1024, NOBODY = 0xffffffff;
/** Colours of `Theme`, in order; then those of the ends. */
const THEME = ["solid", "apron", "car", "van", "brakes", "rude", "road", "kerb", "panel", "ink", "route", "tractor",
  "trailer", "ray", "steer-right", "steer-straight", "steer-left", "transfer-low", "transfer-high", "begun", "done"];

/** A colour of the theme as three numbers of 0 to 1. */
const numbersOf = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);

/** Pipelines and the colours, shared by all worlds of a device. */
class Picture {
  constructor(live, gpu) {
    Object.assign(this, { live, gpu, device: gpu.device });
    this.format = navigator.gpu.getPreferredCanvasFormat();
    const usage = GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST, { VERTEX, FRAGMENT } = GPUShaderStage;
    this.theme = this.device.createBuffer({ label: "theme", size: THEME_BYTES, usage });
    const uniform = { visibility: VERTEX | FRAGMENT, buffer: {} };
    const table = { visibility: VERTEX, buffer: { type: "read-only-storage" } };
    this.own = this.device.createBindGroupLayout({
      label: "view", entries: [uniform, uniform, table, table].map((entry, binding) => ({ binding, ...entry })),
    });
    this.pipelines = new Map();
  }

  /** Takes the colours of the page. */
  paint() {
    const colourOf = colours();
    const ends = this.live.facts.code.ended.map((name) => (name === "running" ? "ink" : `end-${name}`));
    const rows = [...THEME, ...ends].flatMap((name) => [...numbersOf(colourOf(name)), 1]);
    this.device.queue.writeBuffer(this.theme, 0, new Float32Array(rows));
    this.clear = numbersOf(colourOf("solid"));
  }

  /** The pipeline of a layer; the layouts of two batches are alike. */
  async pipeline(name, layout) {
    if (!this.pipelines.has(name)) {
      const [vertex, fragment] = LAYERS[name] ?? VEHICLES[name] ?? TRAILERS[name];
      const factors = { srcFactor: "one", dstFactor: "one-minus-src-alpha" };
      const { code } = this.live, module = await this.gpu.module("view", code.picture + code.view);
      this.pipelines.set(name, this.device.createRenderPipelineAsync({
        label: name, layout: this.device.createPipelineLayout({ bindGroupLayouts: [layout, this.own] }),
        vertex: { module, entryPoint: vertex },
        fragment: {
          module, entryPoint: fragment,
          targets: [{ format: this.format, blend: { color: factors, alpha: factors } }],
        },
        primitive: { topology: "triangle-list" },
      }));
    }
    return this.pipelines.get(name);
  }
}

/** The layers of one batch. */
class BatchPicture {
  static async open(picture, batch, sites) {
    const made = new BatchPicture();
    const { COPY_DST, STORAGE, UNIFORM } = GPUBufferUsage;
    const buffer = (label, size, usage) => picture.device.createBuffer({ label, size, usage: usage | COPY_DST });
    Object.assign(made, { picture, batch, sites, nPoints: 0, layers: {} });
    made.view = buffer("view", VIEW_BYTES, UNIFORM);
    made.points = buffer("points", 16 * MOST_POINTS, STORAGE);
    made.places = buffer("sites", sites.rows.byteLength, STORAGE);
    picture.device.queue.writeBuffer(made.places, 0, sites.rows);
    const resources = [made.view, picture.theme, made.places, made.points];
    made.own = picture.device.createBindGroup({ label: "view", layout: picture.own,
      entries: resources.map((resource, binding) => ({ binding, resource: { buffer: resource } })) });
    const { traffic } = batch.world.facts;
    const layers = { ...LAYERS, ...(traffic ? VEHICLES : {}), ...(traffic?.trailers ? TRAILERS : {}) };
    await Promise.all(Object.entries(layers).map(async ([name, [, , reads]]) => {
      const visibility = {};
      for (const [stage, names] of Object.entries(reads)) {
        for (const read of names) visibility[read] = (visibility[read] ?? 0) | GPUShaderStage[stage];
      }
      const { layout, group } = batch.group0(visibility);
      made.layers[name] = { group, pipeline: await picture.pipeline(name, layout) };
    }));
    return made;
  }

  close() {
    for (const buffer of [this.view, this.points, this.places]) buffer.destroy();
  }

  /** The paths of the followed truck: its steps in this episode, the first one first. */
  setPath(rows) {
    const kept = rows.slice(-MOST_POINTS);
    this.nPoints = kept.length;
    this.picture.device.queue.writeBuffer(this.points, 0, new Float32Array(kept.flat()));
  }

  /** How opaque a vehicle of the crowd is. */
  get others() {
    const onRoad = Math.min(this.batch.n, MOST_AROUND) / this.sites.places.length;
    return Math.max(OTHERS * Math.min(1, FEW_OTHERS / onRoad), LEAST_OTHERS);
  }

  /** What `View` holds. */
  write({ centre, half, pixel, since, followed, colouring, crowd }) {
    const bytes = new ArrayBuffer(VIEW_BYTES), floats = new Float32Array(bytes), words = new Uint32Array(bytes);
    floats.set([...centre, ...half, pixel, since]);
    words.set([followed ?? NOBODY, colouring], 6);
    floats[8] = crowd;
    words.set([this.sites.nRoutes, this.nPoints], 9);
    floats[11] = this.others;
    this.picture.device.queue.writeBuffer(this.view, 0, bytes);
  }

  /** Draws layers: whether the ground too, the crowd, whether its vehicles, and the truck that is followed. */
  draw(pass, { ground, followed, rays, others }) {
    const { code } = this.picture.live.facts, { n } = this.batch;
    const layer = (name, vertices, instances) => {
      const { pipeline, group } = this.layers[name];
      pass.setPipeline(pipeline);
      pass.setBindGroup(0, group);
      pass.setBindGroup(1, this.own);
      pass.draw(vertices, instances);
    };
    const isFollowed = followed !== null, hasVehicles = "others" in this.layers;
    const hasTrailers = "towed" in this.layers;
    if (ground) layer("ground", 6, this.sites.places.length);
    const slots = code.cars.n * Math.min(n, MOST_AROUND);
    if (hasVehicles && others) layer("others", 6, slots);
    if (hasTrailers && others) layer("towed", 6, slots);
    layer("trucks", 18, n);
    layer("crosses", 6, MOST_FAILURES);
    if (!isFollowed) return;
    layer("route", 6, this.sites.mostWaypoints);
    if (1 < this.nPoints) layer("paths", 6, 2 * (this.nPoints - 1));
    if (hasVehicles) layer("around", 6, code.cars.n);
    if (hasTrailers) layer("towedAround", 6, code.cars.n);
    if (rays) layer("rays", 12, code.n_rays);
    layer("followed", 18, 1);
    layer("wheels", 6, N_WHEELS);
  }
}

/** Failures that the device keeps; wheels of a truck with three trailer axles. */
const MOST_FAILURES = 256, N_WHEELS = 10;
