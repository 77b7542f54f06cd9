//! Soft actor-critic over a discrete action table, in the order of P. Christodoulou, "Soft Actor-Critic for Discrete
//! Action Settings" (2019).
//!
//! One learner for the processor and for a graphics device. Only three parts differ: on the processor a batch is
//! learned in shards, one thread each, with gradients by the chain rule written out, Adam is one fused pass, and single
//! numbers are plain; on a device gradients and Adam are tensor operations, and an update waits for nothing. The number
//! of shards does not depend on the machine, so neither does the result.

mod critics;
mod entropy;
mod gradients;
mod scalar;
mod state;

use std::mem::take;

use burn::module::Module;
use burn::tensor::{Device, Int, Tensor};
use rand::SeedableRng;
use rand::rngs::SmallRng;

use crate::adam::Adam;
use crate::config::Learning;
use crate::error::Error;
use crate::network::Mlp;
use crate::shards::{N_SHARDS, Shards};
use critics::Twins;
use entropy::EntropyCoefficient;
use scalar::Scalar;

/// Where a learner's tensors are.
#[derive(Debug, Clone)]
pub enum Placement {
    /// Tensors in the processor's memory.
    Host,
    /// Tensors in the memory of this graphics device.
    Device(Device),
}

impl Placement {
    /// The device for tensors without gradients.
    pub fn plain(&self) -> Device {
        match self {
            Placement::Host => Device::flex(),
            Placement::Device(device) => device.clone(),
        }
    }

    /// For the networks that learn. On a device the tensor library differentiates. On the host it must not record them:
    /// their gradients are written out, and every update would leave its parameters in a graph that nothing frees.
    fn learning(&self) -> Device {
        match self {
            Placement::Host => self.plain(),
            Placement::Device(device) => device.clone().autodiff(),
        }
    }

    fn on_host(&self) -> bool {
        matches!(self, Placement::Host)
    }

