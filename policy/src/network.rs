//! The network's forward pass: linear layers with an activation between them.
//!
//! A sum over inputs is a chain of fused multiply-adds in their order, for each row and output by itself. So a row's
//! result depends on nothing else, and vector instructions of any width give it to the last bit.

use multiversion::multiversion;
use rayon::prelude::*;

use crate::normalisation::Normalisation;

/// Rows, and outputs of each, whose sums are made at a time: they fit into the registers.
pub(crate) const ROWS: usize = 6;
const OUTPUTS: usize = 16;
/// Rows that one thread takes through all layers at a time: a slice of the weights serves them from the nearest cache.
pub(crate) const BLOCK: usize = 8 * ROWS;

offtrack::named! {
    /// What stands after each layer but the last.
    #[derive(Default)]
    pub enum Activation {
        /// The rectifier, max(x, 0).
        #[default]
        Relu = "relu",
        /// The hyperbolic tangent.
        Tanh = "tanh",
    }
}

impl Activation {
    fn apply(self, values: &mut [f32]) {
        match self {
            Activation::Relu => values.iter_mut().for_each(|value| *value = if *value < 0.0 { 0.0 } else { *value }),
            Activation::Tanh => values.iter_mut().for_each(|value| *value = value.tanh()),
        }
    }
}

/// A linear layer: outputs = inputs · weights + biases.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// `[inputs * outputs]`, inputs varying slowest.
    pub weights: Vec<f32>,
    /// `[outputs]`.
    pub biases: Vec<f32>,
}

impl Layer {
    /// Number of the layer's inputs; 0 without outputs.
    pub fn n_inputs(&self) -> usize {
        self.weights.len().checked_div(self.biases.len()).unwrap_or_default()
    }

    /// Number of the layer's outputs.
    pub fn n_outputs(&self) -> usize {
        self.biases.len()
    }
}

/// Neighbouring layers, and what stands before and behind them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pass<'a> {
    /// What happens to a row before the first layer; `None` where it was normalised before or came from a layer.
    pub(crate) normalisation: Option<&'a Normalisation>,
    pub(crate) layers: &'a [Layer],
    pub(crate) activation: Activation,
    /// Whether the activation follows the last layer, too.
    pub(crate) activates_last: bool,
}

impl Pass<'_> {
    /// The last layer's outputs for each row of `[rows * values]`, `[rows * outputs]`; the rows themselves, normalised,
    /// without a layer.
    pub(crate) fn outputs(&self, rows: &[f32]) -> Vec<f32> {
        let Pass { normalisation, layers, activation, activates_last } = *self;
        let normalised = |rows: &[f32]| normalisation.map_or_else(|| rows.to_vec(), |found| found.apply_rows(rows));
        let (Some(first), Some(last)) = (layers.first(), layers.last()) else { return normalised(rows) };
        let (n_values, n_outputs) = (first.n_inputs(), last.n_outputs());
        let mut outputs = vec![0.0; rows.len() / n_values * n_outputs];
        let block = |(rows, outputs): (&[f32], &mut [f32])| {
            let mut values = grouped(&normalised(rows), n_values);
            for (index, layer) in layers.iter().enumerate() {
                let mut sums = vec![[0.0; ROWS]; values.len() / layer.n_inputs() * layer.n_outputs()];
                linear(layer, &values, &mut sums);
                if index + 1 < layers.len() || activates_last {
                    activation.apply(sums.as_flattened_mut());
                }
                values = sums;
            }
            for (row, outputs) in outputs.chunks_exact_mut(n_outputs).enumerate() {
                let group = &values[row / ROWS * n_outputs..];
                outputs.iter_mut().zip(group).for_each(|(output, values)| *output = values[row % ROWS]);
            }
        };
        if BLOCK * n_values < rows.len() {
            rows.par_chunks(BLOCK * n_values).zip(outputs.par_chunks_mut(BLOCK * n_outputs)).for_each(block);
        } else {
            block((rows, &mut outputs));
        }
        outputs
    }
}

/// Rows of values in groups of [`ROWS`], in each the same value of all rows side by side, `[groups * values]`. The last
/// group is filled with zeros.
pub(crate) fn grouped(values: &[f32], n_values: usize) -> Vec<[f32; ROWS]> {
    let groups = values.chunks(ROWS * n_values);
    let value = |group: &[f32], index: usize| {
        std::array::from_fn(|row| group.get(row * n_values + index).copied().unwrap_or_default())
    };
    groups.flat_map(|group| (0..n_values).map(move |index| value(group, index))).collect()
}

/// A layer's outputs `[groups * outputs]` for its inputs `[groups * inputs]`.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2+fma"))]
pub(crate) fn linear(layer: &Layer, inputs: &[[f32; ROWS]], outputs: &mut [[f32; ROWS]]) {
    let (n_inputs, n_outputs) = (layer.n_inputs(), layer.n_outputs());
    for first in (0..n_outputs).step_by(OUTPUTS) {
        let width = OUTPUTS.min(n_outputs - first);
        for (inputs, outputs) in inputs.chunks_exact(n_inputs).zip(outputs.chunks_exact_mut(n_outputs)) {
            // The width is known to the compiler where it matters.
            let sums =
                if width == OUTPUTS { sums(layer, inputs, first, OUTPUTS) } else { sums(layer, inputs, first, width) };
            for (index, (output, bias)) in outputs[first..][..width].iter_mut().zip(&layer.biases[first..]).enumerate()
            {
                *output = std::array::from_fn(|row| sums[row][index] + bias);
            }
        }
    }
}

/// The sums of a group's rows for `width` outputs from the `first` on.
#[inline(always)]
fn sums(layer: &Layer, inputs: &[[f32; ROWS]], first: usize, width: usize) -> [[f32; OUTPUTS]; ROWS] {
    let mut sums = [[0.0; OUTPUTS]; ROWS];
    for (values, row) in inputs.iter().zip(layer.weights.chunks_exact(layer.n_outputs())) {
        let mut weights = [0.0; OUTPUTS];
        weights[..width].copy_from_slice(&row[first..first + width]);
        for (sums, value) in sums.iter_mut().zip(values) {
            for (sum, weight) in sums.iter_mut().zip(&weights) {
                *sum = value.mul_add(*weight, *sum);
            }
        }
    }
    sums
}
