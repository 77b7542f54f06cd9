//! Errors of Rust as exceptions of Python.

use offtrack::reader;
use offtrack::simulator::Error;
use pyo3::create_exception;
use pyo3::exceptions::{PyMemoryError, PyValueError};
use pyo3::prelude::*;

create_exception!(
    offtrack_sim,
    ScenarioError,
    PyValueError,
    "A scenario, roundabout or vehicle file that cannot be read or makes no sense: the message names file, key and value."
);

/// An exception for a file that was refused. A name that is not known is a plain `ValueError`.
pub fn of_reader(error: &reader::Error) -> PyErr {
    match error {
        reader::Error::UnknownName { .. } => PyValueError::new_err(error.to_string()),
        _ => ScenarioError::new_err(error.to_string()),
    }
}

/// An exception for a batch that was refused or a device that failed.
pub fn of_simulator(error: &Error) -> PyErr {
    // Gymnasium's name for it.
    let message = error.to_string();
    let message = message.strip_prefix("n_envs:").map_or(message.clone(), |rest| format!("num_envs:{rest}"));
    match error {
        Error::BatchTooLarge { .. } => PyMemoryError::new_err(message),
        #[cfg(feature = "gpu")]
        Error::Gpu(offtrack::gpu::Error::TooManyTrucks { .. } | offtrack::gpu::Error::WorldTooLarge { .. }) => {
            PyMemoryError::new_err(message)
        }
        #[cfg(feature = "gpu")]
        Error::Gpu(_) => pyo3::exceptions::PyRuntimeError::new_err(message),
        _ => PyValueError::new_err(message),
    }
}

/// `gymnasium.error.ResetNeeded`.
pub fn reset_needed(py: Python, message: &str) -> PyErr {
    let exception = py.import("gymnasium.error").and_then(|module| module.getattr("ResetNeeded")?.call1((message,)));
    exception.map_or_else(|error| error, PyErr::from_value)
}
