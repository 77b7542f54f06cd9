//! `offtrack train`: trains a policy, then evaluates it on the test routes.
//!
//! Everything is written as it comes: the training file at once, a row of metrics every few seconds, policy and
//! checkpoint every few minutes. A stopped run leaves a policy that can be evaluated, and all that it takes to
//! continue.

mod also;
mod args;
mod beginning;
mod seeds;
mod worlds;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use offtrack::files::reader::{read_text, shown_path};
use offtrack::scenario::Split;
use offtrack_evaluation::device::Device;
use offtrack_evaluation::files;
use offtrack_evaluation::page::Page;
use offtrack_evaluation::provenance;
use offtrack_evaluation::recording::Track;
use offtrack_evaluation::report::Report;
use offtrack_evaluation::{Evaluation, usual_episodes};
use offtrack_learner::backend::Backend;
use offtrack_learner::checkpoint::Stored;
use offtrack_learner::config::{self, Config};
use offtrack_learner::error::Error;
use offtrack_learner::mirror::Mirror;
use offtrack_learner::run::Run;
use offtrack_learner::run::folder::Folder;
use offtrack_learner::run::metrics_file::MetricsFile;
use offtrack_learner::run::progress::Progress;
use offtrack_learner::run::resume::Resumed;
use offtrack_learner::run::route_counts::{RouteCounts, WorstRoutes};
use offtrack_learner::run::validation::{Validation, Validations};
use offtrack_learner::session::Session;
use offtrack_policy::Policy;
use serde::Serialize;
use serde_json::json;

use super::{progress, terminal};
use also::AlsoReport;
pub use args::Args;
use worlds::Worlds;

/// Training routes named at the end.
const N_WORST: usize = 5;
/// Most bytes of the metrics that the page shows.
const METRICS_LIMIT: u64 = 64 << 20;

/// A run's result, as written to `report.json`.
#[derive(Debug, Serialize)]
struct Finished {
    /// The run was stopped before its budget was spent.
    interrupted: bool,
    seed: u32,
    /// Training time (s).
    seconds: f64,
    env_steps: u64,
    episodes: u64,
    updates: u64,
    /// Fraction of the latest training episodes that arrived.
    training_success: Option<f64>,
    /// Number of the latest training episodes; each row of the metrics is a mean over as many.
    training_window: u64,
    /// The training routes with least success; none where the trucks were on a device.
    #[serde(skip_serializing_if = "Option::is_none")]
    training_routes: Option<WorstRoutes>,
    /// How the policy did on validation routes, and which one was kept; none without validation.
    #[serde(skip_serializing_if = "Option::is_none")]
    validation: Option<Validations>,
    machine: String,
    /// Where trucks and learner were.
    device: String,
    commit: String,
    /// The final evaluation; none after an interruption.
    evaluation: Option<Report>,
    /// Further evaluations, in the order of `also_evaluate`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    also: Vec<AlsoReport>,
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

    fn resumed(Resumed { folder, metrics, stored, .. }: Resumed, has_new_budget: bool) -> Opened {
        Opened { folder, metrics, stored, has_new_budget }
    }
}

/// What a run has before its folder.
struct Prepared {
    backend: Backend,
    training: Session,
    validation: Option<Validation>,
}

impl Prepared {
    fn new(config: &Config, worlds: &Worlds) -> Result<Prepared, Error> {
        let backend = Backend::open(config)?;
        let routes = worlds.training.split(Split::Train).to_vec();
        let mut training = backend.guarded(|| Session::new(&backend, config, worlds.training_world.clone(), routes))?;
        training.begin()?;
        Ok(Prepared { backend, training, validation: worlds.validation(config) })
    }
}

/// What does not change the policy.
struct Manner {
    /// Which of several seeds it is, as lines begin with; none where it is the only one.
    label: Option<String>,
    /// Rows of metrics go to a TensorBoard event file too.
    tensorboard: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let default = if cfg!(feature = "gpu") { "gpu" } else { "default" };
    let file = args.config.clone().unwrap_or_else(|| PathBuf::from(default));
    if let Some(seeds) = &args.seeds {
        return seeds::run(args, &file, seeds);
    }
    let resumed = args.resume.as_ref().map(|folder| Resumed::open(folder, args.minutes, args.steps)).transpose()?;
    let (config, worlds) = match &resumed {
        Some(Resumed { config, folder, .. }) => (config.clone(), Worlds::read(config, &folder.config())?),
        None => read(args, &file, 1)?,
    };
    // All that can be wrong with the input is found before a folder is made.
    let prepared = Prepared::new(&config, &worlds)?;
    let opened = match resumed {
        Some(resumed) => Opened::resumed(resumed, args.minutes.is_some() || args.steps.is_some()),
        None => {
            let runs = args.out.clone().unwrap_or_else(|| PathBuf::from("runs"));
            Opened::new(Folder::create(&runs, args.name.as_deref(), &file, &config)?)?
        }
    };
    train(&config, &worlds, prepared, opened, &Manner { label: None, tensorboard: args.tensorboard }, &stop_flag())
}

