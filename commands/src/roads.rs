//! Benchmarks and roads by name, as commands take them: with a cache, a bar, and single routes in place of a split.

use std::path::Path;
use std::sync::Arc;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use offtrack::files::cache::{Cache, Loading, Progress};
use offtrack::files::reader::shortened;
use offtrack::map::Road;
use offtrack::map::chosen::is_map;
use offtrack::map::drawing::is_drawing;
use offtrack::map::procedural;
use offtrack::map::route::is_of;
use offtrack::scenario::{Place, Scenario, Split};
use offtrack::world::World;
use offtrack_evaluation::comparison::Asked;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;

use crate::import::PlaceArgs;
use crate::progress::Bar;

/// Roads that take no progress bar.
pub const FEW: usize = 20;
/// Most characters of the list of routes in a message.
const LONGEST_LIST: usize = 600;

/// A benchmark by its name or path. What is known of random roads is kept in the user's cache.
pub fn benchmark(name: &str) -> Result<Scenario, Error> {
    Ok(loading("drawing", |loading| Scenario::load(name, loading))?)
}

/// What a flag that names a split takes.
pub fn split() -> impl TypedValueParser<Value = Split> {
    let names = [Split::Test, Split::Validation, Split::Train].map(Split::name);
    PossibleValuesParser::new(names).try_map(|name| Split::named(&name).ok_or("is no split"))
}

/// The benchmark that an evaluation was asked for, with the routes of its split alone.
pub fn asked(asked: &Asked, split: Split) -> Result<Scenario, Error> {
    let mut scenario = with_load(benchmark(&asked.benchmark)?, asked.load.as_deref())?;
    if !asked.route.is_empty() {
        narrow(&mut scenario, "--route", &asked.route, &[split])?;
    }
    keep(&mut scenario, split, &asked.benchmark)?;
    Ok(scenario)
}

/// A road by its name, the path of its file or of a map, of which the flags choose a place; or a random road.
pub fn road(name: &str, place: &PlaceArgs) -> Result<Road, Error> {
    let file = Path::new(name);
    if is_drawing(file) {
        let expected = "is a drawing: `offtrack import` makes an outline of it, NAME.outline.toml; give that";
        return Err(Error::Setting { name: "ROAD", value: name.to_owned(), expected: expected.into() });
    }
    Ok(if is_map(file) { Road::from_map(file, &place.choice())? } else { procedural::find(name)? })
}

/// The benchmark's world, with the fields of its roundabouts from the user's cache.
pub fn world(scenario: &Scenario) -> Result<Arc<World>, Error> {
    let baked = loading("baking", |loading| World::bake_with(scenario, loading));
    Ok(baked.map_err(|error| Error::contents(Path::new(&scenario.name), error.to_string()))?.into())
}

/// Does `work` on roads with the user's cache and, where there are many, a bar.
pub fn loading<T>(action: &str, work: impl FnOnce(&Loading) -> T) -> T {
    let cache = Cache::of_user();
    let done = {
        let bar = Bar::new(action, "roads", 0);
        let watcher = |progress: Progress| {
            if FEW < progress.total {
                bar.set(progress.done, progress.total);
            }
        };
        work(&Loading { cache: cache.as_ref(), watcher: &watcher, ..Loading::PLAIN })
    };
    if let Some(failure) = cache.as_ref().and_then(Cache::failure) {
        files::say(&format!("note: {failure}; the next command computes them again"));
    }
    done
}

