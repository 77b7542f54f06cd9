//! A beam search over action sequences: can this route be completed from this start at all?
//!
//! At one speed all candidates of a depth have made the same progress, so they are ranked by a discounted cost of how
//! safely they drove; with several speeds driving slowly has a cost too. Candidates in nearly the same state would fill
//! the beam with copies of one plan: only the best of those is kept.

use std::collections::HashSet;
use std::sync::Arc;

use offtrack::layout::angle::wrapped;
use offtrack::layout::{Ended, Params, Rig, Start};
use offtrack::simulator::{Batch, RouteChoice, Simulator};
use offtrack::world::World;
use offtrack_policy::{Driver, Policy, greedy};

use super::check_levels;
use super::pending::{Cell, Pending};
use crate::error::Error;

/// Discount of a candidate's cost with each step: what lies long ago says little about what follows.
const DISCOUNT: f32 = 0.95;
/// Clearance below which a candidate has a cost (m).
const MARGIN: f32 = 0.6;
/// Cost of the squared distance to the lane centre [1/m^2]; the cost of touching a kerb is 1.
const LANE_WEIGHT: f32 = 0.1;
/// Cost of the squared heading difference between the tractor and the lane a little ahead [1/rad^2]. Without it a beam
/// misses the entry.
const HEADING_WEIGHT: f32 = 1.0;
/// Waypoints beyond the next one at which that lane heading is taken.
const AHEAD: usize = 1;
/// Cost of a load transfer ratio at its limit, to the fourth power: half of the limit costs little.
const LOAD_TRANSFER_WEIGHT: f32 = 0.3;
/// Cost of a standing truck where there are several speeds; at the highest it is 0. A load transfer ratio of 0.8 costs
/// as much as half of the highest speed.
const SLOWNESS_WEIGHT: f32 = 0.25;
/// Two candidates are in nearly the same state if these agree after rounding: position (m), headings (rad), steer
/// angle (rad).
const POSITION_BIN: f32 = 0.2;
const HEADING_BIN: f32 = 0.035;
pub(super) const STEER_BIN: f32 = 0.07;
/// Speed, where it is chosen (m/s).
const SPEED_BIN: f32 = 1.0;
/// Steer angles that differ by less are equal (rad).
const SAME_STEER: f32 = 1e-6;
/// The parent of the first segment.
pub(super) const ROOT: u32 = u32::MAX;

/// Width and time resolution of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pass {
    /// Candidates kept at each depth.
    pub width: usize,
    /// Steps that each chosen action is held for.
    pub hold: usize,
}

/// The result of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// [`Ended::Arrived`], or the end of the candidate with the most progress.
    pub ended: Ended,
    /// Fraction of the waypoints that this candidate passed.
    pub progress: f64,
    /// Number of steps of this candidate.
    pub steps: u32,
    /// Env steps of the search.
    pub env_steps: u64,
    /// Actions from the start to the arrival; empty without an arrival.
    pub actions: Vec<u32>,
}

/// The actions between two choices, and the segment before it.
#[derive(Debug)]
struct Segment {
    parent: u32,
    actions: Vec<u32>,
}

/// A candidate of the beam, at one row of the batch.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    /// The last segment of its sequence.
    pub(super) parent: u32,
    /// Actions since that segment.
    pub(super) actions: Vec<u32>,
    /// Action to hold; `None` for the candidate that has followed the policy from the start.
    pub(super) held: Option<u32>,
    /// How unsafely it drove, discounted.
    pub(super) cost: f32,
}

impl Candidate {
    /// Adds a step: its action, and what it cost.
    pub(super) fn follow(&mut self, action: u32, cost: f32) {
        self.actions.push(action);
        self.cost = DISCOUNT * self.cost + cost;
    }
}

