//! The replay buffer on the host: the latest transitions of every truck, in a ring.
//!
//! Rows are in the order of time, `n_envs` to a slot, so the next observation of a row is in the next slot. Only where
//! an episode was truncated it is not: those few observations are kept beside the ring.

mod priorities;
mod state;

use std::collections::{HashMap, TryReserveError};

use offtrack::layout::Ended;
use rand::Rng;

use crate::config;
#[cfg(feature = "gpu")]
pub(crate) use priorities::LEAST_ERROR;
use priorities::Priorities;

/// One step of every truck, as the simulator's columns have it. All are `[n_envs]`.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a, const N: usize> {
    /// Observation that the action was chosen for.
    pub observation: &'a [[f32; N]],
    /// Index into the action table.
    pub action: &'a [u32],
    /// Reward of the step.
    pub reward: &'a [f32],
    /// Code of [`Ended`].
    pub ended: &'a [u32],
    /// Observation after the step.
    pub next_observation: &'a [[f32; N]],
}

/// Sampled transitions over up to `n_steps` steps each. All are `[batch]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample<const N: usize> {
    /// Observation that the first action was chosen for.
    pub observation: Vec<[f32; N]>,
    /// The first action.
    pub action: Vec<u32>,
    /// Discounted sum of the rewards of those steps.
    pub reward: Vec<f32>,
    /// Discount of the value of `next_observation`: gamma ^ steps, and 0 where the episode terminated.
    pub discount: Vec<f32>,
    /// Observation after the last step.
    pub next_observation: Vec<[f32; N]>,
    /// Importance-sampling weight in the critics' loss: 1 without priorities.
    pub weight: Vec<f32>,
    /// Rows of the transitions, for [`ReplayBuffer::set_td_errors`].
    pub row: Vec<usize>,
}

/// Where the next observation of a row is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum After {
    /// In the next slot.
    Next,
    /// Nowhere: the episode terminated.
    Terminated,
    /// In `truncated`: the time limit ended the episode.
    Truncated,
}

/// A ring of the latest steps of every truck.
#[derive(Debug)]
pub struct ReplayBuffer<const N: usize> {
    n_envs: usize,
    n_slots: usize,
    /// Slots written since the beginning; slot `count % n_slots` is the next to be written.
    count: usize,
    observation: Vec<[f32; N]>,
    action: Vec<u32>,
    reward: Vec<f32>,
    after: Vec<After>,
    truncated: HashMap<usize, [f32; N]>,
    /// Steps that must follow a transition before it can be sampled.
    n_steps: usize,
    priorities: Option<Priorities>,
}

impl<const N: usize> ReplayBuffer<N> {
    /// A buffer for at least `settings.capacity` transitions of `n_envs` trucks, sampled over `n_steps` steps each.
    /// Memory is allocated as it is filled.
    pub fn new(n_envs: usize, n_steps: usize, settings: &config::ReplayBuffer) -> ReplayBuffer<N> {
        let n_slots = settings.slots(n_envs);
        ReplayBuffer {
            n_envs,
            n_slots,
            n_steps,
            priorities: settings.priority.map(|priority| Priorities::new(priority, n_slots * n_envs)),
            count: 0,
            observation: Vec::new(),
            action: Vec::new(),
            reward: Vec::new(),
            after: Vec::new(),
            truncated: HashMap::new(),
        }
    }

    /// Takes memory for `n_rows` transitions in all: while they come it is neither moved nor refused.
    pub fn reserve(&mut self, n_rows: usize) -> Result<(), TryReserveError> {
        let more = n_rows.saturating_sub(self.observation.len());
        self.observation.try_reserve_exact(more)?;
        self.action.try_reserve_exact(more)?;
        self.reward.try_reserve_exact(more)?;
        self.after.try_reserve_exact(more)
    }

    /// Transitions held.
    pub fn n_transitions(&self) -> usize {
        self.observation.len()
    }

    /// The observations held, in no particular order.
    pub fn observations(&self) -> &[[f32; N]] {
        &self.observation
    }

