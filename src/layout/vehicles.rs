//! What may be observed of other vehicles, behind the observation and its extras.

use super::observation::{first_among, numbered, values};
use super::{N_AROUND, N_NEAREST, Values};

/// What each of the [`N_AROUND`] values is; indices count from the first of them.
///
/// Values lie in 0..=1, those with a sign in -1..=1. The first eight are about the own entry: what comes on the lanes
/// of the ring that the truck will take or pass beside. The next four are about its own path and its sides; then come
/// the vehicles nearest to either unit, nearest first, those of equal distance by their slots. Disturbances do not
/// touch them.
pub const VEHICLE_VALUES: [Values; 14] = numbered::<14, N_AROUND>([
    values(
        "entry_arrival",
        2,
        "time until the next vehicle is at the own entry, on the nearest lane and on those beyond / 10 s, at most 1",
    ),
    values("entry_distance", 2, "distance of these vehicles from the entry / 50 m, at most 1; 1 where none comes"),
    values("entry_gone", 2, "time until these vehicles have left the entry / 10 s, at most 1; 1 where none comes"),
    values("line_distance", 1, "distance of the front from the line before the ring / 50 m, limited to 0..1"),
    values("has_entered", 1, "whether the front is beyond the line, 0 or 1"),
    values("gap", 1, "distance of the front from the next vehicle on the own path / 50 m, at most 1"),
    with_sign("gap_speed", 1, 1.0, "speed of that vehicle along the path / 15 m/s, 1 where there is none"),
    values("tractor_room", 1, "distance of the tractor from the nearest vehicle / 20 m, at most 1"),
    values("trailer_room", 1, "distance of the trailer from the nearest vehicle / 20 m, at most 1"),
    values(
        "vehicle",
        N_NEAREST,
        "whether there is one within 60 m of a unit, nearest first, 0 or 1; else 0 in the next",
    ),
    with_sign("vehicle_ahead", N_NEAREST, 1.0, "its middle ahead of the drive axle, along the tractor / 60 m"),
    with_sign("vehicle_left", N_NEAREST, -1.0, "its middle to the left of the drive axle / 60 m"),
    with_sign("vehicle_speed_ahead", N_NEAREST, 1.0, "its speed over ground along the tractor / 15 m/s"),
    with_sign("vehicle_speed_left", N_NEAREST, -1.0, "its speed over ground to the left / 15 m/s"),
]);

const fn with_sign(name: &'static str, n: usize, mirror: f32, doc: &'static str) -> Values {
    Values { low: -1.0, mirror, ..values(name, n, doc) }
}

/// Index of the first value of the group with this name.
pub(crate) const fn first_of_vehicles(name: &str) -> usize {
    first_among(&VEHICLE_VALUES, name)
}
