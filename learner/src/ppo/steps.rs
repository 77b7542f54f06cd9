//! Steps of a policy, and the advantages of its actions.

use burn::tensor::{Tensor, TensorData};
use offtrack::layout::Ended;

use crate::pass::matrix;

/// Some steps of all trucks by one policy, in the order in which they were made: row `step * n_envs + env`.
#[derive(Debug, Default)]
pub struct Steps {
    /// Trucks.
    pub n_envs: usize,
    /// Values that the networks observe.
    pub n_values: usize,
    /// Normalised observations that the actions were chosen for, `[rows * values]`.
    pub observation: Vec<f32>,
    /// Indices of the actions, `(rows)`.
    pub action: Vec<u32>,
    /// Logarithms of their probabilities, `(rows)`.
    pub log_prob: Vec<f32>,
    /// Scaled rewards, `(rows)`.
    pub reward: Vec<f32>,
    /// Whether and why the episode ended, `(rows)`.
    pub ended: Vec<Ended>,
    /// Whether nothing comes after the end of an episode's time.
    pub late_fails: bool,
    /// Normalised observations after the steps whose value no later row has: those that ran out of time, and the last
    /// of each truck, in the order of their rows.
    pub next_observation: Vec<f32>,
}

impl Steps {
    /// Whether the value after a row is that of `next_observation`.
    pub fn needs_next(&self, row: usize, n_rows: usize) -> bool {
        let ended = self.ended[row];
        let is_last = ended.terminated() || self.late_fails && ended.truncated();
        !is_last && (ended.truncated() || n_rows <= row + self.n_envs)
    }

    /// The observations of some rows, `[rows, values]`.
    pub fn rows(&self, rows: &[usize]) -> Tensor<2> {
        let mut values = Vec::with_capacity(rows.len() * self.n_values);
        rows.iter().for_each(|row| values.extend_from_slice(&self.observation[row * self.n_values..][..self.n_values]));
        matrix(TensorData::new(values, [rows.len(), self.n_values]))
    }

    /// Generalised advantage estimates of the actions, and the returns that their values are learned from, `(rows)`
    /// each (J. Schulman and others, 2016). `values` are those of the observations, `next_values` of
    /// `next_observation`.
    pub fn advantages(&self, values: &[f32], next_values: &[f32], gamma: f32, lambda: f32) -> (Vec<f32>, Vec<f32>) {
        let n_rows = self.action.len();
        let mut advantage = vec![0.0; n_rows];
        let mut next_values = next_values.iter().rev();
        for row in (0..n_rows).rev() {
            let goes_on = row + self.n_envs < n_rows && self.ended[row] == Ended::Running;
            let next = match () {
                () if goes_on => values[row + self.n_envs],
                () if self.needs_next(row, n_rows) => next_values.next().copied().unwrap_or_default(),
                () => 0.0,
            };
            let later = if goes_on { advantage[row + self.n_envs] } else { 0.0 };
            advantage[row] = self.reward[row] + gamma * next - values[row] + gamma * lambda * later;
        }
        let returned = advantage.iter().zip(values).map(|(advantage, value)| advantage + value).collect();
        (advantage, returned)
    }
}
