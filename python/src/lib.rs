//! The native part of `offtrack_sim`: a batch of trucks as a Python class.
//!
//! Only what must be fast or what needs the simulator is here. Spaces, infos and the classes of Gymnasium are Python.

mod actions; // arrays of actions
mod arrays; // arrays of numpy as they come
mod batch; // the class Batch
mod command; // the command line
mod errors; // errors of Rust as exceptions of Python
mod evaluation; // episodes driven and counted
mod geometry; // routes, kerbs and vehicles as arrays
mod infos; // infos of episodes that ended
mod layout; // columns as numpy sees them
mod observer; // the class Observer
mod observed; // observations with the benchmark's extras
mod policy; // the class Network
mod pool; // threads that survive a fork
mod worlds; // scenarios, read and baked once

use pyo3::prelude::*;

#[pymodule]
fn _offtrack(module: &Bound<PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("ScenarioError", module.py().get_type::<errors::ScenarioError>())?;
    module.add_class::<batch::Batch>()?;
    module.add_class::<observer::Observer>()?;
    module.add_class::<policy::Network>()?;
    module.add_class::<policy::Driver>()?;
    module.add_function(wrap_pyfunction!(command::command, module)?)?;
    module.add_function(wrap_pyfunction!(policy::policy_names, module)?)?;
    module.add_function(wrap_pyfunction!(policy::write_policy, module)?)?;
    module.add_function(wrap_pyfunction!(evaluation::drive, module)?)?;
    module.add_function(wrap_pyfunction!(evaluation::interval_over_routes, module)?)?;
    module.add_function(wrap_pyfunction!(evaluation::wilson, module)?)?;
    module.add_function(wrap_pyfunction!(layout::column_layouts, module)?)?;
    module.add_function(wrap_pyfunction!(layout::observation_groups, module)?)?;
    module.add_function(wrap_pyfunction!(layout::extra_groups, module)?)?;
    module.add_function(wrap_pyfunction!(layout::vehicle_groups, module)?)?;
    module.add_function(wrap_pyfunction!(layout::end_codes, module)?)?;
    module.add_function(wrap_pyfunction!(worlds::scenario_files, module)?)?;
    module.add_function(wrap_pyfunction!(worlds::scenario_keys, module)?)?;
    module.add_function(wrap_pyfunction!(worlds::scenario_names, module)?)?;
    module.add_function(wrap_pyfunction!(worlds::scenario_of_keys, module)?)?;
    module.add_function(wrap_pyfunction!(worlds::scenario_text, module)?)?;
    Ok(())
}
