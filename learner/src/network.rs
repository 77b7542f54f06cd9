//! The network of actor and critics alike: a stack of linear layers with rectifiers between them.

use crate::panics::unreadable;
use burn::module::{Module, Param};
use burn::nn::{LayerNorm, LayerNormConfig, Linear};
use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor, TensorData};
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};

/// Keeps a layer normalisation from dividing by 0.
pub const NORM_EPSILON: f64 = 1e-5;

/// Linear layers, a rectifier after each but the last.
#[derive(Module, Debug, Default)]
pub struct Mlp {
    /// The layers, from the observation on; weights are `[inputs, outputs]`.
    pub layers: Vec<Linear>,
    /// Normalisations before the rectifiers, one each or none at all (J. Ba and others, "Layer Normalization", 2016).
    pub norms: Vec<LayerNorm>,
}

impl Mlp {
    /// Layers between the given sizes. Weights are drawn from He's uniform distribution ("Delving Deep into
    /// Rectifiers", 2015), those of the last layer times `last_gain`; biases are 0.
    pub fn new(sizes: &[usize], last_gain: f32, rng: &mut impl Rng, device: &Device) -> Mlp {
        let n_layers = sizes.len() - 1;
        let layers = sizes.windows(2).enumerate().map(|(index, ends)| {
            let [inputs, outputs] = [ends[0], ends[1]];
            let gain = if index + 1 == n_layers { last_gain } else { 1.0 };
            let limit = gain * (6.0 / inputs as f32).sqrt();
            let weights: Vec<f32> = (0..inputs * outputs).map(|_| limit * rng.random_range(-1.0..1.0f32)).collect();
            layer(weights, vec![0.0; outputs], device)
        });
        Mlp { layers: layers.collect(), norms: Vec::new() }
    }

    /// The network of a policy whose activation is the rectifier.
    pub fn of(layers: &[offtrack_policy::Layer], device: &Device) -> Mlp {
        let layers = layers.iter().map(|plain| layer(plain.weights.clone(), plain.biases.clone(), device));
        Mlp { layers: layers.collect(), norms: Vec::new() }
    }

    /// A policy's network on the processor.
    pub fn of_policy(policy: &offtrack_policy::Policy) -> Mlp {
        Mlp::of(&policy.layers, &Device::flex())
    }

    /// A network on the processor that has learned nothing, of layers of these sizes.
    pub fn untrained(sizes: &[usize], seed: u64) -> Mlp {
        Mlp::new(sizes, 1.0, &mut SmallRng::seed_from_u64(seed), &Device::flex())
    }

    /// The layers as a policy has them; waits for the device that they are on.
    pub fn plain_layers(&self) -> Vec<offtrack_policy::Layer> {
        let plain = |layer: &Linear| offtrack_policy::Layer {
            weights: values_of(&layer.weight),
            biases: layer.bias.as_ref().map(values_of).unwrap_or_default(),
        };
        self.layers.iter().map(plain).collect()
    }

    /// This network with layer normalisation before each rectifier.
    pub fn with_layer_norm(self) -> Mlp {
        let hidden = self.layers.len() - 1;
        let config = |layer: &Linear| LayerNormConfig::new(layer.weight.dims()[1]).with_epsilon(NORM_EPSILON);
        let norm = |layer: &Linear| config(layer).init(&layer.weight.device());
        Mlp { norms: self.layers[..hidden].iter().map(norm).collect(), layers: self.layers }
    }

    /// From an observation `[B, inputs]` to one value an action `[B, A]`.
    pub fn forward(&self, observation: Tensor<2>) -> Tensor<2> {
        let mut output = observation;
        for (index, layer) in self.layers.iter().enumerate() {
            output = layer.forward(output);
            if let Some(norm) = self.norms.get(index) {
                output = norm.forward(output);
            }
            if index + 1 < self.layers.len() {
                output = relu(output);
            }
        }
        output
    }

    /// This network for `n_frames` observations side by side, the newest last: it sees that one alone, until it learns.
    pub fn over_frames(&self, n_frames: usize, device: &Device) -> Mlp {
        let mut parameters: Vec<Vec<f32>> = self.parameters().into_iter().map(|(_, values)| values).collect();
        let older = (n_frames - 1) * parameters[0].len();
        parameters[0].splice(..0, std::iter::repeat_n(0.0, older));
        self.with_parameters(parameters, device)
    }

