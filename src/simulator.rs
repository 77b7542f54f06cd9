//! Many trucks, many steps, on whichever engine was chosen.

use std::sync::Arc;
use std::time::Duration;

use crate::cpu;
pub use crate::cpu::{Batch, RouteChoice};
use crate::layout::Start;
use crate::random::{self, Draw};
use crate::stages::STAGES;
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

/// A batch of trucks in a world.
#[derive(Debug)]
pub struct Simulator {
    world: Arc<World>,
    batch: Batch,
    seed: u32,
}

impl Simulator {
    /// `n_envs` trucks, reset and ready for their first action.
    pub fn new(world: Arc<World>, n_envs: usize, seed: u32, choice: RouteChoice) -> Result<Simulator, Error> {
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
        let mut simulator = Simulator { batch: Batch::new(n_envs, seed, choice), world, seed };
        simulator.reset();
        Ok(simulator)
    }

    /// The world the trucks drive in.
    pub fn world(&self) -> &Arc<World> {
        &self.world
    }

    /// The columns, as the last step or reset left them.
    pub fn batch(&self) -> &Batch {
        &self.batch
    }

    /// Begins episode 0 of every truck.
    pub fn reset(&mut self) {
        self.batch.for_each_row(|row| cpu::reset::begin(&self.world, row, 0));
    }

    /// Begins episode 0 of every truck at a stated pose, `[n_envs]`, rather than a drawn one. An error leaves the batch as it was.
    pub fn reset_from(&mut self, starts: &[Start]) -> Result<(), Error> {
        let n_envs = self.batch.n_envs();
        if starts.len() != n_envs {
            return Err(Error::StartCount { n_starts: starts.len(), n_envs });
        }
        for (env, start) in starts.iter().enumerate() {
            if let Some(share) = [start.offset, start.heading].into_iter().find(|share| !(-1.0..=1.0).contains(share)) {
                return Err(Error::UnknownStart { env, share: share.to_string() });
            }
        }
        self.batch.for_each_row(|row| cpu::reset::begin_from(&self.world, row, 0, &starts[row.env as usize]));
        Ok(())
    }

    /// Makes row `i` what row `indices[i]` was, so that one truck can go on in several ways: the batch then has `indices.len()` trucks.
    ///
    /// A truck that was ended and held stays so. A fixed route moves with its truck; what is drawn later depends on the new row. An error
    /// leaves the batch as it was.
    pub fn gather(&mut self, indices: &[u32]) -> Result<(), Error> {
        let n_envs = self.batch.n_envs();
        if indices.is_empty() {
            return Err(Error::EmptyBatch);
        }
        if let Some((place, &index)) = indices.iter().enumerate().find(|&(_, &index)| n_envs <= index as usize) {
            return Err(Error::UnknownTruck { place, index, n_envs });
        }
        self.batch = self.batch.gathered(indices);
        Ok(())
    }

    /// Goes on from columns that [`Batch::columns`] gave, found by their names: with the same world, seed and routes every later step is the
    /// same bit for bit. An error leaves the batch as it was.
    pub fn restore<'a>(&mut self, column: impl Fn(&str) -> Option<&'a [u8]>) -> Result<(), Error> {
        let mut batch = self.batch.clone();
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
        self.batch = batch;
        Ok(())
    }

    /// One step of every truck. An error leaves the batch as it was.
    pub fn step(&mut self, actions: &[u32]) -> Result<(), Error> {
        let n_envs = self.batch.n_envs();
        if actions.len() != n_envs {
            return Err(Error::ActionCount { n_actions: actions.len(), n_envs });
        }
        let limit = self.world.params.n_actions;
        if let Some((env, &action)) = actions.iter().enumerate().find(|&(_, &action)| limit <= action) {
            return Err(Error::UnknownAction { env, action, limit });
        }
        self.batch.action.copy_from_slice(actions);
        self.batch.step(&self.world);
        Ok(())
    }

    /// One step of every truck with an action drawn from (seed, env, episode, step), each as likely as the next.
    pub fn step_at_random(&mut self) {
        self.draw_actions();
        self.batch.step(&self.world);
    }

    /// [`Simulator::step_at_random`] a stage at a time over the whole batch, for timing: same result, one duration a stage.
    pub fn step_at_random_by_stage(&mut self) -> [Duration; STAGES.len()] {
        self.draw_actions();
        self.batch.step_by_stage(&self.world)
    }

    fn draw_actions(&mut self) {
        let n_actions = self.world.params.n_actions;
        for (env, (action, truck)) in self.batch.action.iter_mut().zip(&self.batch.truck).enumerate() {
            let [word, ..] = random::words(self.seed, env as u32, truck.episode, (Draw::Action as u32).wrapping_add(truck.steps));
            *action = random::index_below(word, n_actions);
        }
    }
}
