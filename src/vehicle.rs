//! Tractor, trailer and load: their dimensions as a vehicle file gives them, and what the stages need of them.
//!
//! The trailer's suspension belongs to the load: an empty trailer and a full tank roll differently on the same axles.

pub mod profile; // how fast a vehicle can drive a route
pub mod swept; // the path of a truck that never leaves its line
mod model;
mod single_track;
mod suspension;
mod vehicle_keys;

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::Path;

use glam::{DVec2, Vec2};

pub use model::{Model, SLIP_LEVER};
pub use single_track::{SingleTrack, Steady};
pub use suspension::Suspension;
pub(crate) use vehicle_keys::{
    CENTRE_OF_GRAVITY, KINGPIN_TO_FRONT, KINGPIN_TO_REAR, LEAST_LEVER, TRACTOR_WHEELBASE, TRAILER_WHEELBASE,
    WrittenModel, model as read_model,
};

use crate::files::reader::Error;
use crate::files::shipped::{Kind, Source};
use crate::layout::{Body, Lag, N_RAYS, N_TRACTOR_RAYS, N_TRAILER_RAYS, Ray, Rig};
use crate::map::Road;

/// Acceleration of free fall (m/s^2).
pub const GRAVITY: f64 = 9.81;
/// Least fraction of its wheelbase that a tractor with oversteer steers as if it had.
pub(crate) const WHEELBASE_MIN: f32 = 0.5;

/// A tractor, its trailer, and every load that the trailer may carry. SI units and radians.
#[derive(Debug, Clone, PartialEq)]
pub struct Vehicle {
    /// The towing unit.
    pub tractor: Tractor,
    /// The towed unit.
    pub trailer: Trailer,
    /// Loads of the trailer, by name.
    pub loads: BTreeMap<String, Load>,
    /// Control of the speed.
    pub speed_control: SpeedControl,
    /// Positions of the distance sensors.
    pub sensors: Sensors,
    /// What its motion takes into account.
    pub model: Model,
}

/// The towing unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Tractor {
    /// Front axle ahead of the drive axle (m).
    pub wheelbase: f64,
    /// Fifth wheel ahead of the drive axle, negative when behind (m).
    pub fifth_wheel: f64,
    /// Front end ahead of the front axle (m).
    pub front_overhang: f64,
    /// Rear end behind the drive axle (m).
    pub rear_overhang: f64,
    /// Width of the outline (m).
    pub width: f64,
    /// Largest steer angle (rad).
    pub steer_max: f64,
    /// Fastest change of the steer angle (rad/s).
    pub steer_rate: f64,
    /// Lateral acceleration that the tyres can hold, in units of gravity.
    pub friction: f64,
    /// Mass (kg).
    pub mass: f64,
    /// The tractor's roll.
    pub suspension: Suspension,
}

/// The towed unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Trailer {
    /// Kingpin ahead of the axle group's centre (m).
    pub wheelbase: f64,
    /// Front end ahead of the kingpin (m).
    pub kingpin_to_front: f64,
    /// Rear end behind the kingpin (m).
    pub kingpin_to_rear: f64,
    /// Width of the outline (m).
    pub width: f64,
}

/// A load of the trailer, and how the truck moves with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Load {
    /// Mass of the trailer with its load (kg).
    pub mass: f64,
    /// Slip angle of an axle per lateral acceleration [rad/(m/s^2)].
    pub slip: f64,
    /// Strongest braking, negative (m/s^2).
    pub acceleration_min: f64,
    /// Strongest drive (m/s^2).
    pub acceleration_max: f64,
    /// Roll of the loaded trailer.
    pub suspension: Suspension,
}

/// A PI controller of the speed with anti-windup.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedControl {
    /// Acceleration per speed error (1/s).
    pub gain: f64,
    /// Acceleration per integral of the speed error (1/s^2).
    pub integral_gain: f64,
    /// Speed error beyond which the integral is reset to 0 (m/s).
    pub integral_band: f64,
    /// Strongest braking that the controller requests, negative (m/s^2).
    pub braking: f64,
}

/// Positions of the distance sensors, each in its unit's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensors {
    /// Tractor sensors, from 90 deg left to 90 deg right: (ahead of the drive axle, left) (m).
    pub tractor_mounts: [DVec2; N_TRACTOR_RAYS],
    /// Foremost trailer sensor, behind the trailer's front end (m).
    pub trailer_first: f64,
    /// Rearmost trailer sensor, behind the trailer's front end (m).
    pub trailer_last: f64,
}

