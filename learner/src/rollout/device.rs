//! Trucks and replay buffer on a graphics device: nothing leaves it.
//!
//! The simulator writes observations into a buffer that a tensor owns. Kernels read the simulator's columns in place
//! and write samples into buffers of other tensors. Both sides submit to one queue. The tensor library queues its work
//! before it submits it, so it is flushed before every submission of ours, and nothing waits.

mod buffers;
mod levels;
mod memory_kernels;
mod shared;

use std::collections::VecDeque;
use std::sync::Arc;

use burn::tensor::{Tensor, TensorData};
use bytemuck::{bytes_of, cast_slice};
use offtrack::gpu::{Kernels, Slice};
use offtrack::layout::random;
use offtrack::layout::{Column, Ended, N_AROUND, N_EXTRAS, N_VALUES};
use offtrack::simulator::{Engine, RouteChoice, Simulator, Tally};
use offtrack::world::World;
use offtrack_policy::{LIMIT, Normalisation};
use wgpu::{PollType, SubmissionIndex};

use super::{Episodes, Rollout, RouteEnd, n_around};
use crate::checkpoint::{Columns, Stored};
use crate::config::{Config, Refinement};
use crate::error::Error;
use crate::level_replay::LevelReplay;
use crate::mirror::Mirror;
use crate::network::Mlp;
use crate::ppo::steps::Steps;
use crate::sac::Transitions;
use buffers::{Buffers, check_capacity};
use memory_kernels::{BLOCK, Binding, Facts, Kernel, Now, Value};
pub use shared::Shared;
use shared::{Owned, floats};

/// Maximum number of steps queued ahead of the device. Queued work holds memory.
const MAX_QUEUED_STEPS: usize = 16;

/// Trucks and a replay buffer whose networks observe `N` values. See the module.
pub struct DeviceRollout<const N: usize> {
    config: Config,
    routes: Vec<u32>,
    mirror: Option<Mirror>,
    shared: Shared,
    kernels: Kernels<Kernel>,
    simulator: Simulator,
    facts: Facts,
    buffers: Buffers,
    /// The simulator's column of observations, `[n_envs, N_VALUES]`.
    observation: Tensor<2>,
    /// The simulator's column of extras, `[n_envs, N_EXTRAS]`.
    extras: Tensor<2>,
    /// The simulator's column of other vehicles where the networks observe them, `[n_envs, N_AROUND]`.
    around: Option<Tensor<2>>,
    /// Mean and factor of each value, `[1, N]`.
    normalisation: [Tensor<2>; 2],
    sample: Transitions,
    _owned: Vec<Owned>,
    /// Steps of all trucks appended, and steps made.
    n_appended: u64,
    n_steps: u32,
    n_samples: u32,
    /// Steps that the device may not have made yet.
    queued: VecDeque<SubmissionIndex>,
    /// The tally when it was last read.
    counted: Tally,
    /// None where routes are drawn uniformly: episodes are then not counted by route.
    level_replay: Option<LevelReplay>,
    /// The counts of episodes by route and end code when they were last read, and the episodes since then.
    counted_ends: Vec<u32>,
    route_ends: Vec<RouteEnd>,
}

impl<const N: usize> DeviceRollout<N> {
    /// Trucks at the start of their first episodes, and an empty replay buffer of `config.replay_buffer.capacity`
    /// transitions.
    pub fn new(
        shared: &Shared,
        config: &Config,
        world: &Arc<World>,
        routes: Vec<u32>,
        mirror: Option<Mirror>,
    ) -> Result<DeviceRollout<N>, Error> {
        DeviceRollout::with_seeds(shared, config, world, routes, mirror, seeds(config.seed, 0))
    }

