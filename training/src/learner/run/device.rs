//! The loop on a graphics device: trucks, memory and learner live there, and the host only says what is next.
//!
//! A checkpoint holds the learner and not the memory: a run that goes on fills it again, its own driver at the wheel, before it learns on.

use std::sync::Arc;

use offtrack::layout::N_VALUES;
use offtrack::random;
use offtrack::simulator::{self, Tally};
use offtrack::world::World;

use super::checkpointer::{Keeper, Kept};
use super::folder::Folder;
use super::progress::Progress;
use super::{broken, fingerprint, found_scaling};
use crate::device::caught;
use crate::error::Error;
use crate::learner::bridge::device::{DeviceMemory, Shared};
use crate::learner::checkpoint::{Columns, Stored};
use crate::learner::config::Config;
use crate::learner::mirror::Mirror;
use crate::learner::normalisation::Scaling;
use crate::learner::sac::Sac;
use crate::learner::sac::device::DeviceSac;
use crate::policy::LearnedPolicy;

/// A run under way on a device.
pub struct DeviceRun {
    config: Config,
    world: Arc<World>,
    fingerprint: u32,
    shared: Shared,
    memory: DeviceMemory,
    sac: DeviceSac,
    /// None while chance drives.
    scaling: Option<Scaling>,
    /// How far it is.
    pub progress: Progress,
    keeper: Keeper,
    /// What had happened when that was last asked.
    told: Tally,
}

impl DeviceRun {
    /// A run at its beginning.
    pub fn new(
        shared: Shared,
        config: &Config,
        routes: Vec<u32>,
        world: Arc<World>,
        folder: &Folder,
        progress: Progress,
    ) -> Result<DeviceRun, Error> {
        let sac = Sac::new(&config.learning, N_VALUES, world.actions.len(), u64::from(config.seed))?;
        Ok(DeviceRun {
            fingerprint: fingerprint(&world),
            memory: DeviceMemory::new(&shared, config, &world, routes, seeds(config.seed, 0))?,
            sac: DeviceSac::new(&sac, &shared.tensors),
            scaling: None,
            progress,
            keeper: Keeper::new(folder, config.checkpoint_minutes),
            told: Tally::default(),
            config: config.clone(),
            world,
            shared,
        })
    }

    /// The adapter, as results name it.
    pub fn device(&self) -> String {
        self.shared.gpu.name()
    }

    /// See [`super::run::Run::learn`]. A device that fails on the way is an error that names the last good checkpoint.
    pub fn learn(&mut self, stopped: impl Fn() -> bool) -> Result<(), Error> {
        let failed = match caught(|| self.learn_on(stopped)) {
            Ok(()) => return Ok(()),
            // What the driver said, rather than what came of it.
            Err(Error::Device(message)) => self.shared.check().err().map_or(message, |error| error.to_string()),
            Err(error @ Error::Simulator(simulator::Error::Gpu(_))) => error.to_string(),
            Err(error) => return Err(error),
        };
        Err(Error::Device(format!("{failed}; {}", self.kept())))
    }

    fn learn_on(&mut self, stopped: impl Fn() -> bool) -> Result<(), Error> {
        while self.progress.share() < 1.0 && !stopped() {
            let is_warm = self.config.memory.warmup <= self.memory.len() && self.memory.can_sample();
            if self.scaling.is_none() && is_warm {
                let mirror = self.config.learning.mirror.then(|| Mirror::of(&self.world)).transpose()?;
                self.set_scaling(found_scaling(&self.config, mirror.as_ref(), &self.memory.observations()?));
            }
            if self.scaling.is_some() {
                self.memory.step_by(&self.sac.actor())?;
            } else {
                self.memory.step_at_random()?;
            }
            self.progress.driven(self.config.n_envs as u64);
            if self.scaling.is_some() && is_warm {
                let pace = 1.0 - (1.0 - self.config.learning.last_rate) * self.progress.share();
                for _ in 0..self.config.learning.updates_per_step {
                    self.sac.update(self.memory.sample()?, pace);
                }
                if self.progress.is_row_due() {
                    self.ask()?;
                    let entropy_weight = self.sac.entropy_weight();
                    self.progress.row(entropy_weight);
                }
                self.progress.show_now_and_then();
            }
            self.keep_now_and_then()?;
        }
        self.ask()
    }

    fn set_scaling(&mut self, scaling: Scaling) {
        self.memory.set_scaling(&scaling);
        self.scaling = Some(scaling);
    }

