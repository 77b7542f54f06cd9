//! Simulator and learner on one device: columns are tensors, and the memory between them never leaves it.
//!
//! The simulator writes its observations into a buffer that a tensor owns; the memory's kernels read the simulator's columns where they are
//! and write samples into buffers of other tensors. Both sides submit to one queue. The tensor library gathers its work before it
//! submits it, so whatever it was asked for is handed over before a submission of ours, and nothing ever waits.

mod kernels;
mod shared;

use std::collections::VecDeque;
use std::sync::Arc;

use burn::tensor::{Tensor, TensorData};
use bytemuck::{bytes_of, cast_slice};
use offtrack::gpu::{Kernels, Slice};
use offtrack::layout::{Column, N_VALUES};
use offtrack::simulator::{Engine, RouteChoice, Simulator};
use offtrack::world::World;
use wgpu::{BindGroup, BindGroupDescriptor, BindGroupEntry, BindingResource, Buffer, BufferBinding, PollType, SubmissionIndex};

use crate::error::Error;
use crate::learner::config::Config;
use crate::learner::mirror::Mirror;
use crate::learner::network::Mlp;
use crate::learner::normalisation::{LIMIT, Scaling};
use crate::learner::sac::Transitions;
use kernels::{Facts, Image, Kernel, Now, Scale};
pub use shared::Shared;
use shared::{Owned, floats, integers};

/// Steps that the host may be ahead of the device: work that waits takes memory, and must not pile up without end.
const AHEAD: usize = 16;
/// The binding of the actor's output.
const LOGITS: usize = 15;

/// The trucks, the learner's memory of them, and the tensors between both and the networks.
pub struct DeviceMemory {
    shared: Shared,
    simulator: Simulator,
    facts: Facts,
    /// Steps of all trucks kept since the beginning, and samples drawn.
    n_kept: u64,
    n_samples: u32,
    /// Steps made, kept or not.
    n_steps: u32,
    kernels: Kernels<Kernel>,
    buffers: Vec<Slice>,
    now: Buffer,
    scaling: Buffer,
    /// What the trucks see, `[n_envs, values]`: the simulator's own column.
    observation: Tensor<2>,
    /// Noise on each value that is learned from.
    noise: [f32; N_VALUES],
    /// Shift and factor of each value, `[1, values]`.
    scale: [Tensor<2>; 2],
    sample: Transitions,
    _owned: Vec<Owned>,
    /// Steps that the device may not have made yet.
    submitted: VecDeque<SubmissionIndex>,
}

