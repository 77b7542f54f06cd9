//! Trucks that something else drives: observers as Python sees them, many at once.

mod rows; // poses and telemetry as arrays

use std::sync::{Mutex, MutexGuard, TryLockError};

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use offtrack::layout::Ended;
use offtrack::observer::{self, State};
use offtrack::scenario::Split;
use offtrack::simulator::{Actions, Error};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::aligned;
use crate::errors::guarded;
use crate::pool::Pool;
use crate::worlds::{Asked, Given, Place};
use crate::{actions, errors, geometry};
use geometry::Points;
use rows::{Rows, Seen, pose_of, telemetry_of};

/// One number for each truck.
type Numbers<'py> = Bound<'py, PyArray1<f32>>;
/// Steps, next waypoint, code of the end, and integral of the speed control of an observer.
type GivenState = (u32, Option<u32>, u32, f32);

/// Trucks that something else drives, in one world.
///
/// The class `offtrack_sim.Observer` extends it and documents it.
#[pyclass(subclass, frozen, module = "offtrack_sim._offtrack")]
pub struct Observer {
    place: Place,
    n_trucks: usize,
    held: Mutex<Held>,
}

/// What an observation changes.
struct Held {
    observers: Vec<observer::Observer>,
    pool: Pool,
}

#[pymethods]
impl Observer {
    /// A truck for each route: `vehicles` are pairs of vehicle and load as their files have them, `rows` indices into
    /// the benchmark's table of vehicles; without either each truck is the first vehicle.
    #[new]
    #[pyo3(signature = (scenario, routes, *, vehicles, rows, num_threads))]
    fn new(
        py: Python,
        scenario: Given,
        routes: Vec<String>,
        vehicles: Option<Vec<(String, String)>>,
        rows: Option<Vec<u32>>,
        num_threads: usize,
    ) -> PyResult<Observer> {
        guarded(|| {
            let mut names = routes.clone();
            names.sort_unstable();
            names.dedup();
            let split = Split::Test.name();
            let asked = Asked { scenario: &scenario, split, routes: Some(&names), max_episode_steps: None };
            let mut pool = Pool::new(num_threads);
            let find = if rows.is_some() { Place::find } else { Place::typical };
            let place = pool.run_until_signal(py, |stop| find(&asked, stop))??;
            let observer = |(truck, name): (usize, &String)| {
                let vehicle = match (&vehicles, &rows) {
                    (Some(pairs), _) => class_row(&place, &pairs[truck])?,
                    (None, Some(rows)) => rows[truck],
                    (None, None) => 0,
                };
                let made = observer::Observer::new(place.world.clone(), route_of(&place, "routes", name)?, vehicle);
                made.map_err(|error| errors::of_simulator(&error))
            };
            let observers = routes.iter().enumerate().map(observer).collect::<PyResult<Vec<_>>>()?;
            Ok(Observer { n_trucks: observers.len(), place, held: Mutex::new(Held { observers, pool }) })
        })
    }

    #[getter]
    fn num_trucks(&self) -> usize {
        self.n_trucks
    }

    #[getter]
    fn scenario(&self) -> &str {
        &self.place.scenario.name
    }

    #[getter]
    fn step_seconds(&self) -> f64 {
        self.place.scenario.step
    }

