//! The actions of an evaluation's episodes, with which each can be driven again.

use std::path::Path;

use offtrack::layout::Command;
use offtrack::simulator::Actions;
use offtrack::world::World;

use crate::actions;
use crate::episode::Episode;
use crate::error::Error;
use crate::seen::Seen;

/// The actions of each episode, `[episodes][steps]`.
#[derive(Debug)]
pub enum Sequences {
    /// Indices into the action table.
    Indices(Vec<Vec<u32>>),
    /// Commands, where actions are continuous.
    Commands(Vec<Vec<Command>>),
}

impl Sequences {
    /// Writes them to `file`, to be [driven again](crate::actions) in `world`.
    ///
    /// # Errors
    ///
    /// A world whose actions are continuous; a disk that is full, or a folder that may not be written.
    pub fn write(&self, file: &Path, world: &World) -> Result<(), Error> {
        match self {
            Sequences::Indices(sequences) => actions::write(file, world, sequences),
            Sequences::Commands(_) => actions::check_levels(world),
        }
    }

    /// So many episodes without an action.
    pub(crate) fn new(world: &World, n_episodes: usize) -> Sequences {
        if world.is_continuous() {
            Sequences::Commands(vec![Vec::new(); n_episodes])
        } else {
            Sequences::Indices(vec![Vec::new(); n_episodes])
        }
    }

    /// Adds the last action of the episodes that have not finished.
    pub(crate) fn add(&mut self, seen: &Seen, finished: &[Option<Episode>]) {
        match self {
            Sequences::Indices(sequences) => add(sequences, &seen.action, finished),
            Sequences::Commands(sequences) => add(sequences, &seen.command, finished),
        }
    }

    /// The action at `step` of each of these episodes; of one that has ended, any.
    pub(crate) fn at(&self, step: usize, indices: &[usize]) -> Actions {
        match self {
            Sequences::Indices(sequences) => Actions::Indices(at(sequences, step, indices)),
            Sequences::Commands(sequences) => Actions::Commands(at(sequences, step, indices)),
        }
    }
}

fn add<T: Copy>(sequences: &mut [Vec<T>], actions: &[T], finished: &[Option<Episode>]) {
    for ((sequence, &action), finished) in sequences.iter_mut().zip(actions).zip(finished) {
        if finished.is_none() {
            sequence.push(action);
        }
    }
}

fn at<T: Copy + Default>(sequences: &[Vec<T>], step: usize, indices: &[usize]) -> Vec<T> {
    indices.iter().map(|&index| sequences[index].get(step).copied().unwrap_or_default()).collect()
}

#[cfg(test)]
mod tests;
