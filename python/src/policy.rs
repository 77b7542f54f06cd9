//! Policies: networks that drive, read from files or shipped, and written for networks that were trained in Python.

use std::io::Write;
use std::path::Path;
use std::sync::Mutex;

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use offtrack::layout::N_VALUES;
use offtrack_policy::{Activation, Error, Layer, Normalisation, Policy};
use pyo3::exceptions::{PyOSError, PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::pool::Pool;
use crate::worlds;

/// A policy. The class `offtrack_sim.Policy` wraps it and documents it.
#[pyclass(frozen, module = "offtrack_sim._offtrack")]
pub struct Network {
    policy: Policy,
    pool: Mutex<Pool>,
}

#[pymethods]
impl Network {
    #[staticmethod]
    fn shipped(benchmark: &str) -> PyResult<Network> {
        Policy::shipped(benchmark).map(Network::new).map_err(refused)
    }

    #[staticmethod]
    fn load(file: &str) -> PyResult<Network> {
        let policy = Policy::load(Path::new(file)).map_err(refused)?;
        if !policy.extras.is_empty() {
            let extras = policy.extras.join(", ");
            let message = format!("{file}: observes {extras} beside the observation; Python drives policies without such extras");
            return Err(PyValueError::new_err(message));
        }
        Ok(Network::new(policy))
    }

    #[getter]
    fn name(&self) -> &str {
        &self.policy.name
    }

    #[getter]
    fn benchmark(&self) -> &str {
        &self.policy.benchmark
    }

    #[getter]
    fn action_table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let table: Vec<f32> = self.policy.actions.iter().flat_map(|action| [action.steering, action.speed]).collect();
        PyArray1::from_vec(py, table).reshape([self.policy.actions.len(), 2])
    }

    fn logits<'py>(&self, py: Python<'py>, observations: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let rows = rows(observations)?;
        let logits = self.run(py, || self.policy.logits(&rows))?;
        PyArray1::from_vec(py, logits).reshape([rows.len(), self.policy.actions.len()])
    }

    fn act<'py>(&self, py: Python<'py>, observations: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<i64>>> {
        let rows = rows(observations)?;
        let actions = self.run(py, || self.policy.act(&rows))?;
        Ok(PyArray1::from_iter(py, actions.into_iter().map(i64::from)))
    }
}

impl Network {
    fn new(policy: Policy) -> Network {
        Network { policy, pool: Mutex::new(Pool::new(0)) }
    }

    /// Does `work` on threads of this process; two Python threads take turns.
    fn run<T: Send>(&self, py: Python, work: impl FnOnce() -> T + Send) -> PyResult<T> {
        use pyo3::sync::MutexExt;

        let mut pool = self.pool.lock_py_attached(py).unwrap_or_else(|poisoned| poisoned.into_inner());
        pool.run(py, work)
    }
}

/// An array of observations, `[n, 69]`.
fn rows(observations: &Bound<PyAny>) -> PyResult<Vec<[f32; N_VALUES]>> {
    let needed = || PyTypeError::new_err(format!("observations: a numpy array of float32 and shape (n, {N_VALUES}) is needed"));
    let array: PyReadonlyArray2<f32> = observations.extract().map_err(|_| needed())?;
    if array.shape()[1] != N_VALUES {
        return Err(PyValueError::new_err(format!("observations: {} values each; {N_VALUES} are needed", array.shape()[1])));
    }
    let values = array.as_slice().map_err(|_| needed())?;
    Ok(values.as_chunks().0.to_vec())
}

fn refused(error: Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Names of the benchmarks for which a policy comes with the package.
#[pyfunction]
pub fn policy_names() -> Vec<&'static str> {
    Policy::shipped_names().to_vec()
}

/// Writes a network as a policy file for a benchmark's action table: weights `[inputs, outputs]` and biases of each
/// layer, and the observation's mean and factor.
#[pyfunction]
pub fn write_policy(
    file: &str,
    scenario: &str,
    layers: Vec<(PyReadonlyArray2<f32>, PyReadonlyArray1<f32>)>,
    activation: &str,
    mean: PyReadonlyArray1<f32>,
    factor: PyReadonlyArray1<f32>,
) -> PyResult<()> {
    let Some(activation) = Activation::ALL.into_iter().find(|known| known.name() == activation) else {
        let known = Activation::ALL.map(Activation::name).join(", ");
        return Err(PyValueError::new_err(format!("activation: {activation:?}; must be one of {known}")));
    };
    let (name, actions) = worlds::action_table(scenario)?;
    let vector = |array: &PyReadonlyArray1<f32>| array.as_array().to_vec();
    let layer = |(weights, biases): &(PyReadonlyArray2<f32>, PyReadonlyArray1<f32>)| Layer {
        weights: weights.as_array().iter().copied().collect(),
        biases: vector(biases),
    };
    let policy = Policy {
        name: file.to_owned(),
        benchmark: name,
        actions,
        extras: Vec::new(),
        normalisation: Normalisation { mean: vector(&mean), factor: vector(&factor) },
        layers: layers.iter().map(layer).collect(),
        activation,
    };
    let bytes = policy.to_bytes();
    // What is written can be read: sizes that do not fit each other are found here.
    Policy::from_bytes(file, &bytes).map_err(refused)?;
    let failed = |error: std::io::Error| PyOSError::new_err(format!("{file}: cannot be written: {error}"));
    let folder = Path::new(file).parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // Whole or not at all.
    let mut part = tempfile::NamedTempFile::new_in(folder).map_err(failed)?;
    part.write_all(&bytes).map_err(failed)?;
    part.persist(file).map_err(|error| failed(error.error))?;
    Ok(())
}
