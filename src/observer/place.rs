//! Where on a route a truck is of which nothing else is known.

use glam::Vec2;

use crate::engine::cpu::follow::distance_to_segment;
use crate::layout::WaypointRow;
use crate::layout::angle::direction;

/// Index of the next waypoint of a truck whose reference point and heading these are: on the nearest segment of those
/// that lead its way, or of all where none does, since a route comes back beside itself where a truck turns round.
pub(super) fn next_waypoint(waypoints: &[WaypointRow], point: Vec2, heading: f32) -> u32 {
    let ahead = direction(heading);
    let (mut nearest, mut least) = (1, (true, f32::INFINITY));
    for (index, pair) in waypoints.windows(2).enumerate() {
        let [from, to] = [pair[0].position, pair[1].position];
        let leads_away = (to - from).dot(ahead) <= 0.0;
        let candidate = (leads_away, distance_to_segment(point, from, to));
        if candidate < least {
            (nearest, least) = (index + 1, candidate);
        }
    }
    // In a bend the lines through the waypoints, which say what was passed, do not bound what is nearest to a segment.
    while 1 < nearest && (point - waypoints[nearest - 1].position).dot(waypoints[nearest - 1].direction) < 0.0 {
        nearest -= 1;
    }
    nearest as u32
}
