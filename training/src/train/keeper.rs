//! Writes checkpoints while the run goes on: the columns go to the system at once, and a thread waits for the disk and moves the file into
//! its place. Until then the checkpoint before it stands, so there is a whole one at any time.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::checkpoint::Columns;
use crate::error::Error;
use crate::train::folder::Folder;

/// The checkpoint of a run.
#[derive(Debug)]
pub struct Keeper {
    /// The latest whole one.
    file: PathBuf,
    /// The one being written.
    part: PathBuf,
    metrics: PathBuf,
    every: Duration,
    since: Instant,
    pending: Option<JoinHandle<Result<(), Error>>>,
}

impl Keeper {
    /// A checkpoint every so many minutes.
    pub fn new(folder: &Folder, minutes: f64) -> Keeper {
        Keeper {
            file: folder.checkpoint(),
            part: folder.checkpoint_part(),
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

    /// Whether it is time for another one.
    pub fn is_due(&self) -> bool {
        self.pending.is_none() && self.every <= self.since.elapsed()
    }

    /// Begins to write a checkpoint of these columns. One still on its way is waited for.
    pub fn begin(&mut self, columns: &Columns, config: String, world: u32) -> Result<(), Error> {
        // Whatever came of it, this one is newer.
        let _ = self.wait();
        self.since = Instant::now();
        let file = columns.write(&self.part, config, world).map_err(|error| self.failed(error))?;
        let (part, whole, metrics) = (self.part.clone(), self.file.clone(), self.metrics.clone());
        let finish = move || {
            // Its rows are on the disk before the checkpoint that counts on them.
            let moved = file.sync_all().and_then(|()| File::open(metrics)?.sync_all()).and_then(|()| std::fs::rename(&part, &whole));
            moved.map_err(|error| failed(&part, &whole, error))
        };
        let thread = std::thread::Builder::new().name("checkpoint".to_owned()).spawn(finish);
        self.pending = Some(thread.map_err(|error| self.failed(error))?);
        Ok(())
    }

    /// What came of the checkpoint begun last, once that is known.
    pub fn done(&mut self) -> Option<Result<(), Error>> {
        self.pending.as_ref().is_some_and(JoinHandle::is_finished).then(|| self.wait())
    }

    /// Waits for the checkpoint begun last.
    pub fn wait(&mut self) -> Result<(), Error> {
        match self.pending.take() {
            Some(pending) => pending.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
            None => Ok(()),
        }
    }

    fn failed(&self, error: std::io::Error) -> Error {
        failed(&self.part, &self.file, error)
    }
}

/// What is left of a checkpoint that could not be written would fill the disk for nothing.
fn failed(part: &Path, whole: &Path, error: std::io::Error) -> Error {
    let _ = std::fs::remove_file(part);
    Error::write(whole)(error)
}