    fn with_seeds(
        shared: &Shared,
        config: &Config,
        world: &Arc<World>,
        routes: Vec<u32>,
        mirror: Option<Mirror>,
        seeds: [u32; 2],
    ) -> Result<DeviceRollout<N>, Error> {
        let (n_envs, n_rows) = (config.n_envs, config.learning.batch);
        let n_slots = config.replay_buffer.capacity.div_ceil(n_envs);
        check_capacity::<N>(shared, config, n_slots * n_envs)?;
        let device = &shared.tensors;
        let zeros = |width: usize| Tensor::<2>::zeros([n_rows, width], device);
        let observation = Tensor::<2>::zeros([n_envs, N_VALUES], device);
        let extras = Tensor::<2>::zeros([n_envs, N_EXTRAS], device);
        let around = (0 < n_around(N)).then(|| Tensor::<2>::zeros([n_envs, N_AROUND], device));
        let sample = Transitions {
            observation: zeros(N),
            action: Tensor::from_data(TensorData::new(vec![0i32; n_rows], [n_rows, 1]), device),
            reward: zeros(1),
            discount: zeros(1),
            next_observation: zeros(N),
            weight: Tensor::ones([n_rows, 1], device),
        };
        shared.flush()?;
        let mut owned = vec![floats(&observation)?, floats(&extras)?];
        owned.extend(around.as_ref().map(floats).transpose()?);
        let external = [Column::Observation, Column::Extras, Column::Around];
        let columns = external.into_iter().zip(&owned).map(|(column, owned)| (column, owned.slice.clone())).collect();
        let engine = Engine::Gpu { device: shared.gpu.clone(), columns };
        let level_replay = config.level_replay.map(|settings| LevelReplay::new(settings, routes.clone()));
        let drawn = level_replay.as_ref().map_or_else(|| routes.clone(), |replay| replay.list().to_vec());
        let simulator = Simulator::on(engine, world.clone(), n_envs, config.seed, RouteChoice::Drawn(drawn))?;
        let priority = config.replay_buffer.priority;
        let facts = Facts {
            n_envs: n_envs as u32,
            n_slots: n_slots as u32,
            n_actions: world.params.n_actions,
            n_values: N as u32,
            n_extras: (N - N_VALUES - n_around(N)) as u32,
            n_rows: n_rows as u32,
            n_steps: config.learning.n_steps as u32,
            acting_seed: seeds[0],
            sampling_seed: seeds[1],
            n_blocks: ((n_slots * n_envs) as u32).div_ceil(BLOCK),
            mirrored: mirror.is_some().into(),
            gamma: config.learning.gamma as f32,
            arrival: config.learning.arrival.unwrap_or(0.0) as f32,
            reward_scale: config.learning.reward_scale as f32,
            clip: LIMIT,
            stratum: 1.0 / n_rows as f32,
            exponent: priority.map_or(0.0, |priority| priority.exponent as f32),
            correction: priority.map_or(0.0, |priority| priority.correction as f32),
        };
        let mut rollout = DeviceRollout {
            kernels: memory_kernels::compile(&shared.gpu.device),
            buffers: Buffers::default(),
            config: config.clone(),
            routes,
            mirror,
            shared: shared.clone(),
            simulator,
            facts,
            observation,
            extras,
            around,
            normalisation: [0.0, 1.0].map(|value| Tensor::full([1, N], value, device)),
            sample,
            _owned: owned,
            n_appended: 0,
            n_steps: 0,
            n_samples: 0,
            queued: VecDeque::with_capacity(MAX_QUEUED_STEPS),
            counted: Tally::default(),
            level_replay,
            counted_ends: vec![0; world.routes.len() * Ended::ALL.len()],
            route_ends: Vec::new(),
        };
        rollout.buffers = rollout.make_buffers()?;
        rollout.set_normalisation(&Normalisation::none(N));
        shared.check()?;
        Ok(rollout)
    }

    /// The trucks' observations with the first extras, and other vehicles, behind them, normalised, `[n_envs, N]`.
    fn normalised(&self) -> Tensor<2> {
        let [mean, factor] = self.normalisation.clone();
        let n_extras = self.facts.n_extras as usize;
        let extras = (0 < n_extras).then(|| self.extras.clone().narrow(1, 0, n_extras));
        let beside: Vec<Tensor<2>> = extras.into_iter().chain(self.around.clone()).collect();
        let own = self.observation.clone();
        let observed = if beside.is_empty() { own } else { Tensor::cat([vec![own], beside].concat(), 1) };
        ((observed - mean) * factor).clamp(-LIMIT, LIMIT)
    }

    fn has_priorities(&self) -> bool {
        self.config.replay_buffer.priority.is_some()
    }

