//! A beam search over action sequences: can this route be completed from this start at all?
//!
//! At one speed all candidates are equally far along at equal depth, so they are ranked by how safely they drove of late. Candidates that
//! are nearly in the same state would fill a beam with copies of one plan: of those only the best is kept.

use std::collections::HashSet;
use std::sync::Arc;

use offtrack::angle::wrapped;
use offtrack::layout::{Ended, Start, Truck};
use offtrack::simulator::{Batch, RouteChoice, Simulator};
use offtrack::world::World;

use crate::error::Error;
use crate::policy::Policy;

/// Share of a candidate's cost that is left after a step: what was long ago says little of what comes.
const MEMORY: f32 = 0.95;
/// Clearance below which a candidate pays for lacking it [m].
const MARGIN: f32 = 0.6;
/// Cost of a metre off the lane centre, beside that of touching a kerb: 1. Counts squared.
const LANE_WEIGHT: f32 = 0.1;
/// Cost of a radian between the tractor and the lane a little ahead. Counts squared; without it a beam drives past the ring's entry.
const HEADING_WEIGHT: f32 = 1.0;
/// Waypoints beyond the next one where that lane heading is read.
const AHEAD: usize = 1;
/// Cost of a load transfer ratio at its limit. Counts to the fourth power: half of the limit is no concern.
const LOAD_TRANSFER_WEIGHT: f32 = 0.3;
/// Candidates are nearly in the same state when these are the same after rounding: place [m], headings [rad], steer angle [rad].
const PLACE_BIN: f32 = 0.2;
const HEADING_BIN: f32 = 0.035;
const STEER_BIN: f32 = 0.07;
/// Steer angles reached that differ by less are the same [rad].
const SAME_STEER: f32 = 1e-6;
/// Before the first stretch.
const NOTHING: u32 = u32::MAX;

/// How broad a search is and how finely it chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pass {
    /// Candidates kept at each depth.
    pub width: usize,
    /// Steps that each chosen action is held for.
    pub hold: usize,
}

/// What a search came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// [`Ended::Arrived`], or how the candidate that got furthest ended.
    pub ended: Ended,
    /// Share of the waypoints that the candidate that got furthest passed.
    pub progress: f64,
    /// Steps that it took.
    pub steps: u32,
    /// Env steps spent.
    pub env_steps: u64,
    /// Actions from the start to the arrival; none when none arrived.
    pub actions: Vec<u32>,
}

/// What was done between two choices, and after which.
#[derive(Debug)]
struct Stretch {
    before: u32,
    actions: Vec<u32>,
}

/// A candidate under way, at one row of the batch.
#[derive(Debug, Clone)]
struct Candidate {
    /// Which stretch led here.
    before: u32,
    /// Actions since then.
    actions: Vec<u32>,
    /// Action to hold; none when the policy chooses, as it has from the start.
    held: Option<u32>,
    cost: f32,
}

/// Searches for a sequence of actions that completes `route` from `start`. With a `policy`, its own actions are among the candidates as
/// long as they lead anywhere.
pub fn search(world: &Arc<World>, route: u32, start: &Start, pass: Pass, policy: Option<&Policy>) -> Result<Outcome, Error> {
    let mut simulator = Simulator::new(world.clone(), 1, 0, RouteChoice::Fixed(vec![route]))?;
    simulator.reset_from(&[*start])?;
    let mut stretches: Vec<Stretch> = Vec::new();
    let straight = nearest_to_straight(world);
    let mut beam = vec![Candidate { before: NOTHING, actions: Vec::new(), held: policy.is_none().then_some(straight), cost: 0.0 }];
    let mut outcome = Outcome { ended: Ended::Running, progress: 0.0, steps: 0, env_steps: 0, actions: Vec::new() };
    while !beam.is_empty() {
        let (rows, mut children) = branched(world, simulator.batch(), &beam, straight, pass.hold);
        simulator.gather(&rows)?;
        for _ in 0..pass.hold {
            let actions = chosen(policy, simulator.batch(), &children, straight);
            outcome.env_steps += simulator.batch().truck.iter().filter(|truck| truck.held == 0).count() as u64;
            simulator.step(&actions)?;
            for (env, child) in children.iter_mut().enumerate() {
                child.actions.push(actions[env]);
                child.cost = MEMORY * child.cost + cost(world, simulator.batch(), env);
            }
            if let Some(child) = arrived(simulator.batch(), &children) {
                outcome.actions = traced(&stretches, child);
                (outcome.ended, outcome.progress, outcome.steps) = (Ended::Arrived, 1.0, outcome.actions.len() as u32);
                return Ok(outcome);
            }
        }
        note_furthest(world, simulator.batch(), &mut outcome);
        let survivors = selected(simulator.batch(), &children, pass.width);
        if survivors.is_empty() {
            break;
        }
        simulator.gather(&survivors)?;
        beam.clear();
        for &row in &survivors {
            let child = children[row as usize].clone();
            let before = stretches.len() as u32;
            stretches.push(Stretch { before: child.before, actions: child.actions });
            beam.push(Candidate { before, actions: Vec::new(), ..child });
        }
    }
    Ok(outcome)
}

