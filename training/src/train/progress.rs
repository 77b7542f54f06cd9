//! How far a run is: the live line, the rows of `metrics.csv`, and when to stop.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use offtrack::layout::Ended;
use offtrack::simulator::Batch;

use crate::config::Config;
use crate::error::Error;
use crate::sac::Update;
use crate::train::folder::Folder;

/// Time between two rows of figures.
const ROW_EVERY: Duration = Duration::from_secs(5);
/// Time between two lines where no terminal shows the live one.
const LINE_EVERY: Duration = Duration::from_secs(30);
/// Episodes that the success rate and the mean reward look back on, as many as in the study.
pub const WINDOW: usize = 250;

/// What is remembered of an episode.
#[derive(Debug)]
struct Episode {
    arrived: bool,
    /// Sum of its rewards.
    reward: f32,
}

/// Counters and clocks of a run.
#[derive(Debug)]
pub struct Progress {
    begun: Instant,
    minutes: Option<f64>,
    steps: Option<u64>,
    env_steps: u64,
    episodes: u64,
    updates: u64,
    /// The latest episodes.
    latest: VecDeque<Episode>,
    /// Each truck's sum of rewards in the episode that it is in, `[n_envs]`.
    rewards: Vec<f32>,
    /// Sums since the last row.
    sums: Update,
    since_row: Instant,
    row_steps: u64,
    row_updates: u64,
    since_line: Instant,
    bar: ProgressBar,
    metrics: (PathBuf, File),
}

