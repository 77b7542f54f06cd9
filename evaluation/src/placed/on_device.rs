//! A policy with its numbers on a device.

use offtrack::gpu;
use offtrack::simulator::{self, Batch, Simulator};
use offtrack::world::World;
use offtrack_policy::device::DevicePolicy;
use offtrack_policy::{Choice, Policy};

use crate::controller::Controller;
use crate::error::Error;

/// A policy that acts where the trucks of a device are.
pub(super) struct OnDevice {
    policy: Policy,
    placed: DevicePolicy,
}

impl OnDevice {
    pub(super) fn new(device: &gpu::Device, policy: Policy, world: &World, choice: Choice) -> Result<OnDevice, Error> {
        let placed = DevicePolicy::new(device, &policy, world, choice)?;
        Ok(OnDevice { policy, placed })
    }
}

impl Controller for OnDevice {
    fn name(&self) -> &str {
        &self.policy.name
    }

    fn choose(&mut self, world: &World, batch: &Batch, actions: &mut Vec<u32>) {
        self.policy.choose(world, batch, actions);
    }

    fn step(&mut self, simulator: &mut Simulator) -> Result<(), simulator::Error> {
        match simulator.on_device() {
            Some(batch) => Ok(self.placed.step(batch)?),
            None => self.policy.step(simulator),
        }
    }
}

#[cfg(test)]
mod tests;
