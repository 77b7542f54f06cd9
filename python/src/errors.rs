//! Errors of Rust as exceptions of Python.

use std::panic::{AssertUnwindSafe, catch_unwind};

use offtrack::files::reader;
use offtrack::simulator::Error;
use pyo3::create_exception;
use pyo3::exceptions::{PyIndexError, PyMemoryError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

create_exception!(
    offtrack_sim,
    ScenarioError,
    PyValueError,
    "A scenario, roundabout or vehicle file that cannot be read or makes no sense: the message names file, key and \
     value."
);

/// Does `work`. A panic in it is a bug on this side of the border: it becomes a `RuntimeError` with the panic's
/// message, which a caller's `except Exception` catches, as it does not PyO3's `PanicException`.
///
/// Nothing that `work` had changed is looked at afterwards: a batch whose lock it held is poisoned and says so.
pub fn guarded<T>(work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
        let message = offtrack::files::reader::shortened(text.unwrap_or("no message"), LONGEST_MESSAGE);
        Err(PyRuntimeError::new_err(format!("a bug of offtrack_sim: {message}")))
    })
}

/// Most characters of a panic's message.
const LONGEST_MESSAGE: usize = 600;

/// The entry of a list with an index that the caller gave under some name.
pub fn at<'a, T>(name: &str, list: &'a [T], index: usize) -> PyResult<&'a T> {
    let outside = || PyIndexError::new_err(format!("{name}: {index}; there are 0..{}", list.len() - 1));
    list.get(index).ok_or_else(outside)
}

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
        Error::Gpu(_) => PyRuntimeError::new_err(message),
        _ => PyValueError::new_err(message),
    }
}

/// `gymnasium.error.ResetNeeded`.
pub fn reset_needed(py: Python, message: &str) -> PyErr {
    let exception = py.import("gymnasium.error").and_then(|module| module.getattr("ResetNeeded")?.call1((message,)));
    exception.map_or_else(|error| error, PyErr::from_value)
}
