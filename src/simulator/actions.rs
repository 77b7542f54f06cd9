//! What the trucks of a batch are asked for in a step, whatever the kind of the world's actions.

use super::{Error, Simulator};
use crate::layout::Command;

/// An action for each truck, `[n_envs]`.
#[derive(Debug, Clone, PartialEq)]
pub enum Actions {
    /// Indices into the action table.
    Indices(Vec<u32>),
    /// Commands, where actions are continuous.
    Commands(Vec<Command>),
}

impl Actions {
    /// The actions of trucks `envs` as those of a batch of `n_envs`: the others have index 0, or a command of zeros.
    pub fn spread(self, envs: &[usize], n_envs: usize) -> Actions {
        match self {
            Actions::Indices(indices) => Actions::Indices(spread(&indices, envs, n_envs)),
            Actions::Commands(commands) => Actions::Commands(spread(&commands, envs, n_envs)),
        }
    }
}

fn spread<T: Copy + Default>(rows: &[T], envs: &[usize], n_envs: usize) -> Vec<T> {
    let mut all = vec![T::default(); n_envs];
    for (&env, &row) in envs.iter().zip(rows) {
        all[env] = row;
    }
    all
}

impl Simulator {
    /// One step of every truck, by indices or by commands. Wrong ones leave the batch as it was.
    ///
    /// Fails as [`Simulator::step`] and [`Simulator::step_with`] do.
    pub fn step_any(&mut self, actions: &Actions) -> Result<(), Error> {
        match actions {
            Actions::Indices(indices) => self.step(indices),
            Actions::Commands(commands) => self.step_with(commands),
        }
    }
}
