// The device: opened with the limits that every device of WebGPU has, and the kernels compiled for it.

/** Why there is no device: `kind` is "webgpu", "adapter" or "device". */
class NoDevice extends Error {
  constructor(kind, message) {
    super(message);
    this.kind = kind;
  }
}

/** Opens the device of this browser. */
async function openDevice(live) {
  if (navigator.gpu === undefined) throw new NoDevice("webgpu", "This browser has no WebGPU.");
  const adapter = await navigator.gpu.requestAdapter({ powerPreference: "high-performance" }).catch(() => null);
  if (adapter === null) throw new NoDevice("adapter", "This browser has WebGPU and no graphics adapter for it.");
  try {
    return new Gpu(live, adapter, await adapter.requestDevice());
  } catch (error) {
    throw new NoDevice("device", `The graphics adapter does not open: ${error.message}`);
  }
}

/** An open device. Batches and pictures share it. */
class Gpu {
  constructor(live, adapter, device) {
    Object.assign(this, { live, adapter, device, limits: device.limits });
    const { vendor, architecture, description } = adapter.info ?? {};
    this.name = [description, vendor, architecture].find((word) => word) ?? "unknown adapter";
    this.isGivenBack = false;
    /** The message of a device that was lost. One that the page gave back is not. */
    this.lost = new Promise((lose) => device.lost.then(({ message }) => this.isGivenBack || lose(message)));
    /** The message of the first error of the device that nobody caught. */
    this.failed = new Promise((fail) => device.addEventListener("uncapturederror", ({ error }) => fail(error.message)));
    /** What its compiler says of the shaders. */
    this.messages = [];
    this.modules = new Map();
    this.pipelines = new Map();
    this.worlds = [];
  }

  destroy() {
    this.isGivenBack = true;
    this.device.destroy();
  }

  /** A buffer of `size` bytes, with `contents` where it has any. */
  buffer(label, size, contents = null, usage = GPUBufferUsage.STORAGE) {
    // A binding of no bytes is refused, and uniforms are read in rows of 16 bytes.
    const rounded = Math.max(16, Math.ceil(size / 16) * 16);
    const whole = usage | GPUBufferUsage.COPY_DST | GPUBufferUsage.COPY_SRC;
    const buffer = this.device.createBuffer({ label, size: rounded, usage: whole });
    if (contents !== null) this.device.queue.writeBuffer(buffer, 0, contents);
    return buffer;
  }

  /** A module of shaders. One that does not compile is an error; what else a compiler says is kept. */
  async module(label, code) {
    if (!this.modules.has(label)) this.modules.set(label, this.compiled(label, code));
    return this.modules.get(label);
  }

  async compiled(label, code) {
    const module = this.device.createShaderModule({ label, code });
    const { messages } = await module.getCompilationInfo();
    const words = ({ type, lineNum, message }) => `${label}, line ${lineNum}: ${type}: ${message}`;
    this.messages.push(...messages.map(words));
    const error = messages.find(({ type }) => type === "error");
    if (error !== undefined) throw new Error(`The shaders do not compile here: ${words(error)}`);
    return module;
  }

  /** A layout of a bind group: `bound` has binding, access and visibility. */
  layout(label, bound) {
    const types = { uniform: "uniform", read: "read-only-storage", read_write: "storage" };
    const entries = bound.map(({ binding, access, visibility }) => ({
      binding,
      visibility,
      buffer: { type: types[access] },
    }));
    return this.device.createBindGroupLayout({ label, entries });
  }

  /** A kernel: its layout and pipeline. `bound` has binding and access of each buffer. */
  async kernel(label, module, entryPoint, bound) {
    const key = `${module.label} ${entryPoint}`;
    if (!this.pipelines.has(key)) {
      const visible = bound.map((one) => ({ ...one, visibility: GPUShaderStage.COMPUTE }));
      const layout = this.layout(label, visible);
      const pipelineLayout = this.device.createPipelineLayout({ label, bindGroupLayouts: [layout] });
      const compute = { module, entryPoint };
      const made = this.device.createComputePipelineAsync({ label, layout: pipelineLayout, compute });
      this.pipelines.set(
        key,
        made.then((pipeline) => ({ layout, pipeline })),
      );
    }
    return this.pipelines.get(key);
  }

