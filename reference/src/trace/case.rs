//! A case as written in its file, and the checks before it is driven.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use offtrack::files::reader::{shortened, shown};
use offtrack::layout::{Lag, Rig};
use offtrack::vehicle::{GRAVITY, SLIP_LEVER, Suspension};
use serde::Deserialize;
use serde::de::IgnoredAny;

/// Lateral acceleration (m/s^2) and power (W/kg) far beyond any truck's, for cases without friction or power.
const UNLIMITED: f32 = 1e6;

/// A case whose values make no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("case {:?}: {key}: {value}; {expected}", shortened(id, 100))]
pub struct Error {
    /// The case.
    pub id: String,
    /// The key in the case, `vehicle.L1`.
    pub key: String,
    /// The value as written.
    pub value: String,
    /// What would do.
    pub expected: String,
}

/// A truck, its initial state and its commands, in the symbols of the reference equations. Other keys are ignored.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Case {
    /// The case's name.
    pub id: String,
    /// The truck.
    pub vehicle: CaseVehicle,
    /// Length of a sub-step (s).
    pub dt: f64,
    /// Time between two decisions of the speed control (s).
    #[serde(default = "control_step")]
    pub control_step: f64,
    /// Initial state.
    pub init: Init,
    /// Commands in order of time.
    pub commands: Vec<Command>,
    /// End of the case (s).
    pub t_end: f64,
    /// Instants to report, ascending; those of `expected` where absent (s).
    pub times: Option<Vec<f64>>,
    /// Reference states. Only their instants are used here.
    #[serde(default)]
    pub expected: Vec<Instant>,
}

/// The truck of a case.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[expect(non_snake_case, reason = "the format's own symbols")]
pub struct CaseVehicle {
    /// Wheelbase (m).
    pub L1: f64,
    /// Fifth wheel ahead of the drive axle (m).
    pub a: f64,
    /// Kingpin to axle group (m).
    pub L2: f64,
    /// Slip factor [rad/(m/s^2)].
    pub K: f64,
    /// Lateral acceleration that the tyres can hold, in units of gravity; unlimited where absent.
    pub mu: Option<f64>,
    /// Lock (rad).
    pub delta_max: f64,
    /// Steer rate (rad/s).
    pub delta_rate: f64,
    /// Strongest drive (m/s^2).
    pub a_max: f64,
    /// Strongest braking, negative (m/s^2).
    pub a_min: f64,
    /// Articulation beyond which the truck is jackknifed (rad).
    #[serde(default = "right_angle")]
    pub gamma_max: f64,
    /// Track of the tractor (m).
    pub T1: f64,
    /// Height of the tractor's centre of gravity (m).
    pub h1: f64,
    /// Height of the tractor's roll centre (m).
    pub hr1: f64,
    /// Roll gain of the tractor (rad/g).
    pub Rphi1: f64,
    /// Roll frequency of the tractor (Hz).
    pub fn1: f64,
    /// Roll damping of the tractor.
    pub zeta1: f64,
    /// Track of the trailer (m).
    pub T2: f64,
    /// Height of the trailer's centre of gravity (m).
    pub h2: f64,
    /// Height of the trailer's roll centre (m).
    pub hr2: f64,
    /// Roll gain of the trailer (rad/g).
    pub Rphi2: f64,
    /// Roll frequency of the trailer (Hz).
    pub fn2: f64,
    /// Roll damping of the trailer.
    pub zeta2: f64,
    /// Bound of `K v²` (m).
    #[serde(default = "slip_lever")]
    pub lever_max: f64,
    /// Increase of each unit's slip with its load transfer ratio: `K` times `1 + slip_growth |ratio|`.
    #[serde(default)]
    pub slip_growth: f64,
    /// Increase of the steer angle that a path needs, per lateral acceleration [rad/(m/s^2)].
    #[serde(default)]
    pub understeer: f64,
    /// Fraction by which the trailer's load transfer ratio counts in the tractor's.
    #[serde(default)]
    pub fifth_wheel_load: f64,
    /// Time constant of the tractor's yaw over `K v`.
    #[serde(default)]
    pub yaw_lag: f64,
    /// Time constant of the drive (s).
    #[serde(default)]
    pub drive_lag: f64,
    /// Time constant of the brakes (s).
    #[serde(default)]
    pub brake_lag: f64,
    /// Time from a steer command to the first movement of the wheels (s).
    #[serde(default)]
    pub delta_delay: f64,
    /// Engine power over the mass of the truck (W/kg); unlimited where absent.
    pub power: Option<f64>,
    /// Whether drive and braking take lateral grip; it needs `mu`.
    #[serde(default)]
    pub ellipse: bool,
    /// Fall of the road to the right, as a tangent.
    #[serde(default)]
    pub crossfall: f64,
    /// Speed control: acceleration per speed error (1/s).
    #[serde(default = "speed_gain")]
    pub kp: f64,
    /// Speed control: acceleration per integral of the speed error (1/s^2).
    #[serde(default = "speed_integral_gain")]
    pub ki: f64,
    /// Speed control: speed error beyond which the integral is reset to 0 (m/s).
    #[serde(default = "speed_band")]
    pub band: f64,
    /// Speed control: strongest braking, negative (m/s^2).
    #[serde(default = "speed_braking")]
    pub brake: f64,
    /// Keys that no trajectory uses.
    #[serde(flatten)]
    pub ignored: BTreeMap<String, IgnoredAny>,
}

