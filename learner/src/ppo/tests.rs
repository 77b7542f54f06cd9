use super::*;
use crate::config::Refinement;
use offtrack::layout::Ended;
use offtrack::scenario::RewardChanges;

fn settings() -> Refinement {
    Refinement {
        begin: 0.0,
        logit_factor: 1.0,
        frames: 1,
        n_steps: 4,
        epochs: 2,
        batch: 16,
        gamma: 0.5,
        gae_lambda: 0.5,
        clip: 0.2,
        entropy_coefficient: 0.01,
        actor_learning_rate: 0.01,
        critic_learning_rate: 0.01,
        final_learning_rate_fraction: 1.0,
        actor_ema_rate: 1.0,
        advantage_limit: 4.0,
        critic_iterations: 0,
        clearance_power: 1.0,
        late_fails: false,
        reward: RewardChanges::default(),
    }
}

fn actor(n_values: usize, n_actions: usize) -> Mlp {
    Mlp::new(&[n_values, 16, n_actions], 1.0, &mut SmallRng::seed_from_u64(5), &Device::flex())
}

/// Steps of two trucks with one value each.
fn steps(reward: &[f32], ended: &[Ended], next_observation: &[f32]) -> Steps {
    Steps {
        n_envs: 2,
        n_values: 1,
        observation: vec![0.0; reward.len()],
        action: vec![0; reward.len()],
        log_prob: vec![0.0; reward.len()],
        reward: reward.to_vec(),
        ended: ended.to_vec(),
        late_fails: false,
        next_observation: next_observation.to_vec(),
    }
}

/// One step for each value of `seen`, ended at once with the reward of its action.
fn bandit(actor: &Mlp, seen: &[f32], reward: impl Fn(f32, u32) -> f32, rng: &mut Generator) -> Steps {
    let output = Pass::forward(actor, matrix(TensorData::new(seen.to_vec(), [seen.len(), 1]))).output;
    let n_actions = output.len() / seen.len();
    let action = crate::network::sampled(&output, n_actions, rng);
    Steps {
        n_envs: seen.len(),
        n_values: 1,
        observation: seen.to_vec(),
        log_prob: output
            .chunks_exact(n_actions)
            .zip(&action)
            .map(|(row, &action)| softmax(row).1[action as usize])
            .collect(),
        reward: seen.iter().zip(&action).map(|(&seen, &action)| reward(seen, action)).collect(),
        ended: vec![Ended::Arrived; seen.len()],
        late_fails: false,
        next_observation: Vec::new(),
        action,
    }
}

#[test]
fn advantages_are_discounted_sums_of_td_errors_within_an_episode() {
    use Ended::{Running, TimedOut, TractorCollided};
    // The first truck fails in its second step; the second one runs out of time in its first. Both then go on.
    let steps = steps(
        &[1.0, 2.0, -8.0, 4.0, 16.0, 32.0],
        &[Running, TimedOut, TractorCollided, Running, Running, Running],
        &[100.0, 200.0, 300.0],
    );
    let needs: Vec<usize> = (0..6).filter(|&row| steps.needs_next(row, 6)).collect();
    assert_eq!(needs, [1, 4, 5]);
    let values = [10.0, 20.0, 30.0, 40.0, 50.0, 60.0];
    let (advantage, returned) = steps.advantages(&values, &[100.0, 200.0, 300.0], 0.5, 0.5);
    // Rewards and half of the next value less the value, and a quarter of what comes later in the same episode.
    let last = [16.0 + 100.0 - 50.0, 32.0 + 150.0 - 60.0];
    let second = [-8.0 - 30.0, 4.0 + 30.0 - 40.0 + 0.25 * last[1]];
    let first = [1.0 + 15.0 - 10.0 + 0.25 * second[0], 2.0 + 50.0 - 20.0];
    assert_eq!(advantage, [first, second, last].concat());
    assert_eq!(returned, advantage.iter().zip(values).map(|(advantage, value)| advantage + value).collect::<Vec<_>>());
    // Where who is late has failed, nothing comes after the second truck's first step.
    let steps = Steps { late_fails: true, ..steps };
    let needs: Vec<usize> = (0..6).filter(|&row| steps.needs_next(row, 6)).collect();
    assert_eq!(needs, [4, 5]);
    let (late, _) = steps.advantages(&values, &[200.0, 300.0], 0.5, 0.5);
    assert_eq!(late, [&[first[0], 2.0 - 20.0][..], &advantage[2..]].concat());
}

