//! Scenarios, read and baked once a process: environments of one scenario share a world.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, Mutex, PoisonError};

use offtrack::layout::Action;
use offtrack::loading::{Cache, Loading};
use offtrack::scenario::{Scenario, Split};
use offtrack::shipped::Kind;
use offtrack::world::World;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors;

/// Most worlds that are kept for the next batch.
const KEPT: usize = 8;
/// Most characters of the list of routes in a message.
const LONGEST_LIST: usize = 600;

/// What trucks drive in.
#[derive(Debug, Clone)]
pub struct Place {
    /// The benchmark, of which the routes to be driven are left.
    pub scenario: Arc<Scenario>,
    /// The same, baked.
    pub world: Arc<World>,
    /// Routes to draw from, as indices into the world's.
    pub routes: Vec<u32>,
}

/// What was baked, by the text and the hash of the scenario.
static BAKED: Mutex<Vec<((u64, usize), Place)>> = Mutex::new(Vec::new());

impl Place {
    /// A benchmark's split, or the routes of any split that `names` has: each a route, or all routes of a roundabout.
    pub fn find(scenario: &str, split: &str, names: Option<&[String]>) -> PyResult<Place> {
        let cache = Cache::of_user();
        let loading = Loading { cache: cache.as_ref(), ..Loading::PLAIN };
        let mut scenario = Scenario::load(scenario, &loading).map_err(|error| errors::of_reader(&error))?;
        narrow(&mut scenario, split, names)?;
        let key = key(&scenario);
        let mut baked = BAKED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, place)) = baked.iter().find(|(known, _)| *known == key) {
            return Ok(place.clone());
        }
        let world = World::bake_with(&scenario, &loading).map_err(|error| PyValueError::new_err(error.to_string()))?;
        let routes = Split::ALL.iter().flat_map(|&split| scenario.split(split)).copied().collect();
        let place = Place { scenario: Arc::new(scenario), world: Arc::new(world), routes };
        if baked.len() == KEPT {
            baked.remove(0);
        }
        baked.push((key, place.clone()));
        Ok(place)
    }
}

/// Leaves the scenario the routes that are to be driven.
fn narrow(scenario: &mut Scenario, split: &str, names: Option<&[String]>) -> PyResult<()> {
    let Some(names) = names else {
        let Some(split) = Split::ALL.into_iter().find(|known| known.name() == split) else {
            let known = Split::ALL.map(Split::name).join(", ");
            return Err(PyValueError::new_err(format!("split: {split:?}; must be one of {known}")));
        };
        if scenario.split(split).is_empty() {
            let has = Split::ALL.into_iter().filter(|&split| !scenario.split(split).is_empty()).map(Split::name);
            let has = has.collect::<Vec<_>>().join(", ");
            return Err(PyValueError::new_err(format!("split: {:?}; {} has no such routes, only {has}", split.name(), scenario.name)));
        }
        scenario.keep(&[split]);
        return Ok(());
    };
    if names.is_empty() {
        return Err(PyValueError::new_err("routes: empty; name at least one route or roundabout, or give None for a split"));
    }
    let is_of = |route: &str, name: &str| route == name || route.strip_prefix(name).is_some_and(|rest| rest.starts_with('/'));
    let known: Vec<String> = scenario.routes().map(|(_, route)| route.name.clone()).collect();
    if let Some(unknown) = names.iter().find(|name| !known.iter().any(|route| is_of(route, name))) {
        let list = offtrack::reader::shortened(&known.join(", "), LONGEST_LIST);
        return Err(PyValueError::new_err(format!("routes: {unknown:?}; {} has {list}", scenario.name)));
    }
    scenario.retain(|_, route| names.iter().any(|name| is_of(&route.name, name)));
    Ok(())
}

/// Equal scenarios have equal keys.
fn key(scenario: &Scenario) -> (u64, usize) {
    let text = format!("{scenario:?}");
    let mut hasher = DefaultHasher::new();
    text.hash(&mut hasher);
    (hasher.finish(), text.len())
}

/// Names of the benchmarks that come with the package.
#[pyfunction]
pub fn scenario_names() -> Vec<&'static str> {
    Kind::Benchmark.names().collect()
}

/// A benchmark's name, its action table, and the names of the extras that it observes.
pub fn policy_table(scenario: &str) -> PyResult<(String, Vec<Action>, Vec<&'static str>)> {
    let cache = Cache::of_user();
    let loading = Loading { cache: cache.as_ref(), ..Loading::PLAIN };
    let scenario = Scenario::load(scenario, &loading).map_err(|error| errors::of_reader(&error))?;
    let substep = (scenario.step / f64::from(scenario.n_substeps)) as f32;
    let rig = scenario.vehicle.rig(&scenario.load, substep, scenario.steer_max);
    Ok((scenario.name.clone(), scenario.actions(rig.steer_max), scenario.extras.names()))
}
