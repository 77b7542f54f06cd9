//! The training loop's two halves, act and learn, on any backend: what `train`, `scale` and `bench` run.

use std::sync::Arc;

use burn::tensor::Device;
use offtrack::world::World;
use offtrack_policy::{Activation, Frames, Head, Layer, Normalisation, Policy};

use super::backend::Backend;
use super::checkpoint::{Columns, Stored};
use super::config::{Config, Refinement};
use super::exchange::Sample;
use super::memory;
use super::mirror::Mirror;
use super::network::Mlp;
use super::ppo::Ppo;
use super::rollout::Rollout;
use super::sac::{Learner, Update};
use crate::error::Error;
use offtrack_evaluation::error::Error as Evaluation;
use offtrack_evaluation::policies;

/// Trucks, replay buffer and learner.
pub struct Session {
    config: Config,
    world: Arc<World>,
    /// None without mirror augmentation.
    mirror: Option<Mirror>,
    rollout: Box<dyn Rollout>,
    sac: Box<dyn Learner>,
    /// None before the refinement.
    ppo: Option<Ppo>,
    /// None while actions are random.
    normalisation: Option<Normalisation>,
}

impl Session {
    /// Trucks at the start of their first episodes on `routes`, an empty replay buffer, and a learner with random
    /// weights. All that can be wrong with a config in this world is an error here.
    pub fn new(backend: &Backend, config: &Config, world: Arc<World>, routes: Vec<u32>) -> Result<Session, Error> {
        let n_values = world.observation_layout().n_values();
        backend.check_memory(config, n_values, world.actions.len())?;
        memory::check_policy(config, n_values, world.actions.len())?;
        let mirror = config.learning.mirror_augmentation.then(|| Mirror::of(&world)).transpose()?;
        Ok(Session {
            rollout: backend.rollout(config, &world, routes, mirror.clone())?,
            sac: backend.learner(config, n_values, world.actions.len())?,
            ppo: None,
            normalisation: None,
            config: config.clone(),
            mirror,
            world,
        })
    }

    /// Begins with the policy of the config's key `from`, if it has one: its actor and its normalisation. A policy of
    /// other actions or layers is an error.
    pub fn begin(&mut self) -> Result<(), Error> {
        let Some(from) = &self.config.from else { return Ok(()) };
        let policy = policies::learned(from).map_err(|error| match error {
            Evaluation::Policy(offtrack_policy::Error::UnknownName { name, known }) => {
                let expected = format!("must be the path of a policy file or one of {}", known.join(", "));
                Error::setting("from", format!("{name:?}"), expected)
            }
            error => error.into(),
        })?;
        policy.check(&self.world)?;
        if !policy.is_plain() {
            let expected = "has a memory, several frames, values of its own or commands: the learner continues with a \
                            perceptron of one observation's values and an output an action alone";
            return Err(Error::setting("from", from, expected.to_owned()));
        }
        if policy.vehicles != self.world.observes_vehicles() {
            let expected = "learned without other vehicles, which the benchmark observes: a policy that observes them \
                            is needed, or a benchmark without observation.vehicles";
            return Err(Error::setting("from", from, expected.to_owned()));
        }
        if policy.activation != Activation::Relu {
            let expected =
                format!("has the activation {}: the learner continues with relu alone", policy.activation.name());
            return Err(Error::setting("from", from, expected));
        }
        let hidden: Vec<usize> = policy.layers[..policy.layers.len() - 1].iter().map(Layer::n_outputs).collect();
        if hidden != self.config.learning.hidden {
            let expected = format!(
                "has hidden layers of {hidden:?}: learning.hidden must be equal, not {:?}",
                self.config.learning.hidden
            );
            return Err(Error::setting("from", from, expected));
        }
        self.sac.set_actor(&Mlp::of(&policy.layers, &Device::flex()));
        self.set_normalisation(policy.normalisation);
        Ok(())
    }

    /// Begins the refinement, from a policy of this run; without effect once it has begun.
    pub fn begin_refinement(&mut self, policy: &Policy) -> Result<(), Error> {
        let Some(settings) = self.config.refinement.as_ref().filter(|_| self.ppo.is_none()) else { return Ok(()) };
        self.ppo = Some(Ppo::new(settings, &Mlp::of(&policy.layers, &Device::flex()), u64::from(self.config.seed))?);
        Ok(())
    }

    /// Whether the refinement has begun.
    pub fn is_refining(&self) -> bool {
        self.ppo.is_some()
    }

    /// Steps of all trucks, and updates from them. Returns the number of updates.
    pub fn refine(&mut self, rate_factor: f64) -> Result<u64, Error> {
        let (Some(ppo), Some(settings)) = (&mut self.ppo, &self.config.refinement) else { return Ok(0) };
        let steps = self.rollout.collect(ppo.actor(), settings)?;
        Ok(ppo.learn(&steps, rate_factor))
    }

    /// Trucks and replay buffer.
    pub fn rollout(&self) -> &dyn Rollout {
        self.rollout.as_ref()
    }

    /// Trucks and replay buffer, to be stepped.
    pub fn rollout_mut(&mut self) -> &mut dyn Rollout {
        self.rollout.as_mut()
    }

    /// The learner.
    pub fn sac(&self) -> &dyn Learner {
        self.sac.as_ref()
    }

    /// Whether the policy acts already; until then actions are random.
    pub fn is_acting(&self) -> bool {
        self.normalisation.is_some()
    }

