//! The loop: act, step, remember, learn; and all of its state into a checkpoint and back.
//!
//! With a budget of steps alone what a run does depends on its state and on nothing else, so that one which goes on from a checkpoint
//! equals one that was never stopped, bit for bit. With minutes the learning rates follow the clock.

pub mod checkpointer;
#[cfg(feature = "gpu")]
pub mod device;
pub mod folder;
pub mod metrics;
pub mod progress;
pub mod resume;

use std::sync::Arc;

use bytemuck::{bytes_of, cast_slice};
use offtrack::layout::N_VALUES;
use offtrack::random;
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::world::World;
use rand::SeedableRng;

use crate::error::Error;
use crate::learner::bridge;
use crate::learner::checkpoint::{Columns, Stored};
use crate::learner::config::Config;
use crate::learner::generator::Generator;
use crate::learner::mirror::Mirror;
use crate::learner::normalisation::Scaling;
use crate::learner::replay_buffer::Memory;
use crate::learner::sac::{Sac, Update};
use crate::policy::{self, Policy};
use checkpointer::{Keeper, Kept};
use folder::Folder;
use progress::Progress;

/// A run under way.
pub struct Run {
    config: Config,
    world: Arc<World>,
    /// CRC-32 of the world.
    fingerprint: u32,
    simulator: Simulator,
    memory: Memory<N_VALUES>,
    acting: Generator,
    sampling: Generator,
    /// None where only what happened is learned from.
    mirror: Option<Mirror>,
    sac: Sac,
    /// None while chance drives.
    scaling: Option<Scaling>,
    /// How far it is.
    pub progress: Progress,
    keeper: Keeper,
    /// What the trucks saw before the step in hand.
    seen: Vec<[f32; N_VALUES]>,
}

impl Run {
    /// A run at its beginning.
    pub fn new(config: &Config, routes: Vec<u32>, world: Arc<World>, folder: &Folder, progress: Progress) -> Result<Run, Error> {
        let stream = |purpose: u32| Generator::seed_from_u64(u64::from(random::words(config.seed, purpose, 0, u32::MAX)[0]));
        Ok(Run {
            fingerprint: fingerprint(&world),
            simulator: Simulator::new(world.clone(), config.n_envs, config.seed, RouteChoice::Drawn(routes))?,
            memory: Memory::new(config.n_envs, config.learning.n_steps, &config.memory),
            acting: stream(1),
            sampling: stream(2),
            mirror: config.learning.mirror.then(|| Mirror::of(&world)).transpose()?,
            sac: Sac::new(&config.learning, N_VALUES, world.actions.len(), u64::from(config.seed))?,
            scaling: None,
            progress,
            keeper: Keeper::new(folder, config.checkpoint_minutes),
            seen: Vec::new(),
            config: config.clone(),
            world,
        })
    }

    /// Goes on until the time or the steps are over, or it is to stop. Only a learner that has broken down is an error: what cannot be
    /// written is reported and tried again.
    pub fn learn(&mut self, stopped: impl Fn() -> bool) -> Result<(), Error> {
        while self.progress.share() < 1.0 && !stopped() {
            self.seen.clone_from(&self.simulator.batch().observation);
            // Chance drives until there is enough to tell how the observed values lie; their scaling then stays.
            if self.scaling.is_none() && self.config.memory.warmup <= self.memory.len() && self.memory.can_sample() {
                self.scaling = Some(self.found_scaling());
            }
            if let Some(scaling) = self.scaling.take() {
                let learned = self.act_and_learn(&scaling);
                self.scaling = Some(scaling);
                learned?;
                if self.progress.is_row_due() {
                    self.check()?;
                    self.progress.row(self.sac.entropy_weight());
                }
                self.progress.show_now_and_then();
            } else {
                self.simulator.step_at_random();
                bridge::remember(&mut self.memory, &self.seen, self.simulator.batch());
                self.progress.stepped(self.simulator.batch());
            }
            self.keep_now_and_then()?;
        }
        Ok(())
    }

    fn act_and_learn(&mut self, scaling: &Scaling) -> Result<(), Error> {
        let learning = &self.config.learning;
        let n_actions = self.world.actions.len();
        let mut actions = policy::drawn(&bridge::logits(&self.sac.actor(), scaling, &self.seen), n_actions, &mut self.acting);
        if let Some(exploration) = &self.config.exploration {
            exploration.explore(self.progress.env_steps(), n_actions, &mut actions, &mut self.acting);
        }
        self.simulator.step(&actions)?;
        bridge::remember(&mut self.memory, &self.seen, self.simulator.batch());
        self.progress.stepped(self.simulator.batch());
        let pace = 1.0 - (1.0 - learning.last_rate) * self.progress.share();
        for _ in 0..learning.updates_per_step {
            let mut sample = self.memory.sample(learning.batch, learning.discount as f32, &mut self.sampling);
            if let Some(mirror) = &self.mirror {
                mirror.turn_half(&mut sample, &mut self.sampling);
            }
            let (update, errors) = self.sac.update(bridge::parts(&sample, scaling, learning, &mut self.sampling), pace);
            if let Some((what, value)) = broken(&update) {
                return Err(self.diverged(what, value));
            }
            self.memory.learned(&sample, &errors);
            self.progress.updated(&update, 1);
        }
        Ok(())
    }

    fn found_scaling(&self) -> Scaling {
        found_scaling(&self.config, self.mirror.as_ref(), self.memory.observations())
    }

