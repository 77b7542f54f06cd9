//! The main job: trucks drive, the learner learns, and at the end the driver is examined on routes it never saw.
//!
//! Everything is written as it comes: the config at once, a row of figures every few seconds, the policy and a checkpoint every few
//! minutes. A run that is stopped leaves a driver that can be examined and all that it takes to go on.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use offtrack::scenario::{Scenario, Split};
use offtrack::world::World;
use serde::Serialize;
use serde_json::json;

use offtrack_training::device::Device;
use offtrack_training::error::Error;
use offtrack_training::evaluation::Examination;
use offtrack_training::evaluation::page::Page;
use offtrack_training::evaluation::policies::Learned;
use offtrack_training::evaluation::report::Report;
use offtrack_training::files;
#[cfg(feature = "gpu")]
use offtrack_training::learner::bridge::device::Shared;
use offtrack_training::learner::checkpoint::Stored;
use offtrack_training::learner::config::{self, Config};
use offtrack_training::learner::run::folder::Folder;
use offtrack_training::learner::run::metrics::Figures;
use offtrack_training::learner::run::progress::Progress;
use offtrack_training::learner::run::resume::Resumed;
use offtrack_training::learner::run::{self, Run};
use offtrack_training::policy::Policy;
use offtrack_training::provenance;

/// Episodes on each route in the closing examination.
const EPISODES: usize = 30;

/// Learn to drive, then examine the driver on the test routes.
#[derive(Debug, Default, clap::Args)]
pub struct Args {
    /// A training file; without it training/configs/default.toml.
    config: Option<PathBuf>,
    /// Name of the run's folder; must be new. Without it the training file's name, numbered.
    #[arg(long)]
    name: Option<String>,
    /// Folder of runs.
    #[arg(long, default_value = "runs")]
    out: Option<PathBuf>,
    /// Another seed than the training file's.
    #[arg(long)]
    seed: Option<u32>,
    /// Another time to learn for [min].
    #[arg(long, allow_negative_numbers = true)]
    minutes: Option<f64>,
    /// Another number of env steps to learn for.
    #[arg(long)]
    steps: Option<u64>,
    /// Another number of trucks.
    #[arg(long)]
    envs: Option<usize>,
    /// Part of the name of another graphics adapter, see `offtrack devices`.
    #[arg(long)]
    adapter: Option<String>,
    /// Another value of one of the training file's keys, as in `learning.n_steps=5`; nothing after the `=` leaves the key out. May be
    /// given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Goes on with a run that was stopped, from the last checkpoint in its folder, as its own config.toml says. With --minutes or --steps
    /// it learns for so long in all; learning rates fall until that end, so with a later one they are higher from here on than they
    /// would have been, and a finished run goes on too. With `steps` alone the result is that of a run never stopped, bit for bit on the
    /// same machine and program.
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["config", "name", "out", "seed", "envs", "adapter", "settings"])]
    resume: Option<PathBuf>,
}

/// What a run came to, as written to `report.json`.
#[derive(Debug, Serialize)]
struct Finished {
    /// The run was stopped before its time.
    interrupted: bool,
    seed: u32,
    /// Time spent learning [s].
    seconds: f64,
    env_steps: u64,
    episodes: u64,
    updates: u64,
    /// Share of the last training episodes that arrived.
    training_success: Option<f64>,
    /// How many episodes that is a share of, and each row of the metrics a mean over.
    training_window: usize,
    machine: String,
    /// Where trucks and learner were.
    device: String,
    commit: String,
    /// The closing examination; none after an interruption.
    evaluation: Option<Report>,
}

