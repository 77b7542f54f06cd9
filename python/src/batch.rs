//! A batch of trucks: the simulator as Python sees it.

mod arguments;
mod state;

use std::borrow::Cow;
use std::sync::{Mutex, MutexGuard, TryLockError};

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadwriteArray2, PyUntypedArrayMethods};
use offtrack::layout::{Column, Ended, N_RAYS, N_VALUES, Start, Stream, Truck};
use offtrack::simulator::{Autoreset, Begin, RouteChoice, Simulator};
use offtrack_drawing::camera::{Camera, Shown};
use pyo3::exceptions::{PyIndexError, PyMemoryError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::infos::{self, End, Names};
use crate::observed::{self, Read, rows_of};
use crate::pool::Pool;
use crate::worlds::Place;
use crate::{actions, errors};
use arguments::{autoreset_of, column_of, engine_of, name_of, unfit, writable};
use state::State;

/// Observation, reward, terminated, truncated of a step.
type Step<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<bool>>, Bound<'py, PyArray1<bool>>);
/// One whole number for each of some trucks.
type Indices<'py> = Bound<'py, PyArray1<i64>>;
/// Trucks whose episode ended, why, on which route, their last observations, and which vehicle they were.
type Ends<'py> = (Indices<'py>, Indices<'py>, Indices<'py>, Bound<'py, PyArray2<f32>>, Indices<'py>);
/// Offset, heading error and speed of a start as fractions, and the index of its vehicle.
type GivenStart = (f32, f32, f32, u32);

/// Many trucks in one world, stepped together.
///
/// The class `offtrack_sim.Batch` extends it and documents it.
#[pyclass(subclass, frozen, module = "offtrack_sim._offtrack")]
pub struct Batch {
    place: Place,
    names: Names,
    n_envs: usize,
    /// Extras that stand behind each observation's values.
    n_extras: usize,
    /// What is read after a step.
    read: Vec<Column>,
    device: String,
    autoreset: Autoreset,
    state: Mutex<State>,
}

