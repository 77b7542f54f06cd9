//! Networks on the device that steps the trucks: a policy in the loop, and a training run. Nothing comes back to the host.
//!
//! Of a policy that only drives nothing is kept, though there is room for one step, 560 bytes a truck beside its columns.

use offtrack::layout::N_VALUES;
use offtrack::simulator::Simulator;

use super::{Drive, Learner, Mode, Setting, Shared};
use offtrack_training::error::Error;
use offtrack_training::learner::bridge::device::DeviceMemory;
use offtrack_training::learner::network::Mlp;
use offtrack_training::learner::sac::Sac;
use offtrack_training::learner::sac::device::DeviceSac;

/// Trucks that a network drives.
pub(super) fn drive(mode: Mode, setting: Setting, learner: &Learner) -> Result<Box<dyn Drive>, Error> {
    let shared = match setting.shared.take() {
        Some(shared) => shared,
        None => Shared::open(Some(setting.adapter))?,
    };
    let shared = setting.shared.insert(shared).clone();
    let mut config = learner.config(setting.envs);
    if mode != Mode::Training {
        config.memory.capacity = setting.envs;
        config.learning.mirror = false;
    }
    let mut memory = DeviceMemory::new(&shared, &config, setting.world, setting.routes.to_vec(), [1, 2])?;
    memory.set_scaling(&learner.policy.scaling);
    if mode != Mode::Training {
        let actor = learner.actor(mode);
        return Ok(Box::new(Acting { actor: actor.on(&shared.tensors), memory, shared }));
    }
    while memory.len() < config.memory.warmup || !memory.can_sample() {
        memory.step_at_random()?;
    }
    let sac = Sac::new(&config.learning, N_VALUES, setting.world.actions.len(), 0)?;
    let sac = DeviceSac::new(&sac, &shared.tensors);
    Ok(Box::new(Learning { updates_per_step: config.learning.updates_per_step, memory, sac, shared }))
}

/// Waits for both, the trucks and the networks.
fn wait(shared: &Shared) -> Result<(), Error> {
    // What the tensor library has gathered is handed over first, or it would not be waited for.
    shared.tensors.flush().map_err(|error| Error::Device(error.to_string()))?;
    Ok(shared.gpu.wait().map_err(offtrack::simulator::Error::from)?)
}

/// A network drives.
struct Acting {
    shared: Shared,
    actor: Mlp,
    memory: DeviceMemory,
}

impl Drive for Acting {
    fn step(&mut self) -> Result<(), Error> {
        self.memory.drive_by(&self.actor)
    }

    fn wait(&mut self) -> Result<(), Error> {
        wait(&self.shared)
    }

    fn simulator(&self) -> &Simulator {
        self.memory.simulator()
    }
}

/// A network drives and learns.
struct Learning {
    shared: Shared,
    updates_per_step: usize,
    memory: DeviceMemory,
    sac: DeviceSac,
}

impl Drive for Learning {
    fn step(&mut self) -> Result<(), Error> {
        self.memory.step_by(&self.sac.actor())?;
        for _ in 0..self.updates_per_step {
            self.sac.update(self.memory.sample()?, 1.0);
        }
        Ok(())
    }

    fn wait(&mut self) -> Result<(), Error> {
        wait(&self.shared)
    }

    fn simulator(&self) -> &Simulator {
        self.memory.simulator()
    }
}
