// The panel of the truck that is followed: how it drives, what it observes, and what its policy makes of that.

/** Largest of the two units' load transfer ratios. */
const transferOf = ({ truck }) =>
  Math.max(Math.abs(truck.tractor_load_transfer_ratio), Math.abs(truck.trailer_load_transfer_ratio));
const articulationOf = ({ truck }) => wrapped(truck.heading - truck.trailer_heading);

/** The readings: name, value of a step as it is seen, text. Each is also a small curve over the episode. */
const LIVE_READINGS = [
  ["Speed", ({ row }) => 3.6 * row.truck.speed, (value) => `${decimal(value, 1)}${GAP}km/h`, "tall"],
  ["Load transfer ratio", ({ row }) => transferOf(row), (value) => decimal(value, 2), "tall"],
  ["Off-tracking", ({ offTracking }) => offTracking, metres],
  ["Steering", ({ row }, side) => side * toDegrees(row.truck.steering), turnWords],
  ["Articulation", ({ row }, side) => side * toDegrees(articulationOf(row)), (value) => degrees(value, 1)],
  // At its start a truck is not judged: the clearance is still that of the episode before.
  ["Nearest kerb", ({ row }) => (row.truck.steps === 0 ? null : Math.min(row.clearance.tractor, row.clearance.trailer)),
    metres],
  ["Lane's centre", ({ row }) => row.progress.lane_distance, metres],
];
/** Points of a small curve, and pictures of the panel a second. */
const MOST_SPARKS = 120, PANEL_RATE = 8;

class Followed {
  constructor(live) {
    this.live = live;
    this.crowd = null;
    this.shownAt = 0;
    byId("readings").replaceChildren(...LIVE_READINGS.map(([name, , , kind]) =>
      html("div", { class: kind }, html("dt", {}, name), html("dd", {}), sparkline([0, 0]))));
  }

  /** Shows the truck that a crowd follows; none with null. */
  open(crowd) {
    this.crowd = crowd;
    byId("truck").hidden = crowd === null;
    if (crowd === null) return;
    const { world, policy } = crowd, facts = this.live.facts.code, { extras, traffic } = world.facts;
    const extra = extras.map((name, n) => {
      const { doc } = facts.extras.find((extra) => extra.name === name);
      return { name, doc, n: 1, low: -1, first: facts.n_values + n };
    });
    const behind = facts.n_values + extras.length;
    const around = traffic?.observed ? facts.around.map((one) => ({ ...one, first: behind + one.first })) : [];
    const observed = [...facts.observation, ...extra, ...around];
    const count = observed.reduce((sum, { n }) => sum + n, 0);
    byId("values-summary").textContent = `The ${count} values that it observes`;
    this.values = new ValueBars(observed);
    byId("values").replaceChildren(this.values.node);
    byId("policy-part").hidden = policy === null;
    this.outputs = null;
    if (policy) this.showOutputs();
    this.show(true);
  }

  /** Makes the cells of a policy's outputs, from left to right as they are seen. */
  showOutputs() {
    const { world, side } = this.crowd;
    this.side = side;
    this.outputs = new OutputCells(world.facts.actions.map(([steering, ...more]) => [side * steering, ...more]));
    byId("outputs").replaceChildren(this.outputs.node);
  }

  /** Shows the latest step, some times a second. */
  show(atOnce = false) {
    const { crowd } = this, now = performance.now();
    if (crowd === null || crowd.row === null || (!atOnce && now - this.shownAt < 1000 / PANEL_RATE)) return;
    this.shownAt = now;
    const { row, steps, world, side } = crowd;
    this.name(row);
    LIVE_READINGS.forEach(([, value, words], index) => {
      const node = byId("readings").children[index], values = thinned(steps.map((step) => value(step, side)), MOST_SPARKS);
      if (values.length === 0) return;
      node.querySelector("dd").textContent = words(values.at(-1));
      node.querySelector("svg").replaceWith(sparkline(values));
    });
    const around = world.facts.traffic?.observed ? row.around : [];
    const seen = [...row.observation, ...[...row.extras].slice(0, world.facts.extras.length), ...around];
    this.values.show(seen);
    if (this.outputs) {
      if (side !== this.side) this.showOutputs();
      const best = this.outputs.show(crowd.policy.outputs(row.observation, row.extras, row.around));
      // Behind the table's actions stands that of a visitor who drives.
      byId("outputs-words").textContent = `${row.action < world.facts.n_actions ? "chooses" : "would choose"} ${best}`;
    }
  }

  /** Which truck it is, which load it carries, and among which vehicles it drives. */
  name({ truck }) {
    const { world, failure, followed } = this.crowd, { facts } = world, env = failure?.env ?? followed;
    byId("truck-title").textContent = `Truck ${whole(env)}`;
    byId("truck-route").textContent = `${facts.routes[truck.route].name}, episode ${truck.episode}`;
    byId("truck-load").textContent = truckWords(facts, truck.vehicle);
    byId("truck-vehicles").hidden = !facts.traffic;
    if (facts.traffic) byId("truck-vehicles").textContent = vehiclesWords(this.crowd.vehicles());
  }
}

/** Words for the vehicles around a truck. */
const vehiclesWords = ({ n, slow, demand }) =>
  `among ${whole(n)} vehicles of ${whole(demand)} an hour${slow === 0 ? "" : `; ${whole(slow)} slowed by it`}`;

/** Words for the names of vehicles and loads in `scenarios/vehicles/`. */
const loadWords = (load) => (load === "half" ? "half laden" : load.replaceAll("_", " "));

/** Vehicle and load of a row of the table of vehicles. */
function truckWords(facts, index) {
  const { vehicle, load } = facts.classes[facts.vehicles[index]];
  return [vehicle.replaceAll("_", " "), `trailer ${loadWords(load)}`].filter(Boolean).join(", ");
}
