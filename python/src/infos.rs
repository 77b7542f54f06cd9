//! Infos of Gymnasium's vector environments: for each key an array of all trucks and a mask `_key`.

use numpy::{PyArray1, PyArrayMethods};
use offtrack::layout::{Ended, Truck};
use offtrack::world::World;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::observed::N_VALUES_MAX;

/// What infos name of an episode: its route, and vehicle and load where the benchmark has several.
const KEYS: [&str; 3] = ["route", "vehicle", "load"];

/// What an episode is drawn from.
#[derive(Clone, Copy)]
pub struct Episode {
    /// Index of its route in the world.
    pub route: u32,
    /// Index of its vehicle in the world.
    pub vehicle: u32,
}

impl Episode {
    /// The episode that a truck is in.
    pub fn of(truck: &Truck) -> Episode {
        Episode { route: truck.route, vehicle: truck.vehicle }
    }
}

/// An episode that the last step ended.
pub struct End {
    /// Index of the truck.
    pub env: usize,
    /// Why the episode ended.
    pub code: u32,
    /// Route and vehicle of the episode.
    pub episode: Episode,
    /// The observation after the last action; zeros behind the benchmark's values.
    pub observation: [f32; N_VALUES_MAX],
}

/// Names of a world's routes and vehicles.
pub struct Names {
    routes: Vec<Py<PyString>>,
    /// Vehicle and load of each row of the world's table; empty where all rows have the same.
    vehicles: Vec<[Py<PyString>; 2]>,
}

impl Names {
    /// The names of a world's routes and vehicles.
    pub fn new(py: Python, world: &World) -> Names {
        let text = |name: &String| PyString::new(py, name).unbind();
        let classes: Vec<_> = world.classes.iter().map(|class| [text(&class.vehicle), text(&class.load)]).collect();
        let pair = |class: u32| classes[class as usize].each_ref().map(|name| name.clone_ref(py));
        let rows = world.rigs.iter().filter(|_| 1 < classes.len());
        Names {
            routes: world.route_names.iter().map(text).collect(),
            vehicles: rows.map(|rig| pair(rig.class_index)).collect(),
        }
    }

    /// What an episode's [`KEYS`] are.
    fn of(&self, episode: Episode) -> impl Iterator<Item = &Py<PyString>> {
        let vehicle = self.vehicles.get(episode.vehicle as usize);
        std::iter::once(&self.routes[episode.route as usize]).chain(vehicle.into_iter().flatten())
    }

    /// Keys that an episode has.
    fn keys(&self) -> &'static [&'static str] {
        if self.vehicles.is_empty() { &KEYS[..1] } else { &KEYS }
    }

    /// An array of each of the keys that names some trucks' episodes; `None` of the others.
    fn arrays<'py>(
        &self,
        py: Python<'py>,
        n_envs: usize,
        episodes: impl Iterator<Item = (usize, Episode)>,
    ) -> PyResult<Vec<(&'static str, Bound<'py, PyAny>)>> {
        let keyed = |key: &&'static str| Ok((*key, objects(py, n_envs)?));
        let arrays = self.keys().iter().map(keyed).collect::<PyResult<Vec<_>>>()?;
        for (env, episode) in episodes {
            for ((_, array), name) in arrays.iter().zip(self.of(episode)) {
                array.set_item(env, name)?;
            }
        }
        Ok(arrays)
    }
}

/// How infos of ended episodes are told.
pub struct Infos<'a> {
    /// Names of routes and vehicles; None for their indices, and last observations in one array of numbers.
    pub names: Option<&'a Names>,
    /// Whether other episodes have begun in the same step: those of the end are then in `final_info`.
    pub is_same_step: bool,
}

