//! Scenarios, read and baked once a process: environments of one scenario share a world.

mod routes; // those that are to be driven

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, TryLockError};
use std::time::Duration;

use offtrack::files::cache::{Cache, Loading, Stopped};
use offtrack::files::reader::{Reader, shortened};
use offtrack::files::shipped::{FILES, Kind};
use offtrack::layout::Action;
use offtrack::scenario::{ActionKind, Scenario, Split};
use offtrack::world::{Error, World};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::{self, ScenarioError};
use routes::RoadFile;

/// Most worlds that are kept for the next batch.
const KEPT: usize = 8;
/// How often a thread looks whether another one has baked its world.
const POLL: Duration = Duration::from_millis(20);

/// What trucks drive in.
#[derive(Debug, Clone)]
pub struct Place {
    /// The benchmark, of which the routes to be driven are left.
    pub scenario: Arc<Scenario>,
    /// The benchmark, baked.
    pub world: Arc<World>,
    /// Name of the split that all of these routes are of, or `routes`.
    pub split: &'static str,
    /// Routes to draw from, as indices into the world's.
    pub routes: Vec<u32>,
    /// Steps after which an episode is timed out in any case, where the caller says so.
    pub max_episode_steps: Option<u32>,
    /// Files whose roads were added to the benchmark's.
    files: Vec<RoadFile>,
    /// The world's fingerprint, once it was asked for.
    fingerprint: Arc<OnceLock<u32>>,
}

/// A benchmark as Python gives it.
#[derive(Debug, Clone, FromPyObject)]
pub enum Given {
    /// Its name, or the path of its file.
    Named(String),
    /// Its name, its text, and the folder that paths in it are relative to.
    Text((String, String, Option<PathBuf>)),
}

impl Given {
    fn load(&self, loading: &Loading) -> PyResult<Scenario> {
        let loaded = match self {
            Given::Named(name) => Scenario::load(name, loading),
            Given::Text((name, text, folder)) => Scenario::parse(name, text, folder.as_deref(), loading),
        };
        loaded.map_err(|error| errors::of_reader(&error))
    }
}

/// What a caller asks for.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// The benchmark.
    pub scenario: &'a Given,
    /// Name of the split.
    pub split: &'a str,
    /// Names of routes, or of roundabouts, in place of a split.
    pub routes: Option<&'a [String]>,
    /// Steps after which an episode is timed out if it was not before.
    pub max_episode_steps: Option<u32>,
}

/// What was baked last.
type Baked = Arc<Mutex<Vec<Place>>>;

/// What this process baked last. Another number is that of the process of which this one is a fork.
static BAKED: Mutex<Option<(u32, Baked)>> = Mutex::new(None);

impl Place {
    /// A number for all that trucks drive by here.
    pub fn fingerprint(&self) -> u32 {
        *self.fingerprint.get_or_init(|| self.world.fingerprint())
    }

    /// Index of a route by its name, which stands in this argument; `known` says of whom the names in the error are.
    pub fn route(&self, argument: &str, name: &str, known: &str) -> PyResult<u32> {
        let names = &self.world.route_names;
        let name_here = self.name_here(name);
        let found = names.iter().position(|route| *route == name_here);
        found.map(|index| index as u32).ok_or_else(|| {
            let list = shortened(&names.join(", "), 600);
            PyValueError::new_err(format!("{argument}: {name:?}; {known} {list}"))
        })
    }

    /// A route or road as it is named here: one of a file after the file's stem.
    pub fn name_here<'a>(&self, name: &'a str) -> Cow<'a, str> {
        self.files.iter().find_map(|file| file.renamed(name)).map_or(Cow::Borrowed(name), Cow::Owned)
    }

    /// The place that is asked for: from those that were baked last, or baked now, unless `stop` is set on the way.
    pub fn find(asked: &Asked, stop: &AtomicBool) -> PyResult<Place> {
        Place::of(asked, stop, |scenario| scenario)
    }

    /// The same with every vehicle as its file has it.
    pub fn typical(asked: &Asked, stop: &AtomicBool) -> PyResult<Place> {
        Place::of(asked, stop, |scenario| scenario.typical())
    }

    fn of(asked: &Asked, stop: &AtomicBool, change: impl FnOnce(Scenario) -> Scenario) -> PyResult<Place> {
        let cache = Cache::of_user();
        let loading = Loading { cache: cache.as_ref(), stop, ..Loading::PLAIN };
        let mut scenario = asked.scenario.load(&loading)?;
        let (split, files) = routes::narrow(&mut scenario, asked.split, asked.routes)?;
        let scenario = change(scenario);
        let limit = asked.max_episode_steps;
        // Held while a world is baked, so that two threads do not bake the same one.
        let baked = baked();
        let mut baked = free(&baked, stop).map_err(|stopped| PyValueError::new_err(stopped.to_string()))?;
        let known =
            |place: &&Place| (place.max_episode_steps, place.split) == (limit, split) && *place.scenario == scenario;
        if let Some(place) = baked.iter().find(known) {
            return Ok(Place { files, ..place.clone() });
        }
        let same = |place: &&Place| place.max_episode_steps.is_none() && *place.scenario == scenario;
        let mut world = match baked.iter().find(same) {
            Some(place) => (*place.world).clone(),
            None => World::bake_with(&scenario, &loading).map_err(|error| of_world(&scenario.name, &error))?,
        };
        if let Some(limit) = limit {
            // The clock of a world lets so many steps pass, and times out in the next one.
            world.step_limits.iter_mut().for_each(|steps| *steps = (*steps).min(limit.saturating_sub(1)));
        }
        let routes = Split::ALL.iter().flat_map(|&split| scenario.split(split)).copied().collect();
        let (scenario, world) = (Arc::new(scenario), Arc::new(world));
        let fingerprint = Arc::default();
        let place = Place { scenario, world, split, routes, max_episode_steps: limit, files, fingerprint };
        if baked.len() == KEPT {
            baked.remove(0);
        }
        baked.push(place.clone());
        Ok(place)
    }
}

