//! Many trucks, many steps, on the engine that the caller chooses: the only module that knows both.

mod actions; // what trucks are asked for
mod check; // what a caller asks of a batch
mod state; // the rows that a batch goes on from

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Duration;

use bytemuck::{AnyBitPattern, NoUninit};

use crate::engine::EngineBatch;
#[cfg(feature = "gpu")]
use crate::engine::gpu;
use crate::engine::limits::check_command;
use crate::engine::stages::{N_STAGES, Stage};
pub use crate::engine::{Autoreset, Batch, Error, RouteChoice, Tally, available_memory, check_size};
use crate::layout::{BEGINS, BeginRow, Column, Command, HAS_ROUTE, HAS_START, IS_FIRST, Start, Stream};
use crate::world::World;
pub use actions::Actions;
use check::{centre_beside, check_alone, check_begins, check_drawn, check_known, check_routes, check_start};
use state::check_state;

/// What steps a batch.
#[derive(Debug, Clone, Default)]
pub enum Engine {
    /// The CPU: all of its cores.
    #[default]
    Cpu,
    /// Compute shaders on a device.
    #[cfg(feature = "gpu")]
    Gpu {
        /// The device.
        device: gpu::Device,
        /// External columns: those that lie in memory of the caller.
        columns: gpu::Columns,
    },
}

/// An episode that the caller begins.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Begin {
    /// Index of the truck.
    pub env: usize,
    /// What the truck draws from on: the episode is the first of this stream. None: the next one of its own stream.
    pub stream: Option<Stream>,
    /// Index of the episode's route in the world. None: as the batch chooses it.
    pub route: Option<u32>,
    /// The episode's start. None: drawn.
    pub start: Option<Start>,
}

