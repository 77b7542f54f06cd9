//! What can be wrong with a training file: ranges of single values, and values that do not go together.

use std::path::Path;

use offtrack::files::reader::Reader;

use super::{Config, Device, Learning};
use crate::error::Error;

impl Config {
    /// The first key whose value makes no sense is an error.
    pub(crate) fn check(&self, reader: &Reader) -> Result<(), Error> {
        let Config { replay_buffer, learning, .. } = self;
        self.check_also_evaluate(reader)?;
        self.reward.check(reader, "reward")?;
        reader.count("n_envs", self.n_envs, 1..=1 << 20)?;
        if let Some(minutes) = self.minutes {
            reader.within("minutes", minutes, 0.01..=100_000.0, "min")?;
        }
        if let Some(steps) = self.steps {
            reader.within("steps", steps as f64, 1.0..=1e12, "")?;
        }
        if self.minutes.is_none() && self.steps.is_none() {
            return Err(reader
                .invalid("minutes", "missing", "`minutes`, `steps` or both must say when to stop")
                .into());
        }
        reader.within("checkpoint_minutes", self.checkpoint_minutes, 1e-4..=100_000.0, "min")?;
        reader.count("replay_buffer.capacity", replay_buffer.capacity, 1_000..=100_000_000)?;
        reader.count("replay_buffer.warmup", replay_buffer.warmup, 1..=replay_buffer.capacity)?;
        if let Some(priority) = replay_buffer.priority {
            reader.within("replay_buffer.priority.exponent", priority.exponent, 0.0..=1.0, "")?;
            reader.within("replay_buffer.priority.correction", priority.correction, 0.0..=1.0, "")?;
        }
        if let Some(exploration) = &self.exploration {
            reader.within("exploration.initial_fraction", exploration.initial_fraction, 0.0..=1.0, "")?;
            reader.within("exploration.final_fraction", exploration.final_fraction, 0.0..=1.0, "")?;
            reader.within("exploration.steps", exploration.steps as f64, 1.0..=1e12, "")?;
            reader.within("exploration.spread", exploration.spread, 0.0..=100.0, "")?;
        }
        if let Some(level_replay) = self.level_replay {
            reader.within("level_replay.fraction", level_replay.fraction, 0.0..=0.95, "")?;
            reader.within("level_replay.rate", level_replay.rate, 0.001..=1.0, "")?;
        }
        if let Some(validation) = &self.validation {
            reader.count("validation.times", validation.times, 1..=10_000)?;
            reader.count("validation.episodes", validation.episodes, 1..=1_000)?;
        }
        learning.check(reader)?;
        if let Some(refinement) = &self.refinement {
            refinement.check(reader)?;
        }
        // A ring of fewer slots than that would hold no step that enough others follow.
        let slots = replay_buffer.slots(self.n_envs);
        if slots <= learning.n_steps {
            let expected = format!(
                "must hold more than learning.n_steps = {} steps of n_envs = {} trucks",
                learning.n_steps, self.n_envs
            );
            return Err(reader.invalid("replay_buffer.capacity", replay_buffer.capacity, expected).into());
        }
        if self.device == Device::Cpu && self.adapter.is_some() {
            return Err(reader.invalid("adapter", "given", "works with device = \"gpu\" alone: leave it out").into());
        }
        if self.device == Device::Gpu {
            let without = [
                ("exploration", self.exploration.is_some()),
                ("refinement", self.refinement.is_some()),
                ("rule", self.rule.is_some()),
            ];
            if let Some((key, _)) = without.into_iter().find(|(_, given)| *given) {
                return Err(reader
                    .invalid(key, "given", "works with device = \"cpu\" alone: leave one of them out")
                    .into());
            }
        }
        Ok(())
    }

    /// An error if a budget of steps ends before the first update, so that nothing is learned, or within an iteration
    /// of the refinement. `origin` is the file or the flag that gives it.
    pub fn check_budget(&self, origin: &Path) -> Result<(), Error> {
        if let (Some(refinement), Some(steps)) = (&self.refinement, self.steps)
            && steps < (self.n_envs * refinement.n_steps) as u64
        {
            let expected = format!(
                "must be at least n_envs = {} times refinement.n_steps = {}, an iteration of the refinement",
                self.n_envs, refinement.n_steps
            );
            return Err(Reader::of(origin).invalid("steps", steps, expected).into());
        }
        let before_updates = self.before_updates();
        let Some(steps) = self.steps.filter(|&steps| steps <= before_updates) else { return Ok(()) };
        let expected = format!(
            "must be above {before_updates}, or nothing is learned: updates begin after replay_buffer.warmup = {} env \
             steps and learning.n_steps + 1 = {} steps of each truck",
            self.replay_buffer.warmup,
            self.learning.n_steps + 1
        );
        Err(Reader::of(origin).invalid("steps", steps, expected).into())
    }

    /// Env steps before the first update: none of a refinement that begins with a policy, at once.
    pub(crate) fn before_updates(&self) -> u64 {
        if self.from.is_some() && self.refinement.as_ref().is_some_and(|refinement| refinement.begin <= 0.0) {
            return 0;
        }
        let of_trucks = (self.learning.n_steps as u64 + 1) * self.n_envs as u64;
        of_trucks.max(self.replay_buffer.warmup as u64)
    }
}

impl Learning {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        reader.count("learning.hidden", self.hidden.len(), 1..=8)?;
        for (index, &size) in self.hidden.iter().enumerate() {
            reader.count(&format!("learning.hidden[{index}]"), size, 1..=8192)?;
        }
        reader.count("learning.batch", self.batch, 2..=1 << 20)?;
        reader.count("learning.updates_per_step", self.updates_per_step, 1..=1000)?;
        reader.count("learning.n_steps", self.n_steps, 1..=100)?;
        reader.within("learning.gamma", self.gamma, 0.0..=1.0, "")?;
        reader.within("learning.reward_scale", self.reward_scale, 1e-6..=1e6, "")?;
        if let Some(arrival) = self.arrival {
            reader.within("learning.arrival", arrival, -1e6..=1e6, "")?;
        }
        reader.within("learning.observation_noise", self.observation_noise, 0.0..=10.0, "")?;
        reader.within("learning.actor_learning_rate", self.actor_learning_rate, 1e-8..=1.0, "")?;
        reader.within("learning.critic_learning_rate", self.critic_learning_rate, 1e-8..=1.0, "")?;
        reader.within("learning.final_learning_rate_fraction", self.final_learning_rate_fraction, 0.0..=1.0, "")?;
        reader.within("learning.tau", self.tau, 1e-6..=1.0, "")?;
        reader.count("learning.target_interval", self.target_interval, 1..=1_000_000)?;
        reader.within("learning.actor_delay", self.actor_delay as f64, 0.0..=1e9, "updates")?;
        reader.within("learning.actor_ema_rate", self.actor_ema_rate, 1e-6..=1.0, "")?;
        if let Some(fraction) = self.entropy.target_fraction {
            reader.within("learning.entropy.target_fraction", fraction, 0.0..=1.0, "")?;
        }
        reader.within("learning.entropy.coefficient", self.entropy.coefficient, 1e-9..=1e3, "")?;
        reader.within("learning.entropy.learning_rate", self.entropy.learning_rate, 1e-8..=1.0, "")?;
        Ok(())
    }
}
