//! Losses of a shard and their gradients, by the chain rule written out: see [`crate::pass`].
//!
//! Recording every operation for automatic differentiation, and as many small tensors, would take longer than the
//! products. A test compares the gradients with the tensor library's own.

use burn::optim::GradientsParams;
use burn::tensor::{Tensor, TensorData};

use super::{Figures, Sac, Transitions};
use crate::config::Critics;
use crate::pass::{Pass, matrix, row_of, softmax};

/// One shard's part of an update.
pub(super) struct ShardGradients {
    pub(super) figures: Figures,
    /// Absolute TD error of each transition, `[B, 1]`.
    pub(super) td_errors: Tensor<2>,
    pub(super) critics: GradientsParams,
    pub(super) actor: GradientsParams,
}

impl Sac {
    /// Losses of one shard and their gradients. They count for `fraction` of the batch.
    pub(super) fn gradients(&self, shard: Transitions, fraction: f32) -> ShardGradients {
        let alpha = self.entropy_coefficient.value();
        let (actor, critics) = (&self.actor, &self.critics);
        let [reward, discount, weight] = [shard.reward, shard.discount, shard.weight].map(numbers);
        let action = shard.action.into_data();
        let action: &[i32] = action.as_slice().expect("actions are made of i32 values");
        let n_rows = action.len();
        let n_actions = actor.layers.last().map_or(0, |layer| layer.weight.dims()[1]);
        let combined = |[first, second]: [&[f32]; 2]| -> Vec<f32> {
            let both = first.iter().zip(second);
            match self.learning.critics {
                Critics::Mean => both.map(|(first, second)| 0.5 * (first + second)).collect(),
                Critics::Minimum => both.map(|(first, second)| first.min(*second)).collect(),
            }
        };

        // TD target: the soft value of the next observation is an expectation over the policy's actions.
        let next = [actor, &self.target_critics.first, &self.target_critics.second]
            .map(|network| Pass::forward(network, shard.next_observation.clone()).output);
        let next_q = combined([&next[1], &next[2]]);
        let target: Vec<f32> = (0..n_rows)
            .map(|row| {
                let (probs, log_probs) = softmax(row_of(&next[0], row, n_actions));
                let alpha = if self.learning.entropy.in_target { alpha } else { 0.0 };
                let actions = probs.iter().zip(log_probs).zip(row_of(&next_q, row, n_actions));
                let value: f32 = actions.map(|((prob, log_prob), q)| prob * (q - alpha * log_prob)).sum();
                reward[row] + discount[row] * value
            })
            .collect();

        // Critics: squared TD error of the action taken.
        let passes = [&critics.first, &critics.second].map(|critic| Pass::forward(critic, shard.observation.clone()));
        let q = combined([&passes[0].output, &passes[1].output]);
        let scale = fraction / n_rows as f32;
        let taken = |row: usize| row * n_actions + action[row] as usize;
        let value: Vec<f32> =
            (0..n_rows).map(|row| 0.5 * (passes[0].output[taken(row)] + passes[1].output[taken(row)])).collect();
        let td_errors = value.iter().zip(&target).map(|(value, target)| (value - target).abs()).collect();
        let mut critic_loss = 0.0;
        let mut of_critics = GradientsParams::new();
        for (critic, pass) in [&critics.first, &critics.second].into_iter().zip(passes) {
            let mut by_output = vec![0.0; pass.output.len()];
            for row in 0..n_rows {
                let error = pass.output[taken(row)] - target[row];
                critic_loss += scale * weight[row] * error * error;
                by_output[taken(row)] = 2.0 * scale * weight[row] * error;
            }
            pass.backward(critic, by_output, &mut of_critics);
        }

        // Actor: the critics' values and some entropy. The values are constants here.
        let pass = Pass::forward(actor, shard.observation);
        let (mut actor_loss, mut entropy) = (0.0, 0.0);
        let mut by_output = Vec::with_capacity(pass.output.len());
        for row in 0..n_rows {
            let (probs, log_probs) = softmax(row_of(&pass.output, row, n_actions));
            let cost: Vec<f32> =
                log_probs.iter().zip(row_of(&q, row, n_actions)).map(|(log_prob, q)| alpha * log_prob - q).collect();
            let mean: f32 = probs.iter().zip(&cost).map(|(prob, cost)| prob * cost).sum();
            actor_loss += scale * mean;
            entropy -= scale * probs.iter().zip(&log_probs).map(|(prob, log_prob)| prob * log_prob).sum::<f32>();
            // The derivative of the entropy coefficient's term by the logarithms sums to 0.
            by_output.extend(probs.iter().zip(&cost).map(|(prob, cost)| scale * prob * (cost - mean)));
        }
        let mut of_actor = GradientsParams::new();
        pass.backward(actor, by_output, &mut of_actor);

        let value = scale * value.iter().sum::<f32>();
        ShardGradients {
            figures: [critic_loss, actor_loss, entropy, value],
            td_errors: matrix(TensorData::new(td_errors, [n_rows, 1])),
            critics: of_critics,
            actor: of_actor,
        }
    }
}

fn numbers(tensor: Tensor<2>) -> Vec<f32> {
    tensor.into_data().try_into_vec().expect("transitions are made of f32 values")
}
