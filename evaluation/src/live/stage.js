// The canvas: one pane for each crowd, side by side, with the same camera; and what stands over it in plain text.

/** How opaque trucks are: in the crowd, around one that is followed, behind a failure that is driven again; and the
 * number on a road from which on those around one are paler. */
const CROWD = 0.85, AROUND = 0.35, BEHIND = 0.1, FEW_ON_ROAD = 100;
/** Room for the names of panes and for the legend (pixels), most pixels of the canvas for a pixel of the page, and
 * lengths of the scale (m). */
const LABEL_ROOM = 40, LEGEND_ROOM = 44, MOST_DENSITY = 2, SCALES = [1, 2, 5, 10, 20, 50, 100, 200, 500];

class Stage {
  constructor(gpu, picture) {
    Object.assign(this, { gpu, picture, canvas: byId("picture"), camera: new Camera(), panes: [] });
    this.context = this.canvas.getContext("webgpu");
    this.context.configure({ device: gpu.device, format: picture.format, alphaMode: "opaque" });
    picture.paint();
  }

  /** Takes the crowds that are shown, each in a pane. */
  show(crowds) {
    this.panes = crowds;
    byId("pane-labels").replaceChildren(...(crowds.length < 2 ? [] : [html("i"), ...crowds.map(({ policy }, n) =>
      html("span", { style: `left: calc(${(100 * n) / crowds.length}% + 12px)` }, policyWords(policy)))]));
    const named = crowds.flatMap((crowd, pane) => crowd.picture.sites.places.map((place) => ({ pane, place })));
    this.labels = named.map((one) => ({ ...one, node: html("span", {}, one.place.name) }));
    byId("labels").replaceChildren(...this.labels.map(({ node }) => node));
    this.written = null;
    this.measure();
  }

  /** Takes the size that the canvas has on the page. */
  measure() {
    const { clientWidth, clientHeight } = this.canvas;
    this.density = Math.min(window.devicePixelRatio || 1, MOST_DENSITY);
    const size = [clientWidth, clientHeight].map((pixels) => Math.max(1, Math.round(pixels * this.density)));
    // A canvas that is given its size again is cleared.
    if (this.canvas.width !== size[0] || this.canvas.height !== size[1]) [this.canvas.width, this.canvas.height] = size;
    this.camera.size = [Math.max(clientWidth / Math.max(this.panes.length, 1), 1), Math.max(clientHeight, 1)];
  }

  /** Shows all roads. */
  fit() {
    const { extents } = this.panes[0].picture.sites;
    this.camera.fit(extents, this.panes.length < 2 ? 0 : LABEL_ROOM, LEGEND_ROOM);
  }

  /** The pane under a pixel of the canvas, and the pixel within it. */
  inPane([x, y]) {
    const [width] = this.camera.size, pane = Math.min(Math.max(Math.floor(x / width), 0), this.panes.length - 1);
    return { crowd: this.panes[pane], at: [x - pane * width, y] };
  }

  /** Middle of a pane (m): the camera's, or that of the truck that it goes along with. */
  centreOf(crowd, shown, since) {
    const { camera } = this;
    if (!camera.goesAlong || shown?.row == null) return camera.centre;
    return shown.middle(since).map((middle, axis) => middle + camera.centre[axis]);
  }

