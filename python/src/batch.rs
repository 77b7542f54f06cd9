//! A batch of trucks: the simulator as Python sees it.

use std::borrow::Cow;
use std::sync::{Mutex, MutexGuard, TryLockError};

use bytemuck::{AnyBitPattern, NoUninit};
use numpy::{Element, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadwriteArray1, PyReadwriteArray2};
use offtrack::layout::{Column, Ended, N_RAYS, N_VALUES, Start, Stream, Truck};
use offtrack::shared::Named;
use offtrack::simulator::{Autoreset, Begin, Engine, RouteChoice, Simulator};
use offtrack_drawing::camera::{Camera, Shown};
use pyo3::exceptions::{PyIndexError, PyMemoryError, PyRuntimeError, PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use rayon::prelude::*;

use crate::pool::Pool;
use crate::worlds::Place;
use crate::{actions, errors};

/// Rows of observations that a thread copies at least.
const ROWS_MIN: usize = 64;
/// The device that is none.
const CPU: &str = "cpu";
/// What is read after a step, the last of them only where observations were replaced in the step.
const READ: [Column; 5] = [Column::Observation, Column::Reward, Column::Ended, Column::Truck, Column::NextObservation];

/// Observation, reward, terminated, truncated of a step.
type Step<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<bool>>, Bound<'py, PyArray1<bool>>);
/// Trucks whose episode ended, why, on which route, and their last observations.
type Ends<'py> = (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f32>>);

/// Many trucks in one world, stepped together.
///
/// The class `offtrack_sim.Batch` extends it and documents it.
#[pyclass(subclass, frozen, module = "offtrack_sim._offtrack")]
pub struct Batch {
    place: Place,
    /// Names of the world's routes.
    names: Vec<Py<PyString>>,
    n_envs: usize,
    device: String,
    autoreset: Autoreset,
    state: Mutex<State>,
}

/// What a step changes.
struct State {
    simulator: Simulator,
    pool: Pool,
    camera: Option<Camera>,
    /// Index of the route that each truck is on.
    routes: Vec<u32>,
    /// Whether its episode has ended and no other has begun.
    held: Vec<bool>,
    /// Episodes that the last step ended.
    ends: Vec<End>,
}

/// An episode that the last step ended.
struct End {
    env: usize,
    code: u32,
    route: u32,
    /// After the last action.
    observation: [f32; N_VALUES],
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
        let mut state = State { simulator, pool, camera: None, routes: Vec::new(), held: Vec::new(), ends: Vec::new() };
        state.look()?;
        let names = place.world.route_names.iter().map(|name| PyString::new(py, name).unbind()).collect();
        Ok(Batch { place, names, n_envs, device, autoreset, state: Mutex::new(state) })
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

    #[getter]
    fn action_table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let table: Vec<f32> = self.place.world.actions.iter().flat_map(|action| [action.steering, action.speed]).collect();
        PyArray1::from_vec(py, table).reshape([self.place.world.actions.len(), 2])
    }

    /// Indices into `route_names` of the routes that trucks are on, `[num_envs]`.
    fn routes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<i64>>> {
        let state = self.state()?;
        Ok(PyArray1::from_iter(py, state.routes.iter().map(|&route| i64::from(route))))
    }

    fn observation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let state = self.state()?;
        state.check_process(&self.device)?;
        let read = state.simulator.read(&[Column::Observation]).map_err(|error| errors::of_simulator(&error))?;
        self.rows(py, &read[0])
    }

    fn step<'py>(&self, py: Python<'py>, actions: &Bound<'py, PyAny>) -> PyResult<Step<'py>> {
        let actions = actions::of_array(actions, self.n_envs, &self.place.world.actions)?;
        let mut state = self.state()?;
        let (observation, reward, terminated, truncated) = state.step(py, self, &actions, |observation, reward, codes| {
            let observation: Vec<[f32; N_VALUES]> = observation.par_iter().with_min_len(ROWS_MIN).copied().collect();
            let flags = |is: fn(Ended) -> bool| -> Vec<bool> { codes.iter().map(|&code| holds(code, is)).collect() };
            (observation.into_flattened(), reward.to_vec(), flags(Ended::terminated), flags(Ended::truncated))
        })?;
        let vector = |flags| PyArray1::from_vec(py, flags);
        let observation = PyArray1::from_vec(py, observation).reshape([self.n_envs, N_VALUES])?;
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
        let n_envs = self.n_envs;
        let shape = format!("float32 of shape ({n_envs}, {N_VALUES})");
        let mut observation: PyReadwriteArray2<f32> = observation.extract().map_err(|_| unfit("observation", &shape))?;
        let observation = observation.as_slice_mut().map_err(|_| unfit("observation", &shape))?;
        if observation.len() != n_envs * N_VALUES {
            return Err(unfit("observation", &shape));
        }
        let mut reward = writable::<f32>(reward, "reward", "float32", n_envs)?;
        let mut terminated = writable::<bool>(terminated, "terminated", "bool", n_envs)?;
        let mut truncated = writable::<bool>(truncated, "truncated", "bool", n_envs)?;
        let mut state = self.state()?;
        let contiguous = |_| unfit("an output", "contiguous");
        let (observation, _) = observation.as_chunks_mut::<N_VALUES>();
        let reward = reward.as_slice_mut().map_err(contiguous)?;
        let terminated = terminated.as_slice_mut().map_err(contiguous)?;
        let truncated = truncated.as_slice_mut().map_err(contiguous)?;
        state.step(py, self, &actions, |new_observation, new_reward, codes| {
            let rows = observation.par_iter_mut().with_min_len(ROWS_MIN).zip(new_observation);
            rows.for_each(|(row, new)| *row = *new);
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
        let observations: Vec<f32> = state.ends.iter().flat_map(|end| end.observation).collect();
        Ok(Some((
            of(|end| end.env as i64),
            of(|end| end.code.into()),
            of(|end| end.route.into()),
            PyArray1::from_vec(py, observations).reshape([state.ends.len(), N_VALUES])?,
        )))
    }

    /// The episodes that the last step ended as Gymnasium's infos, None where it ended none: an array `key` and a mask
    /// `_key` of all trucks. With `autoreset` in the same step those of the end are in `final_info`.
    fn end_infos<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let state = self.state()?;
        if state.ends.is_empty() {
            return Ok(None);
        }
        // An empty array of objects holds None, and is made faster by numpy than filled here.
        let numpy = py.import(intern!(py, "numpy"))?;
        let objects = || numpy.call_method1(intern!(py, "empty"), (self.n_envs, intern!(py, "O")));
        let name = |route: u32| self.names[route as usize].bind(py);
        let mut mask = vec![false; self.n_envs];
        let mut codes = vec![0i64; self.n_envs];
        let mut successes = vec![false; self.n_envs];
        let routes = objects()?;
        for End { env, code, route, .. } in &state.ends {
            mask[*env] = true;
            codes[*env] = i64::from(*code);
            successes[*env] = *code == Ended::Arrived as u32;
            routes.set_item(env, name(*route))?;
        }
        let mask = PyArray1::from_vec(py, mask);
        let infos = PyDict::new(py);
        for (key, masked, values) in [
            (intern!(py, "ended"), intern!(py, "_ended"), PyArray1::from_vec(py, codes).into_any()),
            (intern!(py, "is_success"), intern!(py, "_is_success"), PyArray1::from_vec(py, successes).into_any()),
            (intern!(py, "route"), intern!(py, "_route"), routes),
        ] {
            infos.set_item(key, values)?;
            infos.set_item(masked, &mask)?;
        }
        if self.autoreset != Autoreset::SameStep {
            return Ok(Some(infos));
        }
        let (begun, last) = (objects()?, objects()?);
        for End { env, observation, .. } in &state.ends {
            begun.set_item(env, name(state.routes[*env]))?;
            last.set_item(env, PyArray1::from_slice(py, observation))?;
        }
        let with_final = PyDict::new(py);
        for (key, masked, values) in [
            (intern!(py, "final_obs"), intern!(py, "_final_obs"), last),
            (intern!(py, "final_info"), intern!(py, "_final_info"), infos.into_any()),
            (intern!(py, "route"), intern!(py, "_route"), begun),
        ] {
            with_final.set_item(key, values)?;
            with_final.set_item(masked, &mask)?;
        }
        Ok(Some(with_final))
    }

    fn begin_episodes(
        &self,
        py: Python,
        envs: Vec<usize>,
        streams: Option<Vec<Option<(u32, u32)>>>,
        routes: Option<Vec<Option<String>>>,
        starts: Option<Vec<Option<(f32, f32)>>>,
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
                start: starts.as_ref().and_then(|starts| starts[index]).map(|(offset, heading)| Start {
                    offset,
                    heading,
                    ..Start::default()
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
        let truck = values::<Truck>(&read[0])[env];
        let ranges = values::<[f32; N_RAYS]>(&read[1])[env];
        // A truck that goes on in another episode has not ended.
        let code = if truck.held == 1 { values::<u32>(&read[2])[env] } else { Ended::Running as u32 };
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

    /// An array of observations.
    fn rows<'py>(&self, py: Python<'py>, bytes: &[u8]) -> PyResult<Bound<'py, PyArray2<f32>>> {
        PyArray1::from_slice(py, &values::<f32>(bytes)).reshape([self.n_envs, N_VALUES])
    }
}

impl State {
    /// Steps all trucks, and hands observation, reward and end code of each to `deliver`, on the pool's threads: these
    /// fall asleep where the caller's own does the work.
    fn step<T: Send>(
        &mut self,
        py: Python,
        batch: &Batch,
        actions: &[u32],
        deliver: impl FnOnce(&[[f32; N_VALUES]], &[f32], &[u32]) -> T + Send,
    ) -> PyResult<T> {
        self.check_process(&batch.device)?;
        let State { simulator, pool, ends, routes, held, .. } = self;
        if batch.autoreset == Autoreset::Disabled
            && let Some(env) = held.iter().position(|held| *held)
        {
            return Err(errors::reset_needed(py, &format!("truck {env}: its episode has ended; begin another before the next step")));
        }
        let same_step = batch.autoreset == Autoreset::SameStep;
        let stepped = pool.run(py, || {
            simulator.step(actions)?;
            let read = simulator.read(if same_step { &READ[..] } else { &READ[..READ.len() - 1] })?;
            let (observation, codes, trucks) = (values(&read[0]), values::<u32>(&read[2]), values::<Truck>(&read[3]));
            let last = if same_step { values(&read[4]) } else { Cow::Borrowed(&*observation) };
            if batch.autoreset == Autoreset::NextStep {
                // Those that ended in the step before have begun, and no other is on another route.
                for End { env, .. } in &*ends {
                    routes[*env] = trucks[*env].route;
                    held[*env] = false;
                }
            }
            ends.clear();
            for (env, &code) in codes.iter().enumerate().filter(|&(_, &code)| code != Ended::Running as u32) {
                ends.push(End { env, code, route: routes[env], observation: last[env] });
                routes[env] = trucks[env].route;
                held[env] = trucks[env].held == 1;
            }
            Ok(deliver(&observation, &values(&read[1]), &codes))
        })?;
        stepped.map_err(|error| errors::of_simulator(&error))
    }

    /// Looks at where trucks are after they were put there.
    fn look(&mut self) -> PyResult<()> {
        let State { simulator, routes, held, ends, .. } = self;
        let read = simulator.read(&[Column::Truck]).map_err(|error| errors::of_simulator(&error))?;
        ends.clear();
        see(&values::<Truck>(&read[0]), routes, held);
        Ok(())
    }

    /// An error in a forked child whose batch is on a device: the device is its parent's.
    fn check_process(&self, device: &str) -> PyResult<()> {
        if device != CPU && self.pool.is_forked() {
            let message = format!("this batch is on {device}, which a forked process cannot use; make the batch in the child");
            return Err(PyRuntimeError::new_err(message));
        }
        Ok(())
    }
}

/// Takes down on which routes trucks are and which are held.
fn see(trucks: &[Truck], routes: &mut Vec<u32>, held: &mut Vec<bool>) {
    routes.clear();
    routes.extend(trucks.iter().map(|truck| truck.route));
    held.clear();
    held.extend(trucks.iter().map(|truck| truck.held == 1));
}

/// Bytes as values. Those read from a device need not be aligned.
fn values<T: AnyBitPattern + NoUninit>(bytes: &[u8]) -> Cow<'_, [T]> {
    match bytemuck::try_cast_slice(bytes) {
        Ok(values) => Cow::Borrowed(values),
        Err(_) => Cow::Owned(bytemuck::pod_collect_to_vec(bytes)),
    }
}

