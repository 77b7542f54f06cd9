//! A TensorBoard event file with the figures of `metrics.csv`: records with checksums (TFRecord), each an `Event` of
//! TensorFlow's `event.proto`.
//!
//! Each process writes a file of its own, as TensorBoard expects. It begins with the step after the last row that the
//! run keeps, and TensorBoard then leaves out what earlier files have from that step on.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::error::Error;

/// What TensorBoard looks for in a file's name. The Unix time (s) follows: it reads files in the order of their names.
const PREFIX: &str = "events.out.tfevents.";
/// The column that is the step of all others.
const STEP: &str = "env_steps";

/// The file of one process.
#[derive(Debug)]
pub struct EventsFile {
    path: PathBuf,
    file: File,
    /// Bytes of whole records.
    length: u64,
}

impl EventsFile {
    /// A new file in a run's folder, after those of earlier processes. `row_steps` is the step of the last row that the
    /// run keeps (env steps).
    pub fn create(folder: &Path, row_steps: u64) -> Result<EventsFile, Error> {
        let latest = std::fs::read_dir(folder)
            .map_err(Error::read(folder))?
            .flatten()
            .filter_map(|entry| written_at(&entry.path()))
            .max();
        let time = latest.map_or(0, |latest| latest + 1).max(now() as u64);
        let path = folder.join(format!("{PREFIX}{time:010}.offtrack"));
        let file = OpenOptions::new().append(true).create_new(true).open(&path).map_err(Error::write(&path))?;
        let mut events = EventsFile { path, file, length: 0 };
        let version = Message::default().bytes(3, b"brain.Event:2");
        let start = Message::default().varint(2, row_steps + 1).bytes(7, &Message::default().varint(1, 1).0);
        events.write(&[record(&event(version)), record(&event(start))].concat())?;
        Ok(events)
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a row of metrics, under the names of its columns. After an error the file is as it was.
    pub fn append(&mut self, head: &str, row: &str) -> Result<(), Error> {
        let columns = || head.trim_end().split(',').zip(row.trim_end().split(','));
        let step = columns().find(|(name, _)| *name == STEP).and_then(|(_, value)| value.parse().ok()).unwrap_or(0);
        // A mean over nothing is left out of the row, and so of the event.
        let values = columns()
            .filter(|(name, _)| *name != STEP)
            .filter_map(|(name, value)| Some((name, value.parse::<f32>().ok()?)));
        let summary = values.fold(Message::default(), |summary, (name, value)| {
            let value = Message::default().bytes(1, name.as_bytes()).float(2, value);
            summary.bytes(1, &value.0)
        });
        self.write(&record(&event(Message::default().varint(2, step).bytes(5, &summary.0))))
    }

    fn write(&mut self, records: &[u8]) -> Result<(), Error> {
        let written = self.file.write_all(records);
        if written.is_err() {
            // Half a record would hide those after it.
            let _ = self.file.set_len(self.length);
        }
        written.map_err(Error::write(&self.path))?;
        self.length += records.len() as u64;
        Ok(())
    }
}

/// The time in an event file's name (s).
fn written_at(path: &Path) -> Option<u64> {
    path.file_name()?.to_str()?.strip_prefix(PREFIX)?.split('.').next()?.parse().ok()
}

/// Unix time (s).
fn now() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |time| time.as_secs_f64())
}

/// An `Event` of now with these fields.
fn event(fields: Message) -> Vec<u8> {
    [Message::default().double(1, now()).0, fields.0].concat()
}

/// A TFRecord: length, its checksum, the bytes, their checksum.
fn record(bytes: &[u8]) -> Vec<u8> {
    let length = (bytes.len() as u64).to_le_bytes();
    [&length[..], &masked(&length).to_le_bytes(), bytes, &masked(bytes).to_le_bytes()].concat()
}

/// CRC-32C, rotated and shifted as TFRecord has it.
fn masked(bytes: &[u8]) -> u32 {
    crc32c::crc32c(bytes).rotate_right(15).wrapping_add(0xa282_ead8)
}

/// The fields of a Protocol Buffers message, each after its number and wire type.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    fn number(&mut self, mut value: u64) {
        while 0x80 <= value {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    fn key(&mut self, field: u64, wire_type: u64) {
        self.number(field << 3 | wire_type);
    }

    fn varint(mut self, field: u64, value: u64) -> Message {
        self.key(field, 0);
        self.number(value);
        self
    }

    fn double(mut self, field: u64, value: f64) -> Message {
        self.key(field, 1);
        self.0.extend(value.to_le_bytes());
        self
    }

    fn bytes(mut self, field: u64, value: &[u8]) -> Message {
        self.key(field, 2);
        self.number(value.len() as u64);
        self.0.extend(value);
        self
    }

    fn float(mut self, field: u64, value: f32) -> Message {
        self.key(field, 5);
        self.0.extend(value.to_le_bytes());
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_is_framed_as_tensorflow_frames_it() {
        // The first record of a file that PyTorch's SummaryWriter writes has 24 bytes, and this checksum of its length.
        assert_eq!(masked(&24u64.to_le_bytes()).to_le_bytes(), [0xa3, 0x7f, 0x4b, 0x22]);
        let record = record(b"abc");
        assert_eq!(
            (record.len(), &record[..8], &record[12..15]),
            (8 + 4 + 3 + 4, &3u64.to_le_bytes()[..], &b"abc"[..])
        );
    }

    #[test]
    fn fields_are_encoded_as_the_guide_of_protocol_buffers_shows() {
        // "Encoding", protobuf.dev: field 1 = 150; field 2 = "testing".
        assert_eq!(Message::default().varint(1, 150).0, [0x08, 0x96, 0x01]);
        assert_eq!(Message::default().bytes(2, b"testing").0, b"\x12\x07testing");
        assert_eq!(Message::default().float(2, 1.0).double(1, -2.0).0, b"\x15\0\0\x80\x3f\x09\0\0\0\0\0\0\0\xc0");
    }

    #[test]
    fn a_later_file_stands_behind_an_earlier_one_whatever_the_clock_says() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("events.out.tfevents.9000000000.offtrack"), b"").unwrap();
        let events = EventsFile::create(folder.path(), 0).unwrap();
        assert_eq!(events.path().file_name().unwrap(), "events.out.tfevents.9000000001.offtrack");
    }
}
