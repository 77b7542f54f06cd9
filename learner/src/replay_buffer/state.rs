//! The replay buffer into a checkpoint and back: the ring as it is.

use super::priorities::Priorities;
use super::{After, ReplayBuffer};
use crate::checkpoint::{Columns, Stored};
use crate::error::Error;

/// Far more than any value of an observation.
const LARGEST_VALUE: f32 = 1e6;
/// Far more than any reward.
const LARGEST_REWARD: f32 = 1e9;

impl<const N: usize> ReplayBuffer<N> {
    /// Adds the ring's columns.
    pub fn save<'a>(&'a self, columns: &mut Columns<'a>) {
        columns.put("replay buffer, count", vec![self.count as u64]);
        columns.put("replay buffer, observation", self.observation.as_flattened());
        columns.put("replay buffer, action", &self.action[..]);
        columns.put("replay buffer, reward", &self.reward[..]);
        columns.put("replay buffer, after", self.after.iter().map(|&after| after as u8).collect::<Vec<_>>());
        let mut rows: Vec<usize> = self.truncated.keys().copied().collect();
        rows.sort_unstable();
        columns.put("replay buffer, truncated rows", rows.iter().map(|&row| row as u64).collect::<Vec<_>>());
        columns.put(
            "replay buffer, truncated observations",
            rows.iter().flat_map(|row| self.truncated[row]).collect::<Vec<f32>>(),
        );
        if let Some(priorities) = &self.priorities {
            columns.put("replay buffer, priorities", priorities.rows());
            columns.put("replay buffer, largest priority", vec![priorities.largest()]);
        }
    }

    /// Continues from a buffer of the same size, of transitions with `n_actions` actions.
    pub fn restore(&mut self, stored: &Stored, n_actions: u32) -> Result<(), Error> {
        let [count] = stored.array::<u64, 1>("replay buffer, count")?;
        self.count = usize::try_from(count)
            .map_err(|_| stored.error(format!("its column `replay buffer, count` says {count}")))?;
        let n_rows = self.slots_held() * self.n_envs;
        self.observation =
            bounded(stored, "replay buffer, observation", n_rows * N, LARGEST_VALUE)?.as_chunks().0.to_vec();
        self.action = stored.exactly("replay buffer, action", n_rows)?;
        if let Some(action) = self.action.iter().find(|&&action| n_actions <= action) {
            return Err(stored.error(format!(
                "its column `replay buffer, action` has action {action}; the table has 0..{}",
                n_actions - 1
            )));
        }
        self.reward = bounded(stored, "replay buffer, reward", n_rows, LARGEST_REWARD)?;
        let after = |code: u8| {
            [After::Next, After::Terminated, After::Truncated].into_iter().find(|&after| after as u8 == code)
        };
        let codes: Vec<u8> = stored.exactly("replay buffer, after", n_rows)?;
        let codes: Option<_> = codes.into_iter().map(after).collect();
        self.after =
            codes.ok_or_else(|| stored.error("its column `replay buffer, after` has an unknown code".to_owned()))?;
        self.restore_truncated(stored)?;
        let (count, n_envs, n_slots, n_steps) = (self.count, self.n_envs, self.n_slots, self.n_steps);
        // At least `n_steps` others follow the step of this row.
        let is_ready = |row: usize| {
            let last = count - 1;
            n_steps <= (last + n_slots - row / n_envs) % n_slots
        };
        if let Some(priorities) = &mut self.priorities {
            let [largest] = stored.array("replay buffer, largest priority")?;
            let rows: Vec<f64> = stored.exactly("replay buffer, priorities", self.n_slots * self.n_envs)?;
            if largest <= 0.0 || rows.iter().any(|&priority| priority < 0.0 || largest < priority) {
                return Err(stored.error(
                    "its column `replay buffer, priorities` has one that is negative or above the largest".to_owned(),
                ));
            }
            // A row that can be sampled has a priority, any other has none.
            let ready = |(row, &priority): (usize, &f64)| (0.0 < priority) == (row < n_rows && is_ready(row));
            if !rows.iter().enumerate().all(ready) {
                let message =
                    "its column `replay buffer, priorities` has one where none may be, or lacks one".to_owned();
                return Err(stored.error(message));
            }
            *priorities = Priorities::restored(priorities.settings(), &rows, largest);
        }
        Ok(())
    }

    /// Observations of truncated episodes: one for each row that says so.
    fn restore_truncated(&mut self, stored: &Stored) -> Result<(), Error> {
        let rows: Vec<u64> = stored.column("replay buffer, truncated rows")?;
        let needed =
            self.after.iter().enumerate().filter(|&(_, after)| *after == After::Truncated).map(|(row, _)| row as u64);
        if !rows.iter().copied().eq(needed) {
            let message =
                "its column `replay buffer, truncated rows` does not list the rows that `replay buffer, after` says"
                    .to_owned();
            return Err(stored.error(message));
        }
        let observations = bounded(stored, "replay buffer, truncated observations", rows.len() * N, LARGEST_VALUE)?;
        self.truncated = rows.iter().map(|&row| row as usize).zip(observations.as_chunks().0.iter().copied()).collect();
        Ok(())
    }
}

/// A column of numbers that are no larger than a run makes them.
fn bounded(stored: &Stored, name: &str, n: usize, largest: f32) -> Result<Vec<f32>, Error> {
    let numbers: Vec<f32> = stored.exactly(name, n)?;
    match numbers.iter().find(|number| largest < number.abs()) {
        Some(number) => {
            Err(stored.error(format!("its column `{name}` has {number:e}, which no run makes: put a sound copy back")))
        }
        None => Ok(numbers),
    }
}
