//! Many trucks, many steps, on whichever engine was chosen.

use std::sync::Arc;
use std::time::Duration;

use crate::cpu;
pub use crate::cpu::count::Tally;
pub use crate::cpu::{Batch, RouteChoice};
#[cfg(feature = "gpu")]
use crate::gpu;
use crate::layout::Start;
use crate::stages::{STAGES, Stage};
use crate::world::World;

/// What a caller can get wrong about a batch.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// A batch needs a truck.
    #[error("n_envs: 0; a batch needs at least 1 truck")]
    EmptyBatch,
    /// An episode needs a route to run on.
    #[error("routes: empty; at least 1 route is needed")]
    NoRoutes,
    /// A route that the world does not have.
    #[error("routes: {route}; the world has routes 0..{n_routes}")]
    UnknownRoute {
        /// The index asked for.
        route: u32,
        /// Routes in the world.
        n_routes: usize,
    },
    /// With fixed routes, one each.
    #[error("routes: {n_routes} for {n_envs} trucks; one each is needed")]
    RouteCount {
        /// Routes given.
        n_routes: usize,
        /// Trucks in the batch.
        n_envs: usize,
    },
    /// One start a truck.
    #[error("starts: {n_starts} for {n_envs} trucks; one each is needed")]
    StartCount {
        /// Starts given.
        n_starts: usize,
        /// Trucks in the batch.
        n_envs: usize,
    },
    /// A start beyond the benchmark's largest errors.
    #[error("starts[{env}]: {share} of the largest start error; must lie in -1..1")]
    UnknownStart {
        /// The truck it was meant for.
        env: usize,
        /// The share.
        share: String,
    },
    /// A row that the batch does not have.
    #[error("indices[{place}]: {index}; the batch has trucks 0..{n_envs}")]
    UnknownTruck {
        /// Its place among the indices.
        place: usize,
        /// The index asked for.
        index: u32,
        /// Trucks in the batch.
        n_envs: usize,
    },
    /// One action a truck.
    #[error("actions: {n_actions} for {n_envs} trucks; one each is needed")]
    ActionCount {
        /// Actions given.
        n_actions: usize,
        /// Trucks in the batch.
        n_envs: usize,
    },
    /// An action outside the table.
    #[error("actions[{env}]: {action}; must lie in 0..{limit}")]
    UnknownAction {
        /// The truck it was meant for.
        env: usize,
        /// The action.
        action: u32,
        /// Entries of the action table.
        limit: u32,
    },
    /// A column to go on from that is not of this batch.
    #[error("{column}: {}; a batch of {n_envs} trucks needs {n_bytes} bytes", .found.map_or("missing".to_owned(), |found| format!("{found} bytes")))]
    ColumnSize {
        /// The column's name.
        column: &'static str,
        /// Bytes given, none where the column is missing.
        found: Option<usize>,
        /// Trucks in the batch.
        n_envs: usize,
        /// Bytes needed.
        n_bytes: usize,
    },
    /// The device.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] gpu::Error),
    /// A truck to go on with that cannot be in this world.
    #[error("{column}[{env}]: {found}; the world has {limit}")]
    OutsideWorld {
        /// The column's name.
        column: &'static str,
        /// The truck's place in the batch.
        env: usize,
        /// The index found there.
        found: u32,
        /// What it may be at most.
        limit: String,
    },
}

/// What steps a batch.
#[derive(Debug, Clone, Default)]
pub enum Engine {
    /// The processor: all of its cores.
    #[default]
    Cpu,
    /// Compute shaders on a device.
    #[cfg(feature = "gpu")]
    Gpu {
        /// The device.
        device: gpu::Device,
        /// Columns that lie in memory of the caller.
        columns: gpu::Columns,
    },
}

/// A batch of trucks in a world.
#[derive(Debug)]
pub struct Simulator {
    world: Arc<World>,
    batch: Columns,
}

/// The columns, where their engine has them.
#[derive(Debug)]
enum Columns {
    Cpu(Box<Batch>),
    #[cfg(feature = "gpu")]
    Gpu(Box<gpu::Batch>),
}

impl Simulator {
    /// `n_envs` trucks on the processor, reset and ready for their first action.
    pub fn new(world: Arc<World>, n_envs: usize, seed: u32, choice: RouteChoice) -> Result<Simulator, Error> {
        Simulator::on(Engine::Cpu, world, n_envs, seed, choice)
    }

