//! Networks that were trained in Python, as policy files.

use std::path::Path;

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use offtrack::layout::shared::Named;
use offtrack::layout::{Action, ObservationLayout};
use offtrack_policy::{
    Activation, Cell, FILE_LIMIT, Frames, Gates, Head, Layer, Normalisation, Padding, Policy, Recurrent, Selection,
    Squash,
};
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::refused;
use crate::arrays::aligned;
use crate::errors::guarded;
use crate::pool::Pool;
use crate::worlds::Table;
use crate::{observed, worlds};

/// Weights and biases of a layer.
type Pair<'py> = (PyReadonlyArray2<'py, f32>, PyReadonlyArray1<'py, f32>);

/// A network of Python. `offtrack_sim.export.Network` documents it.
#[derive(FromPyObject)]
pub struct Given<'py> {
    /// Weights `[inputs, outputs]` and biases of each layer.
    layers: Vec<Pair<'py>>,
    activation: String,
    /// How outputs become commands; none where they are values of actions.
    squash: Option<String>,
    /// Names of the values that it reads; none for all, and the extras of the benchmark.
    values: Option<Vec<String>>,
    frames: usize,
    padding: String,
    /// The kind of its recurrent layers, none without such.
    gates: Option<String>,
    /// Layers before the recurrent ones.
    after: usize,
    /// For each recurrent layer weights `[inputs, gates * units]` and biases from what comes in, and the same from the
    /// hidden values.
    cells: Vec<(Pair<'py>, Pair<'py>)>,
    /// Mean and factor of each value, or of each value of each frame; none for a network without normalisation.
    normalisation: Option<(PyReadonlyArray1<'py, f32>, PyReadonlyArray1<'py, f32>)>,
}

/// Writes a network as a policy file for a benchmark's action table and extras.
#[pyfunction]
pub fn write_policy(py: Python, file: &str, scenario: worlds::Given, network: Given) -> PyResult<()> {
    guarded(|| {
        let table = Pool::new(0).run_until_signal(py, |stop| worlds::policy_table(&scenario, stop))??;
        let policy = network.policy(file, table)?;
        let bytes = policy.to_bytes();
        // What is written can be read: sizes that do not fit the benchmark and values that cannot be are found here.
        Policy::from_bytes(file, &bytes).map_err(refused)?;
        write(file, &bytes)
    })
}

impl Given<'_> {
    fn policy(&self, file: &str, table: Table) -> PyResult<Policy> {
        let Table { benchmark, actions, is_continuous, extras, vehicles } = table;
        let activation = word::<Activation>("activation", &self.activation)?;
        let head = match &self.squash {
            None => Head::Levels,
            Some(squash) => Head::Continuous { squash: word::<Squash>("squash", squash)? },
        };
        if self.squash.is_none() && is_continuous {
            let message = format!("squash: None; {benchmark} takes commands: give tanh or clip");
            return Err(PyValueError::new_err(message));
        }
        let padding = word::<Padding>("padding", &self.padding)?;
        let gates = self.gates.as_ref().map(|gates| word::<Gates>("gates", gates)).transpose()?;
        let selected = |names: &Vec<String>| Selection::of(names);
        let values = self.values.as_ref().map(selected).transpose();
        let values = values.map_err(|message| PyValueError::new_err(format!("values: {message}")))?;
        let (extras, vehicles) = if values.is_none() { (&extras[..], vehicles) } else { (&[][..], false) };
        let all = ObservationLayout { n_extras: extras.len(), has_vehicles: vehicles };
        let n_values = values.as_ref().map_or(all.n_values(), |values| values.indices().len());
        let n_stacked = n_values.saturating_mul(self.frames);
        self.check_shapes(n_stacked)?;
        let pair = |(input, hidden): &(Pair, Pair)| Ok(Cell { input: layer(input)?, hidden: layer(hidden)? });
        let cells = self.cells.iter().map(pair).collect::<PyResult<_>>()?;
        let recurrent = gates.map(|gates| Recurrent { gates, after: self.after, cells });
        Ok(Policy {
            name: file.to_owned(),
            benchmark,
            actions: if head == Head::Levels { actions } else { ends(&actions) },
            head,
            values,
            extras: extras.iter().map(|&name| name.to_owned()).collect(),
            vehicles,
            frames: Frames { n: self.frames, padding },
            normalisation: self.normalisation(n_values, n_stacked, extras)?,
            layers: self.layers.iter().map(layer).collect::<PyResult<_>>()?,
            activation,
            recurrent,
        })
    }

    fn normalisation(&self, n_values: usize, n_stacked: usize, extras: &[&str]) -> PyResult<Normalisation> {
        let Some((mean, factor)) = &self.normalisation else { return Ok(Normalisation::none(n_values)) };
        // The factor is that of a variance.
        for (name, found) in [("mean", mean.len()), ("variance", factor.len())] {
            if found != n_values && found != n_stacked {
                let described = observed::described(extras.iter().copied());
                let all =
                    if n_stacked == n_values { String::new() } else { format!(", or ({n_stacked},) of all frames,") };
                return Err(PyValueError::new_err(format!(
                    "{name}: shape ({found},); ({n_values},){all} is needed{described}"
                )));
            }
        }
        if mean.len() != factor.len() {
            let message = format!("variance: shape ({},) beside a mean of shape ({},)", factor.len(), mean.len());
            return Err(PyValueError::new_err(message));
        }
        Ok(Normalisation { mean: vector(mean)?, factor: vector(factor)? })
    }

    /// An error for layers whose shapes do not fit each other, before any of them is copied.
    fn check_shapes(&self, n_inputs: usize) -> PyResult<()> {
        let refused = |message: String| Err(PyValueError::new_err(message));
        if self.layers.is_empty() {
            return refused("layers: none; at least one is needed".to_owned());
        }
        let mut shapes = Shapes { n_inputs, n_numbers: 0 };
        let mut before = "an observation has";
        for (index, pair) in self.layers.iter().enumerate() {
            if self.gates.is_some() && index == self.after {
                for (index, (input, hidden)) in self.cells.iter().enumerate() {
                    let n_units = hidden.0.shape()[0];
                    shapes.check(&format!("recurrent[{index}].input"), input, before)?;
                    shapes.n_inputs = n_units;
                    shapes.check(&format!("recurrent[{index}].hidden"), hidden, "a recurrent layer has units")?;
                    shapes.n_inputs = n_units;
                    before = "the layer before has";
                }
            }
            shapes.check(&format!("layers[{index}]"), pair, before)?;
            before = "the layer before has";
        }
        Ok(())
    }
}

