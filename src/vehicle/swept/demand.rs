//! What a path asks of the truck: steer angle, steer rate, tyres and load, beside what the truck has.

use super::{Pose, Towing};
use crate::geometry::Curve;
use crate::layout::{Rig, Roll};
use crate::vehicle::{GRAVITY, WHEELBASE_MIN};

/// What the truck does at a pose. All are left positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Demand {
    /// Station of the front axle on the line (m).
    pub station: f64,
    /// Steer angle of the front wheels (rad).
    pub steering: f64,
    /// Mean change of the steer angle since the pose before (rad/s).
    pub steer_rate: f64,
    /// Lateral acceleration of the tractor's drive axle (m/s^2).
    pub lateral_acceleration: f64,
    /// Load transfer ratio of the unit with the greater one, the unit's roll included.
    pub load_transfer_ratio: f64,
}

/// A limit of the truck.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// Limit of the steer angle.
    Lock,
    /// Limit of the steer angle's change.
    SteerRate,
    /// Limit of the lateral acceleration: the tyres' grip.
    Tyres,
    /// Limit of the load transfer ratio: the inner wheels lift.
    Rollover,
}

impl Limit {
    /// All limits.
    pub const ALL: [Limit; 4] = [Limit::Lock, Limit::SteerRate, Limit::Tyres, Limit::Rollover];

    /// The limit's name in JSON: `lock`, `steer_rate`, `tyres`, `rollover`.
    pub fn name(self) -> &'static str {
        match self {
            Limit::Lock => "lock",
            Limit::SteerRate => "steer_rate",
            Limit::Tyres => "tyres",
            Limit::Rollover => "rollover",
        }
    }

    /// The quantity that is limited, in words.
    pub fn quantity(self) -> &'static str {
        match self {
            Limit::Lock => "steer angle",
            Limit::SteerRate => "steer rate",
            Limit::Tyres => "lateral acceleration",
            Limit::Rollover => "load transfer ratio",
        }
    }

    /// The unit that [`Limit::of`] and [`Limit::demanded`] are shown in; empty for a ratio.
    pub fn unit(self) -> &'static str {
        match self {
            Limit::Lock => "deg",
            Limit::SteerRate => "deg/s",
            Limit::Tyres => "g",
            Limit::Rollover => "",
        }
    }

    /// What the truck has, in the limit's unit.
    pub fn of(self, rig: &Rig) -> f64 {
        match self {
            Limit::Lock => f64::from(rig.steer_max).to_degrees(),
            Limit::SteerRate => f64::from(rig.steer_rate).to_degrees(),
            Limit::Tyres => f64::from(rig.lateral_acceleration_max) / GRAVITY,
            Limit::Rollover => 1.0,
        }
    }

    /// What a pose asks for, in the limit's unit; its magnitude alone.
    pub fn demanded(self, demand: &Demand) -> f64 {
        match self {
            Limit::Lock => demand.steering.abs().to_degrees(),
            Limit::SteerRate => demand.steer_rate.abs().to_degrees(),
            Limit::Tyres => demand.lateral_acceleration.abs() / GRAVITY,
            Limit::Rollover => demand.load_transfer_ratio.abs(),
        }
    }
}

/// What each pose of a path of [`super::swept_path`] asks of the truck; `centre_line`, `speed` and `spacing` are those
/// of the path. The roll of `rig` must be discretised for the time between two poses, `spacing / speed`.
///
/// A lane's centre line of arcs and straights jumps in its curvature, and so does the steer rate that follows it.
pub fn demands(rig: &Rig, centre_line: &Curve, path: &[Pose], speed: f64, spacing: f64) -> Vec<Demand> {
    let towing = Towing::of(rig, speed);
    let fall = f64::from(rig.crossfall);
    let (mut tractor, mut trailer) = (Rolling::on(&rig.tractor_roll, fall), Rolling::on(&rig.trailer_roll, fall));
    let mut before: Option<f64> = None;
    let demand = |(index, pose): (usize, &Pose)| {
        let station = index as f64 * spacing;
        let direction = centre_line.heading_at(station) - pose.heading;
        let turning = towing.turning(direction, pose.heading - pose.trailer_heading);
        let steering = steer_angle(&towing, direction);
        let steer_rate = (steering - before.unwrap_or(steering)) * speed / spacing;
        before = Some(steering);
        let lateral_acceleration = turning.along * turning.yaw;
        let own = tractor.next(&rig.tractor_roll, lateral_acceleration + fall);
        let trailers = trailer.next(&rig.trailer_roll, turning.trailer_along * turning.trailer_yaw + fall);
        // The trailer leans on the tractor by the fifth wheel.
        let tractors = own + f64::from(rig.fifth_wheel_load) * (trailers - own);
        let load_transfer_ratio = if tractors.abs() < trailers.abs() { trailers } else { tractors };
        Demand { station, steering, steer_rate, lateral_acceleration, load_transfer_ratio }
    };
    path.iter().enumerate().map(demand).collect()
}

