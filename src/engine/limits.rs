//! What the numbers of a truck can be at most, so that whatever is computed from them is finite: for states and poses
//! that come from outside.

use std::fmt::Debug;
use std::ops::RangeInclusive;

use super::Error;
use crate::layout::Command;

/// Largest magnitude of a rate, an acceleration and the like, where nothing narrower is known: stages compute with it
/// safely, and no truck comes near it.
pub(crate) const MOST: f32 = 1e6;
/// Largest magnitude of a speed (m/s): a target is at most 100.
pub(crate) const FASTEST: f32 = 1e3;
/// Largest distance of a truck in each direction from where its route is (m). It has strayed long before.
pub(crate) const FAR: f32 = 1e4;
/// Largest steer angle that an action may ask for (rad): locks are at most 1.5.
pub(crate) const STEEPEST: f32 = 1.6;

/// An error for a command outside -1..=1. NaN lies in no range.
pub(crate) fn check_command(env: usize, command: &Command) -> Result<(), Error> {
    let values = [("steering", command.steering), ("speed", command.speed)];
    let outside = values.into_iter().find(|(_, value)| !(-1.0..=1.0).contains(value));
    outside.map_or(Ok(()), |(field, value)| Err(Error::UnknownCommand { env, field, value: value.to_string() }))
}

/// An error, which names the value's place, unless the value lies in its range. NaN lies in none.
pub(crate) fn within<T: PartialOrd + Debug>(
    place: impl FnOnce() -> String,
    value: T,
    range: RangeInclusive<T>,
) -> Result<(), Error> {
    if range.contains(&value) {
        return Ok(());
    }
    let expected = format!("{:?}..{:?}", range.start(), range.end());
    Err(Error::ImpossibleValue { place: place(), found: format!("{value:?}"), expected })
}
