//! Where on a route a truck is of which nothing else is known.

use glam::Vec2;

use crate::engine::cpu::follow::distance_to_segment;
use crate::layout::WaypointRow;
use crate::layout::angle::direction;

/// Waypoints before and behind a known one, among which the next is looked for.
const AROUND: usize = 16;

/// Index of the next waypoint of a truck whose reference point and heading these are: on the nearest segment of those
/// that lead its way, or of all where none does, since a route comes back beside itself where a truck turns round. With
/// a known waypoint only what is around that is looked at.
pub(super) fn next_waypoint(waypoints: &[WaypointRow], point: Vec2, heading: f32, known: Option<u32>) -> u32 {
    let ahead = direction(heading);
    let last = waypoints.len() - 1;
    let [low, high] = known.map_or([1, last], |known| {
        let known = (known as usize).clamp(1, last);
        [known.saturating_sub(AROUND).max(1), (known + AROUND).min(last)]
    });
    let (mut nearest, mut least) = (low, (true, f32::INFINITY));
    for (index, pair) in waypoints.windows(2).enumerate().take(high).skip(low - 1) {
        let [from, to] = [pair[0].position, pair[1].position];
        let leads_away = (to - from).dot(ahead) <= 0.0;
        let candidate = (leads_away, distance_to_segment(point, from, to));
        if candidate < least {
            (nearest, least) = (index + 1, candidate);
        }
    }
    // In a bend the lines through the waypoints, which say what was passed, do not bound what is nearest to a segment.
    let is_before = |waypoint: &WaypointRow| (point - waypoint.position).dot(waypoint.direction) < 0.0;
    while low < nearest && is_before(&waypoints[nearest - 1]) {
        nearest -= 1;
    }
    nearest as u32
}
