//! A batch on a device: columns in its memory, stepped by kernels. Nothing is copied to the host unless the caller asks
//! for it.

use std::borrow::Cow;
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

use bytemuck::{bytes_of, cast_slice};
use wgpu::{CommandEncoder, ComputePassDescriptor, ComputePassTimestampWrites};

use super::buffers::{Buffers, check_size, check_world};
use super::{Columns, Device, Error, Slice, kernel_times, kernels};
use crate::engine::stages::{BEGIN, Case, Kernel, N_STAGES, STAGES, Stage};
use crate::engine::{self, Autoreset, EngineBatch, RouteChoice, Tally};
use crate::layout::buffers::Table;
use crate::layout::{BatchFacts, BeginRow, Column, Command, Stream};
use crate::world::World;

/// A batch of trucks on a device.
#[derive(Debug)]
pub struct Batch {
    device: Device,
    n_envs: usize,
    buffers: Buffers,
    /// Which kernels have anything to do.
    case: Case,
    /// Whether some columns are external.
    external: bool,
    /// The columns as they are, once the host has read them.
    seen: OnceLock<engine::Batch>,
    /// Room for them until then.
    room: Mutex<Option<engine::Batch>>,
}

impl Batch {
    /// `n_envs` trucks that have yet to be reset, with the caller's `columns` where it has any.
    pub(crate) fn new(
        device: &Device,
        world: &World,
        n_envs: usize,
        seed: u32,
        choice: RouteChoice,
        columns: Columns,
    ) -> Result<Batch, engine::Error> {
        check_world(device, world)?;
        let has_vehicles = world.traffic.is_some();
        check_size(device, n_envs, has_vehicles)?;
        let host = engine::Batch::new(n_envs, seed, choice, has_vehicles, world.group())?;
        let buffers = Buffers::new(device, world, &host, &columns)?;
        let case = Case::of(world, host.autoreset());
        Ok(Batch::of(device, buffers, case, host, !columns.is_empty()))
    }

    fn of(device: &Device, buffers: Buffers, case: Case, host: engine::Batch, external: bool) -> Batch {
        let (device, n_envs, room) = (device.clone(), host.n_envs(), Mutex::new(Some(host)));
        Batch { device, n_envs, buffers, case, external, seen: OnceLock::new(), room }
    }

    /// The device that the batch lives on.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// A column, to be bound elsewhere or copied from.
    pub fn column(&self, column: Column) -> &Slice {
        self.buffers.column(column)
    }

    /// Adds a step with the actions or commands in their column to the caller's commands. The caller submits them and
    /// calls [`Batch::stepped`].
    pub fn add_step(&self, encoder: &mut CommandEncoder) {
        self.add_pass(encoder, self.case.step(), None);
    }

    /// Adds the drawing of random actions to the caller's commands.
    pub fn add_draw(&self, encoder: &mut CommandEncoder) {
        self.add_pass(encoder, [Kernel::Draw], None);
    }

    /// Says that the caller submitted commands that change the batch: what the host read before is out of date.
    pub fn stepped(&mut self) {
        if let Some(batch) = self.seen.take() {
            *self.room.get_mut().unwrap_or_else(PoisonError::into_inner) = Some(batch);
        }
    }

    /// Adds stages in one pass.
    fn add_stages(&self, encoder: &mut CommandEncoder, stages: &[Stage]) {
        self.add_pass(encoder, self.case.working(stages.iter().flat_map(|stage| stage.kernels())), None);
    }

    /// The kernels of a step with random actions.
    fn random_step(&self) -> impl Iterator<Item = Kernel> + Clone + use<> {
        std::iter::once(Kernel::Draw).chain(self.case.step())
    }

    /// Adds a pass of kernels, one after the other.
    pub(super) fn add_pass(
        &self,
        encoder: &mut CommandEncoder,
        kernels: impl IntoIterator<Item = Kernel>,
        timestamp_writes: Option<ComputePassTimestampWrites>,
    ) {
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor { label: None, timestamp_writes });
        for kernel in kernels {
            let Some(group) = self.buffers.group(kernel) else { continue };
            let threads = kernels::threads(kernel, self.n_envs);
            self.device.kernels().dispatch(&mut pass, kernel, group, threads);
        }
    }

    /// Submits commands that change the batch.
    pub(super) fn submit(&mut self, add: impl FnOnce(&Batch, &mut CommandEncoder)) {
        self.stepped();
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        add(self, &mut encoder);
        self.device.queue.submit([encoder.finish()]);
    }

    /// The columns on the host, whether they are those of the device or not.
    fn host(&mut self) -> Option<&mut engine::Batch> {
        let room = self.room.get_mut().unwrap_or_else(PoisonError::into_inner).as_mut();
        self.seen.get_mut().or(room)
    }

    fn write(&self, slice: &Slice, bytes: &[u8]) {
        self.device.queue.write_buffer(&slice.buffer, slice.offset, bytes);
    }

    /// Uploads the columns and the tally of `batch`, which has as many trucks.
    fn upload(&mut self, batch: &engine::Batch) {
        self.stepped();
        for (column, bytes) in batch.columns() {
            self.write(self.column(column), bytes);
        }
        let sums: Vec<u64> = batch.tally.sums.iter().map(|&sum| sum as u64).collect();
        self.write(self.buffers.tally(), cast_slice(&sums));
    }

    fn read_tally(&self) -> Result<Tally, Error> {
        let bytes = self.device.read(std::slice::from_ref(self.buffers.tally()))?;
        // Two words of 32 bits, the lower first.
        let mut sums = bytes[0].chunks_exact(size_of::<i64>()).map(bytemuck::pod_read_unaligned::<[u32; 2]>);
        let mut next = || sums.next().map_or(0, |[low, high]| (u64::from(low) | u64::from(high) << 32) as i64);
        Ok(Tally { sums: std::array::from_fn(|_| next()) })
    }
}

