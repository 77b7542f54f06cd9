// With many routes: a table of groups of routes, and the routes of one roundabout or the worst of all.

/** Most rows of the worst roundabouts, and of routes. */
const MOST_ROUNDABOUTS = 20, MOST_ROUTES = 200;

const KINDS = [["island_radius", "Island radius"], ["lane", "Lane"], ["exit", "Exit"], ["demand", "Demand"], ["roundabout", "Roundabout"]];

const failures = ({ episodes, arrived }) => episodes - arrived;

/** Those with the least success first. */
const worstFirst = (summaries) => summaries.toSorted((a, b) => a.success - b.success || failures(b) - failures(a));

/** Fills both tables; a roundabout's name shows its routes. */
function showGroups(page, scales, open) {
  const { evaluation } = page, { groups } = evaluation, select = byId("roundabout");
  for (const id of ["groups", "routes-choice"]) byId(id).hidden = false;
  const choose = (name) => {
    select.value = name;
    showRoutesOf(page, name, scales, open);
  };
  const label = (kind, name) => (kind === "roundabout"
    ? html("button", { type: "button", class: "link", "aria-label": `Routes of ${name}`, onclick: () => { choose(name); byId("routes").scrollIntoView({ block: "start" }); } }, name)
    : html("span", { class: "label" }, name));
  const body = ([kind, title]) => {
    const worst = kind === "roundabout";
    const members = worst ? worstFirst(groups[kind]).filter((group, index) => 0 < failures(group) && index < MOST_ROUNDABOUTS) : groups[kind];
    const count = groups[kind].length, failed = groups[kind].filter((group) => 0 < failures(group)).length;
    const words = worst ? `${title}: the worst ${members.length} of ${whole(failed)} with a failure, of ${whole(count)}` : title;
    return html("tbody", {}, html("tr", { class: "group" }, html("th", { scope: "rowgroup", colspan: 6 }, words)),
      ...members.map((group) => html("tr", { class: "member" }, html("th", { scope: "row" }, label(kind, group.name),
        html("span", { class: "tag" }, `${whole(group.routes)} ${group.routes === 1 ? "route" : "routes"}`)), ...cells(group, scales))));
  };
  fillTable(byId("group-table"), "The same figures of groups of routes", "Routes by", KINDS.filter(([kind]) => groups[kind] !== undefined).map(body));
  const words = (group) => `${group.name}: ${failures(group) === 0 ? "all" : whole(group.arrived)} of ${whole(group.episodes)} arrived`;
  select.replaceChildren(html("option", { value: "" }, "All, worst routes first"),
    ...worstFirst(groups.roundabout).map((group) => html("option", { value: group.name }, words(group))));
  select.addEventListener("change", () => choose(select.value));
  choose("");
}

/** Fills the table of routes with those of a roundabout, or with the worst of all. */
function showRoutesOf(page, roundabout, scales, open) {
  const { routes } = page.evaluation;
  const all = worstFirst(roundabout === "" ? routes.filter((route) => 0 < failures(route)) : routes.filter((route) => roundaboutOf(route.name) === roundabout));
  const listed = all.slice(0, MOST_ROUTES);
  const head = roundabout === "" || all.length === 0 ? [] : [html("tr", { class: "group" }, html("th", { scope: "rowgroup" }, roundabout), ...cells(merged(all), scales))];
  const name = (route) => (roundabout === "" ? route.name : withinRoundabout(route.name));
  fillTable(byId("route-table"), ROUTES_CAPTION, "Route", [html("tbody", {}, ...head, ...listed.map((route) => routeRow(page, route, name(route), scales, open)))]);
  const what = roundabout === "" ? `routes with a failure, of ${whole(routes.length)}` : `routes of ${roundabout}`;
  byId("listed").textContent = listed.length < all.length ? `The worst ${listed.length} of ${whole(all.length)} ${what}.` : `${whole(all.length)} ${what}.`;
}
