//! Evaluations: episodes are driven and counted as on the command line, by a policy or by a function of Python.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use offtrack::layout::{Ended, Start};
use offtrack::physics::drawn_start;
use offtrack::simulator::{Actions, Error};
use offtrack::world::World;
use offtrack_evaluation::episode::Episode;
use offtrack_evaluation::episodes::Episodes;
use offtrack_evaluation::figures::Figures;
use offtrack_evaluation::interval::Cells;
use offtrack_evaluation::placed::placed;
use offtrack_evaluation::policies::Controller;
use offtrack_evaluation::report;
use offtrack_policy::Choice;
use pyo3::exceptions::{PyMemoryError, PyValueError};
use pyo3::prelude::*;

use crate::arrays::aligned;
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

/// Drives `episodes` episodes on each route of a batch, on a device, and gives their figures, route by route: a list of
/// names and columns.
///
/// `policy` is a `Network`, or a function from the observations of the trucks that drive, `[n, n_values]`, to their
/// actions, `[n]` or `[n, n_commands]`; with `begins` from those of all trucks and whether an episode of each begins,
/// `[n]`. It is called on the caller's own thread; the GIL is released while trucks are stepped.
#[pyfunction]
pub fn drive<'py>(
    py: Python<'py>,
    batch: &Bound<'py, Batch>,
    policy: &Bound<'py, PyAny>,
    episodes: usize,
    seed: u32,
    device: &str,
    begins: bool,
) -> PyResult<Vec<Column<'py>>> {
    guarded(|| {
        let place = batch.get().place();
        let (world, n_values) = (&place.world, batch.get().n_values());
        let (engine, _) = engine_of(device)?;
        let mut pool = Pool::new(0);
        let network = policy.cast::<Network>().ok().map(|network| network.get().policy().clone());
        let network = network.map(|network| placed(network, &engine, world, Choice::Best)).transpose();
        let mut network = network.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let begun = pool.run(py, || Episodes::begin(engine, world.clone(), &place.routes, episodes, seed))?;
        let begun = begun.map_err(|error| match error {
            Error::BatchTooLarge { fitting, .. } => {
                let n_routes = place.routes.len();
                let most = fitting / n_routes as u64;
                let says =
                    format!("episodes: {episodes} on each of {n_routes} routes; memory is free for {most} on each");
                PyMemoryError::new_err(says)
            }
            error => errors::of_simulator(&error),
        })?;
        let figures = Figures::begin(&place.scenario, world, &place.routes, episodes, begun.simulator());
        let mut figures = figures.map_err(|error| errors::of_simulator(&error))?;
        let n_envs = begun.simulator().n_envs();
        let mut function = Function { function: policy, n_values, begins: begins.then_some(true) };
        let driven = begun.drive(|simulator| {
            py.check_signals()?;
            let mut chooser = match &mut network {
                Some(network) => Chooser::Network(network.as_mut()),
                None => Chooser::Chosen(function.choose(simulator.batch(), world)?),
            };
            pool.run(py, || {
                match &mut chooser {
                    Chooser::Network(network) => network.step(simulator)?,
                    Chooser::Chosen(actions) => simulator.step_any(actions)?,
                }
                figures.follow(simulator)
            })??;
            Ok::<(), Raised>(())
        });
        driven.map_err(|Raised(exception)| exception)?;
        let starts = (0..n_envs).map(|env| drawn_start(&world.params, seed, env as u32, 0));
        columns(py, &starts.collect::<Vec<Start>>(), &figures.finish())
    })
}

/// A column's name and its array, `[episodes]`.
type Column<'py> = (&'static str, Bound<'py, PyAny>);

