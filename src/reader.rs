//! Reading a file: its path goes into every error, and values are checked one key at a time.

use std::fmt::Display;
use std::fs::File;
use std::io::Read;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

/// What can be wrong with a file that says what to drive.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file is missing, is no text, or may not be read.
    #[error("{}: cannot be read: {source}", file.display())]
    Unreadable {
        /// The file that was asked for.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A folder, a device or a pipe: reading one may never end.
    #[error("{}: is not a regular file; a file is needed", file.display())]
    NotAFile {
        /// What was asked for.
        file: PathBuf,
    },
    /// The file is larger than any of its kind.
    #[error("{}: is larger than {} MiB, the most that is read of such a file", file.display(), limit >> 20)]
    TooLarge {
        /// The file that was asked for.
        file: PathBuf,
        /// Most bytes read.
        limit: u64,
    },
    /// The file is not valid TOML, has an unknown key, lacks one, or has one of a wrong type.
    #[error("{}: {message}", file.display())]
    Malformed {
        /// The file that was read.
        file: PathBuf,
        /// Line, key and what was expected, as the TOML reader says it.
        message: String,
    },
    /// A value that can be read but makes no sense.
    #[error("{}: {key}: {value}; {expected}", file.display())]
    Invalid {
        /// The file that was read.
        file: PathBuf,
        /// The key's full path, `arm[2].entry.offset`.
        key: String,
        /// The value as written, with its unit.
        value: String,
        /// What would do.
        expected: String,
    },
}

/// Most bytes of a scenario, vehicle or roundabout file: a hundred times the largest that comes with the project.
pub const TEXT_LIMIT: u64 = 1 << 20;

/// The bytes of a regular file of at most `limit` bytes. Anything else is refused before it is read, or as soon as it proves too long.
pub fn read_bytes(file: &Path, limit: u64) -> Result<Vec<u8>, Error> {
    let unreadable = |source| Error::Unreadable { file: file.to_owned(), source };
    // Opening a pipe waits for its writer, so ask what it is first.
    if !std::fs::metadata(file).map_err(unreadable)?.is_file() {
        return Err(Error::NotAFile { file: file.to_owned() });
    }
    let mut bytes = Vec::new();
    File::open(file).map_err(unreadable)?.take(limit + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if limit < bytes.len() as u64 {
        return Err(Error::TooLarge { file: file.to_owned(), limit });
    }
    Ok(bytes)
}

/// The same as text.
pub fn read_text(file: &Path, limit: u64) -> Result<String, Error> {
    String::from_utf8(read_bytes(file, limit)?).map_err(|error| Error::Unreadable {
        file: file.to_owned(),
        source: std::io::Error::new(std::io::ErrorKind::InvalidData, error.utf8_error()),
    })
}

/// A file being read: keeps its path for the errors and checks values one key at a time.
#[derive(Debug, Clone, Copy)]
pub struct Reader<'a> {
    file: &'a Path,
}

impl<'a> Reader<'a> {
    /// Reads `file` as TOML into the type that mirrors it.
    pub fn read<T: DeserializeOwned>(file: &'a Path) -> Result<(Reader<'a>, T), Error> {
        let text = read_text(file, TEXT_LIMIT)?;
        let written = toml::from_str(&text).map_err(|error| Error::Malformed { file: file.to_owned(), message: error.to_string() })?;
        Ok((Reader { file }, written))
    }

    /// A reader for values that come from `file` in another way, or from no file: then it is what the errors name instead.
    pub fn of(file: &'a Path) -> Reader<'a> {
        Reader { file }
    }

    /// The error for a value that makes no sense.
    pub fn invalid(&self, key: impl Into<String>, value: impl Display, expected: impl Into<String>) -> Error {
        Error::Invalid { file: self.file.to_owned(), key: key.into(), value: value.to_string(), expected: expected.into() }
    }

    /// A finite number within `range`; `unit` is for the message.
    pub fn within(&self, key: &str, value: f64, range: RangeInclusive<f64>, unit: &str) -> Result<f64, Error> {
        if range.contains(&value) {
            return Ok(value);
        }
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        Err(self.invalid(key, format_args!("{value}{unit}"), format!("must lie in {}..{}{unit}", range.start(), range.end())))
    }

    /// A count within `range`.
    pub fn count(&self, key: &str, value: usize, range: RangeInclusive<usize>) -> Result<usize, Error> {
        if range.contains(&value) {
            return Ok(value);
        }
        Err(self.invalid(key, value, format!("must lie in {}..{}", range.start(), range.end())))
    }
}
