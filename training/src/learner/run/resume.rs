//! What a run that was stopped goes on from: its folder, its config and its checkpoint, or why it cannot.

use std::path::Path;

use serde_json::Value;

use super::folder::Folder;
use super::metrics::Figures;
use super::progress;
use crate::error::Error;
use crate::learner::checkpoint::Stored;
use crate::learner::config::Config;

/// A run in its folder.
#[derive(Debug)]
pub struct Resumed {
    pub folder: Folder,
    /// The run's own, with another budget where the command line asks for it.
    pub config: Config,
    pub figures: Figures,
    pub stored: Stored,
}

impl Resumed {
    /// Reads all of it; nothing is written yet.
    pub fn open(path: &Path, minutes: Option<f64>, steps: Option<u64>) -> Result<Resumed, Error> {
        let folder = Folder::of(path)?;
        let mut config = Config::read(&folder.config())?;
        if !folder.checkpoint().is_file() {
            let expected = "it has no checkpoint.safetensors: the run was stopped before its first one; begin it anew with its config.toml";
            return Err(refused(path, expected.to_owned()));
        }
        // Held from here on, so that no other run writes another checkpoint meanwhile.
        let figures = Figures::open(folder.metrics())?;
        let stored = Stored::read(&folder.checkpoint())?;
        let written = toml::from_str(stored.config()).map_err(|error| stored.error(format!("its training file: {error}")))?;
        if !config.is_same_run(&written) {
            let message =
                "is not the training file that the checkpoint was written with; only minutes, steps and checkpoint_minutes may differ";
            return Err(Error::Contents { file: folder.config(), message: message.to_owned() });
        }
        config.override_with(None, minutes, steps, None)?;
        let (seconds, env_steps) = progress::reached(&stored)?;
        let over = config.minutes.is_some_and(|minutes| 60.0 * minutes <= seconds) || config.steps.is_some_and(|steps| steps <= env_steps);
        if over && (minutes.is_some() || steps.is_some()) {
            let expected = format!("it has learned for {:.2} min and {env_steps} env steps: more are needed", seconds / 60.0);
            return Err(refused(path, expected));
        }
        if over && is_examined(&folder) {
            let expected = "it has finished, see its report.json; with more --minutes or --steps than it had it goes on".to_owned();
            return Err(refused(path, expected));
        }
        Ok(Resumed { folder, config, figures, stored })
    }
}

fn refused(path: &Path, expected: String) -> Error {
    Error::Flag { flag: "--resume", value: path.display().to_string(), expected }
}

/// The closing examination has been written.
fn is_examined(folder: &Folder) -> bool {
    let report = std::fs::read(folder.report()).ok().and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok());
    report.is_some_and(|report| report["interrupted"] == false)
}