/// Largest steer angle, in magnitude, of a path of [`super::swept_path`]; the other arguments are those of [`demands`]
/// (rad).
pub fn steer_angle_max(rig: &Rig, centre_line: &Curve, path: &[Pose], speed: f64, spacing: f64) -> f64 {
    let towing = Towing::of(rig, speed);
    let angle = |(index, pose): (usize, &Pose)| {
        steer_angle(&towing, centre_line.heading_at(index as f64 * spacing) - pose.heading)
    };
    path.iter().enumerate().map(angle).map(f64::abs).fold(0.0, f64::max)
}

/// Steer angle with which the front axle moves in this direction relative to the tractor: as the tyres slip, and where
/// the tractor understeers, the wheels are turned further. Beyond 90 deg the truck could only be pushed aside (rad).
fn steer_angle(towing: &Towing, direction: f64) -> f64 {
    let (sin, cos) = direction.sin_cos();
    let along = towing.speed * cos;
    let steered = towing.wheelbase + towing.understeer * along * along;
    let steered = steered.max(f64::from(WHEELBASE_MIN) * towing.wheelbase);
    (steered * sin).atan2(towing.tractor_lever(along) * cos)
}

/// Roll of a unit along the path.
#[derive(Debug, Clone, Copy)]
struct Rolling {
    angle: f64,
    rate: f64,
    lateral_acceleration: f64,
}

impl Rolling {
    /// At rest, on a road that tilts by so much (m/s^2).
    fn on(roll: &Roll, fall: f64) -> Rolling {
        let angle = -f64::from(roll.input[1]) * fall / f64::from(roll.transition[2]);
        Rolling { angle, rate: 0.0, lateral_acceleration: fall }
    }

