//! A policy with its numbers on a device.

use offtrack::simulator::{Actions, Batch, Error, Simulator};
use offtrack::world::World;
pub(super) use offtrack_policy::device::DevicePolicy;

use crate::controller::Controller;

/// A policy that acts where the trucks of a device are.
pub(super) struct OnDevice {
    pub(super) placed: DevicePolicy,
    /// The same policy for trucks on the processor.
    pub(super) host: Box<dyn Controller>,
}

impl Controller for OnDevice {
    fn name(&self) -> &str {
        self.host.name()
    }

    fn choose(&mut self, world: &World, batch: &Batch) -> Actions {
        self.host.choose(world, batch)
    }

    fn step(&mut self, simulator: &mut Simulator) -> Result<(), Error> {
        match simulator.on_device() {
            Some(batch) => Ok(self.placed.step(batch)?),
            None => self.host.step(simulator),
        }
    }
}

#[cfg(test)]
mod tests;