/// A run from its beginning or its checkpoint to what it leaves behind, or until it is stopped.
fn train(
    config: &Config,
    worlds: &Worlds,
    prepared: Prepared,
    opened: Opened,
    manner: &Manner,
    stop: &AtomicU8,
) -> Result<(), Error> {
    let (Prepared { backend, training, validation }, Opened { folder, metrics, stored, has_new_budget }) =
        (prepared, opened);
    let label = manner.label.as_deref().unwrap_or_default();
    let progress = Progress::new(config, metrics, Box::new(progress::TrainingDisplay::new(label)));
    let counts = RouteCounts::new(&worlds.training, folder.routes());
    let mut run = Run::new(backend, config, &worlds.training_world, training, &folder, progress, counts);
    run.validation = validation;
    let mut doing = "training".to_owned();
    if let Some(stored) = stored {
        run.restore(&stored)?;
        // The earlier evaluation was of another policy.
        files::write_json(&folder.report(), &Finished { interrupted: true, ..finished(config, &run) })?;
        let _ = std::fs::remove_file(folder.page());
        doing = format!(
            "continuing after {} env steps and {:.2} min",
            run.progress.env_steps(),
            run.progress.seconds() / 60.0
        );
    }
    if has_new_budget {
        folder.write_config(config)?;
    }
    if manner.tensorboard {
        run.progress.write_events(folder.path())?;
    }
    // Training goes on when nobody reads its lines.
    let (path, n_routes) = (shown_path(folder.path()), worlds.training.split(Split::Train).len());
    let rewards = config.changed_rewards();
    let with = if rewards.is_empty() { String::new() } else { format!(" with {rewards}") };
    let on = format!("{n_routes} training routes of {}{with}, {}", worlds.training.name, run.device());
    let _ = files::print(&format!("{label}{path}: {doing} on {on}\n"));
    run.learn(|| 0 < stop.load(Ordering::Relaxed))?;
    let finished = finished(config, &run);
    let written = run.close();
    let policy = run.policy()?;
    drop(run);
    conclude(&folder, worlds, finished, policy, manner, written)
}

/// The training file of so many runs with what the command line changes, and its benchmarks. Says at once what the runs
/// will do.
fn read(args: &Args, file: &Path, n_runs: usize) -> Result<(Config, Worlds), Error> {
    let mut config = config(args, file)?;
    let _ = files::print(&beginning::line(&config, file, n_runs));
    let worlds = Worlds::read(&config, &Config::origin(file, args.benchmark.as_deref(), &args.settings))?;
    // A benchmark of one's own may have any actions and sensors.
    if let (Some(_), true, Err(error)) =
        (&args.benchmark, config.learning.mirror_augmentation, Mirror::of(&worlds.training_world))
    {
        config.learning.mirror_augmentation = false;
        let _ = writeln!(std::io::stderr(), "note: trains without mirror augmentation: {error}");
    }
    Ok((config, worlds))
}

/// The training file with what the command line changes.
fn config(args: &Args, file: &Path) -> Result<Config, Error> {
    let mut config = Config::read_for(file, args.benchmark.as_deref(), &args.settings)?;
    config.override_with(args.seed, args.minutes, args.steps, args.envs)?;
    let flag = args.steps.map(|steps| PathBuf::from(format!("--steps {steps}")));
    config.check_budget(flag.as_deref().unwrap_or(file))?;
    config.from = args.from.clone().or(config.from);
    if let Some(adapter) = &args.adapter {
        if config.device == config::Device::Cpu {
            let expected = "the training file uses the processor: leave it out, or add --set device=gpu".to_owned();
            return Err(Error::setting("--adapter", adapter, expected));
        }
        config.adapter = Some(adapter.clone());
    }
    Ok(config)
}

