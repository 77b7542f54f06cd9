//! What drives the trucks while they are measured.

use std::cell::Cell;
use std::sync::Arc;
use std::time::Duration;

use offtrack::layout::N_VALUES;
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::stages::STAGES;
use offtrack::world::World;
use rand::SeedableRng;
use rand::rngs::SmallRng;
use serde::Serialize;
use tempfile::TempDir;

use crate::config::Config;
use crate::device::Device;
use crate::error::Error;
use crate::files;
use crate::network::Mlp;
use crate::policy::Policy;
use crate::scaling::Scaling;
use crate::train::folder::Folder;
use crate::train::{Job, Place, progress_of};

/// Sizes of the hidden layers of the study's networks.
const STUDY: [usize; 3] = [512, 512, 1024];

/// A way to drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub(super) enum Mode {
    /// Actions drawn where the trucks are stepped, each as likely as the next.
    Random,
    /// The policy that comes with the program chooses each action; on a device its network runs there too.
    Policy,
    /// The same with a network of the study's size, 512, 512 and 1024, that knows nothing.
    Study,
    /// Training as the training file of the engine says, gpu.toml or default.toml, with this many trucks: acting, stepping, remembering, and
    /// its number of updates a step.
    Training,
}

/// Where and how many.
#[derive(Debug, Clone)]
pub(super) struct Setting {
    /// What steps the trucks.
    pub device: Device,
    /// The benchmark's name.
    pub benchmark: String,
    /// Where they drive.
    pub world: Arc<World>,
    /// Routes that their episodes run on.
    pub routes: Vec<u32>,
    /// How many there are.
    pub envs: usize,
}

/// Trucks that are driven one step after the other.
pub(super) trait Drive {
    /// Asks for one step of every truck. A device may still be at it afterwards.
    fn step(&mut self) -> Result<(), Error>;

    /// Asks for so many steps.
    fn steps(&mut self, n_steps: u64) -> Result<(), Error> {
        (0..n_steps).try_for_each(|_| self.step())
    }

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
            Mode::Study => "study",
            Mode::Training => "training",
        }
    }

    /// Trucks that are driven this way.
    pub(super) fn drive(self, setting: Setting) -> Result<Box<dyn Drive>, Error> {
        match self {
            Mode::Random => Ok(Box::new(Random(setting.simulator()?))),
            Mode::Policy => {
                let file = files::shipped_policy(&setting.benchmark);
                let policy = Policy::load(&file)?;
                policy.check(&setting.world, &file)?;
                setting.driven_by(policy)
            }
            Mode::Study => {
                let sizes = [&[N_VALUES], &STUDY[..], &[setting.world.actions.len()]].concat();
                let policy = Policy {
                    benchmark: setting.benchmark.clone(),
                    actions: setting.world.actions.clone(),
                    scaling: Scaling::none(N_VALUES),
                    actor: Mlp::new(&sizes, 0.01, &mut SmallRng::seed_from_u64(0), &burn::tensor::Device::flex()),
                };
                setting.driven_by(policy)
            }
            Mode::Training => Ok(Box::new(Training::new(setting)?)),
        }
    }
}

impl Setting {
    /// The trucks, about to begin.
    fn simulator(self) -> Result<Simulator, Error> {
        Ok(Simulator::on(self.device.engine, self.world, self.envs, 0, RouteChoice::Drawn(self.routes))?)
    }

    /// The trucks with a policy at the wheel: where they are, if that can be.
    fn driven_by(self, policy: Policy) -> Result<Box<dyn Drive>, Error> {
        #[cfg(feature = "gpu")]
        if self.device.kind == "gpu" {
            return Ok(Box::new(OnDevice::new(self, &policy)?));
        }
        Ok(Box::new(Driven { simulator: self.simulator()?, policy }))
    }

    /// The training file of the engine with this number of trucks, warmed up as soon as can be.
    fn config(&self) -> Result<Config, Error> {
        let name = if self.device.kind == "gpu" { "gpu" } else { "default" };
        let mut config = Config::read(&files::repository().join("training/configs").join(name).with_extension("toml"))?;
        (config.n_envs, config.memory.warmup) = (self.envs, self.envs);
        config.memory.capacity = config.memory.capacity.max((config.learning.n_steps + 2) * self.envs);
        // Rows and checkpoints are none of what is measured.
        (config.minutes, config.steps, config.checkpoint_minutes) = (None, Some(1_000_000_000_000), 100_000.0);
        config.learning.scale_observations = false;
        Ok(config)
    }
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

/// See [`Mode::Policy`]: the network runs on the processor.
struct Driven {
    simulator: Simulator,
    policy: Policy,
}

impl Drive for Driven {
    fn step(&mut self) -> Result<(), Error> {
        let actions = self.policy.act(&self.simulator.batch().observation);
        Ok(self.simulator.step(&actions)?)
    }

    fn simulator(&self) -> &Simulator {
        &self.simulator
    }
}

/// See [`Mode::Policy`]: trucks and network are on one device, actions drawn from what the network gives.
#[cfg(feature = "gpu")]
struct OnDevice {
    memory: crate::bridge::device::DeviceMemory,
    actor: Mlp,
}

#[cfg(feature = "gpu")]
impl OnDevice {
    fn new(setting: Setting, policy: &Policy) -> Result<OnDevice, Error> {
        let mut config = setting.config()?;
        // Nothing is kept: one step of every truck is the least there can be room for.
        config.memory.capacity = setting.envs;
        let shared = setting.device.shared()?;
        let mut memory = crate::bridge::device::DeviceMemory::new(&shared, &config, &setting.world, setting.routes, [1, 2])?;
        memory.set_scaling(&policy.scaling);
        let parameters = policy.actor.parameters().into_iter().map(|(_, values)| values).collect();
        Ok(OnDevice { actor: policy.actor.with_parameters(parameters, &shared.tensors), memory })
    }
}

#[cfg(feature = "gpu")]
impl Drive for OnDevice {
    fn step(&mut self) -> Result<(), Error> {
        self.memory.drive_by(&self.actor)
    }

    fn simulator(&self) -> &Simulator {
        self.memory.simulator()
    }
}

/// See [`Mode::Training`].
struct Training {
    job: Job,
    _folder: TempDir,
}

impl Training {
    fn new(setting: Setting) -> Result<Training, Error> {
        let config = setting.config()?;
        let place = Place::on(&setting.device)?;
        let place_for = std::env::temp_dir();
        let held = TempDir::new().map_err(Error::write(&place_for))?;
        let folder = Folder::create(held.path(), Some("scale"), &place_for, &config)?;
        let progress = progress_of(&config, &folder)?;
        Ok(Training { job: Job::new(place, &config, setting.routes, setting.world, &folder, progress)?, _folder: held })
    }
}

impl Drive for Training {
    fn step(&mut self) -> Result<(), Error> {
        self.steps(1)
    }

    fn steps(&mut self, n_steps: u64) -> Result<(), Error> {
        let left = Cell::new(n_steps + 1);
        self.job.learn(|| {
            left.set(left.get() - 1);
            left.get() == 0
        })
    }

    fn simulator(&self) -> &Simulator {
        self.job.simulator()
    }
}
