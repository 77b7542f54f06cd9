//! Measures how long an update of the learner takes, alone and with drawing its batch from the memory.
//!
//! With `--lines` each line read asks for a round: another program can take turns with this one, so that a busy machine slows both alike.

use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};

use offtrack::layout::{Ended, N_VALUES};
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};
use serde::Serialize;

use crate::commands::scale::median;
use offtrack_training::error::Error;
use offtrack_training::files;
use offtrack_training::learner::bridge;
use offtrack_training::learner::config::{self, Critics, Entropy, Learning};
use offtrack_training::learner::normalisation::Scaling;
use offtrack_training::learner::replay_buffer::{Memory, Rows};
use offtrack_training::learner::sac::{Sac, Transitions};
use offtrack_training::provenance;

/// Actions of the benchmark's table.
const N_ACTIONS: usize = 9;
/// Trucks whose transitions are in the memory.
const N_ENVS: usize = 128;
/// Steps of each of them.
const N_SLOTS: usize = 512;
/// Updates timed in one go at most: their batches are made before.
const WINDOW: usize = 8;

/// Measure what an update of the learner takes, alone and with drawing its batch.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Sizes of the learner's hidden layers, separated by commas.
    #[arg(long, value_delimiter = ',', default_value = "256,256")]
    hidden: Vec<usize>,
    /// Transitions in an update; several numbers, separated by commas, are measured one after the other.
    #[arg(long, value_delimiter = ',', default_value = "256,1024")]
    batch: Vec<usize>,
    /// Time for each number of transitions [s].
    #[arg(long, default_value_t = 5.0, allow_negative_numbers = true)]
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

/// What a round came to: medians over windows.
#[derive(Debug, Serialize)]
struct Run {
    hidden: Vec<usize>,
    batch: usize,
    /// Time of an update whose batch is at hand [ms].
    update: f64,
    /// The same, the shortest of all windows [ms].
    fastest: f64,
    /// Time of an update and of drawing its batch [ms].
    with_sampling: f64,
    windows: usize,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    if !(0.1..=3600.0).contains(&args.seconds) {
        return Err(Error::Flag { flag: "--seconds", value: format!("{} s", args.seconds), expected: "must lie in 0.1..3600 s".into() });
    }
    if let Some(size) = args.hidden.iter().find(|size| !(1..=8192).contains(*size)) {
        return Err(Error::Flag { flag: "--hidden", value: size.to_string(), expected: "sizes must lie in 1..8192".into() });
    }
    if let Some(batch) = args.batch.iter().find(|batch| !(2..=1 << 20).contains(*batch)) {
        return Err(Error::Flag { flag: "--batch", value: batch.to_string(), expected: "must lie in 2..1048576".into() });
    }
    if args.lines {
        return in_turns(args);
    }
    let mut bench = Bench {
        machine: provenance::machine(),
        commit: provenance::commit(),
        date: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
        values: N_VALUES,
        actions: N_ACTIONS,
        runs: Vec::new(),
    };
    files::print(&format!("{}; {N_VALUES} values, {N_ACTIONS} actions, hidden layers {:?}\n", bench.machine, args.hidden))?;
    files::print(&format!("{:>8} {:>14} {:>22}\n", "batch", "update [ms]", "with sampling [ms]"))?;
    for &batch in &args.batch {
        let run = Learner::new(&args.hidden, batch)?.warm(0.1 * args.seconds).round(0.9 * args.seconds);
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
            let run = learner.warm(0.1 * args.seconds).round(0.9 * args.seconds);
            let text = serde_json::to_string(&run).map_err(|error| Error::write(Path::new("standard output"))(error.into()))?;
            files::print(&format!("{text}\n"))?;
        }
    }
    Ok(())
}

/// A learner and a memory of random transitions.
struct Learner {
    learning: Learning,
    sac: Sac,
    memory: Memory<N_VALUES>,
    scaling: Scaling,
    rng: SmallRng,
}

