//! Networks on the processor: a policy in the loop, and a training run.

use offtrack::layout::N_VALUES;
use offtrack::simulator::Simulator;
use rand::SeedableRng;
use rand::rngs::SmallRng;

use super::{Drive, Learner, Mode, Setting};
use offtrack_training::error::Error;
use offtrack_training::learner::bridge;
use offtrack_training::learner::config::Config;
use offtrack_training::learner::mirror::Mirror;
use offtrack_training::learner::network::Mlp;
use offtrack_training::learner::normalisation::Scaling;
use offtrack_training::learner::replay_buffer::Memory;
use offtrack_training::learner::sac::Sac;
use offtrack_training::policy;

/// Trucks that a network drives.
pub(super) fn drive(mode: Mode, setting: &Setting, learner: &Learner) -> Result<Box<dyn Drive>, Error> {
    let scaling = learner.policy.scaling.clone();
    let rng = SmallRng::seed_from_u64(0);
    let mut simulator = setting.simulator()?;
    if mode != Mode::Training {
        return Ok(Box::new(Acting { simulator, actor: learner.actor(mode), scaling, rng }));
    }
    let config = learner.config(setting.envs);
    let mut memory = Memory::new(setting.envs, config.learning.n_steps, &config.memory);
    while memory.len() < config.memory.warmup || !memory.can_sample() {
        let seen = simulator.batch().observation.clone();
        simulator.step_at_random();
        bridge::remember(&mut memory, &seen, simulator.batch());
    }
    let sac = Sac::new(&config.learning, N_VALUES, setting.world.actions.len(), 0)?;
    let mirror = config.learning.mirror.then(|| Mirror::of(setting.world)).transpose()?;
    Ok(Box::new(Learning { acting: Acting { simulator, actor: sac.actor(), scaling, rng }, config, memory, mirror, sac }))
}

/// A network drives.
struct Acting {
    simulator: Simulator,
    actor: Mlp,
    scaling: Scaling,
    rng: SmallRng,
}

impl Drive for Acting {
    fn step(&mut self) -> Result<(), Error> {
        let logits = bridge::logits(&self.actor, &self.scaling, &self.simulator.batch().observation);
        let n_actions = self.simulator.world().actions.len();
        Ok(self.simulator.step(&policy::drawn(&logits, n_actions, &mut self.rng))?)
    }

    fn simulator(&self) -> &Simulator {
        &self.simulator
    }
}

/// A network drives and learns.
struct Learning {
    acting: Acting,
    config: Config,
    memory: Memory<N_VALUES>,
    mirror: Option<Mirror>,
    sac: Sac,
}

impl Drive for Learning {
    fn step(&mut self) -> Result<(), Error> {
        let learning = &self.config.learning;
        let seen = self.acting.simulator.batch().observation.clone();
        self.acting.actor = self.sac.actor();
        self.acting.step()?;
        bridge::remember(&mut self.memory, &seen, self.acting.simulator.batch());
        for _ in 0..learning.updates_per_step {
            let mut sample = self.memory.sample(learning.batch, learning.discount as f32, &mut self.acting.rng);
            if let Some(mirror) = &self.mirror {
                mirror.turn_half(&mut sample, &mut self.acting.rng);
            }
            let (_, errors) = self.sac.update(bridge::parts(&sample, &self.acting.scaling, learning, &mut self.acting.rng), 1.0);
            self.memory.learned(&sample, &errors);
        }
        Ok(())
    }

    fn simulator(&self) -> &Simulator {
        &self.acting.simulator
    }
}