/// Initial state of a case.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Init {
    /// Middle of the drive axle (m).
    pub x: f64,
    /// Middle of the drive axle (m).
    pub y: f64,
    /// Tractor's heading (rad).
    pub psi1: f64,
    /// Trailer's heading (rad).
    pub psi2: f64,
    /// Speed (m/s).
    pub v: f64,
    /// Steer angle (rad).
    pub delta: f64,
}

/// A command, in force until the next one.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Command {
    /// Time from which it is in force (s).
    pub t: f64,
    /// Target steer angle (rad).
    pub delta_cmd: f64,
    /// Target acceleration (m/s^2).
    #[serde(default)]
    pub a_cmd: f64,
    /// Target speed, in place of a target acceleration: the speed control asks for one every `control_step` (m/s).
    pub v_cmd: Option<f64>,
}

/// An instant to report.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Instant {
    /// Time (s).
    pub t: f64,
}

fn control_step() -> f64 {
    0.1
}

fn speed_gain() -> f64 {
    0.8
}

fn speed_integral_gain() -> f64 {
    0.05
}

fn speed_band() -> f64 {
    0.5 / 3.6
}

fn speed_braking() -> f64 {
    -2.5
}

fn slip_lever() -> f64 {
    SLIP_LEVER
}

fn right_angle() -> f64 {
    std::f64::consts::FRAC_PI_2
}

impl CaseVehicle {
    /// The tractor's suspension.
    pub fn tractor_suspension(&self) -> Suspension {
        Suspension {
            centre_of_gravity: self.h1,
            roll_centre: self.hr1,
            track: self.T1,
            roll_gain: self.Rphi1,
            roll_frequency: self.fn1,
            roll_damping: self.zeta1,
        }
    }

    /// The trailer's suspension.
    pub fn trailer_suspension(&self) -> Suspension {
        Suspension {
            centre_of_gravity: self.h2,
            roll_centre: self.hr2,
            track: self.T2,
            roll_gain: self.Rphi2,
            roll_frequency: self.fn2,
            roll_damping: self.zeta2,
        }
    }

    /// The tractor's load transfer ratio where it would have its `own` alone: the trailer leans on it.
    pub fn leaning_on(&self, own: f64, trailers: f64) -> f64 {
        own + self.fifth_wheel_load * (trailers - own)
    }

