//! A vehicle file as written, and the checks that turn it into a [`Vehicle`].

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use glam::DVec2;
use serde::Deserialize;

use super::{Load, Model, Sensors, SpeedControl, Suspension, Tractor, Trailer, Vehicle};
use crate::files::reader::{Error, Exactly, Reader, printable};
use crate::files::shipped::Source;
use crate::layout::N_TRACTOR_RAYS;

/// Maximum length of a load's name (characters).
const LONGEST_NAME: usize = 40;
/// Wheelbases of a tractor and of a trailer, and heights of a centre of gravity, that a file may have (m).
pub(crate) const TRACTOR_WHEELBASE: RangeInclusive<f64> = 2.0..=10.0;
pub(crate) const KINGPIN_TO_FRONT: RangeInclusive<f64> = 0.0..=5.0;
pub(crate) const KINGPIN_TO_REAR: RangeInclusive<f64> = 1.0..=25.0;
pub(crate) const TRAILER_WHEELBASE: RangeInclusive<f64> = 2.5..=20.0;
pub(crate) const CENTRE_OF_GRAVITY: RangeInclusive<f64> = 0.2..=5.0;
/// Slip leaves a trailer at least so much of its lever (m).
pub(crate) const LEAST_LEVER: f64 = 1.0;

/// The file as written. Its values are not checked yet.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    tractor: WrittenTractor,
    trailer: WrittenTrailer,
    loads: BTreeMap<String, WrittenLoad>,
    #[serde(default)]
    speed_control: WrittenSpeedControl,
    #[serde(default)]
    sensors: WrittenSensors,
    #[serde(default)]
    model: WrittenModel,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenTractor {
    wheelbase: f64,
    fifth_wheel: f64,
    front_overhang: f64,
    rear_overhang: f64,
    width: f64,
    steer_max_deg: f64,
    steer_rate_deg: f64,
    #[serde(default = "dry_asphalt")]
    friction: f64,
    mass: f64,
    suspension: WrittenSuspension,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenTrailer {
    wheelbase: f64,
    kingpin_to_front: f64,
    kingpin_to_rear: f64,
    width: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenLoad {
    mass: f64,
    slip: f64,
    acceleration_min: f64,
    acceleration_max: f64,
    suspension: WrittenSuspension,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenSuspension {
    centre_of_gravity: f64,
    roll_centre: f64,
    track: f64,
    roll_gain: f64,
    roll_frequency: f64,
    roll_damping: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct WrittenSpeedControl {
    gain: f64,
    integral_gain: f64,
    integral_band_kmh: f64,
    braking: f64,
}

impl Default for WrittenSpeedControl {
    fn default() -> Self {
        WrittenSpeedControl { gain: 0.8, integral_gain: 0.05, integral_band_kmh: 0.5, braking: -2.5 }
    }
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct WrittenSensors {
    tractor_mounts: Option<Vec<Exactly<f64, 2>>>,
    trailer_first: Option<f64>,
    trailer_last: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct WrittenModel {
    slip_lever: f64,
    yaw_lag: f64,
    drive_lag: f64,
    brake_lag: f64,
    steer_delay: f64,
    power: Option<f64>,
    friction_ellipse: bool,
    crossfall: f64,
    slip_growth: f64,
    understeer_deg: f64,
    fifth_wheel_load: f64,
}

impl Default for WrittenModel {
    fn default() -> Self {
        let model = Model::default();
        WrittenModel {
            slip_lever: model.slip_lever,
            yaw_lag: model.yaw_lag,
            drive_lag: model.drive_lag,
            brake_lag: model.brake_lag,
            steer_delay: model.steer_delay,
            power: model.power,
            friction_ellipse: model.friction_ellipse,
            crossfall: model.crossfall,
            slip_growth: model.slip_growth,
            understeer_deg: model.understeer.to_degrees(),
            fifth_wheel_load: model.fifth_wheel_load,
        }
    }
}

/// Friction of truck tyres on dry asphalt.
fn dry_asphalt() -> f64 {
    0.7
}

impl Vehicle {
    /// Reads and checks a vehicle file.
    pub(crate) fn from_source(source: &Source) -> Result<Vehicle, Error> {
        let file = source.shown();
        let (reader, written) = Reader::parse::<Written>(&file, &source.text()?)?;
        let tractor = tractor(&reader, &written.tractor)?;
        let trailer = trailer(&reader, &written.trailer)?;
        if tractor.fifth_wheel.abs() >= trailer.wheelbase {
            let limit = format!("must be nearer to the drive axle than trailer.wheelbase, {} m", trailer.wheelbase);
            return Err(reader.invalid("tractor.fifth_wheel", format_args!("{} m", tractor.fifth_wheel), limit));
        }
        if written.loads.is_empty() {
            return Err(reader.invalid("loads", "empty", "at least one table [loads.NAME] is needed"));
        }
        let loads = written.loads.into_iter().map(|(name, written)| {
            if name.is_empty() || LONGEST_NAME < name.chars().count() || printable(&name) != name {
                let expected = format!("a load's name must be 1 to {LONGEST_NAME} characters, all of them visible");
                return Err(reader.invalid("loads", format_args!("{name:?}"), expected));
            }
            let load = load(&reader, &format!("loads.{name}"), &written)?;
            Ok((name, load))
        });
        Ok(Vehicle {
            loads: loads.collect::<Result<_, Error>>()?,
            speed_control: speed_control(&reader, &written.speed_control)?,
            sensors: sensors(&reader, &written.sensors, &tractor, &trailer)?,
            model: model(&reader, "model", &written.model, &trailer)?,
            tractor,
            trailer,
        })
    }
}

fn tractor(reader: &Reader, written: &WrittenTractor) -> Result<Tractor, Error> {
    Ok(Tractor {
        wheelbase: reader.within("tractor.wheelbase", written.wheelbase, TRACTOR_WHEELBASE, "m")?,
        fifth_wheel: reader.within("tractor.fifth_wheel", written.fifth_wheel, -3.0..=3.0, "m")?,
        front_overhang: reader.within("tractor.front_overhang", written.front_overhang, 0.0..=3.0, "m")?,
        rear_overhang: reader.within("tractor.rear_overhang", written.rear_overhang, 0.0..=4.0, "m")?,
        width: reader.within("tractor.width", written.width, 1.0..=4.0, "m")?,
        steer_max: reader.within("tractor.steer_max_deg", written.steer_max_deg, 1.0..=80.0, "deg")?.to_radians(),
        steer_rate: reader.within("tractor.steer_rate_deg", written.steer_rate_deg, 1.0..=720.0, "deg/s")?.to_radians(),
        friction: reader.within("tractor.friction", written.friction, 0.05..=2.0, "")?,
        mass: reader.within("tractor.mass", written.mass, 500.0..=30_000.0, "kg")?,
        suspension: suspension(reader, "tractor", &written.suspension)?,
    })
}

fn trailer(reader: &Reader, written: &WrittenTrailer) -> Result<Trailer, Error> {
    let trailer = Trailer {
        // Slip shortens this lever by up to `model.slip_lever`: it stays well positive.
        wheelbase: reader.within("trailer.wheelbase", written.wheelbase, TRAILER_WHEELBASE, "m")?,
        kingpin_to_front: reader.within("trailer.kingpin_to_front", written.kingpin_to_front, KINGPIN_TO_FRONT, "m")?,
        kingpin_to_rear: reader.within("trailer.kingpin_to_rear", written.kingpin_to_rear, KINGPIN_TO_REAR, "m")?,
        width: reader.within("trailer.width", written.width, 1.0..=4.0, "m")?,
    };
    if trailer.kingpin_to_rear < trailer.wheelbase {
        let found = format!("{} m", trailer.kingpin_to_rear);
        let expected = format!("its axles would be behind it: must be at least the wheelbase, {} m", trailer.wheelbase);
        return Err(reader.invalid("trailer.kingpin_to_rear", found, expected));
    }
    Ok(trailer)
}

fn load(reader: &Reader, key: &str, written: &WrittenLoad) -> Result<Load, Error> {
    let within = |name: &str, value, range, unit| reader.within(&format!("{key}.{name}"), value, range, unit);
    Ok(Load {
        mass: within("mass", written.mass, 500.0..=100_000.0, "kg")?,
        slip: within("slip", written.slip, 0.0..=0.1, "rad/(m/s^2)")?,
        acceleration_min: within("acceleration_min", written.acceleration_min, -12.0..=-0.1, "m/s^2")?,
        acceleration_max: within("acceleration_max", written.acceleration_max, 0.05..=10.0, "m/s^2")?,
        suspension: suspension(reader, key, &written.suspension)?,
    })
}

fn suspension(reader: &Reader, key: &str, written: &WrittenSuspension) -> Result<Suspension, Error> {
    let within =
        |name: &str, value, range, unit| reader.within(&format!("{key}.suspension.{name}"), value, range, unit);
    let centre_of_gravity = within("centre_of_gravity", written.centre_of_gravity, CENTRE_OF_GRAVITY, "m")?;
    Ok(Suspension {
        centre_of_gravity,
        roll_centre: within("roll_centre", written.roll_centre, 0.0..=centre_of_gravity, "m")?,
        track: within("track", written.track, 1.0..=3.5, "m")?,
        roll_gain: within("roll_gain", written.roll_gain, 0.001..=1.0, "rad/g")?,
        roll_frequency: within("roll_frequency", written.roll_frequency, 0.1..=5.0, "Hz")?,
        roll_damping: within("roll_damping", written.roll_damping, 0.0..=0.95, "")?,
    })
}

fn speed_control(reader: &Reader, written: &WrittenSpeedControl) -> Result<SpeedControl, Error> {
    let within = |name: &str, value, range, unit| reader.within(&format!("speed_control.{name}"), value, range, unit);
    Ok(SpeedControl {
        gain: within("gain", written.gain, 0.01..=10.0, "1/s")?,
        integral_gain: within("integral_gain", written.integral_gain, 0.0..=10.0, "1/s^2")?,
        integral_band: within("integral_band_kmh", written.integral_band_kmh, 0.0..=200.0, "km/h")? / 3.6,
        braking: within("braking", written.braking, -12.0..=-0.1, "m/s^2")?,
    })
}

/// Checks the keys of a `model` table, of a vehicle or in place of one.
pub(crate) fn model(reader: &Reader, key: &str, written: &WrittenModel, trailer: &Trailer) -> Result<Model, Error> {
    let within = |name: &str, value, range, unit| reader.within(&format!("{key}.{name}"), value, range, unit);
    Ok(Model {
        // Slip shortens the trailer's lever by so much: it stays well positive.
        slip_lever: within(
            "slip_lever",
            written.slip_lever,
            0.0..=decimal(trailer.wheelbase - LEAST_LEVER).min(4.0),
            "m",
        )?,
        yaw_lag: within("yaw_lag", written.yaw_lag, 0.0..=5.0, "")?,
        drive_lag: within("drive_lag", written.drive_lag, 0.0..=5.0, "s")?,
        brake_lag: within("brake_lag", written.brake_lag, 0.0..=5.0, "s")?,
        steer_delay: within("steer_delay", written.steer_delay, 0.0..=1.0, "s")?,
        power: written.power.map(|power| within("power", power, 1e4..=1e6, "W")).transpose()?,
        friction_ellipse: written.friction_ellipse,
        crossfall: within("crossfall", written.crossfall, -0.1..=0.1, "")?,
        slip_growth: within("slip_growth", written.slip_growth, 0.0..=5.0, "")?,
        understeer: within("understeer_deg", written.understeer_deg, -5.0..=10.0, "deg/g")?.to_radians(),
        fifth_wheel_load: within("fifth_wheel_load", written.fifth_wheel_load, 0.0..=0.6, "")?,
    })
}

/// A sum as decimals add up: that of floats may lie below it.
fn decimal(sum: f64) -> f64 {
    sum.max((sum * 1e9).round() / 1e9)
}

fn sensors(reader: &Reader, written: &WrittenSensors, tractor: &Tractor, trailer: &Trailer) -> Result<Sensors, Error> {
    let length = trailer.kingpin_to_front + trailer.kingpin_to_rear;
    let up_to = |end: f64, name: &str, value, from| {
        reader.within(name, value, from..=decimal(end), "m").map(|at: f64| at.min(end))
    };
    let within = |name: &str, value, from| up_to(length, name, value, from);
    let trailer_first = within("sensors.trailer_first", written.trailer_first.unwrap_or(0.0), 0.0)?;
    let trailer_last = within("sensors.trailer_last", written.trailer_last.unwrap_or(length), trailer_first)?;
    let front = tractor.wheelbase + tractor.front_overhang;
    let mut tractor_mounts = [DVec2::new(front, 0.0); N_TRACTOR_RAYS];
    if let Some(mounts) = &written.tractor_mounts {
        reader.length("sensors.tractor_mounts", mounts.len(), N_TRACTOR_RAYS..=N_TRACTOR_RAYS, "mounts")?;
        for (index, (mount, &Exactly([ahead, left]))) in tractor_mounts.iter_mut().zip(mounts).enumerate() {
            let key = format!("sensors.tractor_mounts[{index}]");
            let half_width = 0.5 * tractor.width;
            *mount = DVec2::new(
                up_to(front, &format!("{key}[0]"), ahead, -tractor.rear_overhang)?,
                reader.within(&format!("{key}[1]"), left, -half_width..=half_width, "m")?,
            );
        }
    }
    Ok(Sensors { tractor_mounts, trailer_first, trailer_last })
}