/// Searches for a sequence of actions that completes `route` from `start`. With a `policy`, its own sequence is a
/// candidate until it fails.
pub fn search(
    world: &Arc<World>,
    route: u32,
    start: &Start,
    pass: Pass,
    policy: Option<&Policy>,
) -> Result<Outcome, Error> {
    check_levels(world)?;
    let mut simulator = Simulator::new(world.clone(), 1, 0, RouteChoice::Fixed(vec![route]))?;
    simulator.reset_from(&[*start])?;
    // One candidate alone follows the policy, from the start on.
    let mut driver = policy.map(|policy| policy.clone().driver(1));
    let mut segments: Vec<Segment> = Vec::new();
    let straight = nearest_to_straight(world);
    let mut beam =
        vec![Candidate { parent: ROOT, actions: Vec::new(), held: policy.is_none().then_some(straight), cost: 0.0 }];
    let mut outcome = Outcome { ended: Ended::Running, progress: 0.0, steps: 0, env_steps: 0, actions: Vec::new() };
    while !beam.is_empty() {
        let (rows, mut children) = branched(world, simulator.batch(), &beam, straight, pass.hold);
        simulator.gather(&rows)?;
        for _ in 0..pass.hold {
            let actions = chosen(driver.as_mut(), simulator.batch(), &children, straight);
            outcome.env_steps += simulator.batch().truck.iter().filter(|truck| truck.held == 0).count() as u64;
            simulator.step(&actions)?;
            for (env, child) in children.iter_mut().enumerate() {
                child.follow(actions[env], cost(world, simulator.batch(), env, SLOWNESS_WEIGHT));
            }
            if let Some(child) = arrived(simulator.batch(), &children) {
                outcome.actions = traced(&segments, child);
                (outcome.ended, outcome.progress, outcome.steps) = (Ended::Arrived, 1.0, outcome.actions.len() as u32);
                return Ok(outcome);
            }
        }
        note_furthest(world, simulator.batch(), &mut outcome);
        let survivors = selected(world, simulator.batch(), &children, pass.width);
        if survivors.is_empty() {
            break;
        }
        simulator.gather(&survivors)?;
        beam.clear();
        for &row in &survivors {
            let child = children[row as usize].clone();
            let parent = segments.len() as u32;
            segments.push(Segment { parent: child.parent, actions: child.actions });
            beam.push(Candidate { parent, actions: Vec::new(), ..child });
        }
    }
    Ok(outcome)
}

/// The action that steers least.
pub(super) fn nearest_to_straight(world: &World) -> u32 {
    let steering = |action: u32| world.actions[action as usize].steering.abs();
    (0..world.params.n_actions).min_by(|&a, &b| steering(a).total_cmp(&steering(b))).unwrap_or(0)
}

/// The children of all candidates, and the row that each branches from.
pub(super) fn branched(
    world: &World,
    batch: &Batch,
    beam: &[Candidate],
    straight: u32,
    hold: usize,
) -> (Vec<u32>, Vec<Candidate>) {
    let (mut rows, mut children) = (Vec::new(), Vec::new());
    for (row, candidate) in beam.iter().enumerate() {
        if candidate.held.is_none() {
            rows.push(row as u32);
            children.push(candidate.clone());
        }
        let rig = world.rig(&batch.truck[row]);
        let steering = Pending::new(world, rig, &batch.control[row]).followed(batch.truck[row].steering);
        for action in distinct(world, rig, steering, candidate.held.unwrap_or(straight), hold) {
            rows.push(row as u32);
            children.push(Candidate { held: Some(action), ..candidate.clone() });
        }
    }
    (rows, children)
}

/// The actions that differ within `hold` steps: the steer angle changes at a limited rate, so all levels beyond reach
/// are equal. The `last` action represents those equal to it, so that a sequence changes seldom. `steering` is the
/// steer angle once all that was asked for before has taken effect (rad).
fn distinct(world: &World, rig: &Rig, steering: f32, last: u32, hold: usize) -> Vec<u32> {
    let params = &world.params;
    let reach = rig.steer_rate * (hold as u32 * params.n_substeps) as f32 * params.substep;
    let reached = |action: u32| {
        let asked = &world.actions[action as usize];
        (asked.steering.clamp(steering - reach, steering + reach), asked.speed)
    };
    let mut found: Vec<u32> = Vec::new();
    for action in std::iter::once(last).chain(0..params.n_actions) {
        let (angle, speed) = reached(action);
        let same = |&other: &u32| (reached(other).0 - angle).abs() < SAME_STEER && reached(other).1 == speed;
        if !found.iter().any(same) {
            found.push(action);
        }
    }
    found
}

