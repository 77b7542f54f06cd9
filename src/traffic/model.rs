//! The intelligent driver model in integers, and what else decisions compute of distances and speeds.
//!
//! Units are those of [`super::units`]. An interaction is the square of the wished gap over the gap, in units of 2^-16:
//! squares are compared wherever the model compares ratios, so that no root is needed. Every product fits in 32 bits
//! for speeds in 0..[`FASTEST`], distances below [`BEYOND`](super::units::BEYOND) and headways below 3.5 s; the tests
//! try the ends.

use super::Car;
use super::units::{length, speed};
use crate::layout::shared::constants;

constants! {
    /// No car and no truck that one minds is faster (2^-14 m a step).
    pub(super) const FASTEST: i32 = speed(Car::FASTEST);
    /// An interaction of 1.
    pub(super) const ONE: i32 = 1 << 16;
    /// Bits of a ratio of gaps below 1.
    const RATIO_BITS: u32 = 14;
    /// Interactions are below 16: the hardest braking needs 5.
    const MOST_RATIO: u32 = (4 << RATIO_BITS) - 1;
    /// 1 / (2 sqrt(a b)) = 0.2236 s²/m of an acceleration of 2 m/s² and a braking of 2.5 m/s²: for products of speeds
    /// in units of 2^-18 m² a step².
    const PER_PRODUCT: i32 = 1431;
    /// The same for squares of speeds in m²/s² (2^-10).
    const PER_SQUARE: i32 = 229;
    /// The smallest gap that counts (2^-10 m).
    const LEAST_GAP: i32 = length(0.1);
    /// A car that stands is this far before what it stops at (2^-10 m).
    const STANDS_BEFORE: i32 = length(0.2);
    /// The least distance to a line (2^-10 m).
    const LEAST_DISTANCE: i32 = length(0.05);
    /// The least distance to half of [`STANDS_BEFORE`] before it (2^-10 m).
    const LEAST_LEFT: i32 = length(0.03);
    /// A car brakes comfortably where its squared speed is at most so many times the distance: 2 x 2.5 m/s² (m/s²).
    const TWICE_BRAKING: i32 = 5;
    /// What moves can still stop before a line at 4 m/s²: within an eighth of its squared speed, three bits.
    const STOPS_WITHIN: u32 = 3;
    /// Braking at most towards a lower speed limit, in units of an interaction: 1.5 x 2 m/s².
    const SLOWING: i32 = ONE + ONE / 2;
    /// Ratio of a speed to the wished one, in units of 2^-15, beyond which a car slows as hard as it does for a limit.
    const MOST_PART: u32 = 3 << 14;
    /// Hardest braking in units of the largest acceleration: 8 m/s² of 2 m/s².
    const HARDEST: i32 = 4 * ONE;
    /// The hardest braking in the units of a state (2^-19 m a step²).
    const HARDEST_OF_STATE: i32 = 41_943;
}

/// The square of a speed (2^-10 m²/s²): what comes of comparing it with a distance in metres is in m/s².
pub(super) fn square(speed: i32) -> i32 {
    (((speed * speed) >> 8) * 25) >> 8
}

/// Time to drive a distance of at least 0 at a speed above 0 (1/256 step).
pub(super) fn time(distance: i32, speed: i32) -> i32 {
    (((distance as u32) << 12) / speed as u32) as i32
}

/// Way in a time of one second at a speed (2^-10 m).
pub(super) fn way_of_a_second(speed: i32) -> i32 {
    (10 * speed) >> 4
}

/// Whether what has a squared speed can still stop before a line: what cannot any more has entered (2^-10 m, 2^-10
/// m²/s²).
pub(super) fn still_stops(station: i32, square: i32, line: i32) -> bool {
    station + (square >> STOPS_WITHIN) <= line
}

/// Interaction with something ahead, that a car with a headway and a wished gap at rest follows (1/256 step, 2^-10 m).
pub(super) fn following(gap: i32, own: i32, other: i32, headway: i32, at_rest: i32) -> i32 {
    let approaching = (((own * (own - other)) >> 10) * PER_PRODUCT) >> 14;
    let wished = at_rest + (((own * headway) >> 12) + approaching).max(0);
    interaction(wished, gap.max(LEAST_GAP))
}

/// Interaction that stops a car with a squared speed before a line, never later than kinematics needs.
pub(super) fn stopping(distance: i32, square: i32) -> i32 {
    let wished = interaction(STANDS_BEFORE + ((square * PER_SQUARE) >> 10), distance.max(LEAST_DISTANCE));
    let left = (distance - STANDS_BEFORE / 2).max(LEAST_LEFT);
    if TWICE_BRAKING * left < square { wished.max(braking(square, left)) } else { wished }
}

/// Interaction with which a car with a squared speed comes to rest after a distance: 1 + v² / (2 x 2 m/s² x distance).
fn braking(square: i32, distance: i32) -> i32 {
    ONE + (((square as u32) << 14) / distance as u32) as i32
}

/// Interaction of a car that brakes at least so hard, at most at 12.5 m/s² (1/256 m/s²).
pub(super) fn braking_of(deceleration: i32) -> i32 {
    ONE + 128 * deceleration
}

