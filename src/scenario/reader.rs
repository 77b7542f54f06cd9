//! Reading a file: its path goes into every error, and values are checked one key at a time.

use std::fmt::Display;
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

/// A file being read: keeps its path for the errors and checks values one key at a time.
#[derive(Debug, Clone, Copy)]
pub struct Reader<'a> {
    file: &'a Path,
}

impl<'a> Reader<'a> {
    /// Reads `file` as TOML into the type that mirrors it.
    pub fn read<T: DeserializeOwned>(file: &'a Path) -> Result<(Reader<'a>, T), Error> {
        let text = std::fs::read_to_string(file).map_err(|source| Error::Unreadable { file: file.to_owned(), source })?;
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
