//! Adam in tensor operations, for a learner on a device: nothing is read back.

use crate::panics::unreadable;
use burn::module::{Module, ModuleMapper, Param};
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor, TensorData};

use super::{DECAY, State, Step};

/// Both moments of each parameter, flat, in the order in which the network lists its parameters.
#[derive(Default)]
pub struct Tensors {
    n_steps: i32,
    moments: Vec<[Tensor<1>; 2]>,
}

impl Tensors {
    pub(super) fn new(state: &State, device: &Device) -> Tensors {
        let tensor = |values: &Vec<f32>| Tensor::from_data(TensorData::new(values.clone(), [values.len()]), device);
        Tensors {
            n_steps: state.n_steps,
            moments: state.moments.iter().map(|[first, second]| [tensor(first), tensor(second)]).collect(),
        }
    }

    pub(super) fn state(&self) -> State {
        let values = |tensor: Tensor<1>| tensor.into_data().try_to_vec().unwrap_or_else(|error| unreadable(&error));
        State {
            n_steps: self.n_steps,
            moments: self.moments.iter().map(|moments| moments.clone().map(values)).collect(),
        }
    }

    /// See [`super::Adam::step`].
    pub(super) fn step<M: Module>(
        &mut self,
        network: M,
        follower: M,
        gradients: Vec<GradientsParams>,
        learning_rate: f64,
        tau: f64,
    ) -> (M, M) {
        self.n_steps = self.n_steps.saturating_add(1);
        let mut descend = Descend {
            step: Step::new(self.n_steps, learning_rate, tau),
            gradients,
            moments: std::mem::take(&mut self.moments).into_iter(),
            moved_moments: Vec::new(),
            values: Vec::new(),
        };
        let network = network.map(&mut descend);
        self.moments = descend.moved_moments;
        (network, follower.map(&mut Follow { tau: descend.step.tau, values: descend.values.into_iter() }))
    }
}

/// Moves a network's parameters against their gradients.
struct Descend {
    step: Step,
    gradients: Vec<GradientsParams>,
    /// Moments before the step; none before the first.
    moments: std::vec::IntoIter<[Tensor<1>; 2]>,
    /// Moments and parameters after it.
    moved_moments: Vec<[Tensor<1>; 2]>,
    values: Vec<Tensor<1>>,
}

impl ModuleMapper for Descend {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (id, tensor, mapper) = param.consume();
        let (shape, learning) = (tensor.dims(), tensor.is_require_grad());
        let value: Tensor<1> = tensor.without_autodiff().flatten(0, D - 1);
        let [first, second] = self.moments.next().unwrap_or_else(|| [value.zeros_like(), value.zeros_like()]);
        let gradient =
            self.gradients.iter_mut().filter_map(|shard| shard.remove::<D>(id)).reduce(|sum, gradient| sum + gradient);
        // A parameter that has no part in the loss stays.
        let (value, moments) = match gradient {
            None => (value, [first, second]),
            Some(gradient) => {
                let gradient: Tensor<1> = gradient.flatten(0, D - 1);
                let first = first.mul_scalar(DECAY[0]) + gradient.clone().mul_scalar(1.0 - DECAY[0]);
                let second = second.mul_scalar(DECAY[1]) + gradient.square().mul_scalar(1.0 - DECAY[1]);
                let moved = first.clone().mul_scalar(self.step.learning_rate)
                    / second.clone().sqrt().add_scalar(self.step.epsilon);
                (value - moved, [first, second])
            }
        };
        self.moved_moments.push(moments);
        self.values.push(value.clone());
        let value: Tensor<D> = value.reshape(shape);
        Param::from_mapped_value(id, value.autodiff().set_require_grad(learning), mapper)
    }
}

/// Moves a network's parameters part of the way to another's.
struct Follow {
    tau: f32,
    values: std::vec::IntoIter<Tensor<1>>,
}

impl ModuleMapper for Follow {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (id, tensor, mapper) = param.consume();
        let shape = tensor.dims();
        let value = match self.values.next() {
            Some(value) if self.tau != 0.0 => {
                tensor.mul_scalar(1.0 - self.tau) + value.reshape(shape).mul_scalar(self.tau)
            }
            _ => tensor,
        };
        Param::from_mapped_value(id, value, mapper)
    }
}
