//! Policies: networks that drive, read from files or shipped, and written for networks that were trained in Python.

mod driver; // the class Driver
mod written; // networks trained in Python, as files

use std::path::Path;
use std::sync::Mutex;

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use offtrack::layout::{N_AROUND, N_EXTRAS, N_VALUES, ObservationLayout};
use offtrack_policy::{Error, Head, Policy};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::errors::guarded;
use crate::pool::Pool;
use crate::{actions, observed};
pub use driver::Driver;
pub use written::write_policy;

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

    /// Whether it observes other vehicles behind these.
    #[getter]
    fn vehicles(&self) -> bool {
        self.policy.reads_vehicles()
    }

    #[getter]
    fn action_table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        actions::table(py, &self.policy.actions)
    }

    /// Names of the values that it reads, none where it reads all.
    #[getter]
    fn values(&self) -> Option<&[String]> {
        self.policy.values.as_ref().map(offtrack_policy::Selection::names)
    }

    /// Number of steps that it sees at once.
    #[getter]
    fn frames(&self) -> usize {
        self.policy.frames.n
    }

    /// Whether what it does depends on earlier observations.
    #[getter]
    fn has_memory(&self) -> bool {
        self.policy.has_memory()
    }

    /// What its outputs are, by the name that policy files have for it.
    #[getter]
    fn head(&self) -> &'static str {
        self.policy.head.name()
    }

    fn logits<'py>(&self, py: Python<'py>, observations: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        guarded(|| {
            self.check_no_memory()?;
            let Split { values, extras, around } = split(&self.policy, observations)?;
            let logits = self.run(py, || self.policy.logits_among(&values, &extras, &around))?;
            PyArray1::from_vec(py, logits).reshape([values.len(), self.policy.n_outputs()])
        })
    }

    /// Actions, `[n]`, or commands, `[n, n_commands]`.
    fn act<'py>(&self, py: Python<'py>, observations: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        guarded(|| {
            self.check_no_memory()?;
            let Split { values, extras, around } = split(&self.policy, observations)?;
            let outputs = self.run(py, || self.policy.logits_among(&values, &extras, &around))?;
            chosen(py, &self.policy, outputs)
        })
    }

    /// Its network as arrays, by the fields of `offtrack_sim.export.Network`.
    fn parts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        guarded(|| written::parts(py, &self.policy))
    }

    /// The policy with a memory for each of `n` trucks.
    fn driver(&self, n: usize) -> PyResult<Driver> {
        guarded(|| Driver::of(&self.policy, n))
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

    fn check_no_memory(&self) -> PyResult<()> {
        if !self.policy.has_memory() {
            return Ok(());
        }
        Err(PyValueError::new_err(format!(
            "{}: remembers earlier observations; policy.driver(n) keeps them for n trucks, and its act drives",
            self.policy.name
        )))
    }
}

/// What a policy does by its outputs: actions, `[n]`, or commands, `[n, n_commands]`.
fn chosen<'py>(py: Python<'py>, policy: &Policy, outputs: Vec<f32>) -> PyResult<Bound<'py, PyAny>> {
    match policy.head {
        Head::Levels => {
            let actions = offtrack_policy::greedy(&outputs, policy.actions.len());
            Ok(PyArray1::from_iter(py, actions.into_iter().map(i64::from)).into_any())
        }
        Head::Continuous { .. } => {
            let (n, n_commands) = (outputs.len() / policy.n_outputs(), policy.n_outputs());
            Ok(PyArray1::from_vec(py, policy.head.commands(outputs)).reshape([n, n_commands])?.into_any())
        }
    }
}

/// An array of observations, `[n, n_values]`: the 69 values and, where the policy observes them, extras and what is
/// observed of other vehicles. A policy that names its values takes those of any benchmark that observes them.
fn split(policy: &Policy, observations: &Bound<PyAny>) -> PyResult<Split> {
    let least = policy.observation_layout();
    let n_least = least.n_values();
    let needed =
        || PyTypeError::new_err(format!("observations: a numpy array of float32 and shape (n, {n_least}) is needed"));
    let array: PyReadonlyArray2<f32> = observations.extract().map_err(|_| needed())?;
    let n_values = array.shape()[1];
    let fits = |given: ObservationLayout| match policy.values {
        None => given == least,
        Some(_) => least.n_extras <= given.n_extras && least.has_vehicles <= given.has_vehicles,
    };
    let Some(given) = ObservationLayout::of_width(n_values).filter(|&given| fits(given)) else {
        let extras = observed::described(least.extras().iter().map(|extra| extra.name));
        let around = if least.has_vehicles { ", those of other vehicles last" } else { "" };
        return Err(PyValueError::new_err(format!(
            "observations: {n_values} values each; {n_least} are needed{extras}{around}"
        )));
    };
    let values = array.as_slice().map_err(|_| needed())?;
    if let Some(at) = values.iter().position(|value| !value.is_finite()) {
        let (row, column, value) = (at / n_values, at % n_values, values[at]);
        return Err(PyValueError::new_err(format!(
            "observations[{row}, {column}]: {value}; every value must be finite"
        )));
    }
    let mut split = Split::default();
    for row in values.chunks_exact(n_values) {
        let (values, beside) = row.split_at(N_VALUES);
        let (extras, around) = beside.split_at(given.n_extras);
        split.values.push(std::array::from_fn(|index| values[index]));
        split.extras.push(std::array::from_fn(|index| extras.get(index).copied().unwrap_or_default()));
        if given.has_vehicles {
            split.around.push(std::array::from_fn(|index| around[index]));
        }
    }
    Ok(split)
}

/// Values of observations, what stands beside them, and other vehicles.
#[derive(Default)]
struct Split {
    values: Vec<[f32; N_VALUES]>,
    extras: Vec<[f32; N_EXTRAS]>,
    /// Empty where none are observed.
    around: Vec<[f32; N_AROUND]>,
}

fn refused(error: Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Names of the policies that come with the package.
#[pyfunction]
pub fn policy_names() -> Vec<&'static str> {
    Policy::shipped_names().to_vec()
}