/// Where a run writes, and where it begins.
struct Begun {
    folder: Folder,
    figures: Figures,
    /// What it goes on from.
    stored: Option<Stored>,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let default = || {
        let here = PathBuf::from(if cfg!(feature = "gpu") { "training/configs/gpu.toml" } else { "training/configs/default.toml" });
        if here.is_file() { here } else { files::repository().join(here) }
    };
    let file = args.config.clone().unwrap_or_else(default);
    let resumed = args.resume.as_ref().map(|folder| Resumed::open(folder, args.minutes, args.steps)).transpose()?;
    let config = match &resumed {
        Some(resumed) => resumed.config.clone(),
        None => {
            let mut config = Config::read_with(&file, &args.settings)?;
            config.override_with(args.seed, args.minutes, args.steps, args.envs)?;
            if let Some(adapter) = &args.adapter {
                if config.device == config::Device::Cpu {
                    let expected = "the training file learns on the processor: leave it out, or add --set device=gpu".to_owned();
                    return Err(Error::Flag { flag: "--adapter", value: adapter.clone(), expected });
                }
                config.adapter = Some(adapter.clone());
            }
            config
        }
    };
    let scenario = Scenario::read(&files::benchmark(&config.benchmark)?)?;
    let practice = practice(&config, &scenario)?;
    let (world, practice_world) = (Arc::new(World::bake(&scenario)?), Arc::new(World::bake(&practice)?));
    if practice_world.actions != world.actions {
        let expected = format!("its actions and vehicle lock must be those of {}, on which the driver is examined", scenario.name);
        return Err(Error::Flag { flag: "practice", value: practice.name, expected });
    }
    // What cannot learn leaves no folder behind.
    let place = Place::open(&config)?;
    let Begun { folder, figures, stored } = match resumed {
        Some(Resumed { folder, figures, stored, .. }) => Begun { folder, figures, stored: Some(stored) },
        None => {
            let runs = args.out.clone().unwrap_or_else(|| PathBuf::from("runs"));
            let folder = Folder::create(&runs, args.name.as_deref(), &file, &config)?;
            Begun { figures: Figures::create(folder.metrics())?, stored: None, folder }
        }
    };
    let routes = practice.split(Split::Train).to_vec();
    let n_routes = routes.len();
    let mut run = Job::new(place, &config, routes.clone(), practice_world, &folder, Progress::new(&config, figures))?;
    let mut doing = "learning".to_owned();
    if let Some(stored) = stored {
        run.restore(&stored, routes)?;
        if args.minutes.is_some() || args.steps.is_some() {
            folder.write_config(&config)?;
        }
        // What an examination said of the driver before is not said of the one to come.
        files::write_json(&folder.report(), &Finished { interrupted: true, ..finished(&config, &run) })?;
        let _ = std::fs::remove_file(folder.page());
        doing = format!("going on after {} env steps and {:.2} min,", run.progress().env_steps(), run.progress().seconds() / 60.0);
    }
    // A run goes on when nobody reads its lines.
    let _ = files::print(&format!(
        "{}: {doing} on {n_routes} training routes of {}, {}\n",
        folder.path().display(),
        practice.name,
        run.device()
    ));
    let stop = stop_flag();
    run.learn(|| 0 < stop.load(Ordering::Relaxed))?;
    let mut finished = finished(&config, &run);
    let written = run.close();
    let policy = run.policy()?;
    drop(run);
    if finished.interrupted {
        files::write_json(&folder.report(), &finished)?;
        written?;
        let path = folder.path().display();
        return files::print(&format!("stopped: policy and figures are in {path}; not examined; train --resume {path} goes on\n"));
    }
    if scenario.split(Split::Test).is_empty() {
        files::write_json(&folder.report(), &finished)?;
        written?;
        return files::print(&format!("written: {}\n", folder.path().display()));
    }
    let mut driver = Learned { name: folder.policy().display().to_string(), policy };
    let examination = Examination {
        scenario: &scenario,
        world: &world,
        split: Split::Test,
        episodes: EPISODES,
        seed: 0,
        record: true,
        device: &Device::processor(),
    };
    let (report, tracks) = examination.report(&mut driver)?;
    let table = report.table();
    finished.evaluation = Some(report.clone());
    files::write_json(&folder.report(), &finished)?;
    let metrics = std::fs::read_to_string(folder.metrics()).map_err(Error::read(&folder.metrics()))?;
    Page { scenario: &scenario, world: &world, evaluation: &report, tracks: &tracks, run: json!(finished), metrics: Some(metrics) }
        .write(&folder.page())?;
    files::print(&format!("{table}written: {}\n", folder.path().display()))?;
    // The examination is not lost where something else could not be written.
    written
}

/// Where a run can be.
enum Place {
    Host,
    #[cfg(feature = "gpu")]
    Device(Box<Shared>),
}

impl Place {
    /// The place that the config names, ready to work.
    fn open(config: &Config) -> Result<Place, Error> {
        match config.device {
            config::Device::Cpu => Ok(Place::Host),
            #[cfg(feature = "gpu")]
            config::Device::Gpu => Ok(Place::Device(Box::new(Shared::open(config.adapter.as_deref())?))),
            #[cfg(not(feature = "gpu"))]
            config::Device::Gpu => {
                let expected = "this program was built without the feature `gpu`: build it with `--features gpu`, or set device = \"cpu\"";
                Err(Error::Flag { flag: "device", value: "\"gpu\"".to_owned(), expected: expected.to_owned() })
            }
        }
    }
}

