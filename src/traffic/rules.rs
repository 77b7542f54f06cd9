//! The numbers of the driver model.
//!
//! Cars follow each other by the intelligent driver model (M. Treiber, A. Hennecke, D. Helbing, "Congested traffic
//! states in empirical observations and microscopic simulations", Physical Review E 62, 2000). The time headway and the
//! lags of entries are fitted to the entry capacities of the Highway Capacity Manual, equations 22-1 to 22-5; the other
//! numbers were chosen once.

/// Largest acceleration (m/s²).
pub(super) const ACCELERATION: f32 = 2.0;
/// Comfortable braking (m/s²).
pub(super) const BRAKING: f32 = 2.5;
/// 1 / (2 sqrt([`ACCELERATION`] [`BRAKING`])) (s²/m).
pub(super) const PER_SPEEDS: f32 = 0.223_606_8;
/// Hardest braking (m/s²).
pub(super) const HARDEST: f32 = 8.0;
/// Braking at most towards a lower speed limit, in units of [`ACCELERATION`].
pub(super) const SLOWING: f32 = 1.5;
/// How far temperament changes the speed on a free road.
pub(super) const SPEED_SPREAD: f32 = 0.1;
/// How far it changes headway and lags.
pub(super) const HEADWAY_SPREAD: f32 = 0.15;

/// What the model's fit may change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// Time headway (s).
    pub headway: f32,
    /// Gap to a car before that stands (m).
    pub gap: f32,
    /// Lag of an entering car before ring traffic that it joins, and before such that it crosses (s).
    pub lags: [f32; 2],
    /// Lag before ring traffic that it only passes beside, from the lane next to the kerb and from the second (s).
    pub soft_lags: [f32; 2],
    /// Probability with which a ring car lets in one that waits, where it can brake gently.
    pub courtesy: f32,
}

impl Rules {
    /// The numbers as words, to tell other ones from them.
    pub(crate) fn words(&self) -> Vec<u32> {
        let Rules { headway, gap, lags, soft_lags, courtesy } = *self;
        [headway, gap, lags[0], lags[1], soft_lags[0], soft_lags[1], courtesy].map(f32::to_bits).to_vec()
    }

    /// The fitted numbers.
    pub const FITTED: Rules = Rules { headway: 1.1, gap: 1.5, lags: [1.2, 1.1], soft_lags: [2.2, 1.0], courtesy: 0.3 };
}
