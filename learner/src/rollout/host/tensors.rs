//! Samples and observations of the host as the tensors of networks.

use burn::tensor::{Device, Tensor, TensorData};
use offtrack_policy::Normalisation;
use rand::Rng;

use crate::config::Learning;
use crate::network::Mlp;
use crate::replay_buffer::Sample;
use crate::sac::Transitions;
use crate::shards::N_SHARDS;

/// A sample as tensors, in [`N_SHARDS`] shards of nearly the same size. Both observations of a transition get the same
/// noise, so that their difference stays what it is.
pub fn shards<const N: usize>(
    sample: &Sample<N>,
    normalisation: &Normalisation,
    learning: &Learning,
    rng: &mut impl Rng,
) -> Vec<Transitions> {
    let device = Device::flex();
    let n_rows = sample.action.len();
    let (reward_scale, noise) = (learning.reward_scale as f32, learning.observation_noise as f32);
    let mut shard = |index: usize| {
        let rows = n_rows * index / N_SHARDS..n_rows * (index + 1) / N_SHARDS;
        let shape = [rows.len(), 1];
        let actions: Vec<i32> = sample.action[rows.clone()].iter().map(|&action| action as i32).collect();
        let rewards: Vec<f32> = sample.reward[rows.clone()].iter().map(|reward| reward * reward_scale).collect();
        let mut normalised =
            [&sample.observation, &sample.next_observation].map(|column| normalisation.apply(&column[rows.clone()]));
        if 0.0 < noise {
            let [observation, next] = &mut normalised;
            for (value, next) in observation.iter_mut().zip(next) {
                let added = rng.random_range(-noise..noise);
                *value += added;
                *next += added;
            }
        }
        let [observation, next_observation] =
            normalised.map(|values| Tensor::from_data(TensorData::new(values, [rows.len(), N]), &device));
        Transitions {
            observation,
            action: Tensor::from_data(TensorData::new(actions, shape), &device),
            reward: Tensor::from_data(TensorData::new(rewards, shape), &device),
            discount: Tensor::from_data(TensorData::new(sample.discount[rows.clone()].to_vec(), shape), &device),
            next_observation,
            weight: Tensor::from_data(TensorData::new(sample.weight[rows].to_vec(), shape), &device),
        }
    };
    (0..N_SHARDS).map(&mut shard).collect()
}

/// The network's output for each observation, `[rows * actions]`.
pub fn logits<const N: usize>(network: &Mlp, normalisation: &Normalisation, observations: &[[f32; N]]) -> Vec<f32> {
    logits_of_normalised(network, normalisation.apply(observations), N)
}

/// The network's output for normalised observations of `n_values` each, one after the other, `[rows * actions]`.
pub(super) fn logits_of_normalised(network: &Mlp, observations: Vec<f32>, n_values: usize) -> Vec<f32> {
    let shape = [observations.len() / n_values, n_values];
    let data = TensorData::new(observations, shape);
    let output = network.forward(Tensor::from_data(data, &Device::flex())).into_data();
    output.try_to_vec().expect("the layers' weights are f32, and so is their output")
}
