//! A batch of trucks: the simulator as Python sees it.

mod arguments;
mod made;
mod picture;
mod requests;
mod state;
mod stored;
mod weights;

use std::sync::Mutex;

use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray2,
    PyUntypedArrayMethods,
};
use offtrack::layout::{Column, Ended, ObservationLayout};
use offtrack::simulator::Autoreset;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::aligned;
use crate::infos::{End, Infos, Names};
use crate::observed::{Read, columns_of_observation};
use crate::worlds::{Asked, Given, Place};
use crate::{actions, errors, geometry};
pub use arguments::engine_of;
use arguments::{name_of, unfit, writable};
use errors::guarded;
use requests::GivenStart;
use state::State;
use stored::GivenEnds;

/// Observation, reward, terminated, truncated of a step.
type Step<'py> =
    (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<bool>>, Bound<'py, PyArray1<bool>>);
/// One whole number for each of some trucks.
type Indices<'py> = Bound<'py, PyArray1<i64>>;
/// Trucks whose episode ended, why, on which route, their last observations, and which vehicle they were.
type Ends<'py> = (Indices<'py>, Indices<'py>, Indices<'py>, Bound<'py, PyArray2<f32>>, Indices<'py>);

/// Many trucks in one world, stepped together.
///
/// The class `offtrack_sim.Batch` extends it and documents it.
#[pyclass(subclass, frozen, module = "offtrack_sim._offtrack")]
pub struct Batch {
    place: Place,
    names: Names,
    n_envs: usize,
    /// What each observation consists of.
    layout: ObservationLayout,
    /// What is read after a step.
    read: Vec<Column>,
    device: String,
    autoreset: Autoreset,
    state: Mutex<State>,
}

