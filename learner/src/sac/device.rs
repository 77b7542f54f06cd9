//! Soft actor-critic on a graphics device, by kernels of its own: nothing leaves it, and an update is one submission.
//!
//! A tensor library launches hundreds of kernels for an update of a network of two hidden layers; their starts on the
//! host, not their work, would be what it takes. Here they are 16, bound once: products of matrices for all passes
//! at a time, and what lies between them. All numbers are in one buffer. To be saved or looked at they become a learner
//! on the processor, and from one they begin.

pub(super) mod kernels;
mod plan;

use std::rc::Rc;

use burn::tensor::Device;
use bytemuck::{bytes_of, cast_slice};
use glam::Vec2;
use offtrack::gpu::{self, Kernels, Slice};
use wgpu::{BindGroup, ComputePassDescriptor};

use super::critics::Twins;
use super::{Learner, Sac, Update};
use crate::adam::{Adam, State, Step};
use crate::checkpoint::{Columns, Stored};
use crate::config::{Critics, Learning};
use crate::device::{Batch, NUMBER, Network, numbers, part};
use crate::error::Error;
use crate::exchange::{Actor, Sample, TdErrors};
use crate::network::Mlp;
use crate::panics::unreadable;
use kernels::{Binding, Facts, Kernel, N_LEARNING, Now};
use offtrack::layout::WORKGROUP;
use plan::{Dispatch, N_ENTROPY, N_NETWORKS, N_SUMS, Of, Plan};

/// The learner.
pub struct DeviceSac {
    learning: Learning,
    gpu: gpu::Device,
    /// The networks' layers, and their values and actions. Its numbers are those at the beginning.
    like: Rc<Sac>,
    kernels: Kernels<Kernel>,
    plan: Plan,
    facts: Slice,
    now: Slice,
    /// All numbers: see [`Plan`].
    memory: Slice,
    /// For each of the plan's dispatches; none for those that are bound to a sample.
    groups: Vec<Option<BindGroup>>,
    /// The sample that the others are bound to, and what they are bound by.
    bound_to: Option<(Box<Batch>, Vec<Option<BindGroup>>)>,
    /// Absolute TD errors of the latest batch, `[B]`.
    td_error: Slice,
    /// Steps of the actor's optimizer and of the critics', and of the entropy coefficient.
    n_steps: [i32; 3],
    n_updates: u64,
    n_summed: u64,
}

impl DeviceSac {
    /// The learner that [`Sac::new`] gives, on a device.
    pub fn new(
        gpu: &gpu::Device,
        learning: &Learning,
        n_values: usize,
        n_actions: usize,
        seed: u64,
    ) -> Result<DeviceSac, Error> {
        let like = Rc::new(Sac::new(learning, n_values, n_actions, seed)?);
        let sizes: Vec<usize> =
            [n_values].into_iter().chain(learning.hidden.iter().copied()).chain([n_actions]).collect();
        let mut plan = Plan::new(&sizes, learning.layer_norm, learning.batch);
        plan.facts.takes_minimum = (learning.critics == Critics::Minimum).into();
        plan.facts.entropy_in_target = learning.entropy.in_target.into();
        let size = (plan.length * size_of::<f32>()) as u64;
        let limit = gpu.device.limits().max_storage_buffer_binding_size.min(gpu.device.limits().max_buffer_size);
        if limit < size {
            let expected = format!(
                "with hidden layers of {:?} the learner takes {size} bytes where {} allows {limit} in a buffer: a \
                 smaller batch, or smaller layers",
                learning.hidden,
                gpu.name()
            );
            return Err(Error::setting("learning.batch", learning.batch.to_string(), expected));
        }
        let mut learner = DeviceSac {
            kernels: kernels::compile(&gpu.device),
            facts: gpu.filled("learner", bytes_of(&plan.facts)),
            now: gpu.empty("learner", size_of::<Now>() as u64),
            memory: gpu.empty("learner", size),
            groups: Vec::new(),
            td_error: gpu.empty("learner", learning.batch as u64 * NUMBER),
            bound_to: None,
            n_steps: [0; 3],
            n_updates: 0,
            n_summed: 0,
            learning: learning.clone(),
            gpu: gpu.clone(),
            like: like.clone(),
            plan,
        };
        learner.groups = learner.plan.dispatches.iter().map(|dispatch| learner.bound(dispatch, &[])).collect();
        learner.put(&like);
        gpu.check().map_err(offtrack::simulator::Error::from)?;
        Ok(learner)
    }

    /// What a dispatch is bound to, with buffers of a sample; none without those that it needs.
    fn bound(&self, dispatch: &Dispatch, sample: &[(Binding, &Slice)]) -> Option<BindGroup> {
        let gpu = &self.gpu;
        let own = match &dispatch.of {
            Of::All => None,
            Of::Products(products) => Some((Binding::Products, gpu.filled("products", cast_slice(&products[..])))),
            Of::Norms(norms) => Some((Binding::Norms, gpu.filled("norms", cast_slice(norms)))),
        };
        let mut slices =
            vec![(Binding::Facts, &self.facts), (Binding::Now, &self.now), (Binding::Memory, &self.memory)];
        slices.push((Binding::TdError, &self.td_error));
        slices.extend(own.iter().map(|(binding, slice)| (*binding, slice)));
        slices.extend(sample);
        let named: Option<Vec<(u32, &Slice)>> = dispatch
            .kernel
            .bindings()
            .iter()
            .map(|binding| slices.iter().find(|(of, _)| of == binding).map(|(_, slice)| (*binding as u32, *slice)))
            .collect();
        Some(self.kernels.bind(&gpu.device, dispatch.kernel, named?))
    }

