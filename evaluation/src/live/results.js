// How the crowd's episodes end: the large figures, a table beside what is reported, and the list of failures.

/** Failures in the list. */
const MOST_LISTED = 40;

/** Ends of a tally on a world, those that occur first; `running` is none, and where there are no other vehicles none is
 * met. */
const endNames = (live, { facts }) => live.facts.code.ended.filter((name) =>
  name !== "running" && (facts.traffic || !["met_vehicle", "was_met"].includes(name)));

/** Which vehicle a failure met, by which unit and where; nothing if it met none. */
const metWords = ({ met, contact }) => (met === 0 ? "" : `${contact & 1 ? "tractor" : "trailer"} on a ${
  ["car", "van", "bus or truck"][met - 1]} ${contact & 2 ? "beyond" : "before"} its line`);

/** The evaluation of a policy on a benchmark that is reported, of the split that is driven if there is one. */
function reportedOf(policy, world, split) {
  // The roads of others are not those of the evaluation.
  if (!world.facts.is_whole) return undefined;
  const known = (policy?.reported ?? []).filter(({ benchmark }) => benchmark === world.facts.name);
  return known.find((one) => one.split === split) ?? known.find((one) => one.split === "test") ?? known[0];
}

/** The name of a policy on the page. */
const policyWords = (policy) => (policy === null ? "random actions" : policy.name.replace(" (shipped)", ""));

/** A fraction as a percentage with as many digits as its number of trials bears. */
const successWords = (success, episodes) =>
  (episodes === 0 ? "–" : `${decimal(100 * success, episodes < 1000 ? 1 : 2)}${GAP}%`);

/** Shows the figures of one or two crowds. */
function showResults(live, crowds, split) {
  const speed = crowds.reduce((sum, crowd) => sum + (crowd.speed || 0), 0), { step } = crowds[0].world.facts;
  // Nothing moves while the page is paused.
  byId("speed").textContent = speed === 0 ? "–" : short(speed);
  byId("speed-note").textContent = speed === 0 ? "" : `${short(speed * step)} × real time`;
  const [{ tally, policy, world }] = crowds, reported = reportedOf(policy, world, split);
  const successes = crowds.map((crowd) => successWords(crowd.tally?.success, crowd.tally?.episodes ?? 0));
  byId("success").textContent = successes.join(" | ");
  byId("success-of").textContent = `arrived, of ${short(tally?.episodes ?? 0)}`;
  byId("success-note").textContent = reported && crowds.length === 1
    ? `reported: ${whole(reported.arrived)} of ${whole(reported.episodes)}, ${reported.split} routes` : "";
  showEnds(live, crowds, crowds.length === 1 ? reported : undefined);
}

function showEnds(live, crowds, reported) {
  const counted = crowds.map(({ tally }) => tally ?? { episodes: 0, ended: {} });
  const isAlone = crowds.length === 1;
  const heads = crowds.map(({ policy }) => html("th", { scope: "col" }, isAlone ? "live" : policyWords(policy)));
  const cell = ({ ended, episodes }, name) => {
    const n = ended[name] ?? 0, fraction = n === 0 ? "" : successWords(n / episodes, episodes);
    return html("td", { title: fraction }, isAlone && 0 < n ? `${short(n)} · ${fraction}` : short(n));
  };
  const known = (name) =>
    html("td", { class: "muted" }, name === "arrived" ? percent(reported.arrived / reported.episodes) : "");
  const rows = endNames(live, crowds[0].world).map((name) => html("tr", {},
    html("th", { scope: "row" }, html("i", { class: "swatch", style: `--swatch: var(--end-${name})` }), endWords(name)),
    ...counted.map((tally) => cell(tally, name)), reported && known(name)));
  byId("ends").replaceChildren(
    html("thead", {}, html("tr", {}, html("th", {}), ...heads, reported && html("th", { scope: "col" }, "reported"))),
    html("tbody", {}, ...rows));
  const [{ batch: { begun, n } }] = crowds;
  const out = begun < n ? `${whole(begun)} of ${whole(n)} trucks have set out. ` : "";
  const ended = counted.map(({ episodes }) => whole(episodes)).join(" and ");
  const yours = crowds.reduce((sum, { driven }) => sum + driven.size, 0);
  const byYou = yours === 0 ? "" : ` Those that you drive in count, too: ${whole(yours)} so far.`;
  byId("ends-note").textContent = `${out}Episodes that have ended: ${ended}.${byYou}`;
}

/** Shows failures, each a button that calls `open`. The list is made anew only where it has changed. */
class FailureList {
  constructor(open) {
    this.open = open;
    this.key = "";
  }

  show(crowds) {
    const most = Math.ceil(MOST_LISTED / crowds.length);
    const all = crowds.flatMap((crowd) => crowd.failures.slice(0, most).map((failure) => ({ crowd, failure })));
    const count = crowds.reduce((sum, { tally }) => sum + failuresOf(tally), 0);
    byId("failures-count").textContent = count === 0 ? "none yet" : whole(count);
    const who = crowds.map(({ taken }) => taken).join("/");
    const key = `${who} ${all.map(({ failure }) => `${failure.env}/${failure.episode}`).join(" ")}`;
    // An entry that has the focus stays where it is, unless its crowd is gone.
    if (key === this.key || (who === this.who && byId("failures").contains(document.activeElement))) return;
    Object.assign(this, { key, who });
    byId("failures").replaceChildren(...all.map(({ crowd, failure }) => {
      const { ended, route, env, episode } = failure, { name } = crowd.world.facts.routes[route];
      const onclick = () => this.open(crowd, failure);
      const driver = crowd.driven.has(`${env}/${episode}`) ? "you" : `truck ${env}`;
      const met = metWords(failure);
      return html("li", {}, html("button", { type: "button", style: `--end: var(--end-${ended})`, onclick },
        html("b", { "aria-hidden": "true" }, "×"), html("span", {}, endWords(ended)),
        html("span", { class: "muted" }, `${name}, ${driver}`), met && html("span", { class: "muted met" }, met)));
    }));
  }
}

/** Episodes of a tally that did not arrive. */
const failuresOf = (tally) => (tally ? tally.episodes - (tally.ended.arrived ?? 0) : 0);
