//! `offtrack train --tensorboard`: event files, decoded here from the published formats of TFRecord and Protocol
//! Buffers.

use std::path::PathBuf;

use crate::place::{Place, offtrack, succeed};

/// An event, as far as it is read.
#[derive(Debug, Default)]
struct Event {
    wall_time: f64,
    step: u64,
    file_version: Option<String>,
    /// Status of a session log; 1 is START.
    session: Option<u64>,
    scalars: Vec<(String, f32)>,
}

/// CRC-32C bit by bit, as RFC 3720 defines it.
fn crc32c(bytes: &[u8]) -> u32 {
    !bytes
        .iter()
        .fold(!0, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0x82f6_3b78 * (crc & 1))))
}

/// The four bytes at `at` are the masked checksum of `bytes`.
fn assert_checksum(file: &[u8], at: usize, bytes: &[u8]) {
    let crc = crc32c(bytes);
    let masked = crc.rotate_right(15).wrapping_add(0xa282_ead8);
    assert_eq!(u32::from_le_bytes(file[at..at + 4].try_into().unwrap()), masked);
}

fn varint(bytes: &mut &[u8]) -> u64 {
    let n = bytes.iter().position(|byte| byte & 0x80 == 0).unwrap() + 1;
    let value = bytes[..n].iter().rev().fold(0, |value, byte| value << 7 | u64::from(byte & 0x7f));
    *bytes = &bytes[n..];
    value
}

/// Number and value of each field of a message: a number, or bytes.
fn fields(mut bytes: &[u8]) -> Vec<(u64, u64, Vec<u8>)> {
    let mut fields = Vec::new();
    while !bytes.is_empty() {
        let key = varint(&mut bytes);
        let (number, n) = match key & 7 {
            0 => (varint(&mut bytes), 0),
            1 => (0, 8),
            2 => (0, varint(&mut bytes) as usize),
            5 => (0, 4),
            other => panic!("wire type {other}"),
        };
        fields.push((key >> 3, number, bytes[..n].to_vec()));
        bytes = &bytes[n..];
    }
    fields
}

fn event(bytes: &[u8]) -> Event {
    let mut event = Event::default();
    for (field, number, bytes) in fields(bytes) {
        match field {
            1 => event.wall_time = f64::from_le_bytes(bytes.try_into().unwrap()),
            2 => event.step = number,
            3 => event.file_version = Some(String::from_utf8(bytes).unwrap()),
            5 => event.scalars.extend(fields(&bytes).into_iter().map(|(field, _, value)| {
                assert_eq!(field, 1);
                let value = fields(&value);
                assert_eq!(value.iter().map(|(field, ..)| *field).collect::<Vec<_>>(), [1, 2]);
                (
                    String::from_utf8(value[0].2.clone()).unwrap(),
                    f32::from_le_bytes(value[1].2.clone().try_into().unwrap()),
                )
            })),
            7 => event.session = Some(fields(&bytes)[0].1),
            other => panic!("field {other}"),
        }
    }
    event
}

/// The records of an event file.
fn events(file: &PathBuf) -> Vec<Event> {
    let file = std::fs::read(file).unwrap();
    let (mut events, mut at) = (Vec::new(), 0);
    while at < file.len() {
        let length = &file[at..at + 8];
        assert_checksum(&file, at + 8, length);
        let n = u64::from_le_bytes(length.try_into().unwrap()) as usize;
        let bytes = &file[at + 12..at + 12 + n];
        assert_checksum(&file, at + 12 + n, bytes);
        events.push(event(bytes));
        at += 16 + n;
    }
    events
}

/// The run's event files in the order of their names.
fn event_files(place: &Place) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(place.file("runs/run")).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> =
        entries.filter(|path| path.to_str().unwrap().contains("events.out.tfevents.")).collect();
    files.sort();
    files
}

/// Each row of the metrics as step and scalars.
fn rows(place: &Place) -> Vec<(u64, Vec<(String, f32)>)> {
    let text = std::fs::read_to_string(place.file("runs/run/metrics.csv")).unwrap();
    let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let cells = |row: &str| row.split(',').map(str::to_owned).zip(head.clone()).collect::<Vec<_>>();
    let row = |row: &str| {
        let (steps, others): (Vec<_>, Vec<_>) = cells(row).into_iter().partition(|(_, name)| *name == "env_steps");
        let scalars = others.into_iter().filter(|(value, _)| !value.is_empty());
        (steps[0].0.parse().unwrap(), scalars.map(|(value, name)| (name.to_owned(), value.parse().unwrap())).collect())
    };
    text.lines().skip(1).map(row).collect()
}

#[test]
fn an_event_file_has_the_rows_of_the_metrics_and_one_of_a_resumed_run_begins_where_they_were_cut() {
    let place = Place::new();
    succeed(&place.train(&["--name", "run", "--tensorboard", "--steps", "1600"]));
    let files = event_files(&place);
    assert_eq!(files.len(), 1);
    let first = events(&files[0]);
    assert_eq!(first[0].file_version.as_deref(), Some("brain.Event:2"));
    assert_eq!((first[1].session, first[1].step), (Some(1), 1));
    let shown = |events: &[Event]| events.iter().map(|event| (event.step, event.scalars.clone())).collect::<Vec<_>>();
    assert_eq!(shown(&first[2..]), rows(&place));
    assert!(first[2..].iter().all(|event| first[0].wall_time <= event.wall_time && 1.7e9 < event.wall_time));
    assert!(first[2].scalars.iter().any(|(name, _)| name == "critic_loss"));
    let resumed = offtrack(&["train", "--resume", &place.text("runs/run"), "--steps", "2400", "--tensorboard"]);
    succeed(&resumed);
    let files = event_files(&place);
    assert_eq!(files.len(), 2);
    // What the earlier file has from the beginning of this one on no longer counts.
    let second = events(&files[1]);
    assert_eq!(second[1].session, Some(1));
    let mut kept = shown(&first[2..]);
    kept.retain(|(step, _)| *step < second[1].step);
    assert!(!kept.is_empty());
    assert_eq!([kept, shown(&second[2..])].concat(), rows(&place));
}
