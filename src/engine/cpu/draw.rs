//! Draws an action uniformly at random.
//!
//! Not a stage of a step, but a policy that needs no learner: for measuring speed and filling a replay buffer.

use crate::engine::Row;
use crate::layout::random::{Draw, index_below, signed_unit, words};
use crate::layout::{Command, Stream};
use crate::world::World;

/// Draws the row's action, or its command where actions are continuous.
pub fn draw(world: &World, row: &mut Row) {
    if world.is_continuous() {
        *row.command = drawn_command(row.stream, row.truck.episode, row.truck.steps);
    } else {
        *row.action = drawn(row.stream, row.truck.episode, row.truck.steps, world.params.n_actions);
    }
}

/// An action as a function of (seed, env, episode, step).
#[inline]
pub fn drawn(stream: Stream, episode: u32, steps: u32, n_actions: u32) -> u32 {
    index_below(words(stream.seed, stream.env, episode, (Draw::Action as u32).wrapping_add(steps))[0], n_actions)
}

/// A command as a function of the same.
#[inline]
pub fn drawn_command(stream: Stream, episode: u32, steps: u32) -> Command {
    let words = words(stream.seed, stream.env, episode, (Draw::Action as u32).wrapping_add(steps));
    Command { steering: signed_unit(words[0]), speed: signed_unit(words[1]) }
}