    /// The driver as it is.
    pub fn policy(&self) -> Policy {
        Policy {
            benchmark: self.config.benchmark.clone(),
            actions: self.world.actions.clone(),
            scaling: self.scaling.clone().unwrap_or_else(|| self.found_scaling()),
            actor: self.sac.average_actor().clone(),
        }
    }

    /// Writes what a run leaves behind. Everything is tried before the first failure is given.
    pub fn close(&mut self) -> Result<(), Error> {
        self.check()?;
        // The last row belongs to this end alone: a run that goes on takes it back.
        self.keep();
        let kept = self.keeper.wait();
        let row = self.progress.finish(self.sac.entropy_weight());
        kept.map_or(Ok(()), |Kept { checkpoint, policy }| checkpoint.and(policy)).and(row)
    }

    fn keep_now_and_then(&mut self) -> Result<(), Error> {
        if let Some(Kept { checkpoint, policy }) = self.keeper.done() {
            self.progress.note(self.keeper.file(), checkpoint);
            self.progress.note(self.keeper.policy(), policy);
        }
        if self.keeper.is_due() {
            self.check()?;
            self.keep();
        }
        Ok(())
    }

    /// Begins to write a checkpoint and the driver.
    fn keep(&mut self) {
        let mut columns = Columns::default();
        for (column, bytes) in self.simulator.batch().columns() {
            columns.put(batch_name(column.name()), bytes);
        }
        columns.put("acting", &self.acting.state[..]);
        columns.put("sampling", &self.sampling.state[..]);
        if let Some(Scaling { mean, factor }) = &self.scaling {
            columns.put("observation, mean", &mean[..]);
            columns.put("observation, factor", &factor[..]);
        }
        self.progress.save(&mut columns);
        self.sac.save(&mut columns);
        self.memory.save(&mut columns);
        self.keeper.begin(&columns, self.config.to_toml(), self.fingerprint, self.policy().to_bytes());
    }

    /// Goes on from a checkpoint of this run.
    pub fn restore(&mut self, stored: &Stored) -> Result<(), Error> {
        check_world(stored, self.fingerprint, &self.config)?;
        self.simulator.restore(|column| stored.bytes(&batch_name(column.name()))).map_err(|error| stored.error(error.to_string()))?;
        self.acting = Generator { state: stored.array("acting")? };
        self.sampling = Generator { state: stored.array("sampling")? };
        let values = |name: &str| stored.exactly(name, N_VALUES);
        if stored.bytes("observation, mean").is_some() {
            self.scaling = Some(Scaling { mean: values("observation, mean")?, factor: values("observation, factor")? });
        }
        self.memory.restore(stored)?;
        self.sac.restore(stored)?;
        self.progress.restore(stored)
    }

    /// Every number of the learner is one; a checkpoint never holds another.
    fn check(&mut self) -> Result<(), Error> {
        match self.sac.broken() {
            Some((what, value)) => Err(self.diverged(&what, value)),
            None => Ok(()),
        }
    }

    /// The learner has broken down: says where, and what there is to go back to.
    fn diverged(&mut self, what: &str, value: f32) -> Error {
        let also = self.sac.broken().filter(|(name, _)| name != what).map(|(name, _)| format!(", so is {name}")).unwrap_or_default();
        // One on its way was sound when it was begun; that it could not be written is told by what stands in the folder.
        let _ = self.keeper.wait();
        let kept = self.keeper.last_good();
        Error::Diverged { what: what.to_owned(), value, also, env_steps: self.progress.env_steps(), kept }
    }
}

/// How observations are scaled that lie as these do.
fn found_scaling(config: &Config, mirror: Option<&Mirror>, seen: &[[f32; N_VALUES]]) -> Scaling {
    if !config.learning.scale_observations {
        return Scaling::none(N_VALUES);
    }
    // What is learned from lies the same to both sides.
    let images = mirror.iter().flat_map(|mirror| seen.iter().map(|seen| mirror.observation(seen)));
    if mirror.is_none() { Scaling::of(seen) } else { Scaling::of(&seen.iter().copied().chain(images).collect::<Vec<_>>()) }
}

/// A checkpoint goes on in the world it was written in alone.
fn check_world(stored: &Stored, fingerprint: u32, config: &Config) -> Result<(), Error> {
    if stored.world() == fingerprint {
        return Ok(());
    }
    let what = config.practice.as_ref().unwrap_or(&config.benchmark);
    Err(stored.error(format!("was written when {what} was another: put its scenario, vehicle and roundabout files back")))
}

/// A loss that is no number.
fn broken(update: &Update) -> Option<(&'static str, f32)> {
    let losses = [("critic loss", update.critic_loss), ("actor loss", update.actor_loss), ("entropy", update.entropy)];
    losses.into_iter().find(|(_, value)| !value.is_finite())
}

fn batch_name(column: &str) -> String {
    format!("batch, {column}")
}

/// CRC-32 of all that trucks drive by.
fn fingerprint(world: &World) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(bytes_of(&world.params));
    hasher.update(cast_slice(&world.actions));
    hasher.update(cast_slice(&world.rays));
    hasher.update(cast_slice(&world.waypoints));
    hasher.update(cast_slice(&world.previews));
    hasher.update(cast_slice(&world.routes));
    for field in &world.fields {
        hasher.update(cast_slice(&field.cells));
        hasher.update(cast_slice(&field.values));
    }
    hasher.finalize()
}
