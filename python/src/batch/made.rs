//! How a batch is made, and who may use it.

use std::sync::{Mutex, MutexGuard, TryLockError};

use offtrack::simulator::{RouteChoice, Simulator, Tally};
use pyo3::exceptions::{PyMemoryError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use super::arguments::{autoreset_of, engine_of};
use super::state::State;
use super::{Batch, weights};
use crate::errors;
use crate::infos::Names;
use crate::observed::columns_of_step;
use crate::pool::Pool;
use crate::worlds::{Asked, Place};

impl Batch {
    /// What its trucks drive in.
    pub fn place(&self) -> &Place {
        &self.place
    }

    /// A batch, with its threads and, where one is named, its device.
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    pub(super) fn made(
        py: Python,
        asked: &Asked,
        num_envs: i64,
        seed: u32,
        autoreset: &str,
        num_threads: usize,
        device: &str,
        weights: Option<&[(String, f64)]>,
    ) -> PyResult<Batch> {
        let n_envs = match usize::try_from(num_envs) {
            Ok(n_envs) if 0 < n_envs => n_envs,
            _ => return Err(PyValueError::new_err(format!("num_envs: {num_envs}; must be at least 1"))),
        };
        if u32::try_from(n_envs).is_err() {
            return Err(PyMemoryError::new_err(format!("num_envs: {num_envs}; a batch holds fewer than 2^32 trucks")));
        }
        let autoreset = autoreset_of(autoreset)?;
        let mut pool = Pool::new(num_threads);
        let place = pool.run_until_signal(py, |stop| Place::find(asked, stop))??;
        let (engine, device) = engine_of(device)?;
        let drawn = weights.map(|weights| weights::table(&place, weights)).transpose()?;
        let choice = RouteChoice::Drawn(drawn.unwrap_or_else(|| place.routes.clone()));
        let world = place.world.clone();
        let made = pool.run(py, || Simulator::on(engine, world, n_envs, seed, choice))?;
        let mut simulator = made.map_err(|error| errors::of_simulator(&error))?;
        simulator.set_autoreset(autoreset);
        let mut state = State {
            simulator,
            pool,
            camera: None,
            episodes: Vec::new(),
            held: Vec::new(),
            ends: Vec::new(),
            earlier: Tally::default(),
        };
        state.look()?;
        let layout = place.world.observation_layout();
        let (names, read) = (Names::new(py, &place.world), columns_of_step(layout, autoreset));
        Ok(Batch { place, names, n_envs, layout, read, device, autoreset, state: Mutex::new(state) })
    }

    /// The state, unless another thread has it.
    pub(super) fn state(&self) -> PyResult<MutexGuard<'_, State>> {
        match self.state.try_lock() {
            Ok(state) => Ok(state),
            Err(TryLockError::Poisoned(_)) => Err(PyRuntimeError::new_err("this batch failed before; make another")),
            Err(TryLockError::WouldBlock) => Err(PyRuntimeError::new_err(
                "this batch is in use by another thread; give each thread a batch of its own",
            )),
        }
    }
}
