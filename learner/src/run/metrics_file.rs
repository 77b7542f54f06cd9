//! `metrics.csv`: whole rows only, even on a full disk, and cut back to where a checkpoint was.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::error::Error;

/// How long a run waits for the lock of a process that is still ending.
const LOCK_TIME: Duration = Duration::from_secs(3);

/// Names of the columns.
pub(super) const HEAD: &str = "seconds,env_steps,episodes,updates,success,reward,critic_loss,actor_loss,entropy,\
    value,entropy_coefficient,steps_per_second,updates_per_second,validation_success\n";

/// The file, held by one run at a time.
#[derive(Debug)]
pub struct MetricsFile {
    path: PathBuf,
    file: File,
    /// Bytes of whole rows.
    length: u64,
}

impl MetricsFile {
    /// A new file with the names of its columns.
    pub fn create(path: PathBuf) -> Result<MetricsFile, Error> {
        let file = OpenOptions::new().append(true).create_new(true).open(&path).map_err(Error::write(&path))?;
        let mut metrics_file = MetricsFile { path, file, length: 0 };
        metrics_file.lock()?;
        metrics_file.append(HEAD)?;
        Ok(metrics_file)
    }

    /// The file of a run that continues; its lock is taken.
    pub fn open(path: PathBuf) -> Result<MetricsFile, Error> {
        let read = OpenOptions::new().read(true).append(true).open(&path);
        // What can be read cannot be written.
        let file = read.map_err(|error| match File::open(&path) {
            Ok(_) => Error::write(&path)(error),
            Err(_) => Error::read(&path)(error),
        })?;
        let mut metrics_file = MetricsFile { length: 0, path, file };
        metrics_file.lock()?;
        // A run that was still ending may have written rows until its lock was let go.
        metrics_file.length = metrics_file.file.metadata().map_err(Error::read(&metrics_file.path))?.len();
        let mut head = String::new();
        BufReader::new(&metrics_file.file).read_line(&mut head).map_err(Error::read(&metrics_file.path))?;
        if head != HEAD {
            let message = "its columns are not those that this program writes: continue with the program that wrote it"
                .to_owned();
            return Err(Error::contents(&metrics_file.path, message));
        }
        Ok(metrics_file)
    }

    /// Locks the file: a second run in the same folder would mix its rows and checkpoints with those of the first.
    fn lock(&self) -> Result<(), Error> {
        let begun = Instant::now();
        loop {
            match self.file.try_lock() {
                // A killed process holds its lock until it has ended.
                Err(TryLockError::WouldBlock) if begun.elapsed() < LOCK_TIME => {
                    std::thread::sleep(Duration::from_millis(20))
                }
                Err(TryLockError::WouldBlock) => {
                    let message = "another run is writing it: stop that one first".to_owned();
                    return Err(Error::contents(&self.path, message));
                }
                // Some file systems have no locks; there runs go without.
                Ok(()) | Err(TryLockError::Error(_)) => return Ok(()),
            }
        }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes of whole rows.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Adds a row. After an error the file is as it was.
    pub fn append(&mut self, row: &str) -> Result<(), Error> {
        let written = self.file.write_all(row.as_bytes());
        if written.is_err() {
            // Half a row would spoil the next one.
            let _ = self.file.set_len(self.length);
        }
        written.map_err(Error::write(&self.path))?;
        self.length += row.len() as u64;
        Ok(())
    }

    /// Removes all rows.
    pub fn clear(&mut self) -> Result<(), Error> {
        self.shorten(HEAD.len() as u64)
    }

    /// Removes the rows after the first `length` bytes, where a row must end; whether all before are there. A file
    /// without any row stays as it is: it was missing, and is begun again.
    pub fn cut(&mut self, length: u64) -> Result<bool, Error> {
        if self.length == HEAD.len() as u64 {
            return Ok(self.length == length);
        }
        let Some(last) = length.checked_sub(1).filter(|_| length <= self.length) else {
            let message =
                format!("has {} bytes where its checkpoint expects {length}: put the whole file back", self.length);
            return Err(Error::contents(&self.path, message));
        };
        let mut byte = [0];
        let mut file = &self.file;
        file.seek(SeekFrom::Start(last)).and_then(|_| file.read_exact(&mut byte)).map_err(Error::read(&self.path))?;
        if byte != *b"\n" {
            let message = format!(
                "has no end of a row at byte {length}, where its checkpoint expects one: put the file back as it was"
            );
            return Err(Error::contents(&self.path, message));
        }
        self.shorten(length)?;
        Ok(true)
    }

    fn shorten(&mut self, length: u64) -> Result<(), Error> {
        self.file.set_len(length).map_err(Error::write(&self.path))?;
        self.length = length;
        Ok(())
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::io::Write;

    use super::{HEAD, MetricsFile};

    #[test]
    fn rows_that_a_run_writes_while_another_waits_for_its_lock_are_counted() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("metrics.csv");
        std::fs::write(&path, HEAD).unwrap();
        let mut ending = std::fs::OpenOptions::new().append(true).open(&path).unwrap();
        ending.lock().unwrap();
        let opened = std::thread::spawn(move || MetricsFile::open(path).unwrap());
        std::thread::sleep(std::time::Duration::from_millis(100));
        ending.write_all(b"a row\n").unwrap();
        drop(ending);
        assert_eq!(opened.join().unwrap().length(), HEAD.len() as u64 + 6);
    }

    #[test]
    fn a_file_that_may_be_read_but_not_written_is_said_to_be_so_and_is_no_wrong_input() {
        // A program that runs is no one's to write.
        let path = std::env::current_exe().unwrap();
        let error = MetricsFile::open(path.clone()).unwrap_err();
        assert!(error.to_string().starts_with(&format!("{}: cannot be written: ", path.display())), "{error}");
        assert!(!error.is_wrong_input());
    }
}
