//! The learner on a device beside the learner on the host.

#![cfg(feature = "gpu")]

use super::device::DeviceSac;
use super::*;
use crate::checkpoint::{Columns, Stored};
use crate::config::{Critics, Entropy};
use crate::device::{self, Batch, numbers};
use burn::tensor::TensorData;
use offtrack::gpu;
use rand::Rng;

/// A small learner's settings.
fn learning() -> Learning {
    Learning {
        hidden: vec![16, 16],
        batch: 32,
        updates_per_step: 1,
        n_steps: 1,
        gamma: 0.9,
        reward_scale: 1.0,
        arrival: None,
        normalise_observations: false,
        observation_noise: 0.0,
        mirror_augmentation: false,
        actor_learning_rate: 0.003,
        critic_learning_rate: 0.003,
        final_learning_rate_fraction: 1.0,
        layer_norm: false,
        critics: Critics::Mean,
        tau: 0.1,
        target_interval: 2,
        actor_ema_rate: 0.1,
        actor_delay: 0,
        entropy: Entropy { in_target: true, target_fraction: Some(0.5), coefficient: 0.1, learning_rate: 0.01 },
    }
}

/// A random batch of 32 transitions with 6 values and 4 actions, on the host and on a device.
fn random_batch(seed: u64, gpu: &gpu::Device) -> [Sample; 2] {
    let mut rng = SmallRng::seed_from_u64(seed);
    let mut floats =
        |width: usize, low: f32| -> Vec<f32> { (0..32 * width).map(|_| rng.random_range(low..1.0)).collect() };
    let (observation, next_observation) = (floats(6, -1.0), floats(6, -1.0));
    let (reward, discount, weight) = (floats(1, -1.0), floats(1, 0.0), floats(1, 0.5));
    let action: Vec<i32> = (0..32).map(|_| rng.random_range(0..4)).collect();
    let filled = |values: &[f32]| gpu.filled("sample", bytemuck::cast_slice(values));
    let on_device = Batch {
        observation: filled(&observation),
        action: gpu.filled("sample", bytemuck::cast_slice(&action)),
        reward: filled(&reward),
        discount: filled(&discount),
        next_observation: filled(&next_observation),
        weight: filled(&weight),
    };
    let matrix = |values: Vec<f32>| -> Tensor<2> {
        let width = values.len() / 32;
        Tensor::from_data(TensorData::new(values, [32, width]), &Device::flex())
    };
    let on_host = Transitions {
        observation: matrix(observation),
        action: Tensor::<2, Int>::from_data(TensorData::new(action, [32, 1]), &Device::flex()),
        reward: matrix(reward),
        discount: matrix(discount),
        next_observation: matrix(next_observation),
        weight: matrix(weight),
    };
    [Sample::Host(vec![on_host]), Sample::Device(Box::new(on_device))]
}

/// All numbers of a learner, as it saves them.
fn saved(learner: &dyn Learner) -> Stored {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("checkpoint.safetensors");
    let mut columns = Columns::default();
    learner.save(&mut columns);
    columns.write(&file, String::new(), 0).unwrap();
    Stored::read(&file).unwrap()
}

/// A learner on the processor with another one's numbers.
fn copied(learner: &dyn Learner, learning: &Learning) -> Sac {
    let mut copy = Sac::new(learning, 6, 4, 9).unwrap();
    copy.restore(&saved(learner)).unwrap();
    copy
}

/// The largest difference between all numbers of two learners, and where it is.
fn furthest(a: &Sac, b: &Sac) -> (f32, String) {
    let pairs = a.numbers().into_iter().zip(b.numbers());
    let each = pairs.map(|((name, a), (other, b))| {
        assert_eq!((&name, a.len()), (&other, b.len()));
        (a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max), name)
    });
    each.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