    /// Every parameter with its name, in the order in which a module shows them.
    pub fn parameters(&self) -> Vec<(String, Vec<f32>)> {
        let layers = self.layers.iter().zip(1..).flat_map(|(layer, number)| {
            let biases = layer.bias.as_ref().map(|bias| (format!("layer {number}, bias"), values_of(bias)));
            [Some((format!("layer {number}, weight"), values_of(&layer.weight))), biases].into_iter().flatten()
        });
        let norms = self.norms.iter().zip(1..).flat_map(|(norm, number)| {
            let shift = norm.beta.as_ref().map(|beta| (format!("normalisation {number}, shift"), values_of(beta)));
            [Some((format!("normalisation {number}, scale"), values_of(&norm.gamma))), shift].into_iter().flatten()
        });
        layers.chain(norms).collect()
    }

    /// A copy of this network on a device; waits for the device that this network is on.
    pub fn on(&self, device: &Device) -> Mlp {
        self.with_parameters(self.parameters().into_iter().map(|(_, values)| values).collect(), device)
    }

    /// A copy of this network on a device, of `factor` times its outputs.
    pub fn times(&self, factor: f32, device: &Device) -> Mlp {
        let mut parameters: Vec<Vec<f32>> = self.parameters().into_iter().map(|(_, values)| values).collect();
        // Norms stand behind the layers, and the last layer has none.
        let last = 2 * self.layers.len();
        parameters[last - 2..last].iter_mut().flatten().for_each(|value| *value *= factor);
        self.with_parameters(parameters, device)
    }

    /// A network with other parameters, as many as [`Mlp::parameters`] gives; its first layer may have other inputs.
    pub fn with_parameters(&self, parameters: Vec<Vec<f32>>, device: &Device) -> Mlp {
        let mut parameters = parameters.into_iter();
        let mut next = || parameters.next().unwrap_or_default();
        let layers = self.layers.iter().map(|_| layer(next(), next(), device)).collect();
        let norm = |norm: &LayerNorm| {
            let mut norm = norm.clone();
            norm.gamma = vector(next(), device);
            norm.beta = norm.beta.map(|_| vector(next(), device));
            norm
        };
        Mlp { layers, norms: self.norms.iter().map(norm).collect() }
    }
}

/// A parameter's values; waits for the device that they are on.
pub fn values_of<const D: usize>(parameter: &Param<Tensor<D>>) -> Vec<f32> {
    parameter.val().into_data().try_to_vec().unwrap_or_else(|error| unreadable(&error))
}

fn vector(values: Vec<f32>, device: &Device) -> Param<Tensor<1>> {
    let shape = [values.len()];
    Param::from_data(TensorData::new(values, shape), device)
}

/// A layer with the given weights `[inputs, outputs]` and biases `[outputs]`.
pub fn layer(weights: Vec<f32>, biases: Vec<f32>, device: &Device) -> Linear {
    let shape = [weights.len() / biases.len(), biases.len()];
    Linear { weight: Param::from_data(TensorData::new(weights, shape), device), bias: Some(vector(biases, device)) }
}

