//! A training file: what is trained on, for how long, and how. `learner/configs/default.toml` explains every key.
//!
//! A file may name another one as its `base` and give only the keys that differ.

mod also_evaluate;
mod check;
mod file;
mod refinement;
mod rule;
mod set;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use offtrack::files::reader::{Reader, said};
use offtrack::scenario::RewardChanges;
use serde::{Deserialize, Serialize};

use crate::error::Error;

pub use also_evaluate::AlsoEvaluate;
pub use refinement::Refinement;
pub use rule::Rule;
pub(crate) use rule::driven;

/// A training file. Unknown keys are refused; one in hand has been checked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The benchmark whose test routes the policy is evaluated on: a name, or the path of a file.
    pub benchmark: String,
    /// The benchmark whose training routes it is trained on; none for `benchmark` itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub training_benchmark: Option<String>,
    /// Further evaluations of the policy, each `BENCHMARK` or `BENCHMARK/SPLIT`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub also_evaluate: Vec<String>,
    /// Where the trucks and the learner are.
    #[serde(default)]
    pub device: Device,
    /// Part of the graphics adapter's name; none for the first that is found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adapter: Option<String>,
    /// A policy to begin with, a file or a shipped one's name; none begins with random weights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// A rule among other vehicles that caps the speed of every action that a truck makes; none caps nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rule: Option<Rule>,
    /// Seed of routes, poses, networks, actions and samples.
    pub seed: u32,
    /// Number of trucks.
    pub n_envs: usize,
    /// Training time (min).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub minutes: Option<f64>,
    /// Env steps of all trucks together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<u64>,
    /// Time between two checkpoints (min).
    #[serde(default = "checkpoint_minutes")]
    pub checkpoint_minutes: f64,
    /// Other weights than the training benchmark's in its reward.
    #[serde(default, skip_serializing_if = "RewardChanges::is_empty")]
    pub reward: RewardChanges,
    /// Random actions among the policy's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exploration: Option<Exploration>,
    /// Routes that fail are drawn more often; none draws uniformly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level_replay: Option<LevelReplay>,
    /// The policy is tried on validation routes while it learns, and the best one is kept; none keeps the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub validation: Option<Validation>,
    /// The replay buffer.
    pub replay_buffer: ReplayBuffer,
    /// The learner.
    pub learning: Learning,
    /// The last part of the run refines the policy by proximal policy optimisation; none does without.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refinement: Option<Refinement>,
}

/// Why a config can always be written.
const WRITABLE: &str = "numbers, words and lists of them can all be written as TOML";

fn checkpoint_minutes() -> f64 {
    2.0
}

/// Where the trucks and the learner are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Device {
    /// The processor.
    #[default]
    Cpu,
    /// A graphics device, both on the same one.
    Gpu,
}

/// Random actions in place of some of the policy's: epsilon-greedy exploration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exploration {
    /// Fraction of random actions at the beginning.
    pub initial_fraction: f64,
    /// Fraction of random actions from `steps` on.
    pub final_fraction: f64,
    /// Env steps over which the fraction goes from the initial to the final one.
    pub steps: u64,
    /// How differently the trucks explore: the fraction of truck i of n is raised to the power 1 + spread i / (n - 1).
    #[serde(default)]
    pub spread: f64,
}

/// Routes are drawn more often where their episodes fail more often.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LevelReplay {
    /// Fraction of the episodes whose route is drawn by its score; the others' is drawn uniformly.
    pub fraction: f64,
    /// Weight of a route's latest episode in its failure rate.
    pub rate: f64,
}

/// How the policy is tried while it learns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Validation {
    /// The benchmark with the validation routes: a name, or the path of a file. None for those of the run's `benchmark`
    /// or, where that has none, for random roads that are driven as it says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub benchmark: Option<String>,
    /// Number of validations in a run, at equal parts of its budget.
    pub times: usize,
    /// Episodes on each route.
    pub episodes: usize,
}

/// The replay buffer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReplayBuffer {
    /// Transitions held.
    pub capacity: usize,
    /// Transitions before the first update.
    pub warmup: usize,
    /// Prioritised sampling; none samples uniformly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub priority: Option<Priority>,
}

