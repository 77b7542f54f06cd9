//! The learner with all that it moves on one graphics device: an update asks nothing of the host and waits for nothing.
//!
//! It begins as a [`Sac`] and can be read back as one, so that files and examinations know a single kind. The losses are the same code; only
//! the steps of the optimizers are worded in tensors here.

use burn::module::{Module, ModuleMapper, Param};
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor, TensorData};

use super::adam::{Adam, DECAY, Step};
use super::critics::{Reading, Twins};
use super::entropy::{self, EntropyWeight};
use super::losses::{Losses, Networks, Weight, losses};
use super::{Sac, Transitions, Update};
use crate::learner::config::Learning;
use crate::learner::network::Mlp;

/// Losses that are summed up until someone asks: of the critics, of the actor, the entropy and the value.
const N_SUMS: usize = 4;

/// The learner on a device.
pub struct DeviceSac {
    learning: Learning,
    n_actions: usize,
    reading: Reading,
    actor: Mlp,
    critics: Twins,
    target: Twins,
    average: Mlp,
    actor_optimizer: Moments,
    critic_optimizer: Moments,
    entropy_weight: Entropy,
    updates: u64,
    /// Sums since they were last asked for, `[N_SUMS]`, and over how many updates.
    sums: Tensor<1>,
    n_summed: u32,
}

impl DeviceSac {
    /// The learner `host` on a device.
    pub fn new(host: &Sac, device: &Device) -> DeviceSac {
        let learning_device = device.clone().autodiff();
        DeviceSac {
            n_actions: host.reading.n_actions(),
            reading: host.reading.clone(),
            actor: host.actor.on(&learning_device),
            critics: host.critics.on(&learning_device),
            target: host.target.on(device),
            average: host.average.on(device),
            actor_optimizer: Moments::new(&host.actor_optimizer, device),
            critic_optimizer: Moments::new(&host.critic_optimizer, device),
            entropy_weight: Entropy::new(&host.entropy_weight, device),
            updates: host.updates,
            sums: Tensor::zeros([N_SUMS], device),
            n_summed: 0,
            learning: host.learning.clone(),
        }
    }

    /// The actor as it acts now, without gradients.
    pub fn actor(&self) -> Mlp {
        self.actor.valid()
    }

    /// Weight of the entropy beside the reward; waits for the device.
    pub fn entropy_weight(&self) -> f32 {
        self.entropy_weight.value().into_scalar()
    }

    /// One gradient step on a batch, with learning rates times `pace`.
    pub fn update(&mut self, batch: Transitions, pace: f64) {
        let networks = Networks { actor: &self.actor, critics: &self.critics, target: &self.target };
        let alpha = Weight::Tensor(Box::new(self.entropy_weight.value()));
        let Losses { critic, actor, entropy, value, .. } = losses(&self.reading, self.learning.entropy.in_target, &networks, &alpha, batch);
        let told = vec![critic.clone().inner(), actor.clone().inner(), entropy.clone(), value];
        self.sums = self.sums.clone() + Tensor::cat(told, 0);
        self.n_summed += 1;
        let critic_gradients = GradientsParams::from_grads(critic.backward(), &self.critics);
        let actor_gradients = GradientsParams::from_grads(actor.backward(), &self.actor);
        self.updates += 1;
        let [critic_rate, actor_rate] = [self.learning.critic_rate, self.learning.actor_rate].map(|rate| rate * pace);
        let target_rate = if self.updates.is_multiple_of(self.learning.target_every as u64) { self.learning.target_rate } else { 0.0 };
        let [critics, target] = [&mut self.critics, &mut self.target].map(std::mem::take);
        (self.critics, self.target) = self.critic_optimizer.step(critics, target, critic_gradients, critic_rate, target_rate);
        let [actor, average] = [&mut self.actor, &mut self.average].map(std::mem::take);
        (self.actor, self.average) = self.actor_optimizer.step(actor, average, actor_gradients, actor_rate, self.learning.average_rate);
        self.entropy_weight.update(entropy.reshape([1, 1]));
    }

    /// What the updates since the last call came to, summed; waits for the device.
    pub fn summed(&mut self) -> (Update, u32) {
        let sums = host(std::mem::replace(&mut self.sums, Tensor::zeros([N_SUMS], &self.average.layers[0].weight.device())));
        let [critic_loss, actor_loss, entropy, value] = [0, 1, 2, 3].map(|index| sums.get(index).copied().unwrap_or(f32::NAN));
        (Update { critic_loss, actor_loss, entropy, value }, std::mem::take(&mut self.n_summed))
    }

    /// The learner as it is, on the processor; waits for the device.
    pub fn to_host(&self, into: Sac) -> Sac {
        let (plain, learning) = (Device::flex(), Device::flex().autodiff());
        Sac {
            actor: self.actor.on(&learning),
            critics: self.critics.on(&learning),
            target: self.target.on(&plain),
            average: self.average.on(&plain),
            actor_optimizer: self.actor_optimizer.to_host(),
            critic_optimizer: self.critic_optimizer.to_host(),
            entropy_weight: self.entropy_weight.to_host(&self.learning.entropy, self.n_actions),
            updates: self.updates,
            ..into
        }
    }
}

/// Adam's state for one network: both moments of each parameter, flat, in the order in which the network shows its parameters.
struct Moments {
    n_steps: i32,
    moments: Vec<[Tensor<1>; 2]>,
}

