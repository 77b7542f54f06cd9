//! What critics and actor are to lessen, on whichever device the tensors are.

use burn::module::Module;
use burn::tensor::Tensor;

use super::Transitions;
use super::critics::{Following, Reading, Twins};
use crate::learner::network::{Mlp, distribution};

/// The networks of an update.
pub(super) struct Networks<'a> {
    /// The actor, whose gradients are asked for.
    pub(super) actor: &'a Mlp,
    /// The critics, whose gradients are asked for.
    pub(super) critics: &'a Twins,
    /// What the critics' goals come from.
    pub(super) target: &'a Twins,
}

/// Weight of the entropy: a number, or on a device one that nobody waits for.
#[derive(Debug, Clone)]
pub(super) enum Weight {
    Number(f32),
    #[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "the processor has the number at hand"))]
    /// `[1, 1]`, without gradients.
    Tensor(Box<Tensor<2>>),
}

impl Weight {
    /// The weight times a tensor without gradients.
    fn times(&self, tensor: Tensor<2>) -> Tensor<2> {
        match self {
            Weight::Number(weight) => tensor.mul_scalar(*weight),
            Weight::Tensor(weight) => tensor * Tensor::clone(weight),
        }
    }

    /// The weight times a tensor with gradients.
    fn times_learning(&self, tensor: Tensor<2>) -> Tensor<2> {
        match self {
            Weight::Number(weight) => tensor.mul_scalar(*weight),
            Weight::Tensor(weight) => tensor * Tensor::clone(weight).autodiff(),
        }
    }
}

/// The losses, averaged over the rows, `[1]` each where no shape is named; those with gradients first.
pub(super) struct Losses {
    pub(super) critic: Tensor<1>,
    pub(super) actor: Tensor<1>,
    /// Entropy of the policy [nat].
    pub(super) entropy: Tensor<1>,
    /// Value of the actions taken, by the critics' average.
    pub(super) value: Tensor<1>,
    /// How far the critics' average was from what it is to give, `[B, 1]`.
    pub(super) errors: Tensor<2>,
}

/// The losses of some rows. B is their number, A the number of actions.
pub(super) fn losses(reading: &Reading, in_target: bool, networks: &Networks, alpha: &Weight, rows: Transitions) -> Losses {
    let Networks { actor, critics, target } = networks;
    // Value of what follows: expectation over actions, with the entropy's worth where it counts.
    let (probs, log_probs) = distribution(actor.valid().forward(rows.next_observation.clone())); // [B, A] each
    let bonus = in_target.then(|| -alpha.times((probs.clone() * log_probs).sum_dim(1))); // [B, 1]
    let goal = reading.goal(Following {
        probs,
        outputs: target.forward(rows.next_observation),
        bonus,
        reward: &rows.reward,
        discount: &rows.discount,
    });

    // Each critic learns the value of the action that was taken.
    let outputs = critics.forward(rows.observation.clone().autodiff());
    let bounds = reading.clips().then(|| {
        let taken = |q: Tensor<2>| q.gather(1, rows.action.clone()); // [B, 1]
        target.forward(rows.observation.clone()).map(taken)
    });
    let [first_bound, second_bound] = bounds.map_or([None, None], |bounds| bounds.map(Some));
    let (first_loss, first_value) = reading.loss(&outputs[0], &rows.action, &goal, first_bound); // [B, 1] each
    let (second_loss, second_value) = reading.loss(&outputs[1], &rows.action, &goal, second_bound); // [B, 1] each
    let critic = ((first_loss + second_loss) * rows.weight.autodiff()).mean();
    let value = (first_value + second_value).mul_scalar(0.5); // [B, 1]
    let errors = (value.clone() - goal.value.clone()).abs();

    // The actor learns what the critics hold for best, and to keep some entropy. Their values are constants here.
    let q = reading.one_value(outputs.map(|output| reading.values(output.inner()))).autodiff(); // [B, A]
    let (probs, log_probs) = distribution(actor.forward(rows.observation.autodiff())); // [B, A] each
    let entropy = -(probs.clone() * log_probs.clone()).inner().sum_dim(1).mean();
    let actor = (probs * (alpha.times_learning(log_probs) - q)).sum_dim(1).mean();
    Losses { critic, actor, entropy, value: value.mean(), errors }
}
