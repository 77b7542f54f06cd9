//! What drives the trucks while they are measured.

use std::sync::Arc;
use std::time::Duration;

use offtrack::simulator::{Engine, RouteChoice, Simulator};
use offtrack::stages::STAGES;
use offtrack::world::World;
use serde::Serialize;

use crate::error::Error;

/// A way to drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub(super) enum Mode {
    /// Actions drawn where the trucks are stepped, each as likely as the next.
    Random,
}

/// Where and how many.
#[derive(Debug, Clone)]
pub(super) struct Setting {
    /// What steps the trucks.
    pub engine: Engine,
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
        }
    }

    /// Trucks that are driven this way.
    pub(super) fn drive(self, setting: Setting) -> Result<Box<dyn Drive>, Error> {
        match self {
            Mode::Random => Ok(Box::new(Random(setting.simulator()?))),
        }
    }
}

impl Setting {
    /// The trucks, about to begin.
    fn simulator(self) -> Result<Simulator, Error> {
        Ok(Simulator::on(self.engine, self.world, self.envs, 0, RouteChoice::Drawn(self.routes))?)
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