fn interaction(wished: i32, gap: i32) -> i32 {
    let ratio = (((wished as u32) << RATIO_BITS) / gap as u32).min(MOST_RATIO);
    ((ratio * ratio) >> (2 * RATIO_BITS - 16)) as i32
}

/// The acceleration of a car with a speed, a wished speed and an interaction, in the units of a state (2^-19 m a
/// step²).
pub(super) fn acceleration(speed: i32, wished: i32, interaction: i32) -> i32 {
    let part = (((speed as u32) << 15) / wished as u32).min(MOST_PART);
    let squared = (part * part) >> 16;
    let free = (ONE - ((squared * squared) >> 12) as i32).max(-SLOWING);
    // 4/25 of a unit of an interaction is 2 m/s² in units of the state; to the nearest.
    (4 * (free - interaction).clamp(-HARDEST, ONE) + 4 * HARDEST + 12) / 25 - HARDEST_OF_STATE
}

#[cfg(test)]
mod tests {
    use super::super::units::{BEYOND, metres, metres_per_second, time as ticks};
    use super::*;

    /// Speeds from standing to the fastest, and distances from far behind to farther than any road is long.
    const SPEEDS: [i32; 7] = [0, 1, speed(0.1), speed(4.0), speed(8.33), speed(11.0), FASTEST];
    const DISTANCES: [i32; 9] =
        [-BEYOND, -1, 0, length(0.1), length(0.3), length(4.0), length(30.0), length(120.0), BEYOND - 1];

    fn m(length: i32) -> f64 {
        metres(length).into()
    }

    fn m_per_s(speed: i32) -> f64 {
        metres_per_second(speed).into()
    }

    fn real(interaction: i32) -> f64 {
        f64::from(interaction) / f64::from(ONE)
    }

    /// A product that did not fit would be off by far more.
    fn assert_near(found: f64, expected: f64, resolution: f64, what: &str) {
        let within = 0.01 * expected.abs() + resolution;
        assert!((found - expected).abs() <= within, "{what}: {found}, in real numbers {expected}");
    }

    #[test]
    fn squares_and_times_are_those_of_real_numbers_at_the_ends_of_their_ranges() {
        for v in SPEEDS {
            assert_near(f64::from(square(v)) / 1024.0, m_per_s(v).powi(2), 2.0 / 1024.0, "a square");
            assert_near(m(way_of_a_second(v)), m_per_s(v), 1.0 / 1024.0, "a way");
            for d in DISTANCES.into_iter().filter(|&d| 0 <= d && speed(1.0) <= v) {
                assert_near(f64::from(time(d, v)) / 2560.0, m(d) / m_per_s(v), 1.0 / 2560.0, "a time");
            }
        }
    }

    #[test]
    fn interactions_are_those_of_real_numbers_at_the_ends_of_their_ranges() {
        let capped = |ratio: f64| ratio.min(4.0).powi(2);
        let per = 0.5 / (2.0f64 * 2.5).sqrt();
        for (v, gap) in SPEEDS.into_iter().flat_map(|v| DISTANCES.map(|gap| (v, gap))) {
            let (own, left) = (m_per_s(v), m(gap));
            for (other, seconds) in SPEEDS.into_iter().flat_map(|other| [0.9, 1.1, 3.5].map(|t| (other, t))) {
                let found = following(gap, v, other, ticks(seconds), length(1.5));
                let wished = (own * f64::from(seconds) + own * (own - m_per_s(other)) * per).max(0.0) + 1.5;
                let name = format!("following at {own} m/s, {left} m behind {} m/s", m_per_s(other));
                assert_near(real(found), capped(wished / left.max(m(LEAST_GAP))), 2e-5, &name);
            }
            let wished = capped((m(STANDS_BEFORE) + own * own * per) / left.max(m(LEAST_DISTANCE)));
            let needed = 0.5 * own * own / (left - 0.1).max(m(LEAST_LEFT));
            let expected = if 2.5 < needed { wished.max(1.0 + needed / 2.0) } else { wished };
            assert_near(real(stopping(gap, square(v))), expected, 2e-5, &format!("stopping at {own} m/s in {left} m"));
        }
    }

    #[test]
    fn accelerations_are_those_of_real_numbers_at_the_ends_of_their_ranges() {
        let highest = stopping(0, square(FASTEST));
        for interaction in [0, 1, ONE / 2, ONE, 9 * ONE, highest] {
            for (v, wished) in SPEEDS.into_iter().flat_map(|v| [speed(0.45), speed(5.0), speed(11.0)].map(|w| (v, w))) {
                let found = f64::from(acceleration(v, wished, interaction)) / (f64::from(1 << 19) * 0.01);
                let free = (1.0 - (m_per_s(v) / m_per_s(wished)).powi(4)).max(-1.5);
                let expected = (2.0 * (free - real(interaction))).clamp(-8.0, 2.0);
                assert_near(found, expected, 5e-4, &format!("{} m/s, interaction {}", m_per_s(v), real(interaction)));
            }
        }
        for deceleration in [0.0, 3.0, 8.0] {
            let found = acceleration(0, speed(5.0), braking_of((256.0 * deceleration) as i32));
            assert_near(f64::from(found) / (f64::from(1 << 19) * 0.01), -deceleration, 5e-4, "a braking");
        }
    }
}
