//! What chooses the actions of the trucks while they are measured.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use offtrack::engine::stages::STAGES;
use offtrack::simulator::{Engine, RouteChoice, Simulator};
use offtrack::world::World;
use offtrack_evaluation::placed::placed;
use offtrack_evaluation::policies::Controller;
use offtrack_learner::backend::Backend;
use offtrack_learner::config::Config;
use offtrack_learner::error::Error;
use offtrack_learner::exchange::Actor;
use offtrack_learner::network::Mlp;
use offtrack_learner::rollout::Rollout;
use offtrack_learner::session::Session;
use offtrack_policy::{Choice, Policy};
use serde::Serialize;

use super::Updates;

/// Hidden layers of the study's own learner.
const LARGE: [usize; 3] = [512, 512, 1024];

/// Where the actions come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Mode {
    /// Uniformly random actions, drawn where the trucks are stepped
    Random,
    /// Actions sampled from the distribution of the policy that comes with the program
    Policy,
    /// Actions sampled from the distribution of an untrained network with hidden layers of 512, 512 and 1024
    LargePolicy,
    /// The training loop: every step remembered, and the updates of the training file after it
    Training,
}

/// What modes with a network need.
#[derive(Debug)]
pub(super) struct Learner {
    policy: Policy,
    config: Config,
}

impl Learner {
    /// The policy that comes with the program for `benchmark`, and a training file.
    pub(super) fn read(benchmark: &str, config: &Path, world: &World) -> Result<Learner, Error> {
        let policy = Policy::shipped_for(benchmark, world)?;
        policy.check(world)?;
        Ok(Learner { policy, config: Config::read(config)? })
    }

    /// What a step of the training loop holds beside the trucks' own.
    pub(super) fn updates(&self) -> Updates {
        Updates { updates_per_step: self.config.learning.updates_per_step, batch: self.config.learning.batch }
    }

    /// The network of a mode without updates.
    fn actor(&self, mode: Mode) -> Mlp {
        match mode {
            Mode::LargePolicy => {
                let n_values = self.policy.normalisation.mean.len();
                let sizes = [&[n_values], &LARGE[..], &[self.policy.actions.len()]].concat();
                Mlp::untrained(&sizes, 0)
            }
            _ => Mlp::of_policy(&self.policy),
        }
    }

    /// The training file for so many trucks, with the smallest replay buffer that the mode can do with: a larger one is
    /// no slower, and would keep small adapters from being measured.
    fn config(&self, mode: Mode, envs: usize) -> Config {
        let mut config = Config { n_envs: envs, ..self.config.clone() };
        config.replay_buffer.capacity = match mode {
            Mode::Training => config.replay_buffer.warmup.max(envs * (config.learning.n_steps + 2)),
            _ => envs,
        };
        config
    }
}

/// Where the trucks are, and how many.
pub(super) struct Setting<'a> {
    /// What steps the trucks.
    pub engine: &'a Engine,
    /// Name of the engine's adapter; none of the processor.
    pub adapter: Option<&'a str>,
    /// The engine as a backend of the learner too, once a mode has needed that.
    pub backend: &'a mut Option<Backend>,
    /// The world.
    pub world: &'a Arc<World>,
    /// Routes of the episodes.
    pub routes: &'a [u32],
    /// Number of trucks.
    pub envs: usize,
    /// Steps that are submitted at once where actions are random.
    pub submission: usize,
    /// The learner for modes with a network.
    pub learner: Option<&'a Learner>,
}

/// Trucks that are stepped in a mode.
pub(super) enum Driven {
    /// See [`Mode::Random`].
    Random { simulator: Simulator, submission: usize },
    /// See [`Mode::Policy`] and [`Mode::LargePolicy`].
    Acting { rollout: Box<dyn Rollout>, actor: Actor },
    /// See [`Mode::Policy`], on a device: the policy is a kernel there.
    Placed { simulator: Box<Simulator>, policy: Box<dyn Controller> },
    /// See [`Mode::Training`].
    Training(Box<Session>),
}

impl Driven {
    /// Requests steps of every truck. A device may still be at them afterwards.
    pub(super) fn steps(&mut self, n_steps: u64) -> Result<(), Error> {
        if let Driven::Random { simulator, submission } = self {
            let mut left = n_steps as usize;
            while 0 < left {
                let now = left.min(*submission);
                simulator.steps_at_random(now);
                left -= now;
            }
            return Ok(());
        }
        (0..n_steps).try_for_each(|_| self.step())
    }

