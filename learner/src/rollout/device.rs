//! Trucks and replay buffer on a graphics device: nothing leaves it.
//!
//! Kernels read the simulator's columns in place, and write samples into buffers that the learner is bound to. All of
//! them submit to one queue, and nothing waits.

mod buffers;
mod levels;
mod memory_kernels;

use std::collections::VecDeque;
use std::sync::Arc;

use bytemuck::{bytes_of, cast_slice};
use offtrack::gpu::{Columns as External, Device, Kernels, Slice};
use offtrack::layout::random;
use offtrack::layout::{Ended, ObservationLayout};
use offtrack::simulator::{Engine, RouteChoice, Simulator, Tally};
use offtrack::world::World;
use offtrack_policy::{LIMIT, Normalisation};
use wgpu::{BindGroup, Buffer, CommandEncoder, PollType, SubmissionIndex};

use super::{Episodes, Rollout, RouteEnd};
use crate::checkpoint::{Columns, Stored};
use crate::config::{Config, Refinement};
use crate::device::{Batch, Forward, NUMBER, Network};
use crate::error::Error;
use crate::exchange::{Actor, Sample, TdErrors};
use crate::level_replay::LevelReplay;
use crate::mirror::Mirror;
use crate::network::Mlp;
use crate::ppo::steps::Steps;
use buffers::{Buffers, check_capacity};
use memory_kernels::{BLOCK, Binding, Facts, Kernel, Now, Value};

/// Maximum number of steps queued ahead of the device. Queued work holds memory.
const MAX_QUEUED_STEPS: usize = 16;