impl DeviceMemory {
    /// Trucks on the routes drawn from, and room for `config.memory.capacity` of their transitions.
    pub fn new(shared: &Shared, config: &Config, world: &Arc<World>, routes: Vec<u32>, seeds: [u32; 2]) -> Result<DeviceMemory, Error> {
        let (n_envs, n_rows) = (config.n_envs, config.learning.batch);
        let n_slots = config.memory.capacity.div_ceil(n_envs);
        let row_bytes = (N_VALUES * size_of::<f32>()) as u64;
        let limit = shared.gpu.device.limits().max_storage_buffer_binding_size.min(u64::from(u32::MAX) * 4);
        let needed = (n_slots * n_envs) as u64 * row_bytes;
        if limit < needed {
            let name = shared.gpu.name();
            let expected =
                format!("its observations take {needed} bytes where {name} allows {limit} in a buffer: at most {}", limit / row_bytes);
            return Err(Error::Flag { flag: "memory.capacity", value: config.memory.capacity.to_string(), expected });
        }
        let mirror = config.learning.mirror.then(|| Mirror::of(world)).transpose()?;
        let device = &shared.tensors;
        let zeros = |width: usize| Tensor::<2>::zeros([n_rows, width], device);
        let observation = Tensor::<2>::zeros([n_envs, N_VALUES], device);
        let sample = Transitions {
            observation: zeros(N_VALUES),
            action: Tensor::from_data(TensorData::new(vec![0i32; n_rows], [n_rows, 1]), device),
            reward: zeros(1),
            discount: zeros(1),
            next_observation: zeros(N_VALUES),
            weight: Tensor::ones([n_rows, 1], device),
        };
        shared.hand_over()?;
        let seen = floats(&observation)?;
        let drawn = [
            floats(&sample.observation)?,
            integers(&sample.action)?,
            floats(&sample.reward)?,
            floats(&sample.discount)?,
            floats(&sample.next_observation)?,
        ];
        let engine = Engine::Gpu { device: shared.gpu.clone(), columns: vec![(Column::Observation, seen.slice.clone())] };
        let mut simulator = Simulator::on(engine, world.clone(), n_envs, config.seed, RouteChoice::Drawn(routes))?;

        let facts = Facts {
            n_envs: n_envs as u32,
            n_slots: n_slots as u32,
            n_actions: world.params.n_actions,
            n_rows: n_rows as u32,
            n_steps: config.learning.n_steps as u32,
            acting_seed: seeds[0],
            sampling_seed: seeds[1],
            mirrored: mirror.is_some().into(),
            discount: config.learning.discount as f32,
            reward_scale: config.learning.reward_scale as f32,
            scaled_limit: LIMIT,
        };
        let filled = |contents: &[u8]| shared.gpu.filled("memory", contents);
        let empty = |size: u64| shared.gpu.empty("memory", size);
        let now = empty(size_of::<Now>() as u64);
        let scaling = filled(cast_slice(&[Scale { mean: 0.0, factor: 1.0, noise: 0.0 }; N_VALUES]));
        let (values, actions) = match &mirror {
            Some(mirror) => mirror.images(),
            None => (std::array::from_fn(|index| (index, 1.0)), (0..world.params.n_actions).collect()),
        };
        let images = values.map(|(place, factor)| Image { place: place as u32, factor });
        let columns = [Column::Action, Column::Observation, Column::NextObservation, Column::Ended, Column::Reward];
        let batch = simulator.on_device().ok_or_else(|| Error::Device("the simulator is not on a device".to_owned()))?;
        let columns: Vec<Slice> = columns.map(|column| batch.column(column).clone()).into();
        let held = (n_slots * n_envs) as u64;
        let mut buffers =
            vec![filled(bytes_of(&facts)), now.clone(), scaling.clone(), filled(cast_slice(&images)), filled(cast_slice(&actions))];
        buffers.extend(columns);
        buffers.extend([held * row_bytes, held * row_bytes, held * 4, held * 4, held * 4].map(empty));
        // The actor's output is another buffer every step; until the first one something must stand there.
        buffers.push(empty(4));
        buffers.extend(drawn.iter().map(|owned| owned.slice.clone()));
        shared.check()?;
        let scale = [0.0, 1.0].map(|value| Tensor::full([1, N_VALUES], value, device));
        Ok(DeviceMemory {
            kernels: kernels::compile(&shared.gpu.device),
            shared: shared.clone(),
            simulator,
            facts,
            n_kept: 0,
            n_samples: 0,
            n_steps: 0,
            buffers,
            now: now.buffer,
            scaling: scaling.buffer,
            noise: [config.learning.observation_noise as f32; N_VALUES],
            observation,
            scale,
            sample,
            _owned: drawn.into_iter().chain([seen]).collect(),
            submitted: VecDeque::with_capacity(AHEAD),
        })
    }

    /// The trucks.
    pub fn simulator(&self) -> &Simulator {
        &self.simulator
    }

    /// Transitions held.
    pub fn len(&self) -> usize {
        self.slots_held() as usize * self.facts.n_envs as usize
    }

    /// Whether there is a step that enough others follow, so that one can be drawn.
    pub fn can_sample(&self) -> bool {
        self.facts.n_steps < self.slots_held()
    }

    /// One step of every truck by chance, kept.
    pub fn step_at_random(&mut self) -> Result<(), Error> {
        self.step(None, true)
    }

    /// One step of every truck by the actor, kept.
    pub fn step_by(&mut self, actor: &Mlp) -> Result<(), Error> {
        let logits = actor.forward(self.scaled());
        self.step(Some(&logits), true)
    }

    /// One step of every truck by the actor, which nobody will learn from.
    pub fn drive_by(&mut self, actor: &Mlp) -> Result<(), Error> {
        let logits = actor.forward(self.scaled());
        self.step(Some(&logits), false)
    }

    /// What the trucks see, scaled, `[n_envs, values]`.
    fn scaled(&self) -> Tensor<2> {
        let [mean, factor] = self.scale.clone();
        ((self.observation.clone() - mean) * factor).clamp(-LIMIT, LIMIT)
    }

