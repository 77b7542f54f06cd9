use super::*;
use crate::config::{self, Critics, Entropy};
use crate::exchange;
use crate::replay_buffer::{ReplayBuffer, Rows, Sample};
use crate::rollout::host;
use burn::module::Param;
use burn::optim::GradientsParams;
use offtrack::layout::Ended;
use offtrack_policy::Normalisation;

mod differentiated;

const ALPHA: f32 = 0.5;
/// Observations of two states.
const PLAIN: [f32; 2] = [1.0, 0.0];
const OTHER: [f32; 2] = [0.0, 1.0];
/// The networks can represent every value of these tasks; after some hundred of Adam's steps the error is below a
/// hundredth.
const CONVERGED: f32 = 0.01;

fn learning() -> Learning {
    Learning {
        hidden: vec![16],
        batch: 6,
        updates_per_step: 1,
        n_steps: 1,
        gamma: 0.5,
        reward_scale: 1.0,
        arrival: None,
        normalise_observations: false,
        observation_noise: 0.0,
        mirror_augmentation: false,
        actor_learning_rate: 0.01,
        critic_learning_rate: 0.01,
        final_learning_rate_fraction: 1.0,
        layer_norm: false,
        critics: Critics::Mean,
        tau: 0.1,
        target_interval: 1,
        actor_ema_rate: 0.1,
        actor_delay: 0,
        entropy: Entropy { in_target: true, target_fraction: None, coefficient: f64::from(ALPHA), learning_rate: 0.01 },
    }
}

fn learner(learning: &Learning, n_actions: usize, seed: u64) -> Sac {
    Sac::new(learning, 2, n_actions, seed).unwrap()
}

fn plain() -> Normalisation {
    Normalisation::none(2)
}

/// The figures of the one update made.
fn figures(sac: &mut Sac) -> Update {
    let (figures, n_updates) = sac.take_sums();
    assert_eq!(n_updates, 1);
    figures
}

/// Six transitions of a chain: from the first state actions 0 and 2 lead to the second and action 1 ends it; every
/// action ends the second.
fn chain() -> Sample<2> {
    Sample {
        observation: vec![PLAIN, PLAIN, PLAIN, OTHER, OTHER, OTHER],
        action: vec![0, 1, 2, 0, 1, 2],
        reward: vec![0.0, 1.0, -0.5, 1.0, 0.5, -1.0],
        discount: vec![0.8, 0.0, 0.8, 0.0, 0.0, 0.0],
        next_observation: vec![OTHER; 6],
        weight: vec![1.0; 6],
        row: vec![0; 6],
    }
}

/// The whole sample as one shard.
fn whole(sample: &Sample<2>) -> Transitions {
    let cat = |of: fn(&Transitions) -> Tensor<2>| Tensor::cat(halves(sample).iter().map(of).collect(), 0);
    Transitions {
        observation: cat(|shard| shard.observation.clone()),
        action: Tensor::cat(halves(sample).into_iter().map(|shard| shard.action).collect(), 0),
        reward: cat(|shard| shard.reward.clone()),
        discount: cat(|shard| shard.discount.clone()),
        next_observation: cat(|shard| shard.next_observation.clone()),
        weight: cat(|shard| shard.weight.clone()),
    }
}

fn halves(sample: &Sample<2>) -> Vec<Transitions> {
    host::shards(sample, &plain(), &learning(), &mut SmallRng::seed_from_u64(0))
}

/// Updates with constant, then falling learning rates.
fn learn(sac: &mut Sac, sample: impl Fn() -> Sample<2>, n_updates: usize) -> Update {
    let mut last = Update::default();
    for update in 0..n_updates {
        let left = (n_updates - update) as f64 / n_updates as f64;
        sac.update(exchange::Sample::Host(halves(&sample())), left.min(0.5)).unwrap();
        last = figures(sac);
    }
    last
}

