//! Losses of a shard and their gradients.
//!
//! On the processor the networks' chain rule is written out, around the tensor library's products: recording every
//! operation for automatic differentiation, and as many small tensors, would take longer than the products. On a device
//! the tensor library differentiates. A test compares the two.

mod host;
mod tensors;

use burn::optim::GradientsParams;
use burn::tensor::Tensor;

use super::scalar::Scalar;
use super::{Figures, Sac, Transitions};

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
        match self.entropy_coefficient.value() {
            Scalar::Host(alpha) => self.gradients_by_hand(shard, fraction, alpha),
            Scalar::Device(alpha) => self.differentiated(shard, fraction, &alpha),
        }
    }
}
