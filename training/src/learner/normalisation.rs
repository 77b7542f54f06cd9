//! Observations as networks like them: every value shifted and stretched to mean 0 and deviation 1.
//!
//! An observed angle of a degree is 0.006 and matters as much as a sensor that reads 1: a network learns the first far more slowly.

/// Deviation below which a value counts as constant: stretching it further would amplify noise.
const LEAST_DEVIATION: f64 = 0.01;
/// Where a scaled value is cut off, in deviations.
pub const LIMIT: f32 = 10.0;

/// A shift and a factor for each value of an observation.
#[derive(Debug, Clone, PartialEq)]
pub struct Scaling {
    /// Subtracted first, `[values]`.
    pub mean: Vec<f32>,
    /// Multiplied by then, `[values]`.
    pub factor: Vec<f32>,
}

impl Scaling {
    /// Leaves observations of `n_values` values as they are.
    pub fn none(n_values: usize) -> Scaling {
        Scaling { mean: vec![0.0; n_values], factor: vec![1.0; n_values] }
    }

    /// What brings these observations to mean 0 and deviation 1.
    pub fn of<const N: usize>(observations: &[[f32; N]]) -> Scaling {
        let n = observations.len().max(1) as f64;
        let mean_of = |value: &dyn Fn(&[f32; N]) -> f64| observations.iter().map(value).sum::<f64>() / n;
        let (mean, factor) = (0..N)
            .map(|index| {
                let mean = mean_of(&|row| f64::from(row[index]));
                let variance = mean_of(&|row| (f64::from(row[index]) - mean).powi(2));
                (mean as f32, (1.0 / variance.sqrt().max(LEAST_DEVIATION)) as f32)
            })
            .unzip();
        Scaling { mean, factor }
    }

    /// The scaled rows, one after the other, `[rows * values]`.
    pub fn apply<const N: usize>(&self, observations: &[[f32; N]]) -> Vec<f32> {
        let scaled = |((value, mean), factor): ((&f32, &f32), &f32)| ((value - mean) * factor).clamp(-LIMIT, LIMIT);
        let mut values = Vec::with_capacity(observations.len() * N);
        for row in observations {
            values.extend(row.iter().zip(&self.mean).zip(&self.factor).map(scaled));
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scaled_values_have_mean_0_and_deviation_1() {
        let scaling = Scaling::of(&[[1.0, 0.1], [3.0, 0.3], [1.0, 0.5], [3.0, 0.7]]);
        // sqrt(0.05) is the second value's deviation.
        let expected = [[-1.0, -0.3 / 0.05f32.sqrt()], [1.0, 0.3 / 0.05f32.sqrt()]];
        for (value, expected) in scaling.apply(&[[1.0, 0.1], [3.0, 0.7]]).iter().zip(expected.as_flattened()) {
            assert!((value - expected).abs() < 1e-5, "{value} {expected}");
        }
    }

    #[test]
    fn a_constant_value_is_not_blown_up_and_a_far_one_is_cut_off() {
        let scaling = Scaling::of(&[[0.5], [0.5]]);
        assert_eq!(scaling.apply(&[[0.5]]), [0.0]);
        assert!((scaling.apply(&[[0.51]])[0] - 1.0).abs() < 1e-4);
        assert_eq!(scaling.apply(&[[90.0]]), [10.0]);
    }
}