impl Infos<'_> {
    /// The infos of the episodes that a step ended, whose last observations have `n_values` values. `episodes` has
    /// those that trucks are in after the step; of `waiting` ones, which wait for their group, those that have ended.
    pub fn of_ends<'py>(
        &self,
        py: Python<'py>,
        ends: &[End],
        episodes: &[Episode],
        waiting: &[bool],
        n_values: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let n_envs = episodes.len();
        let mut mask = vec![false; n_envs];
        let mut codes = vec![0i64; n_envs];
        let mut successes = vec![false; n_envs];
        for End { env, code, .. } in ends {
            mask[*env] = true;
            codes[*env] = i64::from(*code);
            successes[*env] = *code == Ended::Arrived as u32;
        }
        let has_begun: Vec<bool> = mask.iter().zip(waiting).map(|(&ended, &waits)| ended && !waits).collect();
        let infos = PyDict::new(py);
        // Each key has a mask of its own, as in `SyncVectorEnv`: who writes into one changes no other.
        let put = |infos: &Bound<PyDict>, key: &str, values: Bound<PyAny>, mask: &[bool]| {
            infos.set_item(key, values)?;
            infos.set_item(format!("_{key}"), PyArray1::from_slice(py, mask))
        };
        put(&infos, "ended", PyArray1::from_vec(py, codes).into_any(), &mask)?;
        put(&infos, "is_success", PyArray1::from_vec(py, successes).into_any(), &mask)?;
        for (key, array) in self.episodes(py, n_envs, ends.iter().map(|end| (end.env, end.episode)))? {
            put(&infos, key, array, &mask)?;
        }
        if !self.is_same_step {
            return Ok(infos);
        }
        let with_final = PyDict::new(py);
        put(&with_final, "final_obs", self.last_observations(py, n_envs, ends, n_values)?, &mask)?;
        put(&with_final, "final_info", infos.into_any(), &mask)?;
        let begun = ends.iter().map(|end| end.env).filter(|&env| !waiting[env]);
        for (key, array) in self.episodes(py, n_envs, begun.map(|env| (env, episodes[env])))? {
            put(&with_final, key, array, &has_begun)?;
        }
        Ok(with_final)
    }

    /// What some trucks' episodes were drawn from, of all trucks: names, or indices with 0 for the others.
    fn episodes<'py>(
        &self,
        py: Python<'py>,
        n_envs: usize,
        episodes: impl Iterator<Item = (usize, Episode)>,
    ) -> PyResult<Vec<(&'static str, Bound<'py, PyAny>)>> {
        if let Some(names) = self.names {
            return names.arrays(py, n_envs, episodes);
        }
        let (mut routes, mut vehicles) = (vec![0i64; n_envs], vec![0i64; n_envs]);
        for (env, Episode { route, vehicle }) in episodes {
            (routes[env], vehicles[env]) = (route.into(), vehicle.into());
        }
        let array = |values| PyArray1::from_vec(py, values).into_any();
        Ok(vec![(KEYS[0], array(routes)), (KEYS[1], array(vehicles))])
    }

    /// The last observations of ended episodes, of all trucks: arrays and None, or rows with zeros for the others.
    fn last_observations<'py>(
        &self,
        py: Python<'py>,
        n_envs: usize,
        ends: &[End],
        n_values: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        if self.names.is_none() {
            let mut rows = vec![0.0f32; n_envs * n_values];
            for End { env, observation, .. } in ends {
                rows[env * n_values..][..n_values].copy_from_slice(&observation[..n_values]);
            }
            return Ok(PyArray1::from_vec(py, rows).reshape([n_envs, n_values])?.into_any());
        }
        let last = objects(py, n_envs)?;
        for End { env, observation, .. } in ends {
            last.set_item(env, PyArray1::from_slice(py, &observation[..n_values]))?;
        }
        Ok(last)
    }
}

/// An array of objects: an empty one holds None, and numpy makes it faster than it could be filled here.
fn objects(py: Python<'_>, n_envs: usize) -> PyResult<Bound<'_, PyAny>> {
    py.import(intern!(py, "numpy"))?.call_method1(intern!(py, "empty"), (n_envs, intern!(py, "O")))
}