    /// The load transfer ratio one interval later, with this lateral acceleration there (m/s^2).
    fn next(&mut self, roll: &Roll, lateral_acceleration: f64) -> f64 {
        let mean = 0.5 * (self.lateral_acceleration + lateral_acceleration);
        let [a, b, c, d] = roll.transition.map(f64::from);
        let [input, rate_input] = roll.input.map(f64::from);
        *self = Rolling {
            angle: a * self.angle + b * self.rate + input * mean,
            rate: c * self.angle + d * self.rate + rate_input * mean,
            lateral_acceleration,
        };
        let (per_roll, per_roll_rate) = (f64::from(roll.per_roll), f64::from(roll.per_roll_rate));
        f64::from(roll.per_acceleration) * lateral_acceleration + per_roll * self.angle + per_roll_rate * self.rate
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use glam::DVec2;

    use super::super::swept_path;
    use super::*;
    use crate::geometry::Piece;
    use crate::vehicle::Vehicle;

    const SPACING: f64 = 0.25;

    /// 30 m straight, then one and a half circles to the left or the right.
    fn line(radius: f64, side: f64) -> Curve {
        let arc =
            |from: f64| Piece::Arc { centre: DVec2::new(0.0, side * radius), radius, from, sweep: 1.5 * side * PI };
        let approach = Piece::Segment { from: DVec2::new(-30.0, 0.0), to: DVec2::ZERO };
        Curve { pieces: vec![approach, arc(-side * FRAC_PI_2), arc(side * PI)] }
    }

    fn driven(vehicle: &Vehicle, load: &str, radius: f64, side: f64, speed: f64) -> (Rig, Vec<Demand>) {
        let rig = vehicle.rig(load, (SPACING / speed) as f32, None);
        let line = line(radius, side);
        let path = swept_path(&rig, &line, speed, SPACING);
        let demands = demands(&rig, &line, &path, speed, SPACING);
        assert_eq!(demands.len(), path.len());
        (rig, demands)
    }

    #[test]
    fn a_circle_asks_for_the_steer_angle_and_the_lateral_acceleration_of_its_radius() {
        let vehicle = Vehicle::named("us_wb62").unwrap();
        for side in [1.0, -1.0] {
            // At a crawl: asin(5.94 / 10.2), the tractor's middle on a circle of sqrt(10.2² - 5.94²).
            let (_, demands) = driven(&vehicle, "empty", 10.2, side, 0.1);
            let last = demands.last().unwrap();
            assert!((last.steering.to_degrees() - side * 35.617).abs() < 0.05, "{last:?}");
            // With slip, the drive axle is on the circle of its steer angle: L / tan(angle).
            let (rig, demands) = driven(&vehicle, "empty", 25.0, side, 8.0);
            let last = demands.last().unwrap();
            let radius = f64::from(rig.wheelbase) / last.steering.tan();
            let along = (last.lateral_acceleration * radius).sqrt();
            let slip: f64 = 0.0136 * 64.0;
            assert!((radius.powi(2) + (5.94 - slip).powi(2) - 625.0).abs() < 1.0, "{radius}");
            assert!((along.hypot(along * (5.94 - slip) / radius) - 8.0).abs() < 0.02, "{along}");
        }
    }

    #[test]
    fn a_tractor_that_understeers_needs_the_steer_angle_of_the_simulators_equation() {
        let mut vehicle = Vehicle::named("daf_xf").unwrap();
        let angle = |vehicle: &Vehicle| driven(vehicle, "empty", 30.0, 1.0, 8.0).1.last().unwrap().steering;
        let neutral = angle(&vehicle);
        vehicle.model.understeer = 0.1;
        let (rig, demands) = driven(&vehicle, "empty", 30.0, 1.0, 8.0);
        let last = demands.last().unwrap();
        let curvature = neutral.tan() / f64::from(rig.wheelbase);
        let along = (last.lateral_acceleration / curvature).sqrt();
        let steered = f64::from(rig.wheelbase) + f64::from(rig.understeer) * along * along;
        assert!(f64::from(rig.wheelbase) + 0.5 < steered, "{steered}");
        assert!((last.steering.tan() - curvature * steered).abs() < 1e-4, "{last:?}");
    }

    #[test]
    fn a_bend_after_a_straight_asks_for_a_steer_rate_that_no_truck_has_at_speed() {
        let vehicle = Vehicle::named("daf_xf").unwrap();
        let rate = |speed: f64| {
            driven(&vehicle, "empty", 10.2, 1.0, speed).1.iter().map(|d| d.steer_rate).fold(0.0, f64::max).to_degrees()
        };
        // The front axle's direction turns by speed / radius at once; slip adds to it.
        assert!((rate(1.0) - 5.6).abs() < 0.2 && 46.0 < rate(8.33), "{} {}", rate(1.0), rate(8.33));
    }

    #[test]
    fn the_load_transfer_ratio_settles_at_that_of_the_steady_turn() {
        let vehicle = Vehicle::named("eu_4x2_13m6").unwrap();
        let (rig, demands) = driven(&vehicle, "laden", 19.3, 1.0, 30.0 / 3.6);
        // The reference's steady ratio at 30 km/h on the inner lane of 32m: 0.83.
        let settled = demands.last().unwrap().load_transfer_ratio;
        assert!((settled - 0.83).abs() < 0.02, "{settled}");
        assert_eq!(Limit::ALL.map(|limit| (limit.of(&rig) * 10.0).round() / 10.0), [40.0, 20.0, 0.7, 1.0]);
    }

    #[test]
    fn a_line_tighter_than_the_wheelbase_asks_for_more_than_a_right_angle() {
        let vehicle = Vehicle::named("daf_xf").unwrap();
        let rig = vehicle.rig("empty", 0.05, None);
        let line = line(3.0, 1.0);
        let path = swept_path(&rig, &line, 1.0, SPACING);
        assert!(80.0f64.to_radians() < steer_angle_max(&rig, &line, &path, 1.0, SPACING));
    }
}