impl EngineBatch for Batch {
    fn n_envs(&self) -> usize {
        self.n_envs
    }

    fn bytes(&self) -> usize {
        self.buffers.columns().iter().map(|slice| slice.size as usize).sum()
    }

    fn columns(&self) -> &engine::Batch {
        self.seen.get_or_init(|| {
            let room = self.room.lock().unwrap_or_else(PoisonError::into_inner).take();
            let mut batch = room.expect("what was seen is given back as room before it is read again");
            // A device that fails here fails at the next step, which returns the error.
            if let Ok(contents) = self.device.read(self.buffers.columns()) {
                for ((_, column), bytes) in batch.columns_mut().into_iter().zip(contents) {
                    column.copy_from_slice(&bytes);
                }
            }
            batch.tally = self.read_tally().unwrap_or(batch.tally);
            batch
        })
    }

    fn tally(&self) -> Result<Tally, engine::Error> {
        Ok(self.read_tally()?)
    }

    fn streams(&self) -> Vec<Stream> {
        let room = self.room.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(batch) = self.seen.get().or(room.as_ref()) {
            return batch.streams().to_vec();
        }
        // Another thread is reading the columns.
        drop(room);
        self.columns().streams().to_vec()
    }

    fn begin(&mut self, _: &World, begins: &[BeginRow], streams: Option<&[Stream]>) -> Result<(), engine::Error> {
        self.device.check()?;
        if let Some(streams) = streams {
            self.write(self.buffers.table(Table::Streams), cast_slice(streams));
            self.host().into_iter().for_each(|batch| batch.set_streams(streams));
        }
        self.write(self.buffers.table(Table::Begins), cast_slice(begins));
        self.submit(|batch, encoder| batch.add_pass(encoder, batch.case.working(BEGIN.iter()), None));
        Ok(self.device.check()?)
    }

    fn set_autoreset(&mut self, autoreset: Autoreset) {
        self.case.autoreset = autoreset;
        if let Some(host) = self.host() {
            host.set_autoreset(autoreset);
            let facts = BatchFacts::of(host);
            self.write(self.buffers.table(Table::Batch), bytes_of(&facts));
        }
    }

    fn read(&self, columns: &[Column]) -> Result<Vec<Cow<'_, [u8]>>, engine::Error> {
        if let Some(seen) = self.seen.get() {
            return Ok(columns.iter().map(|&column| Cow::Borrowed(seen.column(column))).collect());
        }
        let slices: Vec<Slice> = columns.iter().map(|&column| self.column(column).clone()).collect();
        Ok(self.device.read(&slices)?.into_iter().map(Cow::Owned).collect())
    }

    fn gather(&mut self, world: &World, indices: &[u32]) -> Result<(), engine::Error> {
        if self.external {
            return Err(Error::ExternalColumns.into());
        }
        let host = self.columns().gathered(indices)?;
        check_size(&self.device, indices.len(), world.traffic.is_some())?;
        let buffers = self.buffers.resized(&self.device, world, &host)?;
        let room = engine::Batch::clone(&host);
        let mut batch = Batch::of(&self.device, buffers, self.case, room, false);
        batch.upload(&host);
        *self = batch;
        Ok(())
    }

    fn draw_from(&mut self, routes: &[u32]) {
        self.write(self.buffers.table(Table::Choice), cast_slice(routes));
        self.host().into_iter().for_each(|batch| batch.set_drawn(routes));
    }

    fn replace(&mut self, batch: engine::Batch) -> Result<(), engine::Error> {
        self.upload(&batch);
        Ok(self.device.check()?)
    }

    fn step(&mut self, _: &World, actions: &[u32]) -> Result<(), engine::Error> {
        self.device.check()?;
        self.write(self.column(Column::Action), cast_slice(actions));
        self.submit(Batch::add_step);
        Ok(())
    }

    fn step_with(&mut self, _: &World, commands: &[Command]) -> Result<(), engine::Error> {
        self.device.check()?;
        self.write(self.column(Column::Command), cast_slice(commands));
        self.submit(Batch::add_step);
        Ok(())
    }

    fn steps_at_random(&mut self, _: &World, n_steps: usize) {
        self.submit(|batch, encoder| {
            batch.add_pass(encoder, std::iter::repeat_n(batch.random_step(), n_steps).flatten(), None);
        });
    }

    fn step_at_random_by_stage(&mut self, _: &World) -> Result<[Duration; N_STAGES], engine::Error> {
        self.submit(Batch::add_draw);
        let case = self.case;
        let times = kernel_times::lasted(self, &STAGES.map(|stage| case.working(stage.kernels().iter()).collect()))?;
        let mut times = times.into_iter();
        Ok(std::array::from_fn(|_| times.next().unwrap_or_default()))
    }

    fn step_at_random_by_kernel(&mut self) -> Result<Vec<(&'static str, Duration)>, engine::Error> {
        let kernels: Vec<Kernel> = self.random_step().collect();
        let each: Vec<Vec<Kernel>> = kernels.iter().map(|&kernel| vec![kernel]).collect();
        let times = kernel_times::lasted(self, &each)?;
        Ok(kernels.into_iter().map(Kernel::name).zip(times).collect())
    }

    fn run_stage(&mut self, _: &World, stage: Stage) {
        self.submit(|batch, encoder| batch.add_stages(encoder, &[stage]));
    }

    fn wait(&self) -> Result<(), engine::Error> {
        Ok(self.device.wait()?)
    }
}