/// An action sampled from the softmax of each row of `logits`, `(rows)`.
pub fn sampled(logits: &[f32], n_actions: usize, rng: &mut impl Rng) -> Vec<u32> {
    offtrack_policy::sampled(logits, n_actions, |_| rng.random())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use offtrack::layout::{N_AROUND, N_VALUES, ObservedExtras};
    use offtrack::scenario::{Scenario, Split};
    use offtrack::simulator::{Batch, RouteChoice, Simulator};
    use offtrack::world::World;
    use offtrack_policy::{Policy, greedy};

    use crate::rollout::host::{logits, observed};

    fn weights(network: &Mlp) -> Vec<f32> {
        network.layers.iter().flat_map(|layer| layer.weight.val().into_data().try_to_vec::<f32>().unwrap()).collect()
    }

    #[test]
    fn a_rectifier_stands_between_the_layers_and_none_after_the_last() {
        let device = Device::flex();
        let network = Mlp {
            layers: vec![layer(vec![1.0, -1.0], vec![0.0, 0.5], &device), layer(vec![-2.0, 3.0], vec![1.0], &device)],
            norms: Vec::new(),
        };
        let output = network.forward(Tensor::from_data([[2.0], [-1.0]], &device));
        // relu(2), relu(-1.5) -> -4 + 0 + 1; relu(-1), relu(1.5) -> 0 + 4.5 + 1.
        assert_eq!(output.into_data().try_to_vec::<f32>().unwrap(), [-3.0, 5.5]);
    }

    #[test]
    fn the_same_seed_gives_the_same_network() {
        let network = |seed| Mlp::new(&[4, 8, 2], 1.0, &mut SmallRng::seed_from_u64(seed), &Device::flex());
        assert_eq!(weights(&network(1)), weights(&network(1)));
        assert_ne!(weights(&network(1)), weights(&network(2)));
    }

    #[test]
    fn actions_are_sampled_with_their_probabilities() {
        let probs = [0.1f32, 0.6, 0.05, 0.25];
        let logits: Vec<f32> = probs.map(|prob| prob.ln() + 30.0).repeat(40_000);
        let actions = sampled(&logits, 4, &mut SmallRng::seed_from_u64(9));
        for (action, prob) in probs.into_iter().enumerate() {
            let frequency = actions.iter().filter(|&&drawn| drawn as usize == action).count() as f32 / 40_000.0;
            // Four standard deviations of a frequency over 40,000 samples.
            assert!((frequency - prob).abs() < 4.0 * (prob * (1.0 - prob) / 40_000.0).sqrt(), "{action}: {frequency}");
        }
    }

    /// Largest difference of two outputs, relative to the largest output of its row.
    fn difference(found: &[f32], expected: &[f32], n_actions: usize) -> f32 {
        assert_eq!(found.len(), expected.len());
        let rows = found.chunks_exact(n_actions).zip(expected.chunks_exact(n_actions));
        let row = |(found, expected): (&[f32], &[f32])| {
            let largest = expected.iter().fold(0.0f32, |most, value| most.max(value.abs()));
            found.iter().zip(expected).fold(0.0f32, |most, (a, b)| most.max((a - b).abs() / largest))
        };
        rows.map(row).fold(0.0, f32::max)
    }

    #[test]
    fn a_policy_drives_as_the_network_that_learned_it() {
        const LADEN: usize = N_VALUES + ObservedExtras::Mass.n_extras();
        const AMONG: usize = N_VALUES + N_AROUND;
        for name in Policy::shipped_names() {
            let policy = Policy::shipped(name).unwrap();
            let scenario = Scenario::named(name.trim_end_matches("-lane")).unwrap();
            assert!([0, LADEN - N_VALUES].contains(&policy.extras.len()), "{name}: {:?}", policy.extras);
            let routes = RouteChoice::Drawn(scenario.split(Split::Train).to_vec());
            let mut simulator = Simulator::new(Arc::new(World::bake(&scenario).unwrap()), 1024, 1, routes).unwrap();
            let network = Mlp::of(&policy.layers, &Device::flex());
            let mut wrong = policy.clone();
            wrong.layers[1].weights.iter_mut().for_each(|weight| *weight *= 1.001);
            for _ in 0..4 {
                for _ in 0..20 {
                    let Batch { observation, extras, around, .. } = simulator.batch();
                    let outputs = policy.logits_among(observation, extras, around);
                    simulator.step(&greedy(&outputs, policy.actions.len())).unwrap();
                }
                let Batch { observation, extras, around, .. } = simulator.batch();
                let normalisation = &policy.normalisation;
                let expected = match (policy.extras.is_empty(), policy.vehicles) {
                    (true, false) => logits(&network, normalisation, observation.as_slice()),
                    (true, true) => logits::<AMONG>(&network, normalisation, &observed(observation, extras, around)),
                    (false, _) => logits::<LADEN>(&network, normalisation, &observed(observation, extras, &[])),
                };
                let n_actions = policy.actions.len();
                // Sums over 256 values may round in another order or without fused multiply-adds.
                let outputs = |policy: &Policy| policy.logits_among(observation, extras, around);
                assert!(difference(&outputs(&policy), &expected, n_actions) < 1e-5);
                assert!(1e-5 < difference(&outputs(&wrong), &expected, n_actions), "a wrong weight must show");
            }
            assert_eq!(network.plain_layers(), policy.layers);
        }
    }
}
