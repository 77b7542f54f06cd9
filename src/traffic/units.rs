//! The units of cars: integers of 32 bits, of which every engine finds the same to the last bit. On a device a quotient
//! or a root of floats is not rounded exactly, and a product and a sum may become one operation.
//!
//! A car's state is in 2^-20 m and steps, in which its motion is exact. Decisions read it in coarser units, so that
//! products fit in 32 bits: lengths in 2^-10 m, speeds in 2^-14 m a step, times in 1/256 step. Shifts to the right
//! round down, and nothing negative is divided.

use super::STEP;
use crate::layout::shared::constants;

constants! {
    /// Bits of a state's station below one of decisions.
    pub(super) const FINER_STATION: u32 = 10;
    /// The same of a speed.
    pub(super) const FINER_SPEED: u32 = 5;
    /// Units of lengths in a metre.
    const METRE: f32 = 1024.0;
    /// Units of speeds in a m/s.
    const PACE: f32 = STEP * METRE_A_STEP;
    /// Larger than every length of a road (2^-10 m).
    pub const BEYOND: i32 = 1 << 20;
}

/// Units of speeds in a metre a step.
const METRE_A_STEP: f32 = 16_384.0;
/// Units of times in a step.
const TICKS: f32 = 256.0;
/// Units of probabilities in 1: the upper 24 bits of a random word are compared with them.
const CERTAIN: f64 = 16_777_216.0;

/// A length in units of decisions (m to 2^-10 m).
pub const fn length(metres: f32) -> i32 {
    nearest(metres * METRE)
}

/// A speed in units of decisions (m/s to 2^-14 m a step).
pub const fn speed(metres_per_second: f32) -> i32 {
    nearest(metres_per_second * PACE)
}

/// A time in units of decisions (s to 1/256 step).
pub const fn time(seconds: f32) -> i32 {
    nearest(seconds * (TICKS / STEP))
}

/// A probability in units of 2^-24.
pub const fn probability(p: f64) -> u32 {
    (p * CERTAIN + 0.5) as u32
}

/// A length of decisions in metres.
pub const fn metres(length: i32) -> f32 {
    length as f32 / METRE
}

/// A speed of decisions in m/s.
pub const fn metres_per_second(speed: i32) -> f32 {
    speed as f32 / PACE
}

/// The nearest integer; conversions from floats saturate.
const fn nearest(value: f32) -> i32 {
    value.round_ties_even() as i32
}

/// Whether a random word falls below a probability in units of 2^-24.
pub(super) fn falls_below(word: u32, probability: u32) -> bool {
    word >> 8 < probability
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_speeds_and_times_are_the_nearest_integers_and_read_back() {
        assert_eq!([length(1.5), length(-0.3), length(0.1)], [1536, -307, 102]);
        assert_eq!([speed(10.0), speed(4.0), speed(0.5)], [16_384, 6554, 819]);
        assert_eq!([time(1.1), time(0.5)], [2816, 1280]);
        assert_eq!([metres(1536), metres_per_second(16_384)], [1.5, 10.0]);
    }

    #[test]
    fn what_is_certain_always_falls_and_what_is_impossible_never() {
        let [never, half, always] = [0.0, 0.5, 1.0].map(probability);
        for word in [0, 1 << 31, u32::MAX] {
            assert_eq!([never, always].map(|p| falls_below(word, p)), [false, true]);
        }
        assert_eq!([(1 << 31) - 1, 1 << 31].map(|word| falls_below(word, half)), [true, false]);
    }
}
