//! Gradients beside those of automatic differentiation.

use super::*;
use burn::tensor::activation::log_softmax;

/// Probabilities and their logarithms, `[B, A]` each, of an actor's output `[B, A]`.
fn distribution(logits: Tensor<2>) -> (Tensor<2>, Tensor<2>) {
    let log_probs = log_softmax(logits, 1);
    (log_probs.clone().exp(), log_probs)
}

/// The gradients of the first critic, the second and the actor that the tensor library finds by recording every
/// operation.
fn differentiated(sac: &Sac, shard: &Transitions) -> [Vec<f32>; 3] {
    // The same parameters in a graph.
    let in_graph = |network: &Mlp| {
        let parameters = network.parameters().into_iter().map(|(_, values)| values).collect();
        network.with_parameters(parameters, &Device::flex().autodiff())
    };
    let actor = in_graph(&sac.actor);
    let critics = Twins { first: in_graph(&sac.critics.first), second: in_graph(&sac.critics.second) };
    let alpha = sac.entropy_coefficient.value();
    let combined = |[first, second]: [Tensor<2>; 2]| match sac.learning.critics {
        Critics::Mean => (first + second).mul_scalar(0.5),
        Critics::Minimum => first.min_pair(second),
    };
    let of_twins = |twins: &Twins, observation: &Tensor<2>| {
        [&twins.first, &twins.second].map(|critic| critic.forward(observation.clone()))
    };
    let (probs, log_probs) = distribution(sac.actor.forward(shard.next_observation.clone()));
    let next_q = combined(of_twins(&sac.target_critics, &shard.next_observation));
    let next_value = (probs * (next_q - log_probs.mul_scalar(alpha))).sum_dim(1);
    let target = shard.reward.clone() + shard.discount.clone() * next_value;

    let observation = shard.observation.clone().autodiff();
    let q = of_twins(&critics, &observation);
    let losses = q.clone().map(|q| {
        (q.gather(1, shard.action.clone().autodiff()) - target.clone().autodiff()).square()
            * shard.weight.clone().autodiff()
    });
    let [first, second] = losses;
    let critic_loss = (first + second).mean();
    let (probs, log_probs) = distribution(actor.forward(observation));
    let q = combined(q.map(Tensor::inner)).autodiff();
    let actor_loss = (probs * (log_probs.mul_scalar(alpha) - q)).sum_dim(1).mean();
    let by_critics = GradientsParams::from_grads(critic_loss.backward(), &critics);
    let by_actor = GradientsParams::from_grads(actor_loss.backward(), &actor);
    [
        gradients_of(&by_critics, &critics.first),
        gradients_of(&by_critics, &critics.second),
        gradients_of(&by_actor, &actor),
    ]
}

#[test]
fn gradients_are_those_that_the_tensor_library_finds() {
    for (layer_norm, critics) in [(false, Critics::Mean), (true, Critics::Minimum)] {
        let mut sac = learner(&Learning { layer_norm, critics, ..learning() }, 3, 4);
        learn(&mut sac, chain, 3);
        let shard = whole(&Sample { weight: vec![0.5, 1.0, 0.7, 0.2, 1.0, 0.9], ..chain() });
        let expected = differentiated(&sac, &shard);
        let found = sac.gradients(shard, 1.0);
        let found = [
            gradients_of(&found.critics, &sac.critics.first),
            gradients_of(&found.critics, &sac.critics.second),
            gradients_of(&found.actor, &sac.actor),
        ];
        for (found, expected) in found.iter().zip(&expected) {
            assert!(expected.iter().any(|gradient| 0.01 < gradient.abs()));
            assert_near(found, expected, 1e-5);
        }
    }
}
