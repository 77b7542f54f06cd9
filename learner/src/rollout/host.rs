//! Trucks and replay buffer on the host.

use std::borrow::Cow;

use burn::tensor::Tensor;
use offtrack::layout::random;
use offtrack::layout::{Column, Ended, N_AROUND, N_EXTRAS, N_VALUES, ObservationLayout, RewardTerms};
use offtrack::physics;
use offtrack::simulator::{Actions, RouteChoice, Simulator};
use offtrack::world::World;
use offtrack_evaluation::policies::rule::Rule;
use offtrack_evaluation::policies::{Controller, UniformRandom};
use offtrack_policy::Normalisation;
use rand::SeedableRng;
use std::sync::Arc;

use super::{Episodes, Rollout, RouteEnd};
use crate::checkpoint::{Columns, Stored};
use crate::config::{Config, Learning, Refinement};
use crate::error::Error;
use crate::exchange::{Actor, Sample, TdErrors};
use crate::generator::Generator;
use crate::level_replay::LevelReplay;
use crate::memory;
use crate::mirror::Mirror;
use crate::network::{Mlp, sampled};
use crate::pass::softmax;
use crate::ppo::steps::Steps;
use crate::replay_buffer::{ReplayBuffer, Rows};

mod stacks;
mod tensors;
#[cfg(test)]
mod tests;

use stacks::Stacks;
use tensors::logits_of_normalised;
pub use tensors::{logits, shards};

/// Each truck's `N` values: those of its observation, its first extras and, where `N` has room for more than all of
/// them, those of other vehicles, `[n_envs]`. Without either nothing is copied.
pub fn observed<'a, const N: usize>(
    observation: &'a [[f32; N_VALUES]],
    extras: &[[f32; N_EXTRAS]],
    around: &[[f32; N_AROUND]],
) -> Cow<'a, [[f32; N]]> {
    if N == N_VALUES {
        return Cow::Borrowed(bytemuck::cast_slice(observation));
    }
    let layout = const { ObservationLayout::of_width(N).unwrap() };
    let joined = |env: usize| {
        let mut row = [0.0; N];
        layout.join(&mut row, env, observation, extras, around);
        row
    };
    Cow::Owned((0..observation.len()).map(joined).collect())
}

/// Trucks and a replay buffer whose networks observe `N` values. See the module.
pub struct HostRollout<const N: usize> {
    config: Config,
    simulator: Simulator,
    /// Caps the speed of every action that is made, not of the one that is chosen; none caps nothing.
    rule: Option<Rule>,
    /// None where routes are drawn uniformly.
    level_replay: Option<LevelReplay>,
    replay_buffer: ReplayBuffer<N>,
    /// Random numbers of actions and of samples.
    acting: Generator,
    sampling: Generator,
    /// None without mirror augmentation.
    mirror: Option<Mirror>,
    normalisation: Normalisation,
    /// What a refinement's networks observe: the last frames of each truck.
    stacks: Stacks,
    /// Observations before the step in hand.
    observation: Vec<[f32; N]>,
    /// Routes of the step in hand; after it, trucks whose episodes ended are on others.
    routes: Vec<u32>,
    /// Rows of the latest sample.
    sampled_rows: Vec<usize>,
    /// Sum of each truck's rewards in its episode so far, `[n_envs]`.
    episode_rewards: Vec<f32>,
    ended: Vec<Episodes>,
    route_ends: Vec<RouteEnd>,
}

