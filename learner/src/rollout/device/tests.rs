use super::*;
use crate::device::least;
use crate::network::Mlp;
use crate::rollout::host::observed;
use offtrack::layout::random::{index_below, signed_unit, words};
use offtrack::layout::{Ended, N_AROUND, N_VALUES, ObservedExtras};
use offtrack::scenario::{Scenario, Split};
use offtrack_policy::{Layer, Policy};
use std::path::Path;

mod level_replay;
mod priorities;

const MASS: usize = N_VALUES + ObservedExtras::Mass.n_extras();

fn training() -> (Arc<World>, Vec<u32>) {
    training_of("attard2023")
}

fn training_of(benchmark: &str) -> (Arc<World>, Vec<u32>) {
    let scenario = Scenario::named(benchmark).unwrap();
    (Arc::new(World::bake(&scenario).unwrap()), scenario.split(Split::Train).to_vec())
}

fn config(settings: &[&str]) -> Config {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/gpu.toml");
    let common = [
        "n_envs=64",
        "replay_buffer.capacity=2000",
        "replay_buffer.warmup=100",
        "replay_buffer.priority=",
        "level_replay=",
        "learning.batch=500",
    ];
    let settings: Vec<String> = common.iter().chain(settings).map(|setting| (*setting).to_owned()).collect();
    Config::read_with(&file, &settings).unwrap()
}

/// The mirror where the training file asks for it.
fn mirror_of(config: &Config, mirror: &Mirror) -> Option<Mirror> {
    config.learning.mirror_augmentation.then(|| mirror.clone())
}

fn seeds(config: &Config) -> Seeds {
    Seeds { episodes: config.seed, acting: 7, sampling: 8 }
}

/// One step of one truck.
struct Step<const N: usize> {
    seen: [f32; N],
    action: u32,
    reward: f32,
    ended: u32,
    next: [f32; N],
}

/// The numbers of a buffer.
fn host<const N: usize>(rollout: &DeviceRollout<N>, slice: &Slice) -> Vec<f32> {
    crate::device::numbers(&rollout.gpu, slice).unwrap()
}

/// An actor with the same output whatever it sees.
fn constant(gpu: &Device, logits: Vec<f32>) -> Network {
    let n_actions = logits.len();
    let layer = Layer { weights: vec![0.0; N_VALUES * n_actions], biases: logits };
    Network::of(gpu, &Mlp::of(&[layer], &burn::tensor::Device::flex()))
}

/// A buffer of the replay buffer, read.
fn held<T: bytemuck::AnyBitPattern, const N: usize>(rollout: &DeviceRollout<N>, binding: Binding) -> Vec<T> {
    let bytes = rollout.gpu.read(std::slice::from_ref(rollout.buffers.slice(binding))).unwrap();
    bytes[0].chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect()
}

#[test]
fn samples_are_the_transitions_that_were_driven_normalised_noisy_and_mirrored_as_asked() {
    check_samples::<N_VALUES>("attard2023");
}

#[test]
fn samples_have_the_extras_that_a_benchmark_observes() {
    check_samples::<MASS>("laden2026");
}

#[test]
fn samples_have_what_a_benchmark_observes_of_vehicles() {
    check_samples::<{ N_VALUES + N_AROUND }>("traffic2026");
}

#[test]
fn networks_act_by_the_values_the_first_extras_and_then_the_vehicles() {
    const BOTH: usize = N_VALUES + ObservedExtras::Mass.n_extras() + N_AROUND;
    let mut scenario = Scenario::named("traffic2026").unwrap();
    scenario.keep(&[Split::Test]);
    scenario.extras = ObservedExtras::Mass;
    let (world, routes) = (Arc::new(World::bake(&scenario).unwrap()), scenario.split(Split::Test).to_vec());
    let mut rollout = DeviceRollout::<BOTH>::new(&least(), &config(&[]), &world, routes, None).unwrap();
    rollout.step_at_random().unwrap();
    rollout.wait().unwrap();
    rollout.submit(&[Kernel::Look]);
    let acted_by = host(&rollout, rollout.buffers.slice(Binding::seen));
    let batch = rollout.simulator().batch();
    let seen = observed::<BOTH>(&batch.observation, &batch.extras, &batch.around);
    let clipped: Vec<f32> = seen.iter().flatten().map(|value| value.clamp(-LIMIT, LIMIT)).collect();
    assert!(batch.around.iter().flatten().any(|&value| value != 0.0));
    assert_eq!(acted_by, clipped);
}