/// Each critic's values of an observation.
fn values(sac: &Sac, observation: [f32; 2]) -> [Vec<f32>; 2] {
    [&sac.critics.first, &sac.critics.second].map(|critic| host::logits(critic, &plain(), &[observation]))
}

fn softmax(logits: &[f32]) -> Vec<f32> {
    let sum: f32 = logits.iter().map(|logit| logit.exp()).sum();
    logits.iter().map(|logit| logit.exp() / sum).collect()
}

fn assert_near(found: &[f32], expected: &[f32], tolerance: f32) {
    let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < tolerance);
    assert!(near && found.len() == expected.len(), "{found:?} is not {expected:?}");
}

fn weights(network: &Mlp) -> Vec<f32> {
    let plain = |data: burn::tensor::TensorData| data.try_to_vec::<f32>().unwrap();
    let of = |layer: &burn::nn::Linear| {
        [plain(layer.weight.val().into_data()), plain(layer.bias.as_ref().unwrap().val().into_data())]
    };
    network.layers.iter().flat_map(of).flatten().collect()
}

fn all_weights(sac: &Sac) -> Vec<f32> {
    let networks = [
        &sac.actor,
        &sac.critics.first,
        &sac.critics.second,
        &sac.target_critics.first,
        &sac.target_critics.second,
        &sac.actor_ema,
    ];
    networks.into_iter().flat_map(weights).collect()
}

/// Gradients of a network's parameters, one after the other.
fn gradients_of(gradients: &GradientsParams, network: &Mlp) -> Vec<f32> {
    fn of<const D: usize>(gradients: &GradientsParams, param: &Param<Tensor<D>>) -> Vec<f32> {
        gradients.get::<D>(param.id).unwrap().into_data().try_to_vec().unwrap()
    }
    network
        .layers
        .iter()
        .flat_map(|layer| [of(gradients, &layer.weight), of(gradients, layer.bias.as_ref().unwrap())])
        .chain(
            network
                .norms
                .iter()
                .flat_map(|norm| [of(gradients, &norm.gamma), of(gradients, norm.beta.as_ref().unwrap())]),
        )
        .flatten()
        .collect()
}

#[test]
fn a_chains_values_and_policy_are_the_soft_optimal_ones() {
    let mut sac = learner(&learning(), 3, 1);
    let last = learn(&mut sac, chain, 1500);
    // Each end is worth its reward. The second state is worth alpha ln sum exp(Q / alpha), the soft maximum of its
    // values.
    let end: [f32; 3] = [1.0, 0.5, -1.0];
    let soft_maximum = ALPHA * end.iter().map(|q| (q / ALPHA).exp()).sum::<f32>().ln();
    let begin = [0.8 * soft_maximum, 1.0, -0.5 + 0.8 * soft_maximum];
    let mut entropy = 0.0;
    for (observation, expected) in [(OTHER, end), (PLAIN, begin)] {
        for critic in values(&sac, observation) {
            assert_near(&critic, &expected, CONVERGED);
        }
        let probs = softmax(&expected.map(|q| q / ALPHA));
        for actor in [&sac.actor, &sac.actor_ema()] {
            assert_near(&softmax(&host::logits(actor, &plain(), &[observation])), &probs, CONVERGED);
        }
        entropy -= 0.5 * probs.iter().map(|prob| prob * prob.ln()).sum::<f32>();
    }
    assert_near(
        &[last.entropy, last.value],
        &[entropy, (end.iter().sum::<f32>() + begin.iter().sum::<f32>()) / 6.0],
        CONVERGED,
    );
    // Values without the entropy term are far off.
    assert!(10.0 * CONVERGED < 0.8 * (soft_maximum - 1.0));
}

#[test]
fn without_entropy_in_the_target_the_second_state_is_worth_what_its_policy_earns() {
    let mut learning = learning();
    learning.entropy.in_target = false;
    let mut sac = learner(&learning, 3, 1);
    learn(&mut sac, chain, 1500);
    let end: [f32; 3] = [1.0, 0.5, -1.0];
    let probs = softmax(&end.map(|q| q / ALPHA));
    let earned: f32 = probs.iter().zip(end).map(|(prob, q)| prob * q).sum();
    assert_near(&values(&sac, PLAIN)[0], &[0.8 * earned, 1.0, -0.5 + 0.8 * earned], CONVERGED);
}

