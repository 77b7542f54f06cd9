//! Draws an action by chance, each as likely as the next.
//!
//! Beside the stages of a step: a driver that needs nothing, for measuring speed and filling a memory.

use crate::cpu::Row;
use crate::random::{Draw, index_below, words};
use crate::world::World;

/// Draws the row's action.
pub fn draw(world: &World, row: &mut Row) {
    *row.action = drawn(row.seed, row.env, row.truck.episode, row.truck.steps, world.params.n_actions);
}

/// An action as a function of (seed, env, episode, step).
#[inline]
pub fn drawn(seed: u32, env: u32, episode: u32, steps: u32, n_actions: u32) -> u32 {
    index_below(words(seed, env, episode, (Draw::Action as u32).wrapping_add(steps))[0], n_actions)
}