#[test]
fn an_update_on_a_device_is_that_on_the_host() {
    let gpu = device::least();
    let actor_alone = Entropy { in_target: false, ..learning().entropy };
    for learning in [
        learning(),
        // Layers wider than a tile and narrower than one, and one that is neither.
        Learning { hidden: vec![40, 7, 70], actor_delay: 1, ..learning() },
        Learning { layer_norm: true, critics: Critics::Minimum, entropy: actor_alone, ..learning() },
        Learning { hidden: vec![70, 9], layer_norm: true, ..learning() },
    ] {
        let mut host = Sac::new(&learning, 6, 4, 3).unwrap();
        let mut on_device = DeviceSac::new(&gpu, &learning, 6, 4, 3).unwrap();
        assert_eq!(copied(&on_device, &learning).numbers(), host.numbers());
        for step in 0..3 {
            let [here, there] = random_batch(step, &gpu);
            let expected = host.update(here, 0.5).unwrap().on_host().unwrap().remove(0);
            let expected = expected.into_data().try_to_vec::<f32>().unwrap();
            let found = on_device.update(there, 0.5).unwrap().on_device().unwrap();
            let found = numbers(&gpu, &found).unwrap();
            let furthest = expected.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(furthest < 1e-3, "{furthest} in step {step}");
        }
        // Sums in another order: a few units in the last place of gradients, divided by their own size plus 1e-5 in
        // Adam's first steps.
        let (difference, name) = furthest(&host, &copied(&on_device, &learning));
        assert!(difference < 3e-4, "{name}: {difference} with {learning:?}");
        let mut begun = Sac::new(&learning, 6, 4, 3).unwrap();
        let [here, _] = random_batch(0, &gpu);
        begun.update(here, 0.0).unwrap();
        assert!(0.003 < furthest(&host, &begun).0, "three steps of 0.0015 are seen");
        assert!((on_device.entropy_coefficient() - host.entropy_coefficient()).abs() < 1e-4);
        let ((found, n_updates), (expected, _)) = (on_device.take_sums(), host.take_sums());
        assert_eq!((n_updates, on_device.take_sums()), (3, (Update::default(), 0)));
        for (found, expected) in [
            (found.critic_loss, expected.critic_loss),
            (found.actor_loss, expected.actor_loss),
            (found.entropy, expected.entropy),
            (found.value, expected.value),
        ] {
            assert!((found - expected).abs() < 1e-3 * expected.abs().max(1.0), "{found} {expected}");
        }
        let actor = on_device.actor();
        let network = actor.on_device().unwrap();
        let learned = numbers(&gpu, &network.parameters).unwrap();
        let expected: Vec<f32> = host.actor.parameters().into_iter().flat_map(|(_, values)| values).collect();
        assert_eq!(network.n_parameters(), expected.len());
        assert!(learned.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 3e-4));
    }
}

#[test]
fn a_learner_restored_on_a_device_has_the_numbers_of_the_host() {
    let gpu = device::least();
    let learning = Learning { layer_norm: true, ..learning() };
    let mut host = Sac::new(&learning, 6, 4, 3).unwrap();
    let [here, _] = random_batch(1, &gpu);
    host.update(here, 1.0).unwrap();
    let mut restored = DeviceSac::new(&gpu, &learning, 6, 4, 4).unwrap();
    restored.restore(&saved(&host)).unwrap();
    assert_eq!(copied(&restored, &learning).numbers(), host.numbers());
    assert!(restored.broken().is_none());
    assert_eq!(restored.take_sums(), host.take_sums());
    restored.set_actor(&host.actor_ema());
    assert_eq!(restored.actor_ema().parameters(), host.actor_ema().parameters());
    assert_ne!(host.actor.parameters(), host.actor_ema().parameters());
}

#[test]
fn a_sample_of_another_memory_is_refused() {
    let gpu = device::least();
    let mut host = Sac::new(&learning(), 6, 4, 3).unwrap();
    let mut on_device = DeviceSac::new(&gpu, &learning(), 6, 4, 3).unwrap();
    let [here, there] = random_batch(0, &gpu);
    for refused in [host.update(there, 1.0).err(), on_device.update(here, 1.0).err()] {
        assert!(refused.unwrap().to_string().contains("the sample must be where the trucks and the learner are"));
    }
}

#[test]
fn a_batch_that_does_not_fit_into_a_buffer_is_refused_with_what_would() {
    let gpu = device::least();
    for (batch, hidden) in [(1 << 20, vec![8192, 8]), (20_000, vec![512])] {
        let learning = Learning { batch, hidden, ..learning() };
        let refused = DeviceSac::new(&gpu, &learning, 6, 4, 3).err().unwrap().to_string();
        for part in [format!("learning.batch: {batch}; "), gpu.name(), "a smaller batch, or smaller layers".to_owned()]
        {
            assert!(refused.contains(&part), "{refused}");
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn no_kernel_of_the_learner_spills_or_takes_more_registers_and_memory_of_a_card_than_stated() {
    use super::device::kernels::{Kernel, source};
    use crate::device::null_device::{Stated, check, stated};
    let most: [Stated; Kernel::ALL.len()] = [
        stated("gather", 24, 0, 0),
        stated("multiply", 96, 9216, 0),
        stated("normalise", 48, 1024, 0),
        stated("find_errors", 48, 0, 0),
        stated("sum_norms", 48, 1024, 0),
        stated("normalise_back", 48, 1024, 0),
        stated("add_figures", 48, 1024, 0),
        stated("move_parameters", 48, 0, 0),
    ];
    assert_eq!(most.each_ref().map(|stated| stated.kernel), Kernel::ALL.map(Kernel::name));
    let test = "sac::device_tests::\
                no_kernel_of_the_learner_spills_or_takes_more_registers_and_memory_of_a_card_than_stated";
    check(test, &source(), &most);
}
