//! Writes checkpoints and drivers while the run goes on: the columns go to the system at once, and a thread waits for the disk and moves
//! the files into their places. Until then the checkpoint before stands, so there is a whole one at any time.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::error::Error;
use crate::files;
use crate::learner::checkpoint::Columns;
use crate::learner::run::folder::Folder;

/// What came of writing a checkpoint and a driver.
#[derive(Debug)]
pub struct Kept {
    pub checkpoint: Result<(), Error>,
    pub policy: Result<(), Error>,
}

/// The checkpoint and the driver of a run.
#[derive(Debug)]
pub struct Keeper {
    /// The latest whole one.
    file: PathBuf,
    /// The one being written.
    part: PathBuf,
    policy: PathBuf,
    metrics: PathBuf,
    every: Duration,
    since: Instant,
    pending: Option<JoinHandle<Kept>>,
}

impl Keeper {
    /// A checkpoint every so many minutes.
    pub fn new(folder: &Folder, minutes: f64) -> Keeper {
        Keeper {
            file: folder.checkpoint(),
            part: folder.checkpoint_part(),
            policy: folder.policy(),
            metrics: folder.metrics(),
            every: Duration::from_secs_f64(60.0 * minutes),
            since: Instant::now(),
            pending: None,
        }
    }

    /// The latest whole checkpoint.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// What there is to go back to, in words.
    pub fn last_good(&self) -> String {
        if self.file.is_file() {
            format!("{} is the last good checkpoint", self.file.display())
        } else {
            "there is no checkpoint yet".to_owned()
        }
    }

    /// Whether it is time for another one.
    pub fn is_due(&self) -> bool {
        self.pending.is_none() && self.every <= self.since.elapsed()
    }

    /// The driver.
    pub fn policy(&self) -> &Path {
        &self.policy
    }

    /// Begins to write a checkpoint of these columns and a driver. Those still on their way are waited for.
    pub fn begin(&mut self, columns: &Columns, config: String, world: u32, policy: Vec<u8>) {
        // Whatever came of them, these are newer.
        self.wait();
        self.since = Instant::now();
        let written = columns.write(&self.part, config, world);
        let (part, whole, policy_file, metrics) = (self.part.clone(), self.file.clone(), self.policy.clone(), self.metrics.clone());
        let finish = move || {
            // The rows of figures are on the disk before the checkpoint that counts on them.
            let moved = written
                .and_then(|file| file.sync_all())
                .and_then(|()| File::open(metrics)?.sync_all())
                .and_then(|()| std::fs::rename(&part, &whole));
            if moved.is_err() {
                // What is left of a checkpoint that could not be written would fill the disk for nothing.
                let _ = std::fs::remove_file(&part);
            }
            Kept { checkpoint: moved.map_err(Error::write(&whole)), policy: files::write_whole(&policy_file, &policy) }
        };
        self.pending = Some(std::thread::spawn(finish));
    }

    /// What came of those begun last, once that is known.
    pub fn done(&mut self) -> Option<Kept> {
        if self.pending.as_ref().is_some_and(JoinHandle::is_finished) { self.wait() } else { None }
    }

    /// Waits for those begun last.
    pub fn wait(&mut self) -> Option<Kept> {
        self.pending.take().map(|pending| pending.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    }
}