/// Each child's action for the next step: the held one, or the policy's for its observation.
fn chosen(driver: Option<&mut Driver>, batch: &Batch, children: &[Candidate], straight: u32) -> Vec<u32> {
    let mut actions: Vec<u32> = children.iter().map(|child| child.held.unwrap_or(straight)).collect();
    if let Some(driver) = driver
        && let Some(env) = children.iter().position(|child| child.held.is_none())
    {
        let around = batch.around.get(env..=env).unwrap_or_default();
        let outputs = driver.outputs_among(&[0], &batch.observation[env..=env], &batch.extras[env..=env], around);
        actions[env] = greedy(&outputs, outputs.len())[0];
    }
    actions
}

/// The cost of a candidate's last step, where standing costs `slowness`.
pub(super) fn cost(world: &World, batch: &Batch, env: usize, slowness: f32) -> f32 {
    let (truck, clearance, progress) = (&batch.truck[env], &batch.clearance[env], &batch.progress[env]);
    let previews = world.route_previews(truck.route);
    let lane_heading = previews[(progress.waypoint as usize + AHEAD).min(previews.len() - 1)].heading;
    let shortfall = (1.0 - clearance.tractor.min(clearance.trailer) / MARGIN).max(0.0);
    let load = truck.load_transfer_ratio() / world.params.rollover_ratio;
    let Params { target_speed_min, target_speed_max, .. } = world.params;
    // Where a truck may drive more slowly, safety alone would make it crawl.
    let slowly = if target_speed_min < target_speed_max { 1.0 - truck.speed / target_speed_max } else { 0.0 };
    shortfall.powi(2)
        + slowness * slowly
        + LANE_WEIGHT * progress.lane_distance.powi(2)
        + HEADING_WEIGHT * wrapped(truck.heading - lane_heading).powi(2)
        + LOAD_TRANSFER_WEIGHT * load.powi(4)
}

/// The cheapest candidate that arrived in the last step.
fn arrived<'a>(batch: &Batch, children: &'a [Candidate]) -> Option<&'a Candidate> {
    let candidates = children.iter().zip(&batch.ended).filter(|&(_, &ended)| ended == Ended::Arrived as u32);
    candidates.map(|(child, _)| child).min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// All actions of `candidate`, from the start on.
fn traced(segments: &[Segment], candidate: &Candidate) -> Vec<u32> {
    let mut parts = vec![&candidate.actions];
    let mut parent = candidate.parent;
    while let Some(segment) = segments.get(parent as usize) {
        parts.push(&segment.actions);
        parent = segment.parent;
    }
    parts.into_iter().rev().flatten().copied().collect()
}

/// Updates the outcome with the candidate that made the most progress.
fn note_furthest(world: &World, batch: &Batch, outcome: &mut Outcome) {
    for ((truck, progress), &ended) in batch.truck.iter().zip(&batch.progress).zip(&batch.ended) {
        let progress_made = f64::from(progress.waypoint) / f64::from(world.routes[truck.route as usize].n_waypoints);
        if (outcome.progress, outcome.steps) <= (progress_made, truck.steps) {
            (outcome.progress, outcome.steps) = (progress_made, truck.steps);
            outcome.ended = Ended::of_column(ended);
        }
    }
}

/// The rows to keep: the policy's own while it runs, then the cheapest; of nearly equal states only the cheapest.
pub(super) fn selected(world: &World, batch: &Batch, children: &[Candidate], width: usize) -> Vec<u32> {
    let mut running: Vec<u32> = (0..children.len() as u32).filter(|&row| batch.truck[row as usize].held == 0).collect();
    let rank = |row: u32| (children[row as usize].held.is_some(), children[row as usize].cost);
    running.sort_by(|&a, &b| rank(a).0.cmp(&rank(b).0).then(rank(a).1.total_cmp(&rank(b).1)));
    let mut taken = HashSet::new();
    running.retain(|&row| taken.len() < width && taken.insert(bin(world, batch, row as usize)));
    running
}

