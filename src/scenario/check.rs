//! The check of a scenario that was changed in memory: everything that baking and stepping rely on.
//!
//! A scenario that was read from a file has passed narrower ranges already; its fields are public, so it can be changed
//! afterwards.

use std::fmt::Display;

use super::{ActionKind, REWARD_KEYS, Scenario, Traffic};
use crate::traffic;
use crate::vehicle::{Model, Suspension, Vehicle};

/// A value with which no truck could be stepped.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{key}: {value}; {expected}")]
pub struct Invalid {
    /// Path of the field in [`Scenario`].
    pub key: String,
    /// The value found.
    pub value: String,
    /// What would do.
    pub expected: String,
}

/// Any magnitude that f32 computes with safely.
const FINITE: [f64; 2] = [-1e9, 1e9];
/// A length, a time, a mass: not 0.
const POSITIVE: [f64; 2] = [1e-6, 1e9];
/// Braking: not 0.
const NEGATIVE: [f64; 2] = [-1e9, -1e-6];
/// A steer angle (rad).
const LOCK: [f64; 2] = [1e-3, 1.5];
/// Longest steer delay (steps): a truck's control goes back so far.
pub(super) const MOST_DELAY: f64 = 3.0;
/// Shortest sub-step (s).
const SHORTEST_SUBSTEP: f64 = 1e-3;

impl Scenario {
    /// An error if the scenario has a value with which no truck could be stepped.
    ///
    /// [`World::bake`](crate::world::World::bake) calls it.
    pub fn check(&self) -> Result<(), Invalid> {
        if !self.vehicle.loads.contains_key(&self.load) {
            let loads: Vec<&str> = self.vehicle.loads.keys().map(String::as_str).collect();
            return Err(invalid(
                "load",
                format_args!("{:?}", self.load),
                format!("the vehicle has {}", loads.join(", ")),
            ));
        }
        self.check_numbers()?;
        match self.action_kind {
            ActionKind::Levels => list("steer_levels", &self.steer_levels, [-1.0, 1.0])?,
            ActionKind::Continuous if self.steer_levels.is_empty() => (),
            ActionKind::Continuous => {
                let found = format_args!("{} values", self.steer_levels.len());
                return Err(invalid("steer_levels", found, "continuous actions have none"));
            }
        }
        list("speeds", &self.speeds, [0.0, 100.0])?;
        within("speeds", self.cruising_speed(), [0.01, 100.0])?;
        if !self.speed_changes.is_empty() {
            list("speed_changes", &self.speed_changes, [-100.0, 100.0])?;
        }
        self.start_speed.iter().flatten().try_for_each(|&speed| within("start_speed", speed, [0.0, 100.0]))?;
        within("start_along", self.start_along, [0.0, 1.0])?;
        self.check_routes()?;
        check_vehicle(&self.vehicle)?;
        if let Some(fleet) = &self.fleet {
            within("fleet.n_vehicles", fleet.n_vehicles as f64, [1.0, 1e6])?;
            if fleet.classes().is_empty() {
                return Err(invalid(
                    "fleet.members",
                    "no loads",
                    "at least one vehicle with a load of a positive share is needed",
                ));
            }
            fleet.extremes().try_for_each(|(_, vehicle)| check_vehicle(&vehicle))?;
        }
        self.disturbances.check()?;
        self.traffic.iter().try_for_each(Traffic::check)?;
        if self.is_out_of_step() {
            return Err(invalid("step", self.step, format!("{} with traffic: so long are its steps", traffic::STEP)));
        }
        if self.traffic.as_ref().is_some_and(|traffic| 1 < traffic.group) && self.start_along != 0.0 {
            let expected = "0 with traffic.group above 1: trucks that begin on their way would stand in each other";
            return Err(invalid("start_along", self.start_along, expected));
        }
        if self.observes_vehicles && self.traffic.is_none() {
            return Err(invalid("observes_vehicles", true, "with traffic: without it there are none to observe"));
        }
        within("n_substeps", f64::from(self.n_substeps), self.substeps())?;
        within("vehicle.model.steer_delay", self.longest_steer_delay(), [0.0, MOST_DELAY * self.step])
    }

    /// Whether its step is not that of the vehicles around each truck.
    pub(super) fn is_out_of_step(&self) -> bool {
        self.traffic.is_some() && self.step as f32 != traffic::STEP
    }

