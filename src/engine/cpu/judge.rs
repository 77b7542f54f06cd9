//! Judges the step: whether and why the episode ended, and the reward.
//!
//! Failure wins over a vehicle that drove into the truck, that over arrival, everything over the time limit.

use glam::Vec2;

use crate::engine::Row;
use crate::engine::cpu::traffic::hindrance;
use crate::field::Purpose;
use crate::layout::angle::{direction, wrapped};
use crate::layout::{Clearance, Ended, Params, Progress, Reward, RewardTerms, RouteRow, Truck};
use crate::traffic::{self, Contact};
use crate::world::World;

/// Advances the truck's number of steps and writes the end code, the reward's terms and the reward: their weighted sum
/// and, among other vehicles, what the truck's hindrance of them weighs, and what its trailer's way over an apron does.
pub fn judge(world: &World, row: &mut Row) {
    row.truck.steps += 1;
    let route = &world.routes[row.truck.route as usize];
    let step_limit = world.step_limit(row.truck);
    let met = row.cars.as_deref().and_then(|words| Contact::from_code(traffic::Row::of(words).met));
    let ended = ending(&world.params, route, step_limit, row.truck, row.clearance, row.progress, met);
    *row.ended = ended as u32;
    *row.terms = reward_terms(&world.reward, row.clearance, row.progress, ended);
    *row.reward = rewarded(&world.reward, row.terms);
    if let Some(hindrance) = hindrance(world, row) {
        *row.reward += hindrance;
    }
    if world.reward.apron != 0.0 {
        *row.reward += world.reward.apron * depth_on_apron(world, row.truck);
    }
}

/// How far the trailer is on an apron (m): the wheel that is furthest, of those at both ends of its axle group.
pub fn depth_on_apron(world: &World, truck: &Truck) -> f32 {
    if !world.has_apron(truck.route) {
        return 0.0;
    }
    let rig = world.rig(truck);
    let (middle, heading) = (truck.trailer_position(rig), direction(truck.trailer_heading));
    let across = rig.trailer_body.half_width * Vec2::new(-heading.y, heading.x);
    let [left, right] = [middle + across, middle - across];
    let [tractor, trailer] = world
        .unit_fields(truck.route)
        .map(|field| field.sample(Purpose::Exact, &[left.x, right.x], &[left.y, right.y]).distance);
    // What the tractor keeps to ends where an apron begins; what both keep to is none.
    let on = |wheel: usize| trailer[wheel].min(0.0) - tractor[wheel];
    on(0).max(on(1)).max(0.0)
}

/// Why the episode ended, [`Ended::Running`] when it did not.
pub fn ending(
    params: &Params,
    route: &RouteRow,
    step_limit: u32,
    truck: &Truck,
    clearance: &Clearance,
    progress: &Progress,
    met: Option<Contact>,
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
    } else if met.is_some_and(|contact| contact.is_trucks_fault) {
        Ended::MetVehicle
    } else if !arrived && params.stray_distance < progress.waypoint_distance {
        Ended::Strayed
    } else if met.is_some() {
        Ended::WasMet
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

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    /// How a step ends in which the truck touched a vehicle, if it did, and so far from kerbs, with this articulation
    /// (m, rad), having strayed or arrived or neither.
    fn ended(met: Option<bool>, clearance: f32, articulation: f32, [strayed, arrived]: [bool; 2]) -> Ended {
        let params = Params { jackknife_angle: 1.0, stray_distance: 10.0, rollover_ratio: 1.0, ..Params::zeroed() };
        let route = RouteRow { n_waypoints: 50, ..RouteRow::zeroed() };
        let truck = Truck { heading: articulation, steps: 700, ..Truck::default() };
        let clearance = Clearance { tractor: 1.0, trailer: clearance };
        let waypoint_distance = if strayed { 11.0 } else { 1.0 };
        let progress = Progress { waypoint: if arrived { 50 } else { 7 }, waypoint_distance, ..Progress::zeroed() };
        let met = met.map(|is_trucks_fault| Contact { slot: 3, is_trucks_fault });
        ending(&params, &route, 600, &truck, &clearance, &progress, met)
    }

    #[test]
    fn of_ends_in_one_step_failure_wins_over_being_met_that_over_arrival_and_the_time_limit_is_last() {
        let [truck, car] = [Some(true), Some(false)];
        for met in [truck, car] {
            assert_eq!(ended(met, -0.1, 0.0, [false, true]), Ended::TrailerCollided);
            assert_eq!(ended(met, 1.0, 1.1, [false, true]), Ended::Jackknifed);
        }
        assert_eq!(ended(truck, 1.0, 0.0, [true, false]), Ended::MetVehicle);
        assert_eq!(ended(truck, 1.0, 0.0, [false, true]), Ended::MetVehicle);
        assert_eq!(ended(car, 1.0, 0.0, [true, false]), Ended::Strayed);
        assert_eq!(ended(car, 1.0, 0.0, [false, true]), Ended::WasMet);
        assert_eq!(ended(car, 1.0, 0.0, [false, false]), Ended::WasMet);
        assert_eq!(ended(None, 1.0, 0.0, [false, false]), Ended::TimedOut);
    }
}
