//! From columns to tensors: the only file that names both.

#[cfg(feature = "gpu")]
pub mod device;

use burn::tensor::{Device, Tensor, TensorData};
use offtrack::layout::N_VALUES;
use offtrack::simulator::Batch;
use rand::Rng;

use crate::learner::config::Learning;
use crate::learner::network::Mlp;
use crate::learner::normalisation::Scaling;
use crate::learner::replay_buffer::{Memory, Rows, Sample};
use crate::learner::sac::{N_PARTS, Transitions};

/// Keeps the step just made; `seen` is the column of observations as it was before it.
pub fn remember(memory: &mut Memory<N_VALUES>, seen: &[[f32; N_VALUES]], batch: &Batch) {
    memory.append(Rows {
        observation: seen,
        action: &batch.action,
        reward: &batch.reward,
        ended: &batch.ended,
        next_observation: &batch.next_observation,
    });
}

/// A sample as the learner takes it, in [`N_PARTS`] parts of nearly the same size. Both observations of a transition get the same noise, so
/// that what changes between them stays what it is.
pub fn parts<const N: usize>(sample: &Sample<N>, scaling: &Scaling, learning: &Learning, rng: &mut impl Rng) -> Vec<Transitions> {
    let device = Device::flex();
    let n_rows = sample.action.len();
    let (reward_scale, noise) = (learning.reward_scale as f32, learning.observation_noise as f32);
    let mut part = |index: usize| {
        let rows = n_rows * index / N_PARTS..n_rows * (index + 1) / N_PARTS;
        let shape = [rows.len(), 1];
        let actions: Vec<i32> = sample.action[rows.clone()].iter().map(|&action| action as i32).collect();
        let rewards: Vec<f32> = sample.reward[rows.clone()].iter().map(|reward| reward * reward_scale).collect();
        let mut seen = [&sample.observation, &sample.next_observation].map(|column| scaling.apply(&column[rows.clone()]));
        if 0.0 < noise {
            let [observation, next] = &mut seen;
            for (value, next) in observation.iter_mut().zip(next) {
                let added = rng.random_range(-noise..noise);
                *value += added;
                *next += added;
            }
        }
        let [observation, next_observation] = seen.map(|values| Tensor::from_data(TensorData::new(values, [rows.len(), N]), &device));
        Transitions {
            observation,
            action: Tensor::from_data(TensorData::new(actions, shape), &device),
            reward: Tensor::from_data(TensorData::new(rewards, shape), &device),
            discount: Tensor::from_data(TensorData::new(sample.discount[rows.clone()].to_vec(), shape), &device),
            next_observation,
            weight: Tensor::from_data(TensorData::new(sample.weight[rows].to_vec(), shape), &device),
        }
    };
    (0..N_PARTS).map(&mut part).collect()
}

/// An actor's output for each observation, `[rows * actions]`.
pub fn logits<const N: usize>(actor: &Mlp, scaling: &Scaling, rows: &[[f32; N]]) -> Vec<f32> {
    let data = actor.forward(observations(rows, scaling)).into_data();
    data.try_to_vec().expect("the layers' weights are f32, and so is what they give")
}

/// Scaled observations as a tensor, `[rows, values]`.
fn observations<const N: usize>(rows: &[[f32; N]], scaling: &Scaling) -> Tensor<2> {
    Tensor::from_data(TensorData::new(scaling.apply(rows), [rows.len(), N]), &Device::flex())
}
