//! Poses and telemetry from outside, checked: every number is one that a truck can have.

use std::f64::consts::TAU;

use super::{Pose, State, Telemetry};
use crate::engine::Error;
use crate::engine::limits::{FAR, FASTEST, MOST, STEEPEST, within};
use crate::layout::angle::{PI, wrapped};
use crate::map::Frame;

/// Largest heading (rad): a sum of turns beyond it is no longer exact.
const MOST_TURNED: f64 = 1e6;

/// An error for the first number that no pose can have.
pub(super) fn pose(frame: &Frame, pose: &Pose) -> Result<(), Error> {
    let Pose { position, heading, trailer_heading, speed } = *pose;
    let far = f64::from(FAR);
    for (place, value, centre) in
        [("position[0]", position.x, frame.origin.x), ("position[1]", position.y, frame.origin.y)]
    {
        within(|| place.to_owned(), value, centre - far..=centre + far)?;
    }
    for (place, value) in [("heading", heading), ("trailer_heading", trailer_heading)] {
        within(|| place.to_owned(), value, -MOST_TURNED..=MOST_TURNED)?;
    }
    within(|| "speed".to_owned(), speed, -FASTEST..=FASTEST)
}

/// An error for the first number that no truck's electronics can say.
pub(super) fn telemetry(telemetry: &Telemetry) -> Result<(), Error> {
    let Telemetry {
        steering,
        target_speed,
        acceleration,
        lateral_acceleration,
        trailer_roll,
        trailer_roll_rate,
        load_transfer_ratios,
    } = *telemetry;
    for (place, value, most) in [
        ("steering", steering, STEEPEST),
        ("target_speed", target_speed, FASTEST),
        ("acceleration", acceleration, MOST),
        ("lateral_acceleration", lateral_acceleration, MOST),
        ("trailer_roll", trailer_roll, MOST),
        ("trailer_roll_rate", trailer_roll_rate, MOST),
        ("load_transfer_ratios[0]", load_transfer_ratios[0], MOST),
        ("load_transfer_ratios[1]", load_transfer_ratios[1], MOST),
    ] {
        within(|| place.to_owned(), value, -most..=most)?;
    }
    Ok(())
}

/// An error for a state that no observer of a route with so many waypoints has.
pub(super) fn state(state: &State, n_waypoints: u32) -> Result<(), Error> {
    state.waypoint.map_or(Ok(()), |next| waypoint(next, n_waypoints))?;
    within(|| "speed_error_integral".to_owned(), state.speed_error_integral, -MOST..=MOST)
}

/// An error for a waypoint that a route with so many does not have; after the last all are passed.
pub(super) fn waypoint(found: u32, n_waypoints: u32) -> Result<(), Error> {
    if found <= n_waypoints {
        return Ok(());
    }
    let limit = format!("{n_waypoints} waypoints on its route");
    Err(Error::OutsideWorld { column: "waypoint", env: 0, found, limit })
}

/// An error for a speed or a target that no truck can have.
pub(super) fn speeds(speed: f32, target: f32) -> Result<(), Error> {
    within(|| "speed".to_owned(), speed, -FASTEST..=FASTEST)?;
    self::target(target)
}

/// An error for a target speed that no truck can have.
pub(super) fn target(target: f32) -> Result<(), Error> {
    within(|| "target".to_owned(), target, -FASTEST..=FASTEST)
}

/// A heading in (-pi, pi], as a truck's is. One that lies there is kept to the last bit.
pub(super) fn heading(heading: f64) -> f32 {
    let near = heading as f32;
    if near.abs() <= PI { wrapped(near) } else { wrapped((heading - TAU * (heading / TAU).round()) as f32) }
}
