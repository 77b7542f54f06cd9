//! Counters and clocks of a run: what it shows, the rows of `metrics.csv`, and when to stop.

use std::fmt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use offtrack::files::reader::shown_path;

use super::events_file::EventsFile;
use super::metrics_file::{HEAD, MetricsFile};
use super::window::Window;
use crate::checkpoint::{Columns, Stored};
use crate::config::Config;
use crate::error::Error;
use crate::rollout::Episodes;
use crate::sac::Update;

/// Time between two rows of metrics, and two updates of the display.
pub(super) const ROW_EVERY: Duration = Duration::from_secs(5);
/// Rows of a run with a budget of steps alone: equal runs then leave equal rows.
const N_ROWS: u64 = 500;

/// How far a run is; as text, a line about it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Status {
    /// Fraction of the budget that is spent, 1 at the end.
    pub fraction: f64,
    /// Env steps made.
    pub env_steps: u64,
    /// Env steps per second since the status before.
    pub steps_per_second: f64,
    /// Updates per second since the status before.
    pub updates_per_second: f64,
    /// Fraction of the latest training episodes that arrived; none before the first ended.
    pub success: Option<f64>,
    /// Number of those episodes.
    pub window: u64,
    /// Success in the latest validation and in the best one; none before the first.
    pub validation: Option<(f64, f64)>,
    /// Training time that is left, as far as it can be known (s).
    pub seconds_left: f64,
    /// Names of files that could not be written when that was last tried.
    pub unwritten: Vec<String>,
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Status { env_steps, steps_per_second, updates_per_second, window, .. } = self;
        write!(
            f,
            "{:.2} M steps, {steps_per_second:.0} steps/s, {updates_per_second:.0} updates/s, success ",
            *env_steps as f64 / 1e6
        )?;
        match self.success {
            Some(success) => write!(f, "{:.1} % of the last {window}", 100.0 * success)?,
            None => write!(f, "- of the last {window}")?,
        }
        if let Some((last, best)) = self.validation {
            write!(f, ", validation {:.1} % (best {:.1} %)", 100.0 * last, 100.0 * best)?;
        }
        let left = self.seconds_left as u64;
        write!(f, ", {}:{:02} left", left / 60, left % 60)?;
        self.unwritten.iter().try_for_each(|name| write!(f, ", {name} cannot be written"))
    }
}

/// Where a run shows how far it is.
pub trait Display {
    /// How far the run is.
    fn show(&mut self, status: &Status);

    /// A line that is to stay, about something that went wrong.
    fn warn(&mut self, line: String);

    /// Leaves the last state where it is.
    fn close(&mut self);
}

/// Shows nothing.
impl Display for () {
    fn show(&mut self, _: &Status) {}
    fn warn(&mut self, _: String) {}
    fn close(&mut self) {}
}

/// Counters and clocks of a run.
pub struct Progress<'a> {
    begun: Instant,
    /// Training time before that.
    before: Duration,
    minutes: Option<f64>,
    steps: Option<u64>,
    env_steps: u64,
    episodes: u64,
    updates: u64,
    /// The latest episodes.
    window: Window,
    /// Success in the latest validation that no row has yet.
    validated: Option<f64>,
    /// The latest validation's success and the best one's, to be shown.
    validation: Option<(f64, f64)>,
    /// Sums since the last row.
    sums: Update,
    /// Time (s), steps and updates at the last row.
    row_seconds: f64,
    row_steps: u64,
    row_updates: u64,
    /// Time (s) and steps when one was last tried to be written.
    tried: (f64, u64),
    /// When the display was last updated, and the steps and updates by then.
    shown: (Instant, u64, u64),
    /// What it showed then.
    last: Option<Status>,
    display: Box<dyn Display + 'a>,
    metrics: MetricsFile,
    /// The rows of `metrics` for TensorBoard.
    events: Option<EventsFile>,
    /// Files that could not be written when that was last tried.
    unwritten: Vec<PathBuf>,
}

