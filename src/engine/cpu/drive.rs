//! Moves the truck: a single-track tractor pulling a trailer hitched near its drive axle.
//!
//! Tyre slip shifts each unit's no-slip point forward by `slip * speed²`; zero slip is pure kinematics. The midpoint
//! rule integrates it. Steer angle and speed change linearly within a sub-step: constant ones would cost decimetres in
//! a turn.

use glam::Vec2;

use crate::engine::Row;
use crate::layout::angle::{sin_cos, wrapped};
use crate::layout::shared::constants;
use crate::layout::{Control, Rig, Roll, Truck};
use crate::vehicle;
use crate::world::World;

constants! {
    /// Lowest speed that the engine's power is divided by (m/s).
    const POWER_SPEED_MIN: f32 = 1.0;
    /// Keeps a quotient finite at a standstill (m^2/s^2).
    const SPEED_SQUARED_MIN: f32 = 0.01;
    /// Least fraction of its wheelbase that a tractor with oversteer steers as if it had.
    const WHEELBASE_MIN: f32 = vehicle::WHEELBASE_MIN;
}

/// One step of the truck: its sub-steps, and the largest load transfer ratio of each unit among them.
pub fn drive(world: &World, row: &mut Row) {
    let params = &world.params;
    *row.truck = driven(world.rig(row.truck), params.substep, params.n_substeps, row.control, row.truck);
}

/// The truck after `n_substeps` sub-steps of `substep` seconds, for which the rig's roll is discretised.
#[inline]
pub fn driven(rig: &Rig, substep: f32, n_substeps: u32, control: &Control, truck: &Truck) -> Truck {
    let mut moving = Moving { truck: *truck, motion: motion_of(rig, truck) };
    let (mut tractor_ratio, mut trailer_ratio) = (0.0, 0.0);
    for n in 0..n_substeps {
        let control = Control { steering: delayed(rig.steer_delay, n, n_substeps, control), ..*control };
        moving = moved(rig, substep, &control, &moving);
        tractor_ratio = larger_in_magnitude(tractor_ratio, moving.truck.tractor_load_transfer_ratio);
        trailer_ratio = larger_in_magnitude(trailer_ratio, moving.truck.trailer_load_transfer_ratio);
    }
    Truck { tractor_load_transfer_ratio: tractor_ratio, trailer_load_transfer_ratio: trailer_ratio, ..moving.truck }
}

/// A truck and its motion there: the end of one sub-step is the start of the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moving {
    /// The truck.
    pub truck: Truck,
    /// The truck's motion.
    pub motion: Motion,
}

/// Motion of both units at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Curvature of the tractor's steer angle, without lag and limit of grip (1/m).
    pub steered_curvature: f32,
    /// Yaw rate of the tractor (rad/s).
    pub yaw_rate: f32,
    /// Yaw rate of the trailer (rad/s).
    pub trailer_yaw_rate: f32,
    /// Speed of the drive axle to the left (m/s).
    pub side_speed: f32,
    /// Lateral acceleration of the tractor, to the left (m/s^2).
    pub lateral_acceleration: f32,
    /// Lateral acceleration of the trailer's axle group, to the left (m/s^2).
    pub trailer_lateral_acceleration: f32,
}

/// The steer angle that was asked for `delay` sub-steps before sub-step `n` of the step, at most three steps ago (rad).
#[inline]
pub fn delayed(delay: u32, n: u32, n_substeps: u32, control: &Control) -> f32 {
    if delay <= n {
        control.steering
    } else if delay <= n + n_substeps {
        control.steering_before
    } else if delay <= n + 2 * n_substeps {
        control.steering_earlier
    } else {
        control.steering_earliest
    }
}

/// Motion of a truck.
#[inline]
pub fn motion_of(rig: &Rig, truck: &Truck) -> Motion {
    let curvature = steered_curvature(rig, truck.steering, truck.speed);
    let articulation = truck.heading - truck.trailer_heading;
    motion(rig, truck, truck.speed, curvature, truck.curvature_lag, truck.acceleration, articulation)
}

/// Curvature of the path that the tractor's wheels lead to at a steer angle (rad) and a speed (m/s), without lag (1/m).
#[inline]
pub fn steered_curvature(rig: &Rig, steering: f32, speed: f32) -> f32 {
    let (sin, cos) = sin_cos(steering);
    sin / (cos * steered_wheelbase(rig, speed))
}

/// Wheelbase as which the tractor steers at a speed (m/s) (m).
#[inline]
pub fn steered_wheelbase(rig: &Rig, speed: f32) -> f32 {
    // Oversteer ends in a spin, which is not modelled.
    (rig.wheelbase + rig.understeer * (speed * speed)).max(WHEELBASE_MIN * rig.wheelbase)
}

/// Strongest drive at a speed (m/s^2).
#[inline]
pub fn drive_max(rig: &Rig, speed: f32) -> f32 {
    rig.acceleration_max.min(rig.power / speed.max(POWER_SPEED_MIN))
}

