//! Training from a config to a report, in a folder: what `offtrack train` does, without its display.
//!
//! Everything is written as it comes: the training file at once, a row of metrics every few seconds, policy and
//! checkpoint every few minutes. A stopped run leaves a policy that can be evaluated, and all that it takes to
//! continue. Nothing is printed: a [`Watcher`] is told of [`Event`]s.

mod alike; // what a policy must drive alike in training and evaluation
mod also; // further evaluations
mod event; // what the caller is told
mod outcome; // what a run came to
mod roads; // benchmarks and worlds, with the user's cache
mod seeds; // several seeds, compared
mod worlds; // the benchmarks of a run, checked against each other

use std::path::Path;
use std::sync::atomic::AtomicBool;

use offtrack::files::reader::{Reader, read_text, shown_path};
use offtrack::scenario::Split;
use offtrack_evaluation::files;
use offtrack_evaluation::page::Page;
use offtrack_policy::Policy;
use serde_json::json;

use crate::backend::Backend;
use crate::checkpoint::Stored;
use crate::config::Config;
use crate::error::Error;
use crate::mirror::Mirror;
use crate::run::Run;
use crate::run::folder::Folder;
use crate::run::metrics_file::MetricsFile;
use crate::run::progress::Progress;
use crate::run::resume::{Resumed, is_evaluated};
use crate::run::route_counts::RouteCounts;
use crate::run::validation::Validation;
use crate::session::Session;
pub use also::AlsoReport;
pub use event::{Begun, Caller, Event, Watcher};
pub use outcome::Outcome;
use roads::Roads;
pub use seeds::SeedsOutcome;
use worlds::Worlds;

/// Most bytes of the metrics that the page shows.
const METRICS_LIMIT: u64 = 64 << 20;

/// Trains as `config` says and evaluates the policy. `folder`, which is made and must be new, then has the config
/// (`config.toml`), `metrics.csv`, `routes.csv`, `policy.safetensors`, `policies/`, `checkpoint.safetensors`,
/// `report.json` and `report.html`.
///
/// `watcher` is told how it goes. With `stop` set training ends after the step in hand, everything is written, and
/// [`resume`] continues; the outcome then says `interrupted` and has no evaluation. Set while roads are still read, it
/// is an error, and no folder is made. Whatever is wrong with the config or its benchmarks is an error before a folder
/// is made.
///
/// ```no_run
/// use std::path::Path;
/// use std::sync::atomic::AtomicBool;
///
/// use offtrack_learner::config::Config;
/// use offtrack_learner::train::{Event, train};
///
/// let config = Config::read(Path::new("default"))?;
/// let watcher = |event: Event| {
///     if let Event::Training(status) = event {
///         println!("{status}");
///     }
/// };
/// let outcome = train(&config, Path::new("runs/mine"), &watcher, &AtomicBool::new(false))?;
/// println!("{:?}", outcome.evaluation.map(|report| report.summary.success));
/// # Ok::<(), offtrack_learner::error::Error>(())
/// ```
pub fn train(config: &Config, folder: &Path, watcher: &Watcher, stop: &AtomicBool) -> Result<Outcome, Error> {
    let (origin, caller) = (Path::new("config"), Caller { watcher, stop });
    config.check(&Reader::of(origin))?;
    config.check_budget(origin)?;
    Training::read(config.clone(), origin, caller)?.begin(|config| Folder::new(folder, config), caller)
}

/// Continues the run in `folder` from its last checkpoint, as its `config.toml` says; then as [`train`] does.
///
/// `minutes` and `steps`, if one is given, are another budget, counted from the run's beginning. With a budget of steps
/// alone the result is that of a run never stopped, bit for bit.
pub fn resume(
    folder: &Path,
    minutes: Option<f64>,
    steps: Option<u64>,
    watcher: &Watcher,
    stop: &AtomicBool,
) -> Result<Outcome, Error> {
    let caller = Caller { watcher, stop };
    let resumed = Resumed::open(folder, minutes, steps)?;
    Training::read(resumed.config.clone(), &resumed.folder.config(), caller)?.resume(resumed, caller)
}

/// A config and its benchmarks, read and checked.
pub struct Training {
    config: Config,
    worlds: Worlds,
    /// Rows of metrics go to a TensorBoard event file too.
    pub tensorboard: bool,
}

/// What a run has before its folder.
struct Prepared {
    backend: Backend,
    session: Session,
    validation: Option<Validation>,
}

/// A new run's folder, or that of one that continues from a checkpoint.
struct Opened {
    folder: Folder,
    metrics: MetricsFile,
    stored: Option<Stored>,
    /// The run continues with another budget than its config.toml says.
    has_new_budget: bool,
}

impl Opened {
    fn new(folder: Folder) -> Result<Opened, Error> {
        let metrics = MetricsFile::create(folder.metrics()).inspect_err(|_| folder.discard())?;
        Ok(Opened { metrics, stored: None, has_new_budget: false, folder })
    }
}

impl From<Resumed> for Opened {
    fn from(Resumed { folder, metrics, stored, has_new_budget, .. }: Resumed) -> Opened {
        Opened { folder, metrics, stored, has_new_budget }
    }
}

impl Training {
    /// Reads and bakes the benchmarks of a config, which `origin` names in errors.
    pub fn read(config: Config, origin: &Path, caller: Caller) -> Result<Training, Error> {
        config.check(&Reader::of(origin))?;
        let worlds = Worlds::read(&config, origin, Roads::stoppable(caller))?;
        Ok(Training { config, worlds, tensorboard: false })
    }

