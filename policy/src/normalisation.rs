//! Observation normalisation: every value to mean 0 and standard deviation 1.
//!
//! An observed angle of a degree is 0.006 and matters as much as a sensor that reads 1. Without normalisation a network
//! learns it far more slowly.

/// Standard deviation below which a value counts as constant: dividing by less would amplify noise.
const LEAST_DEVIATION: f64 = 0.01;
/// Where a normalised value is clipped, in standard deviations.
pub const LIMIT: f32 = 10.0;

/// Mean and factor of each value of an observation.
#[derive(Debug, Clone, PartialEq)]
pub struct Normalisation {
    /// Subtracted first, `[values]`.
    pub mean: Vec<f32>,
    /// Multiplied by then, `[values]`.
    pub factor: Vec<f32>,
}

impl Normalisation {
    /// Leaves observations of `n_values` values as they are.
    pub fn none(n_values: usize) -> Normalisation {
        Normalisation { mean: vec![0.0; n_values], factor: vec![1.0; n_values] }
    }

    /// The normalisation of these observations.
    pub fn of<const N: usize>(observations: &[[f32; N]]) -> Normalisation {
        let n = observations.len().max(1) as f64;
        let mean_of = |value: &dyn Fn(&[f32; N]) -> f64| observations.iter().map(value).sum::<f64>() / n;
        let (mean, factor) = (0..N)
            .map(|index| {
                let mean = mean_of(&|row| f64::from(row[index]));
                let variance = mean_of(&|row| (f64::from(row[index]) - mean).powi(2));
                (mean as f32, (1.0 / variance.sqrt().max(LEAST_DEVIATION)) as f32)
            })
            .unzip();
        Normalisation { mean, factor }
    }

    /// The normalised rows, one after the other, `[rows * values]`.
    pub fn apply<const N: usize>(&self, observations: &[[f32; N]]) -> Vec<f32> {
        self.apply_rows(observations.as_flattened())
    }

    /// The normalised rows of observations that lie one after the other, `[rows * values]`.
    pub fn apply_rows(&self, observations: &[f32]) -> Vec<f32> {
        let normalised = |((value, mean), factor): ((&f32, &f32), &f32)| ((value - mean) * factor).clamp(-LIMIT, LIMIT);
        let mut values = Vec::with_capacity(observations.len());
        for row in observations.chunks_exact(self.mean.len()) {
            values.extend(row.iter().zip(&self.mean).zip(&self.factor).map(normalised));
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normalised_values_have_mean_0_and_standard_deviation_1() {
        let normalisation = Normalisation::of(&[[1.0, 0.1], [3.0, 0.3], [1.0, 0.5], [3.0, 0.7]]);
        // sqrt(0.05) is the second value's deviation.
        let expected = [[-1.0, -0.3 / 0.05f32.sqrt()], [1.0, 0.3 / 0.05f32.sqrt()]];
        for (value, expected) in normalisation.apply(&[[1.0, 0.1], [3.0, 0.7]]).iter().zip(expected.as_flattened()) {
            assert!((value - expected).abs() < 1e-5, "{value} {expected}");
        }
    }

    #[test]
    fn a_constant_value_is_not_amplified_and_a_far_one_is_clipped() {
        let normalisation = Normalisation::of(&[[0.5], [0.5]]);
        assert_eq!(normalisation.apply(&[[0.5]]), [0.0]);
        assert!((normalisation.apply(&[[0.51]])[0] - 1.0).abs() < 1e-4);
        assert_eq!(normalisation.apply(&[[90.0]]), [10.0]);
    }
}
