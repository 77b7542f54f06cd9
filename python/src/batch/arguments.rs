//! What Python gives a batch by name, and arrays that it fills.

use numpy::{BorrowError, Element, PyArray1, PyArrayMethods, PyReadwriteArray1, PyUntypedArrayMethods};
use offtrack::layout::Column;
use offtrack::layout::shared::Named;
use offtrack::simulator::{Autoreset, Engine};
use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;

/// The device that is none.
pub(super) const CPU: &str = "cpu";

pub(super) fn column_of(name: &str) -> PyResult<Column> {
    Column::named(name).ok_or_else(|| {
        let known: Vec<&str> = Column::ALL.iter().map(|column| column.name()).collect();
        PyValueError::new_err(format!("column: {name:?}; must be one of {}", known.join(", ")))
    })
}

/// The names of `gymnasium.vector.AutoresetMode`, in lower case.
const MODES: [(&str, Autoreset); 3] =
    [("next_step", Autoreset::NextStep), ("same_step", Autoreset::SameStep), ("disabled", Autoreset::Disabled)];

pub(super) fn autoreset_of(name: &str) -> PyResult<Autoreset> {
    let found = MODES.iter().find(|(known, _)| *known == name);
    found.map(|(_, mode)| *mode).ok_or_else(|| {
        PyValueError::new_err(format!("autoreset: {name:?}; must be one of {}", MODES.map(|(name, _)| name).join(", ")))
    })
}

pub(super) fn name_of(autoreset: Autoreset) -> &'static str {
    MODES.iter().find(|(_, mode)| *mode == autoreset).map_or("", |(name, _)| name)
}

/// The engine that `device` names, and the name that it goes by.
pub fn engine_of(device: &str) -> PyResult<(Engine, String)> {
    if device == CPU {
        return Ok((Engine::Cpu, CPU.to_owned()));
    }
    #[cfg(feature = "gpu")]
    {
        use offtrack::gpu;

        let adapter = (device != "gpu").then_some(device);
        let opened = gpu::Device::open(adapter).map_err(|error| PyRuntimeError::new_err(format!("device: {error}")))?;
        let name = opened.name();
        Ok((Engine::Gpu { device: opened, columns: gpu::Columns::new() }, name))
    }
    #[cfg(not(feature = "gpu"))]
    Err(PyRuntimeError::new_err(format!(
        "device: {device:?}; this build has only \"cpu\": it was made without the feature gpu"
    )))
}

/// An output array of the caller.
pub(super) fn writable<'py, T: Element>(
    array: &Bound<'py, PyAny>,
    name: &str,
    kind: &str,
    n_envs: usize,
) -> PyResult<PyReadwriteArray1<'py, T>> {
    let shape = format!("{kind} of shape ({n_envs},)");
    let array = array.cast::<PyArray1<T>>().map_err(|_| unfit(name, &shape))?;
    let array = array.try_readwrite().map_err(|error| match error {
        BorrowError::AlreadyBorrowed => {
            PyValueError::new_err(format!("{name}: shares memory with another array of the call; each needs its own"))
        }
        _ => unfit(name, &shape),
    })?;
    if array.len() == n_envs { Ok(array) } else { Err(unfit(name, &shape)) }
}

pub(super) fn unfit(name: &str, needed: &str) -> PyErr {
    PyTypeError::new_err(format!("{name}: must be a writable, contiguous numpy array, {needed}"))
}
