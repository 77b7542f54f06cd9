//! Turns an action into a steer angle to reach and an acceleration that holds the target speed, once a step.
//!
//! The speed control is a PI controller with anti-windup.

use crate::engine::Row;
use crate::engine::cpu::drive::drive_max;
use crate::engine::cpu::perceive::action_delay;
use crate::layout::shared::constants;
use crate::layout::{Action, Command, Control, Params, Rig, Stream};
use crate::world::World;

constants! {
    /// Braking at which a truck comes to stand (m/s^2).
    const HOLD_BRAKING: f32 = 0.5;
    /// Parts of a command's half range in a word.
    const HALF_RANGE: f32 = 32_767.0;
    /// One of them.
    const RANGE_PART: f32 = 1.0 / 32_767.0;
    /// A command of 0 in a word.
    const MIDDLE: f32 = 32_768.0;
}

/// Writes the row's control.
pub fn steer(world: &World, row: &mut Row) {
    let params = &world.params;
    let before = *row.control;
    let next = if world.disturbances.of_action == 0 {
        asked(world, *row.action, row.command)
    } else {
        late_action(world, row.stream, row.truck.episode, asked_word(world, *row.action, row.command), &before)
    };
    let next = targeted(params, &next, &before);
    *row.control = controlled(world.rig(row.truck), world.step(), &next, row.truck.speed, &before);
    if world.disturbances.of_action == 1 {
        row.control.action_before = asked_word(world, *row.action, row.command);
        row.control.action_earlier = before.action_before;
        row.control.action_earliest = before.action_earlier;
    }
}

/// What is asked of a truck.
#[inline]
fn asked(world: &World, action: u32, command: &Command) -> Action {
    if world.is_continuous() {
        commanded(&world.actions[0], &world.actions[1], command)
    } else {
        world.actions[action as usize]
    }
}

/// What a command asks for, between what -1 and 1 do.
#[inline]
pub fn commanded(lowest: &Action, highest: &Action, command: &Command) -> Action {
    let speed = lowest.speed + 0.5 * (command.speed + 1.0) * (highest.speed - lowest.speed);
    Action { steering: command.steering * highest.steering, speed: speed.min(highest.speed) }
}

/// What is asked of a truck, in a word that is not 0.
fn asked_word(world: &World, action: u32, command: &Command) -> u32 {
    if world.is_continuous() { command_word(command) } else { action + 1 }
}

/// A command in a word: 16 bits each, rounded to a part in 32767. None of them is 0.
fn command_word(command: &Command) -> u32 {
    let [steering, speed] =
        [command.steering, command.speed].map(|value| ((value * HALF_RANGE).round_ties_even() + MIDDLE) as u32);
    steering | (speed << 16)
}

/// The command in a word.
fn command_of(word: u32) -> Command {
    let [steering, speed] = [word & 0xffff, word >> 16].map(|half| (half as f32 - MIDDLE) * RANGE_PART);
    Command { steering, speed }
}

/// What takes effect in this step of what is asked, in a word, where actions come late: before the first one arrives
/// the truck is to go straight on at the speed that it began with.
fn late_action(world: &World, stream: Stream, episode: u32, asked: u32, before: &Control) -> Action {
    let listed = [asked, before.action_before, before.action_earlier, before.action_earliest];
    match listed[action_delay(&world.disturbances, stream, episode) as usize] {
        0 => {
            let speed = if world.params.changes_speed == 1 { 0.0 } else { before.target_speed };
            Action { steering: 0.0, speed }
        }
        late if world.is_continuous() => commanded(&world.actions[0], &world.actions[1], &command_of(late)),
        late => world.actions[late as usize - 1],
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
