//! The benchmarks of a run, checked against each other: what it is trained on, and what its policy is evaluated on.

use std::sync::Arc;

use offtrack::scenario::{Scenario, Split};
use offtrack::world::World;
use offtrack_training::error::Error;
use offtrack_training::learner::config::Config;
use offtrack_training::learner::run::validation::Validation;

use super::also::Also;
use crate::commands::roads;

/// What a run is trained on.
pub struct Worlds {
    /// The benchmark that the policy is evaluated on.
    pub benchmark: Scenario,
    pub benchmark_world: Arc<World>,
    /// The benchmark that it is trained on.
    pub training: Scenario,
    pub training_world: Arc<World>,
    /// The benchmark that the policy is chosen on, with its validation routes; none without validation.
    validation: Option<(Arc<Scenario>, Arc<World>)>,
    /// What else it is evaluated on.
    pub also: Vec<Also>,
}

impl Worlds {
    /// Both benchmarks of a training file. None of the routes that the policy is evaluated on may be among those it is
    /// trained on.
    pub fn read(config: &Config) -> Result<Worlds, Error> {
        let mut benchmark = roads::benchmark(&config.benchmark)?;
        let mut training = roads::benchmark(config.training_benchmark.as_ref().unwrap_or(&config.benchmark))?;
        training.keep(&[Split::Train]);
        config.reward.apply(&mut training);
        let wrong = |expected: String| Error::Flag { flag: "training_benchmark", value: training.name.clone(), expected };
        // The policy is evaluated on the test routes alone; without any it is not evaluated.
        if !benchmark.split(Split::Test).is_empty() {
            benchmark.keep(&[Split::Test]);
        }
        if let Some(route) = training.shared_names(Split::Train, &benchmark, Split::Test).first() {
            return Err(wrong(format!("{route} is a test route of {} and must not be trained on", benchmark.name)));
        }
        if training.split(Split::Train).is_empty() {
            return Err(wrong("it has no routes under `train`".to_owned()));
        }
        let (benchmark_world, training_world) = (roads::world(&benchmark)?, roads::world(&training)?);
        if training_world.actions != benchmark_world.actions {
            let name = &benchmark.name;
            return Err(wrong(format!("its actions and vehicle lock must be those of {name}, on which the policy is evaluated")));
        }
        if training.extras != benchmark.extras {
            let name = &benchmark.name;
            return Err(wrong(format!("its observation.extras must be those of {name}, on which the policy is evaluated")));
        }
        let also = Also::read(config, &training, &training_world.actions)?;
        let validation = config.validation.as_ref().map(|settings| validation(&settings.benchmark)).transpose()?;
        Ok(Worlds { benchmark, benchmark_world, training, training_world, validation, also })
    }

    /// Validation at its beginning, if the config has it. Routes that are missing or trained on are an error.
    pub fn validation(&self, config: &Config) -> Result<Option<Validation>, Error> {
        let (Some(settings), Some((scenario, world))) = (&config.validation, &self.validation) else { return Ok(None) };
        Validation::new(settings.clone(), scenario.clone(), world.clone(), &self.training).map(Some)
    }
}

/// A benchmark with its validation routes alone, if it has any.
fn validation(benchmark: &str) -> Result<(Arc<Scenario>, Arc<World>), Error> {
    let mut scenario = roads::benchmark(benchmark)?;
    if !scenario.split(Split::Validation).is_empty() {
        scenario.keep(&[Split::Validation]);
    }
    let world = roads::world(&scenario)?;
    Ok((scenario.into(), world))
}