#[test]
fn standardised_values_have_mean_0_and_deviation_1_and_an_outlier_is_limited() {
    let mut values: Vec<f32> = (0..1000).map(|n| (n % 2) as f32).collect();
    standardise(&mut values, 4.0);
    assert!(values.iter().all(|value| (value.abs() - 1.0).abs() < 1e-5));
    values[0] = -1000.0;
    standardise(&mut values, 4.0);
    assert_eq!(values[0], -4.0);
    assert!(values[1..].iter().all(|value| value.abs() < 0.2));
}

#[test]
fn the_gradients_are_those_of_the_tensor_librarys_differentiation() {
    let (seen, n_actions) = ([0.3f32, -0.7, 1.1, 0.2, -1.4, 0.9], 3);
    let ppo = Ppo::new(&settings(), &actor(1, n_actions), 1).unwrap();
    let action = vec![0u32, 1, 2, 0, 1, 2];
    // Old probabilities such that some ratios lie within the clip range and some on either side of it.
    let output = Pass::forward(&ppo.actor, matrix(TensorData::new(seen.to_vec(), [6, 1]))).output;
    let ratios = [1.1f32, 1.5, 0.6, 0.9, 1.5, 0.6];
    let advantage = [1.0f32, 1.0, 1.0, -2.0, -2.0, -2.0];
    let log_prob =
        (0..6).map(|row| softmax(row_of(&output, row, n_actions)).1[action[row] as usize] - ratios[row].ln()).collect();
    let steps = Steps {
        observation: seen.to_vec(),
        action: action.clone(),
        log_prob,
        ..steps(&[0.0; 6], &[Ended::Running; 6], &[])
    };
    let returned = [0.5f32, -1.0, 2.0, 0.0, 1.0, -0.5];
    let rows = Rows { steps: &steps, advantage: &advantage, returned: &returned, rows: &[0, 1, 2, 3, 4, 5] };
    let ShardGradients { figures, actor: of_actor, critic: of_critic } = ppo.gradients(&rows, 1.0 / 6.0);

    let device = Device::flex().autodiff();
    let column = |values: &[f32]| Tensor::<2>::from_data(TensorData::new(values.to_vec(), [6, 1]), &device);
    let (own_actor, own_critic) = (ppo.actor.on(&device), ppo.critic.on(&device));
    let log_probs = burn::tensor::activation::log_softmax(own_actor.forward(column(&seen)), 1);
    let indices: Vec<i32> = action.iter().map(|&action| action as i32).collect();
    let indices = Tensor::<2, burn::tensor::Int>::from_data(TensorData::new(indices, [6, 1]), &device);
    let ratio = (log_probs.clone().gather(1, indices) - column(&steps.log_prob)).exp();
    let limited = ratio.clone().clamp(0.8, 1.2) * column(&advantage);
    let entropy = -(log_probs.clone().exp() * log_probs).sum_dim(1).mean();
    let surrogate = -(ratio * column(&advantage)).min_pair(limited).mean();
    let loss = surrogate.clone() - entropy.clone().mul_scalar(0.01);
    let critic_loss = (own_critic.forward(column(&seen)) - column(&returned)).square().mean();
    let number = |tensor: Tensor<1>| tensor.into_data().try_to_vec::<f32>().unwrap()[0];
    for (found, expected) in
        [(figures.actor_loss, surrogate), (figures.entropy, entropy), (figures.critic_loss, critic_loss.clone())]
            .map(|(a, b)| (a, number(b)))
    {
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }
    let expected = [
        (GradientsParams::from_grads(loss.backward(), &own_actor), of_actor, &own_actor, &ppo.actor),
        (GradientsParams::from_grads(critic_loss.backward(), &own_critic), of_critic, &own_critic, &ppo.critic),
    ];
    let mut largest = 0.0f32;
    for (expected, found, own, plain) in expected {
        for (own, plain) in own.layers.iter().zip(&plain.layers) {
            let values = |gradients: &GradientsParams, layer: &burn::nn::Linear| -> Vec<f32> {
                gradients.get::<2>(layer.weight.id).unwrap().into_data().try_to_vec().unwrap()
            };
            let (expected, found) = (values(&expected, own), values(&found, plain));
            for (found, expected) in found.iter().zip(&expected) {
                // Sums over six rows in another order.
                assert!((found - expected).abs() < 1e-5, "{found} {expected}");
                largest = largest.max(expected.abs());
            }
        }
    }
    assert!(0.05 < largest, "{largest}");
}

