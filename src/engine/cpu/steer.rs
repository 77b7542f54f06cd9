//! Turns an action into a steer angle to reach and an acceleration that holds the target speed, once a step.
//!
//! The speed control is a PI controller with anti-windup.

use crate::engine::Row;
use crate::engine::cpu::drive::drive_max;
use crate::layout::{Action, Control, Rig};
use crate::world::World;

/// Writes the row's control.
pub fn steer(world: &World, row: &mut Row) {
    let params = &world.params;
    let step = params.n_substeps as f32 * params.substep;
    *row.control = controlled(world.rig(row.truck), step, &world.actions[*row.action as usize], row.truck.speed, row.control);
}

/// The control for the next `step` seconds of a truck at `speed` [m/s] that was controlled by `before`.
///
/// PI controller with anti-windup: the integral is reset to 0 while the error is large, and kept while the acceleration
/// asked for is out of reach. Otherwise a long approach to the target speed would overshoot it.
#[inline]
pub fn controlled(rig: &Rig, step: f32, action: &Action, speed: f32, before: &Control) -> Control {
    let error = action.speed - speed;
    let near = error.abs() <= rig.speed_integral_band;
    let held = if near { before.speed_error_integral } else { 0.0 };
    let integrated = if near { held + error * step } else { 0.0 };
    let asked = rig.speed_gain * error + rig.speed_integral_gain * integrated;
    let most = drive_max(rig, speed);
    let reachable = rig.speed_braking <= asked && asked <= most;
    let speed_error_integral = if reachable { integrated } else { held };
    let acceleration = rig.speed_gain * error + rig.speed_integral_gain * speed_error_integral;
    Control {
        steering: action.steering,
        acceleration: acceleration.max(rig.speed_braking).min(most),
        speed_error_integral,
        steering_before: before.steering,
        steering_earlier: before.steering_before,
    }
}
