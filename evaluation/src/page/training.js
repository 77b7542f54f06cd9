// The training routes on which the policy fails most, as the run counted them while it learned.

/** Shows the table if the run counted its routes and any failed. */
function showTrainingRoutes({ report }) {
  const counted = report.training_routes, worst = counted?.worst ?? [];
  byId("training-routes").hidden = worst.length === 0;
  if (worst.length === 0) return;
  byId("training").hidden = false;
  byId("training-routes-note").textContent =
    `The worst ${worst.length} of ${whole(counted.routes)} training routes, by success in the latest ${counted.window} episodes of each. Actions are explored while a policy learns.`;
  const heads = ["Route", `Latest ${counted.window}`, "All", "Episodes", "Timed out", "Island radius"];
  byId("training-route-table").replaceChildren(
    html("thead", {}, html("tr", {}, ...heads.map((head) => html("th", { scope: "col" }, head)))),
    html("tbody", {}, ...worst.map((route) => html("tr", {}, html("th", { scope: "row" }, route.route),
      ...[percent(route.recent_success), percent(route.success), whole(route.episodes), whole(route.timed_out), metres(route.island_radius)].map((text) => html("td", {}, text))))));
}
