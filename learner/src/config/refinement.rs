//! The last part of a run: its keys, and what can be wrong with them.

use offtrack::files::reader::Reader;
use offtrack::scenario::RewardChanges;
use offtrack_policy::{Frames, Padding};
use serde::{Deserialize, Serialize};

use crate::error::Error;

/// The last part of a run: proximal policy optimisation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Refinement {
    /// Fraction of the budget after which it begins.
    pub begin: f64,
    /// Factor of the logits that it begins with. The most probable action stays; above 1 others become rarer.
    #[serde(default = "logit_factor")]
    pub logit_factor: f64,
    /// Observations that the policy sees from here on, the newest among them; before an episode's first one that again.
    #[serde(default = "one_frame", skip_serializing_if = "is_one")]
    pub frames: usize,
    /// Steps of each truck that are learned from at a time.
    pub n_steps: usize,
    /// Passes over them.
    pub epochs: usize,
    /// Steps in an update.
    pub batch: usize,
    /// Discount factor.
    pub gamma: f64,
    /// Lambda of the generalised advantage estimates.
    pub gae_lambda: f64,
    /// How far the probability of an action may go from what it was, as a fraction, before an update gains nothing.
    pub clip: f64,
    /// Coefficient of the entropy beside the standardised advantages.
    pub entropy_coefficient: f64,
    /// Adam's learning rate of the actor at the beginning of the refinement.
    pub actor_learning_rate: f64,
    /// Adam's learning rate of the value network there.
    pub critic_learning_rate: f64,
    /// Fraction of the learning rates that is left at the end; the schedule is linear.
    pub final_learning_rate_fraction: f64,
    /// How far the EMA of the actor, which becomes the policy, moves toward the actor in each update.
    pub actor_ema_rate: f64,
    /// Most standard deviations that an advantage counts as.
    pub advantage_limit: f64,
    /// Iterations in which the value network alone learns.
    pub critic_iterations: u64,
    /// Power of the clearance term in the reward.
    pub clearance_power: f64,
    /// An episode that runs out of time has failed: it gets the reward of a failure, and has no value after its end.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub late_fails: bool,
    /// Other weights than those of the run so far in the reward.
    #[serde(default, skip_serializing_if = "RewardChanges::is_empty")]
    pub reward: RewardChanges,
}

fn logit_factor() -> f64 {
    1.0
}

fn one_frame() -> usize {
    1
}

fn is_one(frames: &usize) -> bool {
    *frames == 1
}

impl Refinement {
    /// What the policy sees from the refinement on.
    pub(crate) fn seen(&self) -> Frames {
        Frames { n: self.frames, padding: Padding::Reset }
    }

    /// The first key whose value makes no sense is an error.
    pub(super) fn check(&self, reader: &Reader) -> Result<(), Error> {
        reader.within("refinement.begin", self.begin, 0.0..=0.99, "")?;
        reader.within("refinement.logit_factor", self.logit_factor, 0.01..=100.0, "")?;
        reader.count("refinement.frames", self.frames, 1..=64)?;
        reader.count("refinement.n_steps", self.n_steps, 1..=10_000)?;
        reader.count("refinement.epochs", self.epochs, 1..=100)?;
        reader.count("refinement.batch", self.batch, 2..=1 << 20)?;
        reader.within("refinement.gamma", self.gamma, 0.0..=1.0, "")?;
        reader.within("refinement.gae_lambda", self.gae_lambda, 0.0..=1.0, "")?;
        reader.within("refinement.clip", self.clip, 0.001..=10.0, "")?;
        reader.within("refinement.advantage_limit", self.advantage_limit, 0.1..=1e6, "standard deviations")?;
        reader.within("refinement.entropy_coefficient", self.entropy_coefficient, 0.0..=1e3, "")?;
        reader.within("refinement.actor_learning_rate", self.actor_learning_rate, 1e-8..=1.0, "")?;
        reader.within("refinement.critic_learning_rate", self.critic_learning_rate, 1e-8..=1.0, "")?;
        reader.within("refinement.final_learning_rate_fraction", self.final_learning_rate_fraction, 0.0..=1.0, "")?;
        reader.within("refinement.actor_ema_rate", self.actor_ema_rate, 1e-6..=1.0, "")?;
        reader.within("refinement.critic_iterations", self.critic_iterations as f64, 0.0..=1e9, "iterations")?;
        reader.within("refinement.clearance_power", self.clearance_power, 0.1..=10.0, "")?;
        self.reward.check(reader, "refinement.reward")?;
        if let Some(apron) = self.reward.apron {
            let expected = "an apron weighs what it does in the run: set reward.apron";
            return Err(reader.invalid("refinement.reward.apron", apron, expected).into());
        }
        Ok(())
    }
}
