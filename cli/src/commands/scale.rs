//! `offtrack scale`: env steps per second against the number of trucks, on the processor or on a device, by mode and by
//! stage.
//!
//! A size that an adapter cannot hold is a result too: it is in the file with the reason, and the others go on.

mod measure;
mod mode;
mod plot;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Instant, SystemTime};

use indicatif::{ProgressBar, ProgressStyle};
use offtrack::layout::N_RAYS;
use offtrack::scenario::Split;
use offtrack::world::World;
use serde::Serialize;

use measure::{Measured, measured};
pub(crate) use measure::{median, rounded};
use mode::{Learner, Mode, Setting};
use offtrack_commands::{devices, outputs, roads};
use offtrack_evaluation::device::Device;
use offtrack_evaluation::files;
use offtrack_evaluation::provenance;
use offtrack_learner::error::Error;
use offtrack_learner::panics;

/// The largest batch that may be asked for.
const MOST_ENVS: usize = 1 << 22;
/// Steps of a submission where nobody says it.
const SUBMISSION: u32 = 8;
/// A range of sizes goes up by this factor.
const FACTOR: usize = 4;

/// Measure env steps per second against the number of trucks, and what each stage takes.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    device: devices::Choice,
    /// Numbers of trucks, separated by commas; `256..1048576` is a range in steps of four times as many.
    #[arg(long, default_value = "64,256,1024,4096,16384")]
    envs: String,
    /// Where the actions come from, separated by commas.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "random")]
    mode: Vec<Mode>,
    /// With `--mode training`: the training file, its path or name; without it `gpu`. `--envs` replaces its number of
    /// trucks, and its replay buffer is as small as an update allows.
    #[arg(long)]
    config: Option<PathBuf>,
    /// With --mode random on a device: steps that are submitted at once, 8 where nobody says it.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    submission: Option<u32>,
    /// Time for each number of trucks and each mode (s).
    #[arg(long, default_value_t = 5.0)]
    seconds: f64,
    /// A benchmark's name, or the path of its file.
    #[arg(long, default_value = "attard2023")]
    benchmark: String,
    /// Write the result to this file as JSON, again after each number of trucks.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Draw the result into this file, .svg or .png, again after each number of trucks.
    #[arg(long)]
    plot: Option<PathBuf>,
}

/// The result, as written.
#[derive(Debug, Serialize)]
struct Scale {
    /// `cpu` or `gpu`.
    engine: &'static str,
    /// The adapter with its interface and driver, or `cpu`.
    device: String,
    /// The processor.
    machine: String,
    threads: usize,
    commit: String,
    date: String,
    benchmark: String,
    step: Step,
    /// Memory of what all trucks share.
    world_bytes: usize,
    roundabouts: usize,
    routes: usize,
    /// Time to read the benchmark and draw its random roads, and to bake its world; a cache makes both shorter.
    seconds_to_read: f64,
    seconds_to_bake: f64,
    /// Steps that were submitted at once to a device where actions were random.
    submission: u32,
    runs: Vec<Run>,
}

/// What an env step is here, and what is counted.
#[derive(Debug, Serialize)]
struct Step {
    dt: f64,
    substeps: u32,
    rays: usize,
    values: usize,
    /// What is in a step.
    holds: &'static str,
    /// What rays/s counts.
    rays_counted: &'static str,
    /// What the speeds are.
    speeds: &'static str,
    /// Updates after each step of all trucks in training, and their transitions.
    #[serde(skip_serializing_if = "Option::is_none")]
    learning: Option<Updates>,
}

#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Updates {
    updates_per_step: usize,
    batch: usize,
}

/// One number of trucks in one mode.
#[derive(Debug, Serialize)]
struct Run {
    mode: Mode,
    envs: usize,
    #[serde(flatten)]
    outcome: Outcome,
}

/// The result of a run.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Outcome {
    Measured(Box<Measured>),
    Refused { error: String },
}

impl Scale {
    /// The runs of a mode that could be measured, fewest trucks first.
    fn measured(&self, mode: Mode) -> Vec<(usize, &Measured)> {
        let mut runs: Vec<(usize, &Measured)> =
            self.runs.iter().filter(|run| run.mode == mode).filter_map(Run::measured).collect();
        runs.sort_by_key(|(envs, _)| *envs);
        runs
    }
}