    /// `n_envs` trucks on an engine, reset and ready for their first action.
    pub fn on(engine: Engine, world: Arc<World>, n_envs: usize, seed: u32, choice: RouteChoice) -> Result<Simulator, Error> {
        let (RouteChoice::Drawn(routes) | RouteChoice::Fixed(routes)) = &choice;
        if n_envs == 0 {
            return Err(Error::EmptyBatch);
        }
        if routes.is_empty() {
            return Err(Error::NoRoutes);
        }
        if let Some(&route) = routes.iter().find(|&&route| world.routes.len() <= route as usize) {
            return Err(Error::UnknownRoute { route, n_routes: world.routes.len() });
        }
        if matches!(choice, RouteChoice::Fixed(_)) && routes.len() != n_envs {
            return Err(Error::RouteCount { n_routes: routes.len(), n_envs });
        }
        let batch = match engine {
            Engine::Cpu => Columns::Cpu(Box::new(Batch::new(n_envs, seed, choice))),
            #[cfg(feature = "gpu")]
            Engine::Gpu { device, columns } => Columns::Gpu(Box::new(gpu::Batch::new(&device, &world, n_envs, seed, choice, columns)?)),
        };
        let mut simulator = Simulator { batch, world };
        simulator.reset();
        Ok(simulator)
    }

    /// The world the trucks drive in.
    pub fn world(&self) -> &Arc<World> {
        &self.world
    }

    /// Trucks in the batch.
    pub fn n_envs(&self) -> usize {
        match &self.batch {
            Columns::Cpu(batch) => batch.n_envs(),
            #[cfg(feature = "gpu")]
            Columns::Gpu(batch) => batch.n_envs(),
        }
    }

    /// Memory that the columns take, beside the shared world [bytes].
    pub fn bytes(&self) -> usize {
        match &self.batch {
            Columns::Cpu(batch) => batch.columns().iter().map(|(_, column)| column.len()).sum(),
            #[cfg(feature = "gpu")]
            Columns::Gpu(batch) => batch.bytes(),
        }
    }

    /// The columns, as the last step or reset left them. From a device they are read when they are first asked for after a step; of one
    /// that was lost meanwhile nothing can be read, and the next step says so.
    pub fn batch(&self) -> &Batch {
        match &self.batch {
            Columns::Cpu(batch) => batch,
            #[cfg(feature = "gpu")]
            Columns::Gpu(batch) => batch.columns(),
        }
    }

    /// The batch on its device, none on the processor: for who computes beside it there.
    #[cfg(feature = "gpu")]
    pub fn on_device(&mut self) -> Option<&mut gpu::Batch> {
        match &mut self.batch {
            Columns::Cpu(_) => None,
            Columns::Gpu(batch) => Some(batch),
        }
    }

    /// What happened since the batch was made.
    pub fn tally(&self) -> Result<Tally, Error> {
        match &self.batch {
            Columns::Cpu(batch) => Ok(batch.tally()),
            #[cfg(feature = "gpu")]
            Columns::Gpu(batch) => Ok(batch.tally()?),
        }
    }

    /// Begins episode 0 of every truck.
    pub fn reset(&mut self) {
        match &mut self.batch {
            Columns::Cpu(batch) => batch.for_each_row(|row| cpu::reset::begin(&self.world, row, 0)),
            #[cfg(feature = "gpu")]
            Columns::Gpu(batch) => batch.reset(),
        }
    }

    /// Begins episode 0 of every truck at a stated pose, `[n_envs]`, rather than a drawn one. An error leaves the batch as it was.
    pub fn reset_from(&mut self, starts: &[Start]) -> Result<(), Error> {
        let n_envs = self.n_envs();
        if starts.len() != n_envs {
            return Err(Error::StartCount { n_starts: starts.len(), n_envs });
        }
        for (env, start) in starts.iter().enumerate() {
            if let Some(share) = [start.offset, start.heading].into_iter().find(|share| !(-1.0..=1.0).contains(share)) {
                return Err(Error::UnknownStart { env, share: share.to_string() });
            }
        }
        self.change(true, |world, batch| batch.for_each_row(|row| cpu::reset::begin_from(world, row, 0, &starts[row.env as usize])))
    }

    /// Makes row `i` what row `indices[i]` was, so that one truck can go on in several ways: the batch then has `indices.len()` trucks.
    ///
    /// A truck that was ended and held stays so. A fixed route moves with its truck; what is drawn later depends on the new row. An error
    /// leaves the batch as it was.
    pub fn gather(&mut self, indices: &[u32]) -> Result<(), Error> {
        let n_envs = self.n_envs();
        if indices.is_empty() {
            return Err(Error::EmptyBatch);
        }
        if let Some((place, &index)) = indices.iter().enumerate().find(|&(_, &index)| n_envs <= index as usize) {
            return Err(Error::UnknownTruck { place, index, n_envs });
        }
        match &mut self.batch {
            Columns::Cpu(batch) => **batch = batch.gathered(indices),
            #[cfg(feature = "gpu")]
            Columns::Gpu(batch) => **batch = batch.gathered(&self.world, indices)?,
        }
        Ok(())
    }