    /// The rig for the drive stage with sub-steps of `substep` seconds, without outline and speed control.
    pub fn rig(&self, substep: f64) -> Rig {
        Rig {
            wheelbase: self.L1 as f32,
            fifth_wheel: self.a as f32,
            trailer_wheelbase: self.L2 as f32,
            slip: self.K as f32,
            slip_growth: self.slip_growth as f32,
            understeer: self.understeer as f32,
            fifth_wheel_load: self.fifth_wheel_load as f32,
            steer_max: self.delta_max as f32,
            steer_rate: self.delta_rate as f32,
            acceleration_min: self.a_min as f32,
            acceleration_max: self.a_max as f32,
            lateral_acceleration_max: self.mu.map_or(UNLIMITED, |mu| (mu * GRAVITY) as f32),
            tractor_roll: self.tractor_suspension().roll(substep),
            trailer_roll: self.trailer_suspension().roll(substep),
            slip_lever_max: self.lever_max as f32,
            yaw_lag: (self.yaw_lag * self.K) as f32,
            drive_lag: Lag::of(self.drive_lag, substep),
            brake_lag: Lag::of(self.brake_lag, substep),
            power: self.power.map_or(UNLIMITED, |power| power as f32),
            friction_ellipse: self.mu.filter(|_| self.ellipse).map_or(0.0, |mu| (mu * GRAVITY).powi(-2) as f32),
            crossfall: (self.crossfall * GRAVITY) as f32,
            speed_gain: self.kp as f32,
            speed_integral_gain: self.ki as f32,
            speed_integral_band: self.band as f32,
            speed_braking: self.brake as f32,
            ..Rig::default()
        }
    }
}

