//! Reads a benchmark file and the files it refers to, and checks every value.

use super::benchmark_keys::{Written, WrittenActions, WrittenDisturbances, WrittenRange, WrittenTraffic};
use super::check::MOST_DELAY;
use super::disturbances::{Disturbances, LONGEST_DELAY};
use super::fleet::{self, Fleet};
use super::roads::{MOST_ROADS, Procedural};
use super::traffic;
use super::{ActionKind, Scenario, Traffic};
use crate::files::cache::Loading;
use crate::files::reader::{Error, Exactly, Reader};
use crate::files::shipped::Source;
use crate::layout::MOST_IN_GROUP;
use crate::traffic::together;
use crate::vehicle::Vehicle;

/// Most sub-steps of a step that a file may ask for.
const MOST_SUBSTEPS: usize = 100;

impl Scenario {
    /// Reads and checks a benchmark file.
    pub(super) fn from_source(source: &Source, loading: &Loading) -> Result<Scenario, Error> {
        let (mut scenario, written) = Scenario::before_roads(source)?;
        let file = source.shown();
        let reader = Reader::of(&file);
        // Drawing takes longest: everything else is checked first.
        let procedural =
            written.procedural.as_ref().map(|written| Procedural::checked(&reader, source, written)).transpose()?;
        if procedural.is_none() {
            reader.length("roundabout", written.roundabout.len(), 1..=MOST_ROADS, "tables")?;
        }
        for (index, roundabout) in written.roundabout.iter().enumerate() {
            scenario.add_file(&reader, &format!("roundabout[{index}]"), source, roundabout)?;
        }
        if let Some(procedural) = procedural {
            scenario.add_random(&reader, &procedural, loading)?;
        }
        if scenario.splits.iter().all(Vec::is_empty) {
            let expected = "at least one route must be listed under `train`, `validation` or `test`";
            return Err(reader.invalid("roundabout", "no routes", expected));
        }
        Ok(scenario)
    }

    /// Everything of a benchmark but its roads, and what the file says.
    pub(super) fn before_roads(source: &Source) -> Result<(Scenario, Written), Error> {
        let file = source.shown();
        let (reader, written) = Reader::parse::<Written>(&file, &source.text()?)?;
        let vehicles = fleet::vehicles(&reader, source, &written)?;
        let scenario = without_routes(&reader, source.stem(), vehicles, &written)?;
        let delay = scenario.longest_steer_delay();
        if MOST_DELAY * scenario.step < delay {
            let expected = format!("the vehicle's steer delay is up to {delay} s; three steps at most");
            return Err(reader.invalid("time.step", format_args!("{} s", scenario.step), expected));
        }
        let [fewest, most] = scenario.substeps();
        let most = most.min(MOST_SUBSTEPS as f64);
        if !(fewest..=most).contains(&f64::from(scenario.n_substeps)) {
            let why = "at most the trailer's lever is driven in a sub-step, which takes 1 ms at least";
            let expected = if fewest <= most {
                format!("must lie in {fewest}..{most}: {why}")
            } else {
                format!("{fewest} would be needed, and {most} are the most: {why}; shorten time.step")
            };
            return Err(reader.invalid("time.substeps", scenario.n_substeps, expected));
        }
        if scenario.stray_distance < scenario.spacing {
            let expected = format!(
                "must be at least routes.spacing, {} m: a truck that begins is so far from the next waypoint",
                scenario.spacing
            );
            return Err(reader.invalid(
                "ending.stray_distance",
                format_args!("{} m", scenario.stray_distance),
                expected,
            ));
        }
        if scenario.is_out_of_step() {
            let expected = format!("with [traffic] {} s", crate::traffic::STEP);
            return Err(reader.invalid("time.step", format_args!("{} s", scenario.step), expected));
        }
        Ok((scenario, written))
    }
}

