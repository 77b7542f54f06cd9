//! Bakes what a page asks for while it is open: random roads by name, and files that are dropped on it.
//!
//! The page calls this in the browser, as WebAssembly, where there are no files: a benchmark is one that comes with the
//! program or its text, a file its bytes. What comes of it has the sections that a world file has.

use std::path::Path;

use offtrack::files::cache::Loading;
use offtrack::files::reader::{Error as InputError, Reader, TEXT_LIMIT};
use offtrack::files::shipped::{Kind, Source};
use offtrack::map::Road;
use offtrack::map::chosen::{Choice, is_map};
use offtrack::map::opendrive::{Hand, Map, Ring};
use offtrack::map::procedural;
use offtrack::scenario::{Scenario, Split};
use offtrack::world::World;
use serde::Deserialize;
use serde_json::{Value, json};

use super::{Ground, shown};
use crate::error::Error;

/// Bytes that a built baker holds: they tell that it is one, of this version.
pub const STAMP: &str = concat!("offtrack baker ", env!("CARGO_PKG_VERSION"));
/// Most roads at once. One takes a tenth of a second and 0.5 MB.
const MOST_ROADS: usize = 24;

/// What WebAssembly's standard library says of every file.
const NO_FILES: &str = "operation not supported on this platform";

/// What a page asks for.
#[derive(Deserialize)]
struct Asked {
    benchmark: Benchmark,
    of: Of,
}