/// A column's name, and its value of a row.
type Field<Row, Value> = (&'static str, fn(&Row) -> Value);

/// The figures of episodes as columns.
fn columns<'py>(py: Python<'py>, starts: &[Start], episodes: &[Episode]) -> PyResult<Vec<Column<'py>>> {
    let of_starts: [Field<Start, f32>; 4] = [
        ("start_offset", |start| start.offset),
        ("start_heading", |start| start.heading),
        ("start_speed", |start| start.speed),
        ("start_along", |start| start.along),
    ];
    let counts: [Field<Episode, i64>; 3] = [
        ("vehicle", |episode| episode.last.vehicle.into()),
        ("ended", |episode| episode.ended as i64),
        ("steps", |episode| episode.steps.into()),
    ];
    let of_episodes: [Field<Episode, f64>; 14] = [
        ("reward", |episode| episode.reward),
        ("lane_distance_mean", |episode| episode.lane_distance_mean),
        ("lane_distance_max", |episode| episode.lane_distance_max),
        ("outside_lane", |episode| episode.outside_lane),
        ("tractor_clearance_min", |episode| episode.tractor_clearance_min),
        ("trailer_clearance_min", |episode| episode.trailer_clearance_min),
        ("load_transfer_ratio_peak", |episode| episode.load_transfer_ratio_peak),
        ("articulation_peak", |episode| episode.articulation_peak),
        ("off_tracking_peak", |episode| episode.off_tracking_peak),
        ("on_apron", |episode| episode.on_apron.unwrap_or(0.0)),
        ("term_waypoints", |episode| episode.terms.waypoints),
        ("term_lane_distance", |episode| episode.terms.lane_distance),
        ("term_clearance", |episode| episode.terms.clearance),
        ("term_failure", |episode| episode.terms.failure),
    ];
    let mut columns: Vec<Column> = Vec::new();
    for (name, value) in of_starts {
        columns.push((name, PyArray1::from_iter(py, starts.iter().map(value)).into_any()));
    }
    for (name, value) in counts {
        columns.push((name, PyArray1::from_iter(py, episodes.iter().map(value)).into_any()));
    }
    for (name, value) in of_episodes {
        columns.push((name, PyArray1::from_iter(py, episodes.iter().map(value)).into_any()));
    }
    Ok(columns)
}

/// A function of Python that chooses actions.
struct Function<'a, 'py> {
    function: &'a Bound<'py, PyAny>,
    n_values: usize,
    /// Whether every episode begins; `None` for a function that is not told.
    begins: Option<bool>,
}

/// What makes a step.
enum Chooser<'a> {
    Network(&'a mut dyn Controller),
    /// The actions that a function of Python chose, which it does before the GIL is released.
    Chosen(Actions),
}

impl Function<'_, '_> {
    /// The actions that the function chooses for the trucks that drive, and any for the others.
    fn choose(&mut self, batch: &offtrack::simulator::Batch, world: &World) -> PyResult<Actions> {
        let py = self.function.py();
        let is_asked = |&env: &usize| self.begins.is_some() || batch.ended[env] == Ended::Running as u32;
        let asked: Vec<usize> = (0..batch.n_envs()).filter(is_asked).collect();
        let observed = Observed::of(batch, world.observation_layout());
        let rows: Vec<f32> = asked.iter().flat_map(|&env| observed.row(env).into_iter().take(self.n_values)).collect();
        let rows = PyArray1::from_vec(py, rows).reshape([asked.len(), self.n_values])?;
        let given = match self.begins {
            None => self.function.call1((rows,))?,
            Some(begins) => self.function.call1((rows, PyArray1::from_vec(py, vec![begins; asked.len()])))?,
        };
        // One episode a truck: after the first step none begins.
        self.begins = self.begins.map(|_| false);
        Ok(actions::of_array(&given, asked.len(), world)?.spread(&asked, batch.n_envs()))
    }
}

/// Wilson's 95 % interval of the fraction `successes / trials`; (0, 1) without trials.
#[pyfunction]
pub fn wilson(successes: usize, trials: usize) -> PyResult<(f64, f64)> {
    if trials < successes {
        return Err(PyValueError::new_err(format!("successes: {successes}; there are {trials} trials")));
    }
    Ok(report::wilson(successes, trials))
}

/// The 95 % interval over routes of the mean of an episode's `values`, one for each of `routes`; None on one route.
#[pyfunction]
pub fn interval_over_routes(
    py: Python,
    routes: PyReadonlyArray1<u32>,
    values: PyReadonlyArray1<f64>,
) -> PyResult<Option<(f64, f64)>> {
    guarded(|| {
        let (routes, values) = (aligned(routes)?, aligned(values)?);
        if routes.len()? != values.len()? {
            let message =
                format!("values: {} of them; routes has {}, and each is of one", values.len()?, routes.len()?);
            return Err(PyValueError::new_err(message));
        }
        let episodes = routes.as_array().into_iter().copied().zip(values.as_array().into_iter().copied());
        let cells = Cells::of_routes(episodes);
        Pool::new(0).run(py, || cells.interval())
    })
}