impl<const N: usize> HostRollout<N> {
    /// Trucks at the start of their first episodes, and an empty replay buffer. A route that the world does not have
    /// and a batch that does not fit into the memory are errors.
    pub fn new(
        config: &Config,
        world: &Arc<World>,
        routes: Vec<u32>,
        mirror: Option<Mirror>,
    ) -> Result<HostRollout<N>, Error> {
        let stream =
            |purpose: u32| Generator::seed_from_u64(u64::from(random::words(config.seed, purpose, 0, u32::MAX)[0]));
        let level_replay = config.level_replay.map(|settings| LevelReplay::new(settings, routes.clone()));
        let choice = RouteChoice::Drawn(level_replay.as_ref().map_or(routes, |replay| replay.list().to_vec()));
        let mut replay_buffer = ReplayBuffer::new(config.n_envs, config.learning.n_steps, &config.replay_buffer);
        reserve(&mut replay_buffer, config)?;
        Ok(HostRollout {
            simulator: Simulator::new(world.clone(), config.n_envs, config.seed, choice)?,
            rule: config.rule_in(world)?,
            level_replay,
            replay_buffer,
            acting: stream(1),
            sampling: stream(2),
            mirror,
            normalisation: Normalisation::none(N),
            stacks: Stacks::default(),
            observation: Vec::new(),
            routes: Vec::new(),
            sampled_rows: Vec::new(),
            episode_rewards: vec![0.0; config.n_envs],
            ended: Vec::new(),
            route_ends: Vec::new(),
            config: config.clone(),
        })
    }

    fn choose(&mut self, actor: &Mlp) -> Vec<u32> {
        let batch = self.simulator.batch();
        let logits =
            logits::<N>(actor, &self.normalisation, &observed(&batch.observation, &batch.extras, &batch.around));
        sampled(&logits, self.n_actions(), &mut self.acting)
    }

    fn n_actions(&self) -> usize {
        self.simulator.world().actions.len()
    }

    /// Makes a step of every truck with these actions, or with what the rule makes of them.
    fn make(&mut self, chosen: &[u32]) -> Result<(), Error> {
        let Some(rule) = &self.rule else { return Ok(self.simulator.step(chosen)?) };
        let capped = rule.capped(self.simulator.world(), self.simulator.batch(), chosen);
        Ok(self.simulator.step(&capped)?)
    }

    /// Keeps what the step in hand replaces.
    fn begin_step(&mut self) {
        let batch = self.simulator.batch();
        self.observation.clear();
        self.observation.extend_from_slice(&observed(&batch.observation, &batch.extras, &batch.around));
        self.routes.clear();
        self.routes.extend(batch.truck.iter().map(|truck| truck.route));
    }

    /// Appends the step just made to the replay buffer, and counts the episodes that it ended.
    fn remember(&mut self) -> Result<(), Error> {
        let batch = self.simulator.batch();
        let mut reward = Cow::Borrowed(batch.reward.as_slice());
        if let Some(arrival) = self.config.learning.arrival {
            add_arrivals(reward.to_mut(), &batch.ended, arrival as f32);
        }
        self.replay_buffer.append(Rows {
            observation: &self.observation,
            action: &batch.action,
            reward: &reward,
            ended: &batch.ended,
            next_observation: &observed(&batch.next_observation, &batch.next_extras, &batch.next_around),
        });
        self.count()
    }

    /// Counts the episodes that the step just made ended.
    fn count(&mut self) -> Result<(), Error> {
        let batch = self.simulator.batch();
        let codes = batch.ended.iter().map(|&code| Ended::of_column(code));
        for (((sum, &reward), ended), &route) in
            self.episode_rewards.iter_mut().zip(&batch.reward).zip(codes).zip(&self.routes)
        {
            *sum += reward;
            if ended != Ended::Running {
                let arrived = u64::from(ended == Ended::Arrived);
                let end = RouteEnd { route, ended };
                self.level_replay.iter_mut().for_each(|replay| replay.count(end));
                self.route_ends.push(end);
                self.ended.push(Episodes { count: 1, arrived, reward: f64::from(std::mem::take(sum)) });
            }
        }
        if let Some(replay) = &mut self.level_replay
            && replay.stepped()
        {
            replay.renew();
            self.simulator.draw_from(replay.list())?;
        }
        Ok(())
    }
}

impl<const N: usize> Rollout for HostRollout<N> {
    fn simulator(&self) -> &Simulator {
        &self.simulator
    }

    fn n_transitions(&self) -> usize {
        self.replay_buffer.n_transitions()
    }

    fn can_sample(&self) -> bool {
        self.replay_buffer.can_sample()
    }