    fn scalar(&self, value: f32) -> Scalar {
        match self {
            Placement::Host => Scalar::Host(value),
            Placement::Device(device) => Scalar::Device(Box::new(Tensor::full([1, 1], value, device))),
        }
    }
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

/// The figures of [`Update`], in its order, where the learner is.
type Figures = [Scalar; 4];

/// The learner: networks, optimizers, and the entropy coefficient.
pub struct Sac {
    learning: Learning,
    placement: Placement,
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
    pub fn new(
        learning: &Learning,
        n_values: usize,
        n_actions: usize,
        seed: u64,
        placement: Placement,
    ) -> Result<Sac, Error> {
        let device = placement.learning();
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
            target_critics: critics.valid(),
            actor_ema: actor.valid(),
            actor_optimizer: Adam::new(placement.on_host()),
            critic_optimizer: Adam::new(placement.on_host()),
            entropy_coefficient: EntropyCoefficient::new(&learning.entropy, n_actions, |value| placement.scalar(value)),
            n_updates: 0,
            shards: Shards::new(if placement.on_host() { N_SHARDS } else { 0 })?,
            sums: [0.0; 4].map(|zero| placement.scalar(zero)),
            n_summed: 0,
            learning: learning.clone(),
            actor,
            critics,
            placement,
        })
    }

    /// Goes on with this actor, and makes it the policy. It must have the layers of the learner's own.
    pub fn set_actor(&mut self, actor: &Mlp) {
        let parameters = || actor.parameters().into_iter().map(|(_, values)| values).collect();
        self.actor = self.actor.with_parameters(parameters(), &self.placement.learning());
        self.actor_ema = self.actor_ema.with_parameters(parameters(), &self.placement.plain());
    }

    /// The actor, without gradients.
    pub fn actor(&self) -> Mlp {
        self.actor.valid()
    }

    /// The EMA of the actor over its latest updates, in the processor's memory: the policy. Waits for a device.
    pub fn actor_ema(&self) -> Mlp {
        match &self.placement {
            Placement::Host => self.actor_ema.clone(),
            Placement::Device(_) => self.actor_ema.on(&Device::flex()),
        }
    }

    /// The entropy coefficient. Waits for a device.
    pub fn entropy_coefficient(&self) -> f32 {
        self.entropy_coefficient.value().read()
    }

    /// One gradient step of critics, actor and entropy coefficient on the batch that the shards make up. Learning rates
    /// are multiplied by `rate_factor`. Returns the absolute TD error of each transition, `[B, 1]` a shard.
    pub fn update(&mut self, shards: Vec<Transitions>, rate_factor: f64) -> Vec<Tensor<2>> {
        let n_rows: usize = shards.iter().map(|shard| shard.observation.dims()[0]).sum();
        let gradients = self.shards.map(shards, |shard| {
            let fraction = shard.observation.dims()[0] as f32 / n_rows as f32;
            self.gradients(shard, fraction)
        });
        let mut figures: Option<Figures> = None;
        let [mut critic_gradients, mut actor_gradients] = [Vec::new(), Vec::new()];
        let mut td_errors = Vec::new();
        for shard in gradients {
            figures = Some(figures.map_or(shard.figures.clone(), |sums| added(&sums, &shard.figures)));
            critic_gradients.push(shard.critics);
            actor_gradients.push(shard.actor);
            td_errors.push(shard.td_errors);
        }
        let Some(figures) = figures else { return td_errors };

        self.n_updates += 1;
        let Learning { critic_learning_rate, actor_learning_rate, tau, target_interval, actor_ema_rate, .. } =
            self.learning;
        let tau = if self.n_updates.is_multiple_of(target_interval as u64) { tau } else { 0.0 };
        let [critics, target] = [&mut self.critics, &mut self.target_critics].map(take);
        (self.critics, self.target_critics) =
            self.critic_optimizer.step(critics, target, critic_gradients, critic_learning_rate * rate_factor, tau);
        // Until the critics know the policy its rates are 0. It is stepped nevertheless: its leaves must be new ones in
        // each update, or the graph of every update stays in memory.
        let is_learning = self.learning.actor_delay < self.n_updates;
        let (rate, ema_rate) =
            if is_learning { (actor_learning_rate * rate_factor, actor_ema_rate) } else { (0.0, 0.0) };
        let [actor, ema] = [&mut self.actor, &mut self.actor_ema].map(take);
        (self.actor, self.actor_ema) = self.actor_optimizer.step(actor, ema, actor_gradients, rate, ema_rate);
        if is_learning {
            self.entropy_coefficient.update(&figures[2]);
        }

        self.sums = added(&self.sums, &figures);
        self.n_summed += 1;
        td_errors
    }

    /// Figures of the updates since this was last called, summed, and the number of those updates. Waits for a device.
    pub fn take_sums(&mut self) -> (Update, u64) {
        let zeros = [0.0; 4].map(|zero| self.placement.scalar(zero));
        let sums = std::mem::replace(&mut self.sums, zeros).map(|sum| sum.read());
        (update(sums), take(&mut self.n_summed))
    }

    /// The first of the latest figures that is not finite, with its name; none where they are not at hand.
    pub fn diverged(&self) -> Option<(&'static str, f32)> {
        let [critic_loss, actor_loss, entropy, value] =
            [0, 1, 2, 3].map(|n: usize| self.sums[n].known().unwrap_or_default());
        not_finite(&Update { critic_loss, actor_loss, entropy, value })
    }
}

/// The first figure that is not finite, with its name.
pub fn not_finite(update: &Update) -> Option<(&'static str, f32)> {
    let figures = [("critic loss", update.critic_loss), ("actor loss", update.actor_loss), ("entropy", update.entropy)];
    figures.into_iter().find(|(_, value)| !value.is_finite())
}

fn added(sums: &Figures, figures: &Figures) -> Figures {
    std::array::from_fn(|n| sums[n].plus(&figures[n]))
}

fn update([critic_loss, actor_loss, entropy, value]: [f32; 4]) -> Update {
    Update { critic_loss, actor_loss, entropy, value }
}

#[cfg(test)]
mod device_tests;
#[cfg(test)]
mod tests;