    /// Does without mirror augmentation where what is trained on is not symmetric. Returns why, or none if nothing
    /// changes.
    pub fn fit_mirror(&mut self) -> Option<Error> {
        let is_on = &mut self.config.learning.mirror_augmentation;
        let refused = Mirror::of(&self.worlds.training_world).err().filter(|_| *is_on)?;
        *is_on = false;
        Some(refused)
    }

    /// Trains and evaluates in a new folder, which `make` makes once all that can be wrong with the input is known.
    pub fn begin(&self, make: impl FnOnce(&Config) -> Result<Folder, Error>, caller: Caller) -> Result<Outcome, Error> {
        let prepared = self.prepare(&self.config, true)?;
        self.run(&self.config, prepared, Opened::new(make(&self.config)?)?, caller)
    }

    /// Continues a run of this config, and evaluates.
    pub fn resume(&self, resumed: Resumed, caller: Caller) -> Result<Outcome, Error> {
        let prepared = self.prepare(&self.config, resumed.stored.is_none())?;
        self.run(&self.config, prepared, resumed.into(), caller)
    }

    /// Trucks and learner; where the run `begins`, with the policy that it begins with.
    fn prepare(&self, config: &Config, begins: bool) -> Result<Prepared, Error> {
        let backend = Backend::open(config)?;
        let Worlds { training, training_world, .. } = &self.worlds;
        let routes = training.split(Split::Train).to_vec();
        let mut session = backend.guarded(|| Session::new(&backend, config, training_world.clone(), routes))?;
        if begins {
            session.begin()?;
        }
        Ok(Prepared { backend, session, validation: self.worlds.validation(config) })
    }

    /// A run from its beginning or its checkpoint to what it leaves behind, or until it is stopped. `config` is this
    /// training's with any seed.
    fn run(&self, config: &Config, prepared: Prepared, opened: Opened, caller: Caller) -> Result<Outcome, Error> {
        let Prepared { backend, session, validation } = prepared;
        let Opened { folder, mut metrics, stored, has_new_budget } = opened;
        if stored.is_none() {
            // It starts from the beginning: rows that were written before the first checkpoint come again.
            metrics.clear()?;
        }
        let Worlds { training, training_world, .. } = &self.worlds;
        let progress = Progress::new(config, metrics, Box::new(caller));
        let counts = RouteCounts::new(training, folder.routes());
        let mut run = Run::new(backend, config, training_world, session, &folder, progress, counts);
        run.validation = validation;
        let mut resumed = None;
        if let Some(stored) = stored {
            // The earlier evaluation is of another policy as soon as there is a later one.
            let outdate = |run: &Run| {
                files::write_json(&folder.report(), &Outcome { interrupted: true, ..Outcome::of(config, run) })?;
                let _ = std::fs::remove_file(folder.page());
                Ok(())
            };
            run.restore(&stored, Box::new(outdate))?;
            resumed = Some((run.progress.env_steps(), run.progress.seconds()));
        }
        run.continue_kept()?;
        if has_new_budget {
            folder.write_config(config)?;
        }
        if self.tensorboard {
            run.progress.write_events(folder.path())?;
        }
        caller.tell(Event::Begun(Begun {
            folder: folder.path(),
            resumed,
            benchmark: &training.name,
            n_routes: training.split(Split::Train).len(),
            rewards: &config.changed_rewards(),
            device: &run.device(),
        }));
        run.learn(|| caller.stops())?;
        let outcome = Outcome::of(config, &run);
        let written = run.close();
        let policy = run.policy()?;
        if outcome.interrupted && run.has_learned_nothing() && is_evaluated(&folder) {
            written?;
            caller.tell(Event::Finished { folder: &folder, outcome: &outcome });
            return Ok(outcome);
        }
        // Trucks and learner go; the lock is held until the report is written.
        let _metrics = run.into_metrics();
        self.conclude(&folder, outcome, policy, caller, written)
    }

    /// Evaluates the policy of a run that was not interrupted, and writes what the run leaves behind. `written` says
    /// whether its last checkpoint could be written.
    fn conclude(
        &self,
        folder: &Folder,
        mut outcome: Outcome,
        policy: Policy,
        caller: Caller,
        written: Result<(), Error>,
    ) -> Result<Outcome, Error> {
        if outcome.interrupted {
            files::write_json(&folder.report(), &outcome)?;
            written?;
            caller.tell(Event::Finished { folder, outcome: &outcome });
            return Ok(outcome);
        }
        let policy = Policy { name: shown_path(&folder.policy()), ..policy };
        let rule = self.config.rule;
        let evaluated = self.worlds.evaluate(&policy, rule, caller)?;
        outcome.evaluation = evaluated.as_ref().map(|(report, _)| report.clone());
        let further = self.worlds.also.iter().map(|also| also.evaluate(&policy, rule, caller));
        outcome.also = further.collect::<Result<_, _>>()?;
        let mut page = Ok(());
        if let Some((report, tracks)) = evaluated {
            let metrics = read_text(&folder.metrics(), METRICS_LIMIT)
                .inspect_err(|error| caller.tell(Event::Warning(&format!("{error}; the page has no curves"))))
                .ok();
            let (scenario, world) = (&self.worlds.benchmark, &self.worlds.benchmark_world);
            page = Page { scenario, world, evaluation: &report, tracks: &tracks, run: json!(outcome), metrics }
                .write(&folder.page());
        }
        // Last of all: a run that has it is finished.
        let report = files::write_json(&folder.report(), &outcome);
        // The evaluation is told also where it could not be written.
        caller.tell(Event::Finished { folder, outcome: &outcome });
        report?;
        written?;
        page?;
        Ok(outcome)
    }
}
