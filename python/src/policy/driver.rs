//! A policy with what it remembers of several trucks.

use std::sync::Mutex;

use numpy::{PyReadonlyArray1, PyUntypedArrayMethods};
use offtrack_policy::Policy;
use pyo3::exceptions::{PyMemoryError, PyTypeError, PyValueError};
use pyo3::prelude::*;

use super::{Split, chosen, split};
use crate::errors::guarded;
use crate::pool::Pool;

/// A policy at the wheel of several trucks. The class `offtrack_sim.Driver` wraps it and documents it.
#[pyclass(frozen, module = "offtrack_sim._offtrack")]
pub struct Driver {
    n: usize,
    inner: Mutex<(offtrack_policy::Driver, Pool)>,
}

#[pymethods]
impl Driver {
    /// What it does for the trucks by what they observe, `[n, n_values]`. A truck whose `begins` is true, `[n]`, begins
    /// an episode.
    fn act<'py>(
        &self,
        py: Python<'py>,
        observations: &Bound<'py, PyAny>,
        begins: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        use pyo3::sync::MutexExt;

        guarded(|| {
            let mut inner = self.inner.lock_py_attached(py).unwrap_or_else(|poisoned| poisoned.into_inner());
            let (driver, pool) = &mut *inner;
            let Split { values, extras, around } = split(driver.policy(), observations)?;
            if values.len() != self.n {
                return Err(PyValueError::new_err(format!(
                    "observations: {} of them; {} are needed, one a truck",
                    values.len(),
                    self.n
                )));
            }
            let begins = begins.map(|begins| self.begun(begins)).transpose()?.unwrap_or_default();
            begins.into_iter().for_each(|env| driver.begin(env));
            let envs: Vec<usize> = (0..self.n).collect();
            let outputs = pool.run(py, || driver.outputs_among(&envs, &values, &extras, &around))?;
            chosen(py, driver.policy(), outputs)
        })
    }

    /// Another one that remembers the same.
    fn copied(&self, py: Python) -> Driver {
        use pyo3::sync::MutexExt;

        let inner = self.inner.lock_py_attached(py).unwrap_or_else(|poisoned| poisoned.into_inner());
        Driver { n: self.n, inner: Mutex::new((inner.0.clone(), Pool::new(0))) }
    }
}

impl Driver {
    /// The policy with a memory for each of `n` trucks.
    pub fn of(policy: &Policy, n: usize) -> PyResult<Driver> {
        if offtrack::simulator::check_size(n).is_err() {
            let message =
                format!("n: {n}; a batch of so many trucks does not fit into this machine's memory: take fewer");
            return Err(PyMemoryError::new_err(message));
        }
        let n_numbers = n.saturating_mul(policy.n_remembered());
        if Vec::<f32>::new().try_reserve_exact(n_numbers).is_err() {
            let message = format!("n: {n}; {} remembers {} numbers of each: take fewer", policy.name, n_numbers / n);
            return Err(PyMemoryError::new_err(message));
        }
        Ok(Driver { n, inner: Mutex::new((policy.clone().driver(n), Pool::new(0))) })
    }

    /// The trucks whose episodes begin.
    fn begun(&self, begins: &Bound<PyAny>) -> PyResult<Vec<usize>> {
        let needed =
            || PyTypeError::new_err(format!("begins: a numpy array of bool and shape ({},) is needed", self.n));
        let given: PyReadonlyArray1<bool> = begins.extract().map_err(|_| needed())?;
        if given.len() != self.n {
            return Err(needed());
        }
        let begun = given.as_array().iter().enumerate().filter_map(|(env, &begins)| begins.then_some(env)).collect();
        Ok(begun)
    }
}
