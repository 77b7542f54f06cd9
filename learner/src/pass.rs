//! A network's pass forward and back on the processor, with gradients by the chain rule written out.
//!
//! Only products are tensors; what lies between them is one pass over the rows. Sums along a row are made in as many
//! parts as [`LANES`], so that they do not depend on the width of the processor's vectors.

use burn::nn::LayerNorm;
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor, TensorData};
use multiversion::multiversion;

use super::network::{Mlp, NORM_EPSILON, values_of};

/// Parts in which a row is summed.
const LANES: usize = 16;

/// A network's pass from observations to its output, and what it leaves for the way back.
pub struct Pass {
    /// Input of each layer, `[rows, inputs]`.
    inputs: Vec<Tensor<2>>,
    /// Values of each hidden layer before its rectifier.
    hidden: Vec<Hidden>,
    /// `[rows * outputs]`.
    pub output: Vec<f32>,
}

/// A hidden layer before its rectifier.
struct Hidden {
    /// Output of the linear layer, normalised where there is a normalisation, `[rows, width]`.
    values: TensorData,
    /// Factor by which a normalisation multiplied each row; empty without one.
    factors: Vec<f32>,
}

impl Pass {
    /// The way there, from `[rows, values]`.
    pub fn forward(network: &Mlp, observation: Tensor<2>) -> Pass {
        let [n_rows, _] = observation.dims();
        let mut pass = Pass { inputs: vec![observation], hidden: Vec::new(), output: Vec::new() };
        for (index, layer) in network.layers.iter().enumerate() {
            let weights = layer.weight.val();
            let width = weights.dims()[1];
            let biases = layer.bias.as_ref().map(values_of).unwrap_or_else(|| vec![0.0; width]);
            let mut values = pass.inputs[index].clone().matmul(weights).into_data();
            if index + 1 == network.layers.len() {
                add_to_rows(elements_mut(&mut values), &biases);
                pass.output = values.try_into_vec().expect("the output of f32 layers is f32");
                break;
            }
            let mut activations = vec![0.0; n_rows * width];
            let mut factors = Vec::new();
            match network.norms.get(index) {
                Some(norm) => {
                    factors = vec![0.0; n_rows];
                    let norm = Norm::of(norm);
                    normalise(elements_mut(&mut values), &biases, &norm, &mut factors, &mut activations);
                }
                None => rectify(elements_mut(&mut values), &biases, &mut activations),
            }
            pass.inputs.push(matrix(TensorData::new(activations, [n_rows, width])));
            pass.hidden.push(Hidden { values, factors });
        }
        pass
    }

    /// Adds the gradients of the network's parameters, given those of its output.
    pub fn backward(mut self, network: &Mlp, by_output: Vec<f32>, gradients: &mut GradientsParams) {
        let [n_rows, _] = self.inputs[0].dims();
        let n_outputs = by_output.len() / n_rows;
        let mut by_values = TensorData::new(by_output, [n_rows, n_outputs]);
        for (index, layer) in network.layers.iter().enumerate().rev() {
            let width = by_values.shape()[1];
            if let Some(biases) = &layer.bias {
                let mut sums = vec![0.0; width];
                add_rows(&mut sums, elements(&by_values));
                gradients.register(biases.id, row(sums));
            }
            let by_sums = matrix(by_values);
            if let Some(input) = self.inputs.pop() {
                gradients.register(layer.weight.id, input.transpose().matmul(by_sums.clone()));
            }
            let Some(hidden) = self.hidden.pop() else { break };
            by_values = by_sums.matmul(layer.weight.val().transpose()).into_data();
            match network.norms.get(index - 1) {
                Some(norm) => {
                    let (scale, shift) = (&norm.gamma, norm.beta.as_ref());
                    let norm = Norm::of(norm);
                    let mut by_norm = [0; 2].map(|_| vec![0.0; norm.scale.len()]);
                    normalise_back(
                        elements_mut(&mut by_values),
                        elements(&hidden.values),
                        &hidden.factors,
                        &norm,
                        &mut by_norm,
                    );
                    let [by_scale, by_shift] = by_norm.map(row);
                    gradients.register(scale.id, by_scale);
                    shift.into_iter().for_each(|shift| gradients.register(shift.id, by_shift.clone()));
                }
                None => rectify_back(elements_mut(&mut by_values), elements(&hidden.values)),
            }
        }
    }
}

/// The parameters of a layer normalisation.
struct Norm {
    scale: Vec<f32>,
    shift: Vec<f32>,
}

impl Norm {
    fn of(norm: &LayerNorm) -> Norm {
        let scale = values_of(&norm.gamma);
        Norm { shift: norm.beta.as_ref().map(values_of).unwrap_or_else(|| vec![0.0; scale.len()]), scale }
    }
}

/// Adds `added` to each row.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn add_to_rows(values: &mut [f32], added: &[f32]) {
    for row in values.chunks_exact_mut(added.len()) {
        for (value, added) in row.iter_mut().zip(added) {
            *value += added;
        }
    }
}

/// Adds all rows to `sums`.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn add_rows(sums: &mut [f32], values: &[f32]) {
    for row in values.chunks_exact(sums.len()) {
        for (sum, value) in sums.iter_mut().zip(row) {
            *sum += value;
        }
    }
}

