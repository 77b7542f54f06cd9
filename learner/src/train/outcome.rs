//! What a run came to, as `report.json` has it.

use offtrack_evaluation::provenance;
use offtrack_evaluation::report::Report;
use serde::Serialize;

use super::AlsoReport;
use crate::config::Config;
use crate::run::Run;
use crate::run::route_counts::WorstRoutes;
use crate::run::validation::{Validation, Validations};

/// A run's result, as written to `report.json`.
#[derive(Debug, Serialize)]
pub struct Outcome {
    /// The run was stopped before its budget was spent.
    pub interrupted: bool,
    /// The run's seed.
    pub seed: u32,
    /// Training time (s).
    pub seconds: f64,
    /// Env steps made.
    pub env_steps: u64,
    /// Training episodes that ended.
    pub episodes: u64,
    /// Updates made.
    pub updates: u64,
    /// Fraction of the latest training episodes that arrived.
    pub training_success: Option<f64>,
    /// Number of the latest training episodes; each row of the metrics is a mean over as many.
    pub training_window: u64,
    /// The training routes with least success; none where they were not counted: on a device they
    /// are with level replay alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub training_routes: Option<WorstRoutes>,
    /// How the policy did on validation routes, and which one was kept; none without validation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation: Option<Validations>,
    /// The processor.
    pub machine: String,
    /// Where trucks and learner were.
    pub device: String,
    /// The commit that the program was built from.
    pub commit: String,
    /// The final evaluation; none after an interruption.
    pub evaluation: Option<Report>,
    /// Further evaluations, in the order of `also_evaluate`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub also: Vec<AlsoReport>,
}

impl Outcome {
    /// The result before its evaluation.
    pub(super) fn of(config: &Config, run: &Run) -> Outcome {
        let progress = &run.progress;
        Outcome {
            interrupted: progress.fraction() < 1.0,
            seed: config.seed,
            seconds: progress.seconds(),
            env_steps: progress.env_steps(),
            episodes: progress.episodes(),
            updates: progress.updates(),
            training_success: progress.success(),
            training_window: progress.window(),
            training_routes: run.routes.worst(),
            validation: run.validation.as_ref().and_then(Validation::report),
            machine: provenance::machine(),
            device: run.device(),
            commit: provenance::commit(),
            evaluation: None,
            also: Vec::new(),
        }
    }
}