/// The action that steers least.
fn nearest_to_straight(world: &World) -> u32 {
    let steering = |action: u32| world.actions[action as usize].steering.abs();
    (0..world.params.n_actions).min_by(|&a, &b| steering(a).total_cmp(&steering(b))).unwrap_or(0)
}

/// Every way to go on from each candidate: the row that it branches from, and the child.
fn branched(world: &World, batch: &Batch, beam: &[Candidate], straight: u32, hold: usize) -> (Vec<u32>, Vec<Candidate>) {
    let (mut rows, mut children) = (Vec::new(), Vec::new());
    for (row, candidate) in beam.iter().enumerate() {
        if candidate.held.is_none() {
            rows.push(row as u32);
            children.push(candidate.clone());
        }
        for action in distinct(world, batch.truck[row].steering, candidate.held.unwrap_or(straight), hold) {
            rows.push(row as u32);
            children.push(Candidate { held: Some(action), ..candidate.clone() });
        }
    }
    (rows, children)
}

/// The actions that lead to different places within `hold` steps: the steer angle changes at a limited rate, so all that ask for more than
/// can be reached are the same. The `last` action stands for those like it, so that a sequence changes seldom.
fn distinct(world: &World, steering: f32, last: u32, hold: usize) -> Vec<u32> {
    let params = &world.params;
    let reach = params.rig.steer_rate * (hold as u32 * params.n_substeps) as f32 * params.substep;
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

/// Each child's action for the coming step: the one it holds, or what the policy makes of what it sees.
fn chosen(policy: Option<&Policy>, batch: &Batch, children: &[Candidate], straight: u32) -> Vec<u32> {
    let own = |env: usize| policy.and_then(|policy| policy.act(&batch.observation[env..=env]).first().copied());
    children.iter().enumerate().map(|(env, child)| child.held.or_else(|| own(env)).unwrap_or(straight)).collect()
}

/// What the step just made of one candidate costs.
fn cost(world: &World, batch: &Batch, env: usize) -> f32 {
    let (truck, clearance, progress) = (&batch.truck[env], &batch.clearance[env], &batch.progress[env]);
    let previews = world.route_previews(truck.route);
    let lane_heading = previews[(progress.waypoint as usize + AHEAD).min(previews.len() - 1)].heading;
    let lack = (1.0 - clearance.tractor.min(clearance.trailer) / MARGIN).max(0.0);
    let load = truck.tractor_load_transfer_ratio.abs().max(truck.trailer_load_transfer_ratio.abs()) / world.params.rollover_ratio;
    lack.powi(2)
        + LANE_WEIGHT * progress.lane_distance.powi(2)
        + HEADING_WEIGHT * wrapped(truck.heading - lane_heading).powi(2)
        + LOAD_TRANSFER_WEIGHT * load.powi(4)
}

/// The best of those that have just arrived.
fn arrived<'a>(batch: &Batch, children: &'a [Candidate]) -> Option<&'a Candidate> {
    let there = children.iter().zip(&batch.ended).filter(|&(_, &ended)| ended == Ended::Arrived as u32);
    there.map(|(child, _)| child).min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// All actions that led to `candidate`, from the start on.
fn traced(stretches: &[Stretch], candidate: &Candidate) -> Vec<u32> {
    let mut parts = vec![&candidate.actions];
    let mut before = candidate.before;
    while let Some(stretch) = stretches.get(before as usize) {
        parts.push(&stretch.actions);
        before = stretch.before;
    }
    parts.into_iter().rev().flatten().copied().collect()
}

