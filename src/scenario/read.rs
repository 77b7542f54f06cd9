//! Reads a benchmark file and the files it refers to, and checks every value.

use std::path::Path;

use super::benchmark_keys::{Written, WrittenChoice, WrittenRoundabout, WrittenRoutes};
use super::{Place, Scenario};
use crate::reader::{Error, Reader, shown};
use crate::roundabout::Roundabout;
use crate::route::Route;
use crate::shipped::Source;
use crate::vehicle::Vehicle;

impl Scenario {
    /// Reads and checks a benchmark file.
    pub(super) fn from_source(source: &Source) -> Result<Scenario, Error> {
        let file = source.shown();
        let (reader, written) = Reader::parse::<Written>(&file, &source.text()?)?;
        let vehicle = referred(&reader, "vehicle", source, &written.vehicle, Vehicle::from_source)?;
        if !vehicle.loads.contains_key(&written.load) {
            let loads: Vec<&str> = vehicle.loads.keys().map(String::as_str).collect();
            return Err(reader.invalid("load", format_args!("{:?}", written.load), format!("the vehicle has {}", loads.join(", "))));
        }
        let mut scenario = without_routes(&reader, source.stem(), vehicle, &written)?;
        let lengths = WrittenRoutes {
            approach: reader.within("routes.approach", written.routes.approach, 5.0..=500.0, "m")?,
            departure: reader.within("routes.departure", written.routes.departure, 5.0..=500.0, "m")?,
            spacing: reader.within("routes.spacing", written.routes.spacing, 0.5..=5.0, "m")?,
        };
        reader.count("roundabout", written.roundabout.len(), 1..=64)?;
        for (index, roundabout) in written.roundabout.iter().enumerate() {
            scenario.add(&reader, &format!("roundabout[{index}]"), source, roundabout, &lengths)?;
        }
        if scenario.train.is_empty() && scenario.test.is_empty() {
            return Err(reader.invalid("roundabout", "no routes", "at least one route must be listed under `train` or `test`"));
        }
        Ok(scenario)
    }

