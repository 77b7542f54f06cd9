//! Adam in a single pass over the parameters, on the processor.
//!
//! A step is bound by memory bandwidth, not by arithmetic: parameters, gradients, moments and followers are each read
//! and written once, in place. The pass is split into independent blocks, so the result is the same for any number of
//! threads.

use burn::module::{Module, ModuleMapper, Param};
use burn::optim::GradientsParams;
use burn::tensor::{Tensor, TensorData};
use multiversion::multiversion;
use rayon::prelude::*;

use super::{DECAY, State, Step};

/// Elements of a parameter that one thread moves at a time.
const BLOCK: usize = 16_384;
/// Elements whose gradients are summed at a time: they stay in the nearest cache.
const SUM: usize = 1024;

/// The optimizer: nothing but its state.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Adam(State);

impl Adam {
    /// The state.
    pub fn state(&self) -> State {
        self.0.clone()
    }

    /// Continues from a state.
    pub fn restore(&mut self, state: State) {
        self.0 = state;
    }

    /// Moves `network` against the sum of the shards' gradients, then `follower` toward it by `tau`: 0 leaves it, 1
    /// makes it a copy.
    ///
    /// Both are given up and returned so that no copy has to be made; a parameter that is also held elsewhere is
    /// copied.
    pub fn step<M: Module>(
        &mut self,
        network: M,
        follower: M,
        mut gradients: Vec<GradientsParams>,
        learning_rate: f64,
        tau: f64,
    ) -> (M, M) {
        let (mut taken, mut following) = (Take::from(&mut gradients[..]), Take::from(&mut [][..]));
        let (network, follower) = (network.map(&mut taken), follower.map(&mut following));
        let state = &mut self.0;
        if state.moments.is_empty() {
            state.moments =
                taken.values.iter().map(|values| [0; 2].map(|_| vec![0.0; values.num_elements()])).collect();
        }
        state.n_steps = state.n_steps.saturating_add(1);
        let step = Step::new(state.n_steps, learning_rate, tau);
        let parameters =
            taken.values.iter_mut().zip(&taken.gradients).zip(following.values.iter_mut().zip(&mut state.moments));
        let blocks: Vec<Block> = parameters
            .flat_map(|((values, gradients), (follower, [first, second]))| {
                let gradients: Vec<&[f32]> = gradients.iter().map(elements).collect();
                let blocks = elements_mut(values).chunks_mut(BLOCK).zip(elements_mut(follower).chunks_mut(BLOCK));
                let moments = first.chunks_mut(BLOCK).zip(second.chunks_mut(BLOCK));
                blocks.zip(moments).enumerate().map(move |(index, ((values, follower), (first, second)))| {
                    let begin = index * BLOCK;
                    let gradients = gradients.iter().map(|gradient| &gradient[begin..begin + values.len()]).collect();
                    Block { values, gradients, moments: [first, second], follower }
                })
            })
            .collect();
        blocks.into_par_iter().for_each(|block| block.advance(&step));
        (network.map(&mut Put(taken.values.into_iter())), follower.map(&mut Put(following.values.into_iter())))
    }
}

/// Some elements of a parameter, and all that goes with them.
struct Block<'a> {
    values: &'a mut [f32],
    /// Gradients of each shard.
    gradients: Vec<&'a [f32]>,
    moments: [&'a mut [f32]; 2],
    follower: &'a mut [f32],
}

