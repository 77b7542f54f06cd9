//! What a refinement's networks observe of each truck: its last frames, side by side.

use offtrack::layout::Ended;
use offtrack_policy::Frames;

use crate::checkpoint::{Columns, Stored};
use crate::error::Error;

/// Its column in a checkpoint.
const COLUMN: &str = "rollout, frames";

/// The last frames of each truck, normalised, `[n_envs * frames * values]`, oldest first; empty before the first ones.
#[derive(Debug, Default)]
pub struct Stacks(Vec<f32>);

impl Stacks {
    /// Adds a frame of each truck, `[n_envs * values]`. Where the step before `ended` an episode, `[n_envs]`, it is the
    /// first of another one. Returns what the trucks see then.
    pub fn push(&mut self, seen: Frames, frames: &[f32], ended: &[u32]) -> &[f32] {
        let (n_values, is_first) = (frames.len() / ended.len(), self.0.is_empty());
        self.0.resize(seen.n * frames.len(), 0.0);
        let trucks = self.0.chunks_exact_mut(seen.n * n_values).zip(frames.chunks_exact(n_values));
        for ((stack, frame), &ended) in trucks.zip(ended) {
            seen.push(stack, frame, is_first || ended != Ended::Running as u32);
        }
        &self.0
    }

    /// What a truck would see with one frame more.
    pub fn next(&self, seen: Frames, env: usize, frame: &[f32]) -> Vec<f32> {
        let n_stacked = seen.n * frame.len();
        let mut stack = self.0[env * n_stacked..][..n_stacked].to_vec();
        seen.push(&mut stack, frame, false);
        stack
    }

    /// Adds the column, once there are frames. A newest one alone is observed again.
    pub fn save<'a>(&'a self, n_frames: usize, columns: &mut Columns<'a>) {
        if !self.0.is_empty() && 1 < n_frames {
            columns.put(COLUMN, &self.0[..]);
        }
    }

    /// Continues from a checkpoint. Its frames, if it has any, are `n_values` values in all.
    pub fn restore(&mut self, stored: &Stored, n_values: usize) -> Result<(), Error> {
        if stored.bytes(COLUMN).is_some() {
            self.0 = stored.exactly(COLUMN, n_values)?;
        }
        Ok(())
    }
}
