use super::*;
use offtrack::layout::Ended;
use offtrack::random::{index_below, signed_unit, words};
use offtrack::scenario::{Scenario, Split};
use std::path::Path;

use crate::files;

fn practice() -> (Arc<World>, Vec<u32>) {
    let scenario = Scenario::read(&files::benchmark("attard2023").unwrap()).unwrap();
    (Arc::new(World::bake(&scenario).unwrap()), scenario.split(Split::Train).to_vec())
}

fn config(settings: &[&str]) -> Config {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/gpu.toml");
    let common = ["n_envs=64", "memory.capacity=2000", "memory.warmup=100", "learning.batch=500"];
    let settings: Vec<String> = common.iter().chain(settings).map(|setting| (*setting).to_owned()).collect();
    Config::read_with(&file, &settings).unwrap()
}

/// What is known of one step of one truck.
struct Step {
    seen: [f32; N_VALUES],
    action: u32,
    reward: f32,
    ended: u32,
    next: [f32; N_VALUES],
}

fn host<const D: usize>(tensor: &Tensor<D>) -> Vec<f32> {
    tensor.clone().into_data().try_to_vec().unwrap()
}

#[test]
fn samples_are_the_transitions_that_were_driven_scaled_noisy_and_mirrored_as_asked() {
    let (world, routes) = practice();
    let shared = Shared::open(None).unwrap();
    let mirror = Mirror::of(&world).unwrap();
    for settings in [["learning.mirror=true", "learning.observation_noise=0.2"], ["learning.mirror=false", "learning.observation_noise=0"]]
    {
        let config = config(&settings);
        let (n_envs, n_steps, seeds) = (config.n_envs, config.learning.n_steps, [7, 8]);
        let mut memory = DeviceMemory::new(&shared, &config, &world, routes.clone(), seeds).unwrap();
        let mut history: Vec<Vec<Step>> = Vec::new();
        // Three times round the ring of 32 steps.
        for _ in 0..100 {
            let seen = memory.simulator().batch().observation.clone();
            memory.step_at_random().unwrap();
            let batch = memory.simulator().batch();
            history.push(
                (0..n_envs)
                    .map(|env| Step {
                        seen: seen[env],
                        action: batch.action[env],
                        reward: batch.reward[env],
                        ended: batch.ended[env],
                        next: batch.next_observation[env],
                    })
                    .collect(),
            );
        }
        let scaling = Scaling { mean: vec![0.25; N_VALUES], factor: (0..N_VALUES).map(|index| 1.0 + index as f32).collect() };
        memory.set_scaling(&scaling);
        let sample = memory.sample().unwrap();
        let (observation, next) = (host(&sample.observation), host(&sample.next_observation));
        let (reward, discount) = (host(&sample.reward), host(&sample.discount));
        let action: Vec<i32> = sample.action.clone().into_data().try_to_vec().unwrap();
        let n_slots = config.memory.capacity.div_ceil(n_envs);
        let (mut ends, mut turned) = (0, 0);
        for row in 0..config.learning.batch {
            let drawn = words(seeds[1], row as u32, 0, 0);
            let first = 100 - n_slots + index_below(drawn[0], (n_slots - n_steps) as u32) as usize;
            let env = index_below(drawn[1], n_envs as u32) as usize;
            let (mut sum, mut weight, mut last) = (0.0f32, 1.0f32, first);
            for (step, trucks) in history.iter().enumerate().skip(first).take(n_steps) {
                last = step;
                sum += weight * trucks[env].reward;
                weight *= config.learning.discount as f32;
                let ended = Ended::from_code(trucks[env].ended).unwrap();
                if ended.terminated() {
                    weight = 0.0;
                }
                if ended != Ended::Running {
                    ends += 1;
                    break;
                }
            }
            let is_turned = config.learning.mirror && drawn[2] & 1 == 1;
            turned += usize::from(is_turned);
            let turn = |seen: &[f32; N_VALUES]| if is_turned { mirror.observation(seen) } else { *seen };
            let expected_action = history[first][env].action;
            let expected_action = if is_turned { mirror.images().1[expected_action as usize] } else { expected_action };
            assert_eq!(action[row], expected_action as i32);
            assert_eq!(discount[row], weight);
            let expected_reward = sum * config.learning.reward_scale as f32;
            assert!((reward[row] - expected_reward).abs() <= 1e-5 * expected_reward.abs().max(1.0), "{} {expected_reward}", reward[row]);
            for (found, seen) in [(&observation, &history[first][env].seen), (&next, &history[last][env].next)] {
                let expected = scaling.apply(&[turn(seen)]);
                for value in 0..N_VALUES {
                    let noise = config.learning.observation_noise as f32 * signed_unit(words(seeds[1], row as u32, 0, 1 + value as u32)[0]);
                    let difference = found[row * N_VALUES + value] - (expected[value] + noise);
                    // Scaled values lie within 10.
                    assert!(difference.abs() < 1e-5, "{value}: {difference}");
                }
            }
        }
        assert!(20 < ends, "{ends} episodes ended");
        assert_eq!(config.learning.mirror, 200 < turned);
    }
}

