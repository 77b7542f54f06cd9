//! Soft actor-critic over a discrete action table, in the order of P. Christodoulou, "Soft Actor-Critic for Discrete
//! Action Settings" (2019).
//!
//! [`Sac`] learns on the processor: a batch in shards, one thread each, with gradients by the chain rule written out.
//! The number of shards does not depend on the machine, so neither does the result. On a graphics device the same
//! update is made by kernels of our own, see [`device`]. [`Learner`] is what the training loop asks of either.

mod critics;
#[cfg(feature = "gpu")]
pub mod device;
mod entropy;
mod gradients;
mod state;

use std::mem::take;

use burn::tensor::{Device, Int, Tensor};
use rand::SeedableRng;
use rand::rngs::SmallRng;

use crate::adam::Adam;
use crate::checkpoint::{Columns, Stored};
use crate::columns::first_broken;
use crate::config::Learning;
use crate::error::Error;
use crate::exchange::{Actor, Sample, TdErrors};
use crate::network::Mlp;
use crate::shards::{N_SHARDS, Shards};
use critics::Twins;
use entropy::EntropyCoefficient;

/// A learner, wherever it is: what its networks are, and an update.
pub trait Learner {
    /// Goes on with this actor, and makes it the policy. It must have the layers of the learner's own.
    fn set_actor(&mut self, actor: &Mlp);

    /// The actor, where the learner is.
    fn actor(&self) -> Actor;

    /// The EMA of the actor over its latest updates, in the processor's memory: the policy. Waits for a device.
    fn actor_ema(&self) -> Mlp;

    /// The entropy coefficient. Waits for a device.
    fn entropy_coefficient(&self) -> f32;

    /// One gradient step of critics, actor and entropy coefficient on a sample. Learning rates are multiplied by
    /// `rate_factor`. Returns the absolute TD error of each transition.
    fn update(&mut self, sample: Sample, rate_factor: f64) -> Result<TdErrors, Error>;

    /// Figures of the updates since this was last called, summed, and the number of those updates. Waits for a device.
    fn take_sums(&mut self) -> (Update, u64);

    /// The first of the latest figures that is not finite, with its name; none where they are not at hand.
    fn diverged(&self) -> Option<(&'static str, f32)>;

    /// The first of the learner's numbers that is not finite: its name and value. Waits for a device.
    fn broken(&self) -> Option<(String, f32)>;

    /// Adds the learner's columns. Waits for a device.
    fn save(&self, columns: &mut Columns);

    /// Continues from a learner of the same sizes.
    fn restore(&mut self, stored: &Stored) -> Result<(), Error>;
}

/// Some transitions as tensors without gradients. B is their number.
#[derive(Debug)]
pub struct Transitions {
    /// Observation that the action was chosen for, `[B, values]`.
    pub observation: Tensor<2>,
    /// Index of the action, `[B, 1]`.
    pub action: Tensor<2, Int>,
    /// n-step return without the value of the last observation, `[B, 1]`.
    pub reward: Tensor<2>,
    /// Discount of that value, gamma ^ n, and 0 where the episode terminated, `[B, 1]`.
    pub discount: Tensor<2>,
    /// Observation after the last step, `[B, values]`.
    pub next_observation: Tensor<2>,
    /// Importance-sampling weight in the critics' loss, `[B, 1]`.
    pub weight: Tensor<2>,
}

/// Losses and figures of an update, averaged over its batch; or sums of them over several updates.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Update {
    /// Squared TD errors of the two critics, weighted by importance, summed.
    pub critic_loss: f32,
    /// Entropy coefficient times negative entropy, minus value: what the actor minimises.
    pub actor_loss: f32,
    /// Entropy of the policy (nat).
    pub entropy: f32,
    /// Value of the actions taken, the mean of both critics.
    pub value: f32,
}

impl Update {
    /// Its values in the order of its fields.
    fn of([critic_loss, actor_loss, entropy, value]: Figures) -> Update {
        Update { critic_loss, actor_loss, entropy, value }
    }

    /// The sums of both.
    pub fn plus(&self, other: &Update) -> Update {
        Update {
            critic_loss: self.critic_loss + other.critic_loss,
            actor_loss: self.actor_loss + other.actor_loss,
            entropy: self.entropy + other.entropy,
            value: self.value + other.value,
        }
    }
}

/// The figures of [`Update`], in its order.
type Figures = [f32; 4];

/// The learner on the processor: networks, optimizers, and the entropy coefficient.
pub struct Sac {
    learning: Learning,
    actor: Mlp,
    critics: Twins,
    target_critics: Twins,
    actor_ema: Mlp,
    actor_optimizer: Adam,
    critic_optimizer: Adam,
    entropy_coefficient: EntropyCoefficient,
    n_updates: u64,
    shards: Shards,
    /// Figures of the updates since they were last taken, summed, and how many updates those are.
    sums: Figures,
    n_summed: u64,
}

