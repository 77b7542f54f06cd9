//! Policies: networks that drive, read from files or shipped, and written for networks that were trained in Python.

use std::path::Path;
use std::sync::Mutex;

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use offtrack::layout::{N_EXTRAS, N_VALUES};
use offtrack_policy::{Activation, Error, Frames, Head, Layer, Normalisation, Policy};
use pyo3::exceptions::{PyOSError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::errors::guarded;
use crate::pool::Pool;
use crate::worlds::Given;
use crate::{actions, observed, worlds};

/// A policy. The class `offtrack_sim.Policy` wraps it and documents it.
#[pyclass(frozen, module = "offtrack_sim._offtrack")]
pub struct Network {
    policy: Policy,
    pool: Mutex<Pool>,
}

#[pymethods]
impl Network {
    /// The policy of a file's bytes, by the name that errors will have.
    #[new]
    fn new(name: &str, bytes: &[u8]) -> PyResult<Network> {
        guarded(|| Policy::from_bytes(name, bytes).map(Network::of).map_err(refused))
    }

    /// What makes another one, for copies and pickles.
    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<(&str, Bound<'py, PyBytes>)> {
        guarded(|| Ok((self.policy.name.as_str(), PyBytes::new(py, &self.policy.to_bytes()))))
    }

    #[staticmethod]
    fn shipped(name: &str) -> PyResult<Network> {
        guarded(|| Policy::shipped(name).map(Network::of).map_err(refused))
    }

    #[staticmethod]
    fn load(file: &str) -> PyResult<Network> {
        guarded(|| Policy::load(Path::new(file)).map(Network::of).map_err(refused))
    }

    #[getter]
    fn name(&self) -> &str {
        &self.policy.name
    }

    #[getter]
    fn benchmark(&self) -> &str {
        &self.policy.benchmark
    }

    /// Names of the extras that it observes behind an observation's values.
    #[getter]
    fn extras(&self) -> &[String] {
        &self.policy.extras
    }

    #[getter]
    fn action_table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        actions::table(py, &self.policy.actions)
    }

    fn logits<'py>(&self, py: Python<'py>, observations: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        guarded(|| {
            let (values, extras) = self.split(observations)?;
            let logits = self.run(py, || self.policy.logits_beside(&values, &extras))?;
            PyArray1::from_vec(py, logits).reshape([values.len(), self.policy.actions.len()])
        })
    }

    fn act<'py>(&self, py: Python<'py>, observations: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<i64>>> {
        guarded(|| {
            let (values, extras) = self.split(observations)?;
            let actions = self.run(py, || self.policy.act_beside(&values, &extras))?;
            Ok(PyArray1::from_iter(py, actions.into_iter().map(i64::from)))
        })
    }
}

impl Network {
    /// The policy itself.
    pub fn policy(&self) -> &Policy {
        &self.policy
    }

    fn of(policy: Policy) -> Network {
        Network { policy, pool: Mutex::new(Pool::new(0)) }
    }

    /// Does `work` on threads of this process; two Python threads take turns.
    fn run<T: Send>(&self, py: Python, work: impl FnOnce() -> T + Send) -> PyResult<T> {
        use pyo3::sync::MutexExt;

        let mut pool = self.pool.lock_py_attached(py).unwrap_or_else(|poisoned| poisoned.into_inner());
        pool.run(py, work)
    }

    /// An array of observations, `[n, 69 + extras]`: the values and, where the policy observes some, the extras.
    fn split(&self, observations: &Bound<PyAny>) -> PyResult<Split> {
        let n_extras = self.policy.extras.len();
        let n_values = N_VALUES + n_extras;
        let needed = || {
            PyTypeError::new_err(format!("observations: a numpy array of float32 and shape (n, {n_values}) is needed"))
        };
        let array: PyReadonlyArray2<f32> = observations.extract().map_err(|_| needed())?;
        let found = array.shape()[1];
        if found != n_values {
            let extras = observed::described(self.policy.extras.iter().map(String::as_str));
            return Err(PyValueError::new_err(format!(
                "observations: {found} values each; {n_values} are needed{extras}"
            )));
        }
        let values = array.as_slice().map_err(|_| needed())?;
        if let Some(at) = values.iter().position(|value| !value.is_finite()) {
            let (row, column, value) = (at / n_values, at % n_values, values[at]);
            return Err(PyValueError::new_err(format!(
                "observations[{row}, {column}]: {value}; every value must be finite"
            )));
        }
        if n_extras == 0 {
            return Ok((values.as_chunks().0.to_vec(), Vec::new()));
        }
        let split = |row: &[f32]| {
            let (values, extras) = row.split_at(N_VALUES);
            let padded = |index: usize| extras.get(index).copied().unwrap_or_default();
            (std::array::from_fn(|index| values[index]), std::array::from_fn(padded))
        };
        Ok(values.chunks_exact(n_values).map(split).unzip())
    }
}