/// Motion of a truck with this speed (m/s), curvature of the steer angle and deviation from it (1/m), acceleration
/// (m/s^2) and articulation (rad), where it leans as `leaning` does.
#[inline]
pub fn motion(
    rig: &Rig,
    leaning: &Truck,
    speed: f32,
    steered_curvature: f32,
    curvature_lag: f32,
    acceleration: f32,
    articulation: f32,
) -> Motion {
    // The tyres' grip bounds the curvature.
    let grip =
        rig.lateral_acceleration_max * (1.0 - rig.friction_ellipse * acceleration * acceleration).max(0.0).sqrt();
    let curvature = limited(steered_curvature + curvature_lag, grip / (speed * speed).max(SPEED_SQUARED_MIN));
    let yaw_rate = speed * curvature;
    let lateral_acceleration = speed * yaw_rate;
    let (slip, trailer_slip) = slips(rig, leaning, lateral_acceleration);
    let side_speed = -limited(slip * speed * speed.abs(), rig.slip_lever_max) * yaw_rate;
    let hitch_side_speed = side_speed + rig.fifth_wheel * yaw_rate;
    let (sin, cos) = sin_cos(articulation);
    let trailer_speed = speed * cos - hitch_side_speed * sin;
    let lever = rig.trailer_wheelbase - limited(trailer_slip * trailer_speed * trailer_speed.abs(), rig.slip_lever_max);
    let trailer_yaw_rate = (speed * sin + hitch_side_speed * cos) / lever;
    Motion {
        steered_curvature,
        yaw_rate,
        trailer_yaw_rate,
        side_speed,
        lateral_acceleration,
        trailer_lateral_acceleration: trailer_speed * trailer_yaw_rate,
    }
}

/// Slip of both units' tyres, which lose stiffness as load moves to the outer ones (rad/(m/s^2)), at a lateral
/// acceleration of the tractor (m/s^2).
#[inline]
fn slips(rig: &Rig, leaning: &Truck, lateral_acceleration: f32) -> (f32, f32) {
    // The same numbers as below, sooner.
    if rig.slip_growth == 0.0 {
        return (rig.slip, rig.slip);
    }
    let tractor = Vec2::new(leaning.tractor_roll, leaning.tractor_roll_rate);
    let trailer = Vec2::new(leaning.trailer_roll, leaning.trailer_roll_rate);
    let (ratio, trailer_ratio) =
        load_transfer_ratios(rig, tractor, trailer, lateral_acceleration, leaning.lateral_acceleration);
    let grown = |ratio: f32| rig.slip * (1.0 + rig.slip_growth * ratio.abs());
    (grown(ratio), grown(trailer_ratio))
}

/// Load transfer ratios of tractor and trailer with these (roll, roll rate) and lateral accelerations (m/s^2). The
/// trailer leans on the tractor by the fifth wheel.
#[inline]
fn load_transfer_ratios(
    rig: &Rig,
    tractor: Vec2,
    trailer: Vec2,
    lateral_acceleration: f32,
    trailer_lateral_acceleration: f32,
) -> (f32, f32) {
    let own = load_transfer_ratio(&rig.tractor_roll, tractor, lateral_acceleration + rig.crossfall);
    let trailers = load_transfer_ratio(&rig.trailer_roll, trailer, trailer_lateral_acceleration + rig.crossfall);
    (own + rig.fifth_wheel_load * (trailers - own), trailers)
}

/// The deviation of the path's curvature from the steer angle's, `duration` seconds after it was `lag`, where the steer
/// angle's changes by `rise` in that time (1/m).
///
/// The tractor's yaw follows its front wheels with the time constant `yaw_lag * speed`: tyres build up lateral force
/// only as slip angles grow. The exponential is its Padé approximant, which is stable at any speed.
#[inline]
pub fn lagging(rig: &Rig, speed: f32, lag: f32, rise: f32, duration: f32) -> f32 {
    let time = rig.yaw_lag * speed.abs();
    let left = time * time / (time * time + duration * time + 0.5 * duration * duration);
    let settled = -rise / duration * time;
    settled + (lag - settled) * left
}