    fn found_normalisation(&self, mirror: Option<&Mirror>) -> Result<Normalisation, Error> {
        Ok(super::normalisation_of(self.replay_buffer.observations().to_vec(), mirror))
    }

    fn set_normalisation(&mut self, normalisation: &Normalisation) {
        self.normalisation = normalisation.clone();
    }

    fn step_at_random(&mut self) -> Result<(), Error> {
        self.begin_step();
        if self.rule.is_none() {
            self.simulator.step_at_random();
            return self.remember();
        }
        let drawn = UniformRandom { seed: self.config.seed }.choose(self.simulator.world(), self.simulator.batch());
        if let Actions::Indices(drawn) = drawn {
            self.make(&drawn)?;
        }
        self.remember()
    }

    fn step(&mut self, actor: &Actor, env_steps: u64) -> Result<(), Error> {
        let actor = actor.on_host()?;
        self.begin_step();
        let (mut actions, n_actions) = (self.choose(actor), self.n_actions());
        if let Some(exploration) = &self.config.exploration {
            exploration.explore(env_steps, n_actions, &mut actions, &mut self.acting);
        }
        self.make(&actions)?;
        self.remember()
    }

    fn collect(&mut self, actor: &Mlp, settings: &Refinement) -> Result<Steps, Error> {
        let (n_envs, n_actions, n_steps) = (self.config.n_envs, self.n_actions(), settings.n_steps);
        let Learning { arrival, reward_scale, .. } = self.config.learning;
        let own = self.simulator.world().reward;
        let mut weights = own;
        settings.reward.apply_to_world(&mut weights);
        let late_fails = settings.late_fails;
        let n_values = settings.frames * N;
        let mut steps = Steps { n_envs, n_values, late_fails, ..Steps::default() };
        for step in 0..n_steps {
            self.begin_step();
            let frames = self.normalisation.apply(&self.observation);
            let stacked = self.stacks.push(settings.seen(), &frames, &self.simulator.batch().ended);
            steps.observation.extend_from_slice(stacked);
            let logits = logits_of_normalised(actor, stacked.to_vec(), n_values);
            let actions = sampled(&logits, n_actions, &mut self.acting);
            steps.log_prob.extend(
                logits.chunks_exact(n_actions).zip(&actions).map(|(row, &action)| softmax(row).1[action as usize]),
            );
            steps.action.extend_from_slice(&actions);
            self.make(&actions)?;
            let batch = self.simulator.batch();
            let ended = batch.ended.iter().map(|&code| Ended::of_column(code));
            steps.ended.extend(ended);
            for env in 0..n_envs {
                let is_late = late_fails && steps.ended[step * n_envs + env].truncated();
                let lane = batch.terms[env].lane_distance * own.lane_distance_limit / weights.lane_distance_limit;
                let terms = RewardTerms {
                    lane_distance: lane.min(1.0),
                    clearance: physics::closeness(&weights, &batch.clearance[env])
                        .powf(settings.clearance_power as f32),
                    failure: if is_late { 1.0 } else { batch.terms[env].failure },
                    ..batch.terms[env]
                };
                let beside = batch.reward[env] - physics::rewarded(&own, &batch.terms[env]); // hindrance, aprons
                steps.reward.push(physics::rewarded(&weights, &terms) + beside);
            }
            let reward = &mut steps.reward[step * n_envs..];
            if let Some(arrival) = arrival {
                add_arrivals(reward, &batch.ended, arrival as f32);
            }
            reward.iter_mut().for_each(|reward| *reward *= reward_scale as f32);
            let next = observed::<N>(&batch.next_observation, &batch.next_extras, &batch.next_around);
            for (env, next) in next.iter().enumerate() {
                if steps.needs_next(step * n_envs + env, n_steps * n_envs) {
                    let frame = self.normalisation.apply(std::slice::from_ref(next));
                    steps.next_observation.extend(self.stacks.next(settings.seen(), env, &frame));
                }
            }
            self.count()?;
        }
        Ok(steps)
    }

