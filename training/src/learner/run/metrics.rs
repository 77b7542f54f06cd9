//! `metrics.csv`: whole rows or none, whatever the disk says, and cut back to where a checkpoint stood.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use crate::error::Error;

/// Names of the columns.
const HEAD: &str = "seconds,env_steps,episodes,updates,success,reward,critic_loss,actor_loss,entropy,value,entropy_weight,steps_per_second,updates_per_second\n";

/// The file, held by one run at a time.
#[derive(Debug)]
pub struct Figures {
    path: PathBuf,
    file: File,
    /// Bytes of whole rows.
    length: u64,
}

impl Figures {
    /// Begins the file with the names of its columns.
    pub fn create(path: PathBuf) -> Result<Figures, Error> {
        let file = OpenOptions::new().append(true).create_new(true).open(&path).map_err(Error::write(&path))?;
        let mut figures = Figures { path, file, length: 0 };
        figures.hold()?;
        figures.append(HEAD)?;
        Ok(figures)
    }

    /// Opens the file of a run that is to go on.
    pub fn open(path: PathBuf) -> Result<Figures, Error> {
        let read = OpenOptions::new().read(true).append(true).open(&path);
        let file = read.map_err(Error::read(&path))?;
        let figures = Figures { length: file.metadata().map_err(Error::read(&path))?.len(), path, file };
        figures.hold()?;
        let mut head = String::new();
        BufReader::new(&figures.file).read_line(&mut head).map_err(Error::read(&figures.path))?;
        if head != HEAD {
            let message = "its columns are not those that this program writes: go on with the program that wrote it".to_owned();
            return Err(Error::Contents { file: figures.path, message });
        }
        Ok(figures)
    }

    /// A second run in the same folder would mix its rows and checkpoints with the first one's.
    fn hold(&self) -> Result<(), Error> {
        match self.file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                let message = "another run is writing it: stop that one first".to_owned();
                Err(Error::Contents { file: self.path.clone(), message })
            }
            // Some file systems know no locks; runs go on without.
            Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
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

    /// Takes back the rows after the first `length` bytes.
    pub fn cut(&mut self, length: u64) -> Result<(), Error> {
        if self.length < length {
            let message = format!("has {} bytes where its checkpoint knows of {length}: put the whole file back", self.length);
            return Err(Error::Contents { file: self.path.clone(), message });
        }
        self.file.set_len(length).map_err(Error::write(&self.path))?;
        self.length = length;
        Ok(())
    }
}
