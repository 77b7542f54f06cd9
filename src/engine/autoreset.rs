//! What follows the end of an episode. The names are Gymnasium's.

use crate::layout::shared::constants;

constants! {
    /// `Autoreset::SameStep`.
    const SAME_STEP: u32 = Autoreset::SameStep as u32;
    /// `Autoreset::NextStep`.
    const NEXT_STEP: u32 = Autoreset::NextStep as u32;
    /// `Autoreset::Disabled`.
    const DISABLED: u32 = Autoreset::Disabled as u32;
}

/// What follows the end of an episode.
#[repr(u32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Autoreset {
    /// The next episode begins in the same step: `observation` is its first, `next_observation` the last one's last.
    SameStep,
    /// The truck is held; its next step ignores the action, begins the next episode and has a reward of 0. That step is
    /// no env step: the tally does not count it.
    NextStep,
    /// The truck is held until the caller begins an episode.
    Disabled,
}
