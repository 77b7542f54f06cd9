// Stands in place of the page's last script: does what a test's plan says, and gives the test what came of it.

const asked = async (name) => new Uint8Array(await (await fetch(name)).arrayBuffer());
const give = (name, body) => fetch(name, { method: "POST", body });

const opened = async (gpu, job) => Batch.open(gpu, await gpu.world(job.world), job);

/** A run of a batch: trucks, actions and ends after every step, all columns before the first and after the last. */
async function recorded(live, gpu, batch, job) {
  const all = () => Promise.all(batch.columns.map((name) => batch.column(name)));
  batch.beginAll();
  const first = await all();
  const steps = [];
  for (let step = 0; step < job.steps; step++) {
    await batch.advance(1);
    const names = ["truck", "action", "ended", "cars"].filter((name) => batch.columns.includes(name));
    const read = names.map((name) => [
      batch.buffers[name],
      0,
      job.n * live.facts.code.columns[name].bytes,
    ]);
    steps.push(...(await gpu.read(read)));
  }
  const { sums } = await batch.tally();
  await give(`${job.name}.first`, new Blob(first));
  await give(`${job.name}.steps`, new Blob(steps));
  await give(`${job.name}.last`, new Blob(await all()));
  await give(`${job.name}.tally`, JSON.stringify(sums));
}

async function run(live, gpu, job) {
  const batch = await opened(gpu, job);
  if (job.policy !== null) await batch.setPolicy(Policy.shipped(live, job.policy));
  await recorded(live, gpu, batch, job);
  batch.close();
}

/** A slider that is dragged to some places: what the page says then, and a run of its crowd. */
async function slider(live, _, job) {
  const page = new App(live), range = byId("learned");
  await page.start({ n: job.n, seed: job.seed });
  page.play(false);
  page.visit.zoom(2);
  const [crowd] = page.crowds, seen = [], { pixel } = page.stage.camera;
  for (const { name, place } of job.runs) {
    // A drag passes by other places.
    for (const value of [0, range.max, place]) {
      range.value = value;
      range.dispatchEvent(new Event("input"));
    }
    await page.between(() => {});
    const { begun } = crowd.batch, zoomed = page.stage.camera.pixel / pixel;
    const [chosen] = byId("policy").selectedOptions, options = byId("policy").length;
    const words = byId("learned-words").textContent, spoken = range.getAttribute("aria-valuetext");
    const isShown = range.checkVisibility();
    seen.push({ max: Number(range.max), words, spoken, chosen: chosen.textContent, options, begun, zoomed, isShown });
    await page.between(() => recorded(live, page.gpu, crowd.batch, { ...job, name }));
  }
  await give(`${job.name}.seen`, JSON.stringify(seen));
  await page.attempt(() => page.choose({ second: -1 }));
  await page.stepBy(2);
  await page.pickTruck(1);
  const of = (what) => page.crowds.map(what), before = of(({ batch }) => batch.begun);
  range.value = 0;
  range.dispatchEvent(new Event("input"));
  await page.between(() => {});
  const [begun, followed] = [of(({ batch }) => batch.begun), of((one) => one.followed)];
  const names = [...byId("pane-labels").querySelectorAll("span")].map(({ textContent }) => textContent);
  const state = byId("truck-state").textContent;
  await give(`${job.name}.beside`, JSON.stringify({ before, begun, followed, names, state }));
  page.gpu.destroy();
}

/** Stage by stage: each from the columns that the test has of the one before. */
async function stages(live, gpu, job) {
  const batch = await opened(gpu, job);
  const kernels = await gpu.kernels(job.stages.flatMap((stage) => stage.kernels));
  for (const [name, kernel] of Object.entries(kernels)) batch.kernels[name] = batch.bound(name, kernel);
  for (const { name, kernels: names, from } of job.stages) {
    const before = await asked(from);
    let at = 0;
    for (const column of batch.columns) {
      const size = job.n * live.facts.code.columns[column].bytes;
      gpu.device.queue.writeBuffer(batch.buffers[column], 0, before, at, size);
      at += size;
    }
    const encoder = gpu.device.createCommandEncoder();
    const pass = encoder.beginComputePass();
    batch.dispatch(pass, names);
    pass.end();
    gpu.device.queue.submit([encoder.finish()]);
    await give(`${job.name}.${name}`, new Blob(await Promise.all(batch.columns.map((column) => batch.column(column)))));
  }
  batch.close();
}

/** A policy of a file acts for observations of the test. */
async function act(live, gpu, job) {
  const batch = await opened(gpu, job);
  const policy = Policy.read(live, job.file, await asked(job.file));
  await batch.setPolicy(policy);
  const { queue } = gpu.device;
  for (const column of ["observation", "extras"])
    queue.writeBuffer(batch.buffers[column], 0, await asked(`${job.name}.${column}`));
  const encoder = gpu.device.createCommandEncoder();
  // Held trucks need no action.
  encoder.clearBuffer(batch.buffers.truck);
  const pass = encoder.beginComputePass();
  batch.acting.dispatch(pass);
  pass.end();
  queue.submit([encoder.finish()]);
  await give(`${job.name}.action`, await batch.column("action"));
  const { n_values: width, n_extras: beside } = live.facts.code;
  const [seen, extras] = await Promise.all(
    ["observation", "extras"].map(async (name) => new Float32Array(await batch.column(name))),
  );
  const rows = Array.from({ length: Math.min(64, job.n) }, (_, row) =>
    policy.outputs(seen.slice(row * width, (row + 1) * width), extras.slice(row * beside, (row + 1) * beside), []),
  );
  await give(`${job.name}.outputs`, new Blob(rows));
  batch.close();
}

/** What the page says to a file that is dropped on it as a policy. */
async function refuse(live, gpu, job) {
  const batch = await opened(gpu, job);
  const said = await asked(job.file)
    .then((bytes) => batch.setPolicy(Policy.read(live, job.file, bytes)))
    .then(
      () => "it drives",
      (error) => error.message,
    );
  await give(`${job.name}.said`, said);
  batch.close();
}

const JOBS = { run, slider, stages, act, refuse };

try {
  const live = await readLive();
  const gpu = await openDevice(live);
  gpu.failed.then((message) => give("failed", message));
  gpu.lost.then((message) => give("failed", `the device was lost: ${message}`));
  await give(
    "limits",
    JSON.stringify({
      buffers: gpu.limits.maxStorageBuffersPerShaderStage,
      memory: gpu.limits.maxComputeWorkgroupStorageSize,
    }),
  );
  await Promise.all(live.code.act.flat().map((code, index) => gpu.module(`act text ${index}`, code)));
  await gpu.module("view", live.code.picture + live.code.view);
  for (const job of JSON.parse(new TextDecoder().decode(await asked("plan")))) await JOBS[job.kind](live, gpu, job);
  await give("messages", JSON.stringify(gpu.messages));
  await give("done", "");
} catch (error) {
  await give("failed", `${error.stack}`);
}
