//! Adam of D. Kingma and J. Ba (2015), and the network that follows the one it moves: a target network by tau, or an
//! EMA of the actor.
//!
//! On the processor it is one fused pass over the parameters, on a device tensor operations. Both do the same
//! arithmetic.

mod fused;
mod tensors;

use burn::module::Module;
use burn::optim::GradientsParams;

use fused::Fused;
use tensors::Tensors;

/// Decay rates of the first and the second moment.
const DECAY: [f32; 2] = [0.9, 0.999];
/// Keeps a step from dividing by 0.
const EPSILON: f64 = 1e-5;

/// The optimizer of one network.
pub enum Adam {
    /// The optimizer on the processor.
    Fused(Fused),
    /// The optimizer on a device.
    Tensors(Tensors),
}

/// An optimizer's state in the processor's memory. It is all there is: with these fields restored, steps continue bit
/// for bit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct State {
    /// Steps made.
    pub n_steps: i32,
    /// First and second moment of each parameter, `[elements]` each, in the order in which the network lists its
    /// parameters; none before the first step.
    pub moments: Vec<[Vec<f32>; 2]>,
}

impl Adam {
    /// An optimizer before its first step, on the processor or on a device.
    pub fn new(on_host: bool) -> Adam {
        if on_host { Adam::Fused(Fused::default()) } else { Adam::Tensors(Tensors::default()) }
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
        gradients: Vec<GradientsParams>,
        learning_rate: f64,
        tau: f64,
    ) -> (M, M) {
        match self {
            Adam::Fused(fused) => fused.step(network, follower, gradients, learning_rate, tau),
            Adam::Tensors(tensors) => tensors.step(network, follower, gradients, learning_rate, tau),
        }
    }

    /// The state; waits for a device.
    pub fn state(&self) -> State {
        match self {
            Adam::Fused(Fused(state)) => state.clone(),
            Adam::Tensors(tensors) => tensors.state(),
        }
    }

    /// Continues from a state; tensors are put on `device`.
    pub fn restore(&mut self, state: State, device: &burn::tensor::Device) {
        match self {
            Adam::Fused(Fused(own)) => *own = state,
            Adam::Tensors(tensors) => *tensors = Tensors::new(&state, device),
        }
    }
}

/// What is the same for all elements of a step.
struct Step {
    learning_rate: f32,
    epsilon: f32,
    tau: f32,
}

impl Step {
    /// Bias correction: the moments begin at 0 and are too small at first by 1 - decay ^ steps; rate and epsilon make
    /// up for it.
    fn new(n_steps: i32, learning_rate: f64, tau: f64) -> Step {
        let [first, second] = DECAY.map(|decay| 1.0 - f64::from(decay).powi(n_steps));
        Step {
            learning_rate: (learning_rate * second.sqrt() / first) as f32,
            epsilon: (EPSILON * second.sqrt()) as f32,
            tau: tau as f32,
        }
    }
}