impl Vehicle {
    /// Reads a vehicle file. Every fault that a vehicle can have is found here.
    ///
    /// # Errors
    ///
    /// The file and, for a value that makes no sense, its key, the value and what would do.
    pub fn read(path: &Path) -> Result<Vehicle, Error> {
        Vehicle::from_source(&Source::Disk(path.to_owned()))
    }

    /// A vehicle that comes with the library, by the name of its file under `scenarios/vehicles`, as `daf_xf`.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`], which lists the known names.
    pub fn named(name: &str) -> Result<Vehicle, Error> {
        Vehicle::from_source(&Source::named(Kind::Vehicle, name)?)
    }

    /// Reads a file where `name_or_path` ends in `.toml` or is the path of a file; else the same as [`Vehicle::named`].
    ///
    /// # Errors
    ///
    /// The errors of [`Vehicle::read`] and [`Vehicle::named`].
    pub fn find(name_or_path: &str) -> Result<Vehicle, Error> {
        Vehicle::from_source(&Source::find(Kind::Vehicle, name_or_path)?)
    }

    /// The lengths that decide the trailer's path.
    pub fn single_track(&self) -> SingleTrack {
        SingleTrack {
            wheelbase: self.tractor.wheelbase,
            fifth_wheel: self.tractor.fifth_wheel,
            trailer_wheelbase: self.trailer.wheelbase,
        }
    }

    /// The tractor's outline in the frame of its drive axle.
    pub fn tractor_body(&self) -> Body {
        let Tractor { wheelbase, front_overhang, rear_overhang, width, .. } = self.tractor;
        Body {
            front: (wheelbase + front_overhang) as f32,
            rear: -rear_overhang as f32,
            half_width: (0.5 * width) as f32,
        }
    }

    /// The trailer's outline in the frame of its axle group.
    pub fn trailer_body(&self) -> Body {
        let Trailer { wheelbase, kingpin_to_front, kingpin_to_rear, width } = self.trailer;
        Body {
            front: (wheelbase + kingpin_to_front) as f32,
            rear: (wheelbase - kingpin_to_rear) as f32,
            half_width: (0.5 * width) as f32,
        }
    }

    /// Reach of the straight truck behind and ahead of the middle of its wheelbase, the point that follows a route,
    /// when it is turned by up to `heading` (rad) against the route (m).
    pub fn reach(&self, heading: f64) -> (f64, f64) {
        let Tractor { wheelbase, fifth_wheel, front_overhang, rear_overhang, width, .. } = self.tractor;
        let behind_axle = (self.trailer.kingpin_to_rear - fifth_wheel).max(rear_overhang);
        let ahead_of_axle = (wheelbase + front_overhang).max(fifth_wheel + self.trailer.kingpin_to_front);
        let half_width = 0.5 * width.max(self.trailer.width);
        // A corner reaches furthest once it is turned into the direction of travel.
        let turned = |length: f64| {
            let turn = heading.min((half_width / length).atan());
            length * turn.cos() + half_width * turn.sin()
        };
        (turned(0.5 * wheelbase + behind_axle), turned(ahead_of_axle - 0.5 * wheelbase))
    }

    /// Length of the straight truck, from end to end (m).
    pub fn length(&self) -> f64 {
        let (behind, ahead) = self.reach(0.0);
        behind + ahead
    }

    /// Moves the trailer's axle group back by `length` (m), and its rear end and the sensors there with it.
    pub(crate) fn lengthen_trailer(&mut self, length: f64) {
        self.trailer.wheelbase += length;
        self.trailer.kingpin_to_rear += length;
        self.sensors.trailer_last += length;
    }

    /// Moves the tractor's front axle ahead by `length` (m), and its front end and the sensors there with it.
    pub(crate) fn lengthen_tractor(&mut self, length: f64) {
        let middle = 0.5 * self.tractor.wheelbase;
        self.tractor.wheelbase += length;
        self.sensors.tractor_mounts.iter_mut().filter(|mount| middle < mount.x).for_each(|mount| mount.x += length);
    }

    /// The vehicle on a road as it lies in the world: one that is driven as its mirror image tilts to the other side.
    pub fn seen_on(&self, road: &Road) -> Vehicle {
        let mut vehicle = self.clone();
        if road.is_mirrored() {
            vehicle.model.crossfall = -vehicle.model.crossfall;
        }
        vehicle
    }

    /// Mass of tractor, trailer and load (kg).
    pub fn gross_mass(&self, load: &Load) -> f64 {
        self.tractor.mass + load.mass
    }

    /// Fraction of the load on the tractor's axles that is the trailer's, where the model counts it.
    fn fifth_wheel_part(&self, load: &Load) -> f64 {
        let on_fifth_wheel = self.model.fifth_wheel_load * load.mass;
        on_fifth_wheel / (self.tractor.mass + on_fifth_wheel)
    }