/// Compares samples of a benchmark whose networks observe `N` values with the steps that were made.
fn check_samples<const N: usize>(benchmark: &str) {
    let (world, routes) = training_of(benchmark);
    let gpu = least();
    let mirror = Mirror::of(&world).unwrap();
    for settings in [
        ["learning.mirror_augmentation=true", "learning.observation_noise=0.2"],
        ["learning.mirror_augmentation=false", "learning.observation_noise=0"],
    ] {
        let config = config(&settings);
        let (n_envs, n_steps, seeds) = (config.n_envs, config.learning.n_steps, seeds(&config));
        let mut rollout =
            DeviceRollout::<N>::with_seeds(&gpu, &config, &world, routes.clone(), mirror_of(&config, &mirror), seeds)
                .unwrap();
        let mut history: Vec<Vec<Step<N>>> = Vec::new();
        // Three times round the ring of 32 steps.
        for _ in 0..100 {
            let batch = rollout.simulator().batch();
            let seen = observed::<N>(&batch.observation, &batch.extras, &batch.around).into_owned();
            rollout.step_at_random().unwrap();
            let batch = rollout.simulator().batch();
            let next = observed::<N>(&batch.next_observation, &batch.next_extras, &batch.next_around);
            history.push(
                (0..n_envs)
                    .map(|env| Step {
                        seen: seen[env],
                        action: batch.action[env],
                        reward: batch.reward[env],
                        ended: batch.ended[env],
                        next: next[env],
                    })
                    .collect(),
            );
        }
        let normalisation =
            Normalisation { mean: vec![0.25; N], factor: (0..N).map(|index| 1.0 + index as f32).collect() };
        rollout.set_normalisation(&normalisation);
        let sample = rollout.sample().unwrap().on_device().unwrap();
        let (observation, next) = (host(&rollout, &sample.observation), host(&rollout, &sample.next_observation));
        let (reward, discount) = (host(&rollout, &sample.reward), host(&rollout, &sample.discount));
        let action: Vec<i32> = held(&rollout, Binding::sampled_action);
        let n_slots = config.replay_buffer.capacity.div_ceil(n_envs);
        let (mut ends, mut mirrored) = (0, 0);
        for row in 0..config.learning.batch {
            let drawn = words(seeds.sampling, row as u32, 0, 0);
            let first = 100 - n_slots + index_below(drawn[0], (n_slots - n_steps) as u32) as usize;
            let env = index_below(drawn[1], n_envs as u32) as usize;
            let (mut sum, mut weight, mut last) = (0.0f32, 1.0f32, first);
            for (step, trucks) in history.iter().enumerate().skip(first).take(n_steps) {
                last = step;
                sum += weight * trucks[env].reward;
                weight *= config.learning.gamma as f32;
                let ended = Ended::from_code(trucks[env].ended).unwrap();
                if ended.terminated() {
                    weight = 0.0;
                }
                if ended != Ended::Running {
                    ends += 1;
                    break;
                }
            }
            let is_mirrored = config.learning.mirror_augmentation && drawn[2] & 1 == 1;
            mirrored += usize::from(is_mirrored);
            let image = |seen: &[f32; N]| if is_mirrored { mirror.observation(seen) } else { *seen };
            let expected_action = history[first][env].action;
            let expected_action =
                if is_mirrored { mirror.images().1[expected_action as usize] } else { expected_action };
            assert_eq!(action[row], expected_action as i32);
            assert_eq!(discount[row], weight);
            let expected_reward = sum * config.learning.reward_scale as f32;
            assert!(
                (reward[row] - expected_reward).abs() <= 1e-5 * expected_reward.abs().max(1.0),
                "{} {expected_reward}",
                reward[row]
            );
            for (found, seen) in [(&observation, &history[first][env].seen), (&next, &history[last][env].next)] {
                let expected = normalisation.apply(&[image(seen)]);
                for value in 0..N {
                    let noise = config.learning.observation_noise as f32
                        * signed_unit(words(seeds.sampling, row as u32, 0, 1 + value as u32)[0]);
                    let difference = found[row * N + value] - (expected[value] + noise);
                    // Normalised values lie within 10.
                    assert!(difference.abs() < 1e-5, "{value}: {difference}");
                }
            }
        }
        assert!(20 < ends, "{ends} episodes ended");
        assert_eq!(config.learning.mirror_augmentation, 200 < mirrored);
    }
}

