//! The memory into a checkpoint and back: the ring as it lies, nothing left out.

use super::priority::Priorities;
use super::{After, Memory};
use crate::error::Error;
use crate::learner::checkpoint::{Columns, Stored};

impl<const N: usize> Memory<N> {
    /// Adds the ring's columns.
    pub fn save<'a>(&'a self, columns: &mut Columns<'a>) {
        columns.put("memory, count", vec![self.count as u64]);
        columns.put("memory, observation", self.observation.as_flattened());
        columns.put("memory, action", &self.action[..]);
        columns.put("memory, reward", &self.reward[..]);
        columns.put("memory, after", self.after.iter().map(|&after| after as u8).collect::<Vec<_>>());
        let mut rows: Vec<usize> = self.cut.keys().copied().collect();
        rows.sort_unstable();
        columns.put("memory, cut rows", rows.iter().map(|&row| row as u64).collect::<Vec<_>>());
        columns.put("memory, cut observations", rows.iter().flat_map(|row| self.cut[row]).collect::<Vec<f32>>());
        if let Some(priorities) = &self.priorities {
            columns.put("memory, priorities", priorities.rows());
            columns.put("memory, largest priority", vec![priorities.largest()]);
        }
    }

    /// Goes on from a ring of the same size.
    pub fn restore(&mut self, stored: &Stored) -> Result<(), Error> {
        let [count] = stored.array::<u64, 1>("memory, count")?;
        self.count = count as usize;
        let n_rows = self.slots_held() * self.n_envs;
        self.observation = stored.exactly::<f32>("memory, observation", n_rows * N)?.as_chunks().0.to_vec();
        self.action = stored.exactly("memory, action", n_rows)?;
        self.reward = stored.exactly("memory, reward", n_rows)?;
        let after = |code: u8| [After::Next, After::Over, After::Cut].into_iter().find(|&after| after as u8 == code);
        let codes: Vec<u8> = stored.exactly("memory, after", n_rows)?;
        let codes: Option<_> = codes.into_iter().map(after).collect();
        self.after = codes.ok_or_else(|| stored.error("its column `memory, after` has a code that means nothing".to_owned()))?;
        let rows: Vec<u64> = stored.column("memory, cut rows")?;
        let observations: Vec<f32> = stored.exactly("memory, cut observations", rows.len() * N)?;
        self.cut = rows.iter().map(|&row| row as usize).zip(observations.as_chunks().0.iter().copied()).collect();
        if let Some(priorities) = &mut self.priorities {
            let [largest] = stored.array("memory, largest priority")?;
            let rows: Vec<f64> = stored.exactly("memory, priorities", self.n_slots * self.n_envs)?;
            *priorities = Priorities::restored(priorities.settings(), &rows, largest);
        }
        Ok(())
    }
}