impl Sac {
    /// A learner with random weights; its policy is close to uniform.
    pub fn new(learning: &Learning, n_values: usize, n_actions: usize, seed: u64) -> Result<Sac, Error> {
        // Gradients are written out: were operations recorded, every update would leave its parameters in a graph that
        // nothing frees.
        let device = Device::flex();
        let rng = &mut SmallRng::seed_from_u64(seed);
        let sizes: Vec<usize> =
            [n_values].into_iter().chain(learning.hidden.iter().copied()).chain([n_actions]).collect();
        let actor = Mlp::new(&sizes, 0.01, rng, &device);
        let mut critic = || {
            let plain = Mlp::new(&sizes, 0.1, rng, &device);
            if learning.layer_norm { plain.with_layer_norm() } else { plain }
        };
        let critics = Twins { first: critic(), second: critic() };
        Ok(Sac {
            target_critics: critics.clone(),
            actor_ema: actor.clone(),
            actor_optimizer: Adam::default(),
            critic_optimizer: Adam::default(),
            entropy_coefficient: EntropyCoefficient::new(&learning.entropy, n_actions),
            n_updates: 0,
            shards: Shards::new(N_SHARDS)?,
            sums: [0.0; 4],
            n_summed: 0,
            learning: learning.clone(),
            actor,
            critics,
        })
    }
}

impl Learner for Sac {
    fn set_actor(&mut self, actor: &Mlp) {
        let parameters = || actor.parameters().into_iter().map(|(_, values)| values).collect();
        self.actor = self.actor.with_parameters(parameters(), &Device::flex());
        self.actor_ema = self.actor_ema.with_parameters(parameters(), &Device::flex());
    }

    fn actor(&self) -> Actor {
        Actor::Host(self.actor.clone())
    }

    fn actor_ema(&self) -> Mlp {
        self.actor_ema.clone()
    }

    fn entropy_coefficient(&self) -> f32 {
        self.entropy_coefficient.value()
    }

    fn update(&mut self, sample: Sample, rate_factor: f64) -> Result<TdErrors, Error> {
        let shards = sample.on_host()?;
        let n_rows: usize = shards.iter().map(|shard| shard.observation.dims()[0]).sum();
        let gradients = self.shards.map(shards, |shard| {
            let fraction = shard.observation.dims()[0] as f32 / n_rows as f32;
            self.gradients(shard, fraction)
        });
        let mut figures: Option<Figures> = None;
        let [mut critic_gradients, mut actor_gradients] = [Vec::new(), Vec::new()];
        let mut td_errors = Vec::new();
        for shard in gradients {
            figures = Some(figures.map_or(shard.figures, |sums| added(&sums, &shard.figures)));
            critic_gradients.push(shard.critics);
            actor_gradients.push(shard.actor);
            td_errors.push(shard.td_errors);
        }
        let Some(figures) = figures else { return Ok(TdErrors::Host(td_errors)) };

        let Step { rates: [actor_rate, critic_rate], follow: [ema_rate, tau], is_learning } =
            Step::of(&self.learning, &mut self.n_updates, rate_factor);
        let [critics, target] = [&mut self.critics, &mut self.target_critics].map(take);
        (self.critics, self.target_critics) =
            self.critic_optimizer.step(critics, target, critic_gradients, critic_rate, tau);
        let [actor, ema] = [&mut self.actor, &mut self.actor_ema].map(take);
        (self.actor, self.actor_ema) = self.actor_optimizer.step(actor, ema, actor_gradients, actor_rate, ema_rate);
        if is_learning {
            self.entropy_coefficient.update(figures[2]);
        }

        self.sums = added(&self.sums, &figures);
        self.n_summed += 1;
        Ok(TdErrors::Host(td_errors))
    }

    fn take_sums(&mut self) -> (Update, u64) {
        (Update::of(take(&mut self.sums)), take(&mut self.n_summed))
    }

    fn diverged(&self) -> Option<(&'static str, f32)> {
        not_finite(&Update::of(self.sums))
    }

    fn broken(&self) -> Option<(String, f32)> {
        first_broken(self.numbers())
    }

    fn save(&self, columns: &mut Columns) {
        self.put(columns);
    }

    fn restore(&mut self, stored: &Stored) -> Result<(), Error> {
        self.take(stored)
    }
}

/// What an update does beside its gradients.
struct Step {
    /// Learning rates of the actor and of the critics.
    rates: [f64; 2],
    /// How far the actor's EMA and the target critics follow.
    follow: [f64; 2],
    /// Whether actor and entropy coefficient learn: until the critics know the policy they stay.
    is_learning: bool,
}

impl Step {
    /// That of the next update, which is counted.
    fn of(learning: &Learning, n_updates: &mut u64, rate_factor: f64) -> Step {
        *n_updates += 1;
        let tau = if n_updates.is_multiple_of(learning.target_interval as u64) { learning.tau } else { 0.0 };
        let is_learning = learning.actor_delay < *n_updates;
        let of_actor =
            if is_learning { [learning.actor_learning_rate * rate_factor, learning.actor_ema_rate] } else { [0.0; 2] };
        Step {
            rates: [of_actor[0], learning.critic_learning_rate * rate_factor],
            follow: [of_actor[1], tau],
            is_learning,
        }
    }
}

/// The first figure that is not finite, with its name.
pub fn not_finite(update: &Update) -> Option<(&'static str, f32)> {
    let figures = [
        ("critic loss", update.critic_loss),
        ("actor loss", update.actor_loss),
        ("entropy", update.entropy),
        ("value", update.value),
    ];
    figures.into_iter().find(|(_, value)| !value.is_finite())
}

fn added(sums: &Figures, figures: &Figures) -> Figures {
    std::array::from_fn(|n| sums[n] + figures[n])
}

#[cfg(test)]
mod device_tests;
#[cfg(test)]
mod tests;
