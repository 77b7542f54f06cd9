//! Reads `[[vehicle]]` and `[draw]` of a benchmark file, and checks every value.

use std::ops::RangeInclusive;
use std::path::Path;

use super::{Fleet, Member, N_VEHICLES, Ranges};
use crate::files::reader::{Error, Exactly, Reader};
use crate::files::shipped::{Kind, Source};
use crate::scenario::benchmark_keys::{Written, WrittenDraw, WrittenMember, WrittenVehicles};
use crate::scenario::check::{Invalid, check_vehicle, within};
use crate::scenario::referred::referred;
use crate::vehicle::{
    CENTRE_OF_GRAVITY, KINGPIN_TO_FRONT, KINGPIN_TO_REAR, LEAST_LEVER, TRACTOR_WHEELBASE, TRAILER_WHEELBASE, Vehicle,
    read_model,
};

/// Maximum number of rows of a table of vehicles: they take about 45 MB with a chassis each.
const MOST_VEHICLES: usize = 65_536;
/// A length is drawn as so much more or less at most, and the height of a centre of gravity (m).
const MOST_LONGER: f64 = 3.0;
const MOST_HIGHER: f64 = 1.0;
/// Maximum number of kinds of vehicle.
const MOST_MEMBERS: usize = 64;

/// The vehicle and load of a benchmark and, where it has several or draws them, all of them; of these the first stands
/// for the others.
pub(in crate::scenario) fn vehicles(
    reader: &Reader,
    source: &Source,
    written: &Written,
) -> Result<(Vehicle, String, Option<Fleet>), Error> {
    let members = match &written.vehicle {
        WrittenVehicles::One(file) => {
            let (name, vehicle) = read_vehicle(reader, source, "vehicle", file)?;
            let Some(load) = &written.load else {
                return Err(reader.invalid("load", "missing", format!("the vehicle has {}", known(&vehicle))));
            };
            check_load(reader, "load", &vehicle, load)?;
            let Some(_) = &written.draw else { return Ok((vehicle, load.clone(), None)) };
            Vec::from([Member { name, vehicle, share: 1.0, loads: [(load.clone(), 1.0)].into(), drawn: true }])
        }
        WrittenVehicles::Many(tables) => {
            if let Some(load) = &written.load {
                return Err(reader.invalid(
                    "load",
                    format_args!("{load:?}"),
                    "each [[vehicle]] has its own `loads`: leave it out",
                ));
            }
            reader.length("vehicle", tables.len(), 1..=MOST_MEMBERS, "tables")?;
            let read = |(index, table)| member(reader, source, &format!("vehicle[{index}]"), table);
            tables.iter().enumerate().map(read).collect::<Result<Vec<Member>, Error>>()?
        }
    };
    let fleet = drawn(reader, members, written.draw.as_ref().unwrap_or(&WrittenDraw::default()))?;
    let first = &fleet.members[0];
    let load = first.first_load().cloned().unwrap_or_default();
    Ok((first.vehicle.clone(), load, Some(fleet)))
}

fn read_vehicle(reader: &Reader, source: &Source, key: &str, file: &Path) -> Result<(String, Vehicle), Error> {
    let read = |source: &Source| Ok((source.stem(), Vehicle::from_source(source)?));
    referred(reader, key, source, Kind::Vehicle, file, read)
}

fn known(vehicle: &Vehicle) -> String {
    vehicle.loads.keys().map(String::as_str).collect::<Vec<&str>>().join(", ")
}

fn check_load(reader: &Reader, key: &str, vehicle: &Vehicle, load: &str) -> Result<(), Error> {
    if vehicle.loads.contains_key(load) {
        return Ok(());
    }
    Err(reader.invalid(key, format_args!("{load:?}"), format!("the vehicle has {}", known(vehicle))))
}

fn member(reader: &Reader, source: &Source, key: &str, written: &WrittenMember) -> Result<Member, Error> {
    let (name, mut vehicle) = read_vehicle(reader, source, &format!("{key}.file"), &written.file)?;
    if let Some(model) = &written.model {
        vehicle.model = read_model(reader, &format!("{key}.model"), model, &vehicle.trailer)?;
    }
    for (load, &share) in &written.loads {
        check_load(reader, &format!("{key}.loads"), &vehicle, load)?;
        reader.within(&format!("{key}.loads.{load}"), share, 0.0..=1e6, "")?;
    }
    if written.loads.values().all(|&share| share == 0.0) {
        return Err(reader.invalid(
            format!("{key}.loads"),
            "none",
            format!("at least one is needed; the vehicle has {}", known(&vehicle)),
        ));
    }
    let share = reader.within(&format!("{key}.share"), written.share, 1e-6..=1e6, "")?;
    Ok(Member { name, vehicle, share, loads: written.loads.clone(), drawn: written.drawn })
}

