// Stands in place of the last script of a live page: times the steps of its trucks, without a picture.

const plan = await (await fetch("plan")).json();

/** Times of steps, each the mean of a few that are submitted at once (ms). */
async function timed(live, gpu, policy) {
  const batch = await Batch.open(gpu, await gpu.world(0), { n: plan.envs });
  if (policy !== null) await batch.setPolicy(Policy.shipped(live, policy));
  batch.beginAll();
  await batch.advance(plan.before);
  const times = [], end = performance.now() + 1000 * plan.seconds;
  do {
    const begun = performance.now();
    await batch.advance(plan.at_once);
    times.push((performance.now() - begun) / plan.at_once);
  } while (performance.now() < end);
  batch.close();
  return times;
}

try {
  const live = await readLive(), gpu = await openDevice(live), { vendor, architecture } = gpu.adapter.info;
  const times = { random: await timed(live, gpu, null), policy: await timed(live, gpu, 0) };
  const found = { adapter: `${vendor} ${architecture}`, ...times };
  await fetch("done", { method: "POST", body: JSON.stringify(found) });
} catch (error) {
  await fetch("failed", { method: "POST", body: `${error.stack}` });
}
