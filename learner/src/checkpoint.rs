//! A checkpoint's file: named columns of numbers.
//!
//! The format is safetensors, as a policy's is. The metadata's entry has the format's version, the training file, and a
//! checksum over all columns: a file that is cut or changed is refused. Floats in it are finite.

use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt::Display;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use bytemuck::{Pod, cast_slice, cast_slice_mut};
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, Metadata, TensorInfo};
use serde::{Deserialize, Serialize};

use offtrack::files::reader::read_bytes;

use crate::error::Error;

/// Key of the metadata's one entry.
const KEY: &str = "offtrack-checkpoint";
/// Version of the columns' meaning.
const VERSION: u32 = 3;
/// Most bytes of a checkpoint: 200 million transitions.
const LIMIT: u64 = 64 << 30;

/// What a column holds.
pub trait Number: Pod + Display {
    /// The number's type as the file names it.
    const DTYPE: Dtype;

    /// Whether the value is a number at all.
    fn is_finite(&self) -> bool {
        true
    }
}

impl Number for u8 {
    const DTYPE: Dtype = Dtype::U8;
}
impl Number for u32 {
    const DTYPE: Dtype = Dtype::U32;
}
impl Number for u64 {
    const DTYPE: Dtype = Dtype::U64;
}
impl Number for f32 {
    const DTYPE: Dtype = Dtype::F32;

    fn is_finite(&self) -> bool {
        f32::is_finite(*self)
    }
}
impl Number for f64 {
    const DTYPE: Dtype = Dtype::F64;

    fn is_finite(&self) -> bool {
        f64::is_finite(*self)
    }
}

/// The metadata's entry.
#[derive(Debug, Serialize, Deserialize)]
struct Description {
    version: u32,
    /// The run's training file.
    config: String,
    /// CRC-32 of the world that it is trained in.
    world: u32,
    /// CRC-32 of this description with a 0 here, followed by each column's name and bytes in the order of names.
    checksum: u32,
}

/// Columns on their way into a file.
#[derive(Debug, Default)]
pub struct Columns<'a>(Vec<Column<'a>>);

#[derive(Debug)]
struct Column<'a> {
    name: String,
    dtype: Dtype,
    bytes: Cow<'a, [u8]>,
}

impl<'a> Columns<'a> {
    /// Adds a column; what is borrowed is not copied.
    pub fn put<T: Number>(&mut self, name: impl Into<String>, numbers: impl Into<Cow<'a, [T]>>) {
        let bytes = match numbers.into() {
            Cow::Borrowed(numbers) => Cow::Borrowed(cast_slice(numbers)),
            Cow::Owned(numbers) => Cow::Owned(cast_slice(&numbers).to_vec()),
        };
        self.0.push(Column { name: name.into(), dtype: T::DTYPE, bytes });
    }

    /// Writes the file of a run with this training file in this world. What was at `path` is lost at once: write beside
    /// the last good file.
    pub fn write(&self, path: &Path, config: String, world: u32) -> std::io::Result<File> {
        let mut description = Description { version: VERSION, config, world, checksum: 0 };
        let named = self.0.iter().map(|column| (column.name.as_str(), column.bytes.as_ref()));
        description.checksum = checksum(&description, named.collect());
        let mut end = 0;
        let info = |column: &Column| {
            let begin = end;
            end += column.bytes.len();
            let shape = vec![column.bytes.len() / (column.dtype.bitsize() / 8)];
            (column.name.clone(), TensorInfo { dtype: column.dtype, shape, data_offsets: (begin, end) })
        };
        let entries = HashMap::from([(KEY.to_owned(), text(&description))]);
        let header = Metadata::new(Some(entries), self.0.iter().map(info).collect()).map_err(std::io::Error::other)?;
        let mut header = serde_json::to_vec(&header)?;
        header.resize(header.len().next_multiple_of(8), b' ');
        let mut file = BufWriter::with_capacity(1 << 20, File::create(path)?);
        file.write_all(&(header.len() as u64).to_le_bytes())?;
        file.write_all(&header)?;
        for column in &self.0 {
            file.write_all(&column.bytes)?;
        }
        file.into_inner().map_err(|error| error.into_error())
    }
}

