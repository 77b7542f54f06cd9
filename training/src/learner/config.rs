//! How to learn: a training file, checked. `training/configs/default.toml` says what each key means.

use std::path::Path;

use offtrack::reader::Reader;
use serde::{Deserialize, Serialize};

use crate::error::Error;

mod set;

/// A training file. Unknown keys are refused; one in hand has been checked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// A benchmark's name, or the path of its file.
    pub benchmark: String,
    /// A benchmark to practise on in place of `benchmark`, on whose test routes the driver is examined all the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub practice: Option<String>,
    /// Where trucks and learner are.
    #[serde(default)]
    pub device: Device,
    /// Part of the name of the graphics adapter; without it the first that is found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adapter: Option<String>,
    /// What routes, poses, networks, actions and samples are drawn from.
    pub seed: u32,
    /// Trucks that drive at once.
    pub n_envs: usize,
    /// Time to learn for [min].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub minutes: Option<f64>,
    /// Env steps to learn for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<u64>,
    /// Time from one checkpoint to the next [min].
    #[serde(default = "checkpoint_minutes")]
    pub checkpoint_minutes: f64,
    /// How far from the policy the trucks act.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exploration: Option<Exploration>,
    /// What is kept of the past.
    pub memory: Memory,
    /// How it is learned from.
    pub learning: Learning,
}

fn checkpoint_minutes() -> f64 {
    2.0
}

/// Where trucks and learner are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Device {
    /// The processor.
    #[default]
    Cpu,
    /// A graphics device, both on the same.
    Gpu,
}

/// Actions by chance in place of the policy's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exploration {
    /// Share of the actions that are drawn by chance, at the beginning.
    pub first: f64,
    /// The same from `steps` on.
    pub last: f64,
    /// Env steps over which the share goes from `first` to `last`.
    pub steps: u64,
    /// How differently the trucks explore: the share of truck i of n is raised to the power 1 + spread i / (n - 1).
    #[serde(default)]
    pub spread: f64,
}

/// What is kept of the past.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Memory {
    /// Transitions held.
    pub capacity: usize,
    /// Transitions before the first update.
    pub warmup: usize,
    /// Which transitions are drawn more often; without it all are equal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub priority: Option<Priority>,
}

/// Transitions are drawn in proportion to the error that the critics made on them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Priority {
    /// The power of the error that a transition is drawn in proportion to.
    pub exponent: f64,
    /// How much of the bias is taken back by weights: 0 nothing, 1 all of it.
    pub correction: f64,
}

/// How transitions are learned from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learning {
    /// Sizes of the hidden layers of actor and critics.
    pub hidden: Vec<usize>,
    /// Transitions in an update.
    pub batch: usize,
    /// Updates after each step of all trucks.
    pub updates_per_step: usize,
    /// Steps whose rewards are summed before the value takes over.
    pub n_steps: usize,
    /// Weight of the next step beside this one.
    pub discount: f64,
    /// What rewards are multiplied by.
    pub reward_scale: f64,
    /// Observed values are shifted and stretched to mean 0 and deviation 1.
    pub scale_observations: bool,
    /// Noise that is added to the scaled observations that are learned from, evenly distributed up to this; 0 none.
    #[serde(default)]
    pub observation_noise: f64,
    /// Half of the transitions are learned from as in a mirror.
    #[serde(default)]
    pub mirror: bool,
    /// Adam's learning rate of the actor.
    pub actor_rate: f64,
    /// Adam's learning rate of the critics.
    pub critic_rate: f64,
    /// Share of the learning rates that is left at the end of the run.
    pub last_rate: f64,
    /// Layers of the critics are normalised over their units.
    pub layer_norm: bool,
    /// How the two critics' values become one.
    pub critics: Critics,
    /// How far a critic may move from its target before its loss stops following; without it freely.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value_clip: Option<f64>,
    /// Critics give a distribution of values in place of one; without it one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub categories: Option<Categories>,
    /// How far the target critics move toward the critics at a time; 1 copies them.
    pub target_rate: f64,
    /// Updates from one such move to the next.
    pub target_every: usize,
    /// How far the policy that is kept moves toward the actor in each update.
    pub average_rate: f64,
    /// The entropy beside the reward.
    pub entropy: Entropy,
}