/// Evaluates the policy of a run that was not interrupted, and writes what the run leaves behind. `written` says
/// whether its last checkpoint could be written.
fn conclude(
    folder: &Folder,
    worlds: &Worlds,
    mut finished: Finished,
    policy: Policy,
    manner: &Manner,
    written: Result<(), Error>,
) -> Result<(), Error> {
    let path = shown_path(folder.path());
    if finished.interrupted {
        files::write_json(&folder.report(), &finished)?;
        written?;
        return Ok(files::print(&format!(
            "stopped: policy and metrics are in {path}; not evaluated; train --resume {path} continues\n"
        ))?);
    }
    let mut policy = Policy { name: shown_path(&folder.policy()), ..policy };
    let evaluated = evaluate(worlds, &mut policy)?;
    finished.evaluation = evaluated.as_ref().map(|(report, _)| report.clone());
    finished.also = worlds.also.iter().map(|also| also.evaluate(&mut policy)).collect::<Result<_, _>>()?;
    files::write_json(&folder.report(), &finished)?;
    let mut said = String::new();
    if let Some((report, tracks)) = evaluated {
        let metrics = Some(read_text(&folder.metrics(), METRICS_LIMIT)?);
        let (scenario, world) = (&worlds.benchmark, &worlds.benchmark_world);
        Page { scenario, world, evaluation: &report, tracks: &tracks, run: json!(finished), metrics }
            .write(&folder.page())?;
        if manner.label.is_none() {
            said += &report.table(terminal::width());
        }
    }
    // One of several seeds has a line for each evaluation in place of a table of its routes.
    if manner.label.is_some() || !finished.also.is_empty() {
        said += &also::lines(finished.evaluation.as_ref(), &finished.also);
    }
    said += &finished.training_routes.as_ref().map(worst).unwrap_or_default();
    files::print(&format!("{said}written: {path}\n{}", checkpoint(folder)))?;
    // The evaluation is not lost where something else could not be written.
    written
}

/// A line about the checkpoint of a run that has finished.
fn checkpoint(folder: &Folder) -> String {
    let file = folder.checkpoint();
    let Ok(size) = std::fs::metadata(&file).map(|metadata| metadata.len()) else { return String::new() };
    let megabytes = size.div_ceil(1_000_000);
    format!(
        "{} ({megabytes} MB) is for train --resume with more --steps or --minutes alone; it may be deleted\n",
        shown_path(&file)
    )
}

/// The evaluation on `benchmark`, with the episodes that its page shows; none where it has no test routes.
fn evaluate(worlds: &Worlds, policy: &mut Policy) -> Result<Option<(Report, Vec<Track>)>, Error> {
    let n_routes = worlds.benchmark.split(Split::Test).len();
    if n_routes == 0 {
        return Ok(None);
    }
    let evaluation = Evaluation {
        scenario: &worlds.benchmark,
        world: &worlds.benchmark_world,
        split: Split::Test,
        episodes: usual_episodes(n_routes),
        seed: 0,
        record: true,
        device: &Device::processor(),
    };
    let bar = progress::Bar::new("evaluating", "episodes", 0);
    Ok(Some(evaluation.report(policy, &mut |done, all| bar.set(done, all))?))
}

/// A line about the training routes with least success.
fn worst(WorstRoutes { routes, window, worst }: &WorstRoutes) -> String {
    let shown: Vec<String> = worst
        .iter()
        .take(N_WORST)
        .map(|route| format!("{} {:.0} %", route.route, 100.0 * route.recent_success))
        .collect();
    if shown.is_empty() {
        return String::new();
    }
    format!("least success of {routes} training routes, latest {window} episodes of each: {}\n", shown.join(", "))
}

/// Counts Ctrl-C, SIGTERM and SIGHUP: the first lets the step in hand finish and everything be written, the second ends
/// the process.
fn stop_flag() -> Arc<AtomicU8> {
    let stop = Arc::new(AtomicU8::new(0));
    let flag = stop.clone();
    // Without a handler a signal ends the process at once; the last policy and checkpoint are whole all the same.
    let _ = ctrlc::set_handler(move || {
        if 0 < flag.fetch_add(1, Ordering::Relaxed) {
            files::remove_temporaries();
            std::process::exit(130);
        }
    });
    stop
}

/// A run's result before its evaluation.
fn finished(config: &Config, run: &Run) -> Finished {
    let progress = &run.progress;
    Finished {
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
