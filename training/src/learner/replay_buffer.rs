//! The learner's memory: the latest transitions of every truck, in a ring on the host.
//!
//! Rows lie in the order of time, `n_envs` to a slot, so what follows a row stands in the next slot. Only where the clock ended an episode
//! does it not: those few observations are kept beside the ring.

mod priority;
mod state;

use std::collections::HashMap;

use offtrack::layout::Ended;
use rand::Rng;

use crate::learner::config;
use priority::Priorities;

/// One step of every truck, as the simulator's columns have it. All are `[n_envs]`.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a, const N: usize> {
    /// What the action was chosen for.
    pub observation: &'a [[f32; N]],
    /// Index into the action table.
    pub action: &'a [u32],
    /// Reward of the step.
    pub reward: &'a [f32],
    /// Code of [`Ended`].
    pub ended: &'a [u32],
    /// What the action led to.
    pub next_observation: &'a [[f32; N]],
}

/// Transitions over up to `n_steps` steps each, drawn from the memory. All are `[batch]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample<const N: usize> {
    /// What the first action was chosen for.
    pub observation: Vec<[f32; N]>,
    /// The first action.
    pub action: Vec<u32>,
    /// Discounted sum of the rewards on the way.
    pub reward: Vec<f32>,
    /// Weight of the value of `next_observation`: discount ^ steps, and 0 where the task was over on the way.
    pub discount: Vec<f32>,
    /// What the last step on the way led to.
    pub next_observation: Vec<[f32; N]>,
    /// Weight in the critics' loss: 1, or less where priorities made the transition likely.
    pub weight: Vec<f32>,
    /// Where the transitions lie, for [`Memory::learned`].
    pub row: Vec<usize>,
}

/// What a row's step left behind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum After {
    /// The next slot.
    Next,
    /// Nothing: the task was over.
    Over,
    /// An observation in `cut`: the clock ran out.
    Cut,
}

/// A ring of the latest steps of every truck.
#[derive(Debug)]
pub struct Memory<const N: usize> {
    n_envs: usize,
    n_slots: usize,
    /// Slots written since the beginning; slot `count % n_slots` is the next to be written.
    count: usize,
    observation: Vec<[f32; N]>,
    action: Vec<u32>,
    reward: Vec<f32>,
    after: Vec<After>,
    cut: HashMap<usize, [f32; N]>,
    /// Steps that must follow a transition before it can be drawn.
    n_steps: usize,
    priorities: Option<Priorities>,
}

impl<const N: usize> Memory<N> {
    /// Room for at least `settings.capacity` transitions of `n_envs` trucks, to be drawn over `n_steps` steps each. The room is taken as
    /// it is filled.
    pub fn new(n_envs: usize, n_steps: usize, settings: &config::Memory) -> Memory<N> {
        let n_slots = settings.capacity.div_ceil(n_envs);
        Memory {
            n_envs,
            n_slots,
            n_steps,
            priorities: settings.priority.map(|priority| Priorities::new(priority, n_slots * n_envs)),
            count: 0,
            observation: Vec::new(),
            action: Vec::new(),
            reward: Vec::new(),
            after: Vec::new(),
            cut: HashMap::new(),
        }
    }

    /// Transitions held.
    pub fn len(&self) -> usize {
        self.observation.len()
    }

    /// The observations held, in no particular order.
    pub fn observations(&self) -> &[[f32; N]] {
        &self.observation
    }

    /// Keeps one step of every truck and forgets the oldest one once the ring is full.
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
            let ended = Ended::from_code(code).unwrap_or(Ended::Running);
            if self.after[row] == After::Cut {
                self.cut.remove(&row);
            }
            self.after[row] = if ended.terminated() {
                After::Over
            } else if ended.truncated() {
                self.cut.insert(row, rows.next_observation[env]);
                After::Cut
            } else {
                After::Next
            };
        }
        if let Some(priorities) = &mut self.priorities {
            // What was here is gone; the slot that now has enough followers can be drawn.
            (first..first + self.n_envs).for_each(|row| priorities.dismiss(row));
            if self.n_steps <= self.count {
                let ready = (self.count - self.n_steps) % self.n_slots * self.n_envs;
                (ready..ready + self.n_envs).for_each(|row| priorities.admit(row));
            }
        }
        self.count += 1;
    }

    /// Whether there is a step that enough others follow, so that one can be drawn.
    pub fn can_sample(&self) -> bool {
        self.n_steps < self.slots_held()
    }

    /// Takes note of the error of each row of a sample, `[batch]`; what has no priorities has no use for it.
    pub fn learned(&mut self, sample: &Sample<N>, errors: &[f32]) {
        if let Some(priorities) = &mut self.priorities {
            sample.row.iter().zip(errors).for_each(|(&row, &error)| priorities.learned(row, error));
        }
    }

    /// Draws `batch` transitions, each held one as likely as the next or by its priority, and follows each for `n_steps` steps or to its
    /// episode's end.
    ///
    /// The sum of rewards is R. Sutton's n-step return ("Learning to Predict by the Methods of Temporal Differences", 1988), without a
    /// correction for actions that today's policy would not choose. [`Memory::can_sample`] must hold.
    pub fn sample(&self, batch: usize, discount: f32, rng: &mut impl Rng) -> Sample<N> {
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
                    let row = priorities.draw(index, batch, rng);
                    let place = row / self.n_envs;
                    (oldest + (place + self.n_slots - oldest % self.n_slots) % self.n_slots, row % self.n_envs)
                }
            };
            self.follow(slot, env, discount, &mut sample);
        }
        if let Some(priorities) = &self.priorities {
            sample.weight = priorities.weights(&sample.row, (held - self.n_steps) * self.n_envs);
        }
        sample
    }

    fn follow(&self, slot: usize, env: usize, discount: f32, sample: &mut Sample<N>) {
        let row_of = |slot: usize| slot % self.n_slots * self.n_envs + env;
        let first = row_of(slot);
        let mut reward = 0.0;
        let mut weight = 1.0;
        let mut next = None;
        for row in (slot..slot + self.n_steps).map(row_of) {
            reward += weight * self.reward[row];
            weight *= discount;
            match self.after[row] {
                After::Next => continue,
                After::Over => weight = 0.0,
                After::Cut => next = self.cut.get(&row),
            }
            break;
        }
        sample.row.push(first);
        sample.observation.push(self.observation[first]);
        sample.action.push(self.action[first]);
        sample.reward.push(reward);
        sample.discount.push(weight);
        // After an episode's end this is another episode's observation: its weight is then 0.
        sample.next_observation.push(*next.unwrap_or(&self.observation[row_of(slot + self.n_steps)]));
    }

    fn slots_held(&self) -> usize {
        self.count.min(self.n_slots)
    }
}

#[cfg(test)]
mod tests;