impl<'a> Progress<'a> {
    /// Starts the clock.
    pub fn new(config: &Config, metrics: MetricsFile, display: Box<dyn Display + 'a>) -> Progress<'a> {
        Progress {
            begun: Instant::now(),
            before: Duration::ZERO,
            minutes: config.minutes,
            steps: config.steps,
            env_steps: 0,
            episodes: 0,
            updates: 0,
            window: Window::default(),
            validated: None,
            validation: None,
            sums: Update::default(),
            row_seconds: 0.0,
            row_steps: 0,
            row_updates: 0,
            tried: (0.0, 0),
            shown: (Instant::now(), 0, 0),
            last: None,
            display,
            metrics,
            events: None,
            unwritten: Vec::new(),
        }
    }

    /// Writes the rows from here on to a TensorBoard event file in `folder` too.
    pub fn write_events(&mut self, folder: &Path) -> Result<(), Error> {
        self.events = Some(EventsFile::create(folder, self.row_steps)?);
        Ok(())
    }

    /// Fraction of the budget that is spent: of time or of steps, whichever is larger.
    pub fn fraction(&self) -> f64 {
        let by_time = self.minutes.map_or(0.0, |minutes| self.seconds() / (60.0 * minutes));
        let by_steps = self.steps.map_or(0.0, |steps| self.env_steps as f64 / steps as f64);
        by_time.max(by_steps).min(1.0)
    }

    /// Training time (s).
    pub fn seconds(&self) -> f64 {
        (self.before + self.begun.elapsed()).as_secs_f64()
    }

    /// Env steps made.
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

    /// Fraction of the latest episodes that arrived; none before the first ended.
    pub fn success(&self) -> Option<f64> {
        self.window.success()
    }

    /// Episodes that success is a fraction of.
    pub fn window(&self) -> u64 {
        self.window.count()
    }

    /// Counts so many env steps.
    pub fn stepped(&mut self, n_steps: u64) {
        self.env_steps += n_steps;
    }

    /// Counts episodes that ended.
    pub fn ended(&mut self, episodes: Episodes) {
        self.episodes += episodes.count;
        self.window.push(episodes);
    }

    /// Counts so many updates.
    pub fn updated(&mut self, n_updates: u64) {
        self.updates += n_updates;
    }

    /// Notes the success of a validation, for the next row and the display, and the best one's.
    pub fn validated(&mut self, success: f64, best: f64) {
        self.validated = Some(success);
        self.show_validation(success, best);
    }

    /// Shows the latest validation's success and the best one's.
    pub fn show_validation(&mut self, success: f64, best: f64) {
        self.validation = Some((success, best));
    }

    /// Adds sums over the updates since the last row.
    pub fn add_sums(&mut self, sums: &Update) {
        self.sums = self.sums.plus(sums);
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

    /// The rows' file, whose lock keeps other runs out of the folder.
    pub fn into_metrics(self) -> MetricsFile {
        self.metrics
    }

    /// Writes a row. Where that fails, its sums go into the next one.
    pub fn write_row(&mut self, entropy_coefficient: f32) {
        let written = self.append_row(entropy_coefficient);
        let file = self.metrics.path().to_owned();
        self.note(&file, written);
    }

    /// Updates the display when it is time to.
    pub fn show_if_due(&mut self) {
        if ROW_EVERY <= self.shown.0.elapsed() {
            self.show();
        }
    }

    /// Writes the last row, of what is in no row yet, and closes the display.
    pub fn finish(&mut self, entropy_coefficient: f32) -> Result<(), Error> {
        if self.last.as_ref().is_none_or(|last| last.env_steps < self.env_steps || last.validation != self.validation) {
            self.show();
        }
        self.display.close();
        if self.row_steps < self.env_steps { self.append_row(entropy_coefficient) } else { Ok(()) }
    }

    /// Notes whether a file could be written. A failure is reported once, and the display names the file until it
    /// can be written again.
    pub fn note(&mut self, file: &Path, written: Result<(), Error>) {
        let known = self.unwritten.iter().any(|unwritten| unwritten == file);
        match written {
            Ok(()) => self.unwritten.retain(|unwritten| unwritten != file),
            Err(error) if !known => {
                self.unwritten.push(file.to_owned());
                self.display.warn(format!("{error}; training goes on and will try again"));
            }
            Err(_) => {}
        }
    }

    fn append_row(&mut self, entropy_coefficient: f32) -> Result<(), Error> {
        self.tried = (self.seconds(), self.env_steps);
        let n = self.updates - self.row_updates;
        let [steps_rate, update_rate] =
            per_second(self.seconds() - self.row_seconds, [self.env_steps - self.row_steps, n]);
        // A mean over no updates is left out.
        let mean =
            |sum: f32, decimals: usize| if n == 0 { String::new() } else { format!("{:.decimals$}", sum / n as f32) };
        let success = self.success().map(|success| format!("{success:.4}")).unwrap_or_default();
        let reward = self.window.reward().map(|reward| format!("{reward:.2}")).unwrap_or_default();
        let validated = self.validated.map(|success| format!("{success:.4}")).unwrap_or_default();
        let Update { critic_loss, actor_loss, entropy, value } = self.sums;
        let row = format!(
            "{:.1},{},{},{},{success},{reward},{},{},{},{},{entropy_coefficient:.6},{steps_rate:.0},{update_rate:.1},{validated}\n",
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
        if let Some(events) = &mut self.events {
            let (file, written) = (events.path().to_owned(), events.append(HEAD, &row));
            self.note(&file, written);
        }
        self.sums = Update::default();
        self.validated = None;
        (self.row_seconds, self.row_steps, self.row_updates) = (self.seconds(), self.env_steps, self.updates);
        Ok(())
    }

    /// Shows how far the run is.
    fn show(&mut self) {
        let (since, steps, updates) =
            std::mem::replace(&mut self.shown, (Instant::now(), self.env_steps, self.updates));
        let [steps_per_second, updates_per_second] = match &self.last {
            // No step since: the latest rates stand.
            Some(last) if steps == self.env_steps => [last.steps_per_second, last.updates_per_second],
            _ => per_second(since.elapsed().as_secs_f64(), [self.env_steps - steps, self.updates - updates]),
        };
        let fraction = self.fraction();
        let names = self.unwritten.iter().filter_map(|file| Some(file.file_name()?.to_string_lossy().into_owned()));
        let status = Status {
            fraction,
            env_steps: self.env_steps,
            steps_per_second,
            updates_per_second,
            success: self.success(),
            window: self.window.count(),
            validation: self.validation,
            seconds_left: if 0.0 < fraction { self.seconds() * (1.0 - fraction) / fraction } else { 0.0 },
            unwritten: names.collect(),
        };
        self.display.show(&status);
        self.last = Some(status);
    }

    /// Adds the counters' columns.
    pub fn save(&self, columns: &mut Columns) {
        let Update { critic_loss, actor_loss, entropy, value } = self.sums;
        let counts =
            [self.env_steps, self.episodes, self.updates, self.row_steps, self.row_updates, self.metrics.length()];
        columns.put(COUNTS, counts.to_vec());
        columns.put(SECONDS, vec![self.seconds(), self.row_seconds]);
        columns.put("progress, sums", vec![critic_loss, actor_loss, entropy, value]);
        self.window.save(columns);
    }

    /// Continues counting where a checkpoint of this run left off, and removes the rows after it.
    pub fn restore(&mut self, stored: &Stored) -> Result<(), Error> {
        let length;
        [self.env_steps, self.episodes, self.updates, self.row_steps, self.row_updates, length] =
            stored.array(COUNTS)?;
        let [seconds, row_seconds] = stored.array(SECONDS)?;
        if self.env_steps < self.row_steps || self.updates < self.row_updates || seconds < row_seconds {
            return Err(
                stored.error(format!("its columns `{COUNTS}` and `{SECONDS}` say that the last row is yet to come"))
            );
        }
        let [critic_loss, actor_loss, entropy, value] = stored.array("progress, sums")?;
        self.sums = Update { critic_loss, actor_loss, entropy, value };
        self.window = Window::restored(stored)?;
        let before = Duration::try_from_secs_f64(seconds)
            .map_err(|error| stored.error(format!("its column `{SECONDS}`: {error}")))?;
        (self.before, self.begun, self.row_seconds) = (before, Instant::now(), row_seconds);
        self.tried = (seconds, self.row_steps);
        self.shown = (Instant::now(), self.env_steps, self.updates);
        if !self.metrics.cut(length)? {
            let file = shown_path(self.metrics.path());
            self.display.warn(format!("{file}: was missing: its rows begin again here"));
        }
        Ok(())
    }
}

fn per_second(seconds: f64, counts: [u64; 2]) -> [f64; 2] {
    counts.map(|count| count as f64 / seconds.max(f64::MIN_POSITIVE))
}

/// Columns of a checkpoint that say how far the run is.
const COUNTS: &str = "progress, counts";
const SECONDS: &str = "progress, seconds";

/// Training time (s) and env steps when a checkpoint was written.
pub fn reached(stored: &Stored) -> Result<(f64, u64), Error> {
    let [seconds, _] = stored.array(SECONDS)?;
    let [env_steps, ..] = stored.array::<u64, 6>(COUNTS)?;
    Ok((seconds, env_steps))
}

#[cfg(test)]
mod tests;
