//! Further evaluations of a run's policy, as `also_evaluate` names them.
//!
//! Their benchmarks are read and checked before the run begins. Each world is baked when its turn comes, so one at a
//! time is in memory.

use offtrack::files::reader::Reader;
use offtrack::scenario::{Scenario, Split};
use offtrack_evaluation::device::Device;
use offtrack_evaluation::report::Report;
use offtrack_evaluation::{Evaluation, usual_episodes};
use offtrack_policy::Policy;
use serde::Serialize;

use super::alike;
use super::event::{Caller, Event};
use super::roads::Roads;
use super::worlds::check_alone;
use crate::config::{AlsoEvaluate, Config, Rule, driven};
use crate::error::Error;

/// A further evaluation, ready to be made.
pub(super) struct Also {
    /// The benchmark with the routes of the split alone.
    scenario: Scenario,
    split: Split,
    /// Number of those routes that the policy is trained on.
    trained_on: usize,
}

/// A further evaluation's result.
#[derive(Debug, Clone, Serialize)]
pub struct AlsoReport {
    /// Number of the evaluation's routes that the policy was trained on: 0 is zero-shot.
    pub trained_on: usize,
    /// How the policy drives them.
    #[serde(flatten)]
    pub report: Report,
}

impl Also {
    /// Reads the benchmarks that a training file names. `training` is what the policy is trained on. They may be for
    /// other vehicles: how well a policy drives those is something to evaluate.
    pub(super) fn read(
        config: &Config,
        reader: &Reader,
        training: &Scenario,
        roads: Roads,
    ) -> Result<Vec<Also>, Error> {
        let read = |named: AlsoEvaluate| {
            let wrong = |expected: String| Error::from(reader.invalid("also_evaluate", named.name(), expected));
            let mut scenario = roads.benchmark(&named.benchmark).map_err(|error| wrong(error.to_string()))?;
            check_alone(reader, "also_evaluate", &scenario)?;
            scenario.keep(&[named.split]);
            if scenario.split(named.split).is_empty() {
                return Err(wrong(format!("{} has no routes under `{}`", scenario.name, named.split.name())));
            }
            let both = scenario.shared_names(named.split, training, Split::Train);
            if let (Some(route), true) = (both.first(), named.split != Split::Train) {
                return Err(wrong(format!(
                    "{route} is trained on, so no {} route may be: leave it out",
                    named.split.name()
                )));
            }
            let trained_on = both.len();
            if let Some(difference) = alike::needed(training, &scenario) {
                let out = "leave it out, or all of them with --set also_evaluate=";
                return Err(wrong(format!(
                    "it differs from {}, which is trained on, in {difference}: {out}",
                    training.name
                )));
            }
            config.check_rule(reader, "also_evaluate", &scenario)?;
            Ok(Also { scenario, split: named.split, trained_on })
        };
        config.also_evaluated().into_iter().map(read).collect()
    }

    /// Drives every route as many times as an evaluation usually does.
    pub(super) fn evaluate(&self, policy: &Policy, rule: Option<Rule>, caller: Caller) -> Result<AlsoReport, Error> {
        let world = Roads::unstoppable(caller).world(&self.scenario)?;
        let evaluation = Evaluation {
            scenario: &self.scenario,
            world: &world,
            split: self.split,
            episodes: usual_episodes(self.scenario.split(self.split).len()),
            seed: 0,
            record: false,
            device: &Device::processor(),
        };
        let benchmark = &self.scenario.name;
        let mut tell = |done, total| caller.tell(Event::Evaluating { benchmark, done, total });
        let (report, _) = evaluation.report(driven(policy.clone(), rule, &world)?.as_mut(), &mut tell)?;
        Ok(AlsoReport { trained_on: self.trained_on, report })
    }
}