    fn drive(&mut self, actor: &Actor) -> Result<(), Error> {
        let actions = self.choose(actor.on_host()?);
        self.make(&actions)
    }

    fn sample(&mut self) -> Result<Sample, Error> {
        let learning = &self.config.learning;
        let mut sample = self.replay_buffer.sample(learning.batch, learning.gamma as f32, &mut self.sampling);
        if let Some(mirror) = &self.mirror {
            mirror.mirror_half(&mut sample, &mut self.sampling);
        }
        self.sampled_rows.clone_from(&sample.row);
        Ok(Sample::Host(shards(&sample, &self.normalisation, learning, &mut self.sampling)))
    }

    fn set_td_errors(&mut self, errors: TdErrors) -> Result<(), Error> {
        if self.replay_buffer.has_priorities() {
            let read =
                |errors: Tensor<2>| errors.into_data().try_to_vec::<f32>().expect("TD errors of f32 critics are f32");
            let errors: Vec<f32> = errors.on_host()?.into_iter().flat_map(read).collect();
            self.replay_buffer.set_td_errors(&self.sampled_rows, &errors);
        }
        Ok(())
    }

    fn take_episodes(&mut self, _: bool) -> Result<Vec<Episodes>, Error> {
        Ok(std::mem::take(&mut self.ended))
    }

    fn take_route_ends(&mut self) -> Vec<RouteEnd> {
        std::mem::take(&mut self.route_ends)
    }

    fn wait(&self) -> Result<(), Error> {
        Ok(())
    }

    fn check(&self) -> Result<(), Error> {
        Ok(())
    }

    fn save<'a>(&'a self, columns: &mut Columns<'a>) {
        for (column, bytes) in self.simulator.batch().columns() {
            columns.put(column_name(column), bytes);
        }
        columns.put("rollout, acting", &self.acting.state[..]);
        columns.put("rollout, sampling", &self.sampling.state[..]);
        columns.put("rollout, episode rewards", &self.episode_rewards[..]);
        self.config.refinement.iter().for_each(|refinement| self.stacks.save(refinement.frames, columns));
        self.level_replay.iter().for_each(|replay| replay.save(columns));
        self.replay_buffer.save(columns);
    }

    fn restore(&mut self, stored: &Stored, _: u64) -> Result<(), Error> {
        self.simulator
            .restore(|column| stored.bytes(&column_name(column)))
            .map_err(|error| stored.error(error.to_string()))?;
        (self.acting, self.sampling) =
            (Generator::stored(stored, "rollout, acting")?, Generator::stored(stored, "rollout, sampling")?);
        self.episode_rewards = stored.exactly("rollout, episode rewards", self.config.n_envs)?;
        if let Some(refinement) = &self.config.refinement {
            self.stacks.restore(stored, self.config.n_envs * refinement.frames * N)?;
        }
        if let Some(replay) = &mut self.level_replay {
            replay.restore(stored)?;
            self.simulator.draw_from(replay.list())?;
        }
        self.replay_buffer.restore(stored, self.n_actions() as u32)?;
        reserve(&mut self.replay_buffer, &self.config)
    }
}

/// Takes the memory of all transitions that a run will hold, or says that there is not so much.
fn reserve<const N: usize>(replay_buffer: &mut ReplayBuffer<N>, config: &Config) -> Result<(), Error> {
    replay_buffer.reserve(memory::transitions(config)).map_err(|error| {
        let expected = format!("{error}; fewer transitions would do");
        Error::setting("replay_buffer.capacity", config.replay_buffer.capacity.to_string(), expected)
    })
}

/// Adds `arrival` to the rewards of the trucks that arrive, `[n_envs]` each.
fn add_arrivals(reward: &mut [f32], ended: &[u32], arrival: f32) {
    let arrived = reward.iter_mut().zip(ended).filter(|(_, code)| **code == Ended::Arrived as u32);
    arrived.for_each(|(reward, _)| *reward += arrival);
}

fn column_name(column: Column) -> String {
    format!("batch, {}", column.name())
}