impl Case {
    /// Checks every value and gives the instants to report, ascending (s).
    pub(super) fn checked_times(&self) -> Result<Vec<f64>, Error> {
        let vehicle = &self.vehicle;
        let (any, positive, speed) = (-1e5..=1e5, 1e-3..=1e3, -60.0..=60.0);
        self.within("dt", self.dt, 1e-4..=0.2, "s")?;
        if self.commands.iter().any(|command| command.v_cmd.is_some()) {
            self.within("control_step", self.control_step, self.dt..=10.0, "s")?;
        }
        self.within("vehicle.kp", vehicle.kp, 0.0..=100.0, "1/s")?;
        self.within("vehicle.ki", vehicle.ki, 0.0..=100.0, "1/s^2")?;
        self.within("vehicle.band", vehicle.band, 0.0..=100.0, "m/s")?;
        self.within("vehicle.brake", vehicle.brake, -100.0..=0.0, "m/s^2")?;
        self.within("t_end", self.t_end, 0.0..=3600.0, "s")?;
        self.within("vehicle.L1", vehicle.L1, 0.5..=30.0, "m")?;
        self.within("vehicle.a", vehicle.a, -10.0..=10.0, "m")?;
        self.within("vehicle.lever_max", vehicle.lever_max, 0.0..=10.0, "m")?;
        // Slip shortens this lever: it stays positive.
        self.within("vehicle.L2", vehicle.L2, vehicle.lever_max + 0.1..=50.0, "m")?;
        self.within("vehicle.yaw_lag", vehicle.yaw_lag, 0.0..=5.0, "")?;
        self.within("vehicle.drive_lag", vehicle.drive_lag, 0.0..=5.0, "s")?;
        self.within("vehicle.brake_lag", vehicle.brake_lag, 0.0..=5.0, "s")?;
        self.within("vehicle.delta_delay", vehicle.delta_delay, 0.0..=5.0, "s")?;
        self.within("vehicle.power", vehicle.power.unwrap_or(1.0), 0.01..=1e5, "W/kg")?;
        self.within("vehicle.crossfall", vehicle.crossfall, -0.5..=0.5, "")?;
        self.within("vehicle.K", vehicle.K, 0.0..=1.0, "rad/(m/s^2)")?;
        self.within("vehicle.slip_growth", vehicle.slip_growth, 0.0..=5.0, "")?;
        self.within("vehicle.understeer", vehicle.understeer, -0.01..=0.02, "rad/(m/s^2)")?;
        self.within("vehicle.fifth_wheel_load", vehicle.fifth_wheel_load, 0.0..=1.0, "")?;
        self.within("vehicle.mu", vehicle.mu.unwrap_or(1.0), 0.0..=10.0, "")?;
        if vehicle.ellipse && vehicle.mu.is_none() {
            return Err(self.refused("vehicle.ellipse", "true", "needs vehicle.mu, the grip that it shares out"));
        }
        self.within("vehicle.delta_max", vehicle.delta_max, 0.0..=1.5, "rad")?;
        self.within("vehicle.delta_rate", vehicle.delta_rate, 0.0..=1e3, "rad/s")?;
        self.within("vehicle.a_max", vehicle.a_max, 0.0..=100.0, "m/s^2")?;
        self.within("vehicle.a_min", vehicle.a_min, -100.0..=0.0, "m/s^2")?;
        self.within("vehicle.gamma_max", vehicle.gamma_max, positive.clone(), "rad")?;
        for (unit, suspension) in [("1", vehicle.tractor_suspension()), ("2", vehicle.trailer_suspension())] {
            self.within(&format!("vehicle.T{unit}"), suspension.track, positive.clone(), "m")?;
            self.within(&format!("vehicle.h{unit}"), suspension.centre_of_gravity, positive.clone(), "m")?;
            self.within(
                &format!("vehicle.hr{unit}"),
                suspension.roll_centre,
                -10.0..=suspension.centre_of_gravity,
                "m",
            )?;
            self.within(&format!("vehicle.Rphi{unit}"), suspension.roll_gain, 1e-4..=10.0, "rad/g")?;
            self.within(&format!("vehicle.fn{unit}"), suspension.roll_frequency, 1e-2..=100.0, "Hz")?;
            self.within(&format!("vehicle.zeta{unit}"), suspension.roll_damping, 0.0..=0.99, "")?;
        }
        self.within("init.x", self.init.x, any.clone(), "m")?;
        self.within("init.y", self.init.y, any, "m")?;
        self.within("init.psi1", self.init.psi1, -100.0..=100.0, "rad")?;
        self.within("init.psi2", self.init.psi2, -100.0..=100.0, "rad")?;
        self.within("init.v", self.init.v, speed, "m/s")?;
        self.within("init.delta", self.init.delta, -vehicle.delta_max..=vehicle.delta_max, "rad")?;
        let mut earliest = 0.0;
        for (index, command) in self.commands.iter().enumerate() {
            earliest = self.within(&format!("commands[{index}].t"), command.t, earliest..=f64::MAX, "s")?;
            self.within(&format!("commands[{index}].delta_cmd"), command.delta_cmd, -1e3..=1e3, "rad")?;
            self.within(&format!("commands[{index}].a_cmd"), command.a_cmd, -1e3..=1e3, "m/s^2")?;
            self.within(&format!("commands[{index}].v_cmd"), command.v_cmd.unwrap_or(0.0), 0.0..=60.0, "m/s")?;
        }
        let (key, times) = match &self.times {
            Some(times) => ("times[", times.clone()),
            None => ("expected[", self.expected.iter().map(|instant| instant.t).collect()),
        };
        let tail = if self.times.is_some() { "]" } else { "].t" };
        let mut earliest = 0.0;
        for (index, &t) in times.iter().enumerate() {
            earliest = self.within(&format!("{key}{index}{tail}"), t, earliest..=self.t_end, "s")?;
        }
        Ok(times)
    }

    fn within(&self, key: &str, value: f64, range: RangeInclusive<f64>, unit: &str) -> Result<f64, Error> {
        if range.contains(&value) {
            return Ok(value);
        }
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let limits = if *range.end() == f64::MAX {
            format!("must be at least {}{unit}", shown(*range.start()))
        } else {
            format!("must lie in {}..{}{unit}", shown(*range.start()), shown(*range.end()))
        };
        Err(self.refused(key, format!("{}{unit}", shown(value)), limits))
    }

    fn refused(&self, key: &str, value: impl Into<String>, expected: impl Into<String>) -> Error {
        Error { id: self.id.clone(), key: key.to_owned(), value: value.into(), expected: expected.into() }
    }
}