    /// Asks the device how it went since it was last asked, and waits for the answer.
    fn ask(&mut self) -> Result<(), Error> {
        self.shared.check()?;
        let tally = self.memory.simulator().tally()?;
        self.progress.tallied(&tally.since(&self.told));
        self.told = tally;
        let (sums, n_updates) = self.sac.summed();
        self.progress.updated(&sums, n_updates.into());
        match broken(&sums).filter(|_| 0 < n_updates) {
            Some((what, value)) => Err(self.diverged(what, value)),
            None => Ok(()),
        }
    }

    fn host(&self) -> Result<Sac, Error> {
        let like = Sac::new(&self.config.learning, N_VALUES, self.world.actions.len(), u64::from(self.config.seed))?;
        self.shared.check()?;
        Ok(self.sac.to_host(like))
    }

    /// The driver as it is; waits for the device.
    pub fn policy(&self) -> Result<LearnedPolicy, Error> {
        Ok(self.policy_of(&self.host()?))
    }

    fn policy_of(&self, host: &Sac) -> LearnedPolicy {
        LearnedPolicy {
            name: self.config.benchmark.clone(),
            benchmark: self.config.benchmark.clone(),
            actions: self.world.actions.clone(),
            scaling: self.scaling.clone().unwrap_or_else(|| Scaling::none(N_VALUES)),
            actor: host.average_actor().clone(),
        }
    }

    /// Writes what a run leaves behind. Everything is tried before the first failure is given.
    pub fn close(&mut self) -> Result<(), Error> {
        self.keep()?;
        let kept = self.keeper.wait();
        let entropy_weight = self.sac.entropy_weight();
        let row = self.progress.finish(entropy_weight);
        kept.map_or(Ok(()), |Kept { checkpoint, policy }| checkpoint.and(policy)).and(row)
    }

    fn keep_now_and_then(&mut self) -> Result<(), Error> {
        if let Some(Kept { checkpoint, policy }) = self.keeper.done() {
            self.progress.note(self.keeper.file(), checkpoint);
            self.progress.note(self.keeper.policy(), policy);
        }
        if self.keeper.is_due() && self.scaling.is_some() {
            self.ask()?;
            self.keep()?;
        }
        Ok(())
    }

    /// Begins to write a checkpoint and the driver.
    fn keep(&mut self) -> Result<(), Error> {
        let host = self.host()?;
        if let Some((what, value)) = host.broken() {
            return Err(self.diverged(&what, value));
        }
        let mut columns = Columns::default();
        if let Some(Scaling { mean, factor }) = &self.scaling {
            columns.put("observation, mean", &mean[..]);
            columns.put("observation, factor", &factor[..]);
        }
        self.progress.save(&mut columns);
        host.save(&mut columns);
        let policy = self.policy_of(&host).to_bytes();
        self.keeper.begin(&columns, self.config.to_toml(), self.fingerprint, policy);
        Ok(())
    }

    /// Goes on from a checkpoint of this run, with an empty memory.
    pub fn restore(&mut self, stored: &Stored, routes: Vec<u32>) -> Result<(), Error> {
        super::check_world(stored, self.fingerprint, &self.config)?;
        let mut host = self.host()?;
        host.restore(stored)?;
        self.progress.restore(stored)?;
        let values = |name: &str| stored.exactly(name, N_VALUES);
        // Other actions and samples than the first time.
        let seeds = seeds(self.config.seed, self.progress.updates() as u32);
        self.memory = DeviceMemory::new(&self.shared, &self.config, &self.world, routes, seeds)?;
        if stored.bytes("observation, mean").is_some() {
            self.set_scaling(Scaling { mean: values("observation, mean")?, factor: values("observation, factor")? });
        }
        self.sac = DeviceSac::new(&host, &self.shared.tensors);
        Ok(())
    }

    fn kept(&mut self) -> String {
        // One on its way was sound when it was begun; that it could not be written is told by what stands in the folder.
        let _ = self.keeper.wait();
        self.keeper.last_good()
    }

    fn diverged(&mut self, what: &str, value: f32) -> Error {
        Error::Diverged { what: what.to_owned(), value, also: String::new(), env_steps: self.progress.env_steps(), kept: self.kept() }
    }
}

/// What actions and samples are drawn from, after so many updates.
fn seeds(seed: u32, updates: u32) -> [u32; 2] {
    [1, 2].map(|purpose| random::words(seed, purpose, updates, u32::MAX)[0])
}

#[cfg(test)]
mod tests;
