// Reads the data blocks and starts the page. `#n=512&seed=3&benchmark=laden2026&road=20m` chooses what it begins
// with; a road may be a random one, wide/7/12, where the page bakes.

const live = await readLive();
const page = new App(live);
window.offtrackLive = page;
await page.start(chosenByAddress(live.facts, page.chosen.world));
page.baker.driveByAddress();
