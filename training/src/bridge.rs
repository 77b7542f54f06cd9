//! From columns to tensors: the only file that names both.

use burn::tensor::{Device, Tensor, TensorData};
use offtrack::layout::N_VALUES;
use offtrack::simulator::Batch;

use crate::memory::{Memory, Rows, Sample};
use crate::network::Mlp;
use crate::sac::{N_PARTS, Transitions};
use crate::scaling::Scaling;

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

/// A sample as the learner takes it, in [`N_PARTS`] parts of nearly the same size.
pub fn parts<const N: usize>(sample: &Sample<N>, scaling: &Scaling, reward_scale: f32) -> Vec<Transitions> {
    let device = Device::flex();
    let n_rows = sample.action.len();
    let part = |index: usize| {
        let rows = n_rows * index / N_PARTS..n_rows * (index + 1) / N_PARTS;
        let shape = [rows.len(), 1];
        let actions: Vec<i32> = sample.action[rows.clone()].iter().map(|&action| action as i32).collect();
        let rewards: Vec<f32> = sample.reward[rows.clone()].iter().map(|reward| reward * reward_scale).collect();
        Transitions {
            observation: observations(&sample.observation[rows.clone()], scaling),
            action: Tensor::from_data(TensorData::new(actions, shape), &device),
            reward: Tensor::from_data(TensorData::new(rewards, shape), &device),
            discount: Tensor::from_data(TensorData::new(sample.discount[rows.clone()].to_vec(), shape), &device),
            next_observation: observations(&sample.next_observation[rows.clone()], scaling),
            weight: Tensor::from_data(TensorData::new(sample.weight[rows].to_vec(), shape), &device),
        }
    };
    (0..N_PARTS).map(part).collect()
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
