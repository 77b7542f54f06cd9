//! `scenarios/README.md` says of every key of every file what the readers do: its range, its unit, its default. A key
//! without a row, a row without a key, and a row that says something else are all reported at once.

mod check;
mod places;
mod rows;

use std::fmt::Debug;
use std::path::Path;

use offtrack::files::reader::Error;
use offtrack::map::Road;
use offtrack::map::procedural::Distribution;
use offtrack::scenario::Scenario;
use offtrack::vehicle::Vehicle;
use toml::Value;

use check::{Found, Kind, Read, compared};
use places::{parts, places, with};
use rows::{Row, rows_of};

/// The folder of the scenario files, in the folder of this crate.
const SCENARIOS: &str = "scenarios";

fn text_of(file: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(SCENARIOS).join(file)).unwrap()
}

fn document(text: &str) -> Value {
    Value::Table(text.parse().unwrap())
}

/// A document with more keys, each in a table that there is.
fn with_keys(text: &str, keys: &[(&str, &str)]) -> Value {
    keys.iter().fold(document(text), |whole, (key, value)| {
        let (table, name) = key.rsplit_once('.').unwrap_or(("", key));
        let table = if table.is_empty() { vec![] } else { places(&whole, &parts(table)).swap_remove(0) };
        let place = [&table[..], &[places::Step::Key((*name).to_owned())]].concat();
        with(&whole, &place, document(&format!("value = {value}"))["value"].clone())
    })
}

fn boxed<T: Debug + 'static>(read: Result<T, Error>) -> Result<Box<dyn Debug>, Error> {
    read.map(|read| Box::new(read) as Box<dyn Debug>)
}

/// Everything that a benchmark of one vehicle has to say.
const BENCHMARK: &str = r#"
gutter = "drivable"
steer_max_deg = 40.0
[time]
step = 0.1
substeps = 2
[field]
cell = 1.0
[actions]
kind = "levels"
steer_levels = [-0.5, 0.0, 0.5]
speeds_kmh = [10.0, 20.0, 30.0]
speed_changes_kmh = [-5.0, 0.0, 5.0]
[sensors]
range = 20.0
[observation]
extras = "mass"
vehicles = true
[disturbances]
range_noise = 0.05
dropped_rays = 0.01
position_offset = 0.1
heading_offset_deg = 0.5
position_noise = 0.03
heading_noise_deg = 0.3
map_offset = 0.15
observation_delay = [0, 1]
action_delay = [0, 2]
[traffic]
demand = [300.0, 900.0]
drivers = "timid"
vans = 0.1
buses = 0.02
rigid_trucks = 0.03
tractor_trailers = 0.05
rude = [0.0, 0.1]
courtesy = 0.3
waiting = 60.0
hindrance = -0.5
group = 1
[start]
offset = 0.2
heading_deg = 1.0
speed_kmh = [20.0, 25.0]
along = 0.5
[ending]
stray_distance = 8.0
jackknife_deg = 80.0
rollover_ratio = 0.9
time_limit = 2.0
clock = "feasible"
[reward]
waypoint = 100.0
lane_distance = -1.5
lane_distance_limit = 4.0
clearance = -1.0
clearance_limit = 0.4
failure = -500.0
apron = -2.0
[routes]
approach = 26.0
departure = 30.0
spacing = 1.5
"#;

const ONE_VEHICLE: &str = "vehicle = \"daf_xf\"\nload = \"empty\"\n";

const SEVERAL_VEHICLES: &str = r#"
[[vehicle]]
file = "daf_xf"
loads = { empty = 1.0, laden = 2.0 }
share = 2.0
drawn = true
[vehicle.model]
slip_lever = 4.0
yaw_lag = 1.0
drive_lag = 0.1
brake_lag = 0.1
steer_delay = 0.1
power = 330000.0
friction_ellipse = true
crossfall = 0.01
slip_growth = 1.0
understeer_deg = 1.2
fifth_wheel_load = 0.26
[draw]
n_vehicles = 512
trailer_wheelbase = [-0.5, 0.4]
tractor_wheelbase = [-0.1, 0.3]
fifth_wheel = [-0.1, 0.2]
centre_of_gravity = [-0.12, 0.15]
roll_gain = [0.85, 1.15]
roll_frequency = [0.85, 1.15]
roll_damping = [0.7, 1.5]
slip = [0.85, 1.15]
friction = [0.6, 1.1]
steer_rate = [0.75, 1.25]
acceleration_max = [0.8, 1.2]
steer_delay = [0.0, 0.15]
drive_lag = [0.3, 0.6]
brake_lag = [0.2, 0.5]
yaw_lag = [0.8, 1.6]
slip_growth = [0.0, 1.5]
understeer_deg = [-0.5, 1.5]
"#;