/// The cell of the state space that a truck is in: nearly equal states share one.
fn bin(world: &World, batch: &Batch, row: usize) -> ([i32; 6], Cell) {
    let truck = &batch.truck[row];
    let pending = Pending::new(world, world.rig(truck), &batch.control[row]).cell();
    let articulation = wrapped(truck.heading - truck.trailer_heading);
    let cell = [
        truck.position.x / POSITION_BIN,
        truck.position.y / POSITION_BIN,
        truck.heading / HEADING_BIN,
        articulation / HEADING_BIN,
        truck.steering / STEER_BIN,
        truck.speed / SPEED_BIN,
    ]
    .map(|value| value.round() as i32);
    (cell, pending)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world() -> Arc<World> {
        Arc::new(World::bake(&offtrack::scenario::Scenario::named("attard2023").unwrap()).unwrap())
    }

    #[test]
    fn actions_that_the_steer_rate_makes_equal_are_tried_once_and_the_last_one_represents_them() {
        let world = world();
        // 20 deg/s give 2 deg in a step and levels lie 8 deg apart: straight on, or towards either side.
        assert_eq!(distinct(&world, &world.rigs[0], 0.0, 4, 1), [4, 0, 5]);
        assert_eq!(distinct(&world, &world.rigs[0], 0.0, 7, 1), [7, 0, 4]);
        // A level 1 deg away is reached, and the wheels can move beyond it.
        assert_eq!(distinct(&world, &world.rigs[0], 7.0f32.to_radians(), 8, 1), [8, 0, 5]);
        // In 40 steps every level is reached.
        assert_eq!(distinct(&world, &world.rigs[0], 0.0, 4, 40).len(), 9);
    }

    #[test]
    fn a_found_sequence_is_traced_back_to_the_start() {
        let segment = |parent, action: u32| Segment { parent, actions: vec![action; 2] };
        let segments = [segment(ROOT, 1), segment(ROOT, 2), segment(1, 3)];
        let candidate = Candidate { parent: 2, actions: vec![4], held: None, cost: 0.0 };
        assert_eq!(traced(&segments, &candidate), [2, 2, 3, 3, 4]);
    }

    #[test]
    fn a_beam_keeps_at_most_its_width_and_one_candidate_a_state() {
        let world = world();
        let mut simulator = Simulator::new(world.clone(), 6, 0, RouteChoice::Fixed(vec![0, 0, 0, 20, 20, 40])).unwrap();
        simulator.reset_from(&[Start::default(); 6]).unwrap();
        let child = |held, cost| Candidate { parent: ROOT, actions: Vec::new(), held, cost };
        let children = [
            child(Some(4), 0.3),
            child(Some(4), 0.1),
            child(None, 9.0),
            child(Some(4), 0.5),
            child(Some(4), 0.4),
            child(Some(4), 0.2),
        ];
        // The policy's own first, whatever its cost; then the cheapest of each state.
        assert_eq!(selected(&world, simulator.batch(), &children, 64), [2, 5, 4]);
        assert_eq!(selected(&world, simulator.batch(), &children, 2), [2, 5]);
    }

    #[test]
    fn a_search_that_cannot_succeed_reports_its_progress() {
        let world = world();
        let route = world.route_names.iter().position(|name| name == "20m/N-left-4").unwrap() as u32;
        // A beam of one candidate turns too late.
        let outcome = search(&world, route, &Start::default(), Pass { width: 1, hold: 1 }, None).unwrap();
        assert!(outcome.ended.failed() && outcome.actions.is_empty(), "{outcome:?}");
        assert!(
            0.1 < outcome.progress && outcome.progress < 1.0 && 0 < outcome.steps && 0 < outcome.env_steps,
            "{outcome:?}"
        );
    }
}