/// How the two critics' values become one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Critics {
    /// Their average.
    Average,
    /// The lower of the two.
    Lowest,
}

/// Values as a histogram of evenly spaced categories.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Categories {
    /// Their number.
    pub count: usize,
    /// Value of the first, in scaled rewards.
    pub low: f64,
    /// Value of the last.
    pub high: f64,
}

/// The entropy beside the reward.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entropy {
    /// The critics' target counts the entropy of what follows; otherwise the actor alone does.
    pub in_target: bool,
    /// Entropy that the weight is led to, as a share of the most that there can be; without it the weight stays.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
    /// Weight of the entropy, at the beginning or for good.
    pub weight: f64,
    /// Adam's learning rate of the weight's logarithm.
    pub rate: f64,
}

impl Config {
    /// Reads a training file. Everything that can be wrong with it is found here, with its key.
    pub fn read(path: &Path) -> Result<Config, Error> {
        let (reader, config) = Reader::read::<Config>(path)?;
        config.check(&reader)?;
        Ok(config)
    }

    /// Reads a training file with some of its keys set to other values, each `KEY=VALUE`.
    pub fn read_with(path: &Path, settings: &[String]) -> Result<Config, Error> {
        if settings.is_empty() {
            return Config::read(path);
        }
        let (_, mut table) = Reader::read::<toml::Table>(path)?;
        set::set(&mut table, settings)?;
        let origin = format!("{} with --set {}", path.display(), settings.join(" --set "));
        let reader = Reader::of(Path::new(&origin));
        let config: Config = table.try_into().map_err(|error: toml::de::Error| Error::Contents {
            file: origin.clone().into(),
            message: error.to_string().trim().to_owned(),
        })?;
        config.check(&reader)?;
        Ok(config)
    }

    /// What the command line says in place of the file.
    pub fn override_with(&mut self, seed: Option<u32>, minutes: Option<f64>, steps: Option<u64>, envs: Option<usize>) -> Result<(), Error> {
        self.seed = seed.unwrap_or(self.seed);
        self.n_envs = envs.unwrap_or(self.n_envs);
        if minutes.is_some() || steps.is_some() {
            (self.minutes, self.steps) = (minutes, steps);
        }
        // What the file says has been checked: where something is wrong, it is these.
        let flags = [
            minutes.map(|minutes| format!("--minutes {minutes}")),
            steps.map(|steps| format!("--steps {steps}")),
            envs.map(|envs| format!("--envs {envs}")),
        ];
        self.check(&Reader::of(Path::new(&flags.into_iter().flatten().collect::<Vec<_>>().join(" "))))
    }

    /// Whether a run with this config can go on where one with the other left off: they differ in their budget and checkpoints at most.
    pub fn is_same_run(&self, other: &Config) -> bool {
        let Config { minutes, steps, checkpoint_minutes, .. } = *self;
        *self == Config { minutes, steps, checkpoint_minutes, ..other.clone() }
    }

