//! What a stopped run continues from: its folder, its training file and its checkpoint; or why it cannot.

use std::path::Path;

use offtrack::files::reader::read_bytes;
use serde_json::Value;

use super::folder::{Folder, REPORT_LIMIT};
use super::metrics_file::MetricsFile;
use super::progress;
use crate::checkpoint::Stored;
use crate::config::{Config, Device, Flags};
use crate::error::Error;

/// A run in its folder.
#[derive(Debug)]
pub struct Resumed {
    /// The folder.
    pub folder: Folder,
    /// The run's own training file, with another budget where the command line gives one.
    pub config: Config,
    /// The run's metrics, locked: no other run can write a checkpoint meanwhile.
    pub metrics: MetricsFile,
    /// The run's last checkpoint; none where it was killed before the first one, so that it starts from the beginning.
    pub stored: Option<Stored>,
    /// The budget is another one than that of the run's own training file.
    pub has_new_budget: bool,
}

impl Resumed {
    /// Reads what a run left in its folder. Nothing is written but a missing `metrics.csv`; what a killed process left
    /// half written is removed.
    pub fn open(path: &Path, minutes: Option<f64>, steps: Option<u64>) -> Result<Resumed, Error> {
        let folder = Folder::of(path)?;
        let has_new_budget = minutes.is_some() || steps.is_some();
        let mut config = Config::read(&folder.config())?;
        // Policy and report are written after the first checkpoint.
        let had_checkpoint = folder.report().is_file() || folder.policy().is_file();
        if !folder.checkpoint().is_file() && had_checkpoint {
            let ended = if is_evaluated(&folder) { "has finished" } else { "was stopped" };
            let has_frames = config.refinement.as_ref().is_some_and(|refinement| 1 < refinement.frames);
            // A run begins with the policy of one observation alone.
            let instead = match has_frames {
                true => "begin another run".to_owned(),
                false => format!("train --from {} begins a run with its policy", folder.policy().display()),
            };
            return Err(refused(path, format!("it {ended} and its checkpoint is gone: {instead}")));
        }
        let file = folder.metrics();
        let metrics = if file.is_file() { MetricsFile::open(file)? } else { MetricsFile::create(file)? };
        folder.remove_parts();
        if !folder.checkpoint().is_file() {
            give_budget(&mut config, minutes, steps)?;
            return Ok(Resumed { folder, config, metrics, stored: None, has_new_budget });
        }
        let stored = Stored::read(&folder.checkpoint())?;
        let written =
            toml::from_str(stored.config()).map_err(|error| stored.error(format!("its training file: {error}")))?;
        if let Some((key, now, before)) = config.hindrance(&written) {
            let message = format!(
                "{key}: {now}; the checkpoint was written with {before}: put that back; only minutes, steps and \
                 checkpoint_minutes may differ"
            );
            return Err(Error::contents(&folder.config(), message));
        }
        give_budget(&mut config, minutes, steps)?;
        let (seconds, env_steps) = progress::reached(&stored)?;
        let over = config.minutes.is_some_and(|minutes| 60.0 * minutes <= seconds)
            || config.steps.is_some_and(|steps| steps <= env_steps);
        let is_evaluated = is_evaluated(&folder);
        let ends_here = config.steps == Some(env_steps) && !is_evaluated;
        if over && has_new_budget && !ends_here {
            let expected =
                format!("it was trained for {:.2} min and {env_steps} env steps: more are needed", seconds / 60.0);
            return Err(refused(path, expected));
        }
        let refilled = env_steps.saturating_add(config.before_updates());
        if config.device == Device::Gpu
            && let Some(steps) = config.steps.filter(|&steps| env_steps < steps && steps <= refilled)
            && has_new_budget
        {
            let expected = format!(
                "must be above {refilled}, or nothing is learned: a device fills its replay buffer again first"
            );
            return Err(Error::setting("--steps", steps.to_string(), expected));
        }
        if over && is_evaluated {
            let expected =
                "it has finished, see its report.json; with more --minutes or --steps than it had it continues"
                    .to_owned();
            return Err(refused(path, expected));
        }
        Ok(Resumed { folder, config, metrics, stored: Some(stored), has_new_budget })
    }
}

fn refused(path: &Path, expected: String) -> Error {
    Error::setting("--resume", path.display().to_string(), expected)
}

/// Gives a run another budget; an error if nothing would be learned in it.
fn give_budget(config: &mut Config, minutes: Option<f64>, steps: Option<u64>) -> Result<(), Error> {
    config.override_with(&Flags { minutes, steps, ..Flags::default() })?;
    steps.map_or(Ok(()), |steps| config.check_budget(Path::new(&format!("--steps {steps}"))))
}

/// The final evaluation has been written.
pub fn is_evaluated(folder: &Folder) -> bool {
    let report =
        read_bytes(&folder.report(), REPORT_LIMIT).ok().and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok());
    report.is_some_and(|report| report["interrupted"] == false)
}
