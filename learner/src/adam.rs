//! Adam of D. Kingma and J. Ba (2015), and the network that follows the one it moves: a target network by tau, or an
//! EMA of the actor.
//!
//! Here is the one of the processor; a device's kernel does the same arithmetic.

mod fused;

pub use fused::Adam;

/// Decay rates of the first and the second moment.
pub(crate) const DECAY: [f32; 2] = [0.9, 0.999];
/// Keeps a step from dividing by 0.
const EPSILON: f64 = 1e-5;

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

/// What is the same for all elements of a step.
pub(crate) struct Step {
    pub(crate) learning_rate: f32,
    pub(crate) epsilon: f32,
    pub(crate) tau: f32,
}

impl Step {
    /// Bias correction: the moments begin at 0 and are too small at first by 1 - decay ^ steps; rate and epsilon make
    /// up for it.
    pub(crate) fn new(n_steps: i32, learning_rate: f64, tau: f64) -> Step {
        let [first, second] = DECAY.map(|decay| 1.0 - f64::from(decay).powi(n_steps));
        Step {
            learning_rate: (learning_rate * second.sqrt() / first) as f32,
            epsilon: (EPSILON * second.sqrt()) as f32,
            tau: tau as f32,
        }
    }
}