/// Trucks and a replay buffer whose networks observe `N` values. See the module.
pub struct DeviceRollout<const N: usize> {
    config: Config,
    routes: Vec<u32>,
    mirror: Option<Mirror>,
    gpu: Device,
    kernels: Kernels<Kernel>,
    simulator: Simulator,
    facts: Facts,
    buffers: Buffers,
    /// The actor's pass from what it sees to its output.
    forward: Forward,
    /// Kernels' bindings, for all but the one that is bound to the learner's TD errors.
    groups: Vec<Option<BindGroup>>,
    /// The TD errors that the last of them is bound to.
    bound_to: Option<Buffer>,
    sample: Batch,
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
        gpu: &Device,
        config: &Config,
        world: &Arc<World>,
        routes: Vec<u32>,
        mirror: Option<Mirror>,
    ) -> Result<DeviceRollout<N>, Error> {
        DeviceRollout::with_seeds(gpu, config, world, routes, mirror, Seeds::after(config.seed, 0))
    }

    fn with_seeds(
        gpu: &Device,
        config: &Config,
        world: &Arc<World>,
        routes: Vec<u32>,
        mirror: Option<Mirror>,
        seeds: Seeds,
    ) -> Result<DeviceRollout<N>, Error> {
        let (n_envs, n_rows) = (config.n_envs, config.learning.batch);
        let n_slots = config.replay_buffer.slots(n_envs);
        check_capacity::<N>(gpu, config, n_slots * n_envs)?;
        let numbers = |width: usize| gpu.empty("sample", (n_rows * width) as u64 * NUMBER);
        let sample = Batch {
            observation: numbers(N),
            action: numbers(1),
            reward: numbers(1),
            discount: numbers(1),
            next_observation: numbers(N),
            weight: gpu.filled("sample", cast_slice(&vec![1.0f32; n_rows])),
        };
        let engine = Engine::Gpu { device: gpu.clone(), columns: External::new() };
        let level_replay = config.level_replay.map(|settings| LevelReplay::new(settings, routes.clone()));
        let drawn = level_replay.as_ref().map_or_else(|| routes.clone(), |replay| replay.list().to_vec());
        let simulator = Simulator::on(engine, world.clone(), n_envs, seeds.episodes, RouteChoice::Drawn(drawn))?;
        let priority = config.replay_buffer.priority;
        let facts = Facts {
            n_envs: n_envs as u32,
            n_slots: n_slots as u32,
            n_actions: world.params.n_actions,
            n_values: N as u32,
            n_extras: const { ObservationLayout::of_width(N).unwrap() }.n_extras as u32,
            n_rows: n_rows as u32,
            n_steps: config.learning.n_steps as u32,
            acting_seed: seeds.acting,
            sampling_seed: seeds.sampling,
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
            kernels: memory_kernels::compile(&gpu.device),
            buffers: Buffers::default(),
            config: config.clone(),
            routes,
            mirror,
            gpu: gpu.clone(),
            forward: Forward::new(gpu, n_envs),
            groups: Vec::new(),
            bound_to: None,
            simulator,
            facts,
            sample,
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
        rollout.groups = Kernel::ALL.map(|kernel| rollout.bound(kernel)).into();
        rollout.set_normalisation(&Normalisation::none(N));
        rollout.check()?;
        Ok(rollout)
    }

    fn has_priorities(&self) -> bool {
        self.config.replay_buffer.priority.is_some()
    }

    /// What a kernel is bound to; none where that is the learner's.
    fn bound(&self, kernel: Kernel) -> Option<BindGroup> {
        let is_own = !kernel.bindings().contains(&Binding::td_error);
        is_own.then(|| self.buffers.group(&self.gpu.device, &self.kernels, kernel, None))
    }

    /// Submits kernels, one after the other.
    fn submit(&self, each: &[Kernel]) {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        each.iter().for_each(|&kernel| add(&self.kernels, &self.groups, &self.facts, &mut encoder, kernel));
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// One step of every truck: by the actor, or with random actions where there is none.
    fn step_by(&mut self, actor: Option<&Network>, remember: bool) -> Result<(), Error> {
        self.write_now();
        let (has_priorities, counts_ends) = (self.has_priorities(), self.level_replay.is_some());
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let (kernels, groups, facts) = (&self.kernels, &self.groups, &self.facts);
        if let Some(network) = actor {
            add(kernels, groups, facts, &mut encoder, Kernel::Look);
            let [seen, logits] = [Binding::seen, Binding::logits].map(|binding| self.buffers.slice(binding));
            self.forward.add(&mut encoder, network, seen, logits);
            add(kernels, groups, facts, &mut encoder, Kernel::Choose);
        }
        let batch =
            self.simulator.on_device().ok_or_else(|| Error::Device("the simulator is not on a device".to_owned()))?;
        if actor.is_none() {
            batch.add_draw(&mut encoder);
        }
        if remember {
            add(kernels, groups, facts, &mut encoder, Kernel::StoreBefore);
        }
        batch.add_step(&mut encoder);
        if remember {
            add(kernels, groups, facts, &mut encoder, Kernel::StoreAfter);
            if has_priorities {
                add(kernels, groups, facts, &mut encoder, Kernel::Admit);
            }
            if counts_ends {
                add(kernels, groups, facts, &mut encoder, Kernel::CountEnds);
            }
            self.n_appended += 1;
        }
        batch.stepped();
        self.n_steps = self.n_steps.wrapping_add(1);
        if self.queued.len() == MAX_QUEUED_STEPS {
            let waited =
                self.gpu.device.poll(PollType::Wait { submission_index: self.queued.pop_front(), timeout: None });
            waited.map_err(|error| Error::Device(error.to_string()))?;
        }
        self.queued.push_back(self.gpu.queue.submit([encoder.finish()]));
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
        self.gpu.queue.write_buffer(&self.buffers.slice(Binding::now).buffer, 0, bytes_of(&now));
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
        let bytes = self.gpu.read(&[Slice { size, ..held.clone() }]).map_err(offtrack::simulator::Error::from)?;
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
        self.gpu.queue.write_buffer(&self.buffers.slice(Binding::values).buffer, 0, cast_slice(&rows));
    }

    fn step_at_random(&mut self) -> Result<(), Error> {
        self.step_by(None, true)
    }

    fn step(&mut self, actor: &Actor, _: u64) -> Result<(), Error> {
        self.step_by(Some(actor.on_device()?), true)
    }

    /// An error: a refinement is on the processor, and a training file that asks for another is refused.
    fn collect(&mut self, _: &Mlp, _: &Refinement) -> Result<Steps, Error> {
        let expected = "works with device = \"cpu\" alone: leave one of them out".to_owned();
        Err(Error::setting("refinement", "given", expected))
    }

    fn drive(&mut self, actor: &Actor) -> Result<(), Error> {
        self.step_by(Some(actor.on_device()?), false)
    }

    /// Samples a batch: into the same buffers every time.
    fn sample(&mut self) -> Result<Sample, Error> {
        self.write_now();
        let drawn: &[Kernel] = match self.has_priorities() {
            true => &[Kernel::SumBlocks, Kernel::AddUp, Kernel::PickByPriority, Kernel::Weigh],
            false => &[Kernel::Pick],
        };
        self.submit(&[drawn, &[Kernel::Sample, Kernel::SampleNext]].concat());
        self.n_samples = self.n_samples.wrapping_add(1);
        Ok(Sample::Device(Box::new(self.sample.clone())))
    }

    fn set_td_errors(&mut self, errors: TdErrors) -> Result<(), Error> {
        let errors = errors.on_device()?;
        if self.has_priorities() {
            let kernel = Kernel::SetPriorities;
            if self.groups[kernel as usize].is_none() || self.bound_to.as_ref() != Some(&errors.buffer) {
                let bound = Some((Binding::td_error, &errors));
                let group = self.buffers.group(&self.gpu.device, &self.kernels, kernel, bound);
                (self.groups[kernel as usize], self.bound_to) = (Some(group), Some(errors.buffer));
            }
            self.submit(&[kernel]);
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
        Ok(self.gpu.wait().map_err(offtrack::simulator::Error::from)?)
    }

    fn check(&self) -> Result<(), Error> {
        Ok(self.gpu.check().map_err(offtrack::simulator::Error::from)?)
    }

    fn save<'a>(&'a self, columns: &mut Columns<'a>) {
        self.level_replay.iter().for_each(|replay| replay.save(columns));
    }

    fn restore(&mut self, stored: &Stored, n_updates: u64) -> Result<(), Error> {
        // Other episodes, actions and samples than the first time.
        let seeds = Seeds::after(self.config.seed, n_updates as u32);
        let world = self.simulator.world().clone();
        *self = DeviceRollout::with_seeds(
            &self.gpu,
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

/// Adds a kernel that is bound to the commands.
fn add(
    kernels: &Kernels<Kernel>,
    groups: &[Option<BindGroup>],
    facts: &Facts,
    encoder: &mut CommandEncoder,
    kernel: Kernel,
) {
    if let Some(group) = &groups[kernel as usize] {
        memory_kernels::add(kernels, encoder, group, kernel, facts);
    }
}

/// What is drawn from.
#[derive(Debug, Clone, Copy)]
struct Seeds {
    episodes: u32,
    acting: u32,
    sampling: u32,
}

impl Seeds {
    /// Those of a run after so many updates: the episodes of a new one are of its own seed.
    fn after(seed: u32, n_updates: u32) -> Seeds {
        let [acting, sampling, later] = [1, 2, 3].map(|purpose| random::words(seed, purpose, n_updates, u32::MAX)[0]);
        Seeds { episodes: if n_updates == 0 { seed } else { later }, acting, sampling }
    }
}

#[cfg(test)]
mod tests;
