//! Whom cars are driven by: the drivers that the model was fitted to, and three other kinds.
//!
//! No shipped policy was trained among those: whether one has learned to drive among vehicles, or among these vehicles
//! alone, shows there.

use serde::Deserialize;

use super::Rules;
use super::units::{length, probability, time};

/// Parts of a speed limit that [`Drivers::pace`] counts.
pub(super) const PACE_PARTS: i32 = 100;

/// Who drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Drivers {
    /// The fitted ones.
    #[default]
    Fitted,
    /// They follow closely, drive faster, and take gaps that others leave, as the aggressive drivers of J. Laval and
    /// L. Leclercq, "A mechanism to describe the formation and propagation of stop-and-go waves in congested freeway
    /// traffic", Philosophical Transactions of the Royal Society A 368, 2010.
    Aggressive,
    /// They keep their distance, drive slower, wait for long gaps and let others in: the timid ones of the same.
    Timid,
    /// They look away at times, for 2 s: the longest that the guidelines of the NHTSA on driver distraction (2013)
    /// allow for a glance. Meanwhile they hold their braking or their speed, until what looms ahead has them look up
    /// (G. Markkula and others, "A farewell to brake reaction times?", Accident Analysis & Prevention 95, 2016). They
    /// make up for it by some more distance and a little less speed.
    Distracted,
}

impl Drivers {
    /// The numbers that they drive by.
    pub const fn rules(self) -> Rules {
        let rules = match self {
            Drivers::Fitted => return Rules::FITTED,
            Drivers::Aggressive => Rules {
                headway: time(0.7),
                gap: length(1.2),
                lags: [time(0.9), time(0.8)],
                soft_lags: [time(1.5), time(0.7)],
                ..Rules::FITTED
            },
            Drivers::Timid => Rules {
                headway: time(1.7),
                gap: length(2.5),
                lags: [time(2.2), time(2.0)],
                soft_lags: [time(3.2), time(2.0)],
                ..Rules::FITTED
            },
            Drivers::Distracted => Rules {
                headway: time(1.4),
                gap: length(2.0),
                lags: [time(1.4), time(1.3)],
                soft_lags: [time(2.4), time(1.2)],
                lapses: probability(0.15),
                ..Rules::FITTED
            },
        };
        Rules { courtesy: probability(self.courtesy()), ..rules }
    }

    /// Probability with which one in the ring lets in another that waits, where that takes gentle braking.
    pub const fn courtesy(self) -> f64 {
        match self {
            Drivers::Fitted => 0.3,
            Drivers::Aggressive => 0.05,
            Drivers::Timid => 0.6,
            Drivers::Distracted => 0.2,
        }
    }

    /// Speed on a free road, in parts of the limit.
    pub(super) const fn pace(self) -> i32 {
        match self {
            Drivers::Fitted => PACE_PARTS,
            Drivers::Aggressive => 110,
            Drivers::Timid => 85,
            Drivers::Distracted => 95,
        }
    }
}