/// Adds the biases; `activations` becomes what the rectifier leaves.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn rectify(values: &mut [f32], biases: &[f32], activations: &mut [f32]) {
    for (row, activations) in values.chunks_exact_mut(biases.len()).zip(activations.chunks_exact_mut(biases.len())) {
        for ((value, bias), activation) in row.iter_mut().zip(biases).zip(activations) {
            *value += bias;
            *activation = value.max(0.0);
        }
    }
}

/// From the gradients by what the rectifier left to those by the values before it.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn rectify_back(gradients: &mut [f32], values: &[f32]) {
    for (gradient, value) in gradients.iter_mut().zip(values) {
        *gradient = if 0.0 < *value { *gradient } else { 0.0 };
    }
}

/// Adds the biases and normalises each row to mean 0 and variance 1; `factors` becomes by what each was multiplied, and
/// `activations` what the rectifier leaves of the scaled and shifted values.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn normalise(values: &mut [f32], biases: &[f32], norm: &Norm, factors: &mut [f32], activations: &mut [f32]) {
    let width = biases.len();
    for ((row, activations), factor) in
        values.chunks_exact_mut(width).zip(activations.chunks_exact_mut(width)).zip(factors)
    {
        for (value, bias) in row.iter_mut().zip(biases) {
            *value += bias;
        }
        let mean = sum(row) / width as f32;
        for value in row.iter_mut() {
            *value -= mean;
        }
        *factor = 1.0 / (product(row, row) / width as f32 + NORM_EPSILON as f32).sqrt();
        for (((value, scale), shift), activation) in row.iter_mut().zip(&norm.scale).zip(&norm.shift).zip(activations) {
            *value *= *factor;
            *activation = (*value * scale + shift).max(0.0);
        }
    }
}

/// From the gradients by what the rectifier left to those by the values before normalisation and biases; adds those by
/// scale and shift.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn normalise_back(
    gradients: &mut [f32],
    normalised: &[f32],
    factors: &[f32],
    norm: &Norm,
    by_norm: &mut [Vec<f32>; 2],
) {
    let width = norm.scale.len();
    let [by_scale, by_shift] = by_norm;
    for ((gradients, normalised), factor) in
        gradients.chunks_exact_mut(width).zip(normalised.chunks_exact(width)).zip(factors)
    {
        let parameters = norm.scale.iter().zip(&norm.shift).zip(by_scale.iter_mut().zip(by_shift.iter_mut()));
        for ((gradient, normalised), ((scale, shift), (by_scale, by_shift))) in
            gradients.iter_mut().zip(normalised).zip(parameters)
        {
            let open = if 0.0 < normalised * scale + shift { *gradient } else { 0.0 };
            *by_scale += open * normalised;
            *by_shift += open;
            *gradient = open * scale;
        }
        let mean = sum(gradients) / width as f32;
        let along = product(gradients, normalised) / width as f32;
        for (gradient, normalised) in gradients.iter_mut().zip(normalised) {
            *gradient = factor * (*gradient - mean - normalised * along);
        }
    }
}

#[inline(always)]
fn sum(values: &[f32]) -> f32 {
    let mut sums = [0.0; LANES];
    let parts = values.chunks_exact(LANES);
    let rest: f32 = parts.remainder().iter().sum();
    for part in parts {
        for (sum, value) in sums.iter_mut().zip(part) {
            *sum += value;
        }
    }
    sums.iter().sum::<f32>() + rest
}

/// The sum of the products, element by element.
#[inline(always)]
fn product(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0; LANES];
    let parts = a.chunks_exact(LANES).zip(b.chunks_exact(LANES));
    let begin = a.len() - a.len() % LANES;
    let rest: f32 = a[begin..].iter().zip(&b[begin..]).map(|(a, b)| a * b).sum();
    for (a, b) in parts {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f32>() + rest
}

/// A row of `[rows * width]`.
pub fn row_of(values: &[f32], row: usize, width: usize) -> &[f32] {
    &values[row * width..][..width]
}

/// Probabilities and their logarithms.
pub fn softmax(logits: &[f32]) -> (Vec<f32>, Vec<f32>) {
    let most = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let log_sum = most + logits.iter().map(|logit| (logit - most).exp()).sum::<f32>().ln();
    let log_probs: Vec<f32> = logits.iter().map(|logit| logit - log_sum).collect();
    (log_probs.iter().map(|log_prob| log_prob.exp()).collect(), log_probs)
}

/// A matrix in the processor's memory.
pub fn matrix(data: TensorData) -> Tensor<2> {
    Tensor::from_data(data, &Device::flex())
}

fn row(values: Vec<f32>) -> Tensor<1> {
    let shape = [values.len()];
    Tensor::from_data(TensorData::new(values, shape), &Device::flex())
}

fn elements(values: &TensorData) -> &[f32] {
    values.as_slice().expect("products of f32 tensors are f32")
}

fn elements_mut(values: &mut TensorData) -> &mut [f32] {
    values.as_mut_slice().expect("products of f32 tensors are f32")
}