/// Everything but the roundabouts and their routes, checked and in SI units.
fn without_routes(
    reader: &Reader,
    name: String,
    (vehicle, load, fleet): (Vehicle, String, Option<Fleet>),
    written: &Written,
) -> Result<Scenario, Error> {
    let Written { time, field, actions, sensors, start, ending, reward, routes, .. } = written;
    let steer_max =
        written.steer_max_deg.map(|lock| reader.within("steer_max_deg", lock, 1.0..=80.0, "deg")).transpose()?;
    let speeds = numbers(reader, "actions.speeds_kmh", &actions.speeds_kmh, 90.0, 0.0, "km/h")?;
    if speeds.iter().all(|&speed| speed < 1.0) {
        return Err(reader.invalid(
            "actions.speeds_kmh",
            "no speed of 1 km/h or more",
            "at least one is needed, or no truck moves",
        ));
    }
    let speed_changes = match &actions.speed_changes_kmh {
        None => Vec::new(),
        Some(changes) => numbers(reader, "actions.speed_changes_kmh", changes, 90.0, -90.0, "km/h")?,
    };
    written.reward.check(reader)?;
    Ok(Scenario {
        name,
        steer_max: steer_max.map(f64::to_radians),
        lock_of_levels: None,
        vehicle,
        load,
        fleet,
        gutter: written.gutter,
        step: reader.within("time.step", time.step, 0.01..=1.0, "s")?,
        n_substeps: reader.count("time.substeps", time.substeps, 1..=MOST_SUBSTEPS)? as u32,
        cell: reader.within("field.cell", field.cell, 0.1..=1.0, "m")?,
        action_kind: actions.kind,
        steer_levels: steer_levels(reader, actions)?,
        speeds: speeds.into_iter().map(|speed| speed / 3.6).collect(),
        speed_changes: speed_changes.into_iter().map(|change| change / 3.6).collect(),
        sensor_range: reader.within("sensors.range", sensors.range, 1.0..=50.0, "m")?,
        extras: written.observation.extras,
        observes_vehicles: observes_vehicles(reader, written)?,
        disturbances: disturbances(reader, &written.disturbances)?,
        traffic: written.traffic.as_ref().map(|written| of_traffic(reader, written)).transpose()?,
        start_offset: reader.within("start.offset", start.offset, 0.0..=1.0, "m")?,
        start_heading: reader.within("start.heading_deg", start.heading_deg, 0.0..=20.0, "deg")?.to_radians(),
        start_speed: start.speed_kmh.as_ref().map(|written| start_speed(reader, written)).transpose()?,
        start_along: start_along(reader, written)?,
        stray_distance: reader.within("ending.stray_distance", ending.stray_distance, 3.0..=50.0, "m")?,
        jackknife_angle: reader.within("ending.jackknife_deg", ending.jackknife_deg, 30.0..=120.0, "deg")?.to_radians(),
        rollover_ratio: reader.within("ending.rollover_ratio", ending.rollover_ratio, 0.1..=2.0, "")?,
        time_limit: reader.within("ending.time_limit", ending.time_limit, 1.0..=20.0, "")?,
        clock: ending.clock,
        reward: *reward,
        approach: reader.within("routes.approach", routes.approach, 5.0..=500.0, "m")?,
        departure: reader.within("routes.departure", routes.departure, 5.0..=500.0, "m")?,
        spacing: reader.within("routes.spacing", routes.spacing, 0.5..=5.0, "m")?,
        places: Vec::new(),
        splits: Default::default(),
    })
}

/// The steer levels, which actions have that are not continuous.
fn steer_levels(reader: &Reader, actions: &WrittenActions) -> Result<Vec<f64>, Error> {
    const KEY: &str = "actions.steer_levels";
    match (actions.kind, &actions.steer_levels) {
        (ActionKind::Levels, Some(levels)) => numbers(reader, KEY, levels, 1.0, -1.0, ""),
        (ActionKind::Levels, None) => {
            Err(reader.invalid(KEY, "missing", "it is needed unless actions.kind is \"continuous\""))
        }
        (ActionKind::Continuous, Some(levels)) => {
            let expected = "actions.kind is \"continuous\", which has none: leave it out";
            Err(reader.invalid(KEY, format_args!("{} values", levels.len()), expected))
        }
        (ActionKind::Continuous, None) => Ok(Vec::new()),
    }
}

/// Checks `[disturbances]`.
fn disturbances(reader: &Reader, written: &WrittenDisturbances) -> Result<Disturbances, Error> {
    let within = |key: &str, value, most, unit| reader.within(&format!("disturbances.{key}"), value, 0.0..=most, unit);
    let delays = |key: &str, Exactly(ends): Exactly<i64, 2>| {
        for (index, end) in ends.into_iter().enumerate() {
            let key = format!("disturbances.{key}[{index}]");
            reader.within(&key, end as f64, 0.0..=f64::from(LONGEST_DELAY), "steps")?;
        }
        let [least, greatest] = ends.map(|end| end as u32);
        if greatest < least {
            let found = format_args!("[{least}, {greatest}]");
            return Err(reader.invalid(format!("disturbances.{key}"), found, "must be [least, greatest]"));
        }
        Ok([least, greatest])
    };
    Ok(Disturbances {
        range_noise: within("range_noise", written.range_noise, 5.0, "m")?,
        dropped_rays: within("dropped_rays", written.dropped_rays, 1.0, "")?,
        position_offset: within("position_offset", written.position_offset, 5.0, "m")?,
        heading_offset: within("heading_offset_deg", written.heading_offset_deg, 20.0, "deg")?.to_radians(),
        position_noise: within("position_noise", written.position_noise, 5.0, "m")?,
        heading_noise: within("heading_noise_deg", written.heading_noise_deg, 20.0, "deg")?.to_radians(),
        map_offset: within("map_offset", written.map_offset, 5.0, "m")?,
        observation_delay: delays("observation_delay", written.observation_delay)?,
        action_delay: delays("action_delay", written.action_delay)?,
    })
}

