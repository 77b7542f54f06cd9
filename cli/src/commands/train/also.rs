//! Further evaluations of a run's policy, as `also_evaluate` names them, and the lines that sum up all evaluations.
//!
//! Their benchmarks are read and checked before the run begins. Each world is baked when its turn comes, so one at a
//! time is in memory.

use offtrack::files::reader::Reader;
use offtrack::scenario::{Scenario, Split};
use offtrack_evaluation::device::Device;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::report::Report;
use offtrack_evaluation::{Evaluation, usual_episodes};
use offtrack_learner::config::{AlsoEvaluate, Config};
use offtrack_policy::Policy;
use serde::Serialize;

use crate::commands::{progress, roads};
use offtrack_learner::train::alike;

/// A further evaluation, ready to be made.
pub struct Also {
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
    trained_on: usize,
    #[serde(flatten)]
    report: Report,
}

impl Also {
    /// Reads the benchmarks that a training file names. `training` is what the policy is trained on. They may be for
    /// other
    /// vehicles: how well a policy drives those is something to evaluate.
    pub fn read(config: &Config, reader: &Reader, training: &Scenario) -> Result<Vec<Also>, Error> {
        let read = |named: AlsoEvaluate| {
            let wrong = |expected: String| Error::from(reader.invalid("also_evaluate", named.name(), expected));
            let mut scenario = roads::benchmark(&named.benchmark).map_err(|error| wrong(error.to_string()))?;
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
            Ok(Also { scenario, split: named.split, trained_on })
        };
        config.also_evaluated().into_iter().map(read).collect()
    }

    /// Drives every route as many times as an evaluation usually does.
    pub fn evaluate(&self, policy: &mut Policy) -> Result<AlsoReport, Error> {
        let world = roads::world(&self.scenario)?;
        let evaluation = Evaluation {
            scenario: &self.scenario,
            world: &world,
            split: self.split,
            episodes: usual_episodes(self.scenario.split(self.split).len()),
            seed: 0,
            record: false,
            device: &Device::processor(),
        };
        let bar = progress::Bar::new(&format!("evaluating on {}", self.scenario.name), "episodes", 0);
        let (report, _) = evaluation.report(policy, &mut |done, all| bar.set(done, all))?;
        Ok(AlsoReport { trained_on: self.trained_on, report })
    }
}

/// Whether a policy knows the routes it was evaluated on.
fn familiarity(trained_on: usize, n_routes: usize) -> String {
    match trained_on {
        0 => "zero-shot".to_owned(),
        all if all == n_routes => "trained on".to_owned(),
        some => format!("{some} of {n_routes} routes trained on"),
    }
}

/// A line for each evaluation, that on `benchmark` first.
pub fn lines(evaluation: Option<&Report>, also: &[AlsoReport]) -> String {
    // No test route is trained on.
    let all =
        evaluation.map(|report| (0, report)).into_iter().chain(also.iter().map(|also| (also.trained_on, &also.report)));
    let named: Vec<(String, usize, &Report)> = all
        .map(|(trained_on, report)| (format!("{} {}", report.benchmark, report.split), trained_on, report))
        .collect();
    let width = named.iter().map(|(name, ..)| name.len()).max().unwrap_or(0);
    let line = |(name, trained_on, report): &(String, usize, &Report)| {
        let summary = &report.summary;
        let lane = summary.lane_distance_mean_arrived.map_or_else(|| "-".to_owned(), |mean| format!("{mean:.2} m"));
        let arrived = format!("{}/{}", summary.arrived, summary.episodes);
        let [success, low, high] =
            [summary.success, summary.success_low, summary.success_high].map(|fraction| 100.0 * fraction);
        format!(
            "{name:width$}  {arrived:>11} arrived, {success:5.1} % ({low:.1} to {high:.1} %), lane distance {lane} ({})\n",
            familiarity(*trained_on, report.routes.len())
        )
    };
    let lines: String = named.iter().map(line).collect();
    format!(
        "{lines}lane distance: to the lane's centre, mean over the episodes that arrived; in brackets 95 % intervals\n"
    )
}

#[cfg(test)]
mod tests {
    use super::familiarity;

    #[test]
    fn an_evaluation_is_zero_shot_where_no_route_was_trained_on() {
        assert_eq!(familiarity(0, 5), "zero-shot");
        assert_eq!(familiarity(5, 5), "trained on");
        assert_eq!(familiarity(2, 5), "2 of 5 routes trained on");
    }
}
