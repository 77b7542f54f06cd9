//! Reads files of a limited size and checks their values one key at a time. Every error names the file and, where there
//! is one, the key.
//!
//! Messages stay short and harmless whatever the file holds: long lines and values are cut, large numbers are printed
//! with an exponent, characters that a terminal obeys are escaped. Errors see to it where they are shown.

mod exactly;
mod message;
#[cfg(test)]
mod tests;

use std::fmt::Display;
use std::fs::File;
use std::io::Read;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

pub use exactly::Exactly;
pub use message::{LONGEST_PATH, differing, printable, said, shortened, shown, shown_path};

/// What can be wrong with a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file is missing, is not text, or may not be read.
    #[error("{}: cannot be read: {source}", shown_path(file))]
    Unreadable {
        /// The file that was asked for.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A folder, a device or a pipe. Reading one may never end.
    #[error("{}: is not a regular file; a file is needed", shown_path(file))]
    NotAFile {
        /// The path that was asked for.
        file: PathBuf,
    },
    /// The file is larger than any of its kind.
    #[error("{}: is larger than {} MiB, the most that is read of such a file", shown_path(file), limit >> 20)]
    TooLarge {
        /// The file that was asked for.
        file: PathBuf,
        /// Maximum number of bytes.
        limit: u64,
    },
    /// The library has no file of this name.
    #[error(
        "{what}: {}; must be a path ending in .toml or one of {}",
        shortened(name, LONGEST_VALUE),
        known.join(", ")
    )]
    UnknownName {
        /// What was looked up: `benchmark`, `roundabout` or `vehicle`.
        what: &'static str,
        /// The name that was asked for.
        name: String,
        /// The names that the library has.
        known: Vec<&'static str>,
    },
    /// The file is not valid TOML, has an unknown key, lacks one, or has one of a wrong type.
    #[error("{}: {}", shown_path(file), shortened(message, LONGEST_FAULT))]
    Malformed {
        /// The file that was read.
        file: PathBuf,
        /// Line, table, and what was expected.
        message: String,
    },
    /// A value that can be read but makes no sense.
    #[error(
        "{}: {}: {}; {}",
        shown_path(file),
        shortened(key, LONGEST_VALUE),
        shortened(value, LONGEST_VALUE),
        shortened(expected, LONGEST_EXPECTED)
    )]
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
    /// The caller stopped the reading of many roads, see [`crate::files::cache::Loading::stop`].
    #[error("stopped before all roads were read")]
    Stopped,
}

/// Maximum size of a scenario, vehicle or roundabout file: a hundred times the largest shipped one (bytes).
pub const TEXT_LIMIT: u64 = 1 << 20;

/// Maximum length of a key or value in a message (characters).
const LONGEST_VALUE: usize = 100;
/// Maximum length of what is wrong with a file as a whole (characters).
const LONGEST_FAULT: usize = 1000;
/// Maximum length of what a message asks for (characters).
const LONGEST_EXPECTED: usize = 600;

/// The bytes of a regular file of at most `limit` bytes.
///
/// # Errors
///
/// [`Error::NotAFile`] before anything is read, [`Error::TooLarge`] once `limit` bytes are, and [`Error::Unreadable`].
pub fn read_bytes(file: &Path, limit: u64) -> Result<Vec<u8>, Error> {
    let unreadable = |source| Error::Unreadable { file: file.to_owned(), source };
    // Opening a pipe waits for its writer, so the file type is checked first.
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

/// The text of a regular file of at most `limit` bytes.
///
/// # Errors
///
/// The errors of [`read_bytes`], and [`Error::Unreadable`] for bytes that are not UTF-8.
pub fn read_text(file: &Path, limit: u64) -> Result<String, Error> {
    String::from_utf8(read_bytes(file, limit)?).map_err(|error| Error::Unreadable {
        file: file.to_owned(),
        source: std::io::Error::new(std::io::ErrorKind::InvalidData, error.utf8_error()),
    })
}

/// The file whose values are being checked. It keeps the file's name for the errors.
#[derive(Debug, Clone, Copy)]
pub struct Reader<'a> {
    file: &'a Path,
}

impl<'a> Reader<'a> {
    /// Reads a TOML file of at most [`TEXT_LIMIT`] bytes into the type that mirrors it.
    ///
    /// # Errors
    ///
    /// The errors of [`read_text`], and [`Error::Malformed`].
    pub fn read<T: DeserializeOwned>(file: &'a Path) -> Result<(Reader<'a>, T), Error> {
        Reader::parse(file, &read_text(file, TEXT_LIMIT)?)
    }

    /// Parses TOML `text` into the type that mirrors it. Errors name `file` as its origin.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`].
    pub fn parse<T: DeserializeOwned>(file: &'a Path, text: &str) -> Result<(Reader<'a>, T), Error> {
        let written = toml::from_str(text)
            .map_err(|error| Error::Malformed { file: file.to_owned(), message: message::malformed(text, &error) })?;
        Ok((Reader { file }, written))
    }

    /// A reader for values that were read from `file` in another way, or whose origin errors shall name so.
    pub fn of(file: &'a Path) -> Reader<'a> {
        Reader { file }
    }

    /// The error for a value that makes no sense.
    pub fn invalid(&self, key: impl Into<String>, value: impl Display, expected: impl Into<String>) -> Error {
        Error::Invalid {
            file: self.file.to_owned(),
            key: key.into(),
            value: value.to_string(),
            expected: expected.into(),
        }
    }

    /// A finite number within `range`; `unit` is for the message.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`].
    pub fn within(&self, key: &str, value: f64, range: RangeInclusive<f64>, unit: &str) -> Result<f64, Error> {
        if range.contains(&value) {
            return Ok(value);
        }
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let limits = format!("must lie in {}..{}{unit}", shown(*range.start()), shown(*range.end()));
        Err(self.invalid(key, format_args!("{}{unit}", shown(value)), limits))
    }

    /// A count within `range`.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`].
    pub fn count(&self, key: &str, value: usize, range: RangeInclusive<usize>) -> Result<usize, Error> {
        if range.contains(&value) {
            return Ok(value);
        }
        Err(self.invalid(key, value, counts(&range)))
    }

    /// The length of a list within `range`; `what` are its values, for the message: `layers`.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`].
    pub fn length(&self, key: &str, n: usize, range: RangeInclusive<usize>, what: &str) -> Result<usize, Error> {
        if range.contains(&n) {
            return Ok(n);
        }
        let what = if n == 1 { what.strip_suffix('s').unwrap_or(what) } else { what };
        Err(self.invalid(key, format_args!("{n} {what}"), counts(&range)))
    }
}

/// What a count may be.
fn counts(range: &RangeInclusive<usize>) -> String {
    match (range.start(), range.end()) {
        (first, last) if first == last => format!("must be {first}"),
        (first, last) => format!("must lie in {first}..{last}"),
    }
}
