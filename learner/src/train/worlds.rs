//! The benchmarks of a run, checked against each other: what it is trained on, and what its policy is chosen and
//! evaluated on.

use std::path::Path;
use std::sync::Arc;

use offtrack::files::reader::{Error as InputError, Reader};
use offtrack::scenario::{ActionKind, Scenario, Split};
use offtrack::world::World;
use offtrack_evaluation::device::Device;
use offtrack_evaluation::recording::Track;
use offtrack_evaluation::report::Report;
use offtrack_evaluation::{Evaluation, usual_episodes};
use offtrack_policy::Policy;

use super::alike;
use super::also::Also;
use super::event::{Caller, Event};
use super::roads::Roads;
use crate::config::{Config, Rule, driven};
use crate::error::Error;
use crate::run::validation::Validation;

/// Where a benchmark has no training or no validation routes of its own, it is driven on the roads of this one.
const ROADS: &str = "random2026";
/// By how much an approach or a departure that does not fit these roads is shortened at a time, and its least length
/// (m).
const SHORTER: f64 = 5.0;

/// What a run is trained on.
pub(super) struct Worlds {
    /// The benchmark that the policy is evaluated on.
    pub(super) benchmark: Scenario,
    pub(super) benchmark_world: Arc<World>,
    /// The benchmark that it is trained on.
    pub(super) training: Scenario,
    pub(super) training_world: Arc<World>,
    /// The benchmark that the policy is chosen on, with its validation routes; none without validation.
    validation: Option<(Arc<Scenario>, Arc<World>)>,
    /// What else it is evaluated on.
    pub(super) also: Vec<Also>,
}

/// An error for a benchmark whose actions are continuous: what learns here chooses among levels.
fn check_levels(reader: &Reader, key: &str, scenario: &Scenario) -> Result<(), Error> {
    match scenario.action_kind {
        ActionKind::Levels => Ok(()),
        ActionKind::Continuous => {
            let expected = "its actions.kind is \"continuous\", and training learns to choose among levels: one with \
                            actions.steer_levels is needed";
            Err(reader.invalid(key, &scenario.name, expected).into())
        }
    }
}

impl Worlds {
    /// The benchmarks of a training file, which `origin` names in errors. None of the routes that the policy is chosen
    /// or evaluated on may be among those it is trained on, and on all of them it drives what it is trained to drive.
    pub(super) fn read(config: &Config, origin: &Path, roads: Roads) -> Result<Worlds, Error> {
        let reader = Reader::of(origin);
        let own = named(&reader, "benchmark", &config.benchmark, roads)?;
        check_levels(&reader, "benchmark", &own)?;
        config.check_rule(&reader, "benchmark", &own)?;
        let training = training(&reader, config, &own, roads)?;
        check_levels(&reader, "training_benchmark", &training)?;
        config.check_rule(&reader, "training_benchmark", &training)?;
        // The policy is evaluated on the test routes alone; without any it is not evaluated.
        let mut benchmark = own.clone();
        if !benchmark.split(Split::Test).is_empty() {
            benchmark.keep(&[Split::Test]);
        }
        let wrong = |expected: String| reader.invalid("training_benchmark", &training.name, expected);
        if let Some(route) = training.shared_names(Split::Train, &benchmark, Split::Test).first() {
            return Err(
                wrong(format!("{route} is a test route of {} and must not be trained on", benchmark.name)).into()
            );
        }
        if let Some(difference) = alike::difference(&training, &benchmark) {
            let expected = format!(
                "{}, on which the policy is evaluated, differs in {difference}: --benchmark {} trains as it says",
                benchmark.name, config.benchmark
            );
            return Err(wrong(expected).into());
        }
        let also = Also::read(config, &reader, &training, roads)?;
        let validation =
            config.validation.is_some().then(|| validation(&reader, config, &own, &training, roads)).transpose()?;
        let baked = |scenario: Scenario| Ok::<_, Error>((roads.world(&scenario)?, Arc::new(scenario)));
        let validation = validation.map(baked).transpose()?.map(|(world, scenario)| (scenario, world));
        let (benchmark_world, training_world) = (roads.world(&benchmark)?, roads.world(&training)?);
        Ok(Worlds { benchmark, benchmark_world, training, training_world, validation, also })
    }

    /// Validation at its beginning, if the config has it.
    pub(super) fn validation(&self, config: &Config) -> Option<Validation> {
        let (scenario, world) = self.validation.as_ref()?;
        Some(Validation::new(config.validation.clone()?, config.rule, scenario.clone(), world.clone()))
    }