/// What this process baked last. A fork begins with what its parent had; if a thread of the parent was baking, which
/// will never be done in the fork, with nothing.
fn baked() -> Baked {
    let process = std::process::id();
    let mut held = BAKED.lock().unwrap_or_else(PoisonError::into_inner);
    match &*held {
        Some((of, baked)) if *of == process => baked.clone(),
        of_parent => {
            let places = of_parent.as_ref().and_then(|(_, baked)| Some(baked.try_lock().ok()?.clone()));
            let baked = Baked::new(Mutex::new(places.unwrap_or_default()));
            held.insert((process, baked)).1.clone()
        }
    }
}

/// The places that were baked last, once no other thread bakes.
fn free<'a>(baked: &'a Baked, stop: &AtomicBool) -> Result<MutexGuard<'a, Vec<Place>>, Stopped> {
    loop {
        match baked.try_lock() {
            Ok(baked) => return Ok(baked),
            Err(TryLockError::Poisoned(poisoned)) => return Ok(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) if stop.load(Ordering::Relaxed) => return Err(Stopped),
            Err(TryLockError::WouldBlock) => std::thread::sleep(POLL),
        }
    }
}

fn of_world(benchmark: &str, error: &Error) -> PyErr {
    match error {
        Error::Invalid(invalid) => ScenarioError::new_err(format!("{benchmark}: {invalid}")),
        Error::Stopped(stopped) => PyValueError::new_err(stopped.to_string()),
    }
}

/// Names of the benchmarks that come with the package.
#[pyfunction]
pub fn scenario_names() -> Vec<&'static str> {
    Kind::Benchmark.names().collect()
}

/// The scenario files that come with the package: each one's path below a folder, and its text.
#[pyfunction]
pub fn scenario_files() -> Vec<(&'static str, &'static str)> {
    FILES.to_vec()
}

/// The text of a benchmark by its name or the path of its file.
#[pyfunction]
pub fn scenario_text(name_or_path: &str) -> PyResult<String> {
    Scenario::text_of(name_or_path).map_err(|error| errors::of_reader(&error))
}

/// A benchmark's keys as JSON.
#[pyfunction]
pub fn scenario_keys(name: &str, text: &str) -> PyResult<String> {
    let file = PathBuf::from(format!("{name} (a text)"));
    let (_, keys) = Reader::parse::<toml::Table>(&file, text).map_err(|error| errors::of_reader(&error))?;
    serde_json::to_string(&keys).map_err(|error| PyValueError::new_err(format!("{name}: {error}")))
}

/// The text of a benchmark whose keys are given as JSON.
#[pyfunction]
pub fn scenario_of_keys(keys: &str) -> PyResult<String> {
    let wrong = |error: &dyn std::fmt::Display| PyValueError::new_err(format!("benchmark: {error}"));
    let keys: toml::Table = serde_json::from_str(keys).map_err(|error| wrong(&error))?;
    toml::to_string(&keys).map_err(|error| wrong(&error))
}

/// What a policy must know of a benchmark.
#[derive(Debug, Clone)]
pub struct Table {
    /// The benchmark's name.
    pub benchmark: String,
    /// What its actions ask for.
    pub actions: Vec<Action>,
    /// Whether they are commands.
    pub is_continuous: bool,
    /// Names of the extras that it observes.
    pub extras: Vec<&'static str>,
    /// Whether it observes other vehicles.
    pub vehicles: bool,
}

/// What a policy file says of a benchmark.
pub fn policy_table(scenario: &Given, stop: &AtomicBool) -> PyResult<Table> {
    let cache = Cache::of_user();
    let loading = Loading { cache: cache.as_ref(), stop, ..Loading::PLAIN };
    let scenario = scenario.load(&loading)?;
    Ok(Table {
        benchmark: scenario.name.clone(),
        actions: scenario.actions(),
        is_continuous: scenario.action_kind == ActionKind::Continuous,
        extras: scenario.extras.names(),
        vehicles: scenario.observes_vehicles,
    })
}