    /// Goes on with a learner's numbers.
    fn put(&mut self, sac: &Sac) {
        let write = |place: u32, values: &[f32]| {
            let offset = u64::from(place) * size_of::<f32>() as u64;
            self.gpu.queue.write_buffer(&self.memory.buffer, offset, cast_slice(values));
        };
        let Facts { n_parameters, moments, entropy, sums, .. } = self.plan.facts;
        let flat =
            |network: &Mlp| network.parameters().into_iter().flat_map(|(_, values)| values).collect::<Vec<f32>>();
        for (network, place) in networks(sac).into_iter().zip((0..).step_by(n_parameters as usize)) {
            write(place, &flat(network));
        }
        let [actor, critics] = [&sac.actor_optimizer, &sac.critic_optimizer].map(Adam::state);
        // Those of the actor stand before its unused place, those of the critics behind it.
        for which in 0..2 {
            let of =
                |state: &State| state.moments.iter().flat_map(|moments| moments[which].clone()).collect::<Vec<f32>>();
            let first = moments + (which * N_LEARNING) as u32 * n_parameters;
            let mut values = of(&actor);
            values.resize(n_parameters as usize, 0.0);
            values.extend(of(&critics));
            values.resize(N_LEARNING * n_parameters as usize, 0.0);
            write(first, &values);
        }
        let coefficient = &sac.entropy_coefficient;
        write(entropy, &[coefficient.log, coefficient.moments[0], coefficient.moments[1]]);
        write(sums, &sac.sums);
        self.n_steps = [actor.n_steps, critics.n_steps, coefficient.n_updates];
        (self.n_updates, self.n_summed) = (sac.n_updates, sac.n_summed);
    }

    /// So many numbers from a place on. Waits for the device.
    fn read(&self, place: u32, n: usize) -> Vec<f32> {
        numbers(&self.gpu, &part(&self.memory, place as usize, n)).unwrap_or_else(|error| unreadable(&error))
    }

    /// This learner on the processor. Waits for the device.
    fn taken(&self) -> Result<Sac, Error> {
        let Facts { n_parameters, moments, entropy, sums, .. } = self.plan.facts;
        let n = n_parameters as usize;
        let parameters = self.read(0, N_NETWORKS * n);
        let moments = self.read(moments, 2 * N_LEARNING * n);
        let mut sac = self.another()?;
        let device = Device::flex();
        let networks = networks(&self.like);
        let network = |index: usize| {
            networks[index].with_parameters(split(&parameters[index * n..], &[networks[index]]), &device)
        };
        (sac.actor, sac.actor_ema) = (network(0), network(N_LEARNING));
        sac.critics = Twins { first: network(1), second: network(2) };
        sac.target_critics = Twins { first: network(N_LEARNING + 1), second: network(N_LEARNING + 2) };
        let state = |n_steps: i32, networks: &[&Mlp], at: usize| {
            let [first, second] = [0, N_LEARNING * n].map(|which| split(&moments[which + at..], networks));
            let moments = first.into_iter().zip(second).map(|(first, second)| [first, second]);
            // There are none before the first step.
            State { n_steps, moments: moments.filter(|_| 0 < n_steps).collect() }
        };
        sac.actor_optimizer.restore(state(self.n_steps[0], &networks[..1], 0));
        sac.critic_optimizer.restore(state(self.n_steps[1], &networks[1..N_LEARNING], n));
        let entropy = self.read(entropy, N_ENTROPY);
        let coefficient = &mut sac.entropy_coefficient;
        (coefficient.log, coefficient.moments) = (entropy[0], [entropy[1], entropy[2]]);
        coefficient.n_updates = self.n_steps[2];
        sac.sums.copy_from_slice(&self.read(sums, N_SUMS));
        (sac.n_updates, sac.n_summed) = (self.n_updates, self.n_summed);
        Ok(sac)
    }

    /// A learner of the same sizes on the processor.
    fn another(&self) -> Result<Sac, Error> {
        let Facts { n_values, n_actions, .. } = self.plan.facts;
        Sac::new(&self.learning, n_values as usize, n_actions as usize, 0)
    }

    /// See [`DeviceSac::taken`]; what is wrong with the device ends the run where it is caught.
    fn on_host(&self) -> Sac {
        self.taken().unwrap_or_else(|error| unreadable(&error))
    }

