//! Writes the observation: the 69 values that a driver sees.
//!
//! What depends on the waypoint alone was worked out when the world was baked (see [`crate::world`]).

use std::f32::consts::PI;

use glam::Vec2;

use crate::angle::{atan2, wrapped};
use crate::cpu::Row;
use crate::cpu::follow::{distance_to_segment, reference_point};
use crate::layout::{N_RAYS, N_VALUES, Params, Progress, RouteRow, Truck, WaypointRow};
use crate::world::World;

/// Speed that is observed as 1 [m/s].
pub const SPEED_SCALE: f32 = 27.8;
/// Distance to a waypoint or its crossing line that is observed as 1 [m].
pub const WAYPOINT_SCALE: f32 = 20.0;
/// Distance to the lane centre that is observed as 1 [m].
pub const LANE_SCALE: f32 = 10.0;
/// Waypoints beyond the next one that angles are taken to.
pub const LOOK_AHEAD: [usize; 5] = [0, 2, 5, 7, 10];

/// Writes what the step led to.
pub fn observe(world: &World, row: &mut Row) {
    let route = &world.routes[row.truck.route as usize];
    let waypoints = world.route_waypoints(row.truck.route);
    *row.next_observation = observed(&world.params, route, waypoints, row.truck, row.progress, row.ranges);
}

/// The 69 values.
pub fn observed(
    params: &Params,
    route: &RouteRow,
    waypoints: &[WaypointRow],
    truck: &Truck,
    progress: &Progress,
    ranges: &[f32; N_RAYS],
) -> [f32; N_VALUES] {
    let last = waypoints.len() - 1;
    let next = (progress.waypoint as usize).min(last);
    let point = reference_point(params.rig.wheelbase, truck);
    let mut values = [0.0; N_VALUES];
    values[0] = (truck.speed / SPEED_SCALE).clamp(0.0, 1.0);
    for n in 0..2 {
        let waypoint = &waypoints[(next + n).min(last)];
        let normal = waypoint.direction.perp();
        let (left, right) = (waypoint.position + route.crossing_left * normal, waypoint.position - route.crossing_right * normal);
        values[1 + n] = (point.distance(waypoint.position) / WAYPOINT_SCALE).min(1.0);
        values[3 + n] = (distance_to_segment(point, left, right) / WAYPOINT_SCALE).min(1.0);
    }
    values[5] = (progress.lane_distance / LANE_SCALE).min(1.0);
    let behind = waypoints[next.max(1) - 1].position;
    for (n, ahead) in LOOK_AHEAD.into_iter().enumerate() {
        let waypoint = &waypoints[(next + ahead).min(last)];
        values[6 + n] = angle_between(waypoint.position - behind, point - behind) / PI;
        values[11 + n] = wrapped(truck.heading - waypoint.heading) / PI;
        values[16 + n] = wrapped(truck.trailer_heading - waypoint.heading) / PI;
    }
    values[21] = wrapped(truck.heading - truck.trailer_heading) / PI;
    let preview = &waypoints[next].preview;
    values[22..30].copy_from_slice(&preview[..8]);
    for (value, range) in values[30..59].iter_mut().zip(ranges) {
        *value = range / params.sensor_range;
    }
    values[59..].copy_from_slice(&preview[8..]);
    values
}

/// Signed angle from `from` to `to`, left positive [rad].
#[inline]
fn angle_between(from: Vec2, to: Vec2) -> f32 {
    atan2(from.perp_dot(to), from.dot(to))
}
