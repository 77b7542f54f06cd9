//! The buffers that the replay buffer's kernels are bound to: its own, the simulator's columns, and what the learner is
//! given and gives.

use bytemuck::{bytes_of, cast_slice};
use offtrack::gpu::{Device, Kernels, Slice};
use offtrack::layout::{Column, ObservationLayout};
use wgpu::BindGroup;

use super::DeviceRollout;
use super::memory_kernels::{Binding, Kernel, Now, Value};
use crate::config::Config;
use crate::device::Batch;
use crate::error::Error;

/// A buffer for every binding.
#[derive(Debug, Default)]
pub(super) struct Buffers(Vec<(Binding, Slice)>);

impl Buffers {
    /// The bindings in any order, each once.
    pub(super) fn new(mut slices: Vec<(Binding, Slice)>) -> Buffers {
        slices.sort_by_key(|(binding, _)| *binding as u32);
        assert!(slices.iter().map(|(binding, _)| *binding).eq(Binding::ALL), "every binding has one buffer");
        Buffers(slices)
    }

    /// The buffer of a binding.
    pub(super) fn slice(&self, binding: Binding) -> &Slice {
        &self.0[binding as usize].1
    }

    /// A bind group of those that a kernel names, with the `other` buffer for one of them where one is given.
    pub(super) fn group(
        &self,
        device: &wgpu::Device,
        kernels: &Kernels<Kernel>,
        kernel: Kernel,
        other: Option<(Binding, &Slice)>,
    ) -> BindGroup {
        let named = kernel.bindings().iter().map(|&binding| {
            let replaced = other.filter(|(replaced, _)| *replaced == binding);
            (binding as u32, replaced.map_or(self.slice(binding), |(_, slice)| slice))
        });
        kernels.bind(device, kernel, named)
    }
}

impl<const N: usize> DeviceRollout<N> {
    /// A buffer for every binding of the kernels.
    pub(super) fn make_buffers(&mut self) -> Result<Buffers, Error> {
        let gpu = self.gpu.clone();
        let filled = |contents: &[u8]| gpu.filled("replay buffer", contents);
        let empty = |size: usize| gpu.empty("replay buffer", size as u64);
        let actions = match &self.mirror {
            Some(mirror) => mirror.images().1,
            None => (0..self.facts.n_actions).collect(),
        };
        let Batch { observation, action, reward, discount, next_observation, weight } = self.sample.clone();
        let of_trucks = |width: usize| empty(self.config.n_envs * width * 4);
        let held = (self.facts.n_slots * self.facts.n_envs) as usize;
        // What priorities alone need is small without them.
        let (ranked, n_blocks) = if self.has_priorities() { (held, self.facts.n_blocks as usize) } else { (1, 1) };
        let batch =
            self.simulator.on_device().ok_or_else(|| Error::Device("the simulator is not on a device".to_owned()))?;
        let column = |column: Column| batch.column(column).clone();
        let layout = const { ObservationLayout::of_width(N).unwrap() };
        // Where they are not observed any buffer will do.
        let of_vehicles = |of: Column| if layout.has_vehicles { column(of) } else { empty(size_of::<f32>()) };
        let row_bytes = N * size_of::<f32>();
        let buffers = Buffers::new(vec![
            (Binding::facts, filled(bytes_of(&self.facts))),
            (Binding::now, empty(size_of::<Now>())),
            (Binding::values, empty(N * size_of::<Value>())),
            (Binding::action_images, filled(cast_slice(&actions))),
            (Binding::action, column(Column::Action)),
            (Binding::truck, column(Column::Truck)),
            (Binding::observation, column(Column::Observation)),
            (Binding::next_observation, column(Column::NextObservation)),
            (Binding::extras, column(Column::Extras)),
            (Binding::next_extras, column(Column::NextExtras)),
            (Binding::around, of_vehicles(Column::Around)),
            (Binding::next_around, of_vehicles(Column::NextAround)),
            (Binding::ended, column(Column::Ended)),
            (Binding::reward, column(Column::Reward)),
            (Binding::driven, empty(self.config.n_envs * 4)),
            (Binding::route_ends, empty(self.counted_ends.len() * 4)),
            (Binding::held_observation, empty(held * row_bytes)),
            (Binding::held_next, empty(held * row_bytes)),
            (Binding::held_action, empty(held * 4)),
            (Binding::held_reward, empty(held * 4)),
            (Binding::held_ended, empty(held * 4)),
            (Binding::seen, of_trucks(N)),
            (Binding::logits, of_trucks(self.facts.n_actions as usize)),
            // The learner's is bound once it has one.
            (Binding::td_error, empty(4)),
            (Binding::priority, empty(ranked * 4)),
            (Binding::block_sum, empty(n_blocks * 4)),
            (Binding::reached, empty(n_blocks * 4)),
            (Binding::largest, filled(bytes_of(&1.0f32))),
            (Binding::sampled_row, empty(self.facts.n_rows as usize * 4)),
            (Binding::sampled_weight, weight),
            (Binding::sampled_observation, observation),
            (Binding::sampled_action, action),
            (Binding::sampled_reward, reward),
            (Binding::sampled_discount, discount),
            (Binding::sampled_next, next_observation),
        ]);
        Ok(buffers)
    }
}

/// The observations must fit into one buffer of the device.
pub(super) fn check_capacity<const N: usize>(gpu: &Device, config: &Config, n_transitions: usize) -> Result<(), Error> {
    let row_bytes = (N * size_of::<f32>()) as u64;
    let limit = gpu.device.limits().max_storage_buffer_binding_size.min(u64::from(u32::MAX) * 4);
    let needed = n_transitions as u64 * row_bytes;
    if needed <= limit {
        return Ok(());
    }
    let (name, most) = (gpu.name(), limit / row_bytes);
    let expected =
        format!("its observations take {needed} bytes where {name} allows {limit} in a buffer: at most {most}");
    Err(Error::setting("replay_buffer.capacity", config.replay_buffer.capacity.to_string(), expected))
}