    /// The entropy coefficient of the learner that learns now. Waits for a device.
    pub fn entropy_coefficient(&self) -> f32 {
        match self.config.refinement.as_ref().filter(|_| self.is_refining()) {
            Some(refinement) => refinement.entropy_coefficient as f32,
            None => self.sac.entropy_coefficient(),
        }
    }

    /// Figures of the updates since this was last called, summed, and the number of those updates. Waits for a device.
    pub fn take_sums(&mut self) -> (Update, u64) {
        let (mut sums, mut n_updates) = self.sac.take_sums();
        if let Some((refined, n_refined)) = self.ppo.as_mut().map(Ppo::take_sums) {
            (sums, n_updates) = (sums.plus(&refined), n_updates + n_refined);
        }
        (sums, n_updates)
    }

    /// The first of the learners' numbers that is not finite: its name and value. Waits for a device.
    pub fn broken(&self) -> Option<(String, f32)> {
        self.sac.broken().or_else(|| self.ppo.as_ref().and_then(Ppo::broken))
    }

    /// Uses this normalisation, and the policy from here on.
    pub fn set_normalisation(&mut self, normalisation: Normalisation) {
        self.rollout.set_normalisation(&normalisation);
        self.normalisation = Some(normalisation);
    }

    /// Whether the replay buffer is full enough for updates. The first time it is, the normalisation is computed from
    /// it.
    pub fn is_warm(&mut self) -> Result<bool, Error> {
        let is_warm = self.config.replay_buffer.warmup <= self.rollout.n_transitions() && self.rollout.can_sample();
        if is_warm && self.normalisation.is_none() {
            let normalisation = self.found_normalisation()?;
            self.set_normalisation(normalisation);
        }
        Ok(is_warm)
    }

    /// Acts: one step of every truck, by the actor or at random, remembered. `env_steps` were made before.
    pub fn act(&mut self, env_steps: u64) -> Result<(), Error> {
        if self.is_acting() { self.rollout.step(&self.sac.actor(), env_steps) } else { self.rollout.step_at_random() }
    }

    /// Learns: the updates after one step of all trucks. Learning rates are multiplied by `rate_factor`.
    pub fn learn(&mut self, rate_factor: f64) -> Result<(), Error> {
        for _ in 0..self.config.learning.updates_per_step {
            self.update(rate_factor)?;
        }
        Ok(())
    }

    /// One update on a new sample.
    pub fn update(&mut self, rate_factor: f64) -> Result<(), Error> {
        let sample = self.rollout.sample()?;
        self.update_on(sample, rate_factor)
    }

    /// One update on the latest sample.
    pub fn update_on(&mut self, sample: Sample, rate_factor: f64) -> Result<(), Error> {
        let errors = self.sac.update(sample, rate_factor)?;
        self.rollout.set_td_errors(errors)
    }

    /// Values that the networks observe.
    fn n_values(&self) -> usize {
        self.world.observation_layout().n_values()
    }

    /// The normalisation of the observations held.
    fn found_normalisation(&self) -> Result<Normalisation, Error> {
        if !self.config.learning.normalise_observations || self.rollout.n_transitions() == 0 {
            return Ok(Normalisation::none(self.n_values()));
        }
        self.rollout.found_normalisation(self.mirror.as_ref())
    }

    /// What the policy sees: one observation, until a refinement that shows it several.
    fn frames(&self) -> Frames {
        let refinement = self.config.refinement.as_ref().filter(|_| self.is_refining());
        refinement.map_or_else(Frames::default, Refinement::seen)
    }

    /// The policy: the EMA of the actor that learns now. Waits for a device.
    pub fn policy(&self) -> Result<Policy, Error> {
        let layout = self.world.observation_layout();
        Ok(Policy {
            name: "the policy in training".to_owned(),
            benchmark: self.config.benchmark.clone(),
            actions: self.world.actions.clone(),
            normalisation: self.normalisation.clone().map_or_else(|| self.found_normalisation(), Ok)?,
            layers: self
                .ppo
                .as_ref()
                .map_or_else(|| self.sac.actor_ema(), |ppo| ppo.actor_ema().clone())
                .plain_layers(),
            extras: layout.extra_names().into_iter().map(str::to_owned).collect(),
            vehicles: layout.has_vehicles,
            activation: Activation::Relu,
            head: Head::Levels,
            values: None,
            frames: self.frames(),
            recurrent: None,
        })
    }

    /// Adds all state to a checkpoint. Waits for a device.
    pub fn save<'a>(&'a self, columns: &mut Columns<'a>) {
        if let Some(Normalisation { mean, factor }) = &self.normalisation {
            columns.put("normalisation, mean", &mean[..]);
            columns.put("normalisation, factor", &factor[..]);
        }
        self.sac.save(columns);
        self.ppo.iter().for_each(|ppo| ppo.save(columns));
        self.rollout.save(columns);
    }

    /// Continues from a checkpoint, after `n_updates`.
    pub fn restore(&mut self, stored: &Stored, n_updates: u64) -> Result<(), Error> {
        self.rollout.restore(stored, n_updates)?;
        self.sac.restore(stored)?;
        if stored.bytes("normalisation, mean").is_some() {
            let values = |name: &str| stored.exactly(name, self.n_values());
            self.set_normalisation(Normalisation {
                mean: values("normalisation, mean")?,
                factor: values("normalisation, factor")?,
            });
        }
        if Ppo::is_in(stored) {
            self.begin_refinement(&self.policy()?)?;
            self.ppo.as_mut().map_or(Ok(()), |ppo| ppo.restore(stored))?;
        }
        Ok(())
    }
}
