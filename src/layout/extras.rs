//! What may be observed of a truck beside the route and the kerbs: its controls, and its load.
//!
//! A benchmark names a track, which observes the first so many of them.

use super::{N_EXTRAS, ObservationLayout};

/// A value that is observed beside the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extra {
    /// The extra's name.
    pub name: &'static str,
    /// The extra's factor in a mirror: -1 where left and right change places.
    pub mirror: f32,
    /// What the extra is, what it is divided by, and where it is limited.
    pub doc: &'static str,
}

/// Each of the [`N_EXTRAS`] values. They are limited to -1..=1.
pub const EXTRAS: [Extra; N_EXTRAS] = [
    signed("steering", "steer angle / lock, left positive"),
    plain("target_speed", "target speed / 27.8 m/s"),
    plain("acceleration", "acceleration along the heading / 2.5 m/s^2"),
    signed("lateral_acceleration", "lateral acceleration of the trailer / 9.81 m/s^2, to the left positive"),
    plain("trailer_wheelbase", "wheelbase of the trailer / 10 m"),
    signed("trailer_roll", "roll of the trailer / 0.15 rad, to the right positive"),
    signed("trailer_roll_rate", "roll rate of the trailer / 0.3 rad/s"),
    plain("trailer_mass", "mass of the trailer with its load / 40 t"),
    plain("rollover_threshold", "constant lateral acceleration at which the trailer's inner wheels lift / 9.81 m/s^2"),
    plain("friction", "lateral acceleration that the tyres hold / 9.81 m/s^2"),
    signed("tractor_load_transfer_ratio", "load transfer ratio of the tractor, the largest of the step"),
    signed("trailer_load_transfer_ratio", "load transfer ratio of the trailer, the largest of the step"),
];

/// Which extras a benchmark observes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ObservedExtras {
    /// None.
    #[default]
    None,
    /// The truck's controls and dimensions: neither mass nor roll.
    Blind,
    /// What a truck's electronics know: mass and roll too, not the height of the load.
    Mass,
    /// Everything that decides whether it rolls over.
    Oracle,
}

impl ObservedExtras {
    /// Number of extras: the first ones.
    pub const fn n_extras(self) -> usize {
        match self {
            ObservedExtras::None => 0,
            ObservedExtras::Blind => 5,
            ObservedExtras::Mass => 8,
            ObservedExtras::Oracle => N_EXTRAS,
        }
    }

    /// Names of the extras.
    pub fn names(self) -> Vec<&'static str> {
        ObservationLayout { n_extras: self.n_extras(), has_vehicles: false }.extra_names()
    }
}

const fn plain(name: &'static str, doc: &'static str) -> Extra {
    Extra { name, mirror: 1.0, doc }
}

const fn signed(name: &'static str, doc: &'static str) -> Extra {
    Extra { name, mirror: -1.0, doc }
}