/// Values of observations, and the extras beside them.
type Split = (Vec<[f32; N_VALUES]>, Vec<[f32; N_EXTRAS]>);

fn refused(error: Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Names of the policies that come with the package.
#[pyfunction]
pub fn policy_names() -> Vec<&'static str> {
    Policy::shipped_names().to_vec()
}

/// Writes a network as a policy file for a benchmark's action table and extras: weights `[inputs, outputs]` and biases
/// of each layer, and the observation's mean and factor, none for a network without normalisation.
#[pyfunction]
pub fn write_policy(
    py: Python,
    file: &str,
    scenario: Given,
    layers: Vec<(PyReadonlyArray2<f32>, PyReadonlyArray1<f32>)>,
    activation: &str,
    normalisation: Option<(PyReadonlyArray1<f32>, PyReadonlyArray1<f32>)>,
) -> PyResult<()> {
    guarded(|| {
        let Some(activation) = Activation::ALL.into_iter().find(|known| known.name() == activation) else {
            let known = Activation::ALL.map(Activation::name).join(", ");
            return Err(PyValueError::new_err(format!("activation: {activation:?}; must be one of {known}")));
        };
        let (name, actions, extras) =
            Pool::new(0).run_until_signal(py, |stop| worlds::policy_table(&scenario, stop))??;
        let n_values = N_VALUES + extras.len();
        check_layers(&layers, n_values)?;
        let vector = |array: &PyReadonlyArray1<f32>| array.as_array().to_vec();
        let layer = |(weights, biases): &(PyReadonlyArray2<f32>, PyReadonlyArray1<f32>)| Layer {
            weights: weights.as_array().iter().copied().collect(),
            biases: vector(biases),
        };
        // The factor is that of a variance.
        let described = observed::described(extras.iter().copied());
        for (name, given) in [
            ("mean", normalisation.as_ref().map(|given| &given.0)),
            ("variance", normalisation.as_ref().map(|given| &given.1)),
        ] {
            if let Some(found) = given.map(|given| given.len()).filter(|&found| found != n_values) {
                return Err(PyValueError::new_err(format!(
                    "{name}: shape ({found},); ({n_values},) is needed{described}"
                )));
            }
        }
        let normalisation = match &normalisation {
            None => Normalisation::none(n_values),
            Some((mean, factor)) => Normalisation { mean: vector(mean), factor: vector(factor) },
        };
        let policy = Policy {
            name: file.to_owned(),
            benchmark: name,
            actions,
            extras: extras.into_iter().map(str::to_owned).collect(),
            normalisation,
            layers: layers.iter().map(layer).collect(),
            activation,
            head: Head::Levels,
            values: None,
            frames: Frames::default(),
            recurrent: None,
        };
        let bytes = policy.to_bytes();
        // What is written can be read: sizes that do not fit the benchmark and values that cannot be are found here.
        Policy::from_bytes(file, &bytes).map_err(refused)?;
        write(file, &bytes)
    })
}

/// An error for layers whose shapes do not fit each other, before any of them is copied.
fn check_layers(layers: &[(PyReadonlyArray2<f32>, PyReadonlyArray1<f32>)], n_values: usize) -> PyResult<()> {
    let refused = |message: String| Err(PyValueError::new_err(message));
    if layers.is_empty() {
        return refused("layers: none; at least one is needed".to_owned());
    }
    let (mut n_inputs, mut n_numbers) = (n_values, 0usize);
    for (index, (weights, biases)) in layers.iter().enumerate() {
        let (shape, n_outputs) = (weights.shape(), biases.len());
        if shape[1] != n_outputs {
            return refused(format!(
                "layers[{index}]: biases of shape ({n_outputs},) beside weights of shape ({}, {}); ({},) is needed, \
                 one an output",
                shape[0], shape[1], shape[1]
            ));
        }
        if n_outputs == 0 || shape[0] != n_inputs {
            let last = if index == 0 { "an observation has" } else { "the layer before has" };
            return refused(format!(
                "layers[{index}]: weights of shape ({}, {n_outputs}); ({n_inputs}, {n_outputs}) is needed, inputs \
                 before outputs: {last} {n_inputs}",
                shape[0]
            ));
        }
        n_numbers = n_numbers.saturating_add(n_outputs.saturating_mul(n_inputs + 1));
        if MOST_NUMBERS < n_numbers {
            return refused(format!(
                "layers: {n_numbers} numbers up to layers[{index}]; a policy file has at most {MOST_NUMBERS}"
            ));
        }
        n_inputs = n_outputs;
    }
    Ok(())
}

/// Most weights and biases: those of the largest file that is read.
const MOST_NUMBERS: usize = (64 << 20) / size_of::<f32>();

/// Writes a file, whole or not at all.
fn write(file: &str, bytes: &[u8]) -> PyResult<()> {
    let failed = |error: std::io::Error| PyOSError::new_err(format!("{file}: cannot be written: {error}"));
    offtrack::files::writer::write_whole(Path::new(file), bytes).map_err(failed)
}