    /// One step of every truck: by the actor's output, or with random actions where there is none.
    fn step_by(&mut self, logits: Option<&Tensor<2>>, remember: bool) -> Result<(), Error> {
        self.shared.flush()?;
        let output = logits.map(floats).transpose()?;
        let device = &self.shared.gpu.device;
        let chosen_from = output.as_ref().map(|output| (Binding::logits, &output.slice));
        self.write_now();
        let (has_priorities, counts_ends) = (self.has_priorities(), self.level_replay.is_some());
        let mut encoder = device.create_command_encoder(&Default::default());
        let (kernels, facts, buffers) = (&self.kernels, &self.facts, &self.buffers);
        let group = |kernel: Kernel| buffers.group(device, kernels, kernel, chosen_from);
        let batch =
            self.simulator.on_device().ok_or_else(|| Error::Device("the simulator is not on a device".to_owned()))?;
        if logits.is_some() {
            memory_kernels::add(kernels, &mut encoder, &group(Kernel::Choose), Kernel::Choose, facts);
        } else {
            batch.add_draw(&mut encoder);
        }
        if remember {
            memory_kernels::add(kernels, &mut encoder, &group(Kernel::StoreBefore), Kernel::StoreBefore, facts);
        }
        batch.add_step(&mut encoder);
        if remember {
            memory_kernels::add(kernels, &mut encoder, &group(Kernel::StoreAfter), Kernel::StoreAfter, facts);
            if has_priorities {
                memory_kernels::add(kernels, &mut encoder, &group(Kernel::Admit), Kernel::Admit, facts);
            }
            if counts_ends {
                memory_kernels::add(kernels, &mut encoder, &group(Kernel::CountEnds), Kernel::CountEnds, facts);
            }
            self.n_appended += 1;
        }
        batch.stepped();
        self.n_steps = self.n_steps.wrapping_add(1);
        if self.queued.len() == MAX_QUEUED_STEPS {
            let waited = device.poll(PollType::Wait { submission_index: self.queued.pop_front(), timeout: None });
            waited.map_err(|error| Error::Device(error.to_string()))?;
        }
        self.queued.push_back(self.shared.gpu.queue.submit([encoder.finish()]));
        if remember { self.replay_levels() } else { Ok(()) }
    }

    fn slots_held(&self) -> u32 {
        self.n_appended.min(self.facts.n_slots.into()) as u32
    }

    fn write_now(&self) {
        let (held, n_slots) = (self.slots_held(), u64::from(self.facts.n_slots));
        let now = Now {
            slot: (self.n_appended % n_slots) as u32,
            oldest: ((self.n_appended - u64::from(held)) % n_slots) as u32,
            n_ready: held.saturating_sub(self.facts.n_steps),
            has_ready: (self.facts.n_steps <= held).into(),
            step: self.n_steps,
            sample: self.n_samples,
        };
        self.shared.gpu.queue.write_buffer(&self.buffers.slice(Binding::now).buffer, 0, bytes_of(&now));
    }
}

impl<const N: usize> Rollout for DeviceRollout<N> {
    fn simulator(&self) -> &Simulator {
        &self.simulator
    }

    fn n_transitions(&self) -> usize {
        self.slots_held() as usize * self.facts.n_envs as usize
    }

    fn can_sample(&self) -> bool {
        self.facts.n_steps < self.slots_held()
    }

    fn found_normalisation(&self, mirror: Option<&Mirror>) -> Result<Normalisation, Error> {
        let held = self.buffers.slice(Binding::held_observation);
        let size = (self.n_transitions() * N * size_of::<f32>()) as u64;
        let bytes =
            self.shared.gpu.read(&[Slice { size, ..held.clone() }]).map_err(offtrack::simulator::Error::from)?;
        // Bytes need not be aligned as floats are.
        let rows: Vec<[f32; N]> = bytes[0].chunks_exact(N * 4).map(bytemuck::pod_read_unaligned).collect();
        Ok(super::normalisation_of(rows, mirror))
    }

    fn set_normalisation(&mut self, normalisation: &Normalisation) {
        let noise = self.config.learning.observation_noise as f32;
        let images: Vec<(usize, f32)> = match &self.mirror {
            Some(mirror) => mirror.images().0,
            None => (0..N).map(|index| (index, 1.0)).collect(),
        };
        let rows = normalisation.mean.iter().zip(&normalisation.factor).zip(images);
        let value = |((&mean, &factor), (image, image_factor)): ((&f32, &f32), (usize, f32))| Value {
            mean,
            factor,
            noise,
            image: image as u32,
            image_factor,
        };
        let rows: Vec<Value> = rows.map(value).collect();
        self.shared.gpu.queue.write_buffer(&self.buffers.slice(Binding::values).buffer, 0, cast_slice(&rows));
        let row = |values: &[f32]| {
            Tensor::from_data(TensorData::new(values.to_vec(), [1, values.len()]), &self.shared.tensors)
        };
        self.normalisation = [row(&normalisation.mean), row(&normalisation.factor)];
    }