impl Block<'_> {
    fn advance(self, step: &Step) {
        let [first, second] = self.moments;
        let moments = first.chunks_mut(SUM).zip(second.chunks_mut(SUM));
        let chunks = self.values.chunks_mut(SUM).zip(self.follower.chunks_mut(SUM)).zip(moments);
        for (index, ((values, follower), moments)) in chunks.enumerate() {
            let rows = index * SUM..index * SUM + values.len();
            // A parameter that has no part in the loss stays.
            if let Some((gradient, others)) = self.gradients.split_first() {
                let mut sum = [0.0; SUM];
                let sum = &mut sum[..values.len()];
                sum.copy_from_slice(&gradient[rows.clone()]);
                for gradient in others {
                    add(sum, &gradient[rows.clone()]);
                }
                descend(values, moments, sum, step);
            }
            if step.tau != 0.0 {
                approach(follower, values, step.tau);
            }
        }
    }
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn add(sum: &mut [f32], gradient: &[f32]) {
    for (sum, gradient) in sum.iter_mut().zip(gradient) {
        *sum += gradient;
    }
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn descend(values: &mut [f32], moments: (&mut [f32], &mut [f32]), gradient: &[f32], step: &Step) {
    for (((value, first), second), gradient) in values.iter_mut().zip(moments.0).zip(moments.1).zip(gradient) {
        *first = DECAY[0] * *first + (1.0 - DECAY[0]) * gradient;
        *second = DECAY[1] * *second + (1.0 - DECAY[1]) * gradient * gradient;
        *value -= step.learning_rate * *first / (second.sqrt() + step.epsilon);
    }
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn approach(follower: &mut [f32], values: &[f32], rate: f32) {
    for (follower, value) in follower.iter_mut().zip(values) {
        *follower = (1.0 - rate) * *follower + rate * value;
    }
}

/// Takes the values out of a network's parameters, which stay behind empty, and their gradients out of the shards.
struct Take<'a> {
    shards: &'a mut [GradientsParams],
    values: Vec<TensorData>,
    gradients: Vec<Vec<TensorData>>,
}

impl<'a> From<&'a mut [GradientsParams]> for Take<'a> {
    fn from(shards: &'a mut [GradientsParams]) -> Take<'a> {
        Take { shards, values: Vec::new(), gradients: Vec::new() }
    }
}

impl ModuleMapper for Take<'_> {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (id, tensor, mapper) = param.consume();
        let empty = Tensor::empty([0; D], &tensor.device()).set_require_grad(tensor.is_require_grad());
        self.gradients
            .push(self.shards.iter_mut().filter_map(|shard| shard.remove::<D>(id)).map(Tensor::into_data).collect());
        self.values.push(tensor.without_autodiff().into_data());
        Param::from_mapped_value(id, empty, mapper)
    }
}

/// Puts values back into the parameters that [`Take`] took them from.
struct Put(std::vec::IntoIter<TensorData>);

impl ModuleMapper for Put {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (id, empty, mapper) = param.consume();
        let value = match self.0.next() {
            Some(values) => Tensor::from_data(values, &empty.device()).set_require_grad(empty.is_require_grad()),
            None => empty,
        };
        Param::from_mapped_value(id, value, mapper)
    }
}

fn elements(values: &TensorData) -> &[f32] {
    values.as_slice().expect("gradients of f32 parameters are f32")
}

fn elements_mut(values: &mut TensorData) -> &mut [f32] {
    values.as_mut_slice().expect("parameters are made of f32 values")
}

#[cfg(test)]
mod tests {
    use super::super::EPSILON;
    use super::*;
    use crate::network::Mlp;
    use burn::optim::{AdamConfig, MultiGradientsParams};
    use burn::tensor::Device;
    use rand::rngs::SmallRng;
    use rand::{Rng, SeedableRng};
    use rayon::ThreadPoolBuilder;

    fn random(seed: u64, device: &Device) -> Mlp {
        Mlp::new(&[3, 7, 2], 1.0, &mut SmallRng::seed_from_u64(seed), device).with_layer_norm()
    }

    /// Two shards' gradients of the squared output.
    fn gradients(network: &Mlp, seed: u64) -> Vec<GradientsParams> {
        let mut rng = SmallRng::seed_from_u64(seed);
        let inputs = network.layers[0].weight.dims()[0];
        let part = |_| {
            let device = Device::flex().autodiff();
            let values: Vec<f32> = (0..4 * inputs).map(|_| rng.random_range(-1.0..1.0)).collect();
            let own = network.clone().fork(&device);
            let output = own.forward(Tensor::from_data(TensorData::new(values, [4, inputs]), &device));
            GradientsParams::from_grads(output.square().mean().backward(), &own)
        };
        [0; 2].map(part).into()
    }

    /// All weights and biases, one after the other.
    fn weights(network: &Mlp) -> Vec<f32> {
        let mut taken = Take::from(&mut [][..]);
        network.clone().map(&mut taken);
        taken.values.iter().flat_map(elements).copied().collect()
    }

