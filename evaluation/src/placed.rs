//! A learned policy where the trucks are: on the processor, or on their device by its kernel. Then no observation
//! leaves the device. One that the kernel does not act by, with a memory or commands, drives trucks of a device from
//! the processor.

#[cfg(feature = "gpu")]
mod on_device;

use offtrack::layout::{Command, N_AROUND, N_EXTRAS, N_VALUES};
use offtrack::simulator::{Actions, Batch, Engine};
use offtrack::world::World;
use offtrack_policy::{Choice, Driver, Head, Policy, drawn, greedy, sampled};

use crate::controller::Controller;
use crate::error::Error;

/// The policy as it drives trucks of `world` on `engine`.
///
/// # Errors
///
/// A policy that cannot drive in `world` or on the engine's device.
pub fn placed(policy: Policy, engine: &Engine, world: &World, choice: Choice) -> Result<Box<dyn Controller>, Error> {
    match engine {
        #[cfg(feature = "gpu")]
        Engine::Gpu { device, .. } if policy.acts_on_device() => {
            let placed = on_device::DevicePolicy::new(device, &policy, world, choice)?;
            Ok(Box::new(on_device::OnDevice { placed, host: Box::new(OnHost::new(policy, choice)) }))
        }
        _ => {
            policy.check(world)?;
            Ok(Box::new(OnHost::new(policy, choice)))
        }
    }
}

/// A policy without a memory.
impl Controller for Policy {
    fn name(&self) -> &str {
        &self.name
    }

    fn choose(&mut self, _: &World, batch: &Batch) -> Actions {
        let driving = driving(batch);
        let (observations, extras, around) = observed(self, batch, &driving);
        let outputs = self.logits_among(&observations, &extras, &around);
        best(self, outputs).spread(&driving, batch.n_envs())
    }
}

/// Any policy on the processor.
struct OnHost {
    driver: Driver,
    choice: Choice,
}

impl OnHost {
    fn new(policy: Policy, choice: Choice) -> OnHost {
        // The batch's size is known once trucks are there.
        OnHost { driver: policy.driver(0), choice }
    }
}

impl Controller for OnHost {
    fn name(&self) -> &str {
        &self.driver.policy().name
    }

    fn choose(&mut self, _: &World, batch: &Batch) -> Actions {
        if self.driver.n_envs() != batch.n_envs() {
            self.driver = self.driver.policy().clone().driver(batch.n_envs());
        }
        let driving = driving(batch);
        driving.iter().filter(|&&env| batch.truck[env].steps == 0).for_each(|&env| self.driver.begin(env));
        let (observations, extras, around) = observed(self.driver.policy(), batch, &driving);
        let outputs = self.driver.outputs_among(&driving, &observations, &extras, &around);
        let policy = self.driver.policy();
        let chosen = match (self.choice, policy.head) {
            (Choice::Sampled { seed }, Head::Levels) => {
                let drawn = |index: usize| drawn(seed, driving[index] as u32, &batch.truck[driving[index]]);
                Actions::Indices(sampled(&outputs, policy.actions.len(), drawn))
            }
            // A file has the means of commands alone.
            _ => best(policy, outputs),
        };
        chosen.spread(&driving, batch.n_envs())
    }
}

/// The trucks that drive: a held truck needs no action, and before the last episode ends most are held.
fn driving(batch: &Batch) -> Vec<usize> {
    (0..batch.n_envs()).filter(|&env| batch.truck[env].held == 0).collect()
}

/// Observations of some trucks, the extras beside them, and other vehicles.
type Observed = (Vec<[f32; N_VALUES]>, Vec<[f32; N_EXTRAS]>, Vec<[f32; N_AROUND]>);

/// What these trucks observe, as far as a policy reads it.
fn observed(policy: &Policy, batch: &Batch, driving: &[usize]) -> Observed {
    let (observations, extras) = driving.iter().map(|&env| (batch.observation[env], batch.extras[env])).unzip();
    let seeing = if policy.reads_vehicles() { driving } else { &[] };
    (observations, extras, seeing.iter().map(|&env| batch.around[env]).collect())
}

/// The best actions by a policy's outputs: the indices of the largest, or the commands.
fn best(policy: &Policy, outputs: Vec<f32>) -> Actions {
    match policy.head {
        Head::Levels => Actions::Indices(greedy(&outputs, policy.actions.len())),
        Head::Continuous { .. } => {
            let commands = policy.head.commands(outputs);
            // Of one speed there is no second value.
            let command = |row: &[f32]| Command { steering: row[0], speed: row.get(1).copied().unwrap_or_default() };
            Actions::Commands(commands.chunks_exact(policy.n_outputs()).map(command).collect())
        }
    }
}

#[cfg(test)]
mod tests;
