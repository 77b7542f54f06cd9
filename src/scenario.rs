//! What to drive: a benchmark file as written (unknown keys refused) and as understood (checked, SI units).
//!
//! Every error names file, key, value and what would do; it is found here or in the reader of the part it belongs to, never later.

mod benchmark_keys;
mod check;

use std::path::Path;

use crate::layout::Action;
use crate::reader::{Error, Reader, shown};
use crate::roundabout::{Gutter, Roundabout};
use crate::route::Route;
use crate::shipped::{Kind, Source};
use crate::vehicle::Vehicle;
use benchmark_keys::{Written, WrittenChoice, WrittenRoundabout, WrittenRoutes};
pub use check::Invalid;

/// Length of a route before the ring where a benchmark says nothing else [m].
pub const APPROACH: f64 = 40.0;
/// Length of a route after the ring where a benchmark says nothing else [m].
pub const DEPARTURE: f64 = 35.0;
/// Distance between waypoints where a benchmark says nothing else [m].
pub const WAYPOINT_SPACING: f64 = 2.0;
/// Width of the distance field's cells where a benchmark says nothing else [m].
pub const FIELD_CELL: f64 = 0.5;

/// Which routes: those learned on, or those kept for the examination.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// Learned on.
    Train,
    /// Never learned on.
    Test,
}

impl Split {
    /// The split's key in a benchmark file.
    pub fn name(self) -> &'static str {
        match self {
            Split::Train => "train",
            Split::Test => "test",
        }
    }
}

/// One roundabout of a benchmark with the routes that it uses.
#[derive(Debug)]
pub struct Place {
    /// The roundabout.
    pub roundabout: Roundabout,
    /// Routes of either split, each once, in the roundabout's order.
    pub routes: Vec<Route>,
}

/// A benchmark: roundabouts, routes and their split, vehicle, actions, reward. SI units and radians.
#[derive(Debug)]
pub struct Scenario {
    /// The file's stem.
    pub name: String,
    /// The vehicle.
    pub vehicle: Vehicle,
    /// The vehicle's load, one that it has.
    pub load: String,
    /// Lock of the front wheels where it is not the vehicle's own [rad].
    pub steer_max: Option<f64>,
    /// Whether a gutter may be driven on.
    pub gutter: Gutter,
    /// Time of a step [s].
    pub step: f64,
    /// Physics sub-steps in a step.
    pub n_substeps: u32,
    /// Spacing of the field's nodes [m].
    pub cell: f64,
    /// Steer levels as shares of the lock, left positive.
    pub steer_levels: Vec<f64>,
    /// Target speeds [m/s].
    pub speeds: Vec<f64>,
    /// Reach of the distance sensors [m].
    pub sensor_range: f64,
    /// Largest lateral offset at the start [m].
    pub start_offset: f64,
    /// Largest heading error at the start [rad].
    pub start_heading: f64,
    /// Distance to the next waypoint beyond which the truck has strayed [m].
    pub stray_distance: f64,
    /// Articulation beyond which the truck is jackknifed [rad].
    pub jackknife_angle: f64,
    /// Load transfer ratio from which the truck has rolled over.
    pub rollover_ratio: f64,
    /// An episode's time limit, in times that the route takes at the target speed.
    pub time_limit: f64,
    /// Reward for a waypoint.
    pub waypoint_weight: f64,
    /// Reward for the lane-distance term, each step.
    pub lane_distance_weight: f64,
    /// Distance to the lane centre at which that term is 1 [m].
    pub lane_distance_limit: f64,
    /// Reward for the clearance term, each step.
    pub clearance_weight: f64,
    /// Margin kept from kerbs, within which that term counts [m].
    pub clearance_limit: f64,
    /// Reward for failing.
    pub failure_weight: f64,
    /// The roundabouts.
    pub places: Vec<Place>,
    train: Vec<u32>,
    test: Vec<u32>,
}