/// What layers have so far.
struct Shapes {
    /// Outputs of the last one.
    n_inputs: usize,
    n_numbers: usize,
}

impl Shapes {
    fn check(&mut self, name: &str, (weights, biases): &Pair, before: &str) -> PyResult<()> {
        let refused = |message: String| Err(PyValueError::new_err(message));
        let (shape, n_outputs, n_inputs) = (weights.shape(), biases.len(), self.n_inputs);
        if shape[1] != n_outputs {
            return refused(format!(
                "{name}: biases of shape ({n_outputs},) beside weights of shape ({}, {}); ({},) is needed, one an \
                 output",
                shape[0], shape[1], shape[1]
            ));
        }
        if n_outputs == 0 || shape[0] != n_inputs {
            return refused(format!(
                "{name}: weights of shape ({}, {n_outputs}); ({n_inputs}, {n_outputs}) is needed, inputs before \
                 outputs: {before} {n_inputs}",
                shape[0]
            ));
        }
        self.n_numbers = self.n_numbers.saturating_add(n_outputs.saturating_mul(n_inputs + 1));
        if MOST_NUMBERS < self.n_numbers {
            return refused(format!(
                "layers: {} numbers up to {name}; a policy file has at most {MOST_NUMBERS}",
                self.n_numbers
            ));
        }
        self.n_inputs = n_outputs;
        Ok(())
    }
}

/// The network of a policy as arrays, by the fields of [`Given`].
pub fn parts<'py>(py: Python<'py>, policy: &Policy) -> PyResult<Bound<'py, PyDict>> {
    let vector = |values: &[f32]| PyArray1::from_slice(py, values);
    let pair = |layer: &Layer| -> PyResult<_> {
        let weights = vector(&layer.weights).reshape([layer.n_inputs(), layer.n_outputs()])?;
        Ok((weights, vector(&layer.biases)))
    };
    let parts = PyDict::new(py);
    parts.set_item("layers", policy.layers.iter().map(pair).collect::<PyResult<Vec<_>>>()?)?;
    parts.set_item("activation", policy.activation.name())?;
    if let Head::Continuous { squash } = policy.head {
        parts.set_item("squash", squash.name())?;
    }
    parts.set_item("values", policy.values.as_ref().map(|values| values.names().to_vec()))?;
    parts.set_item("frames", policy.frames.n)?;
    parts.set_item("padding", policy.frames.padding.name())?;
    if let Some(Recurrent { gates, after, cells }) = &policy.recurrent {
        let cells = cells.iter().map(|cell| Ok((pair(&cell.input)?, pair(&cell.hidden)?)));
        parts.set_item("gates", gates.name())?;
        parts.set_item("after", after)?;
        parts.set_item("cells", cells.collect::<PyResult<Vec<_>>>()?)?;
    }
    let Normalisation { mean, factor } = &policy.normalisation;
    parts.set_item("normalisation", (vector(mean), vector(factor)))?;
    Ok(parts)
}

/// What -1 and what 1 of each command asks for: the least and the most of a table.
fn ends(actions: &[Action]) -> Vec<Action> {
    let most = |start: f32, of: fn(&Action) -> f32, pick: fn(f32, f32) -> f32| actions.iter().map(of).fold(start, pick);
    let end = |start: f32, pick: fn(f32, f32) -> f32| Action {
        steering: most(start, |action| action.steering, pick),
        speed: most(start, |action| action.speed, pick),
    };
    vec![end(f32::INFINITY, f32::min), end(f32::NEG_INFINITY, f32::max)]
}

fn layer((weights, biases): &Pair) -> PyResult<Layer> {
    let weights = aligned(weights.clone())?.as_array().iter().copied().collect();
    Ok(Layer { weights, biases: vector(biases)? })
}

fn vector(array: &PyReadonlyArray1<f32>) -> PyResult<Vec<f32>> {
    Ok(aligned(array.clone())?.as_array().to_vec())
}

/// One of a list of names.
fn word<T: Named>(key: &str, word: &str) -> PyResult<T> {
    T::named(word).ok_or_else(|| {
        let known: Vec<&str> = T::ALL.iter().map(|known| known.name()).collect();
        PyValueError::new_err(format!("{key}: {word:?}; must be one of {}", known.join(", ")))
    })
}

/// Most weights and biases: those of the largest file that is read.
const MOST_NUMBERS: usize = FILE_LIMIT as usize / size_of::<f32>();

/// Writes a file, whole or not at all.
fn write(file: &str, bytes: &[u8]) -> PyResult<()> {
    let failed = |error: std::io::Error| PyOSError::new_err(format!("{file}: cannot be written: {error}"));
    offtrack::files::writer::write_whole(Path::new(file), bytes).map_err(failed)
}