const RANDOM_ROADS: &str = r#"
[procedural]
distribution = "wide"
seed = 7
count = 8
train = [0, 1]
validation = [1, 2]
test = [2, 3]
"#;

const FILE: &str = r#"
[[roundabout]]
file = "40m"
train = ["E-left-1"]
validation = ["E-left-2"]
test = ["E-left-3"]
"#;

const MAP: &str = r#"
[[roundabout]]
file = "SCENARIOS/maps/sumo_ring22.xodr"
ring = [140.0, 140.0]
name = "ring"
arms = ["A", "B", "C", "D"]
hand = "right"
train = "all"
"#;

const JUNCTION: &str = r#"
[[roundabout]]
file = "SCENARIOS/maps/Town03.xodr"
train = "all"
[[roundabout.way]]
from = { road = 90, lane = 1 }
to = { road = "34", lane = -1 }
"#;

fn benchmarks() -> Kind {
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join(SCENARIOS);
    let scenarios = scenarios.to_str().unwrap().replace('\\', "/");
    let bodies = [
        (ONE_VEHICLE, FILE),
        ("", &format!("{SEVERAL_VEHICLES}{FILE}")),
        (ONE_VEHICLE, RANDOM_ROADS),
        (ONE_VEHICLE, MAP),
        (ONE_VEHICLE, JUNCTION),
    ];
    let documents =
        bodies.map(|(head, tail)| document(&format!("{head}{BENCHMARK}{tail}").replace("SCENARIOS", &scenarios)));
    Kind { documents: documents.into(), read: |path| boxed(Scenario::read(path)) }
}

fn roundabouts() -> Kind {
    let keys = [
        ("hand", "\"right\""),
        ("ring.lanes", "2"),
        ("ring.apron", "0.0"),
        ("arm[].lane_width", "3.7"),
        ("arm[].entry.lanes", "2"),
        ("arm[].exit.lanes", "2"),
    ];
    let documents = Vec::from([
        with_keys(&text_of("roundabouts/16m.toml"), &keys),
        document(&text_of("roundabouts/40m-maps.toml")),
    ]);
    Kind { documents, read: |path| boxed(Road::read(path)) }
}

/// A distribution keeps its file's text, which differs where a key is left out; its keys come last.
fn keys_of_distribution(path: &Path) -> Result<Box<dyn Debug>, Error> {
    let read = format!("{:?}", Distribution::read(path)?);
    Ok(Box::new(read.rsplit_once(", keys: ").unwrap().1.to_owned()))
}

fn distributions() -> Kind {
    let documents = Vec::from([with_keys(&text_of("distributions/mixed.toml"), &[("ring.apron", "[0.5, 2.5]")])]);
    Kind { documents, read: keys_of_distribution }
}

fn vehicles() -> Kind {
    let mounts = "[[4.0, 0.0]".to_owned() + &", [4.0, 0.0]".repeat(12) + "]";
    let keys = [
        ("tractor.friction", "0.6"),
        ("speed_control", "{ gain = 0.7, integral_gain = 0.04, integral_band_kmh = 0.4, braking = -2.0 }"),
        ("sensors", &format!("{{ trailer_first = 1.0, trailer_last = 13.0, tractor_mounts = {mounts} }}")),
        ("model", "{ slip_lever = 1.0, yaw_lag = 1.0, drive_lag = 0.1, brake_lag = 0.1, steer_delay = 0.1 }"),
        ("model.power", "3e5"),
        ("model.friction_ellipse", "true"),
        ("model.crossfall", "0.01"),
        ("model.slip_growth", "1.0"),
        ("model.understeer_deg", "1.2"),
        ("model.fifth_wheel_load", "0.26"),
    ];
    Kind {
        documents: Vec::from([with_keys(&text_of("vehicles/daf_xf.toml"), &keys)]),
        read: |path| boxed(Vehicle::read(path)),
    }
}

