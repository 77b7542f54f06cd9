//! The folder of a run: created for it, and never written by another.

use std::path::{Path, PathBuf};

use offtrack::files::writer::followed;

use crate::config::Config;
use crate::error::Error;
use offtrack_evaluation::files;
use offtrack_evaluation::run_file::RunFile;

/// Maximum length of a run's name: a file system's, 255, less what is put after it.
const LONGEST_NAME: usize = 200;

/// Most bytes of a report that are read.
pub const REPORT_LIMIT: u64 = 64 << 20;

/// Where a run writes.
#[derive(Debug)]
pub struct Folder(PathBuf);

impl Folder {
    /// Makes `path`, which must be new, and writes the config into it.
    pub fn new(path: &Path, config: &Config) -> Result<Folder, Error> {
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(Error::write(parent))?;
        }
        match std::fs::create_dir(path) {
            Ok(()) => Folder(path.to_owned()).begun(config),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
                Err(Error::setting("folder", path.to_string_lossy(), "exists and is never overwritten: choose another"))
            }
            Err(error) => Err(Error::write(path)(error)),
        }
    }

    /// Makes a folder as [`make`] does and writes the config into it.
    pub fn create(runs: &Path, name: Option<&str>, config_file: &Path, config: &Config) -> Result<Folder, Error> {
        Folder(make(runs, name, config_file)?).begun(config)
    }

    /// The new folder with the config in it; where that cannot be written, it is removed again.
    fn begun(self, config: &Config) -> Result<Folder, Error> {
        match self.write_config(config) {
            Ok(()) => Ok(self),
            Err(error) => {
                self.discard();
                Err(error)
            }
        }
    }

    /// Removes the folder of a run that could not begin, which would be in the way of the next attempt. One with more
    /// in it than a run begins with stays.
    pub fn discard(&self) {
        let _ = std::fs::remove_file(self.config());
        let _ = std::fs::remove_file(self.metrics());
        let _ = std::fs::remove_dir(&self.0);
    }

    /// The folder of a run that continues.
    pub fn of(path: &Path) -> Result<Folder, Error> {
        let folder = Folder(path.to_owned());
        if folder.config().is_file() {
            return Ok(folder);
        }
        let expected = "the folder of a run is needed, with the config.toml that it left".to_owned();
        Err(Error::setting("--resume", path.display().to_string(), expected))
    }

    /// Writes the training file as used.
    pub fn write_config(&self, config: &Config) -> Result<(), Error> {
        Ok(files::write_whole(&self.config(), config.to_toml().as_bytes())?)
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// The training file as used.
    pub fn config(&self) -> PathBuf {
        RunFile::Config.of(&self.0)
    }

    /// All that it takes to continue, replaced in one move each time.
    pub fn checkpoint(&self) -> PathBuf {
        RunFile::Checkpoint.of(&self.0)
    }

    /// The next checkpoint while it is being written: beside the last one, also where that is kept elsewhere and
    /// linked.
    pub fn checkpoint_part(&self) -> PathBuf {
        followed(&self.checkpoint()).with_extension("part")
    }

    /// Removes what a killed process has left half written. No run may be writing.
    pub fn remove_parts(&self) {
        let _ = std::fs::remove_file(self.checkpoint_part());
    }

    /// The policy, replaced in one move each time.
    pub fn policy(&self) -> PathBuf {
        RunFile::Policy.of(&self.0)
    }

    /// A row of metrics every few seconds.
    pub fn metrics(&self) -> PathBuf {
        RunFile::Metrics.of(&self.0)
    }

    /// Success on each training route.
    pub fn routes(&self) -> PathBuf {
        RunFile::Routes.of(&self.0)
    }

    /// The report.
    pub fn report(&self) -> PathBuf {
        RunFile::Report.of(&self.0)
    }

    /// The report as a page to look at.
    pub fn page(&self) -> PathBuf {
        RunFile::Page.of(&self.0)
    }
}

/// Makes `runs/name`, or `runs/<training file's name>` with the first free number.
pub fn make(runs: &Path, name: Option<&str>, config_file: &Path) -> Result<PathBuf, Error> {
    files::make_folder(runs)?;
    match name {
        Some(name) => named(runs, name),
        None => numbered(runs, config_file),
    }
}

/// Whether the name of a run's folder may have this character.
fn is_plain_char(c: char) -> bool {
    c.is_ascii_alphanumeric() || "-_.".contains(c)
}

/// Whether a run's folder may have this name.
pub(crate) fn is_plain(name: &str) -> bool {
    name.chars().all(is_plain_char) && !name.starts_with('.') && (1..=LONGEST_NAME).contains(&name.len())
}

/// A name that a run's folder may have, also with a number behind it, as near to another as can be.
fn plain(name: &str) -> String {
    let near = |c: char| if is_plain_char(c) { c } else { '-' };
    // A hyphen and the ten digits of a number come behind it.
    let name: String = name.trim_start_matches('.').chars().map(near).take(LONGEST_NAME - 11).collect();
    if name.is_empty() { "run".to_owned() } else { name }
}

fn named(runs: &Path, name: &str) -> Result<PathBuf, Error> {
    if !is_plain(name) {
        let expected =
            format!("a name of 1 to {LONGEST_NAME} letters, digits, `-`, `_` and `.`, not the last first, is needed");
        return Err(Error::setting("--name", format!("{name:?}"), expected));
    }
    let path = runs.join(name);
    match std::fs::create_dir(&path) {
        Ok(()) => Ok(path),
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
            let expected = format!("{} exists and is never overwritten: choose another name", path.display());
            Err(Error::setting("--name", name, expected))
        }
        Err(error) => Err(Error::write(&path)(error)),
    }
}

fn numbered(runs: &Path, config_file: &Path) -> Result<PathBuf, Error> {
    let stem = plain(&config_file.file_stem().unwrap_or_default().to_string_lossy());
    let mut number = 1u32;
    loop {
        let path = runs.join(format!("{stem}-{number}"));
        match std::fs::create_dir(&path) {
            Ok(()) => return Ok(path),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => number += 1,
            Err(error) => return Err(Error::write(&path)(error)),
        }
    }
}
