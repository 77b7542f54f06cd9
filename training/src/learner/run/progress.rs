//! How far a run is: the live line, the rows of `metrics.csv`, and when to stop.

use std::collections::VecDeque;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use offtrack::layout::Ended;
use offtrack::simulator::Batch;

use super::metrics::Figures;
use crate::error::Error;
use crate::learner::checkpoint::{Columns, Stored};
use crate::learner::config::Config;
use crate::learner::sac::Update;

/// Time between two rows of figures, and two states of the live line.
const ROW_EVERY: Duration = Duration::from_secs(5);
/// Rows of a run that steps alone end: equal runs then leave equal figures.
const N_ROWS: u64 = 500;
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

/// The episodes that ended between two tellings.
#[derive(Debug)]
struct Recent {
    episodes: u64,
    arrived: u64,
    /// Sum of all rewards in between.
    reward: f64,
}

/// Counters and clocks of a run.
#[derive(Debug)]
pub struct Progress {
    begun: Instant,
    /// Time spent learning before that.
    before: Duration,
    minutes: Option<f64>,
    steps: Option<u64>,
    env_steps: u64,
    episodes: u64,
    updates: u64,
    /// The latest episodes.
    latest: VecDeque<Episode>,
    /// Episodes, arrivals and mean reward where they are counted for many trucks at once, as they were last told.
    recent: Option<Recent>,
    /// Each truck's sum of rewards in the episode that it is in, `[n_envs]`.
    rewards: Vec<f32>,
    /// Sums since the last row.
    sums: Update,
    /// Time [s], steps and updates at the last row.
    row_seconds: f64,
    row_steps: u64,
    row_updates: u64,
    /// Time [s] and steps when one was last tried to be written.
    tried: (f64, u64),
    /// When the live line was last moved on, and the steps and updates by then.
    shown: (Instant, u64, u64),
    since_line: Instant,
    bar: ProgressBar,
    metrics: Figures,
    /// Files that could not be written when that was last tried.
    unwritten: Vec<PathBuf>,
}

