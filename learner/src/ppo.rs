//! Proximal policy optimisation over a discrete action table, in the order of J. Schulman and others, "Proximal Policy
//! Optimization Algorithms" (2017): it refines a policy that soft actor-critic found.
//!
//! The critics of soft actor-critic learn from every transition that is held, and rank single actions inexactly. Here
//! an action is judged by the episode that followed it under the same policy, and every step is thrown away after a few
//! passes: that takes many steps, of which a batched simulator has enough. It is on the processor alone.

pub mod steps;
mod state;
#[cfg(test)]
mod tests;

use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor, TensorData};
use rand::rngs::SmallRng;
use rand::seq::SliceRandom;
use rand::{RngCore, SeedableRng};

use super::adam::Adam;
use super::config::Refinement;
use super::error::Error;
use super::generator::Generator;
use super::network::Mlp;
use super::pass::{Pass, matrix, row_of, softmax};
use super::sac::Update;
use super::shards::{N_SHARDS, Shards};
use steps::Steps;

/// Rows that the value network judges at a time.
const BLOCK: usize = 4096;

/// The learner: the actor that is refined, a network of the values of observations, and their optimizers.
pub struct Ppo {
    settings: Refinement,
    actor: Mlp,
    actor_ema: Mlp,
    critic: Mlp,
    actor_optimizer: Adam,
    critic_optimizer: Adam,
    shuffling: Generator,
    /// Iterations made: of steps, and updates from them.
    n_iterations: u64,
    shards: Shards,
    /// Figures of the updates since they were last taken, summed.
    sums: Update,
    n_summed: u64,
}

/// A step's part in an update.
struct Rows<'a> {
    steps: &'a Steps,
    advantage: &'a [f32],
    returned: &'a [f32],
    rows: &'a [usize],
}

/// One shard's part of an update.
struct ShardGradients {
    figures: Update,
    actor: GradientsParams,
    critic: GradientsParams,
}

impl Ppo {
    /// Goes on from this actor of one observation, with a network of values that knows nothing yet.
    pub fn new(settings: &Refinement, actor: &Mlp, seed: u64) -> Result<Ppo, Error> {
        let device = Device::flex();
        let rng = &mut SmallRng::seed_from_u64(seed);
        let actor = actor.times(settings.logit_factor as f32, &device).over_frames(settings.frames, &device);
        let mut sizes: Vec<usize> = actor.layers.iter().map(|layer| layer.weight.dims()[0]).collect();
        sizes.push(1);
        Ok(Ppo {
            settings: settings.clone(),
            critic: Mlp::new(&sizes, 0.1, rng, &device).with_layer_norm(),
            actor_ema: actor.on(&device),
            actor,
            actor_optimizer: Adam::default(),
            critic_optimizer: Adam::default(),
            shuffling: Generator::seed_from_u64(rng.next_u64()),
            n_iterations: 0,
            shards: Shards::new(N_SHARDS)?,
            sums: Update::default(),
            n_summed: 0,
        })
    }

    /// The actor, whose distribution the steps' actions are sampled from.
    pub fn actor(&self) -> &Mlp {
        &self.actor
    }

    /// The EMA of the actor over its latest updates: the policy.
    pub fn actor_ema(&self) -> &Mlp {
        &self.actor_ema
    }

    /// Updates from these steps, some epochs of them. Learning rates are multiplied by `rate_factor`. Returns the
    /// number of updates.
    pub fn learn(&mut self, steps: &Steps, rate_factor: f64) -> u64 {
        let (values, next_values) = (self.values(&steps.observation), self.values(&steps.next_observation));
        let Refinement { gamma, gae_lambda, batch, epochs, advantage_limit, .. } = self.settings;
        let (mut advantage, returned) = steps.advantages(&values, &next_values, gamma as f32, gae_lambda as f32);
        standardise(&mut advantage, advantage_limit);
        let mut rows: Vec<usize> = (0..advantage.len()).collect();
        let mut n_updates = 0;
        for _ in 0..epochs {
            rows.shuffle(&mut self.shuffling);
            for rows in rows.chunks(batch) {
                self.update(Rows { steps, advantage: &advantage, returned: &returned, rows }, rate_factor);
                n_updates += 1;
            }
        }
        self.n_iterations += 1;
        n_updates
    }