#[pymethods]
impl Batch {
    #[new]
    #[pyo3(signature = (scenario, num_envs, *, split, routes, seed, autoreset, num_threads, device, max_episode_steps, weights))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        py: Python,
        scenario: Given,
        num_envs: i64,
        split: &str,
        routes: Option<Vec<String>>,
        seed: u32,
        autoreset: &str,
        num_threads: usize,
        device: &str,
        max_episode_steps: Option<u32>,
        weights: Option<Vec<(String, f64)>>,
    ) -> PyResult<Batch> {
        let asked = Asked { scenario: &scenario, split, routes: routes.as_deref(), max_episode_steps };
        guarded(|| Batch::made(py, &asked, num_envs, seed, autoreset, num_threads, device, weights.as_deref()))
    }

    #[getter]
    fn num_envs(&self) -> usize {
        self.n_envs
    }

    #[getter]
    fn scenario(&self) -> &str {
        &self.place.scenario.name
    }

    #[getter]
    fn device(&self) -> &str {
        &self.device
    }

    #[getter]
    fn autoreset(&self) -> &'static str {
        name_of(self.autoreset)
    }

    #[getter]
    fn step_seconds(&self) -> f64 {
        self.place.scenario.step
    }

    #[getter]
    fn route_names(&self) -> Vec<String> {
        self.place.world.route_names.clone()
    }

    /// Which split's routes these are; `routes` where some were named that are not all of one.
    #[getter]
    fn split(&self) -> &'static str {
        self.place.split
    }

    /// Names of the routes that episodes are drawn from, in the benchmark's order.
    #[getter]
    fn split_routes(&self) -> Vec<&str> {
        self.place.routes.iter().map(|&route| self.place.world.route_names[route as usize].as_str()).collect()
    }

    /// Numbers of a command; 0 where an action is an index.
    #[getter]
    fn n_commands(&self) -> usize {
        self.place.world.n_commands()
    }

    /// Names of the extras that stand behind an observation's values.
    #[getter]
    fn extras(&self) -> Vec<&'static str> {
        self.layout.extra_names()
    }

    /// Whether what is observed of other vehicles stands behind them.
    #[getter]
    fn observes_vehicles(&self) -> bool {
        self.layout.has_vehicles
    }

    /// Trucks that share a road and its vehicles.
    #[getter]
    fn group(&self) -> usize {
        self.place.world.group()
    }

    /// Whether each truck's episode has ended and no other has begun, `[num_envs]`.
    fn waiting<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        Ok(PyArray1::from_slice(py, &self.state()?.held))
    }

    /// Values of an observation, all that stands behind among them.
    #[getter]
    pub fn n_values(&self) -> usize {
        self.layout.n_values()
    }

    /// Vehicle and load of each class of the vehicles, in the benchmark's order.
    #[getter]
    fn classes(&self) -> Vec<(&str, &str)> {
        self.place.world.classes.iter().map(|class| (class.vehicle.as_str(), class.load.as_str())).collect()
    }

    /// Index into `classes` of each vehicle that episodes draw from, `[n_vehicles]`.
    #[getter]
    fn vehicle_classes<'py>(&self, py: Python<'py>) -> Indices<'py> {
        PyArray1::from_iter(py, self.place.world.rigs.iter().map(|rig| i64::from(rig.class_index)))
    }

    #[getter]
    fn action_table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        actions::table(py, &self.place.world.actions)
    }

    /// Indices into `route_names` of the routes that trucks are on, `[num_envs]`.
    fn routes<'py>(&self, py: Python<'py>) -> PyResult<Indices<'py>> {
        let state = self.state()?;
        Ok(PyArray1::from_iter(py, state.episodes.iter().map(|episode| i64::from(episode.route))))
    }

    /// Indices into `vehicle_classes` of the vehicles that trucks are, `[num_envs]`.
    fn vehicles<'py>(&self, py: Python<'py>) -> PyResult<Indices<'py>> {
        let state = self.state()?;
        Ok(PyArray1::from_iter(py, state.episodes.iter().map(|episode| i64::from(episode.vehicle))))
    }

    fn observation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        guarded(|| {
            let mut state = self.state()?;
            state.check_process(&self.device)?;
            let State { simulator, pool, .. } = &mut *state;
            let columns = columns_of_observation(self.layout);
            let read = Read::of(simulator, &columns).map_err(|error| errors::of_simulator(&error))?;
            let observation = if self.layout.is_plain() {
                PyArray1::from_slice(py, &read.rows::<f32>(Column::Observation))
            } else {
                PyArray1::from_vec(py, pool.run(py, || read.observed(self.layout).to_vec())?)
            };
            observation.reshape([self.n_envs, self.n_values()])
        })
    }

    fn step<'py>(&self, py: Python<'py>, actions: &Bound<'py, PyAny>) -> PyResult<Step<'py>> {
        guarded(|| {
            let actions = actions::of_array(actions, self.n_envs, &self.place.world)?;
            let mut state = self.state()?;
            let (observation, reward, terminated, truncated) =
                state.step(py, self, &actions, |observation, reward, codes| {
                    let flags =
                        |is: fn(Ended) -> bool| -> Vec<bool> { codes.iter().map(|&code| holds(code, is)).collect() };
                    (observation.to_vec(), reward.to_vec(), flags(Ended::terminated), flags(Ended::truncated))
                })?;
            let vector = |flags| PyArray1::from_vec(py, flags);
            let observation = PyArray1::from_vec(py, observation).reshape([self.n_envs, self.n_values()])?;
            Ok((observation, PyArray1::from_vec(py, reward), vector(terminated), vector(truncated)))
        })
    }

    fn step_into(
        &self,
        py: Python,
        actions: &Bound<PyAny>,
        observation: &Bound<PyAny>,
        reward: &Bound<PyAny>,
        terminated: &Bound<PyAny>,
        truncated: &Bound<PyAny>,
    ) -> PyResult<()> {
        guarded(|| {
            let actions = actions::of_array(actions, self.n_envs, &self.place.world)?;
            let (n_envs, n_values) = (self.n_envs, self.n_values());
            let shape = format!("float32 of shape ({n_envs}, {n_values})");
            let mut observation: PyReadwriteArray2<f32> =
                observation.extract().map_err(|_| unfit("observation", &shape))?;
            // The slice of an array in Fortran's order would be of its transpose.
            if observation.shape() != [n_envs, n_values] || !observation.is_c_contiguous() {
                return Err(unfit("observation", &shape));
            }
            let observation = observation.as_slice_mut().map_err(|_| unfit("observation", &shape))?;
            let mut reward = writable::<f32>(reward, "reward", "float32", n_envs)?;
            let mut terminated = writable::<bool>(terminated, "terminated", "bool", n_envs)?;
            let mut truncated = writable::<bool>(truncated, "truncated", "bool", n_envs)?;
            let mut state = self.state()?;
            let reward = reward.as_slice_mut().map_err(|_| unfit("reward", "without gaps"))?;
            let terminated = terminated.as_slice_mut().map_err(|_| unfit("terminated", "without gaps"))?;
            let truncated = truncated.as_slice_mut().map_err(|_| unfit("truncated", "without gaps"))?;
            state.step(py, self, &actions, |new_observation, new_reward, codes| {
                new_observation.write(observation);
                reward.copy_from_slice(new_reward);
                for ((terminated, truncated), &code) in terminated.iter_mut().zip(truncated).zip(codes) {
                    *terminated = holds(code, Ended::terminated);
                    *truncated = holds(code, Ended::truncated);
                }
            })
        })
    }

    fn step_at_random(&self, py: Python) -> PyResult<()> {
        guarded(|| {
            let mut state = self.state()?;
            state.check_step(py, self)?;
            let State { simulator, pool, .. } = &mut *state;
            pool.run(py, || {
                simulator.step_at_random();
                simulator.wait()
            })?
            .map_err(|error| errors::of_simulator(&error))?;
            state.look()
        })
    }

    fn last_ended<'py>(&self, py: Python<'py>) -> PyResult<Option<Ends<'py>>> {
        guarded(|| {
            let state = self.state()?;
            if state.ends.is_empty() {
                return Ok(None);
            }
            let of = |value: fn(&End) -> i64| PyArray1::from_iter(py, state.ends.iter().map(value));
            let observations: Vec<f32> =
                state.ends.iter().flat_map(|end| &end.observation[..self.n_values()]).copied().collect();
            Ok(Some((
                of(|end| end.env as i64),
                of(|end| end.code.into()),
                of(|end| end.episode.route.into()),
                PyArray1::from_vec(py, observations).reshape([state.ends.len(), self.n_values()])?,
                of(|end| end.episode.vehicle.into()),
            )))
        })
    }

    /// The episodes that the last step ended as Gymnasium's infos, None where it ended none; with `numeric` arrays of
    /// numbers alone.
    fn end_infos<'py>(&self, py: Python<'py>, numeric: bool) -> PyResult<Option<Bound<'py, PyDict>>> {
        guarded(|| {
            let state = self.state()?;
            if state.ends.is_empty() {
                return Ok(None);
            }
            let infos =
                Infos { names: (!numeric).then_some(&self.names), is_same_step: self.autoreset == Autoreset::SameStep };
            infos.of_ends(py, &state.ends, &state.episodes, &state.held, self.n_values()).map(Some)
        })
    }

    fn begin_episodes(
        &self,
        py: Python,
        envs: Vec<usize>,
        streams: Option<Vec<Option<(u32, u32)>>>,
        routes: Option<Vec<Option<String>>>,
        starts: Option<Vec<Option<GivenStart>>>,
    ) -> PyResult<()> {
        guarded(|| self.begin(py, &envs, streams.as_deref(), routes.as_deref(), starts.as_deref()))
    }

    /// Columns as bytes, `[num_envs, width]`.
    fn column_bytes<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Vec<Bound<'py, PyArray2<u8>>>> {
        guarded(|| self.columns(py, &names))
    }

    /// Goes on from the bytes of every column, each `[num_envs * width]`, and from streams, `[num_envs]`.
    fn restore_bytes(
        &self,
        py: Python,
        columns: Vec<(String, PyReadonlyArray1<u8>)>,
        streams: Vec<(u32, u32)>,
    ) -> PyResult<()> {
        guarded(|| self.restore(py, &columns, &streams))
    }

    /// A number for all that trucks drive by in this world.
    fn fingerprint(&self) -> PyResult<u32> {
        guarded(|| Ok(self.place.fingerprint()))
    }

    /// What `resume` needs beside the columns: the sums of the tally.
    fn progress(&self) -> PyResult<Vec<i64>> {
        guarded(|| Ok(self.sums()?.sums.to_vec()))
    }

    /// Takes what another batch's `progress` and `last_ended` gave.
    fn resume(&self, progress: Vec<i64>, ends: Option<GivenEnds>) -> PyResult<()> {
        guarded(|| self.take_up(&progress, ends))
    }

    /// Seed and index that each truck draws from.
    fn streams(&self) -> PyResult<Vec<(u32, u32)>> {
        Ok(self.state()?.simulator.streams().iter().map(|stream| (stream.seed, stream.env)).collect())
    }

    fn tally<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let tally = guarded(|| self.sums())?;
        let dict = PyDict::new(py);
        dict.set_item("env_steps", tally.env_steps())?;
        dict.set_item("episodes", tally.episodes())?;
        dict.set_item("reward", tally.reward())?;
        for ended in Ended::ALL.into_iter().filter(|ended| *ended != Ended::Running) {
            dict.set_item(ended.name(), tally.ended(ended))?;
        }
        Ok(dict)
    }

    /// A route's waypoints `[n, 3]`, the lane's width at each `[n]`, and as lines `[m, 2]` the centres of all lanes of
    /// its road and the kerbs: in the frame of the batch's columns.
    fn geometry_of<'py>(&self, py: Python<'py>, route: &str) -> PyResult<geometry::Lines<'py>> {
        guarded(|| geometry::lines(py, &self.place, self.route("route", route)?))
    }

    /// Distance of points from the nearest kerb of a route's road, negative off the road, `[n]`.
    fn kerb_distances<'py>(
        &self,
        py: Python<'py>,
        route: &str,
        points: PyReadonlyArray2<f64>,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        guarded(|| Ok(geometry::kerb_distances(py, &self.place, self.route("route", route)?, &aligned(points)?)))
    }

    /// Lengths and limits of a vehicle by its index.
    fn dimensions_of<'py>(&self, py: Python<'py>, vehicle: usize) -> PyResult<Bound<'py, PyDict>> {
        guarded(|| geometry::dimensions(py, errors::at("vehicle", &self.place.world.rigs, vehicle)?))
    }

    /// Draws the routes of later episodes by other weights, of a batch that has some.
    fn weigh_routes(&self, weights: Vec<(String, f64)>) -> PyResult<()> {
        guarded(|| {
            let table = weights::table(&self.place, &weights)?;
            let mut state = self.state()?;
            state.check_process(&self.device)?;
            state.simulator.draw_from(&table).map_err(|error| errors::of_simulator(&error))
        })
    }

    fn picture<'py>(&self, py: Python<'py>, env: usize, size: u32) -> PyResult<Bound<'py, PyArray3<u8>>> {
        guarded(|| self.drawn(py, env, size))
    }
}

fn holds(code: u32, is: fn(Ended) -> bool) -> bool {
    Ended::from_code(code).is_some_and(is)
}
