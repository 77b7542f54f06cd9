//! The learner on a device beside the learner on the host.

use super::*;
use crate::checkpoint::{Columns, Stored};
use crate::config::{Critics, Entropy};
use burn::tensor::TensorData;
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

/// Where a device's part of the learner can run: on the processor's tensors, and on a device where there is one.
fn devices() -> Vec<Device> {
    Vec::from([
        Device::flex(),
        #[cfg(feature = "gpu")]
        crate::rollout::device::Shared::least().unwrap().tensors,
    ])
}

/// A random batch of 32 transitions with 6 values and 4 actions, the same on every device.
fn random_batch(seed: u64, device: &Device) -> Transitions {
    let mut rng = SmallRng::seed_from_u64(seed);
    let mut floats = |width: usize, low: f32| -> Tensor<2> {
        let values: Vec<f32> = (0..32 * width).map(|_| rng.random_range(low..1.0)).collect();
        Tensor::from_data(TensorData::new(values, [32, width]), device)
    };
    let (observation, next_observation) = (floats(6, -1.0), floats(6, -1.0));
    let (reward, discount, weight) = (floats(1, -1.0), floats(1, 0.0), floats(1, 0.5));
    let actions: Vec<i32> = (0..32).map(|_| rng.random_range(0..4)).collect();
    let action = Tensor::<2, Int>::from_data(TensorData::new(actions, [32, 1]), device);
    Transitions { observation, action, reward, discount, next_observation, weight }
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
    for device in devices() {
        let actor_alone = Entropy { in_target: false, ..learning().entropy };
        for learning in
            [learning(), Learning { layer_norm: true, critics: Critics::Minimum, entropy: actor_alone, ..learning() }]
        {
            let new = |seed, placement| Sac::new(&learning, 6, 4, seed, placement).unwrap();
            let (mut host, mut on_device) = (new(3, Placement::Host), new(3, Placement::Device(device.clone())));
            for step in 0..3 {
                host.update(vec![random_batch(step, &Device::flex())], 0.5);
                on_device.update(vec![random_batch(step, &device)], 0.5);
            }
            // Sums in another order: a few units in the last place of gradients, divided by their own size plus 1e-5 in
            // Adam's first steps.
            let (difference, name) = furthest(&host, &on_device);
            assert!(difference < 3e-4, "{name}: {difference}");
            let mut begun = new(3, Placement::Host);
            begun.update(vec![random_batch(0, &Device::flex())], 0.0);
            assert!(0.003 < furthest(&host, &begun).0, "three steps of 0.0015 are seen");
            let ((found, n_updates), (expected, _)) = (on_device.take_sums(), host.take_sums());
            assert_eq!((n_updates, on_device.take_sums().1), (3, 0));
            for (found, expected) in [
                (found.critic_loss, expected.critic_loss),
                (found.actor_loss, expected.actor_loss),
                (found.entropy, expected.entropy),
                (found.value, expected.value),
            ] {
                assert!((found - expected).abs() < 1e-3 * expected.abs().max(1.0), "{found} {expected}");
            }
        }
    }
}

#[test]
fn a_learner_restored_on_a_device_has_the_numbers_of_the_host() {
    let learning = Learning { layer_norm: true, ..learning() };
    let mut host = Sac::new(&learning, 6, 4, 3, Placement::Host).unwrap();
    host.update(vec![random_batch(1, &Device::flex())], 1.0);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("checkpoint.safetensors");
    let mut columns = Columns::default();
    host.save(&mut columns);
    columns.write(&file, String::new(), 0).unwrap();
    for device in devices() {
        let mut restored = Sac::new(&learning, 6, 4, 4, Placement::Device(device)).unwrap();
        restored.restore(&Stored::read(&file).unwrap()).unwrap();
        assert_eq!(restored.numbers(), host.numbers());
        assert_eq!(restored.take_sums(), (Update { ..host.take_sums().0 }, 1));
        host.restore(&Stored::read(&file).unwrap()).unwrap();
    }
}