    #[getter]
    fn extras(&self) -> Vec<&'static str> {
        self.place.world.observation_layout().extra_names()
    }

    #[getter]
    fn n_values(&self) -> usize {
        rows::layout(&self.place.world).n_values()
    }

    #[getter]
    fn classes(&self) -> Vec<(&str, &str)> {
        self.place.world.classes.iter().map(|class| (class.vehicle.as_str(), class.load.as_str())).collect()
    }

    /// Numbers of a command; 0 where an action is an index.
    #[getter]
    fn n_commands(&self) -> usize {
        self.place.world.n_commands()
    }

    #[getter]
    fn action_table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        actions::table(py, &self.place.world.actions)
    }

    /// Begins an episode of each of these trucks at a pose, `[k, 5]`, near a waypoint, `[k]`, where that is known.
    fn begin_at<'py>(
        &self,
        py: Python<'py>,
        trucks: Option<Vec<usize>>,
        poses: PyReadonlyArray2<f64>,
        waypoints: Vec<u32>,
    ) -> PyResult<Seen<'py>> {
        guarded(|| self.look(py, trucks.as_deref(), poses, None, &waypoints))
    }

    /// Observes each of these trucks at a pose, `[k, 5]`, with its telemetry, `[k, 8]`.
    fn observe_at<'py>(
        &self,
        py: Python<'py>,
        trucks: Option<Vec<usize>>,
        poses: PyReadonlyArray2<f64>,
        telemetry: PyReadonlyArray2<f32>,
    ) -> PyResult<Seen<'py>> {
        guarded(|| self.look(py, trucks.as_deref(), poses, Some(telemetry), &[]))
    }

    /// Steer angle and target speed that each truck's action asks for, after its last target speed.
    fn commands<'py>(
        &self,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
        target_speed: PyReadonlyArray1<f32>,
    ) -> PyResult<(Numbers<'py>, Numbers<'py>)> {
        guarded(|| {
            let held = self.held()?;
            let actions = actions::of_array(actions, self.n_trucks, &self.place.world)?;
            let target_speed = aligned(target_speed)?;
            let targets = target_speed.as_array();
            let command = |(truck, observer): (usize, &observer::Observer)| {
                let asked = match &actions {
                    Actions::Indices(indices) => observer.command(indices[truck], targets[truck]),
                    Actions::Commands(commands) => observer.commanded(&commands[truck], targets[truck]),
                };
                asked.map_err(|error| errors::of_simulator(&error))
            };
            let commands = held.observers.iter().enumerate().map(command).collect::<PyResult<Vec<_>>>()?;
            Ok((
                PyArray1::from_iter(py, commands.iter().map(|command| command.steering)),
                PyArray1::from_iter(py, commands.iter().map(|command| command.speed)),
            ))
        })
    }

    /// Acceleration by which each truck's speed control approaches a target from a speed.
    fn accelerations<'py>(
        &self,
        py: Python<'py>,
        speed: PyReadonlyArray1<f32>,
        target: PyReadonlyArray1<f32>,
    ) -> PyResult<Numbers<'py>> {
        guarded(|| {
            let (speed, target) = (aligned(speed)?, aligned(target)?);
            let (speed, target) = (speed.as_array(), target.as_array());
            let mut held = self.held()?;
            // All or none of the controllers go on.
            let before: Vec<State> = held.observers.iter().map(observer::Observer::state).collect();
            let mut asked = Vec::with_capacity(self.n_trucks);
            for truck in 0..self.n_trucks {
                match held.observers[truck].speed_control(speed[truck], target[truck]) {
                    Ok(acceleration) => asked.push(acceleration),
                    Err(error) => {
                        restore(&mut held.observers, &before)?;
                        return Err(of_truck(truck, error));
                    }
                }
            }
            Ok(PyArray1::from_vec(py, asked))
        })
    }

    /// Origin in the map's frame, and whether the road is driven as its mirror image.
    fn frame_of(&self, route: &str) -> PyResult<((f64, f64), bool)> {
        let frame = self.place.world.frame(route_of(&self.place, "route", route)?);
        Ok(((frame.origin.x, frame.origin.y), frame.mirrored))
    }

    /// Position and heading of a route's waypoints in the map's frame, `[n, 3]`.
    fn waypoints_of<'py>(&self, py: Python<'py>, route: &str) -> PyResult<Points<'py>> {
        guarded(|| {
            let observer = observer::Observer::new(self.place.world.clone(), route_of(&self.place, "route", route)?, 0)
                .map_err(|error| errors::of_simulator(&error))?;
            let rows: Vec<f64> = observer.waypoints().flat_map(|(p, heading)| [p.x, p.y, heading]).collect();
            let n = rows.len() / 3;
            PyArray1::from_vec(py, rows).reshape([n, 3])
        })
    }

    /// The kerbs around a route in the map's frame, closed lines `[n, 2]`.
    fn kerbs_of<'py>(&self, py: Python<'py>, route: &str) -> PyResult<Vec<Points<'py>>> {
        guarded(|| {
            let roundabout = self.place.world.routes[route_of(&self.place, "route", route)? as usize].roundabout;
            let scenario = &self.place.scenario;
            let lines = scenario.places[roundabout as usize].roundabout.kerb_lines(scenario.gutter);
            let rows = lines.iter().map(|line| line.iter().flat_map(|p| [p.x, p.y]).collect::<Vec<f64>>());
            rows.zip(&lines).map(|(rows, line)| PyArray1::from_vec(py, rows).reshape([line.len(), 2])).collect()
        })
    }

    /// Lengths and limits of a truck by name.
    fn dimensions_of<'py>(&self, py: Python<'py>, truck: usize) -> PyResult<Bound<'py, PyDict>> {
        guarded(|| geometry::dimensions(py, errors::at("truck", &self.held()?.observers, truck)?.rig()))
    }

    /// A number for all that the observers' benchmark is, see `Batch`.
    fn fingerprint(&self) -> PyResult<u32> {
        guarded(|| Ok(self.place.fingerprint()))
    }

    /// How far each observer has come.
    fn states(&self) -> PyResult<Vec<GivenState>> {
        let of = |observer: &observer::Observer| {
            let State { steps, waypoint, ended, speed_error_integral } = observer.state();
            (steps, waypoint, ended as u32, speed_error_integral)
        };
        Ok(self.held()?.observers.iter().map(of).collect())
    }

    /// Goes on from the states of an observer of as many trucks.
    fn restore_states(&self, states: Vec<GivenState>) -> PyResult<()> {
        guarded(|| {
            if states.len() != self.n_trucks {
                let (found, n) = (states.len(), self.n_trucks);
                return Err(PyValueError::new_err(format!("states: {found} of them; {n} are needed, one a truck")));
            }
            let of = |&(steps, waypoint, code, speed_error_integral): &GivenState| {
                let unknown = || PyValueError::new_err(format!("ended: {code}; must lie in 0..{}", Ended::ALL.len()));
                let ended = Ended::from_code(code).ok_or_else(unknown)?;
                Ok(State { steps, waypoint, ended, speed_error_integral })
            };
            restore(&mut self.held()?.observers, &states.iter().map(of).collect::<PyResult<Vec<State>>>()?)
        })
    }
}