impl Scenario {
    /// Reads a benchmark file and every file that it refers to. Their paths are relative to it.
    ///
    /// # Errors
    ///
    /// The file and, for a value that makes no sense, its key, the value and what would do.
    pub fn read(path: &Path) -> Result<Scenario, Error> {
        Scenario::from_source(&Source::Disk(path.to_owned()))
    }

    /// A benchmark that comes with the library.
    ///
    /// ```
    /// use offtrack::scenario::{Scenario, Split};
    ///
    /// let scenario = Scenario::named("attard2023")?;
    /// assert_eq!(scenario.split(Split::Train).len(), 52);
    /// assert_eq!(scenario.split(Split::Test).len(), 23);
    /// # Ok::<(), offtrack::reader::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`], which lists the known names.
    pub fn named(name: &str) -> Result<Scenario, Error> {
        Scenario::from_source(&Source::named(Kind::Benchmark, name)?)
    }

    /// Reads a file where `name_or_path` ends in `.toml` or is the path of a file; else the same as [`Scenario::named`].
    ///
    /// # Errors
    ///
    /// Those of [`Scenario::read`] and [`Scenario::named`].
    pub fn find(name_or_path: &str) -> Result<Scenario, Error> {
        Scenario::from_source(&Source::find(Kind::Benchmark, name_or_path)?)
    }

    fn from_source(source: &Source) -> Result<Scenario, Error> {
        let file = source.shown();
        let (reader, written) = Reader::parse::<Written>(&file, &source.text()?)?;
        let vehicle = referred(&reader, "vehicle", source, &written.vehicle, Vehicle::from_source)?;
        if !vehicle.loads.contains_key(&written.load) {
            let loads: Vec<&str> = vehicle.loads.keys().map(String::as_str).collect();
            return Err(reader.invalid("load", format_args!("{:?}", written.load), format!("the vehicle has {}", loads.join(", "))));
        }
        let mut scenario = Scenario {
            name: source.stem(),
            steer_max: written
                .steer_max_deg
                .map(|lock| reader.within("steer_max_deg", lock, 1.0..=80.0, "deg").map(f64::to_radians))
                .transpose()?,
            vehicle,
            load: written.load,
            gutter: written.gutter,
            step: reader.within("time.step", written.time.step, 0.01..=1.0, "s")?,
            n_substeps: reader.count("time.substeps", written.time.substeps, 1..=100)? as u32,
            cell: reader.within("field.cell", written.field.cell, 0.1..=1.0, "m")?,
            steer_levels: numbers(&reader, "actions.steer_levels", &written.actions.steer_levels, 1.0, -1.0, "")?,
            speeds: numbers(&reader, "actions.speeds_kmh", &written.actions.speeds_kmh, 90.0, 1.0, "km/h")?
                .into_iter()
                .map(|speed| speed / 3.6)
                .collect(),
            sensor_range: reader.within("sensors.range", written.sensors.range, 1.0..=50.0, "m")?,
            start_offset: reader.within("start.offset", written.start.offset, 0.0..=1.0, "m")?,
            start_heading: reader.within("start.heading_deg", written.start.heading_deg, 0.0..=20.0, "deg")?.to_radians(),
            stray_distance: reader.within("ending.stray_distance", written.ending.stray_distance, 3.0..=50.0, "m")?,
            jackknife_angle: reader.within("ending.jackknife_deg", written.ending.jackknife_deg, 30.0..=120.0, "deg")?.to_radians(),
            rollover_ratio: reader.within("ending.rollover_ratio", written.ending.rollover_ratio, 0.1..=2.0, "")?,
            time_limit: reader.within("ending.time_limit", written.ending.time_limit, 1.0..=20.0, "")?,
            waypoint_weight: weight(&reader, "reward.waypoint", written.reward.waypoint)?,
            lane_distance_weight: weight(&reader, "reward.lane_distance", written.reward.lane_distance)?,
            lane_distance_limit: reader.within("reward.lane_distance_limit", written.reward.lane_distance_limit, 0.1..=50.0, "m")?,
            clearance_weight: weight(&reader, "reward.clearance", written.reward.clearance)?,
            clearance_limit: reader.within("reward.clearance_limit", written.reward.clearance_limit, 0.01..=10.0, "m")?,
            failure_weight: weight(&reader, "reward.failure", written.reward.failure)?,
            places: Vec::new(),
            train: Vec::new(),
            test: Vec::new(),
        };
        let lengths = WrittenRoutes {
            approach: reader.within("routes.approach", written.routes.approach, 5.0..=500.0, "m")?,
            departure: reader.within("routes.departure", written.routes.departure, 5.0..=500.0, "m")?,
            spacing: reader.within("routes.spacing", written.routes.spacing, 0.5..=5.0, "m")?,
        };
        reader.count("roundabout", written.roundabout.len(), 1..=64)?;
        for (index, place) in written.roundabout.iter().enumerate() {
            scenario.add(&reader, &format!("roundabout[{index}]"), source, place, &lengths)?;
        }
        if scenario.train.is_empty() && scenario.test.is_empty() {
            return Err(reader.invalid("roundabout", "no routes", "at least one route must stand under `train` or `test`"));
        }
        Ok(scenario)
    }

