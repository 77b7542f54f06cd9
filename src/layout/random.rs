//! Random numbers as a pure function of (seed, env, episode, draw): no generator state, the same bits on every engine.
//!
//! The mixer is pcg4d of M. Jarzynski and M. Olano, "Hash Functions for GPU Rendering" (JCGT 9(3), 2020): u32
//! arithmetic alone.

use crate::layout::shared::constants;

constants! {
    /// Factor of the linear congruential step that each counter goes through first.
    const FACTOR: u32 = 1_664_525;
    /// Addend of that step.
    const ADDEND: u32 = 1_013_904_223;
    /// Lowest bits of a word that an f32 cannot hold.
    const SPARE_BITS: u32 = 8;
    /// Unit of the bits above them.
    const UNIT: f32 = 1.0 / 8_388_608.0;
    /// Lowest bits of a word that the sum of four such words has no room for in an f32.
    const SPARE_BITS_OF_FOUR: u32 = 10;
    /// Unit of the sum of the bits above them: four uniform numbers of 0..1 add up to 4.
    const UNIT_OF_FOUR: f32 = 1.0 / 4_194_304.0;
    /// Standard deviations in a unit of that sum.
    const DEVIATIONS: f32 = 1.732_050_8;
    /// `Draw::Route`.
    const DRAW_ROUTE: u32 = Draw::Route as u32;
    /// `Draw::Pose`.
    const DRAW_POSE: u32 = Draw::Pose as u32;
    /// `Draw::Vehicle`.
    const DRAW_VEHICLE: u32 = Draw::Vehicle as u32;
    /// `Draw::Delays`.
    const DRAW_DELAYS: u32 = Draw::Delays as u32;
    /// `Draw::Offsets`.
    const DRAW_OFFSETS: u32 = Draw::Offsets as u32;
    /// `Draw::Noise`.
    const DRAW_NOISE: u32 = Draw::Noise as u32;
    /// `Draw::Traffic`.
    const DRAW_TRAFFIC: u32 = Draw::Traffic as u32;
    /// `Draw::Action`.
    const DRAW_ACTION: u32 = Draw::Action as u32;
}

/// What a number is drawn for: each has its own stream. Outside a batch a learner's generators and a table of vehicles
/// begin from words of the same function, whose seeds and counters a batch may have too: as published runs drew them.
#[repr(u32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Draw {
    /// The route of an episode.
    Route,
    /// The pose at the start of an episode: lateral offset and heading.
    Pose,
    /// A random action; the step is added to it, so that numbers above it are free only at the other end. Cars draw
    /// from 2^31 on.
    Action,
    /// The vehicle of an episode, and the speed that it begins at.
    Vehicle = u32::MAX,
    /// The delays of an episode, and the error of its position.
    Delays = u32::MAX - 1,
    /// The other constant errors of an episode.
    Offsets = u32::MAX - 2,
    /// The key of an episode's noise, whose numbers are drawn from it by step and kind.
    Noise = u32::MAX - 3,
    /// The traffic that an episode begins in: how many vehicles come, which snapshot, and how many are rude.
    Traffic = u32::MAX - 4,
}

/// Four random words.
pub fn words(seed: u32, env: u32, episode: u32, draw: u32) -> [u32; 4] {
    let [mut x, mut y, mut z, mut w] =
        [seed, env, episode, draw].map(|word| word.wrapping_mul(FACTOR).wrapping_add(ADDEND));
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    [x, y, z, w] = [x, y, z, w].map(|word| word ^ (word >> 16));
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    [x, y, z, w]
}

/// A word as a number in [-1, 1): its upper 24 bits, exact in f32.
pub fn signed_unit(word: u32) -> f32 {
    (word >> SPARE_BITS) as f32 * UNIT - 1.0
}

/// Four words as a normal number of mean 0 and standard deviation 1: the sum of four uniform ones, at most 3.5 in
/// magnitude. The sum is exact in f32.
pub fn normal(words: [u32; 4]) -> f32 {
    let [a, b, c, d] = words.map(|word| word >> SPARE_BITS_OF_FOUR);
    ((a + b + c + d) as f32 * UNIT_OF_FOUR - 2.0) * DEVIATIONS
}

/// A word as an index below `n`, uniform to within 2^-32.
pub fn index_below(word: u32, n: u32) -> u32 {
    ((u64::from(word) * u64::from(n)) >> 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_counters_give_unrelated_numbers_without_bias() {
        let mut sums = [0.0f64; 4];
        let mut products = 0.0f64;
        let n = 40_000;
        for env in 0..200 {
            for episode in 0..200 {
                let here = words(7, env, episode, 0).map(signed_unit);
                let there = words(7, env + 1, episode, 0).map(signed_unit);
                for (sum, value) in sums.iter_mut().zip(here) {
                    *sum += f64::from(value);
                }
                products += f64::from(here[0] * there[0]);
            }
        }
        // The mean of n uniform numbers in [-1, 1) has a deviation of 1/sqrt(3 n), a product's of 1/(3 sqrt(n)): five
        // of each.
        let limit = 5.0 / (3.0 * n as f64).sqrt();
        assert!(sums.iter().all(|sum| (sum / n as f64).abs() < limit), "{sums:?}");
        assert!((products / n as f64).abs() < 5.0 / (3.0 * (n as f64).sqrt()), "{products}");
    }

    #[test]
    fn a_normal_number_has_mean_0_and_deviation_1_and_is_never_beyond_3_5() {
        let n = 100_000;
        let values: Vec<f64> = (0..n).map(|env| f64::from(normal(words(11, env, 3, 5)))).collect();
        let mean = values.iter().sum::<f64>() / f64::from(n);
        let variance = values.iter().map(|value| value * value).sum::<f64>() / f64::from(n);
        // Five deviations of either estimate.
        assert!(mean.abs() < 5.0 / f64::from(n).sqrt() && (variance - 1.0).abs() < 0.02, "{mean}, {variance}");
        assert!(values.iter().all(|value| value.abs() < 3.5));
        assert_eq!((normal([0; 4]), normal([u32::MAX; 4]) <= 3.47), (-2.0 * DEVIATIONS, true));
    }

    #[test]
    fn an_index_covers_its_range_and_stays_below_it() {
        assert_eq!(index_below(0, 52), 0);
        assert_eq!(index_below(u32::MAX, 52), 51);
        assert_eq!(index_below(u32::MAX, 1), 0);
    }

    #[test]
    fn a_unit_number_is_exact_at_its_ends() {
        assert_eq!(signed_unit(0), -1.0);
        assert!(signed_unit(u32::MAX) < 1.0);
    }
}
