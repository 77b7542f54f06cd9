//! Evaluations: episodes are driven and counted as on the command line, by a policy or by a function of Python.

use numpy::{PyArray1, PyArrayMethods};
use offtrack::layout::{Ended, N_VALUES};
use offtrack::simulator::{Actions, Error};
use offtrack::world::World;
use offtrack_evaluation::episodes::Episodes;
use offtrack_evaluation::placed::placed;
use offtrack_evaluation::report;
use offtrack_policy::Choice;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::batch::{Batch, engine_of};
use crate::errors::guarded;
use crate::observed::Observed;
use crate::policy::Network;
use crate::pool::Pool;
use crate::{actions, errors};

/// Why an evaluation ended early.
struct Raised(PyErr);

impl From<PyErr> for Raised {
    fn from(error: PyErr) -> Raised {
        Raised(error)
    }
}

impl From<Error> for Raised {
    fn from(error: Error) -> Raised {
        Raised(errors::of_simulator(&error))
    }
}

/// Drives `episodes` episodes on each route of a batch, on a device, and gives the end of each, route by route.
///
/// `policy` is a `Network`, or a function from the observations of the trucks that drive, `[n, n_values]`, to their
/// actions, `[n]` or `[n, n_commands]`. It is called on the caller's own thread; the GIL is released while trucks are stepped.
#[pyfunction]
pub fn drive<'py>(
    py: Python<'py>,
    batch: &Bound<'py, Batch>,
    policy: &Bound<'py, PyAny>,
    episodes: usize,
    seed: u32,
    device: &str,
) -> PyResult<Bound<'py, PyArray1<i64>>> {
    guarded(|| {
        let place = batch.get().place();
        let (world, n_values) = (&place.world, batch.get().n_values());
        let (engine, _) = engine_of(device)?;
        let mut pool = Pool::new(0);
        let network = policy.cast::<Network>().ok().map(|network| network.get().policy().clone());
        let network = network.map(|network| placed(network, &engine, world, Choice::Best)).transpose();
        let mut network = network.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let begun = pool.run(py, || Episodes::begin(engine, world.clone(), &place.routes, episodes, seed))?;
        let begun = begun.map_err(|error| errors::of_simulator(&error))?;
        let ended = begun.drive(|simulator| {
            py.check_signals()?;
            match &mut network {
                Some(network) => pool.run(py, || network.step(simulator))??,
                None => {
                    let actions = choose(policy, simulator.batch(), n_values, world)?;
                    pool.run(py, || simulator.step_any(&actions))??;
                }
            }
            Ok::<(), Raised>(())
        });
        let ended = ended.map_err(|Raised(exception)| exception)?;
        Ok(PyArray1::from_iter(py, ended.into_iter().map(|ended| ended as i64)))
    })
}

/// The actions that a function of Python chooses for the trucks that drive, and any for the others.
fn choose<'py>(
    function: &Bound<'py, PyAny>,
    batch: &offtrack::simulator::Batch,
    n_values: usize,
    world: &World,
) -> PyResult<Actions> {
    let driving: Vec<usize> = (0..batch.n_envs()).filter(|&env| batch.ended[env] == Ended::Running as u32).collect();
    let observed = Observed::of(batch, n_values - N_VALUES);
    let rows: Vec<f32> = driving.iter().flat_map(|&env| observed.row(env).into_iter().take(n_values)).collect();
    let rows = PyArray1::from_vec(function.py(), rows).reshape([driving.len(), n_values])?;
    let chosen = actions::of_array(&function.call1((rows,))?, driving.len(), world)?;
    Ok(chosen.spread(&driving, batch.n_envs()))
}

/// Wilson's 95 % interval of the fraction `successes / trials`.
#[pyfunction]
pub fn wilson(successes: usize, trials: usize) -> (f64, f64) {
    report::wilson(successes, trials)
}