/// The rows of a section; of `vehicle[].model`, which has the keys of a vehicle's `model`, those too.
fn rows(readme: &str, title: &str) -> Vec<Row> {
    let mut rows = rows_of(readme, title);
    if title == "Benchmarks" {
        let of_vehicles = rows_of(readme, "Vehicles").into_iter().filter(|row| row.key.starts_with("model."));
        rows.extend(of_vehicles.map(|row| Row { key: format!("vehicle[].{}", row.key), ..row }));
    }
    rows
}

fn agreeing(title: &str, kind: &Kind) -> Found {
    let found = compared(kind, &rows(&text_of("README.md"), title));
    let faults: Vec<&str> = found.faults.iter().map(String::as_str).collect();
    assert!(faults.is_empty(), "{SCENARIOS}/README.md, {title}:\n{}", faults.join("\n"));
    found
}

/// At least so many were compared: ends of ranges, lengths of lists, defaults, required keys, lists of words, tables.
fn at_least(found: &Found, expected: [usize; 6]) {
    let compared = [found.ends, found.counts, found.defaults, found.required, found.words, found.tables];
    assert!(compared.iter().zip(expected).all(|(compared, expected)| expected <= *compared), "{compared:?}");
}

#[test]
fn every_key_of_a_benchmark_is_documented_as_it_is_read() {
    at_least(&agreeing("Benchmarks", &benchmarks()), [90, 3, 20, 20, 4, 50]);
}

#[test]
fn every_key_of_a_roundabout_is_documented_as_it_is_read() {
    at_least(&agreeing("Roundabouts", &roundabouts()), [50, 10, 2, 30, 2, 20]);
}

#[test]
fn every_key_of_a_distribution_is_documented_as_it_is_read() {
    at_least(&agreeing("Distributions", &distributions()), [100, 0, 2, 50, 0, 16]);
}

#[test]
fn every_key_of_a_vehicle_is_documented_as_it_is_read() {
    at_least(&agreeing("Vehicles", &vehicles()), [130, 0, 10, 60, 0, 12]);
}

#[test]
fn every_benchmark_has_a_row() {
    let folder = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(SCENARIOS)).unwrap();
    let mut files: Vec<String> = folder.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    files.retain(|file| file.ends_with(".toml"));
    assert!(29 <= files.len(), "{files:?}");
    let readme = text_of("README.md");
    files.retain(|file| !readme.contains(&format!("\n| `{file}` | ")));
    assert!(files.is_empty(), "{SCENARIOS}/README.md: add rows to the table of benchmarks for {files:?}");
}

#[test]
fn a_wrong_row_and_a_missing_one_are_found_and_all_at_once() {
    let read: Read = |path| boxed(Vehicle::read(path));
    let kind = Kind { read, ..vehicles() };
    let changes = [
        (
            "| `trailer.width` | m | 1..4 |",
            "| `trailer.width` | m | 1..5 |",
            "`trailer.width` has the range 1..5 in its row",
        ),
        (
            "| `tractor.steer_rate_deg` | deg/s |",
            "| `tractor.steer_rate_deg` | rad/s |",
            "`tractor.steer_rate_deg` has the unit rad/s",
        ),
        (
            "| 0.05..2 | 0.7 |",
            "| 0.05..2 | 0.8 |",
            "`tractor.friction` left out is not the same as with its default, 0.8",
        ),
        ("| 0.01..10 | 0.8 |", "| 0.01..10 | |", "`speed_control.gain` may be left out, so its row needs a default"),
        ("| 2..10 | |", "| 2..10 | 3 |", "`tractor.wheelbase` has no default 3"),
        ("| `trailer.kingpin_to_front` |", "| `trailer.colour` |", "`trailer.colour` is in no document of this test"),
        (
            "| `model.crossfall` |",
            "| `model.cross_fall` |",
            "`model.crossfall` is taken and has no row: add | `model.crossfall` |",
        ),
    ];
    let readme = changes.iter().fold(text_of("README.md"), |text, (from, to, _)| {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text.replace(from, to)
    });
    let faults = compared(&kind, &rows(&readme, "Vehicles")).faults;
    for (_, _, expected) in changes {
        assert!(faults.iter().any(|fault| fault.starts_with(expected)), "{expected}: {faults:#?}");
    }
    // The wrong range is refused at its end, too, and each wrong name is one of a key too many and one too few.
    assert_eq!(faults.len(), changes.len() + 3, "{faults:#?}");
}