    fn furthest(found: &[f32], expected: &[f32]) -> f32 {
        assert_eq!(found.len(), expected.len());
        found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn steps_are_those_of_the_librarys_adam_on_the_sum_of_the_shards() {
        let mut expected = random(1, &Device::flex().autodiff());
        let (mut found, mut follower, mut adam) = (expected.clone(), random(2, &Device::flex()), Adam::default());
        let mut library = AdamConfig::new().with_epsilon(EPSILON as f32).init();
        let begun = weights(&expected);
        for step in 0..50 {
            let grads = gradients(&expected, step).into_iter().map(|part| (part, Device::flex())).collect();
            expected = library.step_multi(0.01, expected, MultiGradientsParams { grads });
            let parts = gradients(&found, step);
            (found, follower) = adam.step(found, follower, parts, 0.01, 0.0);
        }
        // Sums of 50 steps of 0.01, rounded in another order; a gradient near 0 is divided by its own size plus 1e-5.
        assert!(furthest(&weights(&found), &weights(&expected)) < 1e-4);
        assert!(0.05 < furthest(&weights(&found), &begun));
        assert_eq!(weights(&follower), weights(&random(2, &Device::flex())));
    }

    #[test]
    fn the_follower_goes_part_of_the_way_to_where_the_step_led_or_all_of_it() {
        let begun = [random(1, &Device::flex().autodiff()), random(2, &Device::flex())];
        for follow in [0.25, 1.0] {
            let [network, follower] = begun.clone();
            let parts = gradients(&network, 0);
            let (network, follower) = Adam::default().step(network, follower, parts, 0.01, follow);
            let way = |(from, to): (&f32, &f32)| (1.0 - follow as f32) * from + follow as f32 * to;
            assert_eq!(
                weights(&follower),
                weights(&begun[1]).iter().zip(&weights(&network)).map(way).collect::<Vec<_>>()
            );
            assert_ne!(weights(&network), weights(&begun[0]));
        }
    }

    #[test]
    fn a_parameter_without_a_gradient_stays_and_is_followed() {
        let begun = random(1, &Device::flex().autodiff());
        let parts = vec![GradientsParams::new(), GradientsParams::new()];
        let (network, follower) = Adam::default().step(begun.clone(), random(2, &Device::flex()), parts, 0.01, 1.0);
        assert_eq!(weights(&network), weights(&begun));
        assert_eq!(weights(&follower), weights(&begun));
    }

    #[test]
    fn the_number_of_threads_does_not_matter() {
        // More blocks than one, the last of them and of its sums broken off.
        let sizes = [130, 300, 2];
        assert!(2 * BLOCK < sizes[0] * sizes[1] && (sizes[0] * sizes[1]) % SUM != 0);
        let stepped = |n_threads| {
            let mut network = Mlp::new(&sizes, 1.0, &mut SmallRng::seed_from_u64(1), &Device::flex().autodiff());
            let (mut follower, mut adam) = (network.valid(), Adam::default());
            for step in 0..3 {
                let parts = gradients(&network, step);
                let pool = ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
                (network, follower) = pool.install(|| adam.step(network, follower, parts, 0.01, 0.1));
            }
            [weights(&network), weights(&follower)]
        };
        let alone = stepped(1);
        assert_eq!(stepped(3), alone);
        assert_ne!(alone[0], alone[1]);
    }

    #[test]
    fn a_state_put_back_goes_on_bit_for_bit() {
        let step = |adam: &mut Adam, network: Mlp, seed| {
            let (follower, parts) = (network.valid(), gradients(&network, seed));
            adam.step(network, follower, parts, 0.01, 0.1).0
        };
        let mut adam = Adam::default();
        let network = step(&mut adam, random(1, &Device::flex().autodiff()), 1);
        let mut put_back = Adam(State { n_steps: adam.0.n_steps, moments: adam.0.moments.clone() });
        let expected = weights(&step(&mut adam, network.clone(), 2));
        assert_eq!(weights(&step(&mut put_back, network.clone(), 2)), expected);
        assert_ne!(weights(&step(&mut Adam::default(), network, 2)), expected);
    }
}
