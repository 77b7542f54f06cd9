//! Counts what happened: steps by how they ended, and their rewards.
//!
//! Beside the stages of a step: integers alone, so that the order of counting changes nothing, whoever counts.

use crate::cpu::Row;
use crate::layout::{Ended, constants};

constants! {
    /// Sums in a tally: steps by their end code, then the rewards.
    pub const N_SUMS: usize = 9;
    /// The sum of the rewards.
    pub const REWARD_SUM: usize = 8;
    /// Parts that a reward of 1 is counted in.
    pub const REWARD_PARTS: f32 = 256.0;
}

/// Sums over all steps of all trucks since the batch was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Steps by their end code, and the rewards in parts of [`REWARD_PARTS`].
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

    /// Sum of all rewards, each rounded to a part.
    pub fn reward(&self) -> f64 {
        self.sums[REWARD_SUM] as f64 / f64::from(REWARD_PARTS)
    }

    /// What happened since the tally was `earlier`.
    pub fn since(mut self, earlier: &Tally) -> Tally {
        self.sums.iter_mut().zip(earlier.sums).for_each(|(sum, earlier)| *sum -= earlier);
        self
    }

    /// Counts the step just made of one truck.
    #[inline]
    pub(crate) fn with(mut self, row: &Row) -> Tally {
        self.sums[*row.ended as usize % REWARD_SUM] += 1;
        self.sums[REWARD_SUM] += parts(*row.reward);
        self
    }

    /// Both sums together.
    pub(crate) fn plus(mut self, other: Tally) -> Tally {
        self.sums.iter_mut().zip(other.sums).for_each(|(sum, other)| *sum += other);
        self
    }
}

/// A reward in whole parts.
#[inline]
fn parts(reward: f32) -> i64 {
    (reward * REWARD_PARTS).round_ties_even() as i64
}
