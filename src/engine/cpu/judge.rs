//! Judges the step: whether and why the episode ended, and the reward.
//!
//! Failure wins over arrival, everything wins over the time limit.

use crate::engine::Row;
use crate::layout::angle::wrapped;
use crate::layout::{Clearance, Ended, Params, Progress, Reward, RewardTerms, RouteRow, Truck};
use crate::world::World;

/// Advances the truck's number of steps and writes the end code, the reward's terms and the reward.
pub fn judge(world: &World, row: &mut Row) {
    row.truck.steps += 1;
    let route = &world.routes[row.truck.route as usize];
    let step_limit = world.step_limit(row.truck);
    let ended = ending(&world.params, route, step_limit, row.truck, row.clearance, row.progress);
    *row.ended = ended as u32;
    *row.terms = reward_terms(&world.reward, row.clearance, row.progress, ended);
    *row.reward = rewarded(&world.reward, row.terms);
}

/// Why the episode ended, [`Ended::Running`] when it did not.
pub fn ending(
    params: &Params,
    route: &RouteRow,
    step_limit: u32,
    truck: &Truck,
    clearance: &Clearance,
    progress: &Progress,
) -> Ended {
    let articulation = wrapped(truck.heading - truck.trailer_heading);
    let load_transfer_ratio = truck.load_transfer_ratio();
    let arrived = route.n_waypoints <= progress.waypoint;
    if clearance.tractor <= 0.0 {
        Ended::TractorCollided
    } else if clearance.trailer <= 0.0 {
        Ended::TrailerCollided
    } else if params.rollover_ratio <= load_transfer_ratio {
        Ended::RolledOver
    } else if params.jackknife_angle < articulation.abs() {
        Ended::Jackknifed
    } else if !arrived && params.stray_distance < progress.waypoint_distance {
        Ended::Strayed
    } else if arrived {
        Ended::Arrived
    } else if step_limit < truck.steps {
        Ended::TimedOut
    } else {
        Ended::Running
    }
}

/// The physical amounts that the reward weighs.
pub fn reward_terms(weights: &Reward, clearance: &Clearance, progress: &Progress, ended: Ended) -> RewardTerms {
    RewardTerms {
        waypoints: progress.passed as f32,
        lane_distance: (progress.lane_distance / weights.lane_distance_limit).min(1.0),
        clearance: closeness(weights, clearance),
        failure: if ended.failed() { 1.0 } else { 0.0 },
    }
}

/// Depth of the nearer unit in the margin kept from kerbs, from 0 outside it to 1 at a kerb.
pub fn closeness(weights: &Reward, clearance: &Clearance) -> f32 {
    (1.0 - clearance.tractor.min(clearance.trailer) / weights.clearance_limit).clamp(0.0, 1.0)
}

/// The weighted sum.
pub fn rewarded(weights: &Reward, terms: &RewardTerms) -> f32 {
    weights.waypoint * terms.waypoints
        + weights.lane_distance * terms.lane_distance
        + weights.clearance * terms.clearance
        + weights.failure * terms.failure
}