/// Leaves the benchmark the routes that `flag` names: each a route, or all routes of a roundabout. Those of the
/// benchmark must be in one of `splits`. A road that the benchmark does not have is added to the last of them.
pub fn narrow(scenario: &mut Scenario, flag: &'static str, names: &[String], splits: &[Split]) -> Result<(), Error> {
    let mut added: Vec<(String, Road)> = Vec::new();
    for name in names {
        let of = |split: Split| scenario.split_names(split).iter().any(|route| is_of(route, name));
        if splits.iter().any(|&split| of(split)) {
            continue;
        }
        if let Some(split) = Split::ALL.into_iter().find(|&split| of(split)) {
            let expected = format!("is not in the split asked for: give --split {}", split.name());
            return Err(Error::Setting { name: flag, value: name.clone(), expected });
        }
        let (road, route) = procedural::road_of(name).ok_or_else(|| unknown(scenario, flag, name))?;
        if scenario.places.iter().any(|place| place.roundabout.name == road) {
            return Err(unknown(scenario, flag, name));
        }
        let found = match added.iter().position(|(known, _)| known == road) {
            Some(found) => found,
            None => {
                let roundabout = procedural::find(road)?;
                let others = scenario.places.iter().map(|place| &place.roundabout.name);
                if others.chain(added.iter().map(|(_, other)| &other.name)).any(|other| *other == roundabout.name) {
                    let expected = format!("another road of the benchmark is {} too: rename one", roundabout.name);
                    return Err(Error::Setting { name: flag, value: name.clone(), expected });
                }
                added.push((road.to_owned(), roundabout));
                added.len() - 1
            }
        };
        // The road of a file is named after its stem.
        if let Some(route) = route {
            let alone = scenario.on(added[found].1.clone())?;
            if !alone.routes().any(|(_, other)| short(&other.name) == route) {
                return Err(unknown(&alone, flag, name));
            }
        }
    }
    let split = splits.last().copied().unwrap_or(Split::Test);
    let mut wanted = names.to_vec();
    for (road, roundabout) in added {
        // Routes of a file are named after its stem.
        wanted.extend(
            names
                .iter()
                .filter_map(|name| name.strip_prefix(road.as_str()))
                .map(|rest| format!("{}{rest}", roundabout.name)),
        );
        scenario.add(roundabout, split)?;
    }
    scenario.keep(splits);
    scenario.retain(|_, route| wanted.iter().any(|name| is_of(&route.name, name)));
    Ok(())
}

/// Leaves the benchmark, which a command was given as `benchmark`, the routes of one split.
pub fn keep(scenario: &mut Scenario, split: Split, benchmark: &str) -> Result<(), Error> {
    if scenario.split(split).is_empty() {
        let name = split.name();
        let has = Split::ALL.into_iter().filter(|&other| !scenario.split(other).is_empty()).map(Split::name);
        let has = shortened(&has.collect::<Vec<_>>().join(", "), LONGEST_LIST);
        let expected = format!(
            "{} has routes under {has} alone; list some under `{name}`, or ask for another split",
            shortened(benchmark, 200)
        );
        return Err(Error::Setting { name: "--split", value: name.to_owned(), expected });
    }
    scenario.keep(&[split]);
    Ok(())
}

/// A route's name within its roundabout.
fn short(route: &str) -> &str {
    route.rsplit('/').next().unwrap_or(route)
}

/// The error for a name that no route has. It lists the routes of the roundabout that the name begins with, or one of
/// each roundabout.
pub fn unknown(scenario: &Scenario, flag: &'static str, name: &str) -> Error {
    let of = |place: &Place| place.routes.iter().map(|route| route.name.clone()).collect::<Vec<_>>();
    let begins = |place: &&Place| {
        name.strip_prefix(&place.roundabout.name).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    };
    let meant = scenario.places.iter().find(begins);
    let names =
        meant.map_or_else(|| scenario.places.iter().filter_map(|place| of(place).first().cloned()).collect(), of);
    let (from, list) = (&scenario.name, shortened(&names.join(", "), LONGEST_LIST));
    let expected = match meant {
        Some(place) => format!("of {} the benchmark {from} has {list}", place.roundabout.name),
        None => format!(
            "a route of the benchmark {from} is needed, such as {list}, or one of a random road, such as \
             wide/7/12/S-left-3"
        ),
    };
    Error::Setting { name: flag, value: name.to_owned(), expected }
}

/// The benchmark with the trucks of this load alone; the whole of it where none is named.
pub fn with_load(scenario: Scenario, load: Option<&str>) -> Result<Scenario, Error> {
    let Some(load) = load else { return Ok(scenario) };
    scenario.with_classes(|class| class.load == load).ok_or_else(|| {
        let mut known: Vec<String> = scenario.classes().into_iter().map(|class| class.load).collect();
        known.sort();
        known.dedup();
        Error::Setting {
            name: "--load",
            value: load.to_owned(),
            expected: format!("{} has {}", scenario.name, known.join(", ")),
        }
    })
}