    fn step_at_random(&mut self) -> Result<(), Error> {
        self.step_by(None, true)
    }

    fn step(&mut self, actor: &Mlp, _: u64) -> Result<(), Error> {
        let logits = actor.forward(self.normalised());
        self.step_by(Some(&logits), true)
    }

    /// An error: a refinement is on the processor, and a training file that asks for another is refused.
    fn collect(&mut self, _: &Mlp, _: &Refinement) -> Result<Steps, Error> {
        let expected = "works with device = \"cpu\" alone: leave one of them out".to_owned();
        Err(Error::setting("refinement", "given", expected))
    }

    fn drive(&mut self, actor: &Mlp) -> Result<(), Error> {
        let logits = actor.forward(self.normalised());
        self.step_by(Some(&logits), false)
    }

    /// Samples a batch in one shard: the same tensors every time, with other values in them.
    fn sample(&mut self) -> Result<Vec<Transitions>, Error> {
        self.shared.flush()?;
        self.write_now();
        let drawn: &[Kernel] = match self.has_priorities() {
            true => &[Kernel::SumBlocks, Kernel::AddUp, Kernel::PickByPriority, Kernel::Weigh],
            false => &[Kernel::Pick],
        };
        self.submit(&[drawn, &[Kernel::Sample, Kernel::SampleNext]].concat(), None);
        self.n_samples = self.n_samples.wrapping_add(1);
        Ok(vec![Transitions {
            observation: self.sample.observation.clone(),
            action: self.sample.action.clone(),
            reward: self.sample.reward.clone(),
            discount: self.sample.discount.clone(),
            next_observation: self.sample.next_observation.clone(),
            weight: self.sample.weight.clone(),
        }])
    }

    fn set_td_errors(&mut self, errors: Vec<Tensor<2>>) -> Result<(), Error> {
        if self.has_priorities() {
            self.shared.flush()?;
            // A sample is one shard.
            for errors in &errors {
                self.submit(&[Kernel::SetPriorities], Some((Binding::td_error, &floats(errors)?.slice)));
            }
        }
        Ok(())
    }

    fn take_episodes(&mut self, wait: bool) -> Result<Vec<Episodes>, Error> {
        if !wait {
            return Ok(Vec::new());
        }
        let tally = self.simulator.tally()?;
        let since = tally.since(&self.counted);
        self.counted = tally;
        let episodes =
            Episodes { count: since.episodes(), arrived: since.ended(Ended::Arrived), reward: since.reward() };
        Ok(Vec::from_iter((0 < episodes.count).then_some(episodes)))
    }

    fn take_route_ends(&mut self) -> Vec<RouteEnd> {
        std::mem::take(&mut self.route_ends)
    }

    fn wait(&self) -> Result<(), Error> {
        self.shared.wait()
    }

    fn check(&self) -> Result<(), Error> {
        self.shared.check()
    }

    fn save<'a>(&'a self, columns: &mut Columns<'a>) {
        self.level_replay.iter().for_each(|replay| replay.save(columns));
    }

    fn restore(&mut self, stored: &Stored, n_updates: u64) -> Result<(), Error> {
        // Other actions and samples than the first time.
        let seeds = seeds(self.config.seed, n_updates as u32);
        let world = self.simulator.world().clone();
        *self = DeviceRollout::with_seeds(
            &self.shared,
            &self.config,
            &world,
            self.routes.clone(),
            self.mirror.clone(),
            seeds,
        )?;
        if let Some(replay) = &mut self.level_replay {
            replay.restore(stored)?;
            self.simulator.draw_from(replay.list())?;
        }
        Ok(())
    }
}

/// Seeds of actions and samples, after so many updates.
fn seeds(seed: u32, n_updates: u32) -> [u32; 2] {
    [1, 2].map(|purpose| random::words(seed, purpose, n_updates, u32::MAX)[0])
}

#[cfg(test)]
mod tests;
