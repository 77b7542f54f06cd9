//! The command line `offtrack`, but for its learner.

use std::ffi::OsString;

use offtrack_commands::program;
use offtrack_evaluation::provenance;
use pyo3::prelude::*;

use crate::errors::guarded;

/// Runs the command line with these arguments, the program's name first, in a process of its own; gives the exit code.
#[pyfunction]
pub fn command(py: Python, arguments: Vec<OsString>) -> PyResult<u8> {
    provenance::set_commit(offtrack_commit::commit!());
    guarded(|| Ok(py.detach(|| program::main(&arguments))))
}
