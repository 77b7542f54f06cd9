//! Follows the route: which waypoints were passed, and the distance to the lane centre.
//!
//! The reference point is the middle of the tractor's wheelbase.

use glam::Vec2;

use crate::engine::Row;
use crate::engine::cpu::perceive;
use crate::layout::angle::{TINY, direction};
use crate::layout::{Progress, Truck, WaypointRow};
use crate::world::World;

/// Updates the row's progress.
pub fn follow(world: &World, row: &mut Row) {
    let waypoints = world.route_waypoints(row.truck.route);
    let point = reference_point(world.rig(row.truck).wheelbase, row.truck);
    *row.progress = followed(waypoints, point, row.progress.waypoint, world.params.stray_distance);
    if world.disturbances.of_observation == 1 {
        perceive::perceive(world, row, row.truck.steps + 1);
    }
}

/// Middle of the wheelbase (m).
#[inline]
pub fn reference_point(wheelbase: f32, truck: &Truck) -> Vec2 {
    truck.position + 0.5 * wheelbase * direction(truck.heading)
}

/// Progress of a truck at `point` that had `next` as its next waypoint.
pub fn followed(waypoints: &[WaypointRow], point: Vec2, next: u32, reach: f32) -> Progress {
    let mut waypoint = next as usize;
    while waypoint < waypoints.len() && is_passed(&waypoints[waypoint], point, reach) {
        waypoint += 1;
    }
    let ahead = waypoint.min(waypoints.len() - 1);
    Progress {
        lane_distance: distance_to_segment(point, waypoints[ahead.max(1) - 1].position, waypoints[ahead].position),
        waypoint_distance: point.distance(waypoints[ahead].position),
        waypoint: waypoint as u32,
        passed: waypoint as u32 - next,
    }
}

/// Whether the point is beyond the line through the waypoint at right angles to its heading, and within reach of it.
fn is_passed(waypoint: &WaypointRow, point: Vec2, reach: f32) -> bool {
    let offset = point - waypoint.position;
    0.0 <= offset.dot(waypoint.direction) && offset.length_squared() <= reach * reach
}

/// Distance of `point` from the segment `from`..`to` (m).
#[inline]
pub fn distance_to_segment(point: Vec2, from: Vec2, to: Vec2) -> f32 {
    let along = to - from;
    let fraction = (point - from).dot(along) / along.length_squared().max(TINY);
    point.distance(from + fraction.clamp(0.0, 1.0) * along)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight(n: usize) -> Vec<WaypointRow> {
        let row = |i| WaypointRow { position: Vec2::new(2.0 * i as f32, 0.0), direction: Vec2::X };
        (0..n).map(row).collect()
    }

    #[test]
    fn several_waypoints_may_be_passed_in_a_step() {
        let progress = followed(&straight(10), Vec2::new(6.5, 1.0), 1, 10.0);
        assert_eq!((progress.waypoint, progress.passed), (4, 3));
        assert_eq!(progress.lane_distance, 1.0);
    }

    #[test]
    fn a_waypoint_out_of_reach_is_not_passed() {
        assert_eq!(followed(&straight(10), Vec2::new(2.5, 10.5), 1, 10.0).passed, 0);
    }

    #[test]
    fn the_last_waypoint_ends_the_route() {
        let progress = followed(&straight(4), Vec2::new(6.1, 0.0), 3, 10.0);
        assert_eq!((progress.waypoint, progress.passed), (4, 1));
        assert!((progress.waypoint_distance - 0.1).abs() < 1e-6);
    }
}
