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

    /// An error if a budget of steps ends before the actor has learned anything, or within an iteration of the
    /// refinement. `origin` is the file or the flag that gives it.
    pub fn check_budget(&self, origin: &Path) -> Result<(), Error> {
        let Some(steps) = self.steps else { return Ok(()) };
        let (unlearned, why) = self.before_actor();
        if steps <= unlearned {
            let expected = format!("must be above {unlearned}, or nothing is learned: {why}");
            return Err(Reader::of(origin).invalid("steps", steps, expected).into());
        }
        if let Some(refinement) = &self.refinement
            && steps < (self.n_envs * refinement.n_steps) as u64
        {
            let expected = format!(
                "must be at least n_envs = {} times refinement.n_steps = {}, an iteration of the refinement",
                self.n_envs, refinement.n_steps
            );
            return Err(Reader::of(origin).invalid("steps", steps, expected).into());
        }
        Ok(())
    }

    /// Most env steps of a run whose actor does not learn, in the refinement where there is one, and why.
    fn before_actor(&self) -> (u64, String) {
        let Config { n_envs, replay_buffer, learning, .. } = self;
        let (n, before_updates) = (*n_envs as u64, self.before_updates());
        let begin_of_updates = format!(
            "updates begin after replay_buffer.warmup = {} env steps and learning.n_steps + 1 = {} steps of each truck",
            replay_buffer.warmup,
            learning.n_steps + 1
        );
        let Some(refinement) = &self.refinement else {
            let delay = learning.actor_delay;
            let delayed = match delay {
                0 => String::new(),
                _ => format!(
                    ", and the actor learns after learning.actor_delay = {delay} of them, \
                     learning.updates_per_step = {} after each step of n_envs = {n} trucks",
                    learning.updates_per_step
                ),
            };
            let unlearned = before_updates + delay / learning.updates_per_step as u64 * n;
            return (unlearned, begin_of_updates + &delayed);
        };
        // Without a policy to begin with there is one after the first update.
        let (before_policy, begin_of_updates) = match self.from {
            Some(_) => (0, String::new()),
            None => (before_updates + n, format!("; {begin_of_updates}")),
        };
        let of_values = refinement.critic_iterations * refinement.n_steps as u64 * n;
        let share = match refinement.begin {
            0.0 => of_values,
            // It begins with a step of all trucks.
            begin => ((of_values + n) as f64 / (1.0 - begin)).ceil() as u64,
        };
        let why = format!(
            "the refinement, from refinement.begin = {} of the steps on, changes the policy after \
             refinement.critic_iterations = {} iterations of refinement.n_steps = {} steps of n_envs = {n} \
             trucks{begin_of_updates}",
            refinement.begin, refinement.critic_iterations, refinement.n_steps
        );
        (share.max(before_policy + of_values), why)
    }

    /// Env steps before the first update of soft actor-critic, whole steps of all trucks: none of a refinement that
    /// begins with a policy, at once.
    pub(crate) fn before_updates(&self) -> u64 {
        if self.from.is_some() && self.refinement.as_ref().is_some_and(|refinement| refinement.begin <= 0.0) {
            return 0;
        }
        let of_each = self.replay_buffer.warmup.div_ceil(self.n_envs).max(self.learning.n_steps + 1);
        (of_each * self.n_envs) as u64
    }
}

impl Learning {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        reader.length("learning.hidden", self.hidden.len(), 1..=8, "layers")?;
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::config::Config;

    fn read(file: &str, settings: &[&str]) -> Config {
        let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
        Config::read_with(Path::new(file), &settings).unwrap()
    }

    /// What is wrong with a budget of so many steps.
    fn fault(config: &Config, steps: u64) -> Option<String> {
        let config = Config { steps: Some(steps), ..config.clone() };
        config.check_budget(Path::new("fast.toml")).err().map(|error| error.to_string())
    }

    /// `most` is refused with each of `expected`, and one step more is not.
    fn refused_up_to(most: u64, config: &Config, expected: &[&str]) {
        let message = fault(config, most).unwrap();
        assert!(
            message.starts_with(&format!("fast.toml: steps: {most}; must be above {most}, or nothing")),
            "{message}"
        );
        assert!(expected.iter().all(|expected| message.contains(expected)), "{message}");
        assert_eq!(fault(config, most + 1), None);
    }

    #[test]
    fn a_budget_that_ends_before_the_actor_has_learned_is_refused() {
        // 40 steps of 512 trucks fill the replay buffer with 20000.
        refused_up_to(20_480, &read("default", &[]), &["replay_buffer.warmup = 20000 env steps and learning.n_steps"]);
        let delayed = ["learning.actor_delay = 1000 of them, learning.updates_per_step = 4 after each step of n_envs"];
        refused_up_to(148_480, &read("default", &["learning.actor_delay=1000"]), &delayed);
        refused_up_to(148_480, &read("default", &["learning.actor_delay=1003"]), &["actor_delay = 1003"]);
        refused_up_to(148_992, &read("default", &["learning.actor_delay=1004"]), &["actor_delay = 1004"]);
        assert!(read("default", &["steps=", "minutes=1"]).check_budget(Path::new("fast.toml")).is_ok());
    }

    #[test]
    fn a_budget_that_ends_before_the_refinement_changes_the_policy_is_refused() {
        let keys = ["refinement.critic_iterations = 16 iterations", "refinement.n_steps = 64", "n_envs = 1024"];
        refused_up_to(16 * 64 * 1024, &read("lane", &[]), &keys);
        // Half of the budget, but for the last step of all trucks before it, is the refinement's.
        let half = read("lane", &["refinement.begin=0.5", "learning.actor_delay=1000000000"]);
        refused_up_to(2 * (16 * 64 + 1) * 1024, &half, &["refinement.begin = 0.5 of the steps"]);
        // Without a policy one is learned first.
        let none = read("lane", &["from="]);
        refused_up_to((16 * 64 + 20 + 1) * 1024, &none, &["replay_buffer.warmup = 20000 env steps"]);
        let shipped = ["lane", "traffic-refined", "transfer-refined", "default", "paper", "transfer", "traffic"];
        for file in shipped {
            let config = read(file, &[]);
            assert!(config.check_budget(Path::new(file)).is_ok(), "{file}");
        }
    }

    #[test]
    fn a_budget_below_an_iteration_of_the_refinement_is_refused() {
        let settings = ["refinement.n_steps=10000", "refinement.critic_iterations=0", "replay_buffer.capacity=1000000"];
        let config = read("lane", &settings);
        let iteration = config.n_envs as u64 * 10_000;
        let message = fault(&config, iteration - 1).unwrap();
        assert!(message.contains("fast.toml: steps: 10239999; must be at least n_envs = "), "{message}");
        assert_eq!(fault(&config, iteration), None);
        // One that begins at once with a policy fills no replay buffer first.
        let mut config = read("lane", &["refinement.n_steps=1", "refinement.critic_iterations=0"]);
        assert_eq!(fault(&config, 1_024), None);
        config.from = None;
        assert!(fault(&config, 5_000).is_some());
    }
}
