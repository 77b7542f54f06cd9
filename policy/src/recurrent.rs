//! Recurrent layers, as PyTorch defines `torch.nn.GRU` and `torch.nn.LSTM`: gates in its order, both biases.
//!
//! A gate's sum is that over the inputs plus that over the last hidden values, each a chain as in [`crate::network`].

use crate::network::{BLOCK, Layer, ROWS, grouped, linear};
use rayon::prelude::*;

offtrack::named! {
    /// The kind of a policy's recurrent layers.
    pub enum Gates {
        /// Gated recurrent units: reset, update, new.
        Gru = "gru",
        /// Long short-term memory: input, forget, cell, output.
        Lstm = "lstm",
    }
}

impl Gates {
    /// Gates of a unit.
    pub const fn n(self) -> usize {
        match self {
            Gates::Gru => 3,
            Gates::Lstm => 4,
        }
    }

    /// Numbers that a unit remembers.
    const fn n_kept(self) -> usize {
        match self {
            Gates::Gru => 1,
            Gates::Lstm => 2,
        }
    }
}

/// A recurrent layer of `n` units. The outputs of both linear layers are the gates, `[gates * n]`, gate by gate.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// From what comes in.
    pub input: Layer,
    /// From the `n` hidden values after the last step.
    pub hidden: Layer,
}

impl Cell {
    /// Number of the layer's units.
    pub fn n_units(&self) -> usize {
        self.hidden.n_inputs()
    }
}

/// The recurrent layers of a policy.
#[derive(Debug, Clone, PartialEq)]
pub struct Recurrent {
    /// What they are.
    pub gates: Gates,
    /// Layers of the policy before them; the activation stands after each of these. What follows takes their hidden
    /// values as they are.
    pub after: usize,
    /// The recurrent layers, of which each takes the hidden values of the one before.
    pub cells: Vec<Cell>,
}

impl Recurrent {
    /// Numbers that are remembered of a truck: of each layer its hidden values and, of an LSTM, its cells' values.
    pub(crate) fn n_kept(&self) -> usize {
        self.cells.iter().map(|cell| self.gates.n_kept() * cell.n_units()).sum()
    }

    /// The last layer's hidden values of each row after a step with the inputs `[rows * inputs]`; `kept` is what is
    /// remembered, `[rows * n_kept]`.
    pub(crate) fn step(&self, inputs: &[f32], kept: &mut [f32]) -> Vec<f32> {
        let (Some(first), Some(last)) = (self.cells.first(), self.cells.last()) else { return inputs.to_vec() };
        let (n_inputs, n_kept, n_outputs) = (first.input.n_inputs(), self.n_kept(), last.n_units());
        let mut outputs = vec![0.0; inputs.len() / n_inputs * n_outputs];
        let rows = inputs.par_chunks(BLOCK * n_inputs).zip(kept.par_chunks_mut(BLOCK * n_kept));
        rows.zip(outputs.par_chunks_mut(BLOCK * n_outputs)).for_each(|((inputs, kept), outputs)| {
            let mut values = inputs.to_vec();
            let mut first = 0;
            for cell in &self.cells {
                values = self.step_cell(cell, &values, kept, first);
                first += self.gates.n_kept() * cell.n_units();
            }
            outputs.copy_from_slice(&values);
        });
        outputs
    }

    /// A layer's hidden values, `[rows * units]`. What it remembers stands at `first` of each row of `kept`.
    fn step_cell(&self, cell: &Cell, inputs: &[f32], kept: &mut [f32], first: usize) -> Vec<f32> {
        let (n_units, n_kept) = (cell.n_units(), self.n_kept());
        let hidden: Vec<f32> =
            kept.chunks_exact(n_kept).flat_map(|row| &row[first..first + n_units]).copied().collect();
        let [of_inputs, of_hidden] =
            [(&cell.input, inputs), (&cell.hidden, hidden.as_slice())].map(|(layer, values)| {
                let values = grouped(values, layer.n_inputs());
                let mut sums = vec![[0.0; ROWS]; values.len() / layer.n_inputs() * layer.n_outputs()];
                linear(layer, &values, &mut sums);
                sums
            });
        let mut outputs = Vec::with_capacity(hidden.len());
        for (row, kept) in kept.chunks_exact_mut(n_kept).enumerate() {
            let kept = &mut kept[first..first + self.gates.n_kept() * n_units];
            for unit in 0..n_units {
                // Both sums of the unit's gate.
                let sums = |gate: usize| {
                    let at = (row / ROWS * self.gates.n() + gate) * n_units + unit;
                    (of_inputs[at][row % ROWS], of_hidden[at][row % ROWS])
                };
                let gate = |index: usize| sigmoid(sums(index).0 + sums(index).1);
                let output = match self.gates {
                    Gates::Gru => {
                        let ((input, hidden), update) = (sums(2), gate(1));
                        let new = (input + gate(0) * hidden).tanh();
                        (1.0 - update) * new + update * kept[unit]
                    }
                    Gates::Lstm => {
                        let new = (sums(2).0 + sums(2).1).tanh();
                        let value = gate(1) * kept[n_units + unit] + gate(0) * new;
                        kept[n_units + unit] = value;
                        gate(3) * value.tanh()
                    }
                };
                kept[unit] = output;
                outputs.push(output);
            }
        }
        outputs
    }
}

/// The logistic function.
fn sigmoid(value: f32) -> f32 {
    1.0 / (1.0 + (-value).exp())
}