/// The fleet, whose vehicles make sense whatever is drawn.
fn drawn(reader: &Reader, members: Vec<Member>, written: &WrittenDraw) -> Result<Fleet, Error> {
    let n_vehicles = reader.count("draw.n_vehicles", written.n_vehicles.unwrap_or(N_VEHICLES), 1..=MOST_VEHICLES)?;
    let mut given = Vec::new();
    let mut range = |key: &'static str, range: Option<Exactly<f64, 2>>, [least, greatest]: [f64; 2], unit: &str| {
        let Some(Exactly(range)) = range else { return Ok(None) };
        for (index, end) in range.into_iter().enumerate() {
            reader.within(&format!("draw.{key}[{index}]"), end, least..=greatest, unit)?;
        }
        let [from, to] = range;
        if to < from {
            return Err(reader.invalid(
                format!("draw.{key}"),
                format_args!("[{from}, {to}]"),
                "must be [least, greatest]",
            ));
        }
        given.push(key);
        Ok(Some(range))
    };
    let (length, height, factor, time) =
        ([-MOST_LONGER, MOST_LONGER], [-MOST_HIGHER, MOST_HIGHER], [0.1, 10.0], [0.0, 5.0]);
    let draw = Ranges {
        trailer_wheelbase: range("trailer_wheelbase", written.trailer_wheelbase, length, "m")?,
        tractor_wheelbase: range("tractor_wheelbase", written.tractor_wheelbase, length, "m")?,
        fifth_wheel: range("fifth_wheel", written.fifth_wheel, length, "m")?,
        centre_of_gravity: range("centre_of_gravity", written.centre_of_gravity, height, "m")?,
        roll_gain: range("roll_gain", written.roll_gain, factor, "")?,
        roll_frequency: range("roll_frequency", written.roll_frequency, factor, "")?,
        roll_damping: range("roll_damping", written.roll_damping, factor, "")?,
        slip: range("slip", written.slip, [0.0, 10.0], "")?,
        friction: range("friction", written.friction, factor, "")?,
        steer_rate: range("steer_rate", written.steer_rate, factor, "")?,
        acceleration_max: range("acceleration_max", written.acceleration_max, factor, "")?,
        steer_delay: range("steer_delay", written.steer_delay, [0.0, 1.0], "s")?,
        drive_lag: range("drive_lag", written.drive_lag, time, "s")?,
        brake_lag: range("brake_lag", written.brake_lag, time, "s")?,
        yaw_lag: range("yaw_lag", written.yaw_lag, [0.0, 5.0], "")?,
        slip_growth: range("slip_growth", written.slip_growth, [0.0, 5.0], "")?,
        understeer: range("understeer_deg", written.understeer_deg, [-5.0, 10.0], "deg/g")?
            .map(|range| range.map(f64::to_radians)),
    };
    let fleet = Fleet { members, draw, n_vehicles };
    if let Some((member, load, share, n_rows)) = fleet.without_row() {
        let value = format_args!("{n_rows} vehicles, of which {} {load} is {share:.1e}", member.name);
        let expected = "none would be one: more vehicles, a larger share, or 0 for what is not to drive";
        return Err(reader.invalid("draw.n_vehicles", value, expected));
    }
    for (member, vehicle) in fleet.extremes() {
        check_drawn(&vehicle).and_then(|()| check_vehicle(&vehicle)).map_err(|wrong| {
            let expected = format!("of {} with all ranges at their ends: {}", member.name, wrong.expected);
            let of = wrong.key.strip_prefix("vehicle.").unwrap_or(&wrong.key);
            // tractor_wheelbase draws tractor.wheelbase.
            let drawn = given.iter().find(|key| of.ends_with(*key) || of.ends_with(&key.replacen('_', ".", 1)));
            let key = drawn.map_or("draw".to_owned(), |key| format!("draw.{key}"));
            reader.invalid(key, format_args!("{of} {}", wrong.value), expected)
        })?;
    }
    Ok(fleet)
}

/// What a vehicle's file must keep to between its values holds for what is drawn, too.
fn check_drawn(vehicle: &Vehicle) -> Result<(), Invalid> {
    let (tractor, trailer) = (&vehicle.tractor, &vehicle.trailer);
    // As of a file: nearer to the drive axle than the trailer's axles are to the kingpin.
    let nearer = trailer.wheelbase - 0.01;
    let longer = |range: RangeInclusive<f64>| [*range.start(), range.end() + MOST_LONGER];
    within("tractor.wheelbase", tractor.wheelbase, longer(TRACTOR_WHEELBASE))?;
    within("trailer.wheelbase", trailer.wheelbase, longer(TRAILER_WHEELBASE))?;
    within("model.slip_lever", vehicle.model.slip_lever, [0.0, trailer.wheelbase - LEAST_LEVER])?;
    within("tractor.fifth_wheel", tractor.fifth_wheel, [-nearer, nearer])?;
    within("trailer.kingpin_to_rear", trailer.kingpin_to_rear, longer(KINGPIN_TO_REAR))?;
    let sensors = &vehicle.sensors;
    let longest = KINGPIN_TO_FRONT.end() + KINGPIN_TO_REAR.end() + MOST_LONGER;
    within("sensors.trailer_last", sensors.trailer_last, [sensors.trailer_first, longest])?;
    let loads = vehicle.loads.iter().map(|(name, load)| (format!("loads.{name}"), &load.suspension));
    let units = std::iter::once(("tractor".to_owned(), &tractor.suspension)).chain(loads);
    for (unit, suspension) in units {
        let key = format!("{unit}.suspension.centre_of_gravity");
        let least = suspension.roll_centre.max(*CENTRE_OF_GRAVITY.start());
        within(&key, suspension.centre_of_gravity, [least, CENTRE_OF_GRAVITY.end() + MOST_HIGHER])?;
    }
    Ok(())
}
