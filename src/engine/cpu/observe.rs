//! Writes the observation after the action: 69 values, see [`OBSERVATION`](crate::layout::OBSERVATION).
//!
//! Values that depend on the next waypoint alone are looked up in a table that [`crate::world`] bakes.

use glam::Vec2;

use crate::engine::Row;
use crate::engine::cpu::follow::{distance_to_segment, reference_point};
use crate::engine::cpu::{around, perceive};
use crate::layout::angle::{PI, arc_tangent, wrapped};
use crate::layout::shared::constants;
use crate::layout::{Control, N_EXTRAS, N_RAYS, N_VALUES, Progress, Truck, first_of};
use crate::world::World;

constants! {
    /// Speed that is observed as 1 (m/s).
    pub const SPEED_SCALE: f32 = 27.8;
    /// Distance to a waypoint or its crossing line that is observed as 1 (m).
    pub const WAYPOINT_SCALE: f32 = 20.0;
    /// Distance to the lane centre that is observed as 1 (m).
    pub const LANE_SCALE: f32 = 10.0;
    /// Number of waypoints that angles are taken to.
    pub const N_LOOK_AHEAD: usize = 5;
    /// Waypoints beyond the next one that angles are taken to.
    pub const LOOK_AHEAD: [usize; N_LOOK_AHEAD] = [0, 2, 5, 7, 10];
    /// Index of the distances to the next two waypoints.
    const DISTANCES_AT: usize = first_of("waypoint_distance");
    /// Index of the distances to their crossing lines.
    const CROSSINGS_AT: usize = first_of("crossing_distance");
    /// Index of the distance to the lane centre.
    const LANE_AT: usize = first_of("lane_distance");
    /// Index of the angles at the waypoint behind, from those ahead to the truck.
    const BEARINGS_AT: usize = first_of("bearing");
    /// Index of the tractor's headings relative to the lane's ahead.
    const HEADINGS_AT: usize = first_of("heading");
    /// Index of the trailer's.
    const TRAILER_HEADINGS_AT: usize = first_of("trailer_heading");
    /// Index of the articulation.
    const ARTICULATION_AT: usize = first_of("articulation");
    /// Index of the curvatures of the route.
    const CURVATURES_AT: usize = first_of("future_curvature");
    /// Number of curvatures.
    const N_CURVATURES: usize = 8;
    /// Index of the ranges.
    const RANGES_AT: usize = first_of("trailer_range");
    /// Index of the radii ahead.
    const RADII_AT: usize = first_of("radius");
    /// Acceleration that is observed as 1 (m/s^2).
    const ACCELERATION_SCALE: f32 = 2.5;
    /// Lateral acceleration that is observed as 1 (m/s^2).
    const G: f32 = 9.81;
    /// Wheelbase that is observed as 1 (m).
    const WHEELBASE_SCALE: f32 = 10.0;
    /// Roll that is observed as 1 (rad).
    const ROLL_SCALE: f32 = 0.15;
    /// Roll rate that is observed as 1 (rad/s).
    const ROLL_RATE_SCALE: f32 = 0.3;
    /// Mass that is observed as 1 (kg).
    const MASS_SCALE: f32 = 40000.0;
}

/// Writes the row's next observation.
pub fn observe(world: &World, row: &mut Row) {
    *row.next_observation = observation_of(world, row);
    if 0 < world.params.n_extras {
        *row.next_extras = extras(world, row.truck, row.control);
    }
    if let Some(seen) = around::around(world, row) {
        row.next_around.iter_mut().for_each(|next| **next = seen);
    }
}

/// The observation of the row's truck.
pub(super) fn observation_of(world: &World, row: &Row) -> [f32; N_VALUES] {
    if world.disturbances.of_observation == 0 {
        return observed(world, row.truck, row.progress, row.ranges);
    }
    let (truck, progress) = perceive::seen(world, row);
    observed(world, &truck, &progress, row.ranges)
}

