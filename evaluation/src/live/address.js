// What the part of the address behind # asks for: `#n=512&seed=3&benchmark=laden2026&road=20m`. A road may be a random
// one, wide/7/12, where the page bakes.

/** What it may name. */
const ADDRESS_KEYS = ["n", "seed", "benchmark", "road"];
/** Roads that are listed where there is none of that name, and letters of what was not understood, at most. */
const MOST_NAMED = 8, MOST_LETTERS = 40;

/** Begins with what the address asks for, and follows it where it changes. */
async function followAddress(page) {
  window.addEventListener("hashchange", async () => {
    const { chosen, ...rest } = askedByAddress(page);
    page.baker.leave();
    if (0 < Object.keys(chosen).length) await page.attempt(() => page.choose(chosen));
    await bakeByAddress(page, rest);
  });
  const { chosen, ...rest } = askedByAddress(page);
  page.ready.then(() => bakeByAddress(page, rest));
  await page.start(chosen);
}

/** Drives on the random road that the address names, and says what of it was not understood. */
async function bakeByAddress(page, { road, wrong }) {
  if (road !== null) await page.baker.drive(road);
  if (0 < wrong.length) page.say(`Of the address behind #: ${wrong.join("; ")}.`, true);
}

/** What the address chooses, its random road or null, and what of it the page does not understand. */
function askedByAddress({ live, chosen: before, baker }) {
  const asked = new URLSearchParams(location.hash.slice(1)), { worlds } = live.facts, chosen = {}, wrong = [];
  const named = (key) => {
    const text = `${key}=${asked.get(key)}`;
    return text.length <= MOST_LETTERS ? text : `${text.slice(0, MOST_LETTERS)}...`;
  };
  const number = (name, least, most) => {
    const text = asked.get(name), value = Number(text);
    if (text === null) return;
    if (/^\d+$/.test(text) && least <= value && value <= most) chosen[name] = value;
    else wrong.push(`${named(name)} is no whole number from ${whole(least)} to ${whole(most)}`);
  };
  number("n", 1, COUNTS.at(-1));
  number("seed", 0, 2 ** 32 - 1);
  const benchmark = asked.get("benchmark"), world = worlds.findIndex(({ name }) => name === benchmark);
  if (0 <= world) chosen.world = world;
  else if (benchmark !== null) wrong.push(`${named("benchmark")} is none of this page`);
  const name = asked.get("road"), { roads, splits } = worlds[chosen.world ?? before.world];
  const index = roads.findIndex((road) => road.name === name), isRandom = name !== null && name.includes("/");
  if (0 <= index) chosen.road = index;
  else if (Object.hasOwn(splits, name ?? "")) chosen.road = name;
  else if (isRandom && !baker.isThere) wrong.push(`${named("road")} needs a page that bakes roads`);
  else if (name !== null && !isRandom) {
    const more = MOST_NAMED < roads.length ? ", ..." : "";
    wrong.push(`${named("road")} is none of ${roads.slice(0, MOST_NAMED).map((road) => road.name).join(", ")}${more}`);
  }
  for (const key of asked.keys()) {
    if (!ADDRESS_KEYS.includes(key)) wrong.push(`${named(key)} is none of ${ADDRESS_KEYS.join(", ")}`);
  }
  return { chosen, road: isRandom && index < 0 && baker.isThere ? name : null, wrong };
}
