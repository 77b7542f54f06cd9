//! Writes checkpoints and policies while training goes on. The columns are handed to the system at once; a thread waits
//! for the disk and moves the files into place. Until then the previous checkpoint stands, so there is a whole one at
//! any time.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use offtrack::files::writer::{followed, keep_access, sync_name};

use crate::checkpoint::Columns;
use crate::error::Error;
use crate::run::folder::Folder;
use offtrack_evaluation::files;

/// From the first checkpoint to the second.
const FIRST: Duration = Duration::from_secs(5);

/// Whether a checkpoint and a policy could be written.
#[derive(Debug)]
pub struct Written {
    /// The checkpoint.
    pub checkpoint: Result<(), Error>,
    /// The policy.
    pub policy: Result<(), Error>,
}

/// The checkpoint and the policy of a run.
#[derive(Debug)]
pub struct Checkpointer {
    /// The latest whole one.
    file: PathBuf,
    /// The one being written.
    part: PathBuf,
    policy: PathBuf,
    metrics: PathBuf,
    /// Longest time between two checkpoints.
    interval: Duration,
    /// The first ones are closer together: a run that is killed early loses little.
    next: Duration,
    since: Option<Instant>,
    /// The checkpoint that there is was not written by this process, which continued from it.
    is_continued: bool,
    pending: Option<JoinHandle<Written>>,
}

impl Checkpointer {
    /// The first checkpoint at once, then after 5, 10, 20 ... seconds, and at least every so many minutes.
    pub fn new(folder: &Folder, minutes: f64) -> Checkpointer {
        Checkpointer {
            file: folder.checkpoint(),
            part: folder.checkpoint_part(),
            policy: folder.policy(),
            metrics: folder.metrics(),
            interval: Duration::from_secs_f64(60.0 * minutes),
            next: FIRST,
            since: None,
            is_continued: false,
            pending: None,
        }
    }

    /// The latest whole checkpoint.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// The run continues from the checkpoint that there is.
    pub fn continue_from(&mut self) {
        self.is_continued = true;
    }

    /// What there is to go back to, in words. That a checkpoint was read does not make it a good one: its numbers may
    /// be what the run failed by.
    pub fn last_good(&self) -> String {
        let file = self.file.display();
        match (self.file.is_file(), self.is_continued) {
            (false, _) => "there is no checkpoint yet".to_owned(),
            (true, true) => format!("it continued from {file} and has written none since, so that one may be at fault"),
            (true, false) => format!("{file} is the last good checkpoint"),
        }
    }

    /// Whether it is time for the next checkpoint.
    pub fn is_due(&self) -> bool {
        self.pending.is_none() && self.since.is_none_or(|since| self.next.min(self.interval) <= since.elapsed())
    }

    /// The policy.
    pub fn policy(&self) -> &Path {
        &self.policy
    }

    /// Begins to write a checkpoint of these columns and a policy. It waits for those that are still being written.
    pub fn begin(&mut self, columns: &Columns, config: String, world: u32, policy: Vec<u8>) {
        // The columns are newer than those still being written, whether or not those can be.
        self.wait();
        if self.since.replace(Instant::now()).is_some() {
            self.next = self.interval.min(self.next.saturating_mul(2));
        }
        let written = columns.write(&self.part, config, world);
        if let (Ok(file), Ok(last)) = (&written, std::fs::metadata(&self.file)) {
            // Where the owner cannot be kept, the checkpoint is this user's.
            let _ = keep_access(&last, file);
        }
        let (part, whole, policy_file, metrics) =
            (self.part.clone(), self.file.clone(), self.policy.clone(), self.metrics.clone());
        let finish = move || {
            // The rows of metrics are on the disk before the checkpoint that refers to them.
            let moved = written
                .and_then(|file| file.sync_all())
                .and_then(|()| File::open(metrics)?.sync_all())
                .and_then(|()| std::fs::rename(&part, followed(&whole)));
            sync_name(&followed(&whole));
            if moved.is_err() {
                // A part of a checkpoint would fill the disk for nothing.
                let _ = std::fs::remove_file(&part);
            }
            Written {
                checkpoint: moved.map_err(Error::write(&whole)),
                policy: files::write_whole(&policy_file, &policy).map_err(Error::from),
            }
        };
        self.pending = Some(std::thread::spawn(finish));
    }

    /// Whether those begun last could be written, once that is known.
    pub fn finished(&mut self) -> Option<Written> {
        if self.pending.as_ref().is_some_and(JoinHandle::is_finished) { self.wait() } else { None }
    }

    /// Waits for those begun last.
    pub fn wait(&mut self) -> Option<Written> {
        let written: Written = self.pending.take()?.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        self.is_continued &= written.checkpoint.is_err();
        Some(written)
    }
}