/// A checkpoint in hand: its checksum was right.
#[derive(Debug)]
pub struct Stored {
    path: PathBuf,
    bytes: Vec<u8>,
    /// Where the columns begin in `bytes`.
    begin: usize,
    header: Metadata,
    description: Description,
}

impl Stored {
    /// Reads a checkpoint. One that is cut, changed, of another version, or was never one is refused.
    pub fn read(path: &Path) -> Result<Stored, Error> {
        let bytes = read_bytes(path, LIMIT)?;
        Stored::from_bytes(path, bytes).map_err(|message| Error::contents(path, message))
    }

    /// The error is a message without the file's name.
    fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Stored, String> {
        let damaged = |what: String| {
            format!("is no checkpoint, or a damaged one: {what}; put a copy of it back or begin a new run")
        };
        let (n, header) = SafeTensors::read_metadata(&bytes).map_err(|error| damaged(error.to_string()))?;
        let entry = header.metadata().as_ref().and_then(|metadata| metadata.get(KEY));
        let entry = entry.ok_or_else(|| damaged(format!("its metadata has no entry `{KEY}`")))?;
        let version: Versioned = serde_json::from_str(entry).map_err(|error| damaged(error.to_string()))?;
        if version.version != VERSION {
            let found = version.version;
            return Err(format!(
                "is a checkpoint of version {found}, this program continues from version {VERSION}: continue with the \
                program that wrote it"
            ));
        }
        let mut description: Description = serde_json::from_str(entry).map_err(|error| damaged(error.to_string()))?;
        let found = std::mem::take(&mut description.checksum);
        let begin = 8 + n;
        let names = header.offset_keys();
        let named = names.iter().filter_map(|name| Some((name.as_str(), &bytes[begin..][offsets(&header, name)?])));
        let expected = checksum(&description, named.collect());
        if found != expected {
            return Err(damaged(format!("its checksum is {found:08x} where its contents give {expected:08x}")));
        }
        Ok(Stored { path: path.to_owned(), begin, header, description, bytes })
    }

    /// The training file of the run that wrote it.
    pub fn config(&self) -> &str {
        &self.description.config
    }

    /// CRC-32 of the world that the run is trained in.
    pub fn world(&self) -> u32 {
        self.description.world
    }

    /// A column's bytes, none when there is no such column.
    pub fn bytes(&self, name: &str) -> Option<&[u8]> {
        Some(&self.bytes[self.begin..][offsets(&self.header, name)?])
    }

    /// A column of any length.
    pub fn column<T: Number>(&self, name: &str) -> Result<Vec<T>, Error> {
        let bytes = self.bytes(name).filter(|_| self.header.info(name).is_some_and(|info| info.dtype == T::DTYPE));
        let bytes = bytes.ok_or_else(|| self.error(format!("has no column `{name}` of type {:?}", T::DTYPE)))?;
        let mut numbers = vec![T::zeroed(); bytes.len() / size_of::<T>()];
        cast_slice_mut(&mut numbers).copy_from_slice(bytes);
        match numbers.iter().position(|number| !number.is_finite()) {
            Some(index) => {
                Err(self.error(format!("its column `{name}` has {} at {index}: put a sound copy back", numbers[index])))
            }
            None => Ok(numbers),
        }
    }

    /// A column that must have `n` numbers.
    pub fn exactly<T: Number>(&self, name: &str, n: usize) -> Result<Vec<T>, Error> {
        let numbers = self.column(name)?;
        if numbers.len() == n {
            return Ok(numbers);
        }
        Err(self.error(format!("its column `{name}` has {} numbers where this run needs {n}", numbers.len())))
    }

    /// A column of as many numbers as an array has.
    pub fn array<T: Number, const N: usize>(&self, name: &str) -> Result<[T; N], Error> {
        let mut array = [T::zeroed(); N];
        array.copy_from_slice(&self.exactly(name, N)?);
        Ok(array)
    }