    /// The longest steer delay of its vehicles (s).
    pub(super) fn longest_steer_delay(&self) -> f64 {
        let drawn = self.fleet.iter().flat_map(|fleet| fleet.extremes().map(|(_, vehicle)| vehicle.model.steer_delay));
        drawn.fold(self.vehicle.model.steer_delay, f64::max)
    }

    /// Fewest and most sub-steps of a step. In too long a sub-step a fast truck goes farther than a short trailer is
    /// long, and its motion diverges; in too short a one it goes less far than positions in single precision tell.
    pub(super) fn substeps(&self) -> [f64; 2] {
        let lever = |vehicle: &Vehicle| vehicle.trailer.wheelbase - vehicle.model.slip_lever;
        let drawn = self.fleet.iter().flat_map(|fleet| fleet.extremes().map(|(_, vehicle)| lever(&vehicle)));
        let shortest = drawn.fold(lever(&self.vehicle), f64::min);
        let fastest = self.start_speed.iter().flatten().copied().fold(self.cruising_speed(), f64::max);
        [
            (fastest * self.step / shortest - 1e-9).ceil().max(1.0),
            (self.step / SHORTEST_SUBSTEP + 1e-9).floor().max(1.0),
        ]
    }

    fn check_numbers(&self) -> Result<(), Invalid> {
        if let Some(lock) = self.steer_max {
            within("steer_max", lock, LOCK)?;
        }
        within("n_substeps", f64::from(self.n_substeps), [1.0, 10_000.0])?;
        // Beyond these widths the field would fill the memory, or miss the kerbs.
        within("cell", self.cell, [0.05, 2.0])?;
        let positive = [
            ("step", self.step),
            ("spacing", self.spacing),
            ("sensor_range", self.sensor_range),
            ("stray_distance", self.stray_distance),
            ("jackknife_angle", self.jackknife_angle),
            ("rollover_ratio", self.rollover_ratio),
            ("time_limit", self.time_limit),
        ];
        let finite = [("start_offset", self.start_offset), ("start_heading", self.start_heading)];
        positive.into_iter().try_for_each(|(key, value)| within(key, value, POSITIVE))?;
        if self.stray_distance < self.spacing {
            let expected = format!("at least spacing, {}: a truck begins so far from the next waypoint", self.spacing);
            return Err(invalid("stray_distance", self.stray_distance, expected));
        }
        finite.into_iter().try_for_each(|(key, value)| within(key, value, FINITE))?;
        let reward = REWARD_KEYS.iter().zip(self.reward.values());
        reward.into_iter().try_for_each(|(key, value)| within(&format!("reward.{}", key.name), value, key.range))
    }

    /// Every route leads somewhere, and there is one.
    fn check_routes(&self) -> Result<(), Invalid> {
        if self.places.iter().all(|place| place.routes.is_empty()) {
            let expected = format!(
                "at least one route is needed: the file of {} must list some in the split that is used",
                self.name
            );
            return Err(invalid("places", "no routes", expected));
        }
        for (index, place) in self.places.iter().enumerate() {
            for (number, route) in place.routes.iter().enumerate() {
                let key = format!("places[{index}].routes[{number}]");
                if route.waypoints.len() < 2 {
                    let found = format_args!("{} waypoints", route.waypoints.len());
                    return Err(invalid(&format!("{key}.waypoints"), found, "at least 2 are needed"));
                }
                within(&format!("{key}.crossing.0"), route.crossing.0, FINITE)?;
                within(&format!("{key}.crossing.1"), route.crossing.1, FINITE)?;
                for (at, waypoint) in route.waypoints.iter().enumerate() {
                    let values = [waypoint.position.x, waypoint.position.y, waypoint.heading];
                    values
                        .into_iter()
                        .try_for_each(|value| within(&format!("{key}.waypoints[{at}]"), value, FINITE))?;
                }
            }
        }
        Ok(())
    }
}

