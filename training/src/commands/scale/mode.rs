//! What drives the trucks while they are measured.

#[cfg(feature = "gpu")]
mod device;
mod host;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use offtrack::layout::N_VALUES;
use offtrack::simulator::{Engine, RouteChoice, Simulator};
use offtrack::stages::STAGES;
use offtrack::world::World;
use rand::SeedableRng;
use rand::rngs::SmallRng;
use serde::Serialize;

use super::Updates;
use offtrack_training::error::Error;
use offtrack_training::files;
use offtrack_training::learner::config::Config;
use offtrack_training::learner::network::Mlp;
use offtrack_training::policy::LearnedPolicy;

/// Hidden layers of the study's own learner.
const LARGE: [usize; 3] = [512, 512, 1024];

/// A device with the learner's tensors on it; a program without the feature has none.
#[cfg(feature = "gpu")]
pub(super) type Shared = offtrack_training::learner::bridge::device::Shared;
#[cfg(not(feature = "gpu"))]
pub(super) type Shared = std::convert::Infallible;

/// A way to drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Mode {
    /// Actions drawn where the trucks are stepped, each as likely as the next
    Random,
    /// Actions drawn from what the policy that comes with the program gives for each observation
    Policy,
    /// The same by an untrained network with hidden layers of 512, 512 and 1024
    LargePolicy,
    /// A training run under way: every step kept, and the updates of the training file after it
    Training,
}

/// What those modes need that more than chance drives.
#[derive(Debug)]
pub(super) struct Learner {
    policy: LearnedPolicy,
    config: Config,
}

impl Learner {
    /// The policy that comes with the program for `benchmark`, and a training file.
    pub(super) fn read(benchmark: &str, config: &Path, world: &World) -> Result<Learner, Error> {
        let policy = LearnedPolicy::shipped_or_default(benchmark)?;
        policy.check(world)?;
        Ok(Learner { policy, config: Config::read(config)? })
    }

    /// What a step of a training run holds beside the trucks' own.
    pub(super) fn updates(&self) -> Updates {
        Updates { updates_per_step: self.config.learning.updates_per_step, batch: self.config.learning.batch }
    }

    /// The network that drives where nothing is learned.
    fn actor(&self, mode: Mode) -> Mlp {
        match mode {
            Mode::LargePolicy => {
                let sizes = [&[N_VALUES], &LARGE[..], &[self.policy.actions.len()]].concat();
                Mlp::new(&sizes, 1.0, &mut SmallRng::seed_from_u64(0), &burn::tensor::Device::flex())
            }
            _ => self.policy.actor.clone(),
        }
    }

    /// The training file for so many trucks. The memory has room for what comes before the first update and for the steps that an update
    /// needs of each truck: a larger one is no slower, and would keep small adapters from being measured.
    fn config(&self, envs: usize) -> Config {
        let mut config = Config { n_envs: envs, ..self.config.clone() };
        config.memory.capacity = config.memory.warmup.max(envs * (config.learning.n_steps + 2));
        config
    }
}

/// Where and how many.
pub(super) struct Setting<'a> {
    /// What steps the trucks.
    pub engine: &'a Engine,
    /// Name of its adapter.
    #[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "the processor needs none"))]
    pub adapter: &'a str,
    /// The same with tensors on it, once someone has needed that.
    #[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "the processor needs none"))]
    pub shared: &'a mut Option<Shared>,
    /// Where they drive.
    pub world: &'a Arc<World>,
    /// Routes that their episodes run on.
    pub routes: &'a [u32],
    /// How many there are.
    pub envs: usize,
    /// For modes in which more than chance drives.
    pub learner: Option<&'a Learner>,
}

/// Trucks that are driven one step after the other.
pub(super) trait Drive {
    /// Asks for one step of every truck. A device may still be at it afterwards.
    fn step(&mut self) -> Result<(), Error>;

    /// Waits until all that was asked for is done.
    fn wait(&mut self) -> Result<(), Error> {
        Ok(self.simulator().wait()?)
    }

    /// One step a stage at a time with the time of each; none where a step is more than the stages.
    fn step_by_stage(&mut self) -> Result<Option<[Duration; STAGES.len()]>, Error> {
        Ok(None)
    }

    /// The trucks.
    fn simulator(&self) -> &Simulator;
}

impl Mode {
    /// Its name on the command line and in results.
    pub(super) fn name(self) -> &'static str {
        match self {
            Mode::Random => "random",
            Mode::Policy => "policy",
            Mode::LargePolicy => "large-policy",
            Mode::Training => "training",
        }
    }

    /// Trucks that are driven this way.
    pub(super) fn drive(self, setting: Setting) -> Result<Box<dyn Drive>, Error> {
        let Some(learner) = setting.learner.filter(|_| self != Mode::Random) else {
            return Ok(Box::new(Random(setting.simulator()?)));
        };
        #[cfg(feature = "gpu")]
        if matches!(setting.engine, Engine::Gpu { .. }) {
            return device::drive(self, setting, learner);
        }
        host::drive(self, &setting, learner)
    }
}

impl Setting<'_> {
    /// The trucks, about to begin.
    fn simulator(&self) -> Result<Simulator, Error> {
        let choice = RouteChoice::Drawn(self.routes.to_vec());
        Ok(Simulator::on(self.engine.clone(), self.world.clone(), self.envs, 0, choice)?)
    }
}

/// The training file that is measured where none is named.
pub(super) fn default_config() -> PathBuf {
    let here = PathBuf::from("training/configs/gpu.toml");
    if here.is_file() { here } else { files::repository().join(here) }
}

/// See [`Mode::Random`].
struct Random(Simulator);

impl Drive for Random {
    fn step(&mut self) -> Result<(), Error> {
        self.0.step_at_random();
        Ok(())
    }

    fn step_by_stage(&mut self) -> Result<Option<[Duration; STAGES.len()]>, Error> {
        Ok(Some(self.0.step_at_random_by_stage()?))
    }

    fn simulator(&self) -> &Simulator {
        &self.0
    }
}
