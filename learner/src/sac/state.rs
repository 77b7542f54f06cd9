//! The learner into a checkpoint and back: every number that an update moves, by its name.

use burn::tensor::Device;

use super::Sac;
use super::critics::Twins;
use crate::checkpoint::{Columns, Stored};
use crate::columns::{Named, moments, named, network, optimizer};
use crate::error::Error;

/// Name of the column with the numbers of steps that the optimizers made.
const STEPS: &str = "learner, steps";

impl Sac {
    pub(super) fn put(&self, columns: &mut Columns) {
        for (name, values) in self.numbers() {
            columns.put(name, values);
        }
        let [actor, critics] =
            [&self.actor_optimizer, &self.critic_optimizer].map(|optimizer| optimizer.state().n_steps);
        columns.put("learner, updates", vec![self.n_updates, self.n_summed]);
        columns.put(STEPS, [actor, critics, self.entropy_coefficient.n_updates].map(|steps| steps as u32).to_vec());
        columns.put("learner, sums", self.sums.to_vec());
    }

    pub(super) fn take(&mut self, stored: &Stored) -> Result<(), Error> {
        let device = Device::flex();
        let twins = |names: [&str; 2], like: &Twins| -> Result<Twins, Error> {
            Ok(Twins {
                first: network(stored, names[0], &like.first, &device)?,
                second: network(stored, names[1], &like.second, &device)?,
            })
        };
        let actor = network(stored, "actor", &self.actor, &device)?;
        let actor_ema = network(stored, "actor EMA", &self.actor_ema, &device)?;
        let critics = twins(["critic 1", "critic 2"], &self.critics)?;
        let target_critics = twins(["target 1", "target 2"], &self.target_critics)?;

        let [actor_steps, critic_steps, entropy_steps] = stored.array::<u32, 3>(STEPS)?;
        let actor_state = optimizer(stored, STEPS, actor_steps, &named("actor", &actor))?;
        let critic_state = optimizer(stored, STEPS, critic_steps, &critics_named(&critics))?;
        let [log, first, second] = stored.array::<f32, 3>("entropy coefficient")?;
        let [n_updates, n_summed] = stored.array("learner, updates")?;
        let sums = stored.array::<f32, 4>("learner, sums")?;

        (self.actor, self.actor_ema, self.critics, self.target_critics) = (actor, actor_ema, critics, target_critics);
        self.actor_optimizer.restore(actor_state);
        self.critic_optimizer.restore(critic_state);
        (self.n_updates, self.n_summed, self.sums) = (n_updates, n_summed, sums);
        let coefficient = &mut self.entropy_coefficient;
        (coefficient.log, coefficient.moments, coefficient.n_updates) = (log, [first, second], entropy_steps as i32);
        Ok(())
    }

    pub(super) fn numbers(&self) -> Named {
        let networks = [named("actor", &self.actor), critics_named(&self.critics)];
        let states = [&self.actor_optimizer, &self.critic_optimizer].map(|optimizer| optimizer.state());
        let moments: Vec<_> =
            states.into_iter().zip(&networks).flat_map(|(state, parameters)| moments(parameters, state)).collect();
        let [first, second] = &self.entropy_coefficient.moments;
        let entropy = vec![self.entropy_coefficient.log, *first, *second];
        let followers = [
            ("target 1", &self.target_critics.first),
            ("target 2", &self.target_critics.second),
            ("actor EMA", &self.actor_ema),
        ];
        let followers = followers.into_iter().flat_map(|(name, network)| named(name, network));
        let entropy = ("entropy coefficient".to_owned(), entropy);
        networks.into_iter().flatten().chain(moments).chain([entropy]).chain(followers).collect()
    }
}

fn critics_named(critics: &Twins) -> Named {
    [named("critic 1", &critics.first), named("critic 2", &critics.second)].concat()
}