    /// Goes on from columns that [`Batch::columns`] gave, found by their names: with the same world, engine, seed and routes every later step
    /// is the same bit for bit. An error leaves the batch as it was.
    pub fn restore<'a>(&mut self, column: impl Fn(&str) -> Option<&'a [u8]>) -> Result<(), Error> {
        let mut batch = self.batch().clone();
        let n_envs = batch.n_envs();
        for (name, bytes) in batch.columns_mut() {
            let found = column(name);
            let kept = found.filter(|found| found.len() == bytes.len());
            let error = || Error::ColumnSize { column: name, found: found.map(<[u8]>::len), n_envs, n_bytes: bytes.len() };
            bytes.copy_from_slice(kept.ok_or_else(error)?);
        }
        // Stages look routes and waypoints up without asking.
        for (env, (truck, progress)) in batch.truck.iter().zip(&batch.progress).enumerate() {
            let Some(route) = self.world.routes.get(truck.route as usize) else {
                let limit = format!("routes 0..{}", self.world.routes.len());
                return Err(Error::OutsideWorld { column: "truck", env, found: truck.route, limit });
            };
            if route.n_waypoints < progress.waypoint {
                let limit = format!("{} waypoints on its route", route.n_waypoints);
                return Err(Error::OutsideWorld { column: "progress", env, found: progress.waypoint, limit });
            }
        }
        self.change(false, |_, columns| *columns = batch)
    }

    /// Changes the columns on the host, wherever they are; then every truck looks around on its own engine if `look` says so.
    fn change(&mut self, look: bool, change: impl FnOnce(&World, &mut Batch)) -> Result<(), Error> {
        match &mut self.batch {
            Columns::Cpu(batch) => change(&self.world, batch),
            #[cfg(feature = "gpu")]
            Columns::Gpu(batch) => {
                let mut host = batch.columns().clone();
                change(&self.world, &mut host);
                batch.upload(&host, look);
                batch.device().check()?;
            }
        }
        // The processor has looked while it changed them.
        let _ = look;
        Ok(())
    }

    /// One step of every truck. An error leaves the batch as it was.
    pub fn step(&mut self, actions: &[u32]) -> Result<(), Error> {
        let n_envs = self.n_envs();
        if actions.len() != n_envs {
            return Err(Error::ActionCount { n_actions: actions.len(), n_envs });
        }
        let limit = self.world.params.n_actions;
        if let Some((env, &action)) = actions.iter().enumerate().find(|&(_, &action)| limit <= action) {
            return Err(Error::UnknownAction { env, action, limit });
        }
        match &mut self.batch {
            Columns::Cpu(batch) => {
                batch.action.copy_from_slice(actions);
                batch.step(&self.world);
            }
            #[cfg(feature = "gpu")]
            Columns::Gpu(batch) => {
                batch.device().check()?;
                batch.set_actions(actions);
                batch.step();
            }
        }
        Ok(())
    }

    /// One step of every truck with an action drawn from (seed, env, episode, step), each as likely as the next.
    pub fn step_at_random(&mut self) {
        match &mut self.batch {
            Columns::Cpu(batch) => {
                batch.for_each_row(|row| cpu::draw::draw(&self.world, row));
                batch.step(&self.world);
            }
            #[cfg(feature = "gpu")]
            Columns::Gpu(batch) => batch.step_at_random(),
        }
    }

    /// [`Simulator::step_at_random`] a stage at a time over the whole batch, for timing: same result, one duration a stage.
    pub fn step_at_random_by_stage(&mut self) -> Result<[Duration; STAGES.len()], Error> {
        match &mut self.batch {
            Columns::Cpu(batch) => {
                batch.for_each_row(|row| cpu::draw::draw(&self.world, row));
                Ok(batch.step_by_stage(&self.world))
            }
            #[cfg(feature = "gpu")]
            Columns::Gpu(batch) => Ok(batch.step_at_random_by_stage()?),
        }
    }

    /// One stage of a step over every truck: for comparing engines a stage at a time.
    pub fn run_stage(&mut self, stage: &Stage) {
        match &mut self.batch {
            Columns::Cpu(batch) => batch.run_stage(&self.world, stage),
            #[cfg(feature = "gpu")]
            Columns::Gpu(batch) => batch.run_stage(stage),
        }
    }

    /// Waits until every step asked for is done: a device works while its caller goes on.
    pub fn wait(&self) -> Result<(), Error> {
        match &self.batch {
            Columns::Cpu(_) => Ok(()),
            #[cfg(feature = "gpu")]
            Columns::Gpu(batch) => Ok(batch.wait()?),
        }
    }
}
