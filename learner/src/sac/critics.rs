//! The twin critics, and how their two values are combined.

use burn::module::Module;
use burn::tensor::Tensor;

use crate::config::Critics;
use crate::network::Mlp;

/// Two critics with weights of their own: their errors differ, so that their mean or minimum is less biased than
/// either.
#[derive(Module, Debug, Default)]
pub(super) struct Twins {
    pub(super) first: Mlp,
    pub(super) second: Mlp,
}

impl Twins {
    /// Value of every action by each critic, `[B, A]` twice.
    pub(super) fn forward(&self, observation: Tensor<2>) -> [Tensor<2>; 2] {
        [self.first.forward(observation.clone()), self.second.forward(observation)]
    }
}

impl Critics {
    /// The two critics' values, `[B, A]` each, as one.
    pub(super) fn combined(self, [first, second]: [Tensor<2>; 2]) -> Tensor<2> {
        match self {
            Critics::Mean => (first + second).mul_scalar(0.5),
            Critics::Minimum => first.min_pair(second),
        }
    }
}