/// Remembers how the candidate ended that got furthest, as long as none got further.
fn note_furthest(world: &World, batch: &Batch, outcome: &mut Outcome) {
    for ((truck, progress), &ended) in batch.truck.iter().zip(&batch.progress).zip(&batch.ended) {
        let share = f64::from(progress.waypoint) / f64::from(world.routes[truck.route as usize].n_waypoints);
        if (outcome.progress, outcome.steps) <= (share, truck.steps) {
            (outcome.progress, outcome.steps) = (share, truck.steps);
            outcome.ended = Ended::from_code(ended).unwrap_or(Ended::Running);
        }
    }
}

/// The rows to go on with: the policy's own while it runs, then the cheapest, of nearly equal states only the best.
fn selected(batch: &Batch, children: &[Candidate], width: usize) -> Vec<u32> {
    let mut running: Vec<u32> = (0..children.len() as u32).filter(|&row| batch.truck[row as usize].held == 0).collect();
    let rank = |row: u32| (children[row as usize].held.is_some(), children[row as usize].cost);
    running.sort_by(|&a, &b| rank(a).0.cmp(&rank(b).0).then(rank(a).1.total_cmp(&rank(b).1)));
    let mut taken = HashSet::new();
    running.retain(|&row| taken.len() < width && taken.insert(bin(&batch.truck[row as usize])));
    running
}

/// Nearly equal states have the same bin.
fn bin(truck: &Truck) -> [i32; 5] {
    let articulation = wrapped(truck.heading - truck.trailer_heading);
    [
        truck.position.x / PLACE_BIN,
        truck.position.y / PLACE_BIN,
        truck.heading / HEADING_BIN,
        articulation / HEADING_BIN,
        truck.steering / STEER_BIN,
    ]
    .map(|value| value.round() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files;

    fn world() -> Arc<World> {
        let path = files::repository().join("scenarios/attard2023.toml");
        Arc::new(World::bake(&offtrack::scenario::Scenario::read(&path).unwrap()).unwrap())
    }

    #[test]
    fn actions_that_the_steer_rate_makes_equal_are_tried_once_and_the_last_one_stands_for_its_like() {
        let world = world();
        // 20 deg/s reach 2 deg in a step and levels lie 8 deg apart: straight on, or further to either side.
        assert_eq!(distinct(&world, 0.0, 4, 1), [4, 0, 5]);
        assert_eq!(distinct(&world, 0.0, 7, 1), [7, 0, 4]);
        // 1 deg short of a level it is reached, and so is what lies beyond it.
        assert_eq!(distinct(&world, 7.0f32.to_radians(), 8, 1), [8, 0, 5]);
        // In 40 steps every level is reached.
        assert_eq!(distinct(&world, 0.0, 4, 40).len(), 9);
    }

    #[test]
    fn a_found_sequence_is_traced_back_to_the_start() {
        let stretch = |before, action: u32| Stretch { before, actions: vec![action; 2] };
        let stretches = [stretch(NOTHING, 1), stretch(NOTHING, 2), stretch(1, 3)];
        let candidate = Candidate { before: 2, actions: vec![4], held: None, cost: 0.0 };
        assert_eq!(traced(&stretches, &candidate), [2, 2, 3, 3, 4]);
    }

    #[test]
    fn a_beam_keeps_no_more_than_its_width_and_nobody_twice_in_one_state() {
        let world = world();
        let mut simulator = Simulator::new(world, 6, 0, RouteChoice::Fixed(vec![0, 0, 0, 20, 20, 40])).unwrap();
        simulator.reset_from(&[Start::default(); 6]).unwrap();
        let child = |held, cost| Candidate { before: NOTHING, actions: Vec::new(), held, cost };
        let children =
            [child(Some(4), 0.3), child(Some(4), 0.1), child(None, 9.0), child(Some(4), 0.5), child(Some(4), 0.4), child(Some(4), 0.2)];
        // The policy's own first, whatever it costs; then the cheapest of each state.
        assert_eq!(selected(simulator.batch(), &children, 64), [2, 5, 4]);
        assert_eq!(selected(simulator.batch(), &children, 2), [2, 5]);
    }

    #[test]
    fn a_search_that_cannot_succeed_says_how_far_it_got() {
        let world = world();
        let route = world.route_names.iter().position(|name| name == "20m/N-left-4").unwrap() as u32;
        // One candidate at each depth sees the kerb too late.
        let outcome = search(&world, route, &Start::default(), Pass { width: 1, hold: 1 }, None).unwrap();
        assert!(outcome.ended.failed() && outcome.actions.is_empty(), "{outcome:?}");
        assert!(0.1 < outcome.progress && outcome.progress < 1.0 && 0 < outcome.steps && 0 < outcome.env_steps, "{outcome:?}");
    }
}