/// A benchmark by the text of its file; without one it is the program's of that name.
#[derive(Deserialize)]
struct Benchmark {
    name: String,
    text: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Of {
    /// Names of roads, with commas between them.
    Roads(String),
    /// A file, whose bytes follow; of a map the ring with this index among [`Map::rings`].
    File { name: String, ring: usize },
}

/// A baked benchmark; whether a file describes it, or roads alone; of a map, its rings.
struct Baked {
    ground: Ground,
    is_benchmark: bool,
    rings: Vec<Value>,
}

/// What is asked for, baked. `asked` is a line of JSON, and behind it a file's bytes: `{"benchmark": {"name":
/// "attard2023"}, "of": {"roads": "wide/7/12"}}`. The result is a line of JSON, the facts of a world file and the names
/// and lengths of its kinds of sections, and behind it their bytes.
///
/// # Errors
///
/// The reader's, each as it says it of a file, and more roads than a page bakes.
pub fn bake(asked: &[u8]) -> Result<Vec<u8>, Error> {
    let end = asked.iter().position(|&byte| byte == b'\n').unwrap_or(asked.len());
    let (line, bytes) = (&asked[..end], asked.get(end + 1..).unwrap_or_default());
    let asked: Asked = serde_json::from_slice(line).map_err(|error| wrong("asked", error.to_string()))?;
    let Baked { ground, is_benchmark, rings } = match &asked.of {
        Of::Roads(names) => on_roads(&asked.benchmark, names)?,
        Of::File { name, ring } if is_map(Path::new(name)) => on_map(&asked.benchmark, name, *ring, bytes)?,
        Of::File { name, .. } => of_text(&asked.benchmark, name, bytes)?,
    };
    let (mut facts, packed) = ground.printed();
    let (kinds, sections) = packed.raw();
    facts["kinds"] = json!(kinds);
    facts["is_benchmark"] = json!(is_benchmark);
    facts["rings"] = json!(rings);
    Ok([format!("{facts}\n").into_bytes(), sections].concat())
}

/// A benchmark on roads by their names.
fn on_roads(benchmark: &Benchmark, names: &str) -> Result<Baked, Error> {
    let mut all: Vec<&str> = names.split(',').map(str::trim).collect();
    let before = all.len();
    all.sort_unstable();
    all.dedup();
    if all.len() < before || MOST_ROADS < before {
        let expected = format!("{MOST_ROADS} at most, and each once");
        return Err(Error::Setting { name: "roads", value: names.to_owned(), expected });
    }
    on(benchmark, names.split(',').map(|name| Ok(procedural::find(name.trim())?)))
}

/// A benchmark on a ring of a map.
fn on_map(benchmark: &Benchmark, name: &str, ring: usize, bytes: &[u8]) -> Result<Baked, Error> {
    let file = Path::new(name);
    let map = Map::from_bytes(file, bytes.to_vec(), Hand::default())?;
    let rings = map.rings();
    // Without any, the reader says what it has found in place of one.
    let chosen = rings.get(ring).or(rings.first()).map(|ring| ring.centre);
    let road = Road::in_map(file, &map, &Choice { ring: chosen, ..Choice::default() })?;
    let described = |ring: &Ring| json!({ "centre": [ring.centre.x, ring.centre.y], "radius": ring.radius });
    Ok(Baked { rings: rings.iter().map(described).collect(), ..on(benchmark, [Ok(road)].into_iter())? })
}

/// A benchmark on the road that a file describes, or the benchmark that it describes.
fn of_text(benchmark: &Benchmark, name: &str, bytes: &[u8]) -> Result<Baked, Error> {
    let file = Path::new(name);
    let text = std::str::from_utf8(bytes).map_err(|error| wrong(name, error.to_string()))?;
    if TEXT_LIMIT < text.len() as u64 {
        return Err(InputError::TooLarge { file: file.to_owned(), limit: TEXT_LIMIT }.into());
    }
    let (reader, table) = Reader::parse::<toml::Table>(file, text)?;
    if !["vehicle", "actions", "reward"].iter().any(|key| table.contains_key(*key)) {
        return on(benchmark, [Ok(Road::from_text(file, text)?)].into_iter());
    }
    let n_roads = n_random(&table);
    if MOST_ROADS < n_roads {
        let expected = format!("a page bakes {MOST_ROADS} at most: ask for fewer under train, validation and test");
        return Err(reader.invalid("procedural", format_args!("{n_roads} roads"), expected).into());
    }
    let stem = Source::Disk(file.to_owned()).stem();
    let scenario = Scenario::parse(&stem, text, None, &Loading::PLAIN);
    let scenario = scenario.map_err(|error| of_file(name, &stem, &error))?;
    Ok(Baked { ground: baked(scenario, Some(text.to_owned()))?, is_benchmark: true, rings: Vec::new() })
}

/// The number of random roads that a benchmark's file asks for, if it says so as it should.
fn n_random(file: &toml::Table) -> usize {
    let Some(random) = file.get("procedural").and_then(toml::Value::as_table) else { return 0 };
    let bounds = |split: &Split| Some(random.get(split.name())?.as_array()?.iter().filter_map(toml::Value::as_integer));
    let length =
        |bounds: Vec<i64>| if let [from, to] = bounds[..] { to.saturating_sub(from).max(0) as usize } else { 0 };
    Split::ALL.iter().filter_map(bounds).map(|bounds| length(bounds.collect())).sum()
}

/// A benchmark on these roads alone.
fn on(benchmark: &Benchmark, roads: impl Iterator<Item = Result<Road, Error>>) -> Result<Baked, Error> {
    let Benchmark { name, text } = benchmark;
    let read = match text {
        Some(text) => Scenario::without_roads(name, text),
        None => Source::named(Kind::Benchmark, name)
            .and_then(|source| source.text())
            .and_then(|text| Scenario::without_roads(name, &text)),
    };
    let mut scenario = read.map_err(|error| of_file(&format!("{name}.toml"), name, &error))?;
    for road in roads {
        scenario.add(road?, Split::Test)?;
    }
    Ok(Baked { ground: baked(scenario, text.clone())?, is_benchmark: false, rings: Vec::new() })
}

fn baked(scenario: Scenario, text: Option<String>) -> Result<Ground, Error> {
    let scenario = shown(scenario);
    let name = &scenario.name;
    let world = World::bake(&scenario)?;
    if world.is_continuous() {
        return Err(wrong(name, "has continuous actions, and a page steers by actions.steer_levels".to_owned()));
    }
    Ok(Ground { scenario, world: world.into(), text, is_whole: false })
}

/// The first vehicle of a benchmark whose file is not one that comes with the program: a page, which has a benchmark's
/// text alone, bakes no roads for it. `None` of a text that is no benchmark.
pub fn vehicle_beyond(benchmark: &Source) -> Option<String> {
    let table = benchmark.text().ok()?.parse::<toml::Table>().ok()?;
    let files: Vec<&str> = match table.get("vehicle")? {
        toml::Value::Array(all) => all.iter().filter_map(|one| one.get("file")?.as_str()).collect(),
        one => one.as_str().into_iter().collect(),
    };
    let alone = Source::Text { name: String::new(), text: String::new(), folder: None };
    let is_beyond = |file: &&str| {
        let path = Path::new(file);
        let is_path = is_map(path) || path.extension().is_some_and(|extension| extension == "toml");
        let [here, there] = [benchmark.relative(path), alone.relative(path)];
        let is_same = || matches!((here.text(), there.text()), (Ok(here), Ok(there)) if here == there);
        is_path && !(matches!(there, Source::Embedded(_)) && is_same())
    };
    files.into_iter().find(is_beyond).map(str::to_owned)
}

fn wrong(file: &str, message: String) -> Error {
    Error::Contents { file: file.into(), message }
}

/// An error of a benchmark's text, said of its file. Files beside it are out of reach.
fn of_file(file: &str, stem: &str, error: &InputError) -> Error {
    let text = error.to_string();
    let said = text.strip_prefix(&format!("{stem} (a text): ")).unwrap_or(&text);
    let words = "a page cannot read files beside this one; `offtrack web --world` makes one file of all";
    wrong(file, said.replace(NO_FILES, words))
}

#[cfg(test)]
mod tests;
