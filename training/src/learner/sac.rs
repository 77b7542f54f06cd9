//! Soft actor-critic over a discrete action table, in the order of P. Christodoulou, "Soft Actor-Critic for Discrete Action Settings" (2019).
//!
//! A batch arrives in parts, one a thread: each part works out its gradients alone, and their sum makes one step. The number of parts
//! never depends on the machine, so neither does the result.

mod adam;
mod critics;
#[cfg(feature = "gpu")]
pub mod device;
mod entropy;
mod losses;
mod state;

use std::mem::take;

use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::{Device, Int, Tensor};
use rand::SeedableRng;
use rand::rngs::SmallRng;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::learner::config::Learning;
use crate::learner::network::Mlp;
use adam::Adam;
use critics::{Reading, Twins};
use entropy::EntropyWeight;
use losses::{Losses, Networks, Weight, losses};

/// Parts that a batch is learned in: two, for the cores that the smallest machines have. Another number would round sums otherwise.
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
    /// Weight of the row in the critics' loss, `[B, 1]`.
    pub weight: Tensor<2>,
}

/// What an update came to, averaged over its batch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Update {
    /// Squared error of the two critics, summed; with categories the cross entropy.
    pub critic_loss: f32,
    /// Weighted negative entropy minus value: what the actor minimises.
    pub actor_loss: f32,
    /// Entropy of the policy [nat].
    pub entropy: f32,
    /// Value of the actions taken, by the critics' average.
    pub value: f32,
}

/// The learner: actor, critics, and all that an update moves.
pub struct Sac {
    learning: Learning,
    reading: Reading,
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
        let reading = Reading::new(learning, n_actions);
        let sizes =
            |n_outputs: usize| -> Vec<usize> { [n_values].into_iter().chain(learning.hidden.iter().copied()).chain([n_outputs]).collect() };
        let actor = Mlp::new(&sizes(n_actions), 0.01, rng, &device);
        let mut critic = || {
            let plain = Mlp::new(&sizes(reading.n_outputs()), 0.1, rng, &device);
            if learning.layer_norm { plain.normalised() } else { plain }
        };
        let critics = Twins { first: critic(), second: critic() };
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
            reading,
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

    /// One gradient step of critics, actor and entropy weight on the batch that the parts make up, with learning rates times `pace`. Gives
    /// also the error of each row, `[batch]`: how far the critics' average was from what they are to give.
    pub fn update(&mut self, parts: Vec<Transitions>, pace: f64) -> (Update, Vec<f32>) {
        let n_rows: usize = parts.iter().map(|part| part.observation.dims()[0]).sum();
        let shares = on_pools(&self.pools, parts, |part| {
            let share = part.observation.dims()[0] as f32 / n_rows as f32;
            self.gradients(part, share)
        });
        let mut update = Update::default();
        let mut errors = Vec::with_capacity(n_rows);
        let [mut critic_gradients, mut actor_gradients] = [Vec::new(), Vec::new()];
        for share in shares {
            update.critic_loss += share.update.critic_loss;
            update.actor_loss += share.update.actor_loss;
            update.entropy += share.update.entropy;
            update.value += share.update.value;
            errors.extend(share.errors);
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
        (update, errors)
    }

    /// One part's gradients; its losses count for `share` of the batch's.
    fn gradients(&self, part: Transitions, share: f32) -> Share {
        let alpha = self.entropy_weight.value();
        // Leaves of its own for every thread: two backward passes over shared ones wait for each other for ever.
        let device = Device::flex().autodiff();
        let actor = self.actor.clone().fork(&device);
        let critics = self.critics.clone().fork(&device);

        let networks = Networks { actor: &actor, critics: &critics, target: &self.target };
        let Losses { critic, actor: actor_loss, entropy, value, errors } =
            losses(&self.reading, self.learning.entropy.in_target, &networks, &Weight::Number(alpha), part);
        let (critic_loss, actor_loss) = (critic.mul_scalar(share), actor_loss.mul_scalar(share));

        Share {
            update: Update {
                critic_loss: critic_loss.clone().inner().into_scalar(),
                actor_loss: actor_loss.clone().inner().into_scalar(),
                entropy: entropy.into_scalar::<f32>() * share,
                value: value.into_scalar::<f32>() * share,
            },
            errors: errors.into_data().try_to_vec().expect("the critics' weights are f32, and so are their errors"),
            critics: GradientsParams::from_grads(critic_loss.backward(), &critics),
            actor: GradientsParams::from_grads(actor_loss.backward(), &actor),
        }
    }
}

/// What one part adds to an update.
struct Share {
    update: Update,
    errors: Vec<f32>,
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