#[test]
fn critics_with_layer_normalisation_find_the_same_values() {
    let mut learning = Learning { layer_norm: true, ..learning() };
    learning.entropy.in_target = false;
    let mut sac = learner(&learning, 3, 1);
    learn(&mut sac, chain, 1500);
    // Layer normalisation in a plain network's place leaves its mark on the parameters.
    assert_ne!(sac.critics.first.parameters().len(), learner(&self::learning(), 3, 1).critics.first.parameters().len());
    assert_near(&values(&sac, OTHER)[0], &[1.0, 0.5, -1.0], 5.0 * CONVERGED);
    let probs = softmax(&[1.0, 0.5, -1.0].map(|q: f32| q / ALPHA));
    let earned = probs[0] + 0.5 * probs[1] - probs[2];
    assert_near(&values(&sac, PLAIN)[0], &[0.8 * earned, 1.0, -0.5 + 0.8 * earned], 5.0 * CONVERGED);
}

/// The value of an action after each step of which an episode ends in `ended`, leaving the truck where it was, with
/// reward 1.
fn learned_value(ended: Ended) -> f32 {
    let learning = learning();
    let mut buffer = ReplayBuffer::<2>::new(
        1,
        learning.n_steps,
        &config::ReplayBuffer { capacity: 1000, warmup: 1, priority: None },
    );
    for step in 0..8 {
        buffer.append(Rows {
            observation: &[PLAIN],
            action: &[step % 2],
            reward: &[1.0],
            ended: &[ended as u32],
            next_observation: &[PLAIN],
        });
    }
    let mut sac = learner(&learning, 2, 2);
    let rng = std::cell::RefCell::new(SmallRng::seed_from_u64(3));
    learn(&mut sac, || buffer.sample(8, learning.gamma as f32, &mut *rng.borrow_mut()), 800);
    let [first, second] = values(&sac, PLAIN);
    first.iter().chain(&second).sum::<f32>() / 4.0
}

#[test]
fn a_truncated_episode_keeps_the_value_of_its_last_observation() {
    assert_near(&[learned_value(Ended::Arrived), learned_value(Ended::TrailerCollided)], &[1.0; 2], CONVERGED);
    // Q = 1 + gamma (Q + alpha ln 2), the entropy of two equal actions being ln 2.
    let endless = (1.0 + 0.5 * ALPHA * 2f32.ln()) / (1.0 - 0.5);
    assert_near(&[learned_value(Ended::TimedOut)], &[endless], CONVERGED);
}

#[test]
fn the_actors_loss_does_not_move_the_critics() {
    let mut sac = learner(&learning(), 3, 4);
    // The discounts are 0, so the actor cannot reach the critics' loss by the TD target.
    let ends = Sample { discount: vec![0.0; 6], ..chain() };
    let before = sac.gradients(whole(&ends), 1.0);
    sac.actor = learner(&learning(), 3, 5).actor;
    let after = sac.gradients(whole(&ends), 1.0);
    assert_ne!(before.figures[1], after.figures[1]);
    for critic in [&sac.critics.first, &sac.critics.second] {
        assert_eq!(gradients_of(&before.critics, critic), gradients_of(&after.critics, critic));
        assert!(gradients_of(&before.critics, critic).iter().any(|gradient| *gradient != 0.0));
    }
}

#[test]
fn the_critics_loss_does_not_move_the_actor() {
    let sac = learner(&learning(), 3, 4);
    let poor = chain();
    let rich = Sample { reward: poor.reward.iter().map(|reward| 10.0 + reward).collect(), ..chain() };
    let [poor, rich] = [poor, rich].map(|sample| sac.gradients(whole(&sample), 1.0));
    assert_ne!(poor.figures[0], rich.figures[0]);
    assert_eq!(gradients_of(&poor.actor, &sac.actor), gradients_of(&rich.actor, &sac.actor));
    assert!(gradients_of(&poor.actor, &sac.actor).iter().any(|gradient| *gradient != 0.0));
}

