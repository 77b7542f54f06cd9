//! A learned policy where the trucks are: on the processor, or on their device by its kernel. Then no observation
//! leaves the device. One that the kernel does not act by, with a memory or values of its own, drives trucks of a device
//! from the processor.

#[cfg(feature = "gpu")]
mod on_device;

use offtrack::layout::{N_EXTRAS, N_VALUES};
use offtrack::simulator::{Batch, Engine};
use offtrack::world::World;
use offtrack_policy::{Choice, Driver, Policy, drawn, greedy, sampled};

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
        Engine::Gpu { device, .. } if policy.is_plain() => {
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

    fn choose(&mut self, _: &World, batch: &Batch, actions: &mut Vec<u32>) {
        let driving = driving(batch);
        let (observations, extras) = observed(batch, &driving);
        let logits = self.logits_beside(&observations, &extras);
        spread(&driving, &greedy(&logits, self.actions.len()), batch, actions);
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

    fn choose(&mut self, _: &World, batch: &Batch, actions: &mut Vec<u32>) {
        if self.driver.n_envs() != batch.n_envs() {
            self.driver = self.driver.policy().clone().driver(batch.n_envs());
        }
        let driving = driving(batch);
        driving.iter().filter(|&&env| batch.truck[env].steps == 0).for_each(|&env| self.driver.begin(env));
        let (observations, extras) = observed(batch, &driving);
        let outputs = self.driver.outputs(&driving, &observations, &extras);
        let n_actions = self.driver.policy().actions.len();
        let chosen = match self.choice {
            Choice::Best => greedy(&outputs, n_actions),
            Choice::Sampled { seed } => {
                let drawn = |index: usize| drawn(seed, driving[index] as u32, &batch.truck[driving[index]]);
                sampled(&outputs, n_actions, drawn)
            }
        };
        spread(&driving, &chosen, batch, actions);
    }
}

/// The trucks that drive: a held truck needs no action, and before the last episode ends most are held.
fn driving(batch: &Batch) -> Vec<usize> {
    (0..batch.n_envs()).filter(|&env| batch.truck[env].held == 0).collect()
}

/// What these trucks observe, and the extras beside it.
fn observed(batch: &Batch, driving: &[usize]) -> (Vec<[f32; N_VALUES]>, Vec<[f32; N_EXTRAS]>) {
    driving.iter().map(|&env| (batch.observation[env], batch.extras[env])).unzip()
}

/// The actions of all trucks: what was chosen for those that drive.
fn spread(driving: &[usize], chosen: &[u32], batch: &Batch, actions: &mut Vec<u32>) {
    actions.clear();
    actions.resize(batch.n_envs(), 0);
    for (&env, &action) in driving.iter().zip(chosen) {
        actions[env] = action;
    }
}

#[cfg(test)]
mod tests;
