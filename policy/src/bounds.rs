//! How large a network's values can become: a policy whose logits may overflow is refused when it is read.

use crate::network::{Activation, Layer};
use crate::normalisation::LIMIT;
use crate::recurrent::{Cell, Recurrent};

/// Largest magnitude that a sum of 32-bit floats may have: half of what they hold, for the rounding of its terms.
const MOST: f64 = 0.5 * f32::MAX as f64;

/// The first layer some of whose sums may overflow for a normalised observation, by the name of its tensors, and the
/// magnitude that they may reach.
///
/// The sum of the magnitudes of an output's terms bounds the sum of any of them, in any order. Hidden values lie in
/// -1..=1: an LSTM's are a product of two such numbers, a GRU's lie between two.
pub(crate) fn overflowing(
    layers: &[Layer],
    activation: Activation,
    recurrent: Option<&Recurrent>,
) -> Option<(String, f64)> {
    let most = |sums: &[f64]| Some(sums.iter().copied().fold(0.0, f64::max)).filter(|&most| MOST < most);
    let first = recurrent.filter(|recurrent| recurrent.after == 0).and_then(|recurrent| recurrent.cells.first());
    let n_inputs = first.map_or(layers.first()?.n_inputs(), |cell| cell.input.n_inputs());
    let mut inputs = vec![f64::from(LIMIT); n_inputs];
    for (index, layer) in layers.iter().enumerate() {
        if let Some(Recurrent { cells, .. }) = recurrent.filter(|recurrent| recurrent.after == index) {
            for (index, Cell { input, hidden }) in cells.iter().enumerate() {
                let mut sums = bounds(input, &inputs);
                let of_hidden = bounds(hidden, &vec![1.0; hidden.n_inputs()]);
                sums.iter_mut().zip(of_hidden).for_each(|(sum, hidden)| *sum += hidden);
                if let Some(most) = most(&sums) {
                    return Some((format!("recurrent.{index}"), most));
                }
                inputs = vec![1.0; hidden.n_inputs()];
            }
        }
        let outputs = bounds(layer, &inputs);
        if let Some(most) = most(&outputs) {
            return Some((format!("actor.{index}"), most));
        }
        inputs = if activation == Activation::Tanh { vec![1.0; outputs.len()] } else { outputs };
    }
    None
}

/// What the magnitudes of a layer's outputs are at most for inputs of at most these.
fn bounds(layer: &Layer, inputs: &[f64]) -> Vec<f64> {
    let mut outputs: Vec<f64> = layer.biases.iter().map(|bias| f64::from(bias.abs())).collect();
    for (input, weights) in inputs.iter().zip(layer.weights.chunks_exact(layer.n_outputs())) {
        outputs.iter_mut().zip(weights).for_each(|(output, weight)| *output += input * f64::from(weight.abs()));
    }
    outputs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_bounded_through_a_rectifier_and_by_1_behind_a_tangent() {
        let layers =
            [Layer { weights: vec![1e20; 2], biases: vec![1.0] }, Layer { weights: vec![-1e20], biases: vec![0.0] }];
        let (name, most) = overflowing(&layers, Activation::Relu, None).unwrap();
        // Two inputs of at most 10.
        assert!(name == "actor.1" && (most / 2e41 - 1.0).abs() < 1e-6, "{name} {most}");
        assert_eq!(overflowing(&layers, Activation::Tanh, None), None);
        assert_eq!(overflowing(&layers[..1], Activation::Relu, None), None);
    }

    #[test]
    fn gates_are_bounded_by_what_comes_in_and_hidden_values_by_1() {
        let layer = |weights: Vec<f32>, n_outputs| Layer { weights, biases: vec![0.0; n_outputs] };
        // Of one unit, behind one layer with one output of at most 10 * 1e20.
        let recurrent = |input: f32, hidden: f32| Recurrent {
            gates: crate::Gates::Gru,
            after: 1,
            cells: vec![Cell { input: layer(vec![input; 3], 3), hidden: layer(vec![hidden; 3], 3) }],
        };
        let layers = [layer(vec![1e20], 1), layer(vec![1e20], 1)];
        let found = |input, hidden| overflowing(&layers, Activation::Relu, Some(&recurrent(input, hidden)));
        assert_eq!(found(1e10, 1e38), None);
        // Each 1e38: together they are beyond half of 3.4e38.
        assert_eq!(found(1e17, 1e38).map(|(name, _)| name), Some("recurrent.0".to_owned()));
        assert_eq!(found(1e18, 0.0).map(|(name, _)| name), Some("recurrent.0".to_owned()));
    }
}