impl ReplayBuffer {
    /// Steps of all trucks that it holds: enough for its capacity.
    pub fn slots(&self, n_envs: usize) -> usize {
        self.capacity.div_ceil(n_envs)
    }
}

/// Transitions are sampled in proportion to a power of their TD error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Priority {
    /// Power of the TD error.
    pub exponent: f64,
    /// Power of the importance-sampling weights: 0 corrects nothing, 1 all of the bias.
    pub correction: f64,
}

/// The learner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learning {
    /// Sizes of the hidden layers of the actor and the critics.
    pub hidden: Vec<usize>,
    /// Transitions in an update.
    pub batch: usize,
    /// Updates after each step of all trucks.
    pub updates_per_step: usize,
    /// Steps of the n-step return.
    pub n_steps: usize,
    /// Discount factor.
    pub gamma: f64,
    /// Factor of the rewards.
    pub reward_scale: f64,
    /// Added to the reward of a step that arrives; none adds nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arrival: Option<f64>,
    /// Observations are normalised to mean 0 and standard deviation 1.
    pub normalise_observations: bool,
    /// Uniform noise on the normalised observations of a sample, up to this; 0 for none.
    #[serde(default)]
    pub observation_noise: f64,
    /// Half of the sampled transitions are mirrored left to right.
    #[serde(default)]
    pub mirror_augmentation: bool,
    /// Adam's learning rate of the actor at the beginning.
    pub actor_learning_rate: f64,
    /// Adam's learning rate of the critics at the beginning.
    pub critic_learning_rate: f64,
    /// Fraction of the learning rates that is left at the end; the schedule is linear.
    pub final_learning_rate_fraction: f64,
    /// Layer normalisation in the critics' hidden layers.
    pub layer_norm: bool,
    /// How the two critics' values are combined.
    pub critics: Critics,
    /// How far the target critics move toward the critics at a time; 1 copies them.
    pub tau: f64,
    /// Updates between two such moves.
    pub target_interval: usize,
    /// How far the EMA of the actor, which becomes the policy, moves toward the actor in each update.
    pub actor_ema_rate: f64,
    /// Updates of the critics alone at the beginning: a policy that is begun with is kept until they know it.
    #[serde(default)]
    pub actor_delay: u64,
    /// The entropy term.
    pub entropy: Entropy,
}

/// How the two critics' values are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Critics {
    /// The mean of the two values.
    Mean,
    /// The lower of the two values.
    Minimum,
}

/// The entropy term.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entropy {
    /// The TD target includes the entropy of the next state; otherwise the actor's loss alone does.
    pub in_target: bool,
    /// Entropy that the coefficient is adapted to, as a fraction of the largest possible; none keeps the coefficient.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_fraction: Option<f64>,
    /// The coefficient, at the beginning or throughout.
    pub coefficient: f64,
    /// Adam's learning rate of the coefficient's logarithm.
    pub learning_rate: f64,
}

/// Values that flags of the command line give in place of a training file's.
#[derive(Debug, Clone, Copy, Default)]
pub struct Flags {
    /// `--seed`.
    pub seed: Option<u32>,
    /// `--minutes`. It or `--steps` replaces the whole budget.
    pub minutes: Option<f64>,
    /// `--steps`.
    pub steps: Option<u64>,
    /// `--envs`.
    pub envs: Option<usize>,
}

impl Flags {
    /// Those that can be wrong as they are given.
    fn words(&self) -> impl Iterator<Item = String> {
        let words = [
            self.minutes.map(|minutes| format!("--minutes {minutes}")),
            self.steps.map(|steps| format!("--steps {steps}")),
            self.envs.map(|envs| format!("--envs {envs}")),
        ];
        words.into_iter().flatten()
    }
}

impl Config {
    /// Reads a training file by its path or its name, `default`. Everything that can be wrong with it is found here,
    /// with its key.
    pub fn read(file: &Path) -> Result<Config, Error> {
        Config::read_with(file, &[])
    }

    /// Reads a training file with some of its keys set to other values, each `KEY=VALUE`.
    pub fn read_with(file: &Path, settings: &[String]) -> Result<Config, Error> {
        Config::read_for(file, None, settings, &Flags::default())
    }

