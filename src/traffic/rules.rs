//! The numbers of the driver model.
//!
//! Cars follow each other by the intelligent driver model (M. Treiber, A. Hennecke, D. Helbing, "Congested traffic
//! states in empirical observations and microscopic simulations", Physical Review E 62, 2000). The time headway and the
//! lags of entries are fitted to the entry capacities of the Highway Capacity Manual, equations 22-1 to 22-5; the other
//! numbers were chosen once.

use super::units::{length, probability, time};
use crate::layout::shared::constants;

constants! {
    /// How far temperament changes the speed on a free road (1/150 of it for each of its 15 units).
    pub(super) const SPEED_PARTS: i32 = 150;
    /// How far it changes headway and lags (1/100 of them for each of its 15 units).
    pub(super) const TIME_PARTS: i32 = 100;
    /// Numbers of `Rules`, in words.
    const N_RULES: usize = 7;
    /// Index of the time headway among them.
    const RULE_HEADWAY: usize = 0;
    /// Index of the gap.
    const RULE_GAP: usize = 1;
    /// Index of the first lag.
    const RULE_LAGS: usize = 2;
    /// Index of the first lag before traffic that is only passed beside.
    const RULE_SOFT_LAGS: usize = 4;
    /// Index of the courtesy.
    const RULE_COURTESY: usize = 6;
}

/// What the model's fit may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rules {
    /// Time headway (1/256 step).
    pub headway: i32,
    /// Gap to a car before that stands (2^-10 m).
    pub gap: i32,
    /// Lag of an entering car before ring traffic that it joins, and before such that it crosses (1/256 step).
    pub lags: [i32; 2],
    /// Lag before ring traffic that it only passes beside, from the lane next to the kerb and from the second (1/256
    /// step).
    pub soft_lags: [i32; 2],
    /// Probability with which a ring car lets in one that waits, where it can brake gently (2^-24).
    pub courtesy: u32,
    /// Probability with which a driver looks away for 2 s (2^-24).
    pub lapses: u32,
}

impl Rules {
    /// The fitted numbers as words.
    pub(crate) fn words(&self) -> [u32; N_RULES] {
        let Rules { headway, gap, lags, soft_lags, courtesy, lapses: _ } = *self;
        let mut words = [0; N_RULES];
        words[RULE_HEADWAY] = headway.cast_unsigned();
        words[RULE_GAP] = gap.cast_unsigned();
        words[RULE_LAGS..][..2].copy_from_slice(&lags.map(i32::cast_unsigned));
        words[RULE_SOFT_LAGS..][..2].copy_from_slice(&soft_lags.map(i32::cast_unsigned));
        words[RULE_COURTESY] = courtesy;
        words
    }

    /// All numbers as words; lapses where there are any, so that worlds without them keep their fingerprint, and
    /// snapshots their place in the cache.
    pub(crate) fn all_words(&self) -> Vec<u32> {
        let lapses = Some(self.lapses).filter(|&lapses| 0 < lapses);
        self.words().into_iter().chain(lapses).collect()
    }

    /// The fitted numbers.
    pub const FITTED: Rules = Rules {
        headway: time(1.1),
        gap: length(1.5),
        lags: [time(1.2), time(1.1)],
        soft_lags: [time(2.2), time(1.0)],
        courtesy: probability(0.3),
        lapses: 0,
    };
}
