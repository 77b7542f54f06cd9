//! Numbers for one attempt at a road: each is a function of (seed, road, attempt, place, quantity) alone, so a new
//! quantity shifts no other.

use crate::layout::random;

/// What is drawn. A quantity keeps its number for ever: roads are the same as long as it does.
#[repr(u32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    IslandRadius = 0,
    LaneWidth = 1,
    Gutter = 2,
    Arms = 3,
    FirstBearing = 4,
    CornerShare = 5,
    RingLanes = 6,
    RingLaneWidth = 7,
    Apron = 8,
    Gap = 16,
    Length = 17,
    IsBeside = 18,
    Beside = 19,
    HasMedian = 20,
    Median = 21,
    IsWidened = 22,
    Widening = 23,
    WideningLength = 24,
    HasSBend = 25,
    Shift = 26,
    SBendLength = 27,
    HasCorner = 28,
    CornerRadius = 29,
    HasSplitter = 30,
    SplitterRadius = 31,
    ShiftSide = 32,
    IsStraight = 64,
    Angle = 65,
    Aim = 66,
    KerbArc = 67,
    BeforeRing = 68,
    BendRadius = 69,
    KerbOffset = 70,
    HasLanes = 71,
    RightOffset = 72,
    RightRadius = 73,
    LeftOffset = 74,
    LeftRadius = 75,
    WideningRadius = 76,
    IsSingle = 77,
}

/// What a number belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    Ring,
    Arm(usize),
    Entry(usize),
    Exit(usize),
}

/// Draws of roads begin here, beyond those of episodes, which use the first few numbers.
const FIRST: u32 = 1 << 16;
/// Numbers that a place may use.
const QUANTITIES: u32 = 256;

/// The numbers of one attempt.
#[derive(Debug, Clone, Copy)]
pub(super) struct Draws {
    pub(super) seed: u32,
    pub(super) road: u32,
    pub(super) attempt: u32,
}

impl Draws {
    fn words(&self, place: Place, quantity: Quantity) -> [u32; 4] {
        let place = match place {
            Place::Ring => 0,
            Place::Arm(arm) => 1 + 3 * arm as u32,
            Place::Entry(arm) => 2 + 3 * arm as u32,
            Place::Exit(arm) => 3 + 3 * arm as u32,
        };
        random::words(self.seed, self.road, self.attempt, FIRST + QUANTITIES * place + quantity as u32)
    }

    /// Uniform in [0, 1).
    pub(super) fn unit(&self, place: Place, quantity: Quantity) -> f64 {
        part(self.words(place, quantity)[0])
    }

    /// Whether something happens that does so in this share of all cases.
    pub(super) fn happens(&self, place: Place, quantity: Quantity, share: f64) -> bool {
        self.unit(place, quantity) < share
    }

    /// Uniform.
    pub(super) fn within(&self, place: Place, quantity: Quantity, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * self.unit(place, quantity)
    }

    /// Log-uniform: a factor of two is equally likely everywhere.
    pub(super) fn log_within(&self, place: Place, quantity: Quantity, [low, high]: [f64; 2]) -> f64 {
        low * (high / low).powf(self.unit(place, quantity))
    }

    /// About normal with mean 0 and standard deviation 1: the sum of four uniform numbers, at most 3.5.
    pub(super) fn normal(&self, place: Place, quantity: Quantity) -> f64 {
        (self.words(place, quantity).map(part).into_iter().sum::<f64>() - 2.0) * 3f64.sqrt()
    }

    /// An index with a probability in proportion to its weight.
    pub(super) fn index(&self, place: Place, quantity: Quantity, weights: &[f64]) -> usize {
        let mut left = self.unit(place, quantity) * weights.iter().sum::<f64>();
        for (index, weight) in weights.iter().enumerate() {
            if left < *weight {
                return index;
            }
            left -= weight;
        }
        weights.iter().rposition(|&weight| 0.0 < weight).unwrap_or(0)
    }
}

fn part(word: u32) -> f64 {
    f64::from(word) / 4_294_967_296.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(draw: impl Fn(Draws) -> f64) -> Vec<f64> {
        (0..4000).map(|road| draw(Draws { seed: 7, road, attempt: 0 })).collect()
    }

    #[test]
    fn a_normal_number_has_mean_0_and_deviation_1_and_stays_below_3_5() {
        let drawn = numbers(|draws| draws.normal(Place::Arm(2), Quantity::Beside));
        let mean = drawn.iter().sum::<f64>() / 4000.0;
        let deviation = (drawn.iter().map(|value| value * value).sum::<f64>() / 4000.0).sqrt();
        // The mean of 4,000 has a deviation of 0.016, their deviation one of 0.01.
        assert!(mean.abs() < 0.07 && (deviation - 1.0).abs() < 0.05, "{mean} {deviation}");
        assert!(drawn.iter().all(|value| value.abs() < 3.5));
    }

    #[test]
    fn log_uniform_numbers_fill_their_range_with_equal_factors() {
        let drawn = numbers(|draws| draws.log_within(Place::Ring, Quantity::IslandRadius, [2.0, 8.0]));
        let below = drawn.iter().filter(|&&value| value < 4.0).count();
        assert!(drawn.iter().all(|&value| (2.0..8.0).contains(&value)) && below.abs_diff(2000) < 150, "{below}");
    }

    #[test]
    fn an_index_follows_its_weights_and_one_of_weight_0_is_never_drawn() {
        let drawn = numbers(|draws| draws.index(Place::Ring, Quantity::Arms, &[0.0, 3.0, 1.0, 0.0]) as f64);
        let first = drawn.iter().filter(|&&index| index == 1.0).count();
        assert!(drawn.iter().all(|&index| index == 1.0 || index == 2.0) && first.abs_diff(3000) < 150, "{first}");
    }

    #[test]
    fn neighbouring_places_and_quantities_are_unrelated() {
        let one = numbers(|draws| draws.unit(Place::Entry(0), Quantity::Angle));
        for (place, quantity) in
            [(Place::Exit(0), Quantity::Angle), (Place::Entry(0), Quantity::Aim), (Place::Entry(1), Quantity::Angle)]
        {
            let other = numbers(|draws| draws.unit(place, quantity));
            let product: f64 = one.iter().zip(&other).map(|(a, b)| (a - 0.5) * (b - 0.5)).sum::<f64>() / 4000.0;
            // A product of two has a deviation of 1/12, its mean over 4,000 one of 0.0013.
            assert!(product.abs() < 0.006, "{product}");
        }
    }
}