    /// Reads a training file as [`Config::read_with`] does with flags, for another benchmark alone if one is given.
    pub fn read_for(file: &Path, benchmark: Option<&str>, settings: &[String], flags: &Flags) -> Result<Config, Error> {
        let mut table = file::resolved(file)?;
        if let Some(benchmark) = benchmark {
            set::set_benchmark(&mut table, benchmark);
        }
        set::set(&mut table, settings)?;
        let origin = Config::origin(file, benchmark, settings, flags);
        // Shown whole, the error names the key too.
        let wrong = |error: toml::de::Error| {
            let fault = error.to_string().replace(error.message(), &said(&error));
            Error::contents(&origin, fault.trim().replace('\n', ", "))
        };
        let mut config: Config = table.try_into().map_err(wrong)?;
        config.replace(flags);
        config.check(&Reader::of(&origin))?;
        Ok(config)
    }

    /// Where the keys of [`Config::read_for`] come from, for errors: `default with --set seed=3`.
    pub fn origin(file: &Path, benchmark: Option<&str>, settings: &[String], flags: &Flags) -> PathBuf {
        let benchmark = benchmark.map(|name| format!("--benchmark {name}")).into_iter();
        let settings = settings.iter().map(|setting| format!("--set {setting}"));
        let all: Vec<String> = benchmark.chain(settings).chain(flags.words()).collect();
        if all.is_empty() {
            file.to_owned()
        } else {
            PathBuf::from(format!("{} with {}", file.display(), all.join(" ")))
        }
    }

    /// Values of flags replace those of a config that has been checked.
    pub fn override_with(&mut self, flags: &Flags) -> Result<(), Error> {
        self.replace(flags);
        // So an error here comes from these flags.
        self.check(&Reader::of(Path::new(&flags.words().collect::<Vec<_>>().join(" "))))
    }

    fn replace(&mut self, &Flags { seed, minutes, steps, envs }: &Flags) {
        self.seed = seed.unwrap_or(self.seed);
        self.n_envs = envs.unwrap_or(self.n_envs);
        if minutes.is_some() || steps.is_some() {
            (self.minutes, self.steps) = (minutes, steps);
        }
    }

    /// The first key, and its two values, that keeps a run with this config from continuing one with the other, as
    /// [`Config::first_difference`]: only budget and checkpoint interval may differ.
    pub(crate) fn hindrance(&self, other: &Config) -> Option<(String, String, String)> {
        let Config { minutes, steps, checkpoint_minutes, .. } = *self;
        self.first_difference(&Config { minutes, steps, checkpoint_minutes, ..other.clone() })
    }

    /// The first key whose value differs from that of `other`, and the two values, each `nothing` where it is not
    /// given.
    pub fn first_difference(&self, other: &Config) -> Option<(String, String, String)> {
        let (own, others) = (self.keys(), other.keys());
        let key = own.keys().chain(others.keys()).filter(|&key| own.get(key) != others.get(key)).min()?;
        let value = |of: &BTreeMap<String, String>| of.get(key).cloned().unwrap_or_else(|| "nothing".to_owned());
        Some((key.clone(), value(&own), value(&others)))
    }

    /// What differs from the training benchmark's reward, `reward.clearance = -100.0`; empty where nothing does.
    pub fn changed_rewards(&self) -> String {
        let changed = self.keys().into_iter().filter(|(key, _)| key.starts_with("reward."));
        changed.map(|(key, value)| format!("{key} = {value}")).collect::<Vec<_>>().join(", ")
    }

    /// Every key with its tables' names before it, and its value as TOML.
    fn keys(&self) -> BTreeMap<String, String> {
        let mut keys = BTreeMap::new();
        let mut left = vec![(String::new(), toml::Value::try_from(self).expect(WRITABLE))];
        while let Some((name, value)) = left.pop() {
            match value {
                toml::Value::Table(table) => {
                    let prefix = if name.is_empty() { name } else { name + "." };
                    left.extend(table.into_iter().map(|(key, value)| (format!("{prefix}{key}"), value)));
                }
                value => drop(keys.insert(name, value.to_string())),
            }
        }
        keys
    }

    /// The training file that this config would be read from, without a `base`.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect(WRITABLE)
    }
}

#[cfg(test)]
mod documented_tests;
#[cfg(test)]
mod set_tests;
#[cfg(test)]
mod tests;