    /// Appends one step of every truck; it replaces the oldest one once the ring is full.
    pub fn append(&mut self, rows: Rows<N>) {
        let first = self.count % self.n_slots * self.n_envs;
        if self.observation.len() == first {
            self.observation.extend_from_slice(rows.observation);
            self.action.extend_from_slice(rows.action);
            self.reward.extend_from_slice(rows.reward);
            self.after.resize(first + self.n_envs, After::Next);
        } else {
            let slot = first..first + self.n_envs;
            self.observation[slot.clone()].copy_from_slice(rows.observation);
            self.action[slot.clone()].copy_from_slice(rows.action);
            self.reward[slot].copy_from_slice(rows.reward);
        }
        for (env, &code) in rows.ended.iter().enumerate() {
            let row = first + env;
            let ended = Ended::of_column(code);
            if self.after[row] == After::Truncated {
                self.truncated.remove(&row);
            }
            self.after[row] = if ended.terminated() {
                After::Terminated
            } else if ended.truncated() {
                self.truncated.insert(row, rows.next_observation[env]);
                After::Truncated
            } else {
                After::Next
            };
        }
        if let Some(priorities) = &mut self.priorities {
            // The old rows are gone; the slot that enough steps follow from now on can be sampled.
            (first..first + self.n_envs).for_each(|row| priorities.exclude(row));
            if self.n_steps <= self.count {
                let ready = (self.count - self.n_steps) % self.n_slots * self.n_envs;
                (ready..ready + self.n_envs).for_each(|row| priorities.include(row));
            }
        }
        self.count += 1;
    }

    /// Whether any held transition can be sampled: one that enough steps follow.
    pub fn can_sample(&self) -> bool {
        self.n_steps < self.slots_held()
    }

    /// Whether sampling follows priorities, so that TD errors are needed.
    pub fn has_priorities(&self) -> bool {
        self.priorities.is_some()
    }

    /// Sets priorities from the absolute TD error of each sampled row, both `[batch]`. Without priorities it does
    /// nothing.
    pub fn set_td_errors(&mut self, rows: &[usize], errors: &[f32]) {
        if let Some(priorities) = &mut self.priorities {
            rows.iter().zip(errors).for_each(|(&row, &error)| priorities.set_td_error(row, error));
        }
    }

    /// Samples `batch` transitions, uniformly at random or by priority, each over `n_steps` steps or to the end of its
    /// episode.
    ///
    /// The sum of rewards is R. Sutton's n-step return ("Learning to Predict by the Methods of Temporal Differences",
    /// 1988), without an off-policy correction. [`ReplayBuffer::can_sample`] must hold.
    pub fn sample(&self, batch: usize, gamma: f32, rng: &mut impl Rng) -> Sample<N> {
        let held = self.slots_held();
        let oldest = self.count - held;
        let mut sample = Sample {
            observation: Vec::with_capacity(batch),
            action: Vec::with_capacity(batch),
            reward: Vec::with_capacity(batch),
            discount: Vec::with_capacity(batch),
            next_observation: Vec::with_capacity(batch),
            weight: vec![1.0; batch],
            row: Vec::with_capacity(batch),
        };
        for index in 0..batch {
            let (slot, env) = match &self.priorities {
                // The last `n_steps` slots are not yet followed by enough others.
                None => (rng.random_range(oldest..self.count - self.n_steps), rng.random_range(0..self.n_envs)),
                Some(priorities) => {
                    let row = priorities.sample(index, batch, rng);
                    let index = row / self.n_envs;
                    (oldest + (index + self.n_slots - oldest % self.n_slots) % self.n_slots, row % self.n_envs)
                }
            };
            self.follow(slot, env, gamma, &mut sample);
        }
        if let Some(priorities) = &self.priorities {
            sample.weight = priorities.weights(&sample.row, (held - self.n_steps) * self.n_envs);
        }
        sample
    }

    fn follow(&self, slot: usize, env: usize, gamma: f32, sample: &mut Sample<N>) {
        let row_of = |slot: usize| slot % self.n_slots * self.n_envs + env;
        let first = row_of(slot);
        let mut reward = 0.0;
        let mut weight = 1.0;
        let mut next = None;
        for row in (slot..slot + self.n_steps).map(row_of) {
            reward += weight * self.reward[row];
            weight *= gamma;
            match self.after[row] {
                After::Next => continue,
                After::Terminated => weight = 0.0,
                After::Truncated => next = self.truncated.get(&row),
            }
            break;
        }
        sample.row.push(first);
        sample.observation.push(self.observation[first]);
        sample.action.push(self.action[first]);
        sample.reward.push(reward);
        sample.discount.push(weight);
        // After the end of an episode this is another episode's observation: its discount is 0.
        sample.next_observation.push(*next.unwrap_or(&self.observation[row_of(slot + self.n_steps)]));
    }

    fn slots_held(&self) -> usize {
        self.count.min(self.n_slots)
    }
}

#[cfg(test)]
mod tests;