    /// Indices of a split's routes in the world's table.
    pub fn split(&self, split: Split) -> &[u32] {
        match split {
            Split::Train => &self.train,
            Split::Test => &self.test,
        }
    }

    /// Names of a split's routes.
    pub fn split_names(&self, split: Split) -> Vec<&str> {
        let names: Vec<&str> = self.routes().map(|(_, route)| route.name.as_str()).collect();
        self.split(split).iter().map(|&route| names[route as usize]).collect()
    }

    /// Every route used, in the order of the world's table, with its roundabout's index.
    pub fn routes(&self) -> impl Iterator<Item = (usize, &Route)> {
        self.places.iter().enumerate().flat_map(|(index, place)| place.routes.iter().map(move |route| (index, route)))
    }

    /// (steer angle, target speed) pairs, the speed varying slowest.
    pub fn actions(&self, lock: f32) -> Vec<Action> {
        let pair = |speed: f64, level: f64| Action { steering: level as f32 * lock, speed: speed as f32 };
        self.speeds.iter().flat_map(|&speed| self.steer_levels.iter().map(move |&level| pair(speed, level))).collect()
    }

    /// The speed that a truck starts with and that time limits are reckoned by: the highest target [m/s].
    pub fn cruising_speed(&self) -> f64 {
        self.speeds.iter().copied().fold(0.0, f64::max)
    }

    fn add(
        &mut self,
        reader: &Reader,
        key: &str,
        source: &Source,
        place: &WrittenRoundabout,
        lengths: &WrittenRoutes,
    ) -> Result<(), Error> {
        let roundabout = referred(reader, &format!("{key}.file"), source, &place.file, Roundabout::from_source)?;
        if self.places.iter().any(|other| other.roundabout.name == roundabout.name) {
            return Err(reader.invalid(format!("{key}.file"), place.file.display(), "each roundabout may stand here once"));
        }
        let routes = roundabout.routes(lengths.approach, lengths.departure, lengths.spacing).map_err(|leaves| {
            reader.invalid(format!("routes.{}", leaves.part), format_args!("{} m", shown(leaves.asked)), leaves.to_string())
        })?;
        let train = chosen(reader, &format!("{key}.train"), &place.train, &routes)?;
        let test = chosen(reader, &format!("{key}.test"), &place.test, &routes)?;
        let mut next = self.routes().count() as u32;
        let mut kept = Vec::new();
        for (index, route) in routes.into_iter().enumerate() {
            if train.contains(&index) && test.contains(&index) {
                return Err(reader.invalid(format!("{key}.test"), route.name, "is trained on too; a route is in one split"));
            }
            if train.contains(&index) {
                self.train.push(next);
            } else if test.contains(&index) {
                self.test.push(next);
            } else {
                continue;
            }
            next += 1;
            kept.push(route);
        }
        self.whole_truck_on_arms(reader, &kept, lengths)?;
        self.places.push(Place { roundabout, routes: kept });
        Ok(())
    }

