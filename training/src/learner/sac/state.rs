//! The learner into a checkpoint and back: every number that an update moves, by its name.

use burn::tensor::Device;

use super::Sac;
use super::adam::Adam;
use super::critics::Twins;
use crate::error::Error;
use crate::learner::checkpoint::{Columns, Stored};
use crate::learner::network::Mlp;

impl Sac {
    /// Adds the learner's columns.
    pub fn save(&self, columns: &mut Columns) {
        for (name, values) in self.numbers() {
            columns.put(name, values);
        }
        let steps = [self.actor_optimizer.n_steps, self.critic_optimizer.n_steps, self.entropy_weight.updates];
        columns.put("learner, updates", vec![self.updates]);
        columns.put("learner, steps", steps.map(|steps| steps as u32).to_vec());
    }

    /// Goes on from a learner of the same sizes.
    pub fn restore(&mut self, stored: &Stored) -> Result<(), Error> {
        let network = |name: &str, like: &Mlp, device: &Device| -> Result<Mlp, Error> {
            let parameters: Result<_, Error> =
                like.parameters().iter().map(|(part, values)| stored.exactly(&format!("{name}, {part}"), values.len())).collect();
            Ok(like.with_parameters(parameters?, device))
        };
        let (plain, learning) = (Device::flex(), Device::flex().autodiff());
        let twins = |names: [&str; 2], like: &Twins, device: &Device| -> Result<Twins, Error> {
            Ok(Twins { first: network(names[0], &like.first, device)?, second: network(names[1], &like.second, device)? })
        };
        let actor = network("actor", &self.actor, &learning)?;
        let average = network("average actor", &self.average, &plain)?;
        let critics = twins(["critic 1", "critic 2"], &self.critics, &learning)?;
        let target = twins(["target 1", "target 2"], &self.target, &plain)?;

        let [actor_steps, critic_steps, entropy_steps] = stored.array::<u32, 3>("learner, steps")?.map(|steps| steps as i32);
        let optimizer = |n_steps: i32, parameters: Vec<(String, Vec<f32>)>| -> Result<Adam, Error> {
            let moments = parameters.iter().filter(|_| 0 < n_steps).map(|(name, values)| {
                let [first, second] = moment_names(name).map(|name| stored.exactly(&name, values.len()));
                Ok([first?, second?])
            });
            Ok(Adam { n_steps, moments: moments.collect::<Result<_, Error>>()? })
        };
        let actor_optimizer = optimizer(actor_steps, named("actor", &actor))?;
        let critic_optimizer = optimizer(critic_steps, critics_named(&critics))?;
        let [log_weight, first, second] = stored.array("entropy weight")?;
        let [updates] = stored.array("learner, updates")?;

        (self.actor, self.average, self.critics, self.target) = (actor, average, critics, target);
        (self.actor_optimizer, self.critic_optimizer, self.updates) = (actor_optimizer, critic_optimizer, updates);
        self.entropy_weight.log_weight = log_weight;
        self.entropy_weight.moments = [first, second];
        self.entropy_weight.updates = entropy_steps;
        Ok(())
    }

    /// The first of the learner's numbers that is none: where it lies, and what is there.
    pub fn broken(&self) -> Option<(String, f32)> {
        self.numbers().into_iter().find_map(|(name, values)| Some((name, values.into_iter().find(|value| !value.is_finite())?)))
    }

    pub(super) fn numbers(&self) -> Vec<(String, Vec<f32>)> {
        let moving = [named("actor", &self.actor), critics_named(&self.critics)];
        let moments = [&self.actor_optimizer, &self.critic_optimizer].into_iter().zip(&moving).flat_map(|(optimizer, parameters)| {
            parameters.iter().zip(&optimizer.moments).flat_map(|((name, _), moments)| moment_names(name).into_iter().zip(moments.clone()))
        });
        let moments: Vec<_> = moments.collect();
        let [first, second] = self.entropy_weight.moments;
        let entropy = ("entropy weight".to_owned(), vec![self.entropy_weight.log_weight, first, second]);
        let following = [("target 1", &self.target.first), ("target 2", &self.target.second), ("average actor", &self.average)];
        let following = following.into_iter().flat_map(|(name, network)| named(name, network));
        moving.into_iter().flatten().chain(moments).chain([entropy]).chain(following).collect()
    }
}

/// A network's parameters, in the order in which its optimizer has them.
fn named(network: &str, parameters: &Mlp) -> Vec<(String, Vec<f32>)> {
    parameters.parameters().into_iter().map(|(name, values)| (format!("{network}, {name}"), values)).collect()
}

fn critics_named(critics: &Twins) -> Vec<(String, Vec<f32>)> {
    [named("critic 1", &critics.first), named("critic 2", &critics.second)].concat()
}

fn moment_names(parameter: &str) -> [String; 2] {
    ["first", "second"].map(|which| format!("{parameter}, {which} moment"))
}