  /** Draws everything into a texture. `again` is the failure that is driven again, in the pane of its crowd. */
  draw({ texture = this.context.getCurrentTexture(), again, since, colouring, rays }) {
    const { device } = this.gpu, { camera } = this, [r, g, b] = this.picture.clear;
    const encoder = device.createCommandEncoder({ label: "picture" });
    const drawn = this.panes.map((crowd) => {
      const over = again?.from === crowd ? again : null, shown = over ?? crowd;
      const centre = this.centreOf(crowd, shown, since);
      const view = { centre, half: camera.half, pixel: camera.pixel, since, colouring, followed: crowd.followed };
      const onRoad = crowd.batch.n / crowd.picture.sites.places.length;
      const around = AROUND * Math.min(1, Math.sqrt(FEW_ON_ROAD / onRoad));
      const isNear = crowd.followed !== null && camera.goesAlong;
      crowd.picture.write({ ...view, since: over ? 0 : since, crowd: over ? BEHIND : isNear ? around : CROWD });
      over?.picture.write({ ...view, followed: 0, crowd: 1 });
      crowd.centre = centre;
      return { crowd, over };
    });
    const pass = encoder.beginRenderPass({ colorAttachments: [
      { view: texture.createView(), loadOp: "clear", storeOp: "store", clearValue: [r, g, b, 1] },
    ] });
    const width = Math.floor(texture.width / drawn.length);
    drawn.forEach(({ crowd, over }, pane) => {
      pass.setViewport(pane * width, 0, width, texture.height, 0, 1);
      pass.setScissorRect(pane * width, 0, width, texture.height);
      // The vehicles of other trucks are not there for the one that is followed.
      const others = crowd.followed === null && !over;
      crowd.picture.draw(pass, { ground: true, followed: crowd.followed, rays: rays && !over, others });
      over?.picture.draw(pass, { ground: false, followed: 0, rays, others: false });
    });
    pass.end();
    device.queue.submit([encoder.finish()]);
    this.write();
  }

  /** Puts names and scale where they belong. */
  write() {
    const { camera } = this, [width] = camera.size;
    const key = [camera.pixel, ...camera.centre, camera.goesAlong, width, this.panes.length].join();
    if (key === this.written) return;
    this.written = key;
    for (const { pane, place, node } of this.labels) {
      const [x, y] = this.pixelOf(place, place.bounds[0], place.bounds[0 < place.side ? 3 : 1]);
      const wide = (place.bounds[2] - place.bounds[0]) / camera.pixel;
      node.hidden = camera.goesAlong || wide < 70 || this.labels.length === this.panes.length;
      node.style.transform = `translate(${pane * width + x + 8}px, ${y + 8}px)`;
    }
    const length = SCALES.findLast((metres) => metres / camera.pixel < 120) ?? SCALES[0];
    byId("scale").style.width = `${length / camera.pixel}px`;
    byId("scale").textContent = `${length}${GAP}m`;
  }

  /** The pixel of a pane at a point of a place's own coordinates (m). */
  pixelOf({ offset, side }, x, y) {
    const { camera } = this, [width, height] = camera.size, [cx, cy] = this.panes[0].centre ?? camera.centre;
    return [width / 2 + (offset[0] + x - cx) / camera.pixel, height / 2 - (offset[1] + side * y - cy) / camera.pixel];
  }

  /** The point of the plane under a pixel of a pane (m). */
  pointAt(crowd, at) {
    const from = this.camera.fromMiddle(at), centre = crowd.centre ?? this.camera.centre;
    return [centre[0] + from[0], centre[1] + from[1]];
  }

  /** The colour (0 to 255) at a pixel of the page's canvas, drawn anew beside the canvas. */
  async colourAt([x, y], scene) {
    const { device } = this.gpu, { format } = this.picture, size = [this.canvas.width, this.canvas.height];
    const usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC;
    const texture = device.createTexture({ size, format, usage });
    this.draw({ ...scene, texture });
    const buffer = device.createBuffer({ size: 4, usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST });
    const encoder = device.createCommandEncoder();
    const origin = [x, y].map((at, axis) => Math.min(Math.floor(at * this.density), size[axis] - 1));
    encoder.copyTextureToBuffer({ texture, origin }, { buffer }, [1, 1]);
    device.queue.submit([encoder.finish()]);
    await buffer.mapAsync(GPUMapMode.READ);
    const [a, b, c, d] = new Uint8Array(buffer.getMappedRange());
    buffer.destroy();
    texture.destroy();
    return format === "bgra8unorm" ? [c, b, a, d] : [a, b, c, d];
  }
}