    /// Radius of the circle inside the trailer's axle group when the outermost of both units' front corners runs on a
    /// circle of radius `outer` (m); `None` if the combination cannot turn so tightly. Directive 96/53/EC requires
    /// 5.30 m at 12.50 m.
    pub fn turning_circle_inner_radius(&self, outer: f64) -> Option<f64> {
        let Tractor { wheelbase, front_overhang, width, .. } = self.tractor;
        // Radius of a unit's axle whose front corner, so far ahead of it, runs on the circle.
        let axle = |ahead: f64, width: f64| (outer.powi(2) - ahead.powi(2)).sqrt() - 0.5 * width;
        let steady = self.single_track().at_tractor_radius(axle(wheelbase + front_overhang, width))?;
        let trailer = &self.trailer;
        let own = axle(trailer.wheelbase + trailer.kingpin_to_front, trailer.width);
        (0.0 < own).then(|| steady.trailer_radius.min(own) - 0.5 * trailer.width)
    }

    /// The constants that the stages need, for one of the loads and sub-steps of `substep` (s). `steer_max` replaces
    /// the vehicle's own lock (rad). Chassis and class are the first: [`crate::world::World`] numbers them.
    ///
    /// # Panics
    ///
    /// If [`Vehicle::loads`] has no load of this name.
    pub fn rig(&self, load: &str, substep: f32, steer_max: Option<f64>) -> Rig {
        let load = &self.loads[load];
        let (model, grip, duration) = (&self.model, self.tractor.friction * GRAVITY, f64::from(substep));
        Rig {
            wheelbase: self.tractor.wheelbase as f32,
            fifth_wheel: self.tractor.fifth_wheel as f32,
            trailer_wheelbase: self.trailer.wheelbase as f32,
            slip: load.slip as f32,
            steer_max: steer_max.unwrap_or(self.tractor.steer_max) as f32,
            steer_rate: self.tractor.steer_rate as f32,
            acceleration_min: load.acceleration_min as f32,
            acceleration_max: load.acceleration_max as f32,
            lateral_acceleration_max: grip as f32,
            speed_gain: self.speed_control.gain as f32,
            speed_integral_gain: self.speed_control.integral_gain as f32,
            speed_integral_band: self.speed_control.integral_band as f32,
            speed_braking: self.speed_control.braking as f32,
            tractor_body: self.tractor_body(),
            trailer_body: self.trailer_body(),
            tractor_roll: self.tractor.suspension.roll(duration),
            trailer_roll: load.suspension.roll(duration),
            slip_lever_max: model.slip_lever as f32,
            yaw_lag: (model.yaw_lag * load.slip) as f32,
            drive_lag: Lag::of(model.drive_lag, duration),
            brake_lag: Lag::of(model.brake_lag, duration),
            power: model.specific_power(self.gross_mass(load)) as f32,
            friction_ellipse: model.ellipse(grip) as f32,
            crossfall: model.fall() as f32,
            steer_delay: (model.steer_delay / duration).round() as u32,
            trailer_mass: load.mass as f32,
            rollover_threshold: load.suspension.rollover_threshold() as f32,
            chassis: 0,
            class_index: 0,
            slip_growth: model.slip_growth as f32,
            understeer: (model.understeer / GRAVITY) as f32,
            fifth_wheel_load: self.fifth_wheel_part(load) as f32,
        }
    }

    /// The distance sensors in the order of an observation: the trailer's from front to rear, left and right
    /// alternating, then the tractor's from left to right.
    pub fn rays(&self) -> [Ray; N_RAYS] {
        let body = self.trailer_body();
        let Sensors { trailer_first, trailer_last, .. } = self.sensors;
        std::array::from_fn(|index| {
            if index < N_TRAILER_RAYS {
                let fraction = (index / 2) as f64 / (N_TRAILER_RAYS / 2 - 1) as f64;
                let behind_front = trailer_first + fraction * (trailer_last - trailer_first);
                let side = if index % 2 == 0 { 1.0 } else { -1.0 };
                Ray {
                    origin: Vec2::new(body.front - behind_front as f32, side * body.half_width),
                    direction: Vec2::new(0.0, side),
                }
            } else {
                let mount = index - N_TRAILER_RAYS;
                let angle = PI * (0.5 - mount as f64 / (N_TRACTOR_RAYS - 1) as f64);
                Ray {
                    origin: self.sensors.tractor_mounts[mount].as_vec2(),
                    direction: DVec2::from_angle(angle).as_vec2(),
                }
            }
        })
    }
}
