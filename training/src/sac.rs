//! Soft actor-critic over a discrete action table, in the order of P. Christodoulou, "Soft Actor-Critic for Discrete Action Settings" (2019).
//!
//! A batch arrives in parts, one a thread: each part works out its gradients alone, and their sum makes one step. The number of parts
//! never depends on the machine, so neither does the result.

mod adam;
mod entropy;

use std::mem::take;

use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::{Device, Int, Tensor};
use rand::SeedableRng;
use rand::rngs::SmallRng;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::config::{Critics, Learning};
use crate::network::{Mlp, distribution};
use adam::Adam;
use entropy::EntropyWeight;

/// Parts that a batch is learned in. Two: their gradients' sum is the same in either order, and the optimizer promises none.
pub const N_PARTS: usize = 2;

/// Some rows of a batch, as tensors without gradients. B is the number of rows.
#[derive(Debug)]
pub struct Transitions {
    /// What the action was chosen for, `[B, values]`.
    pub observation: Tensor<2>,
    /// The action, `[B, 1]`.
    pub action: Tensor<2, Int>,
    /// Sum of rewards on the way, `[B, 1]`.
    pub reward: Tensor<2>,
    /// Weight of the value of what follows, 0 where the task was over, `[B, 1]`.
    pub discount: Tensor<2>,
    /// What it led to, `[B, values]`.
    pub next_observation: Tensor<2>,
}

/// What an update came to, averaged over its batch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Update {
    /// Squared error of the two critics, summed.
    pub critic_loss: f32,
    /// Weighted negative entropy minus value: what the actor minimises.
    pub actor_loss: f32,
    /// Entropy of the policy [nat].
    pub entropy: f32,
    /// Value of the actions taken, by the critics' average.
    pub value: f32,
}

/// Two critics that read alike, begin apart and err apart.
#[derive(Module, Debug, Default)]
struct Twins {
    first: Mlp,
    second: Mlp,
}

impl Twins {
    /// Value of every action by each critic, `[B, A]` twice.
    fn values(&self, observation: Tensor<2>) -> [Tensor<2>; 2] {
        [self.first.forward(observation.clone()), self.second.forward(observation)]
    }
}

/// The learner: actor, critics, and all that an update moves.
pub struct Sac {
    learning: Learning,
    actor: Mlp,
    critics: Twins,
    target: Twins,
    average: Mlp,
    actor_optimizer: Adam,
    critic_optimizer: Adam,
    entropy_weight: EntropyWeight,
    updates: u64,
    pools: Vec<ThreadPool>,
}

impl Sac {
    /// A learner that knows nothing yet: its policy is close to chance.
    pub fn new(learning: &Learning, n_values: usize, n_actions: usize, seed: u64) -> Result<Sac, ThreadPoolBuildError> {
        let device = Device::flex().autodiff();
        let rng = &mut SmallRng::seed_from_u64(seed);
        let sizes: Vec<usize> = [n_values].into_iter().chain(learning.hidden.iter().copied()).chain([n_actions]).collect();
        let actor = Mlp::new(&sizes, 0.01, rng, &device);
        let critics = Twins { first: Mlp::new(&sizes, 0.1, rng, &device), second: Mlp::new(&sizes, 0.1, rng, &device) };
        let pools: Result<_, _> = (0..N_PARTS).map(|_| ThreadPoolBuilder::new().num_threads(1).build()).collect();
        Ok(Sac {
            target: critics.valid(),
            average: actor.valid(),
            actor_optimizer: Adam::default(),
            critic_optimizer: Adam::default(),
            entropy_weight: EntropyWeight::new(&learning.entropy, n_actions),
            updates: 0,
            pools: pools?,
            learning: learning.clone(),
            actor,
            critics,
        })
    }

    /// The actor as it acts now, without gradients.
    pub fn actor(&self) -> Mlp {
        self.actor.valid()
    }

    /// Running average of the actor over its latest updates: steadier than any one of them.
    pub fn average_actor(&self) -> &Mlp {
        &self.average
    }

    /// Weight of the entropy beside the reward.
    pub fn entropy_weight(&self) -> f32 {
        self.entropy_weight.value()
    }

