use super::*;
use crate::learner::bridge::device::Shared;
use crate::learner::config::{Critics, Entropy as EntropyConfig};
use burn::tensor::Int;
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};

const N_VALUES: usize = 6;
const N_ACTIONS: usize = 4;
const N_ROWS: usize = 32;

fn learning(in_target: bool, layer_norm: bool, value_clip: Option<f64>) -> Learning {
    Learning {
        hidden: vec![16, 16],
        batch: N_ROWS,
        updates_per_step: 1,
        n_steps: 1,
        discount: 0.9,
        reward_scale: 1.0,
        scale_observations: false,
        observation_noise: 0.0,
        mirror: false,
        actor_rate: 0.003,
        critic_rate: 0.003,
        last_rate: 1.0,
        layer_norm,
        value_clip,
        categories: None,
        critics: if in_target { Critics::Average } else { Critics::Lowest },
        target_rate: 0.1,
        target_every: 2,
        average_rate: 0.1,
        entropy: EntropyConfig { in_target, share: Some(0.5), weight: 0.1, rate: 0.01 },
    }
}

/// The same random batch on any device.
fn batch(seed: u64, device: &Device) -> Transitions {
    let mut rng = SmallRng::seed_from_u64(seed);
    let mut floats = |width: usize, low: f32| -> Tensor<2> {
        let values: Vec<f32> = (0..N_ROWS * width).map(|_| rng.random_range(low..1.0)).collect();
        Tensor::from_data(TensorData::new(values, [N_ROWS, width]), device)
    };
    let (observation, next_observation) = (floats(N_VALUES, -1.0), floats(N_VALUES, -1.0));
    let (reward, discount, weight) = (floats(1, -1.0), floats(1, 0.0), floats(1, 0.5));
    let actions: Vec<i32> = (0..N_ROWS).map(|_| rng.random_range(0..N_ACTIONS as i32)).collect();
    let action = Tensor::<2, Int>::from_data(TensorData::new(actions, [N_ROWS, 1]), device);
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
fn updates_move_the_learner_as_they_do_on_the_processor() {
    let shared = Shared::open(None).unwrap();
    for learning in [learning(true, false, None), learning(false, true, Some(0.2))] {
        let mut host = Sac::new(&learning, N_VALUES, N_ACTIONS, 3).unwrap();
        let mut begun = Sac::new(&learning, N_VALUES, N_ACTIONS, 3).unwrap();
        let mut device = DeviceSac::new(&host, &shared.tensors);
        let mut sums = Update::default();
        for step in 0..3 {
            let (update, _) = host.update(vec![batch(step, &Device::flex())], 0.5);
            sums.critic_loss += update.critic_loss;
            sums.actor_loss += update.actor_loss;
            sums.entropy += update.entropy;
            sums.value += update.value;
            device.update(batch(step, &shared.tensors), 0.5);
        }
        let read = device.to_host(Sac::new(&learning, N_VALUES, N_ACTIONS, 4).unwrap());
        // Sums in another order: a few units in the last place of gradients, divided by their own size plus 1e-5 in Adam's first steps.
        let (difference, name) = furthest(&host, &read);
        assert!(difference < 2e-4, "{name}: {difference}");
        // Three steps of 0.0015 are seen.
        begun.update(vec![batch(0, &Device::flex())], 0.0);
        assert!(0.003 < furthest(&host, &begun).0);
        let (found, n_updates) = device.summed();
        assert_eq!(n_updates, 3);
        for (found, expected) in [
            (found.critic_loss, sums.critic_loss),
            (found.actor_loss, sums.actor_loss),
            (found.entropy, sums.entropy),
            (found.value, sums.value),
        ] {
            assert!((found - expected).abs() < 1e-3 * expected.abs().max(1.0), "{found} {expected}");
        }
        assert_eq!(device.summed().1, 0);
    }
}

#[test]
fn a_learner_goes_to_the_device_and_back_unchanged() {
    let shared = Shared::open(None).unwrap();
    let learning = learning(true, true, None);
    let mut host = Sac::new(&learning, N_VALUES, N_ACTIONS, 3).unwrap();
    host.update(vec![batch(1, &Device::flex())], 1.0);
    let back = DeviceSac::new(&host, &shared.tensors).to_host(Sac::new(&learning, N_VALUES, N_ACTIONS, 4).unwrap());
    assert_eq!(host.numbers(), back.numbers());
}
