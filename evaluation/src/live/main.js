// Reads the data blocks and starts the page, with what its address asks for.

const live = await readLive();
const page = new App(live);
window.offtrackLive = page;
await followAddress(page);