pub(super) fn check_vehicle(vehicle: &Vehicle) -> Result<(), Invalid> {
    let Vehicle { tractor, trailer, loads, speed_control, sensors, model } = vehicle;
    let positive = [
        ("tractor.wheelbase", tractor.wheelbase),
        ("tractor.width", tractor.width),
        ("tractor.steer_rate", tractor.steer_rate),
        ("tractor.friction", tractor.friction),
        ("tractor.mass", tractor.mass),
        ("trailer.wheelbase", trailer.wheelbase),
        ("trailer.width", trailer.width),
    ];
    let finite = [
        ("tractor.fifth_wheel", tractor.fifth_wheel),
        ("tractor.front_overhang", tractor.front_overhang),
        ("tractor.rear_overhang", tractor.rear_overhang),
        ("trailer.kingpin_to_front", trailer.kingpin_to_front),
        ("trailer.kingpin_to_rear", trailer.kingpin_to_rear),
        ("speed_control.gain", speed_control.gain),
        ("speed_control.integral_gain", speed_control.integral_gain),
        ("speed_control.integral_band", speed_control.integral_band),
        ("sensors.trailer_first", sensors.trailer_first),
        ("sensors.trailer_last", sensors.trailer_last),
    ];
    let key = |key: &str| format!("vehicle.{key}");
    within(&key("tractor.steer_max"), tractor.steer_max, LOCK)?;
    positive.into_iter().try_for_each(|(name, value)| within(&key(name), value, POSITIVE))?;
    finite.into_iter().try_for_each(|(name, value)| within(&key(name), value, FINITE))?;
    for (index, mount) in sensors.tractor_mounts.iter().enumerate() {
        let name = key(&format!("sensors.tractor_mounts[{index}]"));
        within(&name, mount.x, FINITE)?;
        within(&name, mount.y, FINITE)?;
    }
    within(&key("speed_control.braking"), speed_control.braking, NEGATIVE)?;
    check_model(&key("model"), model, trailer.wheelbase)?;
    check_suspension(&key("tractor.suspension"), &tractor.suspension)?;
    for (name, load) in loads {
        let key = key(&format!("loads.{name}"));
        within(&format!("{key}.mass"), load.mass, POSITIVE)?;
        within(&format!("{key}.slip"), load.slip, FINITE)?;
        within(&format!("{key}.acceleration_min"), load.acceleration_min, NEGATIVE)?;
        within(&format!("{key}.acceleration_max"), load.acceleration_max, POSITIVE)?;
        check_suspension(&format!("{key}.suspension"), &load.suspension)?;
    }
    Ok(())
}

fn check_model(key: &str, model: &Model, trailer_wheelbase: f64) -> Result<(), Invalid> {
    // The trailer's lever stays positive; to a nanometre, as decimals are subtracted.
    let longest = ((trailer_wheelbase - 0.01) * 1e9).round() / 1e9;
    within(&format!("{key}.slip_lever"), model.slip_lever, [0.0, longest])?;
    let times = [("yaw_lag", model.yaw_lag), ("drive_lag", model.drive_lag), ("brake_lag", model.brake_lag)];
    times.into_iter().try_for_each(|(name, value)| within(&format!("{key}.{name}"), value, [0.0, 1e6]))?;
    model.power.map_or(Ok(()), |power| within(&format!("{key}.power"), power, POSITIVE))?;
    within(&format!("{key}.crossfall"), model.crossfall, [-1.0, 1.0])?;
    within(&format!("{key}.slip_growth"), model.slip_growth, [0.0, 1e3])?;
    within(&format!("{key}.understeer"), model.understeer, [-1.0, 1.0])?;
    within(&format!("{key}.fifth_wheel_load"), model.fifth_wheel_load, [0.0, 1.0])
}

fn check_suspension(key: &str, suspension: &Suspension) -> Result<(), Invalid> {
    within(&format!("{key}.centre_of_gravity"), suspension.centre_of_gravity, POSITIVE)?;
    within(&format!("{key}.roll_centre"), suspension.roll_centre, FINITE)?;
    within(&format!("{key}.track"), suspension.track, POSITIVE)?;
    within(&format!("{key}.roll_gain"), suspension.roll_gain, POSITIVE)?;
    within(&format!("{key}.roll_frequency"), suspension.roll_frequency, POSITIVE)?;
    within(&format!("{key}.roll_damping"), suspension.roll_damping, [0.0, 0.9999])
}

pub(super) fn list(key: &str, values: &[f64], range: [f64; 2]) -> Result<(), Invalid> {
    if values.is_empty() {
        return Err(invalid(key, "empty", "at least one value is needed"));
    }
    values.iter().enumerate().try_for_each(|(index, &value)| within(&format!("{key}[{index}]"), value, range))
}

/// NaN lies in no range.
pub(super) fn within(key: &str, value: f64, [least, most]: [f64; 2]) -> Result<(), Invalid> {
    if (least..=most).contains(&value) {
        Ok(())
    } else {
        Err(invalid(key, value, format!("must lie in {least}..{most}")))
    }
}

pub(super) fn invalid(key: &str, value: impl Display, expected: impl Into<String>) -> Invalid {
    Invalid { key: key.to_owned(), value: value.to_string(), expected: expected.into() }
}