    /// Every route leaves room on its arms for the whole truck, at the start pose behind the route's beginning and, on arrival, ahead of its
    /// end.
    fn whole_truck_on_arms(&self, reader: &Reader, routes: &[Route], lengths: &WrittenRoutes) -> Result<(), Error> {
        let (behind, ahead) = self.vehicle.reach(self.start_heading);
        let starts = routes.iter().map(|route| (route.before - behind, route));
        let ends = routes.iter().map(|route| (route.after - ahead, route));
        let nearest = |(a, first), (b, second)| if b < a { (b, second) } else { (a, first) };
        for (part, asked, reach, side, room) in [
            ("approach", lengths.approach, behind, "behind its start", starts.reduce(nearest)),
            ("departure", lengths.departure, ahead, "ahead of its end", ends.reduce(nearest)),
        ] {
            let Some((room, route)) = room.filter(|(room, _)| *room < 0.0) else { continue };
            // Rounded down, so that the length named does fit.
            let longest = ((asked + room) * 100.0).floor() / 100.0;
            let expected = format!("the truck needs {reach:.2} m of the arm {side}: at most {longest} m fit {}", route.name);
            return Err(reader.invalid(format!("routes.{part}"), format_args!("{} m", shown(asked)), expected));
        }
        Ok(())
    }
}

/// Reads the file at `path` that `source` refers to under `key`. Where there is no such file, the error names the key too.
fn referred<T>(reader: &Reader, key: &str, source: &Source, path: &Path, read: impl Fn(&Source) -> Result<T, Error>) -> Result<T, Error> {
    read(&source.relative(path)).map_err(|error| match error {
        Error::Unreadable { .. } | Error::NotAFile { .. } | Error::TooLarge { .. } => {
            reader.invalid(key, format_args!("{:?}", path.display().to_string()), error.to_string())
        }
        error => error,
    })
}

/// A non-empty list of finite numbers within a range.
fn numbers(reader: &Reader, key: &str, values: &[f64], most: f64, least: f64, unit: &str) -> Result<Vec<f64>, Error> {
    reader.count(key, values.len(), 1..=64)?;
    values.iter().enumerate().map(|(index, &value)| reader.within(&format!("{key}[{index}]"), value, least..=most, unit)).collect()
}

fn weight(reader: &Reader, key: &str, value: f64) -> Result<f64, Error> {
    reader.within(key, value, -1e6..=1e6, "")
}

/// Indices of the routes that a split names.
fn chosen(reader: &Reader, key: &str, choice: &WrittenChoice, routes: &[Route]) -> Result<Vec<usize>, Error> {
    let names = match choice {
        WrittenChoice::Word(word) if word == "all" => return Ok((0..routes.len()).collect()),
        WrittenChoice::Word(word) => {
            return Err(reader.invalid(key, format_args!("{word:?}"), "must be \"all\" or a list of route names"));
        }
        WrittenChoice::Names(names) => names,
    };
    let mut indices = Vec::new();
    for (place, name) in names.iter().enumerate() {
        let key = format!("{key}[{place}]");
        let found = routes.iter().position(|route| route.name.rsplit('/').next() == Some(name));
        let index = found.ok_or_else(|| {
            let known: Vec<&str> = routes.iter().filter_map(|route| route.name.rsplit('/').next()).collect();
            reader.invalid(&key, format_args!("{name:?}"), format!("the roundabout has {}", known.join(", ")))
        })?;
        if indices.contains(&index) {
            return Err(reader.invalid(&key, format_args!("{name:?}"), "stands here twice"));
        }
        indices.push(index);
    }
    Ok(indices)
}
