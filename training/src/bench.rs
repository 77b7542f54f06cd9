//! Measures env steps per second against the number of trucks, and what each stage takes; with `--learner` the time of an update.
//!
//! Speeds are medians over windows of about a quarter of a second: other work on the machine disturbs some windows, not most.

mod learner;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use offtrack::layout::{N_RAYS, N_VALUES};
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::stages::STAGES;
use offtrack::world::World;
use serde::Serialize;

use crate::error::Error;
use crate::files;
use crate::provenance;

/// Measure env steps per second, random actions drawn inside, or what an update of the learner takes.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Numbers of trucks, separated by commas.
    #[arg(long, value_delimiter = ',', default_value = "64,256,1024,4096,16384")]
    envs: Vec<usize>,
    /// Time for each number of trucks, or of transitions [s].
    #[arg(long, default_value_t = 5.0, allow_negative_numbers = true)]
    seconds: f64,
    /// A benchmark's name, or the path of its file.
    #[arg(long, default_value = "attard2023")]
    benchmark: String,
    /// Write the result to this file as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Measure the learner instead: the time of an update, alone and with drawing its batch.
    #[arg(long, conflicts_with_all = ["envs", "benchmark"])]
    learner: bool,
    /// Sizes of the learner's hidden layers, separated by commas.
    #[arg(long, requires = "learner", value_delimiter = ',', default_value = "256,256")]
    hidden: Vec<usize>,
    /// Transitions in an update; several numbers, separated by commas, are measured one after the other.
    #[arg(long, requires = "learner", value_delimiter = ',', default_value = "256,1024")]
    batch: Vec<usize>,
    /// Measure a round of `--seconds` for each line read and print it as a line of JSON.
    #[arg(long, requires = "learner", conflicts_with = "json")]
    lines: bool,
}

/// The result, as written.
#[derive(Debug, Serialize)]
struct Bench {
    machine: String,
    threads: usize,
    commit: String,
    date: String,
    benchmark: String,
    step: Step,
    runs: Vec<Run>,
}

/// What an env step is here.
#[derive(Debug, Serialize)]
struct Step {
    dt: f64,
    substeps: u32,
    rays: usize,
    values: usize,
    actions: &'static str,
}

#[derive(Debug, Serialize)]
struct Run {
    engine: &'static str,
    envs: usize,
    env_steps_per_second: f64,
    windows: usize,
    slowest_window: f64,
    fastest_window: f64,
    /// Time of each stage when the batch is stepped a stage at a time [ns a truck].
    #[serde(serialize_with = "as_map")]
    stages: Vec<(&'static str, f64)>,
}

/// Pairs as a map in their own order.
fn as_map<S: serde::Serializer>(pairs: &[(&'static str, f64)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().copied())
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    if let Some(envs) = args.envs.iter().find(|envs| !(1..=1 << 22).contains(*envs)) {
        return Err(Error::Flag { flag: "--envs", value: envs.to_string(), expected: "must lie in 1..4194304".into() });
    }
    if !(0.1..=3600.0).contains(&args.seconds) {
        return Err(Error::Flag { flag: "--seconds", value: format!("{} s", args.seconds), expected: "must lie in 0.1..3600 s".into() });
    }
    if args.learner {
        return learner::run(args);
    }
    let scenario = Scenario::read(&files::benchmark(&args.benchmark)?)?;
    let world = Arc::new(World::bake(&scenario));
    let routes = [scenario.split(Split::Train), scenario.split(Split::Test)].concat();
    let mut bench = Bench {
        machine: provenance::machine(),
        threads: rayon::current_num_threads(),
        commit: provenance::commit(),
        date: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
        benchmark: scenario.name.clone(),
        step: Step { dt: scenario.step, substeps: scenario.n_substeps, rays: N_RAYS, values: N_VALUES, actions: "random, drawn inside" },
        runs: Vec::new(),
    };
    files::print(&format!(
        "{}, {} threads; a step is {} s in {} sub-steps, {N_RAYS} rays, {N_VALUES} values, random actions drawn inside\n",
        bench.machine, bench.threads, scenario.step, scenario.n_substeps
    ))?;
    let names: Vec<String> = STAGES.iter().map(|stage| format!("{:>8}", stage.name)).collect();
    files::print(&format!("{:>8} {:>14}   ns a truck, a stage at a time:{}\n", "trucks", "env steps/s", names.join("")))?;
    for &envs in &args.envs {
        let mut simulator = Simulator::new(world.clone(), envs, 0, RouteChoice::Drawn(routes.clone()))?;
        let run = measured(&mut simulator, args.seconds)?;
        let stages: Vec<String> = run.stages.iter().map(|(_, time)| format!("{time:>8.0}")).collect();
        files::print(&format!("{:>8} {:>14.0}                                 {}\n", envs, run.env_steps_per_second, stages.join("")))?;
        bench.runs.push(run);
        if let Some(file) = &args.json {
            files::write_json(file, &bench)?;
        }
    }
    Ok(())
}

/// Three quarters of the time for whole steps, the rest a stage at a time.
fn measured(simulator: &mut Simulator, seconds: f64) -> Result<Run, Error> {
    let envs = simulator.batch().n_envs();
    // Trucks all begin at once: let their episodes spread out first.
    let warm = Instant::now();
    while warm.elapsed().as_secs_f64() < 0.1 * seconds {
        simulator.step_at_random();
    }
    let mut windows = Vec::new();
    let begun = Instant::now();
    while begun.elapsed().as_secs_f64() < 0.7 * seconds {
        let (window, mut steps) = (Instant::now(), 0);
        while window.elapsed() < Duration::from_millis(250).min(Duration::from_secs_f64(0.2 * seconds)) {
            simulator.step_at_random();
            steps += 1;
        }
        windows.push((steps * envs) as f64 / window.elapsed().as_secs_f64());
    }
    let mut times: [Vec<f64>; STAGES.len()] = Default::default();
    let begun = Instant::now();
    while begun.elapsed().as_secs_f64() < 0.2 * seconds || times[0].is_empty() {
        for (times, time) in times.iter_mut().zip(simulator.step_at_random_by_stage()?) {
            times.push(time.as_secs_f64() * 1e9 / envs as f64);
        }
    }
    let stages = STAGES.iter().zip(&mut times).map(|(stage, times)| (stage.name, rounded(median(times))));
    Ok(Run {
        engine: "cpu",
        envs,
        env_steps_per_second: median(&mut windows).round(),
        windows: windows.len(),
        slowest_window: windows.first().copied().unwrap_or(0.0).round(),
        fastest_window: windows.last().copied().unwrap_or(0.0).round(),
        stages: stages.collect(),
    })
}

/// The middle value; sorts on the way.
fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

fn rounded(value: f64) -> f64 {
    (10.0 * value).round() / 10.0
}
