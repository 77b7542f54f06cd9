//! A learned policy where the trucks are: on the processor, or on their device by its kernel. Then no observation
//! leaves the device.

#[cfg(feature = "gpu")]
mod on_device;

use offtrack::simulator::{Batch, Engine};
use offtrack::world::World;
use offtrack_policy::{Choice, Policy, drawn, greedy, sampled};

use crate::controller::Controller;
use crate::error::Error;

/// The policy as it drives trucks of `world` on `engine`.
///
/// # Errors
///
/// A policy that cannot drive in `world` or on the engine's device.
pub fn placed(policy: Policy, engine: &Engine, world: &World, choice: Choice) -> Result<Box<dyn Controller>, Error> {
    match engine {
        Engine::Cpu => {
            policy.check(world)?;
            Ok(on_host(policy, choice))
        }
        #[cfg(feature = "gpu")]
        Engine::Gpu { device, .. } => {
            let placed = on_device::DevicePolicy::new(device, &policy, world, choice)?;
            Ok(Box::new(on_device::OnDevice { placed, host: on_host(policy, choice) }))
        }
    }
}

/// The policy on the processor.
fn on_host(policy: Policy, choice: Choice) -> Box<dyn Controller> {
    match choice {
        Choice::Best => Box::new(policy),
        Choice::Sampled { seed } => Box::new(Sampling { policy, seed }),
    }
}

impl Controller for Policy {
    fn name(&self) -> &str {
        &self.name
    }

    fn choose(&mut self, _: &World, batch: &Batch, actions: &mut Vec<u32>) {
        choose(self, batch, actions, |_, logits| greedy(logits, self.actions.len()));
    }
}

/// A policy that samples its actions from their distribution.
struct Sampling {
    policy: Policy,
    seed: u32,
}

impl Controller for Sampling {
    fn name(&self) -> &str {
        &self.policy.name
    }

    fn choose(&mut self, _: &World, batch: &Batch, actions: &mut Vec<u32>) {
        choose(&self.policy, batch, actions, |driving, logits| {
            let drawn = |index: usize| drawn(self.seed, driving[index] as u32, &batch.truck[driving[index]]);
            sampled(logits, self.policy.actions.len(), drawn)
        });
    }
}

/// Chooses from the outputs for the trucks that drive: a held truck needs no action, and before the last episode ends
/// most are held.
fn choose(policy: &Policy, batch: &Batch, actions: &mut Vec<u32>, of: impl Fn(&[usize], &[f32]) -> Vec<u32>) {
    let driving: Vec<usize> = (0..batch.truck.len()).filter(|&env| batch.truck[env].held == 0).collect();
    let observations: Vec<_> = driving.iter().map(|&env| batch.observation[env]).collect();
    let extras: Vec<_> = driving.iter().map(|&env| batch.extras[env]).collect();
    let chosen = of(&driving, &policy.logits_beside(&observations, &extras));
    actions.clear();
    actions.resize(batch.truck.len(), 0);
    for (env, action) in driving.into_iter().zip(chosen) {
        actions[env] = action;
    }
}