    fn step(&mut self, logits: Option<&Tensor<2>>, is_kept: bool) -> Result<(), Error> {
        self.shared.hand_over()?;
        let output = logits.map(floats).transpose()?;
        let group = self.group(output.as_ref().map(|output| &output.slice));
        self.tell_now();
        let mut encoder = self.shared.gpu.device.create_command_encoder(&Default::default());
        let values = self.facts.n_envs * N_VALUES as u32;
        let batch = self.simulator.on_device().ok_or_else(|| Error::Device("the simulator is not on a device".to_owned()))?;
        if logits.is_some() {
            kernels::add(&self.kernels, &mut encoder, &group, Kernel::Choose, self.facts.n_envs);
        } else {
            batch.add_draw(&mut encoder);
        }
        if is_kept {
            kernels::add(&self.kernels, &mut encoder, &group, Kernel::Keep, values);
        }
        batch.add_step(&mut encoder);
        if is_kept {
            kernels::add(&self.kernels, &mut encoder, &group, Kernel::Remember, values);
            self.n_kept += 1;
        }
        batch.stepped();
        self.n_steps = self.n_steps.wrapping_add(1);
        if self.submitted.len() == AHEAD {
            let waited = self.shared.gpu.device.poll(PollType::Wait { submission_index: self.submitted.pop_front(), timeout: None });
            waited.map_err(|error| Error::Device(error.to_string()))?;
        }
        self.submitted.push_back(self.shared.gpu.queue.submit([encoder.finish()]));
        Ok(())
    }

    /// Draws transitions: the same tensors every time, with other values in them.
    pub fn sample(&mut self) -> Result<Transitions, Error> {
        self.shared.hand_over()?;
        let group = self.group(None);
        self.tell_now();
        let mut encoder = self.shared.gpu.device.create_command_encoder(&Default::default());
        kernels::add(&self.kernels, &mut encoder, &group, Kernel::Sample, self.facts.n_rows * N_VALUES as u32);
        self.shared.gpu.queue.submit([encoder.finish()]);
        self.n_samples = self.n_samples.wrapping_add(1);
        Ok(Transitions {
            observation: self.sample.observation.clone(),
            action: self.sample.action.clone(),
            reward: self.sample.reward.clone(),
            discount: self.sample.discount.clone(),
            next_observation: self.sample.next_observation.clone(),
            weight: self.sample.weight.clone(),
        })
    }

    /// What the trucks saw in the steps held, read to the host.
    pub fn observations(&self) -> Result<Vec<[f32; N_VALUES]>, Error> {
        let Slice { buffer, .. } = &self.buffers[10];
        let size = (self.len() * N_VALUES * size_of::<f32>()) as u64;
        let slice = Slice { buffer: buffer.clone(), offset: 0, size };
        let bytes = self.shared.gpu.read(&[slice]).map_err(offtrack::simulator::Error::from)?;
        // A byte vector need not lie where a float may.
        Ok(bytes[0].chunks_exact(N_VALUES * 4).map(bytemuck::pod_read_unaligned).collect())
    }

    /// From here on observations are scaled so, for acting and learning alike.
    pub fn set_scaling(&mut self, scaling: &Scaling) {
        let rows = scaling.mean.iter().zip(&scaling.factor).zip(&self.noise);
        let rows: Vec<Scale> = rows.map(|((&mean, &factor), &noise)| Scale { mean, factor, noise }).collect();
        self.shared.gpu.queue.write_buffer(&self.scaling, 0, cast_slice(&rows));
        let row = |values: &[f32]| Tensor::from_data(TensorData::new(values.to_vec(), [1, values.len()]), &self.shared.tensors);
        self.scale = [row(&scaling.mean), row(&scaling.factor)];
    }

    fn slots_held(&self) -> u32 {
        self.n_kept.min(self.facts.n_slots.into()) as u32
    }

    fn tell_now(&self) {
        let (held, n_slots) = (self.slots_held(), u64::from(self.facts.n_slots));
        let now = Now {
            slot: (self.n_kept % n_slots) as u32,
            oldest: ((self.n_kept - u64::from(held)) % n_slots) as u32,
            n_drawable: held.saturating_sub(self.facts.n_steps),
            step: self.n_steps,
            sample: self.n_samples,
        };
        self.shared.gpu.queue.write_buffer(&self.now, 0, bytes_of(&now));
    }

    fn group(&self, logits: Option<&Slice>) -> BindGroup {
        let slice = |index: usize| if index == LOGITS { logits.unwrap_or(&self.buffers[LOGITS]) } else { &self.buffers[index] };
        let entries: Vec<BindGroupEntry> = (0..self.buffers.len())
            .map(|index| {
                let Slice { buffer, offset, size } = slice(index);
                let size = std::num::NonZero::new(*size);
                let resource = BindingResource::Buffer(BufferBinding { buffer, offset: *offset, size });
                BindGroupEntry { binding: index as u32, resource }
            })
            .collect();
        let layout = &self.kernels.layout;
        self.shared.gpu.device.create_bind_group(&BindGroupDescriptor { label: Some("memory"), layout, entries: &entries })
    }
}

#[cfg(test)]
mod tests;