fn holds(code: u32, is: fn(Ended) -> bool) -> bool {
    Ended::from_code(code).is_some_and(is)
}

fn column_of(name: &str) -> PyResult<Column> {
    let found = Column::ALL.iter().find(|column| column.name() == name);
    found.copied().ok_or_else(|| {
        let known: Vec<&str> = Column::ALL.iter().map(|column| column.name()).collect();
        PyValueError::new_err(format!("column: {name:?}; must be one of {}", known.join(", ")))
    })
}

/// The names of `gymnasium.vector.AutoresetMode`, in lower case.
const MODES: [(&str, Autoreset); 3] =
    [("next_step", Autoreset::NextStep), ("same_step", Autoreset::SameStep), ("disabled", Autoreset::Disabled)];

fn autoreset_of(name: &str) -> PyResult<Autoreset> {
    let found = MODES.iter().find(|(known, _)| *known == name);
    found
        .map(|(_, mode)| *mode)
        .ok_or_else(|| PyValueError::new_err(format!("autoreset: {name:?}; must be one of {}", MODES.map(|(name, _)| name).join(", "))))
}

fn name_of(autoreset: Autoreset) -> &'static str {
    MODES.iter().find(|(_, mode)| *mode == autoreset).map_or("", |(name, _)| name)
}

