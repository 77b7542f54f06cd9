//! Turns an action into what drives the truck: a steer angle to reach and an acceleration that holds the target speed.
//!
//! Once a step, in simulation time.

use crate::cpu::Row;
use crate::layout::{Action, Control, Rig};
use crate::world::World;

/// What the row's action asks for.
pub fn steer(world: &World, row: &mut Row) {
    let params = &world.params;
    let step = params.n_substeps as f32 * params.substep;
    *row.control = controlled(&params.rig, step, &world.actions[*row.action as usize], row.truck.speed, row.control);
}

/// The control for the next `step` seconds of a truck at `speed` [m/s] that was controlled by `before`.
///
/// Proportional-integral control of the speed. The integral is that of a small error alone, and of an answer the truck can give: whatever
/// a long approach had piled up would have to be paid back by driving past the target for as long.
#[inline]
pub fn controlled(rig: &Rig, step: f32, action: &Action, speed: f32, before: &Control) -> Control {
    let error = action.speed - speed;
    let near = error.abs() <= rig.speed_integral_band;
    let held = if near { before.speed_error_integral } else { 0.0 };
    let grown = if near { held + error * step } else { 0.0 };
    let asked = rig.speed_gain * error + rig.speed_integral_gain * grown;
    let answerable = rig.speed_braking <= asked && asked <= rig.acceleration_max;
    let speed_error_integral = if answerable { grown } else { held };
    let acceleration = rig.speed_gain * error + rig.speed_integral_gain * speed_error_integral;
    Control { steering: action.steering, acceleration: acceleration.max(rig.speed_braking).min(rig.acceleration_max), speed_error_integral }
}