    /// One gradient step of actor and value network on some of the steps.
    fn update(&mut self, Rows { steps, advantage, returned, rows }: Rows, rate_factor: f64) {
        let n_rows = rows.len();
        let part = |index: usize| &rows[n_rows * index / N_SHARDS..n_rows * (index + 1) / N_SHARDS];
        // The last rows of an epoch may be fewer than the shards.
        let parts = (0..N_SHARDS).map(part).filter(|rows| !rows.is_empty());
        let parts: Vec<Rows> = parts.map(|rows| Rows { steps, advantage, returned, rows }).collect();
        let shards = self.shards.map(parts, |part| self.gradients(&part, 1.0 / n_rows as f32));
        let (mut of_actor, mut of_critic) = (Vec::new(), Vec::new());
        for ShardGradients { figures, actor, critic } in shards {
            self.sums = self.sums.plus(&figures);
            of_actor.push(actor);
            of_critic.push(critic);
        }
        self.n_summed += 1;
        let Refinement { actor_learning_rate, critic_learning_rate, actor_ema_rate, critic_iterations, .. } =
            self.settings;
        let critic = std::mem::take(&mut self.critic);
        (self.critic, _) =
            self.critic_optimizer.step(critic.clone(), critic, of_critic, critic_learning_rate * rate_factor, 0.0);
        if critic_iterations <= self.n_iterations {
            let (actor, ema) = (std::mem::take(&mut self.actor), std::mem::take(&mut self.actor_ema));
            (self.actor, self.actor_ema) =
                self.actor_optimizer.step(actor, ema, of_actor, actor_learning_rate * rate_factor, actor_ema_rate);
        }
    }

    /// Gradients of some rows' losses, each row counting for `scale`.
    fn gradients(&self, &Rows { steps, advantage, returned, rows }: &Rows, scale: f32) -> ShardGradients {
        let observation = steps.rows(rows);
        let Refinement { clip, entropy_coefficient, .. } = self.settings;
        let (clip, entropy_coefficient) = (clip as f32, entropy_coefficient as f32);
        let mut figures = Update::default();

        // Actor: the clipped surrogate objective and some entropy.
        let pass = Pass::forward(&self.actor, observation.clone());
        let n_actions = pass.output.len() / rows.len().max(1);
        let mut by_output = Vec::with_capacity(pass.output.len());
        for (index, &row) in rows.iter().enumerate() {
            let (probs, log_probs) = softmax(row_of(&pass.output, index, n_actions));
            let action = steps.action[row] as usize;
            let (ratio, advantage) = ((log_probs[action] - steps.log_prob[row]).exp(), advantage[row]);
            let limited = ratio.clamp(1.0 - clip, 1.0 + clip);
            figures.actor_loss -= scale * (ratio * advantage).min(limited * advantage);
            let entropy = -probs.iter().zip(&log_probs).map(|(prob, log_prob)| prob * log_prob).sum::<f32>();
            figures.entropy += scale * entropy;
            // Where the clipped term is the lower one, it has no slope.
            let slope = if ratio * advantage <= limited * advantage { ratio * advantage } else { 0.0 };
            by_output.extend(probs.iter().zip(&log_probs).enumerate().map(|(other, (prob, log_prob))| {
                let taken = if other == action { 1.0 } else { 0.0 };
                scale * (entropy_coefficient * prob * (log_prob + entropy) - slope * (taken - prob))
            }));
        }
        let mut actor = GradientsParams::new();
        pass.backward(&self.actor, by_output, &mut actor);

        // Value network: the squared error of what was returned.
        let pass = Pass::forward(&self.critic, observation);
        let mut by_output = Vec::with_capacity(pass.output.len());
        for (value, &row) in pass.output.iter().zip(rows) {
            let error = value - returned[row];
            figures.critic_loss += scale * error * error;
            figures.value += scale * value;
            by_output.push(2.0 * scale * error);
        }
        let mut critic = GradientsParams::new();
        pass.backward(&self.critic, by_output, &mut critic);
        ShardGradients { figures, actor, critic }
    }

    /// The value network's output for each normalised observation of `[rows * values]`, `(rows)`.
    fn values(&self, observations: &[f32]) -> Vec<f32> {
        let n_values = self.critic.layers[0].weight.dims()[0];
        let blocks: Vec<&[f32]> = observations.chunks(BLOCK * n_values).collect();
        let value = |block: &[f32]| {
            let data = TensorData::new(block.to_vec(), [block.len() / n_values, n_values]);
            let output: Tensor<2> = self.critic.forward(matrix(data));
            output.into_data().try_into_vec::<f32>().expect("the layers' weights are f32, and so is their output")
        };
        blocks.into_iter().flat_map(value).collect()
    }

    /// Figures of the updates since this was last called, summed, and the number of those updates.
    pub fn take_sums(&mut self) -> (Update, u64) {
        (std::mem::take(&mut self.sums), std::mem::take(&mut self.n_summed))
    }
}

/// Scales to mean 0 and standard deviation 1, then limits. A rare failure is worth many standard deviations, and a
/// batch that has one would learn nothing else.
fn standardise(values: &mut [f32], limit: f64) {
    let n = values.len().max(1) as f64;
    let mean = values.iter().map(|&value| f64::from(value)).sum::<f64>() / n;
    let variance = values.iter().map(|&value| (f64::from(value) - mean).powi(2)).sum::<f64>() / n;
    let factor = 1.0 / (variance.sqrt() + 1e-8);
    values.iter_mut().for_each(|value| *value = ((f64::from(*value) - mean) * factor).clamp(-limit, limit) as f32);
}