impl Progress {
    /// Starts the clock.
    pub fn new(config: &Config, metrics: Figures) -> Progress {
        let style = ProgressStyle::with_template("{bar:24} {percent:>3} % {msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
        Progress {
            begun: Instant::now(),
            before: Duration::ZERO,
            minutes: config.minutes,
            steps: config.steps,
            env_steps: 0,
            episodes: 0,
            updates: 0,
            latest: VecDeque::with_capacity(WINDOW),
            recent: None,
            rewards: vec![0.0; config.n_envs],
            sums: Update::default(),
            row_seconds: 0.0,
            row_steps: 0,
            row_updates: 0,
            tried: (0.0, 0),
            shown: (Instant::now(), 0, 0),
            since_line: Instant::now(),
            bar: ProgressBar::new(1000).with_style(style),
            metrics,
            unwritten: Vec::new(),
        }
    }

    /// Share of the run that is over: by time or by steps, whichever is further.
    pub fn share(&self) -> f64 {
        let by_time = self.minutes.map_or(0.0, |minutes| self.seconds() / (60.0 * minutes));
        let by_steps = self.steps.map_or(0.0, |steps| self.env_steps as f64 / steps as f64);
        by_time.max(by_steps).min(1.0)
    }

    /// Time spent learning [s].
    pub fn seconds(&self) -> f64 {
        (self.before + self.begun.elapsed()).as_secs_f64()
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
        if let Some(Recent { episodes, arrived, .. }) = self.recent {
            return Some(arrived as f64 / episodes as f64);
        }
        let arrived = self.latest.iter().filter(|episode| episode.arrived).count();
        (!self.latest.is_empty()).then(|| arrived as f64 / self.latest.len() as f64)
    }

    /// Mean sum of rewards of the latest episodes, none before the first ended.
    fn reward(&self) -> Option<f64> {
        if let Some(Recent { episodes, reward, .. }) = self.recent {
            return Some(reward / episodes as f64);
        }
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

    /// Episodes that the success rate and the mean reward look back on.
    pub fn window(&self) -> usize {
        self.recent.as_ref().map_or(WINDOW, |recent| recent.episodes as usize)
    }

    /// Counts so many env steps, whose episodes are told of later.
    #[cfg(feature = "gpu")]
    pub fn driven(&mut self, n_steps: u64) {
        self.env_steps += n_steps;
    }

    /// Counts what happened since this was last called.
    #[cfg(feature = "gpu")]
    pub fn tallied(&mut self, since: &offtrack::simulator::Tally) {
        let (episodes, arrived) = (since.episodes(), since.ended(Ended::Arrived));
        self.episodes += episodes;
        if 0 < episodes {
            self.recent = Some(Recent { episodes, arrived, reward: since.reward() });
        }
    }

    /// Counts so many updates and what they came to in sum.
    pub fn updated(&mut self, sums: &Update, n_updates: u64) {
        self.updates += n_updates;
        self.sums.critic_loss += sums.critic_loss;
        self.sums.actor_loss += sums.actor_loss;
        self.sums.entropy += sums.entropy;
        self.sums.value += sums.value;
    }

    /// Whether it is time for a row: by the clock, or by steps where they alone end the run.
    pub fn is_row_due(&self) -> bool {
        let (seconds, tried_steps) = self.tried;
        match (self.minutes, self.steps) {
            (None, Some(steps)) => {
                let row = |env_steps: u64| u128::from(env_steps) * u128::from(N_ROWS) / u128::from(steps.max(1));
                row(tried_steps) < row(self.env_steps)
            }
            _ => ROW_EVERY.as_secs_f64() <= self.seconds() - seconds,
        }
    }

    /// Writes a row. Where that fails its figures wait for the next one.
    pub fn row(&mut self, entropy_weight: f32) {
        let written = self.append_row(entropy_weight);
        let file = self.metrics.path().to_owned();
        self.note(&file, written);
    }

    /// Moves the live line on when it is time to.
    pub fn show_now_and_then(&mut self) {
        if ROW_EVERY <= self.shown.0.elapsed() {
            self.show();
        }
    }

    /// Writes the last row, of what no row has told of yet, and ends the live line.
    pub fn finish(&mut self, entropy_weight: f32) -> Result<(), Error> {
        self.show();
        self.bar.finish();
        if self.row_steps < self.env_steps { self.append_row(entropy_weight) } else { Ok(()) }
    }

    /// Takes note of whether a file could be written: a failure is reported once, and the live line tells of it until it is made good.
    pub fn note(&mut self, file: &Path, written: Result<(), Error>) {
        let known = self.unwritten.iter().any(|unwritten| unwritten == file);
        match written {
            Ok(()) => self.unwritten.retain(|unwritten| unwritten != file),
            Err(error) if !known => {
                self.unwritten.push(file.to_owned());
                // A run goes on when nobody reads its lines.
                let _ = self.bar.suspend(|| writeln!(std::io::stderr(), "offtrack: {error}; the run goes on and will try again"));
            }
            Err(_) => {}
        }
    }

    fn append_row(&mut self, entropy_weight: f32) -> Result<(), Error> {
        self.tried = (self.seconds(), self.env_steps);
        let n = self.updates - self.row_updates;
        let [steps_rate, update_rate] = per_second(self.seconds() - self.row_seconds, [self.env_steps - self.row_steps, n]);
        // A mean over no updates is left empty.
        let mean = |sum: f32, decimals: usize| if n == 0 { String::new() } else { format!("{:.decimals$}", sum / n as f32) };
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
        self.metrics.append(&row)?;
        self.sums = Update::default();
        (self.row_seconds, self.row_steps, self.row_updates) = (self.seconds(), self.env_steps, self.updates);
        Ok(())
    }

    /// The live line on a terminal, a plain line now and then elsewhere.
    fn show(&mut self) {
        let (since, steps, updates) = std::mem::replace(&mut self.shown, (Instant::now(), self.env_steps, self.updates));
        let [steps_rate, update_rate] = per_second(since.elapsed().as_secs_f64(), [self.env_steps - steps, self.updates - updates]);
        let share = self.share();
        let left = if 0.0 < share { self.seconds() * (1.0 - share) / share } else { 0.0 };
        let success = self.success().map_or_else(|| "-".to_owned(), |success| format!("{:.1} %", 100.0 * success));
        let line = format!(
            "{:.2} M steps, {steps_rate:.0} steps/s, {update_rate:.0} updates/s, success {success} of the last {}, {}:{:02} left",
            self.env_steps as f64 / 1e6,
            self.recent.as_ref().map_or(self.latest.len(), |recent| recent.episodes as usize),
            left as u64 / 60,
            left as u64 % 60,
        );
        let names = self.unwritten.iter().filter_map(|file| Some(file.file_name()?.to_string_lossy()));
        let line = names.fold(line, |line, name| format!("{line}, {name} cannot be written"));
        if std::io::stderr().is_terminal() {
            self.bar.set_position((1000.0 * share) as u64);
            self.bar.set_message(line);
        } else if LINE_EVERY <= self.since_line.elapsed() || share == 1.0 {
            // A run goes on when nobody reads its lines any more.
            let _ = writeln!(std::io::stderr(), "{:>3.0} % {line}", 100.0 * share);
            self.since_line = Instant::now();
        }
    }

    /// Adds the counters' columns.
    pub fn save(&self, columns: &mut Columns) {
        let Update { critic_loss, actor_loss, entropy, value } = self.sums;
        let counts = [self.env_steps, self.episodes, self.updates, self.row_steps, self.row_updates, self.metrics.length()];
        columns.put(COUNTS, counts.to_vec());
        columns.put(SECONDS, vec![self.seconds(), self.row_seconds]);
        columns.put("progress, sums", vec![critic_loss, actor_loss, entropy, value]);
        columns.put("progress, arrived", self.latest.iter().map(|episode| u8::from(episode.arrived)).collect::<Vec<_>>());
        columns.put("progress, episode rewards", self.latest.iter().map(|episode| episode.reward).collect::<Vec<_>>());
        columns.put("progress, rewards", self.rewards.clone());
    }

    /// Goes on counting where a checkpoint of this run left off, and takes back the rows after it.
    pub fn restore(&mut self, stored: &Stored) -> Result<(), Error> {
        let length;
        [self.env_steps, self.episodes, self.updates, self.row_steps, self.row_updates, length] = stored.array(COUNTS)?;
        let [seconds, row_seconds] = stored.array(SECONDS)?;
        let [critic_loss, actor_loss, entropy, value] = stored.array("progress, sums")?;
        let arrived: Vec<u8> = stored.column("progress, arrived")?;
        let rewards: Vec<f32> = stored.exactly("progress, episode rewards", arrived.len())?;
        self.sums = Update { critic_loss, actor_loss, entropy, value };
        self.latest = arrived.iter().zip(rewards).map(|(&arrived, reward)| Episode { arrived: arrived != 0, reward }).collect();
        self.rewards = stored.exactly("progress, rewards", self.rewards.len())?;
        let before = Duration::try_from_secs_f64(seconds).map_err(|error| stored.error(format!("its column `{SECONDS}`: {error}")))?;
        (self.before, self.begun, self.row_seconds) = (before, Instant::now(), row_seconds);
        self.tried = (seconds, self.row_steps);
        self.shown = (Instant::now(), self.env_steps, self.updates);
        self.metrics.cut(length)
    }
}

fn per_second(seconds: f64, counts: [u64; 2]) -> [f64; 2] {
    counts.map(|count| count as f64 / seconds.max(f64::MIN_POSITIVE))
}

/// Columns of a checkpoint that say how far the run is.
const COUNTS: &str = "progress, counts";
const SECONDS: &str = "progress, seconds";

/// Time spent learning [s] and env steps made when a checkpoint was written.
pub fn reached(stored: &Stored) -> Result<(f64, u64), Error> {
    let [seconds, _] = stored.array(SECONDS)?;
    let [env_steps, ..] = stored.array::<u64, 6>(COUNTS)?;
    Ok((seconds, env_steps))
}