/// A run, where its config wants it.
enum Job {
    Host(Box<Run>),
    #[cfg(feature = "gpu")]
    Device(Box<run::device::DeviceRun>),
}

impl Job {
    fn new(place: Place, config: &Config, routes: Vec<u32>, world: Arc<World>, folder: &Folder, progress: Progress) -> Result<Job, Error> {
        match place {
            Place::Host => Ok(Job::Host(Box::new(Run::new(config, routes, world, folder, progress)?))),
            #[cfg(feature = "gpu")]
            Place::Device(shared) => {
                Ok(Job::Device(Box::new(run::device::DeviceRun::new(*shared, config, routes, world, folder, progress)?)))
            }
        }
    }

    /// What it runs on.
    fn device(&self) -> String {
        match self {
            Job::Host(_) => "cpu".to_owned(),
            #[cfg(feature = "gpu")]
            Job::Device(run) => run.device(),
        }
    }

    fn progress(&self) -> &Progress {
        match self {
            Job::Host(run) => &run.progress,
            #[cfg(feature = "gpu")]
            Job::Device(run) => &run.progress,
        }
    }

    fn learn(&mut self, stopped: impl Fn() -> bool) -> Result<(), Error> {
        match self {
            Job::Host(run) => run.learn(stopped),
            #[cfg(feature = "gpu")]
            Job::Device(run) => run.learn(stopped),
        }
    }

    /// Goes on from a checkpoint, on the same routes as before.
    #[cfg_attr(not(feature = "gpu"), expect(unused_variables, reason = "trucks on the processor are in the checkpoint"))]
    fn restore(&mut self, stored: &Stored, routes: Vec<u32>) -> Result<(), Error> {
        match self {
            Job::Host(run) => run.restore(stored),
            #[cfg(feature = "gpu")]
            Job::Device(run) => run.restore(stored, routes),
        }
    }

    fn policy(&self) -> Result<Policy, Error> {
        match self {
            Job::Host(run) => Ok(run.policy()),
            #[cfg(feature = "gpu")]
            Job::Device(run) => run.policy(),
        }
    }

    fn close(&mut self) -> Result<(), Error> {
        match self {
            Job::Host(run) => run.close(),
            #[cfg(feature = "gpu")]
            Job::Device(run) => run.close(),
        }
    }
}

/// What is practised on: the benchmark, or what the config names in its place. No route that the driver will be examined on may be in it.
fn practice(config: &Config, benchmark: &Scenario) -> Result<Scenario, Error> {
    let practice = Scenario::read(&files::benchmark(config.practice.as_ref().unwrap_or(&config.benchmark))?)?;
    let examined = benchmark.split_names(Split::Test);
    if let Some(route) = practice.split_names(Split::Train).into_iter().find(|route| examined.contains(route)) {
        let expected = format!("{route} is a test route of {} and must not be practised on", benchmark.name);
        return Err(Error::Flag { flag: "practice", value: practice.name, expected });
    }
    if practice.split(Split::Train).is_empty() {
        let expected = "it has no routes under `train` to learn on".to_owned();
        return Err(Error::Flag { flag: "practice", value: practice.name, expected });
    }
    Ok(practice)
}

/// Counts Ctrl-C: the first lets the step in hand finish and everything be written, the second ends the process.
fn stop_flag() -> Arc<AtomicU8> {
    let stop = Arc::new(AtomicU8::new(0));
    let flag = stop.clone();
    // Without a handler Ctrl-C ends the process at once; the last policy and checkpoint are whole all the same.
    let _ = ctrlc::set_handler(move || {
        if 0 < flag.fetch_add(1, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    stop
}

/// What a run has come to before its examination.
fn finished(config: &Config, run: &Job) -> Finished {
    let progress = run.progress();
    Finished {
        interrupted: progress.share() < 1.0,
        seed: config.seed,
        seconds: progress.seconds(),
        env_steps: progress.env_steps(),
        episodes: progress.episodes(),
        updates: progress.updates(),
        training_success: progress.success(),
        training_window: progress.window(),
        machine: provenance::machine(),
        device: run.device(),
        commit: provenance::commit(),
        evaluation: None,
    }
}