    /// One gradient step of critics, actor and entropy weight on the batch that the parts make up, with learning rates times `pace`.
    pub fn update(&mut self, parts: Vec<Transitions>, pace: f64) -> Update {
        let n_rows: usize = parts.iter().map(|part| part.observation.dims()[0]).sum();
        let shares = on_pools(&self.pools, parts, |part| {
            let share = part.observation.dims()[0] as f32 / n_rows as f32;
            self.gradients(part, share)
        });
        let mut update = Update::default();
        let [mut critic_gradients, mut actor_gradients] = [Vec::new(), Vec::new()];
        for share in shares {
            update.critic_loss += share.update.critic_loss;
            update.actor_loss += share.update.actor_loss;
            update.entropy += share.update.entropy;
            update.value += share.update.value;
            critic_gradients.push(share.critics);
            actor_gradients.push(share.actor);
        }
        self.updates += 1;
        let [critic_rate, actor_rate] = [self.learning.critic_rate, self.learning.actor_rate].map(|rate| rate * pace);
        let target_rate = if self.updates.is_multiple_of(self.learning.target_every as u64) { self.learning.target_rate } else { 0.0 };
        let [critics, target] = [&mut self.critics, &mut self.target].map(take);
        (self.critics, self.target) = self.critic_optimizer.step(critics, target, critic_gradients, critic_rate, target_rate);
        let [actor, average] = [&mut self.actor, &mut self.average].map(take);
        (self.actor, self.average) = self.actor_optimizer.step(actor, average, actor_gradients, actor_rate, self.learning.average_rate);
        self.entropy_weight.update(update.entropy);
        update
    }

    /// One part's gradients; its losses count for `share` of the batch's.
    fn gradients(&self, part: Transitions, share: f32) -> Share {
        let alpha = self.entropy_weight.value();
        // Leaves of its own for every thread: two backward passes over shared ones wait for each other for ever.
        let device = Device::flex().autodiff();
        let actor = self.actor.clone().fork(&device);
        let critics = self.critics.clone().fork(&device);

        // Soft value of what follows: expectation over actions.
        let (probs, log_probs) = distribution(self.actor.valid().forward(part.next_observation.clone())); // [B, A] each
        let q = self.one_value(self.target.values(part.next_observation)); // [B, A]
        let value = (probs * (q - log_probs.mul_scalar(alpha))).sum_dim(1); // [B, 1]
        let target = part.reward + part.discount * value; // [B, 1]

        // Each critic learns the value of the action that was taken.
        let [first, second] = critics.values(part.observation.clone().autodiff()); // [B, A] each
        let taken = |q: &Tensor<2>| q.clone().gather(1, part.action.clone().autodiff()); // [B, 1]
        let error = |q: &Tensor<2>| (taken(q) - target.clone().autodiff()).square().mean();
        let critic_loss = (error(&first) + error(&second)).mul_scalar(share); // [1]

        // The actor learns what the critics hold for best, and to keep some entropy. Their values are constants here.
        let values = [first, second].map(Tensor::inner); // [B, A] each
        let taken_value = values.iter().map(|q| q.clone().gather(1, part.action.clone()).mean().into_scalar::<f32>()).sum::<f32>();
        let q = self.one_value(values).autodiff(); // [B, A]
        let (probs, log_probs) = distribution(actor.forward(part.observation.autodiff())); // [B, A] each
        let entropy = (probs.clone() * log_probs.clone()).inner().sum_dim(1).mean().into_scalar::<f32>();
        let actor_loss = (probs * (log_probs.mul_scalar(alpha) - q)).sum_dim(1).mean().mul_scalar(share); // [1]

        Share {
            update: Update {
                critic_loss: critic_loss.clone().inner().into_scalar(),
                actor_loss: actor_loss.clone().inner().into_scalar(),
                entropy: -entropy * share,
                value: 0.5 * taken_value * share,
            },
            critics: GradientsParams::from_grads(critic_loss.backward(), &critics),
            actor: GradientsParams::from_grads(actor_loss.backward(), &actor),
        }
    }

    /// The two critics' values `[B, A]` as one, `[B, A]`.
    fn one_value(&self, [first, second]: [Tensor<2>; 2]) -> Tensor<2> {
        match self.learning.critics {
            Critics::Average => (first + second).mul_scalar(0.5),
            Critics::Lowest => first.min_pair(second),
        }
    }
}

/// What one part adds to an update.
struct Share {
    update: Update,
    critics: GradientsParams,
    actor: GradientsParams,
}

/// Does `work` to each part, each on a pool of one thread: the tensor library would otherwise share out single small products, which costs
/// more than it gains.
fn on_pools<I: Send, O: Send>(pools: &[ThreadPool], parts: Vec<I>, work: impl Fn(I) -> O + Sync) -> Vec<O> {
    let mut done: Vec<Option<O>> = parts.iter().map(|_| None).collect();
    let mut jobs: Vec<_> = pools.iter().zip(parts).zip(&mut done).map(|((pool, part), done)| (pool, part, done)).collect();
    in_turn(&mut jobs.drain(..), &work);
    done.into_iter().flatten().collect()
}

/// Starts the first job, then all others, then waits.
fn in_turn<'a, I: Send + 'a, O: Send + 'a>(
    jobs: &mut impl Iterator<Item = (&'a ThreadPool, I, &'a mut Option<O>)>,
    work: &(impl Fn(I) -> O + Sync),
) {
    let Some((pool, part, done)) = jobs.next() else { return };
    pool.in_place_scope(|scope| {
        scope.spawn(|_| *done = Some(work(part)));
        in_turn(jobs, work);
    });
}

#[cfg(test)]
mod tests;
