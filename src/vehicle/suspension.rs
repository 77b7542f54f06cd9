//! Roll of a unit in a turn, and when its wheels lift: one degree of freedom, a mass above a roll centre on springs and
//! dampers.
//!
//! The quasi-static part follows T. Gillespie, "Fundamentals of Vehicle Dynamics" (1992), chapter 9.

use crate::layout::Roll;
use crate::vehicle::GRAVITY;

/// Parameters of a unit's roll.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Suspension {
    /// Height of the centre of gravity (m).
    pub centre_of_gravity: f64,
    /// Height of the roll centre (m).
    pub roll_centre: f64,
    /// Distance between the wheels of an axle (m).
    pub track: f64,
    /// Roll angle per lateral acceleration in units of gravity (rad).
    pub roll_gain: f64,
    /// Undamped natural frequency of the roll (Hz).
    pub roll_frequency: f64,
    /// Damping ratio of the roll, below 1.
    pub roll_damping: f64,
}

impl Suspension {
    /// Constant lateral acceleration at which the inner wheels lift, in units of gravity.
    pub fn rollover_threshold(&self) -> f64 {
        let lever = self.centre_of_gravity - self.roll_centre;
        0.5 * self.track / (self.centre_of_gravity + self.roll_gain * lever)
    }

    /// Load transfer ratio under a constant lateral acceleration (m/s^2).
    pub fn quasi_static_load_transfer_ratio(&self, lateral_acceleration: f64) -> f64 {
        lateral_acceleration / GRAVITY / self.rollover_threshold()
    }

    /// The exact discretisation of the roll for sub-steps of `substep` seconds, with constant lateral acceleration in
    /// each.
    pub fn roll(&self, substep: f64) -> Roll {
        let Suspension { centre_of_gravity, roll_centre, track, roll_gain, roll_frequency, roll_damping } = *self;
        let natural = std::f64::consts::TAU * roll_frequency;
        let damped = natural * (1.0 - roll_damping * roll_damping).sqrt();
        let decay = (-roll_damping * natural * substep).exp();
        let (sin, cos) = (damped * substep).sin_cos();
        let lag = roll_damping * natural / damped;
        let transition = [
            decay * (cos + lag * sin),
            decay * sin / damped,
            -decay * natural * natural / damped * sin,
            decay * (cos - lag * sin),
        ];
        // Under constant acceleration the state converges to rest at a roll of `settled` per m/s^2.
        let settled = roll_gain / GRAVITY;
        let input = [(1.0 - transition[0]) * settled, -transition[2] * settled];
        let lever = centre_of_gravity - roll_centre;
        Roll {
            transition: transition.map(|value| value as f32),
            input: input.map(|value| value as f32),
            per_acceleration: (2.0 * roll_centre / (track * GRAVITY)) as f32,
            per_roll: (2.0 * lever * (1.0 + 1.0 / roll_gain) / track) as f32,
            per_roll_rate: (4.0 * roll_damping * lever / (roll_gain * natural * track)) as f32,
        }
    }
}
