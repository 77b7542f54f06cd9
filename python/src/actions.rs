//! Arrays of actions: integers or, where actions are continuous, numbers, of any width and checked as they were given.

use std::fmt::Display;

use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use offtrack::layout::{Action, Command};
use offtrack::simulator::Actions;
use offtrack::world::World;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::arrays::aligned;

/// Steer angle and speed of each action, or of commands of -1 and of 1, `[n_actions, 2]`.
pub fn table<'py>(py: Python<'py>, actions: &[Action]) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let rows: Vec<f32> = actions.iter().flat_map(|action| [action.steering, action.speed]).collect();
    PyArray1::from_vec(py, rows).reshape([actions.len(), 2])
}

/// The actions of a step, `[n_envs]`, or where the world's are continuous its commands, `[n_envs, n_commands]`.
///
/// # Errors
///
/// `TypeError` for anything but a numpy array of integers or of numbers, of one dimension or of two; `ValueError` for
/// another length, an action outside the table, and a number outside -1..1.
pub fn of_array(actions: &Bound<PyAny>, n_envs: usize, world: &World) -> PyResult<Actions> {
    // What is masked is still there, below.
    if actions.get_type().name()? == "MaskedArray" {
        return Err(PyTypeError::new_err("actions: MaskedArray; a plain array is needed, as of its `filled`"));
    }
    match world.n_commands() {
        0 => indices(actions, n_envs, world.params.n_actions).map(Actions::Indices),
        n_commands => commands(actions, n_envs, n_commands).map(Actions::Commands),
    }
}

/// The commands of a step.
fn commands(actions: &Bound<PyAny>, n_envs: usize, n_commands: usize) -> PyResult<Vec<Command>> {
    let of = OfCommands { n_envs, n_commands };
    let given = of.numbers::<f32>(actions).or_else(|| of.numbers::<f64>(actions));
    given.unwrap_or_else(|| {
        let needed = format!("a numpy array of float32 of shape ({n_envs}, {n_commands}) is needed");
        Err(PyTypeError::new_err(format!("actions: {}; {needed}", described(actions))))
    })
}

/// What commands must be.
struct OfCommands {
    n_envs: usize,
    n_commands: usize,
}

impl OfCommands {
    /// The commands of an array of this type of numbers, None for any other array.
    fn numbers<T>(&self, actions: &Bound<PyAny>) -> Option<PyResult<Vec<Command>>>
    where
        T: Element + Copy + Display + Into<f64>,
    {
        let &OfCommands { n_envs, n_commands } = self;
        let array = actions.extract::<PyReadonlyArray2<T>>().ok()?;
        // Before anything is copied: a broadcast array may be longer than any memory.
        if array.shape() != [n_envs, n_commands] {
            let &[rows, columns] = array.shape() else { return None };
            return Some(Err(PyValueError::new_err(format!(
                "actions: shape ({rows}, {columns}); ({n_envs}, {n_commands}) is needed, a row a truck"
            ))));
        }
        let array = match aligned(array) {
            Ok(array) => array,
            Err(error) => return Some(Err(error)),
        };
        let mut commands = vec![Command::default(); n_envs];
        for ((env, index), &given) in array.as_array().indexed_iter() {
            let value: f64 = given.into();
            if !(-1.0..=1.0).contains(&value) {
                let message = format!("actions[{env}, {index}]: {given}; must lie in -1..1");
                return Some(Err(PyValueError::new_err(message)));
            }
            let Command { steering, speed } = &mut commands[env];
            *(if index == 0 { steering } else { speed }) = value as f32;
        }
        Some(Ok(commands))
    }
}

/// The indices of a step.
fn indices(actions: &Bound<PyAny>, n_envs: usize, limit: u32) -> PyResult<Vec<u32>> {
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

/// What indices must be.
struct Of {
    n_envs: usize,
    limit: u32,
}

impl Of {
    /// The indices of an array of this type of numbers, None for any other array.
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
            _ => Err(PyValueError::new_err(format!("actions[{env}]: {action}; must lie in 0..{}", limit - 1))),
        };
        Some(aligned(array).and_then(|array| array.as_array().iter().enumerate().map(known).collect()))
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