#[test]
fn the_same_seed_gives_the_same_learner_bit_for_bit() {
    let learned = |seed| {
        let mut sac = learner(&learning(), 3, seed);
        learn(&mut sac, chain, 60);
        all_weights(&sac)
    };
    assert_eq!(learned(6), learned(6));
    assert_ne!(learned(6), learned(7));
}

#[test]
fn shards_of_a_batch_make_the_update_of_the_whole() {
    let after = |shards: fn(&Sample<2>) -> Vec<Transitions>| {
        let mut sac = learner(&learning(), 3, 8);
        sac.update(exchange::Sample::Host(shards(&chain())), 1.0).unwrap();
        let update = figures(&mut sac);
        let losses = vec![update.critic_loss, update.actor_loss, update.entropy, update.value];
        (losses, [weights(&sac.actor), weights(&sac.critics.first), weights(&sac.critics.second)].concat())
    };
    // Of two rows and of four: a shard counts for its rows.
    let uneven = |sample: &Sample<2>| {
        let whole = whole(sample);
        let rows = |tensor: &Tensor<2>, from: usize, to: usize| tensor.clone().narrow(0, from, to - from);
        let shard = |from: usize, to: usize| Transitions {
            observation: rows(&whole.observation, from, to),
            action: whole.action.clone().narrow(0, from, to - from),
            reward: rows(&whole.reward, from, to),
            discount: rows(&whole.discount, from, to),
            next_observation: rows(&whole.next_observation, from, to),
            weight: rows(&whole.weight, from, to),
        };
        vec![shard(0, 2), shard(2, 6)]
    };
    let (losses, weights) = after(|sample| vec![whole(sample)]);
    for shards in [halves, uneven] {
        let (found_losses, found_weights) = after(shards);
        assert_near(&found_losses, &losses, 1e-6);
        // Adam divides a gradient by its own size plus 1e-5: rounding by 1e-8 moves a step of 0.01 by up to 1e-5.
        assert_near(&found_weights, &weights, 1e-5);
    }
    let (losses_of_a_half, weights_of_a_half) = after(|sample| vec![halves(sample).remove(0)]);
    let furthest =
        |found: &[f32], whole: &[f32]| found.iter().zip(whole).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(1e-3 < furthest(&losses_of_a_half, &losses) && 1e-3 < furthest(&weights_of_a_half, &weights));
}

#[test]
fn the_target_critics_follow_every_so_many_updates_by_tau() {
    let mut sac = learner(&Learning { target_interval: 3, tau: 0.25, ..learning() }, 3, 9);
    let begun = weights(&sac.target_critics.second);
    learn(&mut sac, chain, 2);
    assert_eq!(weights(&sac.target_critics.second), begun);
    learn(&mut sac, chain, 1);
    let expected: Vec<f32> =
        begun.iter().zip(weights(&sac.critics.second)).map(|(old, new)| 0.75 * old + 0.25 * new).collect();
    // Two ways to round a sum of numbers below 2.
    assert_near(&weights(&sac.target_critics.second), &expected, 1e-6);
    assert_ne!(weights(&sac.target_critics.second), begun);
}

#[test]
fn nothing_on_the_host_is_recorded_for_differentiation() {
    // Each parameter of each update would stay in the tensor library's graph.
    let mut sac = learner(&Learning { layer_norm: true, ..learning() }, 3, 9);
    learn(&mut sac, chain, 2);
    for network in [&sac.actor, &sac.critics.first, &sac.critics.second] {
        assert!(network.layers.iter().all(|layer| !layer.weight.val().is_require_grad()));
        assert!(network.norms.iter().all(|norm| !norm.gamma.val().is_require_grad()));
    }
}