    /// The evaluation on `benchmark`, with the episodes that its page shows; none where it has no test routes.
    pub(super) fn evaluate(
        &self,
        policy: &Policy,
        rule: Option<Rule>,
        caller: Caller,
    ) -> Result<Option<(Report, Vec<Track>)>, Error> {
        let n_routes = self.benchmark.split(Split::Test).len();
        if n_routes == 0 {
            return Ok(None);
        }
        let evaluation = Evaluation {
            scenario: &self.benchmark,
            world: &self.benchmark_world,
            split: Split::Test,
            episodes: usual_episodes(n_routes),
            seed: 0,
            record: true,
            device: &Device::processor(),
        };
        let benchmark = &self.benchmark.name;
        let mut tell = |done, total| caller.tell(Event::Evaluating { benchmark, done, total });
        let mut policy = driven(policy.clone(), rule, &self.benchmark_world)?;
        Ok(Some(evaluation.report(policy.as_mut(), &mut tell)?))
    }
}

/// The benchmark that a key names.
fn named(reader: &Reader, key: &str, name: &str, roads: Roads) -> Result<Scenario, InputError> {
    let scenario = roads.benchmark(name).map_err(|error| match error {
        // The benchmark's own file was not found or is none, so the key that names it is what is wrong.
        InputError::UnknownName { .. } | InputError::Unreadable { .. } | InputError::NotAFile { .. } => {
            reader.invalid(key, name, error.to_string())
        }
        error => error,
    })?;
    check_alone(reader, key, &scenario)?;
    Ok(scenario)
}

/// An error for a benchmark with several trucks on a road.
pub(super) fn check_alone(reader: &Reader, key: &str, scenario: &Scenario) -> Result<(), InputError> {
    match &scenario.traffic {
        Some(traffic) if 1 < traffic.group => {
            let expected = "its traffic.group puts several trucks on a road, which are trained from Python: \
                            python/examples/self_play.py";
            Err(reader.invalid(key, &scenario.name, expected))
        }
        _ => Ok(()),
    }
}

/// What is trained on, with its training routes alone and the reward of the training file.
fn training(reader: &Reader, config: &Config, own: &Scenario, roads: Roads) -> Result<Scenario, Error> {
    let mut training = match &config.training_benchmark {
        Some(name) => named(reader, "training_benchmark", name, roads)?,
        None if own.split(Split::Train).is_empty() => on_random_roads(own, Split::Train, roads)?,
        None => own.clone(),
    };
    if training.split(Split::Train).is_empty() {
        return Err(reader.invalid("training_benchmark", &training.name, "it has no routes under `train`").into());
    }
    training.keep(&[Split::Train]);
    config.reward.apply(&mut training.reward);
    Ok(training)
}

/// What the policy is chosen on, with its validation routes alone.
fn validation(
    reader: &Reader,
    config: &Config,
    own: &Scenario,
    training: &Scenario,
    roads: Roads,
) -> Result<Scenario, Error> {
    let given = config.validation.as_ref().and_then(|validation| validation.benchmark.as_ref());
    let mut scenario = match given {
        Some(name) => named(reader, "validation.benchmark", name, roads)?,
        None if own.split(Split::Validation).is_empty() => on_random_roads(own, Split::Validation, roads)?,
        None => own.clone(),
    };
    let wrong = |expected: String| {
        let name = given.unwrap_or(&scenario.name);
        Err(reader.invalid("validation.benchmark", name, expected).into())
    };
    if scenario.split(Split::Validation).is_empty() {
        return wrong("it has no validation routes; random2026 has some".to_owned());
    }
    if let Some(route) = scenario.shared_names(Split::Validation, training, Split::Train).first() {
        return wrong(format!("{route} is a training route of {}: validation needs others", training.name));
    }
    if let Some(difference) = alike::difference(training, &scenario) {
        return wrong(format!(
            "it differs from {}, which is trained on, in {difference}: with --set validation.benchmark= validation is \
             as {} says",
            training.name, own.name
        ));
    }
    config.check_rule(reader, "validation.benchmark", &scenario)?;
    scenario.keep(&[Split::Validation]);
    Ok(scenario)
}

/// A benchmark on the roads of a split of [`ROADS`] in place of its own: vehicle, actions and all else are its own.
/// Approach and departure are as long as the arms have room for.
fn on_random_roads(own: &Scenario, split: Split, roads: Roads) -> Result<Scenario, Error> {
    let mut on = roads.benchmark(ROADS)?;
    on.keep(&[split]);
    let mut bare = own.clone();
    bare.keep(&[]);
    bare.name = format!("{} on roads of {ROADS}", own.name);
    loop {
        let mut scenario = bare.clone();
        match on.places.iter().try_for_each(|place| scenario.add(place.roundabout.clone(), split)) {
            Ok(()) => return Ok(scenario),
            Err(InputError::Invalid { key, .. }) if key == "routes.approach" && 2.0 * SHORTER <= bare.approach => {
                bare.approach -= SHORTER
            }
            Err(InputError::Invalid { key, .. }) if key == "routes.departure" && 2.0 * SHORTER <= bare.departure => {
                bare.departure -= SHORTER;
            }
            Err(error) => return Err(error.into()),
        }
    }
}
