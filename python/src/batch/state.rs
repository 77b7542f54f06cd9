//! What a step of a batch changes, and the step.

use offtrack::layout::{Column, Ended, Truck};
use offtrack::simulator::{Actions, Autoreset, Simulator, Tally, rows};
use offtrack_drawing::camera::Camera;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use super::Batch;
use super::arguments::CPU;
use crate::errors;
use crate::infos::{End, Episode};
use crate::observed::{Observed, Read};
use crate::pool::Pool;

/// What a step changes.
pub(super) struct State {
    pub(super) simulator: Simulator,
    pub(super) pool: Pool,
    pub(super) camera: Option<Camera>,
    /// What each truck's episode was drawn from.
    pub(super) episodes: Vec<Episode>,
    /// Whether its episode has ended and no other has begun.
    pub(super) held: Vec<bool>,
    /// Episodes that the last step ended.
    pub(super) ends: Vec<End>,
    /// What the batch that this one goes on from had counted.
    pub(super) earlier: Tally,
}

impl State {
    /// Steps all trucks, and hands observation, reward and end code of each to `deliver`, on the pool's threads: these
    /// fall asleep where the caller's own does the work.
    pub(super) fn step<T: Send>(
        &mut self,
        py: Python,
        batch: &Batch,
        actions: &Actions,
        deliver: impl FnOnce(&Observed, &[f32], &[u32]) -> T + Send,
    ) -> PyResult<T> {
        self.check_step(py, batch)?;
        let State { simulator, pool, ends, episodes, held, .. } = self;
        let group = batch.place.world.group();
        let stepped = pool.run(py, || {
            simulator.step_any(actions)?;
            let read = Read::of(simulator, &batch.read)?;
            let (codes, trucks) = (read.rows::<u32>(Column::Ended), read.rows::<Truck>(Column::Truck));
            let last = read.observed_last(batch.layout);
            let mut rewards = read.rows::<f32>(Column::Reward);
            let mut codes = codes;
            if 1 < group {
                // What a truck had in its last step stands in its row while it waits for its group.
                for (env, held) in held.iter_mut().enumerate().filter(|(_, held)| **held) {
                    (codes.to_mut()[env], rewards.to_mut()[env]) = (Ended::Running as u32, 0.0);
                    *held = trucks[env].held == 1;
                    episodes[env] = Episode::of(&trucks[env]);
                }
            } else if batch.autoreset == Autoreset::NextStep {
                // Trucks that were held have begun, and no other is in another episode.
                for env in (0..trucks.len()).filter(|&env| std::mem::take(&mut held[env])) {
                    episodes[env] = Episode::of(&trucks[env]);
                }
            }
            ends.clear();
            for (env, &code) in codes.iter().enumerate().filter(|&(_, &code)| code != Ended::Running as u32) {
                ends.push(End { env, code, episode: episodes[env], observation: last.row(env) });
                episodes[env] = Episode::of(&trucks[env]);
                held[env] = trucks[env].held == 1;
            }
            Ok(deliver(&read.observed(batch.layout), &rewards, &codes))
        })?;
        stepped.map_err(|error| errors::of_simulator(&error))
    }

    /// An error where a step cannot be made: in a forked child, or where episodes have ended that the caller begins.
    pub(super) fn check_step(&self, py: Python, batch: &Batch) -> PyResult<()> {
        self.check_process(&batch.device)?;
        let group = batch.place.world.group();
        if batch.autoreset == Autoreset::Disabled
            && let Some(index) = self.held.chunks(group).position(|held| held.iter().all(|&held| held))
        {
            return Err(errors::reset_needed(
                py,
                &format!("truck {}: its episode has ended; begin another before the next step", index * group),
            ));
        }
        Ok(())
    }

    /// Sums over all steps, those of the batch that this one goes on from among them.
    pub(super) fn tally(&self) -> PyResult<Tally> {
        let mut tally = self.simulator.tally().map_err(|error| errors::of_simulator(&error))?;
        tally.sums.iter_mut().zip(self.earlier.sums).for_each(|(sum, earlier)| *sum += earlier);
        Ok(tally)
    }

    /// Looks at where trucks are after they were put there.
    pub(super) fn look(&mut self) -> PyResult<()> {
        let State { simulator, episodes, held, ends, .. } = self;
        let mut read = simulator.read(&[Column::Truck]).map_err(|error| errors::of_simulator(&error))?;
        ends.clear();
        see(&rows::<Truck>(read.pop().unwrap_or_default()), episodes, held);
        Ok(())
    }

    /// An error in a forked child whose batch is on a device: the device is its parent's.
    pub(super) fn check_process(&self, device: &str) -> PyResult<()> {
        if device != CPU && self.pool.is_forked() {
            let message =
                format!("this batch is on {device}, which a forked process cannot use; make the batch in the child");
            return Err(PyRuntimeError::new_err(message));
        }
        Ok(())
    }
}

/// Takes down which episodes trucks are in and which are held.
fn see(trucks: &[Truck], episodes: &mut Vec<Episode>, held: &mut Vec<bool>) {
    episodes.clear();
    episodes.extend(trucks.iter().map(Episode::of));
    held.clear();
    held.extend(trucks.iter().map(|truck| truck.held == 1));
}
