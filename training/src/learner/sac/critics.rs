//! The two critics: how their outputs are read as values, and what they learn.
//!
//! A critic gives one value an action or, with categories, a histogram of values (M. Bellemare, W. Dabney and R. Munos, "A Distributional
//! Perspective on Reinforcement Learning", 2017).

use burn::module::Module;
use burn::tensor::activation::{log_softmax, softmax};
use burn::tensor::{Device, Int, Tensor, TensorData};

use crate::learner::config::{Categories, Critics, Learning};
use crate::learner::network::Mlp;

/// Two critics that read alike, begin apart and err apart.
#[derive(Module, Debug, Default)]
pub(super) struct Twins {
    pub(super) first: Mlp,
    pub(super) second: Mlp,
}

impl Twins {
    /// The same critics on a device.
    #[cfg(feature = "gpu")]
    pub(super) fn on(&self, device: &Device) -> Twins {
        Twins { first: self.first.on(device), second: self.second.on(device) }
    }

    /// Output of each critic, `[B, A]` or `[B, A * categories]` twice.
    pub(super) fn forward(&self, observation: Tensor<2>) -> [Tensor<2>; 2] {
        [self.first.forward(observation.clone()), self.second.forward(observation)]
    }
}

/// What the critics are to give for the actions taken.
pub(super) struct Goal {
    /// The value, `[B, 1]`.
    pub(super) value: Tensor<2>,
    /// With categories: their shares, `[B, categories]`.
    histogram: Option<Tensor<2>>,
}

/// What the next state is worth to the policy. Shapes are `[B, 1]` where none is named.
pub(super) struct Following<'a> {
    /// The policy's probabilities there, `[B, A]`.
    pub(super) probs: Tensor<2>,
    /// The targets' outputs there.
    pub(super) outputs: [Tensor<2>; 2],
    /// Worth of the entropy there.
    pub(super) bonus: Option<Tensor<2>>,
    /// Sum of rewards on the way.
    pub(super) reward: &'a Tensor<2>,
    /// Weight of what follows.
    pub(super) discount: &'a Tensor<2>,
}

/// How outputs are read.
#[derive(Debug, Clone)]
pub(super) struct Reading {
    n_actions: usize,
    critics: Critics,
    categories: Option<Categories>,
    value_clip: Option<f64>,
}

impl Reading {
    pub(super) fn new(learning: &Learning, n_actions: usize) -> Reading {
        Reading { n_actions, critics: learning.critics, categories: learning.categories, value_clip: learning.value_clip }
    }

    /// Entries of the action table.
    #[cfg(feature = "gpu")]
    pub(super) fn n_actions(&self) -> usize {
        self.n_actions
    }

    /// Size of a critic's output.
    pub(super) fn n_outputs(&self) -> usize {
        self.n_actions * self.categories.map_or(1, |categories| categories.count)
    }

    /// Value of every action by one critic, `[B, A]`, from its output.
    pub(super) fn values(&self, output: Tensor<2>) -> Tensor<2> {
        let Some(categories) = self.categories else { return output };
        let rows = output.dims()[0];
        let shares = softmax(self.histograms(output, categories), 2);
        means(categories, shares.reshape([rows * self.n_actions, categories.count])).reshape([rows, self.n_actions])
    }

    /// The two critics' values `[B, A]` as one, `[B, A]`.
    pub(super) fn one_value(&self, [first, second]: [Tensor<2>; 2]) -> Tensor<2> {
        match self.critics {
            Critics::Average => (first + second).mul_scalar(0.5),
            Critics::Lowest => first.min_pair(second),
        }
    }

    /// Expected reward and what follows by the target critics.
    pub(super) fn goal(&self, following: Following) -> Goal {
        let Following { probs, outputs, bonus, reward, discount } = following;
        let Some(categories) = self.categories else {
            let q = self.one_value(outputs); // [B, A]
            let value = (probs * q).sum_dim(1); // [B, 1]
            let value = bonus.map_or(value.clone(), |bonus| value + bonus);
            return Goal { value: reward.clone() + discount.clone() * value, histogram: None };
        };
        let [rows, n_actions] = probs.dims();
        let weights = probs.reshape([rows, n_actions, 1]);
        let shares = outputs.map(|output| (softmax(self.histograms(output, categories), 2) * weights.clone()).sum_dim(1)); // [B, 1, C] each
        let [first, second] = shares.map(|share| share.reshape([rows, categories.count]));
        let shares = host((first + second).mul_scalar(0.5));
        let moved = bonus.map_or(reward.clone(), |bonus| reward.clone() + discount.clone() * bonus);
        let (moved, discount) = (host(moved), host(discount.clone()));
        let centres = centres(categories);
        let mut projected = Vec::with_capacity(shares.len());
        let mut means: Vec<f32> = Vec::with_capacity(rows);
        for ((shares, &moved), &discount) in shares.chunks_exact(categories.count).zip(&moved).zip(&discount) {
            let histogram = projection(categories, &centres, shares, moved, discount);
            means.push(histogram.iter().zip(&centres).map(|(share, centre)| share * centre).sum());
            projected.extend(histogram);
        }
        let device = Device::flex();
        let histogram = Tensor::from_data(TensorData::new(projected, [rows, categories.count]), &device);
        Goal { value: Tensor::from_data(TensorData::new(means, [rows, 1]), &device), histogram: Some(histogram) }
    }