#[test]
fn the_action_that_pays_where_it_is_becomes_probable_and_the_values_are_learned() {
    let mut ppo = Ppo::new(&settings(), &actor(1, 3), 1).unwrap();
    let mut rng = Generator::seed_from_u64(3);
    let seen: Vec<f32> = (0..64).map(|n| if n % 2 == 0 { 1.0 } else { -1.0 }).collect();
    for _ in 0..200 {
        let steps =
            bandit(&ppo.actor, &seen, |seen, action| if (seen < 0.0) == (action == 0) { 2.0 } else { 0.0 }, &mut rng);
        assert_eq!(ppo.learn(&steps, 1.0), 8);
    }
    let output = Pass::forward(ppo.actor_ema(), matrix(TensorData::new(vec![-1.0, 1.0], [2, 1]))).output;
    let [left, right] = [0, 1].map(|row| softmax(row_of(&output, row, 3)).0[0]);
    assert!(0.9 < left && right < 0.1, "{left} {right}");
    for value in ppo.values(&[-1.0, 1.0]) {
        assert!((value - 2.0).abs() < 0.2, "{value}");
    }
    let (sums, n_updates) = ppo.take_sums();
    assert!(n_updates == 1600 && sums.value.is_finite() && ppo.take_sums().1 == 0);
}

#[test]
fn the_policy_stays_while_the_value_network_alone_learns() {
    let begun = actor(1, 3);
    let mut ppo = Ppo::new(&Refinement { critic_iterations: 2, ..settings() }, &begun, 1).unwrap();
    let mut rng = Generator::seed_from_u64(3);
    let weights = |network: &Mlp| network.parameters();
    for iteration in 0..3 {
        let before = weights(&ppo.critic);
        let steps = bandit(&ppo.actor, &[0.5, -0.5, 0.2], |_, action| action as f32, &mut rng);
        ppo.learn(&steps, 1.0);
        assert_ne!(weights(&ppo.critic), before);
        assert_eq!(weights(&ppo.actor) == weights(&begun), iteration < 2, "{iteration}");
    }
}

#[test]
fn a_policy_begins_with_its_logits_times_the_factor() {
    let (begun, seen) = (actor(1, 3), matrix(TensorData::new(vec![-1.0, 0.5], [2, 1])));
    let ppo = Ppo::new(&Refinement { logit_factor: 2.5, ..settings() }, &begun, 1).unwrap();
    let logits = Pass::forward(&begun, seen.clone()).output;
    for network in [&ppo.actor, &ppo.actor_ema] {
        let found = Pass::forward(network, seen.clone()).output;
        // A product of sums, and a sum of products.
        assert!(found.iter().zip(&logits).all(|(found, logit)| (found - 2.5 * logit).abs() < 1e-5), "{found:?}");
    }
    let same = Ppo::new(&settings(), &begun, 1).unwrap();
    assert_eq!(same.actor.parameters(), begun.parameters());
}

#[test]
fn a_single_step_is_learned_from() {
    let mut ppo = Ppo::new(&settings(), &actor(1, 3), 1).unwrap();
    let steps = bandit(&ppo.actor, &[0.5], |_, _| 1.0, &mut Generator::seed_from_u64(3));
    let before = ppo.values(&[0.5])[0];
    assert_eq!(ppo.learn(&steps, 1.0), 2);
    assert!(before < ppo.values(&[0.5])[0] && ppo.broken().is_none());
}