    /// The file that this config would be read from.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("numbers, words and lists of numbers can all be written as TOML")
    }

    fn check(&self, reader: &Reader) -> Result<(), Error> {
        let Config { memory, learning, .. } = self;
        reader.count("n_envs", self.n_envs, 1..=1 << 20)?;
        if let Some(minutes) = self.minutes {
            reader.within("minutes", minutes, 0.01..=100_000.0, "min")?;
        }
        if let Some(steps) = self.steps {
            reader.within("steps", steps as f64, 1.0..=1e12, "")?;
        }
        if self.minutes.is_none() && self.steps.is_none() {
            return Err(reader.invalid("minutes", "missing", "`minutes`, `steps` or both must say when to stop").into());
        }
        reader.within("checkpoint_minutes", self.checkpoint_minutes, 1e-4..=100_000.0, "min")?;
        reader.count("memory.capacity", memory.capacity, 1_000..=100_000_000)?;
        reader.count("memory.warmup", memory.warmup, 1..=memory.capacity)?;
        if let Some(priority) = memory.priority {
            reader.within("memory.priority.exponent", priority.exponent, 0.0..=1.0, "")?;
            reader.within("memory.priority.correction", priority.correction, 0.0..=1.0, "")?;
        }
        if let Some(exploration) = &self.exploration {
            reader.within("exploration.first", exploration.first, 0.0..=1.0, "")?;
            reader.within("exploration.last", exploration.last, 0.0..=1.0, "")?;
            reader.within("exploration.steps", exploration.steps as f64, 1.0..=1e12, "")?;
            reader.within("exploration.spread", exploration.spread, 0.0..=100.0, "")?;
        }
        reader.count("learning.hidden", learning.hidden.len(), 1..=8)?;
        for (index, &size) in learning.hidden.iter().enumerate() {
            reader.count(&format!("learning.hidden[{index}]"), size, 1..=8192)?;
        }
        reader.count("learning.batch", learning.batch, 2..=1 << 20)?;
        reader.count("learning.updates_per_step", learning.updates_per_step, 1..=1000)?;
        reader.count("learning.n_steps", learning.n_steps, 1..=100)?;
        // A ring of fewer slots than that would hold no step that enough others follow.
        let slots = memory.capacity / self.n_envs;
        if slots <= learning.n_steps {
            let expected = format!("must hold more than learning.n_steps = {} steps of n_envs = {} trucks", learning.n_steps, self.n_envs);
            return Err(reader.invalid("memory.capacity", memory.capacity, expected).into());
        }
        reader.within("learning.discount", learning.discount, 0.0..=1.0, "")?;
        reader.within("learning.reward_scale", learning.reward_scale, 1e-6..=1e6, "")?;
        reader.within("learning.observation_noise", learning.observation_noise, 0.0..=10.0, "")?;
        reader.within("learning.actor_rate", learning.actor_rate, 1e-8..=1.0, "")?;
        reader.within("learning.critic_rate", learning.critic_rate, 1e-8..=1.0, "")?;
        reader.within("learning.last_rate", learning.last_rate, 0.0..=1.0, "")?;
        if let Some(clip) = learning.value_clip {
            reader.within("learning.value_clip", clip, 1e-6..=1e6, "")?;
        }
        if let Some(Categories { count, low, high }) = learning.categories {
            reader.count("learning.categories.count", count, 2..=1001)?;
            reader.within("learning.categories.low", low, -1e6..=1e6, "")?;
            reader.within("learning.categories.high", high, -1e6..=1e6, "")?;
            if high <= low {
                return Err(reader
                    .invalid("learning.categories.high", high, format!("must be above learning.categories.low = {low}"))
                    .into());
            }
            if learning.value_clip.is_some() {
                let expected = "has no meaning beside learning.categories: leave one of them out";
                return Err(reader.invalid("learning.value_clip", "given", expected).into());
            }
        }
        if learning.categories.is_some() && learning.critics == Critics::Lowest {
            let expected = "is for single values: beside learning.categories \"average\" is needed, for histograms are averaged";
            return Err(reader.invalid("learning.critics", "\"lowest\"", expected).into());
        }
        if self.device == Device::Gpu {
            let without = [
                ("exploration", self.exploration.is_some()),
                ("memory.priority", memory.priority.is_some()),
                ("learning.categories", learning.categories.is_some()),
            ];
            if let Some((key, _)) = without.into_iter().find(|(_, given)| *given) {
                return Err(reader.invalid(key, "given", "is not there with device = \"gpu\": leave one of them out").into());
            }
        }
        reader.within("learning.target_rate", learning.target_rate, 1e-6..=1.0, "")?;
        reader.count("learning.target_every", learning.target_every, 1..=1_000_000)?;
        reader.within("learning.average_rate", learning.average_rate, 1e-6..=1.0, "")?;
        if let Some(share) = learning.entropy.share {
            reader.within("learning.entropy.share", share, 0.0..=1.0, "")?;
        }
        reader.within("learning.entropy.weight", learning.entropy.weight, 1e-9..=1e3, "")?;
        reader.within("learning.entropy.rate", learning.entropy.rate, 1e-8..=1.0, "")?;
        Ok(())
    }
}

#[cfg(test)]
mod tests;