impl Moments {
    fn new(adam: &Adam, device: &Device) -> Moments {
        let moved = |values: &Vec<f32>| Tensor::from_data(TensorData::new(values.clone(), [values.len()]), device);
        Moments { n_steps: adam.n_steps, moments: adam.moments.iter().map(|moments| [moved(&moments[0]), moved(&moments[1])]).collect() }
    }

    fn to_host(&self) -> Adam {
        Adam { n_steps: self.n_steps, moments: self.moments.iter().map(|moments| moments.clone().map(host)).collect() }
    }

    /// See [`Adam::step`].
    fn step<M: Module>(&mut self, network: M, follower: M, gradients: GradientsParams, rate: f64, follow: f64) -> (M, M) {
        self.n_steps = self.n_steps.saturating_add(1);
        let mut descend = Descend {
            step: Step::new(self.n_steps, rate, follow),
            gradients,
            moments: std::mem::take(&mut self.moments).into_iter(),
            after: Vec::new(),
            values: Vec::new(),
        };
        let network = network.map(&mut descend);
        self.moments = descend.after;
        (network, follower.map(&mut Follow { rate: descend.step.follow, values: descend.values.into_iter() }))
    }
}

/// Moves a network's parameters against their gradients.
struct Descend {
    step: Step,
    gradients: GradientsParams,
    /// Moments before the step; none before the first.
    moments: std::vec::IntoIter<[Tensor<1>; 2]>,
    after: Vec<[Tensor<1>; 2]>,
    /// Parameters after it.
    values: Vec<Tensor<1>>,
}

impl ModuleMapper for Descend {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (id, tensor, mapper) = param.consume();
        let (shape, learning) = (tensor.dims(), tensor.is_require_grad());
        let value: Tensor<1> = tensor.without_autodiff().flatten(0, D - 1);
        let [first, second] = self.moments.next().unwrap_or_else(|| [value.zeros_like(), value.zeros_like()]);
        // A parameter that has no part in the loss stays.
        let (value, moments) = match self.gradients.remove::<D>(id) {
            None => (value, [first, second]),
            Some(gradient) => {
                let gradient: Tensor<1> = gradient.flatten(0, D - 1);
                let first = first.mul_scalar(DECAY[0]) + gradient.clone().mul_scalar(1.0 - DECAY[0]);
                let second = second.mul_scalar(DECAY[1]) + gradient.square().mul_scalar(1.0 - DECAY[1]);
                let moved = first.clone().mul_scalar(self.step.rate) / second.clone().sqrt().add_scalar(self.step.epsilon);
                (value - moved, [first, second])
            }
        };
        self.after.push(moments);
        self.values.push(value.clone());
        let value: Tensor<D> = value.reshape(shape);
        Param::from_mapped_value(id, value.autodiff().set_require_grad(learning), mapper)
    }
}

/// Moves a network's parameters part of the way to another's.
struct Follow {
    rate: f32,
    values: std::vec::IntoIter<Tensor<1>>,
}

impl ModuleMapper for Follow {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (id, tensor, mapper) = param.consume();
        let shape = tensor.dims();
        let value = match self.values.next() {
            Some(value) if self.rate != 0.0 => tensor.mul_scalar(1.0 - self.rate) + value.reshape(shape).mul_scalar(self.rate),
            _ => tensor,
        };
        Param::from_mapped_value(id, value, mapper)
    }
}

/// The entropy's weight and Adam's state for it, `[1, 1]` each; see [`EntropyWeight`].
struct Entropy {
    log_weight: Tensor<2>,
    goal: Option<f32>,
    rate: f32,
    moments: [Tensor<2>; 2],
    updates: i32,
}

impl Entropy {
    fn new(host: &EntropyWeight, device: &Device) -> Entropy {
        let number = |value: f32| Tensor::from_data(TensorData::new(vec![value], [1, 1]), device);
        Entropy {
            log_weight: number(host.log_weight),
            goal: host.goal,
            rate: host.rate,
            moments: host.moments.map(number),
            updates: host.updates,
        }
    }

    fn value(&self) -> Tensor<2> {
        self.log_weight.clone().exp()
    }

    fn update(&mut self, entropy: Tensor<2>) {
        let Some(goal) = self.goal else { return };
        let gradient = self.value() * entropy.sub_scalar(goal);
        self.updates = self.updates.saturating_add(1);
        let given = [gradient.clone(), gradient.square()];
        let mut corrected = Vec::new();
        for ((moment, value), decay) in self.moments.iter_mut().zip(given).zip(entropy::DECAY) {
            *moment = moment.clone().mul_scalar(decay) + value.mul_scalar(1.0 - decay);
            corrected.push(moment.clone().div_scalar(1.0 - decay.powi(self.updates)));
        }
        if let Ok([first, second]) = <[Tensor<2>; 2]>::try_from(corrected) {
            let moved = first.mul_scalar(self.rate) / second.sqrt().add_scalar(entropy::EPSILON);
            self.log_weight = self.log_weight.clone() - moved;
        }
    }

    fn to_host(&self, entropy: &crate::learner::config::Entropy, n_actions: usize) -> EntropyWeight {
        let number = |tensor: &Tensor<2>| tensor.clone().into_scalar::<f32>();
        EntropyWeight {
            log_weight: number(&self.log_weight),
            moments: [number(&self.moments[0]), number(&self.moments[1])],
            updates: self.updates,
            ..EntropyWeight::new(entropy, n_actions)
        }
    }
}

fn host(tensor: Tensor<1>) -> Vec<f32> {
    tensor.into_data().try_to_vec().expect("parameters and losses are f32")
}

#[cfg(test)]
mod tests;
