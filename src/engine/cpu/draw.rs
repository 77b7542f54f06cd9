//! Draws an action uniformly at random.
//!
//! Not a stage of a step, but a policy that needs no learner: for measuring speed and filling a replay buffer.

use crate::engine::Row;
use crate::layout::Stream;
use crate::layout::random::{Draw, index_below, words};
use crate::world::World;

/// Draws the row's action.
pub fn draw(world: &World, row: &mut Row) {
    *row.action = drawn(row.stream, row.truck.episode, row.truck.steps, world.params.n_actions);
}

/// An action as a function of (seed, env, episode, step).
#[inline]
pub fn drawn(stream: Stream, episode: u32, steps: u32, n_actions: u32) -> u32 {
    index_below(words(stream.seed, stream.env, episode, (Draw::Action as u32).wrapping_add(steps))[0], n_actions)
}
