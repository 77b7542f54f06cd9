//! Sums over all steps of a batch: steps by how they ended, and rewards.
//!
//! Integers alone, so that the order of summation changes nothing on any engine.

use crate::layout::Ended;
use crate::layout::shared::constants;

constants! {
    /// Sums in a tally: steps by their end code, then the rewards.
    pub const N_SUMS: usize = Ended::ALL.len() + 1;
    /// Index of the sum of the rewards.
    pub const REWARD_SUM: usize = N_SUMS - 1;
    /// Units that a reward of 1 is counted in.
    pub const REWARD_UNITS: f32 = 256.0;
}

/// Sums over all steps of all trucks since the batch was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Steps by their end code, then the rewards, 256 units to 1.
    pub sums: [i64; N_SUMS],
}

impl Tally {
    /// Env steps taken.
    pub fn env_steps(&self) -> u64 {
        self.sums[..REWARD_SUM].iter().sum::<i64>() as u64
    }

    /// Episodes that ended for this reason; of [`Ended::Running`] the steps that ended none.
    pub fn ended(&self, ended: Ended) -> u64 {
        self.sums[ended as usize] as u64
    }

    /// Episodes that ended.
    pub fn episodes(&self) -> u64 {
        self.env_steps() - self.ended(Ended::Running)
    }

    /// Sum of all rewards, each rounded to 1/256.
    pub fn reward(&self) -> f64 {
        self.sums[REWARD_SUM] as f64 / f64::from(REWARD_UNITS)
    }

    /// The tally less an `earlier` one of the same batch.
    pub fn since(mut self, earlier: &Tally) -> Tally {
        self.sums.iter_mut().zip(earlier.sums).for_each(|(sum, earlier)| *sum -= earlier);
        self
    }

    /// Adds a step with this end code and reward.
    #[inline]
    pub(crate) fn add_step(&mut self, ended: u32, reward: f32) {
        // A remainder and no check: the code is one of so many.
        self.sums[ended as usize % Ended::ALL.len()] += 1;
        self.sums[REWARD_SUM] += (reward * REWARD_UNITS).round_ties_even() as i64;
    }

    /// The sum of both.
    #[inline]
    pub(crate) fn plus(mut self, other: Tally) -> Tally {
        self.sums.iter_mut().zip(other.sums).for_each(|(sum, other)| *sum += other);
        self
    }
}
