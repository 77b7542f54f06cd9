//! Arrays of actions: integers of any width, checked as they were given.

use numpy::{Element, PyReadonlyArray1};
use offtrack::layout::Action;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// The actions of a step, `[n_envs]`.
///
/// # Errors
///
/// `TypeError` for anything but a one-dimensional numpy array of integers, `ValueError` for another length or an action
/// outside the table.
pub fn of_array(actions: &Bound<PyAny>, n_envs: usize, table: &[Action]) -> PyResult<Vec<u32>> {
    let given = of_type::<i64>(actions)
        .or_else(|| of_type::<i32>(actions))
        .or_else(|| of_type::<u32>(actions))
        .or_else(|| of_type::<u8>(actions))
        .or_else(|| of_type::<u64>(actions))
        .or_else(|| of_type::<i16>(actions))
        .or_else(|| of_type::<u16>(actions))
        .or_else(|| of_type::<i8>(actions));
    let Some(given) = given else {
        return Err(PyTypeError::new_err(format!(
            "actions: {}; a numpy array of integers of shape ({n_envs},) is needed",
            described(actions)
        )));
    };
    if given.len() != n_envs {
        return Err(PyValueError::new_err(format!("actions: {} of them; {n_envs} are needed, one a truck", given.len())));
    }
    let limit = table.len();
    let known = |(env, action): (usize, i128)| match usize::try_from(action) {
        Ok(index) if index < limit => Ok(index as u32),
        _ => Err(PyValueError::new_err(format!("actions[{env}]: {action}; must lie in 0..{limit}"))),
    };
    given.into_iter().enumerate().map(known).collect()
}

fn of_type<T: Element + Copy + Into<i128>>(actions: &Bound<PyAny>) -> Option<Vec<i128>> {
    let array = actions.extract::<PyReadonlyArray1<T>>().ok()?;
    Some(array.as_array().iter().map(|&action| action.into()).collect())
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