/// The engine that `device` names, and the name that it goes by.
fn engine_of(device: &str) -> PyResult<(Engine, String)> {
    if device == CPU {
        return Ok((Engine::Cpu, CPU.to_owned()));
    }
    #[cfg(feature = "gpu")]
    {
        use offtrack::gpu;

        let adapter = (device != "gpu").then_some(device);
        let opened = gpu::Device::open(adapter).map_err(|error| PyRuntimeError::new_err(format!("device: {error}")))?;
        let name = opened.name();
        Ok((Engine::Gpu { device: opened, columns: gpu::Columns::new() }, name))
    }
    #[cfg(not(feature = "gpu"))]
    Err(PyRuntimeError::new_err(format!("device: {device:?}; this build has only \"cpu\": it was made without the feature gpu")))
}

/// An output array of the caller.
fn writable<'py, T: Element>(array: &Bound<'py, PyAny>, name: &str, kind: &str, n_envs: usize) -> PyResult<PyReadwriteArray1<'py, T>> {
    let shape = format!("{kind} of shape ({n_envs},)");
    let array: PyReadwriteArray1<T> = array.extract().map_err(|_| unfit(name, &shape))?;
    if array.len().is_ok_and(|len| len == n_envs) { Ok(array) } else { Err(unfit(name, &shape)) }
}

fn unfit(name: &str, needed: &str) -> PyErr {
    PyTypeError::new_err(format!("{name}: must be a writable, contiguous numpy array, {needed}"))
}