    /// Adds a roundabout of the file, written under `key`, and its routes.
    fn add(
        &mut self,
        reader: &Reader,
        key: &str,
        source: &Source,
        written: &WrittenRoundabout,
        lengths: &WrittenRoutes,
    ) -> Result<(), Error> {
        let roundabout = referred(reader, &format!("{key}.file"), source, &written.file, Roundabout::from_source)?;
        if self.places.iter().any(|other| other.roundabout.name == roundabout.name) {
            return Err(reader.invalid(format!("{key}.file"), written.file.display(), "each roundabout may be listed once"));
        }
        let routes = roundabout.routes(lengths.approach, lengths.departure, lengths.spacing).map_err(|leaves| {
            reader.invalid(format!("routes.{}", leaves.part), format_args!("{} m", shown(leaves.asked)), leaves.to_string())
        })?;
        let train = chosen(reader, &format!("{key}.train"), &written.train, &routes)?;
        let test = chosen(reader, &format!("{key}.test"), &written.test, &routes)?;
        let mut next = self.routes().count() as u32;
        let mut kept = Vec::new();
        for (index, route) in routes.into_iter().enumerate() {
            if train.contains(&index) && test.contains(&index) {
                return Err(reader.invalid(format!("{key}.test"), route.name, "is listed under `train` too; a route is in one split"));
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

    /// Every route leaves room for the whole truck on its arms: behind the route's beginning at the start pose, and
    /// ahead of its end on arrival.
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
            // Rounded down, so that the length in the message does fit.
            let longest = ((asked + room) * 100.0).floor() / 100.0;
            let expected = format!("the truck needs {reach:.2} m of the arm {side}: at most {longest} m fit {}", route.name);
            return Err(reader.invalid(format!("routes.{part}"), format_args!("{} m", shown(asked)), expected));
        }
        Ok(())
    }
}

/// Everything but the roundabouts and their routes, checked and in SI units.
fn without_routes(reader: &Reader, name: String, vehicle: Vehicle, written: &Written) -> Result<Scenario, Error> {
    let Written { time, field, actions, sensors, start, ending, reward, .. } = written;
    let steer_max = written.steer_max_deg.map(|lock| reader.within("steer_max_deg", lock, 1.0..=80.0, "deg")).transpose()?;
    let speeds = numbers(reader, "actions.speeds_kmh", &actions.speeds_kmh, 90.0, 1.0, "km/h")?;
    Ok(Scenario {
        name,
        steer_max: steer_max.map(f64::to_radians),
        vehicle,
        load: written.load.clone(),
        gutter: written.gutter,
        step: reader.within("time.step", time.step, 0.01..=1.0, "s")?,
        n_substeps: reader.count("time.substeps", time.substeps, 1..=100)? as u32,
        cell: reader.within("field.cell", field.cell, 0.1..=1.0, "m")?,
        steer_levels: numbers(reader, "actions.steer_levels", &actions.steer_levels, 1.0, -1.0, "")?,
        speeds: speeds.into_iter().map(|speed| speed / 3.6).collect(),
        sensor_range: reader.within("sensors.range", sensors.range, 1.0..=50.0, "m")?,
        start_offset: reader.within("start.offset", start.offset, 0.0..=1.0, "m")?,
        start_heading: reader.within("start.heading_deg", start.heading_deg, 0.0..=20.0, "deg")?.to_radians(),
        stray_distance: reader.within("ending.stray_distance", ending.stray_distance, 3.0..=50.0, "m")?,
        jackknife_angle: reader.within("ending.jackknife_deg", ending.jackknife_deg, 30.0..=120.0, "deg")?.to_radians(),
        rollover_ratio: reader.within("ending.rollover_ratio", ending.rollover_ratio, 0.1..=2.0, "")?,
        time_limit: reader.within("ending.time_limit", ending.time_limit, 1.0..=20.0, "")?,
        waypoint_weight: weight(reader, "reward.waypoint", reward.waypoint)?,
        lane_distance_weight: weight(reader, "reward.lane_distance", reward.lane_distance)?,
        lane_distance_limit: reader.within("reward.lane_distance_limit", reward.lane_distance_limit, 0.1..=50.0, "m")?,
        clearance_weight: weight(reader, "reward.clearance", reward.clearance)?,
        clearance_limit: reader.within("reward.clearance_limit", reward.clearance_limit, 0.01..=10.0, "m")?,
        failure_weight: weight(reader, "reward.failure", reward.failure)?,
        places: Vec::new(),
        train: Vec::new(),
        test: Vec::new(),
    })
}

/// Reads the file at `path` that `source` refers to under `key`. If there is no such file, the error names the key too.
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

/// Indices of the routes that a split lists.
fn chosen(reader: &Reader, key: &str, choice: &WrittenChoice, routes: &[Route]) -> Result<Vec<usize>, Error> {
    let names = match choice {
        WrittenChoice::Word(word) if word == "all" => return Ok((0..routes.len()).collect()),
        WrittenChoice::Word(word) => {
            return Err(reader.invalid(key, format_args!("{word:?}"), "must be \"all\" or a list of route names"));
        }
        WrittenChoice::Names(names) => names,
    };
    let mut indices = Vec::new();
    for (number, name) in names.iter().enumerate() {
        let key = format!("{key}[{number}]");
        let found = routes.iter().position(|route| route.name.rsplit('/').next() == Some(name));
        let index = found.ok_or_else(|| {
            let known: Vec<&str> = routes.iter().filter_map(|route| route.name.rsplit('/').next()).collect();
            reader.invalid(&key, format_args!("{name:?}"), format!("the roundabout has {}", known.join(", ")))
        })?;
        if indices.contains(&index) {
            return Err(reader.invalid(&key, format_args!("{name:?}"), "is listed twice"));
        }
        indices.push(index);
    }
    Ok(indices)
}
