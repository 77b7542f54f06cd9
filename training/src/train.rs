//! The main job: trucks drive, the learner learns, and at the end the driver is examined on routes it never saw.
//!
//! Everything is written as it comes: the config at once, a row of figures every few seconds, the policy every minute. A run that is
//! stopped leaves a driver that can be examined.

mod folder;
mod progress;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::{Duration, Instant};

use offtrack::layout::N_VALUES;
use offtrack::random;
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::world::World;
use rand::SeedableRng;
use rand::rngs::SmallRng;
use serde::Serialize;
use serde_json::json;

use crate::bridge;
use crate::config::Config;
use crate::drivers::Learned;
use crate::error::Error;
use crate::evaluate::examine;
use crate::files;
use crate::memory::Memory;
use crate::page::Page;
use crate::policy::{self, Policy};
use crate::provenance;
use crate::report::Report;
use crate::sac::{Sac, Update};
use crate::scaling::Scaling;
use folder::Folder;
use progress::Progress;

/// Time between two saved policies.
const SAVE_EVERY: Duration = Duration::from_secs(60);
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
    /// Another value of one of the training file's keys, as in `learning.n_steps=5`; nothing after the `=` leaves the key out. May be
    /// given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
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
    commit: String,
    /// The closing examination; none after an interruption.
    evaluation: Option<Report>,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let default = || {
        let here = PathBuf::from("training/configs/default.toml");
        if here.is_file() { here } else { files::repository().join(here) }
    };
    let file = args.config.clone().unwrap_or_else(default);
    let mut config = Config::read_with(&file, &args.settings)?;
    config.override_with(args.seed, args.minutes, args.steps, args.envs)?;
    let scenario = Scenario::read(&files::benchmark(&config.benchmark)?)?;
    let practice = practice(&config, &scenario)?;
    let (world, practice_world) = (Arc::new(World::bake(&scenario)), Arc::new(World::bake(&practice)));
    if practice_world.actions != world.actions {
        let expected = format!("its actions and vehicle lock must be those of {}, on which the driver is examined", scenario.name);
        return Err(Error::Flag { flag: "practice", value: practice.name, expected });
    }
    let runs = args.out.clone().unwrap_or_else(|| PathBuf::from("runs"));
    let folder = Folder::create(&runs, args.name.as_deref(), &file, &config)?;
    let n_routes = practice.split(Split::Train).len();
    // A run goes on when nobody reads its lines.
    let _ = files::print(&format!("{}: learning on {n_routes} training routes of {}\n", folder.path().display(), practice.name));
    let stop = stop_flag();
    let (policy, mut finished) = learn(&config, &practice, &practice_world, &folder, stop)?;
    policy.save(&folder.policy())?;
    if finished.interrupted {
        files::write_json(&folder.report(), &finished)?;
        return files::print(&format!("stopped: policy and figures are in {}; not examined\n", folder.path().display()));
    }
    if scenario.split(Split::Test).is_empty() {
        files::write_json(&folder.report(), &finished)?;
        return files::print(&format!("written: {}\n", folder.path().display()));
    }
    let mut driver = Learned { name: folder.policy().display().to_string(), policy };
    let (report, tracks) = examine(&scenario, &world, Split::Test, EPISODES, 0, &mut driver, true)?;
    let table = report.table();
    finished.evaluation = Some(report.clone());
    files::write_json(&folder.report(), &finished)?;
    let metrics = std::fs::read_to_string(folder.metrics()).map_err(Error::read(&folder.metrics()))?;
    Page { scenario: &scenario, world: &world, evaluation: &report, tracks: &tracks, run: json!(finished), metrics: Some(metrics) }
        .write(&folder.page())?;
    files::print(&format!("{table}written: {}\n", folder.path().display()))
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
    // Without a handler Ctrl-C ends the process at once; the last saved policy is whole all the same.
    let _ = ctrlc::set_handler(move || {
        if 0 < flag.fetch_add(1, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    stop
}

/// The loop: act, step, remember, learn. Ends with the time, the steps, or Ctrl-C.
fn learn(
    config: &Config,
    scenario: &Scenario,
    world: &Arc<World>,
    folder: &Folder,
    stop: Arc<AtomicU8>,
) -> Result<(Policy, Finished), Error> {
    let learning = &config.learning;
    let n_actions = world.actions.len();
    let routes = RouteChoice::Drawn(scenario.split(Split::Train).to_vec());
    let mut simulator = Simulator::new(world.clone(), config.n_envs, config.seed, routes)?;
    let mut memory: Memory<N_VALUES> = Memory::new(config.n_envs, learning.n_steps, &config.memory);
    let stream = |purpose: u32| SmallRng::seed_from_u64(u64::from(random::words(config.seed, purpose, 0, u32::MAX)[0]));
    let (mut acting, mut sampling) = (stream(1), stream(2));
    let mut sac = Sac::new(learning, N_VALUES, n_actions, u64::from(config.seed))?;
    let mut progress = Progress::new(config, folder)?;
    let mut seen = Vec::new();

    // Chance drives until there is enough to tell how the observed values lie; their scaling then stays.
    let stopped = || 0 < stop.load(Ordering::Relaxed);
    let ready = |memory: &Memory<N_VALUES>| config.memory.warmup <= memory.len() && memory.can_sample();
    while !ready(&memory) && progress.share() < 1.0 && !stopped() {
        seen.clone_from(&simulator.batch().observation);
        simulator.step_at_random();
        bridge::remember(&mut memory, &seen, simulator.batch());
        progress.stepped(simulator.batch());
    }
    let scaling = if learning.scale_observations { Scaling::of(memory.observations()) } else { Scaling::none(N_VALUES) };
    let policy = |sac: &Sac| Policy {
        benchmark: config.benchmark.clone(),
        actions: world.actions.clone(),
        scaling: scaling.clone(),
        actor: sac.average_actor().clone(),
    };

    let mut saved = Instant::now();
    while progress.share() < 1.0 && !stopped() {
        seen.clone_from(&simulator.batch().observation);
        let mut actions = policy::drawn(&bridge::logits(&sac.actor(), &scaling, &seen), n_actions, &mut acting);
        if let Some(exploration) = &config.exploration {
            exploration.explore(progress.env_steps(), n_actions, &mut actions, &mut acting);
        }
        simulator.step(&actions)?;
        bridge::remember(&mut memory, &seen, simulator.batch());
        progress.stepped(simulator.batch());
        let pace = 1.0 - (1.0 - learning.last_rate) * progress.share();
        for _ in 0..learning.updates_per_step {
            let sample = memory.sample(learning.batch, learning.discount as f32, &mut sampling);
            let (update, errors) = sac.update(bridge::parts(&sample, &scaling, learning, &mut sampling), pace);
            check(&update, progress.env_steps(), folder.path())?;
            memory.learned(&sample, &errors);
            progress.updated(&update);
        }
        progress.report(sac.entropy_weight())?;
        if SAVE_EVERY <= saved.elapsed() {
            policy(&sac).save(&folder.policy())?;
            saved = Instant::now();
        }
    }
    progress.finish(sac.entropy_weight())?;
    let finished = Finished {
        interrupted: stopped(),
        seed: config.seed,
        seconds: progress.seconds(),
        env_steps: progress.env_steps(),
        episodes: progress.episodes(),
        updates: progress.updates(),
        training_success: progress.success(),
        training_window: progress::WINDOW,
        machine: provenance::machine(),
        commit: provenance::commit(),
        evaluation: None,
    };
    Ok((policy(&sac), finished))
}

/// A loss that is no number says that the learner has broken down; what it knew before is in the folder.
fn check(update: &Update, env_steps: u64, folder: &Path) -> Result<(), Error> {
    for (what, value) in [("critic loss", update.critic_loss), ("actor loss", update.actor_loss), ("entropy", update.entropy)] {
        if !value.is_finite() {
            return Err(Error::Diverged { what, value, env_steps, folder: folder.to_owned() });
        }
    }
    Ok(())
}