#[test]
fn actions_are_drawn_as_the_actor_would_have_them() {
    let (world, routes) = practice();
    let shared = Shared::open(None).unwrap();
    let config = config(&["n_envs=4096", "memory.capacity=100000"]);
    let mut memory = DeviceMemory::new(&shared, &config, &world, routes, [7, 8]).unwrap();
    // Probabilities of 1/45, 2/45, ... 9/45.
    let logits: Vec<f32> = (0..4096).flat_map(|_| (1..=9).map(|rank| (rank as f32).ln())).collect();
    let logits = Tensor::from_data(TensorData::new(logits, [4096, 9]), &shared.tensors);
    let mut counts = [0usize; 9];
    for _ in 0..5 {
        memory.step(Some(&logits), true).unwrap();
        memory.simulator().batch().action.iter().for_each(|&action| counts[action as usize] += 1);
    }
    let n = 5.0 * 4096.0;
    for (rank, count) in counts.into_iter().enumerate() {
        let share = (rank + 1) as f64 / 45.0;
        // Five deviations of a count.
        assert!((count as f64 - n * share).abs() < 5.0 * (n * share * (1.0 - share)).sqrt(), "{rank}: {count}");
    }
}

/// Rewards of 40 samples, each asked for before the next sample is drawn and worked out when the device gets to it.
fn rewards(is_careless: bool) -> Vec<Vec<f32>> {
    let (world, routes) = practice();
    let mut shared = Shared::open(None).unwrap();
    shared.is_careless = is_careless;
    let mut memory = DeviceMemory::new(&shared, &config(&[]), &world, routes, [7, 8]).unwrap();
    for _ in 0..40 {
        memory.step_at_random().unwrap();
    }
    shared.tensors.sync().unwrap();
    let mut told = |_| {
        let asked = memory.sample().unwrap().reward.mul_scalar(1.0);
        memory.sample().unwrap();
        host(&asked)
    };
    (0..40).map(&mut told).collect()
}

#[test]
fn what_is_asked_of_a_sample_is_answered_before_the_next_is_drawn_and_only_because_it_is_handed_over() {
    let expected = rewards(false);
    assert_eq!(expected, rewards(false));
    let careless = rewards(true);
    let wrong = expected.iter().zip(&careless).filter(|(expected, found)| expected != found).count();
    println!("{wrong} of 40 answers are about the wrong sample where nothing is handed over");
    assert!(20 < wrong, "the hand-over could be left out");
}

#[test]
fn trucks_do_what_the_networks_have_just_said() {
    let (world, routes) = practice();
    let shared = Shared::open(None).unwrap();
    let mut memory = DeviceMemory::new(&shared, &config(&[]), &world, routes, [7, 8]).unwrap();
    let asked = |step: usize| {
        let row = (0..9).map(|action| if action == step % 9 { 50.0 } else { 0.0 });
        Tensor::<2>::from_data(TensorData::new(row.collect::<Vec<f32>>(), [1, 9]), &shared.tensors).repeat_dim(0, 64)
    };
    for step in 0..40 {
        // An answer that has to be worked out first.
        let logits = asked(step).mul_scalar(2.0).add_scalar(1.0);
        memory.step(Some(&logits), true).unwrap();
        assert!(memory.simulator().batch().action.iter().all(|&action| action as usize == step % 9), "{step}");
    }
}
