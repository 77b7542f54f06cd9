//! How large a network's values can become: a policy whose logits may overflow is refused when it is read.

use crate::network::{Activation, Layer};
use crate::normalisation::LIMIT;

/// Largest magnitude that a sum of 32-bit floats may have: half of what they hold, for the rounding of its terms.
const MOST: f64 = 0.5 * f32::MAX as f64;

/// The first layer some of whose sums may overflow for a normalised observation, and the magnitude that they may reach.
///
/// The sum of the magnitudes of an output's terms bounds the sum of any of them, in any order.
pub(crate) fn overflowing(layers: &[Layer], activation: Activation) -> Option<(usize, f64)> {
    let mut inputs = vec![f64::from(LIMIT); layers.first()?.n_inputs()];
    for (index, layer) in layers.iter().enumerate() {
        let mut outputs: Vec<f64> = layer.biases.iter().map(|bias| f64::from(bias.abs())).collect();
        for (input, weights) in inputs.iter().zip(layer.weights.chunks_exact(layer.n_outputs())) {
            outputs.iter_mut().zip(weights).for_each(|(output, weight)| *output += input * f64::from(weight.abs()));
        }
        let most = outputs.iter().copied().fold(0.0, f64::max);
        if MOST < most {
            return Some((index, most));
        }
        inputs = if activation == Activation::Tanh { vec![1.0; outputs.len()] } else { outputs };
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_bounded_through_a_rectifier_and_by_1_behind_a_tangent() {
        let layers =
            [Layer { weights: vec![1e20; 2], biases: vec![1.0] }, Layer { weights: vec![-1e20], biases: vec![0.0] }];
        let (index, most) = overflowing(&layers, Activation::Relu).unwrap();
        // Two inputs of at most 10.
        assert!(index == 1 && (most / 2e41 - 1.0).abs() < 1e-6, "{most}");
        assert_eq!(overflowing(&layers, Activation::Tanh), None);
        assert_eq!(overflowing(&layers[..1], Activation::Relu), None);
    }
}