    /// Something else that is wrong with the file.
    pub fn error(&self, message: String) -> Error {
        Error::contents(&self.path, message)
    }
}

/// The one part of a description that every version has.
#[derive(Deserialize)]
struct Versioned {
    version: u32,
}

fn offsets(header: &Metadata, name: &str) -> Option<std::ops::Range<usize>> {
    let (begin, end) = header.info(name)?.data_offsets;
    Some(begin..end)
}

fn text(description: &Description) -> String {
    serde_json::to_string(description).expect("numbers and words can be written as JSON")
}

fn checksum(unsigned: &Description, mut columns: Vec<(&str, &[u8])>) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(text(unsigned).as_bytes());
    // By name: the header does not keep the order of columns without numbers.
    columns.sort_unstable_by_key(|&(name, _)| name);
    for (name, bytes) in columns {
        hasher.update(name.as_bytes());
        hasher.update(bytes);
    }
    hasher.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small checkpoint's bytes.
    fn written() -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checkpoint.safetensors");
        let mut columns = Columns::default();
        columns.put("words", &[1u64, u64::MAX][..]);
        columns.put("values", vec![0.1f32, f32::MIN_POSITIVE, -0.0]);
        columns.put("none", Vec::<u8>::new());
        columns.put("nothing", Vec::<f64>::new());
        columns.write(&path, "seed = 1".to_owned(), 7).unwrap();
        std::fs::read(path).unwrap()
    }

    fn read(bytes: Vec<u8>) -> Result<Stored, String> {
        Stored::from_bytes(Path::new("checkpoint.safetensors"), bytes)
    }

    #[test]
    fn what_was_written_is_read_back_bit_for_bit() {
        let stored = read(written()).unwrap();
        assert_eq!((stored.config(), stored.world()), ("seed = 1", 7));
        assert_eq!(stored.array::<u64, 2>("words").unwrap(), [1, u64::MAX]);
        let values = stored.array::<f32, 3>("values").unwrap();
        assert_eq!(values.map(f32::to_bits), [0.1f32, f32::MIN_POSITIVE, -0.0].map(f32::to_bits));
        assert!(stored.column::<u8>("none").unwrap().is_empty());
        for (error, expected) in [
            (stored.column::<u64>("values").unwrap_err(), "has no column `values` of type U64"),
            (stored.column::<u64>("word").unwrap_err(), "has no column `word`"),
            (stored.exactly::<u64>("words", 3).unwrap_err(), "`words` has 2 numbers where this run needs 3"),
        ] {
            assert!(
                error.to_string().starts_with("checkpoint.safetensors: ") && error.to_string().contains(expected),
                "{error}"
            );
        }
    }

    #[test]
    fn a_checkpoint_cut_anywhere_or_with_any_bit_changed_is_refused() {
        let whole = written();
        for n in 0..whole.len() {
            assert!(read(whole[..n].to_vec()).unwrap_err().contains("damaged"), "cut at {n}");
            let mut changed = whole.clone();
            changed[n] ^= 1 << (n % 8);
            if let Ok(stored) = read(changed) {
                // A header says some things more than once; what it says must still be the same.
                let numbers = (stored.array("words").unwrap(), stored.array::<f32, 3>("values").unwrap());
                assert_eq!(numbers, ([1u64, u64::MAX], [0.1, f32::MIN_POSITIVE, -0.0]), "changed at {n}");
            }
        }
        assert!(read([whole, vec![0]].concat()).unwrap_err().contains("damaged"));
    }

    #[test]
    fn a_checkpoint_of_another_version_is_refused_by_its_version() {
        let whole = written();
        let text = br#"{\"version\":3,"#;
        let at = whole.windows(text.len()).position(|window| window == text).unwrap() + text.len() - 2;
        let mut other = whole;
        other[at] = b'2';
        let message = read(other).unwrap_err();
        assert!(message.contains("version 2, this program continues from version 3"), "{message}");
    }
}
