//! The values of an observation, in their order.

use super::{N_TRACTOR_RAYS, N_TRAILER_RAYS, N_VALUES};

/// Neighbouring values of an observation that measure the same thing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Values {
    /// Name of the group.
    pub name: &'static str,
    /// Index of its first value.
    pub first: usize,
    /// Number of its values.
    pub n: usize,
    /// The least that they can be: 0, of angles -1. The largest is 1.
    pub low: f32,
    /// Factor of its values in a mirror: -1 where left and right change places, as of angles. Pairs of sensors change
    /// places themselves.
    pub mirror: f32,
    /// What each value is, what it is divided by, and where it is limited.
    pub doc: &'static str,
}

/// What each of the [`N_VALUES`] values of an observation is.
///
/// Values lie in 0..=1, angles in -1..=1. "Next waypoint" is the next one to pass; beyond the end of a route its last
/// waypoint repeats. The truck's reference point is the middle of the tractor's wheelbase.
///
/// | values | name | what |
/// |---|---|---|
/// | 0 | `speed` | speed of the drive axle / 27.8 m/s, limited to 0..1 |
/// | 1-2 | `waypoint_distance` | distance to the next and the following waypoint / 20 m, at most 1 |
/// | 3-4 | `crossing_distance` | distance to the crossing lines of these waypoints / 20 m, at most 1 |
/// | 5 | `lane_distance` | distance to the lane's centre line / 10 m, at most 1 |
/// | 6-10 | `bearing` | angle at the waypoint behind, from a waypoint ahead to the truck / pi |
/// | 11-15 | `heading` | tractor's heading less the lane's at these waypoints / pi |
/// | 16-20 | `trailer_heading` | trailer's heading less the lane's at these waypoints / pi |
/// | 21 | `articulation` | tractor's heading less the trailer's / pi |
/// | 22-25 | `future_curvature` | interior angle of the route ahead / pi, chords of 5, 7, 10, 12 waypoints; straight: 1 |
/// | 26-29 | `current_curvature` | interior angle at the next waypoint / pi, the same chords |
/// | 30-45 | `trailer_range` | trailer's distance sensors, left and right alternating, front to rear / sensor range |
/// | 46-58 | `tractor_range` | tractor's distance sensors, from left 90 deg to right 90 deg / sensor range |
/// | 59-68 | `radius` | radius of the route over two chords of 5 waypoints, 0 to 9 chords ahead / 100 m, at most 1 |
///
/// Waypoints ahead are the next one and the 2nd, 5th, 7th and 10th after it.
pub const OBSERVATION: [Values; 13] = [
    values("speed", 0, 1, "speed of the drive axle / 27.8 m/s, limited to 0..1"),
    values("waypoint_distance", 1, 2, "distance to the next and the following waypoint / 20 m, at most 1"),
    values("crossing_distance", 3, 2, "distance to the crossing lines of these waypoints / 20 m, at most 1"),
    values("lane_distance", 5, 1, "distance to the lane's centre line / 10 m, at most 1"),
    angles("bearing", 6, 5, "angle at the waypoint behind, from a waypoint ahead to the truck / pi"),
    angles("heading", 11, 5, "tractor's heading less the lane's at these waypoints / pi"),
    angles("trailer_heading", 16, 5, "trailer's heading less the lane's at these waypoints / pi"),
    angles("articulation", 21, 1, "tractor's heading less the trailer's / pi"),
    values("future_curvature", 22, 4, "interior angle of the route ahead / pi, chords of 5, 7, 10, 12 waypoints; 1 is straight"),
    values("current_curvature", 26, 4, "interior angle at the next waypoint / pi, the same chords"),
    values("trailer_range", 30, N_TRAILER_RAYS, "trailer's distance sensors, left and right alternating, front to rear / sensor range"),
    values("tractor_range", 46, N_TRACTOR_RAYS, "tractor's distance sensors, from left 90 deg to right 90 deg / sensor range"),
    values("radius", 59, 10, "radius of the route over two chords of 5 waypoints, 0 to 9 chords ahead / 100 m, at most 1"),
];

const fn values(name: &'static str, first: usize, n: usize, doc: &'static str) -> Values {
    Values { name, first, n, low: 0.0, mirror: 1.0, doc }
}

const fn angles(name: &'static str, first: usize, n: usize, doc: &'static str) -> Values {
    Values { low: -1.0, mirror: -1.0, ..values(name, first, n, doc) }
}

// Every value belongs to one group.
const _: () = {
    let (mut group, mut next) = (0, 0);
    while group < OBSERVATION.len() {
        assert!(OBSERVATION[group].first == next);
        next += OBSERVATION[group].n;
        group += 1;
    }
    assert!(next == N_VALUES);
};