impl Observer {
    /// The observers, unless another thread has them.
    fn held(&self) -> PyResult<MutexGuard<'_, Held>> {
        match self.held.try_lock() {
            Ok(held) => Ok(held),
            Err(TryLockError::Poisoned(_)) => Err(PyRuntimeError::new_err("this observer failed before; make another")),
            Err(TryLockError::WouldBlock) => Err(PyRuntimeError::new_err(
                "this observer is in use by another thread; give each thread an observer of its own",
            )),
        }
    }

    /// Observes these trucks, or all, or none where one's numbers are none that a truck can have. Without telemetry
    /// their episodes begin.
    fn look<'py>(
        &self,
        py: Python<'py>,
        trucks: Option<&[usize]>,
        poses: PyReadonlyArray2<f64>,
        telemetry: Option<PyReadonlyArray2<f32>>,
        waypoints: &[u32],
    ) -> PyResult<Seen<'py>> {
        let (poses, telemetry) = (aligned(poses)?, telemetry.map(aligned).transpose()?);
        let poses: Vec<_> = poses.as_array().rows().into_iter().map(pose_of).collect();
        let telemetry: Vec<_> = telemetry
            .map_or_else(Vec::new, |telemetry| telemetry.as_array().rows().into_iter().map(telemetry_of).collect());
        let rows = Rows { trucks, poses: &poses, telemetry: &telemetry, waypoints };
        let mut held = self.held()?;
        let Held { observers, pool } = &mut *held;
        rows.check(observers)?;
        let seen = if rows::is_few(poses.len()) {
            rows.observed(observers)
        } else {
            pool.run(py, || rows.observed(observers))?
        };
        let seen = seen.map_err(|error| errors::of_simulator(&error))?;
        rows::arrays(py, &seen, rows::layout(&self.place.world))
    }
}

/// Restores each observer, or none.
fn restore(observers: &mut [observer::Observer], states: &[State]) -> PyResult<()> {
    let mut restored = observers.to_vec();
    for (truck, (observer, state)) in restored.iter_mut().zip(states).enumerate() {
        observer.restore(state).map_err(|error| of_truck(truck, error))?;
    }
    observers.clone_from_slice(&restored);
    Ok(())
}

/// The exception for a number of one of many trucks: its place has the truck's index first.
fn of_truck(truck: usize, error: Error) -> PyErr {
    let indexed = |name: &str| match name.split_once('[') {
        // Arguments of their own here.
        Some(("load_transfer_ratios", "0]")) => format!("tractor_load_transfer_ratio[{truck}]"),
        Some(("load_transfer_ratios", _)) => format!("trailer_load_transfer_ratio[{truck}]"),
        Some((array, rest)) => format!("{array}[{truck}, {rest}"),
        None => format!("{name}[{truck}]"),
    };
    let error = match error {
        Error::ImpossibleValue { place, found, expected } => {
            Error::ImpossibleValue { place: indexed(&place), found, expected }
        }
        Error::OutsideWorld { column, found, limit, .. } => Error::OutsideWorld { column, env: truck, found, limit },
        other => other,
    };
    errors::of_simulator(&error)
}

/// Index of a route by its name, which stands in this argument.
fn route_of(place: &Place, argument: &str, name: &str) -> PyResult<u32> {
    place.route(argument, name, "an observer follows one route a truck, here of")
}

/// Index of the first vehicle of a class in the world.
fn class_row(place: &Place, (vehicle, load): &(String, String)) -> PyResult<u32> {
    let world = &place.world;
    let class = world.classes.iter().position(|class| (&class.vehicle, &class.load) == (vehicle, load));
    let row = class.and_then(|class| world.rigs.iter().position(|rig| rig.class_index as usize == class));
    row.map(|row| row as u32).ok_or_else(|| {
        let known: Vec<String> =
            world.classes.iter().map(|class| format!("({:?}, {:?})", class.vehicle, class.load)).collect();
        let name = &place.scenario.name;
        PyValueError::new_err(format!("vehicles: ({vehicle:?}, {load:?}); {name} has {}", known.join(", ")))
    })
}