impl Learner {
    fn new(hidden: &[usize], batch: usize) -> Result<Learner, Error> {
        let learning = learning(hidden, batch);
        let sac = Sac::new(&learning, N_VALUES, N_ACTIONS, 0)?;
        let mut rng = SmallRng::seed_from_u64(0);
        let capacity = N_ENVS * N_SLOTS;
        let mut memory = Memory::new(N_ENVS, learning.n_steps, &config::Memory { capacity, warmup: capacity, priority: None });
        for _ in 0..N_SLOTS {
            memory.append(Rows {
                observation: &rows(&mut rng),
                action: &(0..N_ENVS).map(|_| rng.random_range(0..N_ACTIONS as u32)).collect::<Vec<_>>(),
                reward: &(0..N_ENVS).map(|_| rng.random_range(-1.0..1.0)).collect::<Vec<_>>(),
                ended: &[Ended::Running as u32; N_ENVS],
                next_observation: &rows(&mut rng),
            });
        }
        let scaling = Scaling::of(memory.observations());
        Ok(Learner { learning, sac, memory, scaling, rng })
    }

    /// A batch drawn from the memory.
    fn parts(&mut self) -> Vec<Transitions> {
        let sample = self.memory.sample(self.learning.batch, self.learning.discount as f32, &mut self.rng);
        bridge::parts(&sample, &self.scaling, &self.learning, &mut self.rng)
    }

    /// Updates for so many seconds, once at least.
    fn warm(&mut self, seconds: f64) -> &mut Learner {
        let begun = Instant::now();
        let mut time = 0.0;
        while begun.elapsed().as_secs_f64() < seconds || time == 0.0 {
            time = self.sampled(1);
        }
        self
    }

    /// Windows of updates alone and of updates with sampling in turn, for so many seconds.
    fn round(&mut self, seconds: f64) -> Run {
        let [mut alone, mut sampled] = [Vec::new(), Vec::new()];
        let begun = Instant::now();
        while begun.elapsed().as_secs_f64() < seconds || alone.is_empty() {
            alone.push(1e3 * self.alone(WINDOW));
            sampled.push(1e3 * self.sampled(WINDOW));
        }
        Run {
            hidden: self.learning.hidden.clone(),
            batch: self.learning.batch,
            // The median sorts.
            update: rounded(median(&mut alone)),
            fastest: rounded(alone[0]),
            with_sampling: rounded(median(&mut sampled)),
            windows: alone.len(),
        }
    }

    /// Time of an update whose batch is at hand [s].
    fn alone(&mut self, n: usize) -> f64 {
        let batches: Vec<_> = (0..n).map(|_| self.parts()).collect();
        let begun = Instant::now();
        for batch in batches {
            self.sac.update(batch, 1.0);
        }
        begun.elapsed().as_secs_f64() / n as f64
    }

    /// Time of an update and of drawing its batch [s].
    fn sampled(&mut self, n: usize) -> f64 {
        let begun = Instant::now();
        for _ in 0..n {
            let parts = self.parts();
            self.sac.update(parts, 1.0);
        }
        begun.elapsed().as_secs_f64() / n as f64
    }
}

/// Plain twin critics, as in the default training file.
fn learning(hidden: &[usize], batch: usize) -> Learning {
    Learning {
        hidden: hidden.to_vec(),
        batch,
        updates_per_step: 1,
        n_steps: 3,
        discount: 0.97,
        reward_scale: 1.0,
        scale_observations: true,
        observation_noise: 0.0,
        mirror: false,
        actor_rate: 3e-4,
        critic_rate: 3e-4,
        last_rate: 1.0,
        layer_norm: false,
        value_clip: None,
        categories: None,
        critics: Critics::Average,
        target_rate: 0.005,
        target_every: 1,
        average_rate: 0.005,
        entropy: Entropy { in_target: true, share: Some(0.1), weight: 0.05, rate: 3e-4 },
    }
}

/// Random observations of every truck.
fn rows(rng: &mut SmallRng) -> Vec<[f32; N_VALUES]> {
    (0..N_ENVS).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect()
}

fn rounded(value: f64) -> f64 {
    (1000.0 * value).round() / 1000.0
}
