//! Gradients by the tensor library's automatic differentiation, for a learner on a device.

use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::Tensor;

use super::ShardGradients;
use crate::network::distribution;
use crate::sac::scalar::Scalar;
use crate::sac::{Sac, Transitions};

impl Sac {
    /// See [`Sac::gradients`]. `alpha` is the entropy coefficient, `[1, 1]`.
    pub(super) fn differentiated(&self, shard: Transitions, fraction: f32, alpha: &Tensor<2>) -> ShardGradients {
        let (actor, critics) = (&self.actor, &self.critics);
        let combined = |values| self.learning.critics.combined(values);

        // TD target: the soft value of the next observation is an expectation over the policy's actions.
        let logits = actor.valid().forward(shard.next_observation.clone()); // [B, A]
        let (next_probs, next_log_probs) = distribution(logits); // [B, A] each
        let next_q = combined(self.target_critics.forward(shard.next_observation)); // [B, A]
        let next_value = (next_probs.clone() * next_q).sum_dim(1); // [B, 1]
        let next_value = match self.learning.entropy.in_target {
            true => next_value + -((next_probs * next_log_probs).sum_dim(1) * alpha.clone()),
            false => next_value,
        };
        let target = shard.reward + shard.discount * next_value; // [B, 1]

        // Critics: squared TD error of the action taken.
        let q = critics.forward(shard.observation.clone().autodiff()); // [B, A] twice
        let [first, second] = q.clone().map(|q| q.gather(1, shard.action.clone().autodiff())); // [B, 1] each
        let [first_loss, second_loss] =
            [&first, &second].map(|taken| (taken.clone() - target.clone().autodiff()).square());
        let critic_loss = ((first_loss + second_loss) * shard.weight.autodiff()).mean();
        let value = (first.inner() + second.inner()).mul_scalar(0.5); // [B, 1]
        let td_errors = (value.clone() - target).abs(); // [B, 1]

        // Actor: the critics' values and some entropy. The values are constants here.
        let q = combined(q.map(Tensor::inner)).autodiff(); // [B, A]
        let (probs, log_probs) = distribution(actor.forward(shard.observation.autodiff())); // [B, A] each
        let entropy = -(probs.clone() * log_probs.clone()).inner().sum_dim(1).mean();
        let actor_loss = (probs * (log_probs * alpha.clone().autodiff() - q)).sum_dim(1).mean();

        let (critic_loss, actor_loss) = (critic_loss.mul_scalar(fraction), actor_loss.mul_scalar(fraction));
        let scalar = |tensor: Tensor<1>| Scalar::Device(Box::new(tensor.reshape([1, 1])));
        ShardGradients {
            figures: [
                scalar(critic_loss.clone().inner()),
                scalar(actor_loss.clone().inner()),
                scalar(entropy).times_number(fraction),
                scalar(value.mean()).times_number(fraction),
            ],
            td_errors,
            critics: GradientsParams::from_grads(critic_loss.backward(), critics),
            actor: GradientsParams::from_grads(actor_loss.backward(), actor),
        }
    }
}
