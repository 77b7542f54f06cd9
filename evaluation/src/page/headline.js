// The result in one number, compared with the published study on the study's benchmarks, and the figures behind it.

/** As published by Attard and Bajada (2023) for their soft actor-critic, and the benchmarks with their routes. */
const STUDY = {
  benchmarks: ["attard2023", "attard2023-as-run"], routes: { test: 23, train: 52 },
  test: { arrived: 506, episodes: 690 }, train: { arrived: 1240, episodes: 1560 },
  laneDistance: 0.73, envSteps: 1.5e6,
};
const ROUTES = { test: "unseen routes", train: "training routes" };

/** A 95 % interval as text. */
const interval = (low, high) => `${decimal(100 * low, 1)}\u2060\u2013\u2060${percent(high)}`;

/** The interval over routes as text; empty where there is none, or it has no width. */
function overRoutes({ success_low_over_routes: low, success_high_over_routes: high }) {
  return low < high ? `; over routes ${interval(low, high)}` : "";
}

function fraction(summary) {
  const { arrived, episodes } = summary, [low, high] = wilson(arrived, episodes);
  return html("td", {}, percent(arrived / episodes), html("span", { class: "muted" }, ` ${whole(arrived)}/${whole(episodes)}, ${interval(low, high)}${overRoutes(summary)}`));
}

/** Whether the routes are the study's, all of them; of further evaluations, which are of whole splits, by the benchmark. */
const comparable = ({ benchmark, split, routes }) => STUDY.benchmarks.includes(benchmark)
  && (routes === undefined || routes.length === (STUDY.routes[split] ?? routes.length));

/** Fills the header and the first section. */
function showHeadline(page) {
  const { report, evaluation, ground } = page;
  const facts = [`policy ${evaluation.policy}`, report.seed !== undefined && `seed ${report.seed}`,
    `commit ${report.commit ?? ground.commit}`];
  byId("subtitle").textContent = facts.filter(Boolean).join(" · ");
  const routes = ROUTES[evaluation.split] ?? `${evaluation.split} routes`;
  byId("verdict").replaceChildren(
    html("p", { class: "big" }, percent(evaluation.success)),
    html("p", {}, `of all episodes on ${evaluation.routes.length} ${routes} arrived`),
    html("p", { class: "muted" }, `${whole(evaluation.arrived)} of ${whole(evaluation.episodes)}; 95${GAP}% Wilson interval ${interval(evaluation.success_low, evaluation.success_high)}${overRoutes(evaluation)}`));
  const bars = [["This policy", evaluation.success, evaluation.success_low, evaluation.success_high, "var(--good)"]];
  const { certified } = evaluation;
  if (certified) bars.push(["This policy, certified routes", certified.success, certified.success_low, certified.success_high, "var(--good)"]);
  const study = comparable(evaluation) && STUDY[evaluation.split];
  if (study) bars.push(["Study, 2023 (SAC)", study.arrived / study.episodes, ...wilson(study.arrived, study.episodes), "var(--study)"]);
  byId("comparison").replaceChildren(html("div", { class: "bars" }, ...bars.flatMap(([name, value, low, high, colour]) =>
    [html("span", {}, name), html("strong", {}, percent(value)), fractionBar(value, low, high, colour, 24)])));
  showFigures(page, routes, study, certified);
}

function showFigures({ report, evaluation, ground }, routes, study, certified) {
  const { possible } = evaluation, also = report.also ?? [];
  const own = evaluation.own_lane_suffices, deviating = evaluation.needs_deviation, compared = comparable(evaluation);
  const rows = [
    [`Success, ${routes}`, fraction(evaluation), study && fraction(study)],
    certified && ["Success, certified routes", fraction(certified)],
    possible?.episodes && ["Success, starts shown to be possible", fraction(possible)],
    own && ["Success where the own lane suffices", fraction(own)],
    own && deviating && ["Success where it does not", fraction(deviating)],
    ...also.map((other) => [`Success, ${other.benchmark}, ${other.split} routes (${other.trained_on === 0 ? "zero-shot" : `${whole(other.trained_on)} of them trained on`})`,
      fraction(other), comparable(other) && STUDY[other.split] && fraction(STUDY[other.split])]),
    compared && evaluation.split === "test" && !also.some((other) => comparable(other) && other.split === "train") && ["Success, training routes", null, fraction(STUDY.train)],
    ["Mean distance to the lane centre", metres(evaluation.lane_distance_mean), compared && metres(STUDY.laneDistance)],
    own && ["The same where the own lane suffices", metres(own.lane_distance_mean)],
    typeof evaluation.outside_lane_mean === "number" && ["Time outside the own lane, of episodes that arrived", percent(evaluation.outside_lane_mean)],
    typeof own?.outside_lane_mean === "number" && ["The same where the own lane suffices", percent(own.outside_lane_mean)],
    report.env_steps !== undefined && ["Env steps of training", whole(report.env_steps), compared && whole(STUDY.envSteps)],
  ].filter(Boolean);
  const cell = (value) => (value instanceof Node ? value : html("td", {}, value || "\u2013"));
  byId("figures").replaceChildren(
    html("caption", { class: "unseen" }, compared ? "Figures of this run and of the published study" : "Figures of this run"),
    html("thead", {}, html("tr", {}, html("td", {}), html("th", { scope: "col" }, "This run"),
      compared ? html("th", { scope: "col" }, "Attard and Bajada (2023), SAC") : null)),
    html("tbody", {}, ...rows.map(([name, ours, theirs]) =>
      html("tr", {}, html("th", { scope: "row" }, name), cell(ours), compared ? cell(theirs) : null))));
  byId("study").hidden = !compared;
  showCauses(evaluation);
  const facts = [
    ["Episodes evaluated", whole(evaluation.episodes)],
    ["Training time", report.seconds !== undefined && `${decimal(report.seconds / 60, 1)}${GAP}min`],
    ["Training episodes", report.episodes !== undefined && whole(report.episodes)],
    ["Updates", report.updates !== undefined && whole(report.updates)],
    ["Seed", report.seed !== undefined && String(report.seed)],
    ["Seed of the start poses", String(evaluation.seed)],
    [report.machine === undefined ? "Evaluated on" : "Machine", report.machine ?? ground.machine],
    ["Commit", report.commit ?? ground.commit],
  ];
  byId("facts").replaceChildren(...facts.filter(([, value]) => value).map(([name, value]) => html("div", {}, html("dt", {}, name), html("dd", {}, value))));
}

/** Why episodes did not arrive, a row a cause, the commonest first. */
function showCauses({ failures }) {
  byId("causes").hidden = failures.length === 0;
  const searched = failures.some((cause) => cause.possible !== undefined);
  const heads = ["Not arrived, by cause", "Episodes", searched && "From a possible start", "For example"].filter(Boolean);
  byId("causes").replaceChildren(
    html("thead", {}, html("tr", {}, ...heads.map((head) => html("th", { scope: "col" }, head)))),
    html("tbody", {}, ...failures.map(({ cause, episodes, share, possible, example }) => html("tr", {},
      html("th", { scope: "row" }, cause), html("td", {}, `${whole(episodes)}, ${percent(share)}`),
      searched ? html("td", {}, whole(possible)) : null, html("td", {}, `${example.route}, episode ${example.episode}`)))));
}
