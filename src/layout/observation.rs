//! The values of an observation, in their order.

use super::{N_TRACTOR_RAYS, N_TRAILER_RAYS, N_VALUES};

/// Neighbouring values of an observation that measure the same thing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Values {
    /// Name of the group.
    pub name: &'static str,
    /// Index of the group's first value.
    pub first: usize,
    /// Number of the group's values.
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
pub const OBSERVATION: [Values; 13] = numbered::<13, N_VALUES>([
    values("speed", 1, "speed of the drive axle / 27.8 m/s, limited to 0..1"),
    values(
        "waypoint_distance",
        2,
        "distance of the middle of the tractor's wheelbase from the next and the following waypoint / 20 m, at most 1; \
         the last one of a route repeats",
    ),
    values("crossing_distance", 2, "distance to the crossing lines of these waypoints / 20 m, at most 1"),
    values("lane_distance", 1, "distance to the lane's centre line / 10 m, at most 1"),
    angles(
        "bearing",
        5,
        "angle at the waypoint behind, from the next one, and the 2nd, 5th, 7th and 10th after it, to the middle of \
         the tractor's wheelbase / pi",
    ),
    angles("heading", 5, "tractor's heading less the lane's at the waypoints ahead of the bearings / pi"),
    angles("trailer_heading", 5, "trailer's heading less the lane's at the waypoints ahead of the bearings / pi"),
    angles("articulation", 1, "tractor's heading less the trailer's / pi"),
    values(
        "future_curvature",
        4,
        "interior angle of the route ahead / pi, chords of 5, 7, 10, 12 waypoints; 1 is straight",
    ),
    values("current_curvature", 4, "interior angle at the next waypoint / pi, the same chords"),
    values(
        "trailer_range",
        N_TRAILER_RAYS,
        "trailer's distance sensors, left and right alternating, front to rear / sensor range",
    ),
    values(
        "tractor_range",
        N_TRACTOR_RAYS,
        "tractor's distance sensors, from left 90 deg to right 90 deg / sensor range",
    ),
    values("radius", 10, "radius of the route over two chords of 5 waypoints, 0 to 9 chords ahead / 100 m, at most 1"),
]);

pub(super) const fn values(name: &'static str, n: usize, doc: &'static str) -> Values {
    Values { name, first: 0, n, low: 0.0, mirror: 1.0, doc }
}

pub(super) const fn angles(name: &'static str, n: usize, doc: &'static str) -> Values {
    Values { low: -1.0, mirror: -1.0, ..values(name, n, doc) }
}

/// The groups with the index of each one's first value, which follow each other and are `IN_ALL`.
pub(super) const fn numbered<const N: usize, const IN_ALL: usize>(mut groups: [Values; N]) -> [Values; N] {
    let (mut group, mut next) = (0, 0);
    while group < N {
        groups[group].first = next;
        next += groups[group].n;
        group += 1;
    }
    assert!(next == IN_ALL);
    groups
}

/// Index of the first value of the group with this name.
pub(crate) const fn first_of(name: &str) -> usize {
    first_among(&OBSERVATION, name)
}

/// Index of the first value of the group with this name among these.
pub(super) const fn first_among(groups: &[Values], name: &str) -> usize {
    let mut group = 0;
    while !is_same(groups[group].name, name) {
        group += 1;
    }
    groups[group].first
}

const fn is_same(one: &str, other: &str) -> bool {
    let (one, other) = (one.as_bytes(), other.as_bytes());
    let mut index = 0;
    while index < one.len() && index < other.len() && one[index] == other[index] {
        index += 1;
    }
    index == one.len() && index == other.len()
}