impl Progress {
    /// Starts the clock and the file of figures.
    pub fn new(config: &Config, folder: &Folder) -> Result<Progress, Error> {
        let path = folder.metrics();
        let mut file = File::create_new(&path).map_err(Error::write(&path))?;
        let head = "seconds,env_steps,episodes,updates,success,reward,critic_loss,actor_loss,entropy,value,entropy_weight,steps_per_second,updates_per_second";
        writeln!(file, "{head}").map_err(Error::write(&path))?;
        let style = ProgressStyle::with_template("{bar:24} {percent:>3} % {msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
        Ok(Progress {
            begun: Instant::now(),
            minutes: config.minutes,
            steps: config.steps,
            env_steps: 0,
            episodes: 0,
            updates: 0,
            latest: VecDeque::with_capacity(WINDOW),
            rewards: vec![0.0; config.n_envs],
            sums: Update::default(),
            since_row: Instant::now(),
            row_steps: 0,
            row_updates: 0,
            since_line: Instant::now(),
            bar: ProgressBar::new(1000).with_style(style),
            metrics: (path, file),
        })
    }

    /// Share of the run that is over: by time or by steps, whichever is further.
    pub fn share(&self) -> f64 {
        let by_time = self.minutes.map_or(0.0, |minutes| self.seconds() / (60.0 * minutes));
        let by_steps = self.steps.map_or(0.0, |steps| self.env_steps as f64 / steps as f64);
        by_time.max(by_steps).min(1.0)
    }

    /// Time since the start [s].
    pub fn seconds(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    /// Env steps taken.
    pub fn env_steps(&self) -> u64 {
        self.env_steps
    }

    /// Episodes ended.
    pub fn episodes(&self) -> u64 {
        self.episodes
    }

    /// Updates made.
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// Share of the latest episodes that arrived, none before the first ended.
    pub fn success(&self) -> Option<f64> {
        let arrived = self.latest.iter().filter(|episode| episode.arrived).count();
        (!self.latest.is_empty()).then(|| arrived as f64 / self.latest.len() as f64)
    }

    /// Mean sum of rewards of the latest episodes, none before the first ended.
    fn reward(&self) -> Option<f64> {
        let sum: f64 = self.latest.iter().map(|episode| f64::from(episode.reward)).sum();
        (!self.latest.is_empty()).then(|| sum / self.latest.len() as f64)
    }

    /// Counts a step of every truck.
    pub fn stepped(&mut self, batch: &Batch) {
        self.env_steps += batch.n_envs() as u64;
        for ((sum, &reward), &code) in self.rewards.iter_mut().zip(&batch.reward).zip(&batch.ended) {
            *sum += reward;
            if code != Ended::Running as u32 {
                self.episodes += 1;
                if self.latest.len() == WINDOW {
                    self.latest.pop_front();
                }
                self.latest.push_back(Episode { arrived: code == Ended::Arrived as u32, reward: std::mem::take(sum) });
            }
        }
    }

    /// Counts an update.
    pub fn updated(&mut self, update: &Update) {
        self.updates += 1;
        self.sums.critic_loss += update.critic_loss;
        self.sums.actor_loss += update.actor_loss;
        self.sums.entropy += update.entropy;
        self.sums.value += update.value;
    }

    /// Moves the live line on and writes a row when it is time for one.
    pub fn report(&mut self, entropy_weight: f32) -> Result<(), Error> {
        if ROW_EVERY <= self.since_row.elapsed() {
            self.row(entropy_weight)?;
        }
        Ok(())
    }

    /// Writes the last row and ends the live line.
    pub fn finish(&mut self, entropy_weight: f32) -> Result<(), Error> {
        self.row(entropy_weight)?;
        self.bar.finish();
        Ok(())
    }

    fn row(&mut self, entropy_weight: f32) -> Result<(), Error> {
        let seconds = self.since_row.elapsed().as_secs_f64();
        let n = self.updates - self.row_updates;
        // A mean over no updates is left empty.
        let mean = |sum: f32, decimals: usize| if n == 0 { String::new() } else { format!("{:.decimals$}", sum / n as f32) };
        let [steps_rate, update_rate] =
            [self.env_steps - self.row_steps, self.updates - self.row_updates].map(|count| count as f64 / seconds);
        let success = self.success().map(|success| format!("{success:.4}")).unwrap_or_default();
        let reward = self.reward().map(|reward| format!("{reward:.2}")).unwrap_or_default();
        let Update { critic_loss, actor_loss, entropy, value } = self.sums;
        let row = format!(
            "{:.1},{},{},{},{success},{reward},{},{},{},{},{entropy_weight:.6},{steps_rate:.0},{update_rate:.1}\n",
            self.seconds(),
            self.env_steps,
            self.episodes,
            self.updates,
            mean(critic_loss, 5),
            mean(actor_loss, 5),
            mean(entropy, 4),
            mean(value, 4),
        );
        let (path, file) = &mut self.metrics;
        file.write_all(row.as_bytes()).and_then(|()| file.flush()).map_err(Error::write(path))?;
        self.show(steps_rate, update_rate);
        self.sums = Update::default();
        (self.since_row, self.row_steps, self.row_updates) = (Instant::now(), self.env_steps, self.updates);
        Ok(())
    }

    /// The live line on a terminal, a plain line now and then elsewhere.
    fn show(&mut self, steps_rate: f64, update_rate: f64) {
        let share = self.share();
        let left = if 0.0 < share { self.seconds() * (1.0 - share) / share } else { 0.0 };
        let success = self.success().map_or_else(|| "-".to_owned(), |success| format!("{:.1} %", 100.0 * success));
        let line = format!(
            "{:.2} M steps, {steps_rate:.0} steps/s, {update_rate:.0} updates/s, success {success} of the last {}, {}:{:02} left",
            self.env_steps as f64 / 1e6,
            self.latest.len(),
            left as u64 / 60,
            left as u64 % 60,
        );
        if std::io::stderr().is_terminal() {
            self.bar.set_position((1000.0 * share) as u64);
            self.bar.set_message(line);
        } else if LINE_EVERY <= self.since_line.elapsed() || share == 1.0 {
            // A run goes on when nobody reads its lines any more.
            let _ = writeln!(std::io::stderr(), "{:>3.0} % {line}", 100.0 * share);
            self.since_line = Instant::now();
        }
    }
}