#[pymethods]
impl Batch {
    #[new]
    #[pyo3(signature = (scenario, num_envs, *, split, routes, seed, autoreset, num_threads, device))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        py: Python,
        scenario: &str,
        num_envs: i64,
        split: &str,
        routes: Option<Vec<String>>,
        seed: u32,
        autoreset: &str,
        num_threads: usize,
        device: &str,
    ) -> PyResult<Batch> {
        let n_envs = match usize::try_from(num_envs) {
            Ok(n_envs) if 0 < n_envs => n_envs,
            _ => return Err(PyValueError::new_err(format!("num_envs: {num_envs}; must be at least 1"))),
        };
        if u32::try_from(n_envs).is_err() {
            return Err(PyMemoryError::new_err(format!("num_envs: {num_envs}; a batch holds fewer than 2^32 trucks")));
        }
        let autoreset = autoreset_of(autoreset)?;
        let mut pool = Pool::new(num_threads);
        let place = pool.run(py, || Place::find(scenario, split, routes.as_deref()))??;
        let (engine, device) = engine_of(device)?;
        let choice = RouteChoice::Drawn(place.routes.clone());
        let world = place.world.clone();
        let made = pool.run(py, || Simulator::on(engine, world, n_envs, seed, choice))?;
        let mut simulator = made.map_err(|error| errors::of_simulator(&error))?;
        simulator.set_autoreset(autoreset);
        let mut state = State { simulator, pool, camera: None, episodes: Vec::new(), held: Vec::new(), ends: Vec::new() };
        state.look()?;
        let n_extras = place.world.params.n_extras as usize;
        let (names, read) = (Names::new(py, &place.world), observed::columns_of_step(autoreset, n_extras));
        Ok(Batch { place, names, n_envs, n_extras, read, device, autoreset, state: Mutex::new(state) })
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

    /// Names of the routes that episodes are drawn from, in the benchmark's order.
    #[getter]
    fn split_routes(&self) -> Vec<&str> {
        self.place.routes.iter().map(|&route| self.place.world.route_names[route as usize].as_str()).collect()
    }

    /// Names of the extras that stand behind an observation's values.
    #[getter]
    fn extras(&self) -> Vec<&'static str> {
        observed::names(self.n_extras)
    }

    /// Values of an observation, its extras among them.
    #[getter]
    fn n_values(&self) -> usize {
        N_VALUES + self.n_extras
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
        let table: Vec<f32> = self.place.world.actions.iter().flat_map(|action| [action.steering, action.speed]).collect();
        PyArray1::from_vec(py, table).reshape([self.place.world.actions.len(), 2])
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
        let mut state = self.state()?;
        state.check_process(&self.device)?;
        let State { simulator, pool, .. } = &mut *state;
        let columns = observed::columns_of_observation(self.n_extras);
        let read = Read::of(simulator, columns).map_err(|error| errors::of_simulator(&error))?;
        let observation = if self.n_extras == 0 {
            PyArray1::from_slice(py, &read.rows::<f32>(Column::Observation))
        } else {
            PyArray1::from_vec(py, pool.run(py, || read.observed(self.n_extras).to_vec())?)
        };
        observation.reshape([self.n_envs, self.n_values()])
    }

    fn step<'py>(&self, py: Python<'py>, actions: &Bound<'py, PyAny>) -> PyResult<Step<'py>> {
        let actions = actions::of_array(actions, self.n_envs, &self.place.world.actions)?;
        let mut state = self.state()?;
        let (observation, reward, terminated, truncated) = state.step(py, self, &actions, |observation, reward, codes| {
            let flags = |is: fn(Ended) -> bool| -> Vec<bool> { codes.iter().map(|&code| holds(code, is)).collect() };
            (observation.to_vec(), reward.to_vec(), flags(Ended::terminated), flags(Ended::truncated))
        })?;
        let vector = |flags| PyArray1::from_vec(py, flags);
        let observation = PyArray1::from_vec(py, observation).reshape([self.n_envs, self.n_values()])?;
        Ok((observation, PyArray1::from_vec(py, reward), vector(terminated), vector(truncated)))
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
        let actions = actions::of_array(actions, self.n_envs, &self.place.world.actions)?;
        let (n_envs, n_values) = (self.n_envs, self.n_values());
        let shape = format!("float32 of shape ({n_envs}, {n_values})");
        let mut observation: PyReadwriteArray2<f32> = observation.extract().map_err(|_| unfit("observation", &shape))?;
        if observation.shape() != [n_envs, n_values] {
            return Err(unfit("observation", &shape));
        }
        let observation = observation.as_slice_mut().map_err(|_| unfit("observation", &shape))?;
        let mut reward = writable::<f32>(reward, "reward", "float32", n_envs)?;
        let mut terminated = writable::<bool>(terminated, "terminated", "bool", n_envs)?;
        let mut truncated = writable::<bool>(truncated, "truncated", "bool", n_envs)?;
        let mut state = self.state()?;
        let contiguous = |_| unfit("an output", "contiguous");
        let reward = reward.as_slice_mut().map_err(contiguous)?;
        let terminated = terminated.as_slice_mut().map_err(contiguous)?;
        let truncated = truncated.as_slice_mut().map_err(contiguous)?;
        state.step(py, self, &actions, |new_observation, new_reward, codes| {
            new_observation.write(observation);
            reward.copy_from_slice(new_reward);
            for ((terminated, truncated), &code) in terminated.iter_mut().zip(truncated).zip(codes) {
                *terminated = holds(code, Ended::terminated);
                *truncated = holds(code, Ended::truncated);
            }
        })
    }

    fn step_at_random(&self, py: Python) -> PyResult<()> {
        let mut state = self.state()?;
        state.check_process(&self.device)?;
        let State { simulator, pool, .. } = &mut *state;
        pool.run(py, || {
            simulator.step_at_random();
            simulator.wait()
        })?
        .map_err(|error| errors::of_simulator(&error))?;
        state.look()
    }

    fn last_ended<'py>(&self, py: Python<'py>) -> PyResult<Option<Ends<'py>>> {
        let state = self.state()?;
        if state.ends.is_empty() {
            return Ok(None);
        }
        let of = |value: fn(&End) -> i64| PyArray1::from_iter(py, state.ends.iter().map(value));
        let observations: Vec<f32> = state.ends.iter().flat_map(|end| &end.observation[..self.n_values()]).copied().collect();
        Ok(Some((
            of(|end| end.env as i64),
            of(|end| end.code.into()),
            of(|end| end.episode.route.into()),
            PyArray1::from_vec(py, observations).reshape([state.ends.len(), self.n_values()])?,
            of(|end| end.episode.vehicle.into()),
        )))
    }

    /// The episodes that the last step ended as Gymnasium's infos, None where it ended none.
    fn end_infos<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let state = self.state()?;
        if state.ends.is_empty() {
            return Ok(None);
        }
        infos::of_ends(py, &self.names, &state.ends, &state.episodes, self.autoreset, self.n_values()).map(Some)
    }

    fn begin_episodes(
        &self,
        py: Python,
        envs: Vec<usize>,
        streams: Option<Vec<Option<(u32, u32)>>>,
        routes: Option<Vec<Option<String>>>,
        starts: Option<Vec<Option<GivenStart>>>,
    ) -> PyResult<()> {
        let n = envs.len();
        let lengths = [streams.as_ref().map(Vec::len), routes.as_ref().map(Vec::len), starts.as_ref().map(Vec::len)];
        for (name, found) in ["streams", "routes", "starts"].into_iter().zip(lengths) {
            if found.is_some_and(|found| found != n) {
                return Err(PyValueError::new_err(format!("{name}: {} of them; {n} are needed, one a truck", found.unwrap_or(0))));
            }
        }
        let request = |(index, &env): (usize, &usize)| {
            let route = routes.as_ref().and_then(|routes| routes[index].as_deref());
            Ok(Begin {
                env,
                stream: streams.as_ref().and_then(|streams| streams[index]).map(|(seed, env)| Stream { seed, env }),
                route: route.map(|name| self.route(name)).transpose()?,
                start: starts.as_ref().and_then(|starts| starts[index]).map(|(offset, heading, speed, vehicle)| Start {
                    offset,
                    heading,
                    speed,
                    vehicle,
                }),
            })
        };
        let requests = envs.iter().enumerate().map(request).collect::<PyResult<Vec<Begin>>>()?;
        let mut state = self.state()?;
        state.check_process(&self.device)?;
        let State { simulator, pool, .. } = &mut *state;
        pool.run(py, || simulator.begin(&requests))?.map_err(|error| errors::of_simulator(&error))?;
        state.look()
    }

    /// Columns as bytes, `[num_envs, width]`.
    fn column_bytes<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Vec<Bound<'py, PyArray2<u8>>>> {
        let columns = names.iter().map(|name| column_of(name)).collect::<PyResult<Vec<Column>>>()?;
        let state = self.state()?;
        state.check_process(&self.device)?;
        let read = state.simulator.read(&columns).map_err(|error| errors::of_simulator(&error))?;
        let shaped = |bytes: &Cow<[u8]>| PyArray1::from_slice(py, bytes).reshape([self.n_envs, bytes.len() / self.n_envs]);
        read.iter().map(shaped).collect()
    }

    /// Goes on from the bytes of every column, each `[num_envs * width]`, and from streams, `[num_envs]`.
    fn restore_bytes(&self, py: Python, columns: Vec<(String, PyReadonlyArray1<u8>)>, streams: Vec<(u32, u32)>) -> PyResult<()> {
        let mut given = Vec::new();
        for (name, bytes) in &columns {
            given.push((column_of(name)?, bytes.as_slice().map_err(|_| unfit(name, "contiguous"))?));
        }
        let streams: Vec<Stream> = streams.into_iter().map(|(seed, env)| Stream { seed, env }).collect();
        let mut state = self.state()?;
        state.check_process(&self.device)?;
        let State { simulator, pool, .. } = &mut *state;
        let bytes_of = |column| given.iter().find(|(known, _)| *known == column).map(|(_, bytes)| *bytes);
        let restored = pool.run(py, || {
            let before = simulator.streams();
            simulator.set_streams(&streams)?;
            simulator.restore(bytes_of).inspect_err(|_| drop(simulator.set_streams(&before)))
        })?;
        restored.map_err(|error| errors::of_simulator(&error))?;
        state.look()
    }

    /// Seed and index that each truck draws from.
    fn streams(&self) -> PyResult<Vec<(u32, u32)>> {
        Ok(self.state()?.simulator.streams().iter().map(|stream| (stream.seed, stream.env)).collect())
    }

    fn tally<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let tally = self.state()?.simulator.tally().map_err(|error| errors::of_simulator(&error))?;
        let dict = PyDict::new(py);
        dict.set_item("env_steps", tally.env_steps())?;
        dict.set_item("episodes", tally.episodes())?;
        dict.set_item("reward", tally.reward())?;
        for ended in Ended::ALL.into_iter().filter(|ended| *ended != Ended::Running) {
            dict.set_item(ended.name(), tally.ended(ended))?;
        }
        Ok(dict)
    }

    fn picture<'py>(&self, py: Python<'py>, env: usize, size: u32) -> PyResult<Bound<'py, PyArray3<u8>>> {
        if self.n_envs <= env {
            return Err(PyIndexError::new_err(format!("env: {env}; the batch has trucks 0..{}", self.n_envs)));
        }
        let mut state = self.state()?;
        state.check_process(&self.device)?;
        let State { simulator, camera, .. } = &mut *state;
        let camera = match camera.take_if(|camera| camera.side() == size) {
            Some(kept) => camera.insert(kept),
            None => {
                let made = Camera::new(self.place.scenario.clone(), &self.place.world, size);
                camera.insert(made.map_err(|error| PyValueError::new_err(format!("size: {error}")))?)
            }
        };
        let read = simulator.read(&[Column::Truck, Column::Ranges, Column::Ended]).map_err(|error| errors::of_simulator(&error))?;
        let truck = rows_of::<Truck>(&read[0])[env];
        let ranges = rows_of::<[f32; N_RAYS]>(&read[1])[env];
        // A truck that goes on in another episode has not ended.
        let code = if truck.held == 1 { rows_of::<u32>(&read[2])[env] } else { Ended::Running as u32 };
        let shown = Shown { truck: &truck, ranges: &ranges, ended: Ended::from_code(code).unwrap_or(Ended::Running) };
        let picture = camera.draw(&shown);
        PyArray1::from_slice(py, picture).reshape([size as usize, size as usize, 3])
    }
}

impl Batch {
    /// The state, unless another thread has it.
    fn state(&self) -> PyResult<MutexGuard<'_, State>> {
        match self.state.try_lock() {
            Ok(state) => Ok(state),
            Err(TryLockError::Poisoned(_)) => Err(PyRuntimeError::new_err("this batch failed before; make another")),
            Err(TryLockError::WouldBlock) => {
                Err(PyRuntimeError::new_err("this batch is in use by another thread; give each thread a batch of its own"))
            }
        }
    }

    /// Index of a route by its name.
    fn route(&self, name: &str) -> PyResult<u32> {
        let names = &self.place.world.route_names;
        let found = names.iter().position(|known| known == name);
        found.map(|index| index as u32).ok_or_else(|| {
            let list = offtrack::reader::shortened(&names.join(", "), 600);
            PyValueError::new_err(format!("routes: {name:?}; the batch drives {list}"))
        })
    }
}

fn holds(code: u32, is: fn(Ended) -> bool) -> bool {
    Ended::from_code(code).is_some_and(is)
}
