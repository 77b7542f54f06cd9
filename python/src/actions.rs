//! Arrays of actions: integers of any width, checked as they were given.

use std::fmt::Display;

use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyUntypedArrayMethods};
use offtrack::layout::Action;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// Steer angle and speed of each action, `[n_actions, 2]`.
pub fn table<'py>(py: Python<'py>, actions: &[Action]) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let rows: Vec<f32> = actions.iter().flat_map(|action| [action.steering, action.speed]).collect();
    PyArray1::from_vec(py, rows).reshape([actions.len(), 2])
}

/// The actions of a step, `[n_envs]`.
///
/// # Errors
///
/// `TypeError` for anything but a one-dimensional numpy array of integers, `ValueError` for another length or an action
/// outside the table.
pub fn of_array(actions: &Bound<PyAny>, n_envs: usize, table: &[Action]) -> PyResult<Vec<u32>> {
    let limit = table.len() as u32;
    let of = Of { n_envs, limit };
    let given = of
        .numbers::<i64>(actions)
        .or_else(|| of.numbers::<i32>(actions))
        .or_else(|| of.numbers::<u32>(actions))
        .or_else(|| of.numbers::<u8>(actions))
        .or_else(|| of.numbers::<u64>(actions))
        .or_else(|| of.numbers::<i16>(actions))
        .or_else(|| of.numbers::<u16>(actions))
        .or_else(|| of.numbers::<i8>(actions));
    given.unwrap_or_else(|| {
        let needed = format!("a numpy array of integers of shape ({n_envs},) is needed");
        Err(PyTypeError::new_err(format!("actions: {}; {needed}", described(actions))))
    })
}

/// What actions must be.
struct Of {
    n_envs: usize,
    limit: u32,
}

impl Of {
    /// The actions of an array of this type of numbers, None for any other array.
    fn numbers<T>(&self, actions: &Bound<PyAny>) -> Option<PyResult<Vec<u32>>>
    where
        T: Element + Copy + Display,
        u32: TryFrom<T>,
    {
        let &Of { n_envs, limit } = self;
        let array = actions.extract::<PyReadonlyArray1<T>>().ok()?;
        // Before anything is copied: a broadcast array may be longer than any memory.
        if array.len() != n_envs {
            return Some(Err(PyValueError::new_err(format!(
                "actions: {} of them; {n_envs} are needed, one a truck",
                array.len()
            ))));
        }
        let known = |(env, &action): (usize, &T)| match u32::try_from(action) {
            Ok(index) if index < limit => Ok(index),
            _ => Err(PyValueError::new_err(format!("actions[{env}]: {action}; must lie in 0..{limit}"))),
        };
        Some(array.as_array().iter().enumerate().map(known).collect())
    }
}

/// Type of a value, of an array its numbers and shape too.
fn described(value: &Bound<PyAny>) -> String {
    let of = |name: &str| value.getattr(name).and_then(|found| found.str()).map(|text| text.to_string());
    let kind = value.get_type().name().map_or_else(|_| "a value".to_owned(), |name| name.to_string());
    match (of("dtype"), of("shape")) {
        (Ok(dtype), Ok(shape)) => format!("{kind} of {dtype} and shape {shape}"),
        _ => kind,
    }
}