    /// What changes from one update to the next, after it is counted.
    fn counted(&mut self, rate_factor: f64) -> Now {
        let super::Step { rates, follow, is_learning } =
            super::Step::of(&self.learning, &mut self.n_updates, rate_factor);
        self.n_steps[..2].iter_mut().for_each(|steps| *steps = steps.saturating_add(1));
        let actor = Step::new(self.n_steps[0], rates[0], follow[0]);
        let critics = Step::new(self.n_steps[1], rates[1], follow[1]);
        let coefficient = &self.like.entropy_coefficient;
        let target = coefficient.target.filter(|_| is_learning);
        if target.is_some() {
            self.n_steps[2] = self.n_steps[2].saturating_add(1);
        }
        let [first, second] = crate::adam::DECAY.map(|decay| 1.0 - decay.powi(self.n_steps[2]));
        Now {
            rates: Vec2::new(actor.learning_rate, critics.learning_rate),
            epsilons: Vec2::new(actor.epsilon, critics.epsilon),
            follow: Vec2::new(actor.tau, critics.tau),
            entropy_corrections: Vec2::new(first, second),
            entropy_rate: coefficient.learning_rate,
            entropy_target: target.unwrap_or_default(),
            adapts: target.is_some().into(),
            unused: 0,
        }
    }
}

/// The networks: those that learn, and those that follow them, in the same order.
fn networks(sac: &Sac) -> [&Mlp; N_NETWORKS] {
    let Sac { actor, critics, actor_ema, target_critics, .. } = sac;
    [actor, &critics.first, &critics.second, actor_ema, &target_critics.first, &target_critics.second]
}

/// Values in parts as long as the parameters of networks, one after the other.
fn split(values: &[f32], networks: &[&Mlp]) -> Vec<Vec<f32>> {
    let lengths = networks.iter().flat_map(|network| network.parameters()).map(|(_, values)| values.len());
    let mut at = 0;
    lengths
        .map(|length| {
            at += length;
            values[at - length..at].to_vec()
        })
        .collect()
}

impl Learner for DeviceSac {
    fn set_actor(&mut self, actor: &Mlp) {
        let mut sac = self.on_host();
        sac.set_actor(actor);
        self.put(&sac);
    }

    fn actor(&self) -> Actor {
        let Facts { n_values, n_actions, n_parameters, .. } = self.plan.facts;
        let hidden = self.learning.hidden.iter().copied();
        Actor::Device(Network {
            parameters: part(&self.memory, 0, n_parameters as usize),
            sizes: [n_values as usize].into_iter().chain(hidden).chain([n_actions as usize]).collect(),
        })
    }

    fn actor_ema(&self) -> Mlp {
        self.on_host().actor_ema()
    }

    fn entropy_coefficient(&self) -> f32 {
        self.read(self.plan.facts.entropy, 1)[0].exp()
    }

    fn update(&mut self, sample: Sample, rate_factor: f64) -> Result<TdErrors, Error> {
        let sample = sample.on_device()?;
        let now = self.counted(rate_factor);
        self.gpu.queue.write_buffer(&self.now.buffer, 0, bytes_of(&now));
        if self.bound_to.as_ref().is_none_or(|(batch, _)| batch.observation.buffer != sample.observation.buffer) {
            let slices = [
                (Binding::Observation, &sample.observation),
                (Binding::NextObservation, &sample.next_observation),
                (Binding::Action, &sample.action),
                (Binding::Reward, &sample.reward),
                (Binding::Discount, &sample.discount),
                (Binding::Weight, &sample.weight),
            ];
            let unbound = self.plan.dispatches.iter().zip(&self.groups);
            let groups = unbound.map(|(dispatch, group)| match group {
                None => self.bound(dispatch, &slices),
                Some(_) => None,
            });
            self.bound_to = Some((sample.clone(), groups.collect()));
        }
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        let to_sample = self.bound_to.iter().flat_map(|(_, groups)| groups);
        for ((dispatch, group), to_sample) in self.plan.dispatches.iter().zip(&self.groups).zip(to_sample) {
            let threads = u64::from(dispatch.groups) * u64::from(WORKGROUP);
            if let Some(group) = group.as_ref().or(to_sample.as_ref()) {
                self.kernels.dispatch(&mut pass, dispatch.kernel, group, threads);
            }
        }
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
        self.n_summed += 1;
        Ok(TdErrors::Device(self.td_error.clone()))
    }

    fn take_sums(&mut self) -> (Update, u64) {
        let place = self.plan.facts.sums;
        let sums = self.read(place, N_SUMS);
        let offset = u64::from(place) * size_of::<f32>() as u64;
        self.gpu.queue.write_buffer(&self.memory.buffer, offset, &[0; N_SUMS * size_of::<f32>()]);
        (Update::of([sums[0], sums[1], sums[2], sums[3]]), std::mem::take(&mut self.n_summed))
    }

    /// None: the figures are not at hand.
    fn diverged(&self) -> Option<(&'static str, f32)> {
        None
    }

    fn broken(&self) -> Option<(String, f32)> {
        self.on_host().broken()
    }

    fn save(&self, columns: &mut Columns) {
        self.on_host().save(columns);
    }

    fn restore(&mut self, stored: &Stored) -> Result<(), Error> {
        let mut sac = self.another()?;
        sac.restore(stored)?;
        self.put(&sac);
        Ok(())
    }
}