impl Run {
    fn measured(&self) -> Option<(usize, &Measured)> {
        match &self.outcome {
            Outcome::Measured(measured) => Some((self.envs, measured)),
            Outcome::Refused { .. } => None,
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let envs = sizes(&args.envs)?;
    check(args)?;
    let device = args.device.open()?;
    let start = Instant::now();
    let scenario = roads::benchmark(&args.benchmark)?;
    let drawn = start.elapsed();
    let world = roads::world(&scenario)?;
    let baked = start.elapsed() - drawn;
    let learner = match args.mode.iter().any(|mode| *mode != Mode::Random) {
        true => {
            Some(Learner::read(&scenario.name, &args.config.clone().unwrap_or_else(|| PathBuf::from("gpu")), &world)?)
        }
        false => None,
    };
    let mut scale = Scale {
        engine: device.kind(),
        device: device.name.clone(),
        machine: provenance::machine(),
        threads: rayon::current_num_threads(),
        commit: provenance::commit(),
        date: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
        benchmark: scenario.name.clone(),
        step: Step {
            dt: scenario.step,
            substeps: scenario.n_substeps,
            rays: N_RAYS,
            values: world.observation_layout().n_values(),
            holds: "physics, collision, progress, rays, observation, reward, and a new episode where one ended",
            rays_counted: "those of every step, and once more those after each reset",
            speeds: "medians over windows, nothing read back within one; stages are timed apart, each over the whole \
                batch",
            learning: learner.as_ref().filter(|_| args.mode.contains(&Mode::Training)).map(Learner::updates),
        },
        world_bytes: world.bytes(),
        roundabouts: world.fields.len(),
        routes: world.routes.len(),
        seconds_to_read: drawn.as_secs_f64(),
        seconds_to_bake: baked.as_secs_f64(),
        submission: args.submission.unwrap_or(SUBMISSION),
        runs: Vec::new(),
    };
    files::print(&heading(&scale, &device))?;
    let routes = Split::ALL.map(|split| scenario.split(split)).concat();
    let place = Place { world, routes, learner };
    measure_all(args, &envs, &place, device, &mut scale)
}

/// An error for flags that cannot be used, or not together.
fn check(args: &Args) -> Result<(), Error> {
    if !(0.1..=3600.0).contains(&args.seconds) {
        return Err(Error::setting("--seconds", format!("{} s", args.seconds), "must lie in 0.1..3600 s"));
    }
    if let Some(file) = &args.plot {
        offtrack_commands::plot::check("--plot", file)?;
    }
    if let Some(file) = args.config.as_ref().filter(|_| !args.mode.contains(&Mode::Training)) {
        let expected = "is for --mode training: add that mode, or leave --config out".to_owned();
        return Err(Error::setting("--config", file.display().to_string(), expected));
    }
    if let Some(submission) =
        args.submission.filter(|_| args.device.is_processor() || !args.mode.contains(&Mode::Random))
    {
        let expected = "is for --mode random on a device: add --device gpu and that mode, or leave it out".to_owned();
        return Err(Error::setting("--submission", submission.to_string(), expected));
    }
    Ok(outputs::distinct(
        &[("--json", args.json.as_deref()), ("--plot", args.plot.as_deref())],
        &[("--config", args.config.as_deref()), ("--benchmark", Some(Path::new(&args.benchmark)))],
    )?)
}

/// Where trucks drive, and by what.
struct Place {
    world: Arc<World>,
    routes: Vec<u32>,
    /// The learner of modes with a network.
    learner: Option<Learner>,
}

/// Measures each number of trucks in each mode, and writes what is known after each. An error where none could be
/// measured.
fn measure_all(args: &Args, envs: &[usize], place: &Place, mut device: Device, scale: &mut Scale) -> Result<(), Error> {
    let bar = ProgressBar::new((envs.len() * args.mode.len()) as u64).with_style(
        ProgressStyle::with_template("measuring {bar:30} {pos}/{len} {msg}, {elapsed}")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    let (mut refusal, mut backend) = (None, None);
    for (&envs, &mode) in envs.iter().flat_map(|envs| args.mode.iter().map(move |mode| (envs, mode))) {
        bar.set_message(format!("{envs} trucks, {}", mode.name()));
        bar.tick();
        let setting = Setting {
            engine: &device.engine,
            adapter: device.adapter(),
            backend: &mut backend,
            world: &place.world,
            routes: &place.routes,
            envs,
            submission: scale.submission as usize,
            learner: place.learner.as_ref(),
        };
        let work = || measured(&mut mode.driven(setting)?, args.seconds);
        // The tensor library panics where a device fails.
        let outcome = if device.adapter().is_some() { panics::caught(work, || None) } else { work() };
        let outcome = match outcome {
            Ok(measured) => Outcome::Measured(Box::new(measured)),
            Err(error) => {
                // A broken device must not spoil the next size.
                (device, backend) = (args.device.open()?, None);
                let outcome = Outcome::Refused { error: error.to_string() };
                refusal.get_or_insert(error);
                outcome
            }
        };
        let run = Run { mode, envs, outcome };
        bar.suspend(|| files::print(&row(&run)))?;
        scale.runs.push(run);
        bar.inc(1);
        write(args, scale, &device.title())?;
    }
    bar.finish_and_clear();
    match refusal {
        Some(error) if scale.runs.iter().all(|run| run.measured().is_none()) => Err(error),
        _ => Ok(()),
    }
}

/// The numbers of trucks that `--envs` names.
fn sizes(text: &str) -> Result<Vec<usize>, Error> {
    let wrong = |value: &str| {
        Error::setting("--envs", value, format!("must lie in 1..{MOST_ENVS}, as in 1024,4096 or 256..1048576"))
    };
    let size =
        |word: &str| word.trim().parse().ok().filter(|size| (1..=MOST_ENVS).contains(size)).ok_or_else(|| wrong(word));
    let mut sizes = Vec::new();
    for part in text.split(',') {
        let Some((first, last)) = part.split_once("..") else {
            sizes.push(size(part)?);
            continue;
        };
        let (mut next, last) = (size(first)?, size(last)?);
        if last < next {
            return Err(wrong(part));
        }
        while next < last {
            sizes.push(next);
            next *= FACTOR;
        }
        sizes.push(last);
    }
    Ok(sizes)
}

fn write(args: &Args, scale: &Scale, title: &str) -> Result<(), Error> {
    if let Some(file) = &args.json {
        files::write_json(file, scale)?;
    }
    if let Some(file) = &args.plot {
        offtrack_commands::plot::write(file, plot::drawn(scale, title), plot::PNG_WIDTH)?;
    }
    Ok(())
}

fn heading(scale: &Scale, device: &Device) -> String {
    let Step { dt, substeps, values, holds, .. } = &scale.step;
    let threads = if scale.engine == "cpu" { format!(", {} threads", scale.threads) } else { String::new() };
    let names: String = measure::STAGE_NAMES.iter().map(|name| format!(" {name:>7}")).collect();
    let Scale { roundabouts, routes, world_bytes, seconds_to_read, seconds_to_bake, .. } = scale;
    let megabytes = *world_bytes as f64 / 1e6;
    format!(
        "{}{threads}; a step is {dt} s in {substeps} sub-steps, {N_RAYS} rays, {values} values: {holds}\n\
         {roundabouts} roundabouts, {routes} routes, {megabytes:.1} MB; read in {seconds_to_read:.1} s, baked in \
         {seconds_to_bake:.1} s\n\
         {:>8} {:>9} {:>14} {:>14}   ns a truck, a stage at a time:{names}\n",
        device.title(),
        "trucks",
        "mode",
        "env steps/s",
        "rays/s",
    )
}

fn row(run: &Run) -> String {
    let Run { mode, envs, outcome } = run;
    match outcome {
        Outcome::Refused { error } => format!("{envs:>8} {:>9} {error}\n", mode.name()),
        Outcome::Measured(measured) => {
            let stages: String = measured
                .stages
                .iter()
                .map(|(name, time)| format!(" {time:>width$.1}", width = name.len().max(7)))
                .collect();
            let (steps, rays) = (measured.env_steps_per_second, measured.rays_per_second);
            format!(
                "{envs:>8} {:>9} {steps:>14.0} {rays:>14.0}                                 {stages}\n",
                mode.name()
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_goes_up_four_times_and_ends_where_it_says() {
        assert_eq!(sizes("256..65536").unwrap(), [256, 1024, 4096, 16384, 65536]);
        assert_eq!(sizes("1,3..20, 7..7").unwrap(), [1, 3, 12, 20, 7]);
        for wrong in ["0", "", "9..4", "256..", "4194305", "1e3", "4...16"] {
            assert!(sizes(wrong).is_err(), "{wrong}");
        }
    }
}
