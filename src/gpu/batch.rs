//! The columns of a batch on a device, stepped by kernels. Nothing comes back to the host unless it is asked for.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use bytemuck::{bytes_of, cast_slice};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindingResource, Buffer, BufferBinding, BufferDescriptor, BufferUsages, CommandEncoder,
    ComputePassDescriptor, ComputePassTimestampWrites, Features, QuerySetDescriptor, QueryType,
};

use super::tables::tables;
use super::{Device, Error};
use crate::cpu::count::{N_SUMS, Tally};
use crate::cpu::{self, RouteChoice};
use crate::layout::buffers::{BUFFERS, FIRST_COLUMN, N_BUFFERS};
use crate::layout::{BatchFacts, Clearance, Control, N_RAYS, N_VALUES, Progress, RewardTerms, Truck};
use crate::stages::{DRAW, Kernel, RESTART, STAGES, Stage};
use crate::world::World;

/// Part of a buffer.
#[derive(Debug, Clone)]
pub struct Slice {
    /// The buffer; a shader may write to it, and it may be copied from and to.
    pub buffer: Buffer,
    /// Where the part begins [bytes].
    pub offset: u64,
    /// Its length [bytes].
    pub size: u64,
}

/// Columns that lie in memory of the caller, by their names; the others are the batch's own. Each is laid out as [`cpu::Batch`] has it.
pub type Columns = Vec<(&'static str, Slice)>;

/// What a column takes for each truck [bytes], by its name; the tally is none.
const WIDTHS: [(&str, usize); cpu::N_COLUMNS] = [
    ("action", size_of::<u32>()),
    ("control", size_of::<Control>()),
    ("truck", size_of::<Truck>()),
    ("clearance", size_of::<Clearance>()),
    ("progress", size_of::<Progress>()),
    ("ranges", N_RAYS * size_of::<f32>()),
    ("observation", N_VALUES * size_of::<f32>()),
    ("next_observation", N_VALUES * size_of::<f32>()),
    ("ended", size_of::<u32>()),
    ("terms", size_of::<RewardTerms>()),
    ("reward", size_of::<f32>()),
];

/// A batch of trucks on a device.
#[derive(Debug)]
pub struct Batch {
    device: Device,
    n_envs: usize,
    seed: u32,
    choice: RouteChoice,
    buffers: Vec<Slice>,
    group: BindGroup,
    foreign: bool,
    /// The columns as they are, once someone has asked.
    seen: OnceLock<cpu::Batch>,
}

impl Batch {
    /// `n_envs` trucks that have yet to be reset, with the caller's columns where it has any.
    pub fn new(device: &Device, world: &World, n_envs: usize, seed: u32, choice: RouteChoice, columns: Columns) -> Result<Batch, Error> {
        let limit = device.device.limits().max_storage_buffer_binding_size.min(device.device.limits().max_buffer_size);
        for (buffer, width) in WIDTHS {
            let n_bytes = (n_envs as u64).saturating_mul(width as u64);
            if limit < n_bytes {
                let (adapter, fitting) = (device.adapter.get_info().name, limit / width as u64);
                return Err(Error::TooManyTrucks { n_envs, buffer, n_bytes, adapter, limit, fitting });
            }
        }
        let (RouteChoice::Drawn(routes) | RouteChoice::Fixed(routes)) = &choice;
        let facts = BatchFacts {
            n_envs: n_envs as u32,
            seed,
            n_routes: routes.len() as u32,
            fixed: matches!(choice, RouteChoice::Fixed(_)).into(),
        };
        let foreign = !columns.is_empty();
        let names = || BUFFERS.iter().map(|buffer| buffer.name);
        let mut buffers: Vec<Slice> = names().zip(tables(world)).map(|(name, table)| device.filled(name, &table)).collect();
        buffers.push(device.filled("batch", bytes_of(&facts)));
        buffers.push(device.filled("choice", cast_slice(routes)));
        for (column, width) in WIDTHS {
            let needed = (n_envs * width) as u64;
            let given = columns.iter().find(|(name, _)| *name == column);
            if let Some((_, slice)) = given.filter(|(_, slice)| slice.size < needed) {
                return Err(Error::ColumnSize { column, found: slice.size, n_envs, needed });
            }
            buffers.push(given.map_or_else(|| device.empty(column, needed), |(_, slice)| Slice { size: needed, ..slice.clone() }));
        }
        buffers.push(device.empty("tally", (2 * N_SUMS * size_of::<u32>()) as u64));
        debug_assert!(buffers.len() == N_BUFFERS && names().skip(FIRST_COLUMN).zip(WIDTHS).all(|(name, (column, _))| name == column));

        let entries = (0..).zip(&buffers).map(|(binding, slice)| BindGroupEntry {
            binding,
            resource: BindingResource::Buffer(BufferBinding {
                buffer: &slice.buffer,
                offset: slice.offset,
                size: std::num::NonZero::new(slice.size),
            }),
        });
        let entries: Vec<BindGroupEntry> = entries.collect();
        let layout = &device.kernels().layout;
        let group = device.device.create_bind_group(&BindGroupDescriptor { label: Some("batch"), layout, entries: &entries });
        device.check()?;
        Ok(Batch { device: device.clone(), n_envs, seed, choice, buffers, group, foreign, seen: OnceLock::new() })
    }

    /// Trucks in the batch.
    pub fn n_envs(&self) -> usize {
        self.n_envs
    }

    /// Memory that its columns take, wherever they lie, beside the shared world [bytes].
    pub fn bytes(&self) -> usize {
        self.buffers[FIRST_COLUMN..FIRST_COLUMN + WIDTHS.len()].iter().map(|slice| slice.size as usize).sum()
    }

    /// Where it lives.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// A column, to be bound elsewhere or copied from.
    pub fn column(&self, name: &str) -> Option<&Slice> {
        BUFFERS.iter().zip(&self.buffers).skip(FIRST_COLUMN).find(|(buffer, _)| buffer.name == name).map(|(_, slice)| slice)
    }

    /// Begins episode 0 of every truck.
    pub fn reset(&mut self) {
        self.run(|batch, encoder| {
            batch.pass(encoder, &[RESTART]);
            batch.look(encoder);
        });
    }

    /// One step of every truck with the actions that lie in the column.
    pub fn step(&mut self) {
        self.run(Batch::add_step);
    }

    /// Adds a step with the actions that lie in the column to someone else's commands, who submits them.
    pub fn add_step(&self, encoder: &mut CommandEncoder) {
        let [stages @ .., last] = &STAGES;
        self.pass(encoder, stages.iter().flat_map(|stage| stage.kernels));
        self.hand_on(encoder);
        self.pass(encoder, last.kernels);
    }

    /// The same for actions drawn by chance.
    pub fn add_draw(&self, encoder: &mut CommandEncoder) {
        self.pass(encoder, &[DRAW]);
    }

    /// Forgets what the host saw of the columns: for who submits a step of their own.
    pub fn stepped(&mut self) {
        self.seen.take();
    }

    /// The same with actions drawn by chance.
    pub fn step_at_random(&mut self) {
        self.run(|batch, encoder| {
            batch.add_draw(encoder);
            batch.add_step(encoder);
        });
    }

    /// The same a stage at a time, for timing: by the device's own clock where it has one, else by the host's.
    pub fn step_at_random_by_stage(&mut self) -> Result<[Duration; STAGES.len()], Error> {
        self.run(|batch, encoder| batch.pass(encoder, &[DRAW]));
        if self.device.device.features().contains(Features::TIMESTAMP_QUERY) { self.timed_by_device() } else { self.timed_by_host() }
    }

    fn timed_by_device(&mut self) -> Result<[Duration; STAGES.len()], Error> {
        let count = 2 * STAGES.len() as u32;
        let set = self.device.device.create_query_set(&QuerySetDescriptor { label: Some("stages"), ty: QueryType::Timestamp, count });
        let size = u64::from(count) * size_of::<u64>() as u64;
        let usage = BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC;
        let resolved =
            self.device.device.create_buffer(&BufferDescriptor { label: Some("stages"), size, usage, mapped_at_creation: false });
        self.run(|batch, encoder| {
            for (index, stage) in (0..).zip(&STAGES) {
                let timestamp_writes = ComputePassTimestampWrites {
                    query_set: &set,
                    beginning_of_pass_write_index: Some(2 * index),
                    end_of_pass_write_index: Some(2 * index + 1),
                };
                batch.add_stage(encoder, stage, Some(timestamp_writes));
            }
            encoder.resolve_query_set(&set, 0..count, &resolved, 0);
        });
        let bytes = self.device.read(&[Slice { buffer: resolved, offset: 0, size }])?;
        let ticks: &[u64] = cast_slice(&bytes[0]);
        let period = f64::from(self.device.queue.get_timestamp_period());
        let lasted = |index: usize| ticks[2 * index + 1].saturating_sub(ticks[2 * index]) as f64 * period;
        Ok(std::array::from_fn(|index| Duration::from_nanos(lasted(index) as u64)))
    }

    fn timed_by_host(&mut self) -> Result<[Duration; STAGES.len()], Error> {
        self.wait()?;
        let mut times = [Duration::ZERO; STAGES.len()];
        for (index, stage) in STAGES.iter().enumerate() {
            let begun = Instant::now();
            self.run_stage(stage);
            self.wait()?;
            times[index] = begun.elapsed();
        }
        Ok(times)
    }

    /// Waits until all that was asked of the device is done.
    pub fn wait(&self) -> Result<(), Error> {
        self.device.wait()
    }

    /// Puts an action for every truck into its column.
    pub fn set_actions(&mut self, actions: &[u32]) {
        self.write("action", cast_slice(actions));
    }

    /// The columns, as the last step or reset left them. What a lost device has forgotten is as it was last seen or zero.
    pub fn columns(&self) -> &cpu::Batch {
        self.seen.get_or_init(|| {
            let mut batch = cpu::Batch::new(self.n_envs, self.seed, self.choice.clone());
            // A device that fails here fails at the next step, which says so.
            if let Ok(bytes) = self.device.read(&self.buffers[FIRST_COLUMN..FIRST_COLUMN + WIDTHS.len()]) {
                for ((_, column), bytes) in batch.columns_mut().into_iter().zip(bytes) {
                    column.copy_from_slice(&bytes);
                }
            }
            batch.tally = self.tally().unwrap_or_default();
            batch
        })
    }

    /// What happened since the batch was made.
    pub fn tally(&self) -> Result<Tally, Error> {
        let bytes = self.device.read(&self.buffers[N_BUFFERS - 1..])?;
        let words: &[u32] = cast_slice(&bytes[0]);
        let sum = |index: usize| (u64::from(words[2 * index]) | u64::from(words[2 * index + 1]) << 32) as i64;
        Ok(Tally { sums: std::array::from_fn(sum) })
    }

    /// Makes the columns those of `batch`, which has as many trucks, and looks around anew from where the trucks stand if `look` says so.
    pub(crate) fn upload(&mut self, batch: &cpu::Batch, look: bool) {
        for (name, bytes) in batch.columns() {
            self.write(name, bytes);
        }
        let sums: Vec<u64> = batch.tally.sums.iter().map(|&sum| sum as u64).collect();
        self.write("tally", cast_slice(&sums));
        if look {
            self.run(|batch, encoder| batch.look(encoder));
        }
    }

    /// A batch of the rows `indices`, see [`crate::simulator::Simulator::gather`].
    pub(crate) fn gathered(&self, world: &World, indices: &[u32]) -> Result<Batch, Error> {
        if self.foreign {
            return Err(Error::ForeignColumns);
        }
        let host = self.columns().gathered(indices);
        let mut batch = Batch::new(&self.device, world, indices.len(), self.seed, host.choice().clone(), Columns::new())?;
        batch.upload(&host, false);
        Ok(batch)
    }

    /// One stage over all trucks with what belongs to it.
    pub(crate) fn run_stage(&mut self, stage: &Stage) {
        self.run(|batch, encoder| batch.add_stage(encoder, stage, None));
    }

    /// Adds a stage with what belongs to it.
    fn add_stage(&self, encoder: &mut CommandEncoder, stage: &Stage, timestamp_writes: Option<ComputePassTimestampWrites>) {
        if stage.name == "reset" {
            self.hand_on(encoder);
        }
        self.add_pass(encoder, stage.kernels, timestamp_writes);
    }

    /// Senses and observes where the trucks stand.
    fn look(&self, encoder: &mut CommandEncoder) {
        let looking = STAGES.iter().filter(|stage| ["sense", "observe"].contains(&stage.name));
        self.pass(encoder, looking.flat_map(|stage| stage.kernels));
        self.hand_on(encoder);
    }

    /// Copies what the last action led to, to what the next one sees.
    fn hand_on(&self, encoder: &mut CommandEncoder) {
        if let (Some(from), Some(to)) = (self.column("next_observation"), self.column("observation")) {
            encoder.copy_buffer_to_buffer(&from.buffer, from.offset, &to.buffer, to.offset, to.size);
        }
    }

    fn pass<'a>(&self, encoder: &mut CommandEncoder, kernels: impl IntoIterator<Item = &'a Kernel>) {
        self.add_pass(encoder, kernels, None);
    }

    fn add_pass<'a>(
        &self,
        encoder: &mut CommandEncoder,
        kernels: impl IntoIterator<Item = &'a Kernel>,
        timestamp_writes: Option<ComputePassTimestampWrites>,
    ) {
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor { label: None, timestamp_writes });
        pass.set_bind_group(0, &self.group, &[]);
        for kernel in kernels {
            self.device.kernels().dispatch_over(&mut pass, kernel, self.n_envs as u32);
        }
    }

    /// Submits commands that change the batch.
    fn run(&mut self, add: impl FnOnce(&Batch, &mut CommandEncoder)) {
        self.seen.take();
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        add(self, &mut encoder);
        self.device.queue.submit([encoder.finish()]);
    }

    fn write(&mut self, name: &str, bytes: &[u8]) {
        self.seen.take();
        if let Some(slice) = self.column(name) {
            self.device.queue.write_buffer(&slice.buffer, slice.offset, bytes);
        }
    }
}