  /** A bind group: pairs of a binding and a buffer. */
  group(label, layout, pairs) {
    const entries = pairs.map(([binding, buffer]) => ({ binding, resource: { buffer } }));
    return this.device.createBindGroup({ label, layout, entries });
  }

  /** The kernels of a step by name, and the page's own. */
  async kernels(names) {
    const { buffers, kernels, journal } = this.live.facts.code;
    const { code } = this.live;
    const of = ({ bindings }) => bindings.map((binding) => ({ binding, access: buffers[binding].access }));
    const made = names.map(async (name) => {
      if (!(name in journal.kernels))
        return this.kernel(name, await this.module("step", code.step), name, of(kernels[name]));
      const read = journal.kernels[name].map((binding) => ({
        binding,
        access: buffers[binding].access === "uniform" ? "uniform" : "read",
      }));
      const bound = [...read, { binding: journal.binding, access: "read_write" }];
      return this.kernel(name, await this.module("journal", code.journal), name, bound);
    });
    return Object.fromEntries((await Promise.all(made)).map((kernel, index) => [names[index], kernel]));
  }

  /** A benchmark with its tables on the device. */
  async world(index) {
    return (this.worlds[index] ??= new World(this, this.live.facts.worlds[index]));
  }

  /** Adds a dispatch of so many workgroups to a pass, in rows as the shaders expect them. */
  dispatch(pass, pipeline, group, workgroups) {
    const columns = Math.min(workgroups, this.live.facts.code.row);
    pass.setPipeline(pipeline);
    pass.setBindGroup(0, group);
    pass.dispatchWorkgroups(columns, Math.ceil(workgroups / columns));
  }

  /** The bytes of parts of buffers, each [buffer, offset, size], after all work submitted before. */
  async read(parts) {
    const total = parts.reduce((sum, [, , size]) => sum + size, 0);
    const usage = GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST;
    const staging = this.device.createBuffer({ label: "staging", size: Math.max(total, 4), usage });
    const encoder = this.device.createCommandEncoder();
    let at = 0;
    for (const [buffer, offset, size] of parts) {
      encoder.copyBufferToBuffer(buffer, offset, staging, at, size);
      at += size;
    }
    this.device.queue.submit([encoder.finish()]);
    await staging.mapAsync(GPUMapMode.READ);
    const all = staging.getMappedRange().slice(0);
    staging.destroy();
    at = 0;
    return parts.map(([, , size]) => all.slice(at, (at += size)));
  }
}

/** Why the page cannot run, by the kind of a `NoDevice`, and what would do. */
const MISSING = {
  webgpu: ["This page needs WebGPU", "Browsers that have it: Chrome and Edge from version 113 on (on Linux from 144 " +
    "on, with some graphics cards), Safari from 26 on, Firefox from 141 on Windows and from 145 on macOS."],
  adapter: ["No graphics adapter was found", "Turn on graphics acceleration in the browser's settings, update the " +
    "graphics driver, or try another browser: Chrome, Edge, Safari and Firefox of today have WebGPU."],
  device: ["The graphics adapter does not open", "Close other pages that use it, or start the browser again."],
  lost: ["The graphics device was lost", "The driver was reset, or the computer slept. Nothing is damaged."],
  failed: ["The graphics device reported an error", "The page stopped. Fewer trucks may do."],
};

/** Whether a device is a program on the processor: it has no speed for thousands of trucks. */
const isSoftware = ({ name, adapter }) =>
  adapter.info?.isFallbackAdapter || /swiftshader|llvmpipe|software/i.test(name);
