//! `offtrack evaluate`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use offtrack::scenario::{Scenario, Split};
use offtrack::world::World;
use offtrack_training::error::Error;
use offtrack_training::evaluation::Examination;
use offtrack_training::evaluation::certificate::certified;
use offtrack_training::evaluation::page::{MOST_EPISODES, Page};
use offtrack_training::evaluation::policies::{self as drivers, PURSUIT_LOOK_AHEAD};
use offtrack_training::evaluation::report::{Episode, Summary};
use offtrack_training::files;
use serde_json::Value;

use super::devices as device;

/// Examine a driver on a benchmark's routes.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A policy file, `pursuit` (pure pursuit of the centre line) or `random`. Without it the policy that comes with the program.
    #[arg(long)]
    policy: Option<String>,
    /// A benchmark's name, or the path of its file.
    #[arg(long, default_value = "attard2023")]
    benchmark: String,
    /// Which routes: `test` (never learned on) or `train`.
    #[arg(long, default_value = "test", value_parser = ["test", "train"])]
    split: String,
    /// Episodes on each route.
    #[arg(long, default_value_t = 30)]
    episodes: usize,
    /// What the start poses are drawn from.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Write the report to this file as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Write a page to this file that shows the report and every episode, for a browser.
    #[arg(long)]
    html: Option<PathBuf>,
    /// With --html: the folder of the training run that the driver comes from, to show its curves too.
    #[arg(long, requires = "html")]
    run: Option<PathBuf>,
    /// A certificate of `offtrack certify`: success over the routes that it shows to be possible is reported too.
    #[arg(long)]
    certified: Option<PathBuf>,
    /// With `pursuit`: distance to the point pursued [m].
    #[arg(long, default_value_t = PURSUIT_LOOK_AHEAD, allow_negative_numbers = true)]
    look_ahead: f32,
    #[command(flatten)]
    device: device::Choice,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    if !(1..=100_000).contains(&args.episodes) {
        return Err(Error::Flag { flag: "--episodes", value: args.episodes.to_string(), expected: "must lie in 1..100000".into() });
    }
    let device = args.device.open()?;
    let scenario = Scenario::read(&files::benchmark(&args.benchmark)?)?;
    let world = Arc::new(World::bake(&scenario)?);
    let mut driver = drivers::named(args.policy.as_deref(), &scenario.name, args.look_ahead, args.seed, &world)?;
    let split = if args.split == "train" { Split::Train } else { Split::Test };
    let n_episodes = args.episodes * scenario.split(split).len();
    if args.html.is_some() && MOST_EPISODES < n_episodes {
        let expected = format!("{n_episodes} in all; a page holds {MOST_EPISODES} at most: ask for fewer, or leave --html out");
        return Err(Error::Flag { flag: "--episodes", value: args.episodes.to_string(), expected });
    }
    let (run, metrics) = match &args.run {
        Some(folder) => read_run(folder)?,
        None => (Value::Null, None),
    };
    let possible = args.certified.as_ref().map(|file| certified(file, &scenario, &world, scenario.split(split))).transpose()?;
    let (episodes, seed, record) = (args.episodes, args.seed, args.html.is_some());
    let examination = Examination { scenario: &scenario, world: &world, split, episodes, seed, record, device: &device };
    let (finished, tracks) = examination.drive(driver.as_mut())?;
    let mut report = examination.summarised(driver.name(), &finished);
    report.certified = possible.and_then(|possible| {
        let chunks = scenario.split(split).iter().zip(finished.chunks(args.episodes));
        let kept: Vec<&Episode> = chunks.filter(|(route, _)| possible.contains(route)).flat_map(|(_, chunk)| chunk).collect();
        Summary::of(kept.into_iter(), scenario.step)
    });
    if let Some(file) = &args.json {
        files::write_json(file, &report)?;
    }
    if let Some(file) = &args.html {
        Page { scenario: &scenario, world: &world, evaluation: &report, tracks: &tracks, run, metrics }.write(file)?;
    }
    files::print(&report.table())
}

/// What a run's folder says of it: its report, and the rows of its figures.
fn read_run(folder: &Path) -> Result<(Value, Option<String>), Error> {
    let [report, metrics] = ["report.json", "metrics.csv"].map(|name| folder.join(name));
    let read = |file: &Path| std::fs::read_to_string(file).map_err(Error::read(file));
    let wrong = |message: String| Error::Contents { file: report.clone(), message };
    let run: Value = serde_json::from_str(&read(&report)?).map_err(|error| wrong(format!("{error}; a run's report is needed")))?;
    if run.get("env_steps").is_none() {
        return Err(wrong("has no env_steps; a run's report is needed, as `train` writes it".to_owned()));
    }
    Ok((run, Some(read(&metrics)?)))
}