/// The 69 values.
pub fn observed(world: &World, truck: &Truck, progress: &Progress, ranges: &[f32; N_RAYS]) -> [f32; N_VALUES] {
    let route = &world.routes[truck.route as usize];
    let (waypoints, previews) = (world.route_waypoints(truck.route), world.route_previews(truck.route));
    let last = waypoints.len() - 1;
    let next = (progress.waypoint as usize).min(last);
    let point = reference_point(world.rig(truck).wheelbase, truck);
    let mut values = [0.0; N_VALUES];
    values[0] = (truck.speed / SPEED_SCALE).clamp(0.0, 1.0);
    for n in 0..2 {
        let waypoint = &waypoints[(next + n).min(last)];
        let normal = waypoint.direction.perp();
        let (left, right) =
            (waypoint.position + route.crossing_left * normal, waypoint.position - route.crossing_right * normal);
        values[DISTANCES_AT + n] = (point.distance(waypoint.position) / WAYPOINT_SCALE).min(1.0);
        values[CROSSINGS_AT + n] = (distance_to_segment(point, left, right) / WAYPOINT_SCALE).min(1.0);
    }
    values[LANE_AT] = (progress.lane_distance / LANE_SCALE).min(1.0);
    let behind = waypoints[next.max(1) - 1].position;
    for (n, ahead) in LOOK_AHEAD.into_iter().enumerate() {
        let index = (next + ahead).min(last);
        let heading = previews[index].heading;
        values[BEARINGS_AT + n] = angle_between(waypoints[index].position - behind, point - behind) / PI;
        values[HEADINGS_AT + n] = wrapped(truck.heading - heading) / PI;
        values[TRAILER_HEADINGS_AT + n] = wrapped(truck.trailer_heading - heading) / PI;
    }
    values[ARTICULATION_AT] = wrapped(truck.heading - truck.trailer_heading) / PI;
    let preview = &previews[next].values;
    values[CURVATURES_AT..RANGES_AT].copy_from_slice(&preview[..N_CURVATURES]);
    for (value, range) in values[RANGES_AT..RADII_AT].iter_mut().zip(ranges) {
        *value = range / world.params.sensor_range;
    }
    values[RADII_AT..].copy_from_slice(&preview[N_CURVATURES..]);
    values
}

/// The values beside the observation, as [`EXTRAS`](crate::layout::EXTRAS) defines them: those that the benchmark
/// observes, zeros in place of the others.
pub fn extras(world: &World, truck: &Truck, control: &Control) -> [f32; N_EXTRAS] {
    let rig = world.rig(truck);
    let values = [
        truck.steering / rig.steer_max,
        control.target_speed / SPEED_SCALE,
        truck.acceleration / ACCELERATION_SCALE,
        truck.lateral_acceleration / G,
        rig.trailer_wheelbase / WHEELBASE_SCALE,
        truck.trailer_roll / ROLL_SCALE,
        truck.trailer_roll_rate / ROLL_RATE_SCALE,
        rig.trailer_mass / MASS_SCALE,
        rig.rollover_threshold,
        rig.lateral_acceleration_max / G,
        truck.tractor_load_transfer_ratio,
        truck.trailer_load_transfer_ratio,
    ];
    let mut observed = [0.0; N_EXTRAS];
    for (n, value) in values.into_iter().enumerate().take(world.params.n_extras as usize) {
        observed[n] = value.clamp(-1.0, 1.0);
    }
    observed
}

/// Signed angle from `from` to `to`, left positive (rad).
#[inline]
fn angle_between(from: Vec2, to: Vec2) -> f32 {
    arc_tangent(from.perp_dot(to), from.dot(to))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::{N_TRAILER_RAYS, OBSERVATION};

    #[test]
    fn the_documented_scales_and_numbers_of_values_are_those_that_are_written() {
        assert_eq!(CURVATURES_AT + N_CURVATURES / 2, first_of("current_curvature"));
        assert_eq!(RANGES_AT + N_TRAILER_RAYS, first_of("tractor_range"));
        let doc = |name: &str| {
            OBSERVATION.iter().find(|values| values.name == name).map(|values| values.doc).unwrap_or_default()
        };
        for (name, scale) in
            [("speed", SPEED_SCALE), ("waypoint_distance", WAYPOINT_SCALE), ("lane_distance", LANE_SCALE)]
        {
            assert!(doc(name).contains(&format!("/ {scale} m")), "{name}: {}", doc(name));
        }
        assert!(
            ["bearing", "heading", "trailer_heading"]
                .iter()
                .all(|name| { OBSERVATION.iter().any(|values| values.name == *name && values.n == N_LOOK_AHEAD) })
        );
    }
}