    /// Requests one step of every truck.
    fn step(&mut self) -> Result<(), Error> {
        match self {
            Driven::Random { simulator, .. } => simulator.step_at_random(),
            Driven::Acting { rollout, actor } => rollout.drive(actor)?,
            Driven::Placed { simulator, policy } => policy.step(simulator)?,
            Driven::Training(training) => {
                training.act(0)?;
                training.learn(1.0)?;
            }
        }
        Ok(())
    }

    /// Waits until all that was requested is done.
    pub(super) fn wait(&mut self) -> Result<(), Error> {
        match self {
            Driven::Random { simulator, .. } => Ok(simulator.wait()?),
            Driven::Acting { rollout, .. } => rollout.wait(),
            Driven::Placed { simulator, .. } => Ok(simulator.wait()?),
            Driven::Training(training) => training.rollout().wait(),
        }
    }

    /// One step a stage at a time with the time of each; none where a step is more than the stages.
    pub(super) fn step_by_stage(&mut self) -> Result<Option<[Duration; STAGES.len()]>, Error> {
        match self {
            Driven::Random { simulator, .. } => Ok(Some(simulator.step_at_random_by_stage()?)),
            _ => Ok(None),
        }
    }

    /// One step a kernel at a time with the time of each; none on the processor, and where a step is more than that.
    pub(super) fn step_by_kernel(&mut self) -> Result<Vec<(&'static str, Duration)>, Error> {
        match self {
            Driven::Random { simulator, .. } => Ok(simulator.step_at_random_by_kernel()?),
            _ => Ok(Vec::new()),
        }
    }

    /// The trucks.
    pub(super) fn simulator(&self) -> &Simulator {
        match self {
            Driven::Random { simulator, .. } => simulator,
            Driven::Acting { rollout, .. } => rollout.simulator(),
            Driven::Placed { simulator, .. } => simulator,
            Driven::Training(training) => training.rollout().simulator(),
        }
    }
}

impl Mode {
    /// The mode's name on the command line and in results.
    pub(super) fn name(self) -> &'static str {
        match self {
            Mode::Random => "random",
            Mode::Policy => "policy",
            Mode::LargePolicy => "large-policy",
            Mode::Training => "training",
        }
    }

    /// Trucks that are stepped this way, at the start of their first episodes.
    pub(super) fn driven(self, setting: Setting) -> Result<Driven, Error> {
        let Setting { engine, adapter, backend, world, routes, envs, submission, learner } = setting;
        let Some(learner) = learner.filter(|_| self != Mode::Random) else {
            let choice = RouteChoice::Drawn(routes.to_vec());
            let simulator = Simulator::on(engine.clone(), world.clone(), envs, 0, choice)?;
            return Ok(Driven::Random { simulator, submission });
        };
        // A wide network reads its weights too often in the kernel: the tensor library is faster.
        if self == Mode::Policy && !matches!(engine, Engine::Cpu) {
            let policy = placed(learner.policy.clone(), engine, world, Choice::Sampled { seed: 0 })?;
            let choice = RouteChoice::Drawn(routes.to_vec());
            let simulator = Simulator::on(engine.clone(), world.clone(), envs, 0, choice)?;
            return Ok(Driven::Placed { simulator: Box::new(simulator), policy });
        }
        let opened = match backend.take() {
            Some(backend) => backend,
            None if matches!(engine, Engine::Cpu) => Backend::Host,
            None => Backend::on_device(adapter)?,
        };
        let backend = backend.insert(opened);
        let config = learner.config(self, envs);
        if self != Mode::Training {
            let mut rollout = backend.rollout(&config, world, routes.to_vec(), None)?;
            rollout.set_normalisation(&learner.policy.normalisation);
            return Ok(Driven::Acting { rollout, actor: backend.actor(learner.actor(self)) });
        }
        let mut training = Session::new(backend, &config, world.clone(), routes.to_vec())?;
        while training.rollout().n_transitions() < config.replay_buffer.warmup || !training.rollout().can_sample() {
            training.rollout_mut().step_at_random()?;
        }
        training.set_normalisation(learner.policy.normalisation.clone());
        Ok(Driven::Training(Box::new(training)))
    }
}
