//! Turns an action into a steer angle to reach and an acceleration that holds the target speed, once a step.
//!
//! The speed control is a PI controller with anti-windup.

use crate::engine::Row;
use crate::engine::cpu::drive::drive_max;
use crate::engine::cpu::perceive::action_delay;
use crate::layout::shared::constants;
use crate::layout::{Action, Control, Params, Rig, Stream};
use crate::world::World;

constants! {
    /// Braking at which a truck comes to stand (m/s^2).
    const HOLD_BRAKING: f32 = 0.5;
}

/// Writes the row's control.
pub fn steer(world: &World, row: &mut Row) {
    let params = &world.params;
    let before = *row.control;
    let asked = if world.disturbances.of_action == 0 {
        world.actions[*row.action as usize]
    } else {
        late_action(world, row.stream, row.truck.episode, *row.action, &before)
    };
    let action = targeted(params, &asked, &before);
    *row.control = controlled(world.rig(row.truck), world.step(), &action, row.truck.speed, &before);
    if world.disturbances.of_action == 1 {
        row.control.action_before = *row.action + 1;
        row.control.action_earlier = before.action_before;
        row.control.action_earliest = before.action_earlier;
    }
}

/// The action that takes effect in this step, where actions come late: before the first one arrives the truck is to go
/// straight on at the speed that it began with.
fn late_action(world: &World, stream: Stream, episode: u32, action: u32, before: &Control) -> Action {
    let actions = [action + 1, before.action_before, before.action_earlier, before.action_earliest];
    match actions[action_delay(&world.disturbances, stream, episode) as usize] {
        0 => {
            let speed = if world.params.changes_speed == 1 { 0.0 } else { before.target_speed };
            Action { steering: 0.0, speed }
        }
        index => world.actions[index as usize - 1],
    }
}

/// The action with the target speed that it leads to, from that of the control before.
#[inline]
pub fn targeted(params: &Params, action: &Action, before: &Control) -> Action {
    let changed = (before.target_speed + action.speed).max(params.target_speed_min).min(params.target_speed_max);
    Action { speed: if params.changes_speed == 1 { changed } else { action.speed }, ..*action }
}

/// The control for the next `step` seconds of a truck at `speed` (m/s) that was controlled by `before`.
///
/// PI controller with anti-windup: the integral is reset to 0 while the error is large, and kept while the acceleration
/// asked for is out of reach. Otherwise a long approach to the target speed would overshoot it. A target of 0 is
/// reached with constant braking at last: the controller alone would never stand.
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
    let holds = action.speed == 0.0;
    let acceleration = if holds { acceleration.min(-HOLD_BRAKING) } else { acceleration };
    Control {
        steering: action.steering,
        acceleration: acceleration.max(rig.speed_braking).min(most),
        speed_error_integral: if holds { 0.0 } else { speed_error_integral },
        steering_before: before.steering,
        steering_earlier: before.steering_before,
        target_speed: action.speed,
        holds: u32::from(holds),
        steering_earliest: before.steering_earlier,
        action_before: before.action_before,
        action_earlier: before.action_earlier,
        action_earliest: before.action_earliest,
    }
}
