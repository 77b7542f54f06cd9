//! `offtrack bench`: the time of an update of the learner, alone and with sampling its batch.
//!
//! With `--lines` each line read asks for a round: another program can take turns with this one, so that a busy machine
//! slows both alike.

use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Instant, SystemTime};

use offtrack::layout::N_VALUES;
use offtrack::scenario::{Scenario, Split};
use offtrack::world::World;
use offtrack_evaluation::files;
use offtrack_evaluation::provenance;
use offtrack_learner::backend::Backend;
use offtrack_learner::config::{self, Config, Learning};
use offtrack_learner::error::Error;
use offtrack_learner::session::Session;
use serde::Serialize;

use super::scale::{median, rounded};

/// The benchmark whose transitions are learned from.
const BENCHMARK: &str = "attard2023-training";
/// Trucks whose transitions are in the replay buffer.
const N_ENVS: usize = 128;
/// Steps of each of them.
const N_SLOTS: usize = 512;
/// Updates timed in one go at most: their batches are made before.
const WINDOW: usize = 8;

/// Measure the time of an update of the learner, alone and with sampling its batch.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Sizes of the learner's hidden layers, separated by commas.
    #[arg(long, value_delimiter = ',', default_value = "256,256")]
    hidden: Vec<usize>,
    /// Transitions in an update; several numbers, separated by commas, are measured one after the other.
    #[arg(long, value_delimiter = ',', default_value = "256,1024")]
    batch: Vec<usize>,
    /// Time for each number of transitions (s).
    #[arg(long, default_value_t = 5.0)]
    seconds: f64,
    /// Write the result to this file as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Measure a round of `--seconds` for each line read and print it as a line of JSON.
    #[arg(long, conflicts_with = "json")]
    lines: bool,
}

/// The result, as written.
#[derive(Debug, Serialize)]
struct Bench {
    machine: String,
    commit: String,
    date: String,
    values: usize,
    actions: usize,
    runs: Vec<Run>,
}

/// The result of a round: medians over windows.
#[derive(Debug, Serialize)]
struct Run {
    hidden: Vec<usize>,
    batch: usize,
    /// Time of an update whose batch is at hand (ms).
    update: f64,
    /// The shortest of all windows (ms).
    fastest: f64,
    /// Time of an update and of sampling its batch (ms).
    with_sampling: f64,
    windows: usize,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    if !(0.1..=3600.0).contains(&args.seconds) {
        return Err(Error::setting("--seconds", format!("{} s", args.seconds), "must lie in 0.1..3600 s"));
    }
    if let Some(size) = args.hidden.iter().find(|size| !(1..=8192).contains(*size)) {
        return Err(Error::setting("--hidden", size.to_string(), "sizes must lie in 1..8192"));
    }
    if let Some(batch) = args.batch.iter().find(|batch| !(2..=1 << 20).contains(*batch)) {
        return Err(Error::setting("--batch", batch.to_string(), "must lie in 2..1048576"));
    }
    if args.lines {
        return in_turns(args);
    }
    let mut bench = Bench {
        machine: provenance::machine(),
        commit: provenance::commit(),
        date: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
        values: N_VALUES,
        actions: Scenario::named(BENCHMARK)?.actions().len(),
        runs: Vec::new(),
    };
    files::print(&format!(
        "{}; {N_VALUES} values, {} actions, hidden layers {:?}\n",
        bench.machine, bench.actions, args.hidden
    ))?;
    files::print(&format!("{:>8} {:>14} {:>22}\n", "batch", "update [ms]", "with sampling [ms]"))?;
    for &batch in &args.batch {
        let run = Learner::new(&args.hidden, batch)?.warm(0.1 * args.seconds)?.round(0.9 * args.seconds)?;
        files::print(&format!("{:>8} {:>14.2} {:>22.2}\n", run.batch, run.update, run.with_sampling))?;
        bench.runs.push(run);
        if let Some(file) = &args.json {
            files::write_json(file, &bench)?;
        }
    }
    Ok(())
}

/// Answers each line with the run of a round, a line of JSON, until there are no more lines.
fn in_turns(args: &Args) -> Result<(), Error> {
    let mut learners = Vec::new();
    for &batch in &args.batch {
        learners.push(Learner::new(&args.hidden, batch)?);
    }
    for line in std::io::stdin().lock().lines() {
        line.map_err(Error::read(Path::new("standard input")))?;
        for learner in &mut learners {
            let run = learner.warm(0.1 * args.seconds)?.round(0.9 * args.seconds)?;
            let text = serde_json::to_string(&run)
                .map_err(|error| Error::write(Path::new("standard output"))(error.into()))?;
            files::print_json(&text)?;
        }
    }
    Ok(())
}

/// The default learner with other sizes, and a full replay buffer of transitions with random actions.
struct Learner {
    learning: Learning,
    training: Session,
}

impl Learner {
    fn new(hidden: &[usize], batch: usize) -> Result<Learner, Error> {
        let mut config = Config::read(Path::new("default"))?;
        config.n_envs = N_ENVS;
        config.replay_buffer =
            config::ReplayBuffer { capacity: N_ENVS * N_SLOTS, warmup: N_ENVS * N_SLOTS, priority: None };
        // Plain networks, as benches/peers/torch_sac_bench.py has them.
        config.learning = Learning { hidden: hidden.to_vec(), batch, layer_norm: false, ..config.learning };
        let scenario = Scenario::named(BENCHMARK)?;
        let routes = scenario.split(Split::Train).to_vec();
        let mut training = Session::new(&Backend::Host, &config, Arc::new(World::bake(&scenario)?), routes)?;
        while !training.is_warm()? {
            training.act(0)?;
        }
        Ok(Learner { learning: config.learning, training })
    }

    /// Updates for so many seconds, once at least.
    fn warm(&mut self, seconds: f64) -> Result<&mut Learner, Error> {
        let begun = Instant::now();
        let mut time = 0.0;
        while begun.elapsed().as_secs_f64() < seconds || time == 0.0 {
            time = self.sampled(1)?;
        }
        Ok(self)
    }

    /// Windows of updates alone and of updates with sampling in turn, for so many seconds.
    fn round(&mut self, seconds: f64) -> Result<Run, Error> {
        let [mut alone, mut sampled] = [Vec::new(), Vec::new()];
        let begun = Instant::now();
        while begun.elapsed().as_secs_f64() < seconds || alone.is_empty() {
            alone.push(1e3 * self.alone(WINDOW)?);
            sampled.push(1e3 * self.sampled(WINDOW)?);
        }
        Ok(Run {
            hidden: self.learning.hidden.clone(),
            batch: self.learning.batch,
            // The median sorts.
            update: rounded(median(&mut alone)),
            fastest: rounded(alone[0]),
            with_sampling: rounded(median(&mut sampled)),
            windows: alone.len(),
        })
    }

    /// Time of an update whose batch is at hand (s).
    fn alone(&mut self, n: usize) -> Result<f64, Error> {
        let batches: Result<Vec<_>, Error> = (0..n).map(|_| self.training.rollout_mut().sample()).collect();
        let batches = batches?;
        let begun = Instant::now();
        for batch in batches {
            self.training.update_on(batch, 1.0)?;
        }
        Ok(begun.elapsed().as_secs_f64() / n as f64)
    }

    /// Time of an update and of drawing its batch (s).
    fn sampled(&mut self, n: usize) -> Result<f64, Error> {
        let begun = Instant::now();
        for _ in 0..n {
            self.training.update(1.0)?;
        }
        Ok(begun.elapsed().as_secs_f64() / n as f64)
    }
}