/// The truck one sub-step later, with its load transfer ratios there.
#[inline]
pub fn moved(rig: &Rig, substep: f32, control: &Control, start: &Moving) -> Moving {
    let truck = &start.truck;
    let turn = limited(limited(control.steering, rig.steer_max) - truck.steering, rig.steer_rate * substep);
    let steering = truck.steering + turn;
    let asked = control.acceleration.max(rig.acceleration_min).min(drive_max(rig, truck.speed));
    let lag = if asked < 0.0 { &rig.brake_lag } else { &rig.drive_lag };
    let mut acceleration = asked + lag.left * (truck.acceleration - asked);
    let mut mean_acceleration = asked + lag.mean * (truck.acceleration - asked);
    let mut speed = truck.speed + mean_acceleration * substep;
    // Brakes that act late stop a truck. They do not drive it backwards.
    let may_stop = control.holds == 1 || 0.0 < truck.speed;
    if may_stop && truck.speed * speed <= 0.0 {
        (acceleration, mean_acceleration, speed) = (0.0, -truck.speed / substep, 0.0);
    }

    let half = 0.5 * substep;
    let articulation = truck.heading - truck.trailer_heading;
    let middle_speed = truck.speed + mean_acceleration * half;
    let middle_articulation = articulation + half * (start.motion.yaw_rate - start.motion.trailer_yaw_rate);
    let middle_curvature = steered_curvature(rig, truck.steering + 0.5 * turn, middle_speed);
    let rise = middle_curvature - start.motion.steered_curvature;
    let middle_lag = lagging(rig, middle_speed, truck.curvature_lag, rise, half);
    let middle = motion(rig, truck, middle_speed, middle_curvature, middle_lag, mean_acceleration, middle_articulation);
    let (sin, cos) = sin_cos(truck.heading + half * start.motion.yaw_rate);
    let velocity =
        Vec2::new(middle_speed * cos - middle.side_speed * sin, middle_speed * sin + middle.side_speed * cos);

    let heading = wrapped(truck.heading + substep * middle.yaw_rate);
    let trailer_heading = wrapped(truck.trailer_heading + substep * middle.trailer_yaw_rate);
    let curvature = steered_curvature(rig, steering, speed);
    let curvature_lag =
        lagging(rig, middle_speed, truck.curvature_lag, curvature - start.motion.steered_curvature, substep);
    let end = motion(rig, truck, speed, curvature, curvature_lag, acceleration, heading - trailer_heading);
    let tilted = |lateral_acceleration: f32| lateral_acceleration + rig.crossfall;
    let tractor = rolled(
        &rig.tractor_roll,
        Vec2::new(truck.tractor_roll, truck.tractor_roll_rate),
        tilted(middle.lateral_acceleration),
    );
    let trailer = rolled(
        &rig.trailer_roll,
        Vec2::new(truck.trailer_roll, truck.trailer_roll_rate),
        tilted(middle.trailer_lateral_acceleration),
    );
    let (tractor_ratio, trailer_ratio) =
        load_transfer_ratios(rig, tractor, trailer, end.lateral_acceleration, end.trailer_lateral_acceleration);
    Moving {
        truck: Truck {
            position: truck.position + substep * velocity,
            heading,
            trailer_heading,
            speed,
            steering,
            tractor_roll: tractor.x,
            tractor_roll_rate: tractor.y,
            trailer_roll: trailer.x,
            trailer_roll_rate: trailer.y,
            tractor_load_transfer_ratio: tractor_ratio,
            trailer_load_transfer_ratio: trailer_ratio,
            acceleration,
            curvature_lag,
            lateral_acceleration: end.trailer_lateral_acceleration,
            ..*truck
        },
        motion: end,
    }
}

/// The truck as it leans once it has turned for long with its steer angle and speed.
pub fn settled(rig: &Rig, truck: &Truck) -> Truck {
    let motion = motion_of(rig, truck);
    let tractor = Vec2::new(settled_roll(&rig.tractor_roll, motion.lateral_acceleration + rig.crossfall), 0.0);
    let trailer = Vec2::new(settled_roll(&rig.trailer_roll, motion.trailer_lateral_acceleration + rig.crossfall), 0.0);
    let (tractor_ratio, trailer_ratio) =
        load_transfer_ratios(rig, tractor, trailer, motion.lateral_acceleration, motion.trailer_lateral_acceleration);
    Truck {
        tractor_roll: tractor.x,
        trailer_roll: trailer.x,
        tractor_load_transfer_ratio: tractor_ratio,
        trailer_load_transfer_ratio: trailer_ratio,
        lateral_acceleration: motion.trailer_lateral_acceleration,
        ..*truck
    }
}

/// The roll that a unit comes to rest at under a constant lateral acceleration (rad): one at which its rate stays 0.
#[inline]
fn settled_roll(roll: &Roll, lateral_acceleration: f32) -> f32 {
    -roll.input[1] * lateral_acceleration / roll.transition[2]
}

/// A unit's (roll, roll rate) one sub-step later. The lateral acceleration of the sub-step's middle stands for its
/// mean.
#[inline]
fn rolled(roll: &Roll, state: Vec2, lateral_acceleration: f32) -> Vec2 {
    let [a, b, c, d] = roll.transition;
    let [angle, rate] = roll.input;
    Vec2::new(
        a * state.x + b * state.y + angle * lateral_acceleration,
        c * state.x + d * state.y + rate * lateral_acceleration,
    )
}

/// Fraction of a unit's weight that has moved to its right wheels, for its (roll, roll rate): at 1 the left ones lift.
#[inline]
pub fn load_transfer_ratio(roll: &Roll, state: Vec2, lateral_acceleration: f32) -> f32 {
    roll.per_acceleration * lateral_acceleration + roll.per_roll * state.x + roll.per_roll_rate * state.y
}

/// `value` kept within `limit` of 0.
#[inline]
fn limited(value: f32, limit: f32) -> f32 {
    if value < -limit {
        -limit
    } else if limit < value {
        limit
    } else {
        value
    }
}

/// Whichever is larger in magnitude.
#[inline]
fn larger_in_magnitude(a: f32, b: f32) -> f32 {
    if a.abs() < b.abs() { b } else { a }
}