#[test]
fn the_replay_buffer_has_the_simulators_rewards_and_more_for_an_arrival_where_that_is_asked_for() {
    let (world, routes) = training();
    let gpu = least();
    let policy = Policy::shipped("attard2023").unwrap();
    let actor = Actor::Device(Network::of(&gpu, &Mlp::of_policy(&policy)));
    for (setting, arrival) in [("seed=0", 0.0), ("learning.arrival=1500", 1500.0)] {
        let config = config(&["n_envs=16", "replay_buffer.capacity=4000", setting]);
        let mut rollout =
            DeviceRollout::<N_VALUES>::with_seeds(&gpu, &config, &world, routes.clone(), None, seeds(&config)).unwrap();
        rollout.set_normalisation(&policy.normalisation);
        let (mut expected, mut arrivals) = (Vec::new(), 0);
        for _ in 0..250 {
            rollout.step(&actor, 0).unwrap();
            let batch = rollout.simulator().batch();
            expected.extend(batch.reward.iter().zip(&batch.ended).map(|(&reward, &code)| {
                let arrived = code == Ended::Arrived as u32;
                arrivals += u32::from(arrived);
                if arrived { reward + arrival } else { reward }
            }));
        }
        assert_eq!(held::<f32, N_VALUES>(&rollout, Binding::held_reward), expected);
        assert!(0 < arrivals, "no truck arrived");
    }
}

#[test]
fn actions_follow_the_actors_distribution() {
    let (world, routes) = training();
    let gpu = least();
    let config = config(&["n_envs=4096", "replay_buffer.capacity=100000"]);
    let mut rollout =
        DeviceRollout::<N_VALUES>::with_seeds(&gpu, &config, &world, routes, None, seeds(&config)).unwrap();
    // Probabilities of 1/45, 2/45, ... 9/45.
    let actor = constant(&gpu, (1..=9).map(|rank| (rank as f32).ln()).collect());
    let mut counts = [0usize; 9];
    for _ in 0..5 {
        rollout.step_by(Some(&actor), true).unwrap();
        rollout.simulator().batch().action.iter().for_each(|&action| counts[action as usize] += 1);
    }
    let n = 5.0 * 4096.0;
    for (rank, count) in counts.into_iter().enumerate() {
        let fraction = (rank + 1) as f64 / 45.0;
        // Five standard deviations of a count.
        assert!(
            (count as f64 - n * fraction).abs() < 5.0 * (n * fraction * (1.0 - fraction)).sqrt(),
            "{rank}: {count}"
        );
    }
}

#[test]
fn trucks_take_the_actions_of_the_latest_output() {
    let (world, routes) = training();
    let gpu = least();
    let config = config(&["learning.mirror_augmentation=false"]);
    let mut rollout =
        DeviceRollout::<N_VALUES>::with_seeds(&gpu, &config, &world, routes, None, seeds(&config)).unwrap();
    for step in 0..40 {
        let actor = constant(&gpu, (0..9).map(|action| if action == step % 9 { 50.0 } else { 0.0 }).collect());
        rollout.step_by(Some(&actor), true).unwrap();
        assert!(rollout.simulator().batch().action.iter().all(|&action| action as usize == step % 9), "{step}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn no_kernel_of_the_replay_buffer_spills_or_takes_more_registers_and_memory_of_a_card_than_stated() {
    use crate::device::null_device::{Stated, check, stated};
    let most: [Stated; Kernel::ALL.len()] = [
        stated("look", 48, 0, 0),
        stated("choose", 48, 0, 0),
        stated("store_before", 48, 0, 0),
        stated("store_after", 48, 0, 0),
        stated("count_ends", 48, 0, 0),
        stated("admit", 48, 0, 0),
        stated("sum_blocks", 48, 0, 0),
        stated("add_up", 48, 512, 0),
        stated("pick", 48, 0, 0),
        stated("pick_by_priority", 48, 0, 0),
        stated("weigh", 48, 512, 0),
        stated("set_priorities", 48, 0, 0),
        stated("sample", 48, 0, 0),
        stated("sample_next", 48, 0, 0),
    ];
    assert_eq!(most.each_ref().map(|stated| stated.kernel), Kernel::ALL.map(Kernel::name));
    let test = "rollout::device::tests::\
                no_kernel_of_the_replay_buffer_spills_or_takes_more_registers_and_memory_of_a_card_than_stated";
    check(test, &memory_kernels::source(), &most);
}
