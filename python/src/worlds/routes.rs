//! The routes that are to be driven: a split, or routes by their names, which are those of the command line.

use std::fs;
use std::path::PathBuf;

use offtrack::files::reader::shortened;
use offtrack::map::procedural;
use offtrack::map::route::is_of;
use offtrack::scenario::{Scenario, Split};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors;

/// Most characters of the list of routes in a message.
const LONGEST_LIST: usize = 600;
/// Most characters of a name in a message.
const LONGEST_NAME: usize = 100;

/// A road that the benchmark does not have, such as one of a file.
#[derive(Debug, Clone)]
pub struct RoadFile {
    /// As the caller names it.
    path: String,
    /// Where it lies, of a file.
    file: Option<PathBuf>,
    /// As its routes are named: after the stem of a file.
    name: String,
}

impl RoadFile {
    fn new(path: &str, name: &str) -> RoadFile {
        RoadFile { path: path.to_owned(), file: fs::canonicalize(path).ok(), name: name.to_owned() }
    }

    /// The name of a route, or of the road, that is named by the file's path: as the caller named it, or another one of
    /// the same file.
    pub fn renamed(&self, name: &str) -> Option<String> {
        let of_same_file = || {
            let (road, _) = procedural::road_of(name)?;
            let is_same = self.file.is_some() && fs::canonicalize(road).ok() == self.file;
            is_same.then(|| &name[road.len()..])
        };
        name.strip_prefix(&self.path).or_else(of_same_file).map(|rest| format!("{}{rest}", self.name))
    }
}

/// Leaves the scenario the routes of a split, or those of any split that `names` has: each a route, or all routes of a
/// roundabout. One that the benchmark does not have is added, as `wide/7/12` is. Returns the name of the split that all
/// of these are of, or `routes`, and the files that were added.
pub fn narrow(
    scenario: &mut Scenario,
    split: &str,
    names: Option<&[String]>,
) -> PyResult<(&'static str, Vec<RoadFile>)> {
    let Some(split) = Split::named(split) else {
        let known = Split::ALL.map(Split::name).join(", ");
        return Err(PyValueError::new_err(format!("split: {split:?}; must be one of {known}")));
    };
    let Some(names) = names else {
        if scenario.split(split).is_empty() {
            let has = Split::ALL.into_iter().filter(|&split| !scenario.split(split).is_empty()).map(Split::name);
            let has = has.collect::<Vec<_>>().join(", ");
            return Err(PyValueError::new_err(format!(
                "split: {:?}; {} has no such routes, only {has}",
                split.name(),
                scenario.name
            )));
        }
        scenario.keep(&[split]);
        return Ok((split.name(), Vec::new()));
    };
    if names.is_empty() {
        return Err(PyValueError::new_err(
            "routes: empty; name at least one route or roundabout, or give None for a split",
        ));
    }
    let mut wanted = names.to_vec();
    let of_benchmark = known(scenario);
    let (mut added, mut files): (Vec<&str>, Vec<RoadFile>) = Default::default();
    for name in names {
        let road = match procedural::road_of(name) {
            Some((road, _)) if !of_benchmark.iter().any(|route| is_of(route, name)) => road,
            _ => continue,
        };
        if added.contains(&road) || scenario.places.iter().any(|place| place.roundabout.name == road) {
            continue;
        }
        let roundabout = procedural::find(road).map_err(|error| errors::of_reader(&error))?;
        if scenario.places.iter().any(|place| place.roundabout.name == roundabout.name) {
            let (name, other) = (shortened(name, LONGEST_NAME), &roundabout.name);
            return Err(PyValueError::new_err(format!(
                "routes: {name:?}; another road of the batch is {other} too: rename one"
            )));
        }
        let file = RoadFile::new(road, &roundabout.name);
        wanted.extend(names.iter().filter_map(|name| file.renamed(name)));
        files.push(file);
        scenario.add(roundabout, Split::Test).map_err(|error| errors::of_reader(&error))?;
        added.push(road);
    }
    let known = known(scenario);
    let is_known = |name: &str| known.iter().any(|route| is_of(route, name));
    let is_file = |name: &str| added.iter().any(|road| name.starts_with(road) && road.ends_with(".toml"));
    if let Some(unknown) = wanted.iter().find(|name| !is_known(name) && !is_file(name)) {
        let list = shortened(&known.join(", "), LONGEST_LIST);
        let name = shortened(unknown, LONGEST_NAME);
        return Err(PyValueError::new_err(format!(
            "routes: {name:?}; {} has {list}, and random roads have names as wide/7/12",
            scenario.name
        )));
    }
    scenario.retain(|_, route| wanted.iter().any(|name| is_of(&route.name, name)));
    let mut splits = Split::ALL.into_iter().filter(|&split| !scenario.split(split).is_empty());
    let first = splits.next().filter(|_| added.is_empty() && splits.next().is_none());
    Ok((first.map_or("routes", Split::name), files))
}

fn known(scenario: &Scenario) -> Vec<String> {
    scenario.routes().map(|(_, route)| route.name.clone()).collect()
}