    /// One critic's loss of each row, `[B, 1]`, and its value of the action taken, `[B, 1]` without gradients. `bound` is the target
    /// critic's value of that action where a clip asks for it.
    pub(super) fn loss(
        &self,
        output: &Tensor<2>,
        action: &Tensor<2, Int>,
        goal: &Goal,
        bound: Option<Tensor<2>>,
    ) -> (Tensor<2>, Tensor<2>) {
        if let Some((histogram, categories)) = goal.histogram.as_ref().zip(self.categories) {
            let rows = output.dims()[0];
            let index = action.clone().reshape([rows, 1, 1]).expand([rows, 1, categories.count]);
            let taken: Tensor<2> = self.histograms(output.clone(), categories).gather(1, index.autodiff()).squeeze_dim(1); // [B, C]
            let loss = -(log_softmax(taken.clone(), 1) * histogram.clone().autodiff()).sum_dim(1);
            return (loss, means(categories, softmax(taken.inner(), 1)));
        }
        let taken = output.clone().gather(1, action.clone().autodiff()); // [B, 1]
        let error = (taken.clone() - goal.value.clone().autodiff()).square();
        let value = taken.clone().inner();
        let Some((bound, clip)) = bound.zip(self.value_clip) else { return (error, value) };
        // H. Zhou and others, "Revisiting Discrete Soft Actor-Critic" (2022): no gain from moving further than the clip.
        let near = (taken - bound.clone().autodiff()).clamp(-clip, clip) + bound.autodiff();
        (error.max_pair((near - goal.value.clone().autodiff()).square()), value)
    }

    /// Whether the loss needs the target critics' values of the action taken.
    pub(super) fn clips(&self) -> bool {
        self.value_clip.is_some()
    }

    /// Logits of the categories, `[B, A, categories]`.
    fn histograms(&self, output: Tensor<2>, categories: Categories) -> Tensor<3> {
        let rows = output.dims()[0];
        output.reshape([rows, self.n_actions, categories.count])
    }
}

/// Mean value of each histogram, `[rows, 1]`, from its shares `[rows, categories]`.
fn means(categories: Categories, shares: Tensor<2>) -> Tensor<2> {
    let centres = Tensor::<2>::from_data(TensorData::new(centres(categories), [1, categories.count]), &shares.device());
    (shares * centres).sum_dim(1)
}

/// Values that the categories stand for, `[categories]`.
fn centres(Categories { count, low, high }: Categories) -> Vec<f32> {
    (0..count).map(|index| (low + (high - low) * index as f64 / (count - 1) as f64) as f32).collect()
}

/// A histogram over the categories after every value in it has become `moved + discount * value`: each share is divided between the two
/// categories that it comes to lie between.
fn projection(categories: Categories, centres: &[f32], shares: &[f32], moved: f32, discount: f32) -> Vec<f32> {
    let mut projected = vec![0.0; shares.len()];
    let last = shares.len() - 1;
    let width = ((categories.high - categories.low) / last as f64) as f32;
    for (share, centre) in shares.iter().zip(centres) {
        let place = ((moved + discount * centre - categories.low as f32) / width).clamp(0.0, last as f32);
        let below = (place as usize).min(last - 1);
        let above = place - below as f32;
        projected[below] += share * (1.0 - above);
        projected[below + 1] += share * above;
    }
    projected
}

fn host(tensor: Tensor<2>) -> Vec<f32> {
    tensor.into_data().try_to_vec().expect("rewards, weights and networks' outputs are f32")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moved_histogram_keeps_its_sum_and_moves_its_mean() {
        let categories = Categories { count: 5, low: -2.0, high: 2.0 };
        let mean = |shares: &[f32]| shares.iter().zip(centres(categories)).map(|(share, centre)| share * centre).sum::<f32>();
        let shares = [0.1, 0.2, 0.4, 0.2, 0.1];
        let moved = projection(categories, &centres(categories), &shares, 0.3, 0.5);
        assert!((moved.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        assert!((mean(&moved) - (0.3 + 0.5 * mean(&shares))).abs() < 1e-6);
        // Nothing follows: all of it lies at the reward, a quarter of the way from 0 to 1; beyond the ends it stays at the end.
        for (moved, discount, expected) in [(0.25, 0.0, [0.0, 0.0, 0.75, 0.25, 0.0]), (9.0, 1.0, [0.0, 0.0, 0.0, 0.0, 1.0])] {
            let found = projection(categories, &centres(categories), &shares, moved, discount);
            assert!(found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-6), "{found:?}");
        }
    }
}