/// Whether other vehicles are observed, which needs some.
fn observes_vehicles(reader: &Reader, written: &Written) -> Result<bool, Error> {
    let observes = written.observation.vehicles;
    if observes && written.traffic.is_none() {
        let expected = "with the table [traffic]: without it there are none to observe";
        return Err(reader.invalid("observation.vehicles", observes, expected));
    }
    Ok(observes)
}

/// Checks `[traffic]`.
fn of_traffic(reader: &Reader, written: &WrittenTraffic) -> Result<Traffic, Error> {
    let WrittenTraffic { demand, drivers, vans, rude, courtesy, waiting, hindrance, group, .. } = written;
    let vans = reader.within("traffic.vans", *vans, 0.0..=1.0, "")?;
    let mut large = [written.buses, written.rigid_trucks, written.tractor_trailers];
    for (key, fraction) in traffic::LARGE_KEYS.into_iter().zip(&mut large) {
        *fraction = reader.within(&format!("traffic.{key}"), *fraction, 0.0..=1.0, "")?;
    }
    reader.within("traffic.vans and larger vehicles together", together(vans, large), 0.0..=1.0, "")?;
    let [least, greatest] = traffic::MOST_HINDRANCE;
    let rude = rude.as_ref().map(|written| range(reader, "traffic.rude", written, 1.0, ""));
    Ok(Traffic {
        demand: numbers(reader, "traffic.demand", demand, traffic::MOST_DEMAND, 0.0, "veh/h")?,
        drivers: *drivers,
        vans,
        large,
        rude: rude.transpose()?.unwrap_or_default(),
        courtesy: reader.within("traffic.courtesy", courtesy.unwrap_or(drivers.courtesy()), 0.0..=1.0, "")?,
        waiting: reader.within("traffic.waiting", *waiting, 0.0..=600.0, "s")?,
        hindrance: reader.within("traffic.hindrance", *hindrance, least..=greatest, "")?,
        group: reader.count("traffic.group", *group, 1..=MOST_IN_GROUP)?,
    })
}

/// How far along its route an episode may begin, as a fraction. Trucks of a group would stand in each other.
fn start_along(reader: &Reader, written: &Written) -> Result<f64, Error> {
    const KEY: &str = "start.along";
    let along = reader.within(KEY, written.start.along, 0.0..=1.0, "")?;
    let is_in_group = written.traffic.as_ref().is_some_and(|traffic| 1 < traffic.group);
    if is_in_group && along != 0.0 {
        return Err(reader.invalid(
            KEY,
            along,
            "must be 0 with traffic.group above 1, whose trucks begin on their arms",
        ));
    }
    Ok(along)
}

/// Least and greatest speed at the start (m/s).
fn start_speed(reader: &Reader, written: &WrittenRange) -> Result<[f64; 2], Error> {
    Ok(range(reader, "start.speed_kmh", written, 90.0, "km/h")?.map(|speed| speed / 3.6))
}

/// Least and greatest of a range from 0 on.
fn range(reader: &Reader, key: &str, written: &WrittenRange, most: f64, unit: &str) -> Result<[f64; 2], Error> {
    let [least, greatest] = written.ends();
    reader.within(key, least, 0.0..=most, unit)?;
    reader.within(key, greatest, 0.0..=most, unit)?;
    if greatest < least {
        let found = format_args!("[{least}, {greatest}]");
        return Err(reader.invalid(key, found, "must be a number or [least, greatest], the least first"));
    }
    Ok([least, greatest])
}

/// Most values of a list.
const MOST_VALUES: usize = 64;

/// A non-empty list of finite numbers within a range.
fn numbers(reader: &Reader, key: &str, values: &[f64], most: f64, least: f64, unit: &str) -> Result<Vec<f64>, Error> {
    if !(1..=MOST_VALUES).contains(&values.len()) {
        let found = format_args!("{} values", values.len());
        return Err(reader.invalid(key, found, format!("must lie in 1..{MOST_VALUES}")));
    }
    values
        .iter()
        .enumerate()
        .map(|(index, &value)| reader.within(&format!("{key}[{index}]"), value, least..=most, unit))
        .collect()
}