/// The bytes of a column as rows. Those read from a device need not be aligned.
pub fn rows<T: AnyBitPattern + NoUninit>(bytes: Cow<'_, [u8]>) -> Cow<'_, [T]> {
    match bytes {
        Cow::Borrowed(bytes) => match bytemuck::try_cast_slice(bytes) {
            Ok(rows) => Cow::Borrowed(rows),
            Err(_) => Cow::Owned(bytemuck::pod_collect_to_vec(bytes)),
        },
        Cow::Owned(bytes) => Cow::Owned(bytemuck::pod_collect_to_vec(&bytes)),
    }
}

/// A batch of trucks in a world.
#[derive(Debug)]
pub struct Simulator {
    world: Arc<World>,
    batch: Box<dyn EngineBatch>,
    /// Routes that it draws from, none where each truck has its own.
    drawn: Option<usize>,
}

impl Simulator {
    /// `n_envs` trucks on the CPU, reset and ready for their first action.
    pub fn new(world: Arc<World>, n_envs: usize, seed: u32, choice: RouteChoice) -> Result<Simulator, Error> {
        Simulator::on(Engine::Cpu, world, n_envs, seed, choice)
    }

    /// `n_envs` trucks on an engine, reset and ready for their first action.
    ///
    /// Fails where the routes do not fit the world or the number of trucks, or the columns neither the host's memory
    /// nor the device's.
    pub fn on(
        engine: Engine,
        world: Arc<World>,
        n_envs: usize,
        seed: u32,
        choice: RouteChoice,
    ) -> Result<Simulator, Error> {
        check_routes(&world, n_envs, &choice)?;
        let drawn = matches!(choice, RouteChoice::Drawn(_)).then_some(choice.routes().len());
        let batch: Box<dyn EngineBatch> = match engine {
            Engine::Cpu => Box::new(Batch::new(n_envs, seed, choice, world.traffic.is_some(), world.group())?),
            #[cfg(feature = "gpu")]
            Engine::Gpu { device, columns } => {
                Box::new(gpu::Batch::new(&device, &world, n_envs, seed, choice, columns)?)
            }
        };
        let mut simulator = Simulator { batch, world, drawn };
        simulator.reset();
        Ok(simulator)
    }

    /// The world the trucks drive in.
    pub fn world(&self) -> &Arc<World> {
        &self.world
    }

    /// Trucks in the batch.
    pub fn n_envs(&self) -> usize {
        self.batch.n_envs()
    }

    /// Memory of the columns, without the shared world (bytes).
    pub fn bytes(&self) -> usize {
        self.batch.bytes()
    }

    /// The columns, as the last step or reset left them.
    ///
    /// From a device they are read when they are first asked for after a step. From a lost device nothing can be read:
    /// the columns are then those last read, and the next step fails.
    pub fn batch(&self) -> &Batch {
        self.batch.columns()
    }

    /// The batch on its device, none on the CPU: for other computations there.
    #[cfg(feature = "gpu")]
    pub fn on_device(&mut self) -> Option<&mut gpu::Batch> {
        let batch: &mut dyn std::any::Any = self.batch.as_mut();
        batch.downcast_mut()
    }

    /// What each truck draws from, `[n_envs]`.
    pub fn streams(&self) -> Vec<Stream> {
        self.batch.streams()
    }

    /// Makes trucks draw from other streams from now on, `[n_envs]`: random actions, noise, delays and vehicles at
    /// once, routes and starts with their next episode. [`Simulator::restore`] needs it where [`Simulator::begin`] had
    /// given them.
    pub fn set_streams(&mut self, streams: &[Stream]) -> Result<(), Error> {
        let n_envs = self.n_envs();
        if streams.len() != n_envs {
            return Err(Error::StreamCount { n_streams: streams.len(), n_envs });
        }
        self.batch.begin(&self.world, &vec![BeginRow::default(); n_envs], Some(streams))
    }

    /// Sums over all steps since the batch was made.
    pub fn tally(&self) -> Result<Tally, Error> {
        self.batch.tally()
    }

    /// The bytes of some columns, as [`Simulator::batch`] has them, `[n_envs]` [`rows`] each. From a device these alone
    /// are read, unless all were read since the last step.
    pub fn read(&self, columns: &[Column]) -> Result<Vec<Cow<'_, [u8]>>, Error> {
        self.batch.read(columns)
    }

    /// What follows the end of an episode from the next step on: before the first call that of
    /// [`RouteChoice::autoreset`].
    pub fn set_autoreset(&mut self, autoreset: Autoreset) {
        self.batch.set_autoreset(autoreset);
    }

    /// Begins episode 0 of every truck.
    pub fn reset(&mut self) {
        let begins = vec![BeginRow { what: BEGINS | IS_FIRST, ..BeginRow::default() }; self.n_envs()];
        // A device that fails here fails at the next step, which returns the error.
        let _ = self.batch.begin(&self.world, &begins, None);
    }

    /// Begins an episode of each of these trucks and leaves the others as they are. What follows depends on the truck's
    /// stream alone: with the stream (seed, env) it drives as truck `env` of a batch with that seed, at any place in a
    /// batch of any size. Wrong requests, as two for one truck, leave the batch as it was.
    pub fn begin(&mut self, requests: &[Begin]) -> Result<(), Error> {
        let n_envs = self.n_envs();
        let mut begins = vec![BeginRow::default(); n_envs];
        let mut has_stream = false;
        let mut streams = self.batch.streams();
        for (position, &Begin { env, stream, route, start }) in requests.iter().enumerate() {
            let Some(begin) = begins.get_mut(env) else {
                return Err(Error::UnknownTruck { position, index: env, n_envs });
            };
            if begin.what != 0 {
                return Err(Error::RepeatedTruck { position, index: env });
            }
            route.map_or(Ok(()), |route| check_known(&self.world, &[route]))?;
            start.map_or(Ok(()), |start| check_start(&self.world, env, &start))?;
            let flag = |is_set: bool, bit: u32| if is_set { bit } else { 0 };
            let what = BEGINS
                | flag(stream.is_some(), IS_FIRST)
                | flag(route.is_some(), HAS_ROUTE)
                | flag(start.is_some(), HAS_START);
            *begin = BeginRow { start: start.unwrap_or_default(), route: route.unwrap_or_default(), what };
            streams[env] = stream.unwrap_or(streams[env]);
            has_stream |= stream.is_some();
        }
        check_begins(&self.world, &begins)?;
        centre_beside(&self.world, &mut begins);
        self.batch.begin(&self.world, &begins, has_stream.then_some(streams.as_slice()))
    }

    /// Begins episode 0 of every truck at a stated pose, `[n_envs]`, rather than a drawn one. Wrong starts leave the
    /// batch as it was.
    pub fn reset_from(&mut self, starts: &[Start]) -> Result<(), Error> {
        let n_envs = self.n_envs();
        if starts.len() != n_envs {
            return Err(Error::StartCount { n_starts: starts.len(), n_envs });
        }
        for (env, start) in starts.iter().enumerate() {
            check_start(&self.world, env, start)?;
        }
        let what = BEGINS | IS_FIRST | HAS_START;
        let begins: Vec<BeginRow> = starts.iter().map(|&start| BeginRow { start, route: 0, what }).collect();
        self.batch.begin(&self.world, &begins, None)
    }

    /// Draws the routes of later episodes from these, as many as before; a route that stands twice is drawn twice as
    /// often. Episodes under way end on their own routes. Wrong routes leave the batch as it was.
    pub fn draw_from(&mut self, routes: &[u32]) -> Result<(), Error> {
        if self.drawn != Some(routes.len()) {
            return Err(Error::DrawnCount { n_routes: routes.len(), drawn: self.drawn });
        }
        check_known(&self.world, routes)?;
        check_drawn(&self.world, routes)?;
        self.batch.draw_from(routes);
        Ok(())
    }

    /// Makes row `i` what row `indices[i]` was, so that one truck can go on in several ways: the batch then has
    /// `indices.len()` trucks.
    ///
    /// A truck that was ended and held stays so. A fixed route moves with its truck; what is drawn later depends on the
    /// batch's seed and the new row. An error leaves the batch as it was.
    pub fn gather(&mut self, indices: &[u32]) -> Result<(), Error> {
        let n_envs = self.n_envs();
        if indices.is_empty() {
            return Err(Error::EmptyBatch);
        }
        check_alone(&self.world, "gather")?;
        if let Some((position, &index)) = indices.iter().enumerate().find(|&(_, &index)| n_envs <= index as usize) {
            return Err(Error::UnknownTruck { position, index: index as usize, n_envs });
        }
        self.batch.gather(&self.world, indices)
    }

    /// Goes on from the bytes of every column that [`Batch::columns`] gave: with the same world, engine, seed and
    /// routes every later step is the same bit for bit.
    ///
    /// Fails where a column is missing or of another size, and for the first value that no truck of this world can
    /// have: an index or a code outside its table, a number outside its range or none, by column, truck and field; and
    /// for a truck that waits for its next episode where [`Autoreset::SameStep`] leaves none waiting. The batch is then
    /// as it was, so what a file holds can be given unchecked.
    pub fn restore<'a>(&mut self, bytes_of: impl Fn(Column) -> Option<&'a [u8]>) -> Result<(), Error> {
        let mut batch = self.batch().blank()?;
        let n_envs = batch.n_envs();
        for (column, bytes) in batch.columns_mut() {
            let found = bytes_of(column);
            let fitting = found.filter(|found| found.len() == bytes.len());
            let error = || Error::ColumnSize {
                column: column.name(),
                found: found.map(<[u8]>::len),
                n_envs,
                n_bytes: bytes.len(),
            };
            bytes.copy_from_slice(fitting.ok_or_else(error)?);
        }
        check_state(&self.world, &batch)?;
        self.batch.replace(batch)
    }

    /// One step of every truck, `actions` being `[n_envs]` indices into the action table. Wrong actions leave the batch
    /// as it was.
    pub fn step(&mut self, actions: &[u32]) -> Result<(), Error> {
        let n_envs = self.n_envs();
        if self.world.is_continuous() {
            return Err(Error::NeedsCommands);
        }
        if actions.len() != n_envs {
            return Err(Error::ActionCount { n_actions: actions.len(), n_envs });
        }
        let limit = self.world.params.n_actions;
        if let Some((env, &action)) = actions.iter().enumerate().find(|&(_, &action)| limit <= action) {
            return Err(Error::UnknownAction { env, action, limit });
        }
        self.batch.step(&self.world, actions)
    }

    /// One step of every truck by commands, `[n_envs]`, where actions are continuous. The driven frame's left is
    /// positive, on a left-hand road the map's right. Wrong commands leave the batch as it was.
    ///
    /// Fails where actions are indices, and for the first value outside -1..=1, by truck: none is clipped.
    pub fn step_with(&mut self, commands: &[Command]) -> Result<(), Error> {
        let n_envs = self.n_envs();
        if !self.world.is_continuous() {
            return Err(Error::NeedsIndices);
        }
        if commands.len() != n_envs {
            return Err(Error::CommandCount { n_commands: commands.len(), n_envs });
        }
        commands.iter().enumerate().try_for_each(|(env, command)| check_command(env, command))?;
        self.batch.step_with(&self.world, commands)
    }

    /// One step of every truck with an action drawn uniformly at random from (seed, env, episode, step).
    pub fn step_at_random(&mut self) {
        self.batch.steps_at_random(&self.world, 1);
    }

    /// As many such steps, one after the other. On a device they are one submission, so that the host does less for
    /// each; it takes memory for each, and a driver may end one that lasts for seconds, so thousands are several calls.
    pub fn steps_at_random(&mut self, n_steps: usize) {
        self.batch.steps_at_random(&self.world, n_steps);
    }

    /// [`Simulator::step_at_random`] a stage at a time over the whole batch, for timing: the same result, and the time
    /// of each stage.
    pub fn step_at_random_by_stage(&mut self) -> Result<[Duration; N_STAGES], Error> {
        self.batch.step_at_random_by_stage(&self.world)
    }

    /// [`Simulator::step_at_random`] a kernel at a time, for timing: the same result, and the kernels of a step on a
    /// device with the time of each. On the CPU nothing is done and the list is empty.
    pub fn step_at_random_by_kernel(&mut self) -> Result<Vec<(&'static str, Duration)>, Error> {
        self.batch.step_at_random_by_kernel()
    }

    /// One stage of a step over every truck: for comparing engines a stage at a time.
    pub fn run_stage(&mut self, stage: Stage) {
        self.batch.run_stage(&self.world, stage);
    }

    /// Waits until every step asked for is done: a device works while its caller goes on.
    pub fn wait(&self) -> Result<(), Error> {
        self.batch.wait()
    }
}
