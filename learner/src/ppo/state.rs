//! The learner into a checkpoint and back: every number that an update moves, by its name.

use burn::tensor::Device;

use super::Ppo;
use crate::checkpoint::{Columns, Stored};
use crate::columns::{Named, first_broken, moments, named, network, optimizer};
use crate::error::Error;
use crate::generator::Generator;
use crate::sac::Update;

/// Names of its columns in a checkpoint.
const ACTOR: &str = "refined actor";
const ACTOR_EMA: &str = "refined actor EMA";
const CRITIC: &str = "value network";
const COUNTS: &str = "refinement, counts";
const STEPS: &str = "refinement, steps";
const SUMS: &str = "refinement, sums";
const SHUFFLING: &str = "refinement, shuffling";

impl Ppo {
    /// Whether a checkpoint was written after a refinement had begun.
    pub fn is_in(stored: &Stored) -> bool {
        stored.bytes(COUNTS).is_some()
    }

    /// Adds the learner's columns.
    pub fn save(&self, columns: &mut Columns) {
        for (name, values) in self.numbers() {
            columns.put(name, values);
        }
        let Update { critic_loss, actor_loss, entropy, value } = self.sums;
        columns.put(SUMS, vec![critic_loss, actor_loss, entropy, value]);
        columns.put(COUNTS, vec![self.n_iterations, self.n_summed]);
        let steps = [&self.actor_optimizer, &self.critic_optimizer].map(|optimizer| optimizer.state().n_steps as u32);
        columns.put(STEPS, steps.to_vec());
        columns.put(SHUFFLING, self.shuffling.state.to_vec());
    }

    /// Continues from a learner of the same sizes.
    pub fn restore(&mut self, stored: &Stored) -> Result<(), Error> {
        let device = Device::flex();
        let [actor, actor_ema] = [(ACTOR, &self.actor), (ACTOR_EMA, &self.actor_ema)]
            .map(|(name, like)| network(stored, name, like, &device));
        let (actor, actor_ema, critic) = (actor?, actor_ema?, network(stored, CRITIC, &self.critic, &device)?);
        let [actor_steps, critic_steps] = stored.array::<u32, 2>(STEPS)?;
        let actor_state = optimizer(stored, STEPS, actor_steps, &named(ACTOR, &actor))?;
        let critic_state = optimizer(stored, STEPS, critic_steps, &named(CRITIC, &critic))?;
        let [n_iterations, n_summed] = stored.array(COUNTS)?;
        let [critic_loss, actor_loss, entropy, value] = stored.array::<f32, 4>(SUMS)?;
        self.shuffling = Generator::stored(stored, SHUFFLING)?;
        (self.actor, self.actor_ema, self.critic) = (actor, actor_ema, critic);
        self.actor_optimizer.restore(actor_state);
        self.critic_optimizer.restore(critic_state);
        (self.n_iterations, self.n_summed) = (n_iterations, n_summed);
        self.sums = Update { critic_loss, actor_loss, entropy, value };
        Ok(())
    }

    /// The first of the learner's numbers that is not finite: its name and value.
    pub fn broken(&self) -> Option<(String, f32)> {
        first_broken(self.numbers())
    }

    fn numbers(&self) -> Named {
        let networks = [named(ACTOR, &self.actor), named(CRITIC, &self.critic)];
        let states = [&self.actor_optimizer, &self.critic_optimizer].map(|optimizer| optimizer.state());
        let moments: Vec<_> =
            states.into_iter().zip(&networks).flat_map(|(state, parameters)| moments(parameters, state)).collect();
        networks.into_iter().flatten().chain(moments).chain(named(ACTOR_EMA, &self.actor_ema)).collect()
    }
}
