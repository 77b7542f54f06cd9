//! What the readers of a kind of file make of every documented key, as seen from outside.

use std::collections::BTreeSet;
use std::fmt::Debug;
use std::fs;
use std::path::Path;

use offtrack::files::reader::Error;
use toml::Value;

use super::places::{Step, at, next, parts, places, tables, with, without, written};
use super::rows::{Ends, Row, ends};

/// Reads a file of some kind; what is in it can be compared as text.
pub type Read = fn(&Path) -> Result<Box<dyn Debug>, Error>;

/// A kind of file, and valid documents that have all of its keys between them.
pub struct Kind {
    pub documents: Vec<Value>,
    pub read: Read,
}

/// What was compared, and where README and readers differ.
#[derive(Debug, Default)]
pub struct Found {
    pub faults: BTreeSet<String>,
    pub ends: usize,
    pub counts: usize,
    pub defaults: usize,
    pub required: usize,
    pub words: usize,
    pub tables: usize,
}

const UNKNOWN: &str = "no_such_key";

/// Compares every row with what the readers do, and every key that they take with the rows.
pub fn compared(kind: &Kind, rows: &[Row]) -> Found {
    let folder = tempfile::tempdir().unwrap();
    let mut check = Check { kind, file: folder.path().join("file.toml"), found: Found::default() };
    for document in &kind.documents {
        check.read(document).unwrap_or_else(|error| panic!("a document of the test: {error}"));
        check.keys_taken(document, rows);
    }
    for row in rows {
        let parts = parts(&row.key);
        let mut found = kind.documents.iter().map(|document| (document, places(document, &parts)));
        let Some((document, places)) = found.find(|(_, places)| !places.is_empty()) else {
            check.fault(
                row,
                "is in no document of this test: add it to one or, if no reader takes it, take its row out",
            );
            continue;
        };
        for place in places {
            check.presence(document, &place, row);
            check.words(document, &place, row);
            check.range(document, &place, row);
        }
    }
    check.found
}

struct Check<'a> {
    kind: &'a Kind,
    file: std::path::PathBuf,
    found: Found,
}

impl Check<'_> {
    fn read(&self, document: &Value) -> Result<Box<dyn Debug>, Error> {
        // A new file: ext4 waits for the disk where a file is written over.
        let _ = fs::remove_file(&self.file);
        fs::write(&self.file, toml::to_string(document).unwrap()).unwrap();
        (self.kind.read)(&self.file)
    }

    fn fault(&mut self, row: &Row, what: impl std::fmt::Display) {
        self.found.faults.insert(format!("`{}` {what}", row.key));
    }

    /// A key that the reader takes in a table of the document has a row.
    fn keys_taken(&mut self, document: &Value, rows: &[Row]) {
        for table in tables(document) {
            let key = [&table[..], &[Step::Key(UNKNOWN.to_owned())]].concat();
            let message = self.read(&with(document, &key, Value::Integer(1))).map(drop).unwrap_err().to_string();
            // A table whose keys are names takes any.
            let Some((_, listed)) = message.split_once(&format!("unknown field `{UNKNOWN}`, expected ")) else {
                continue;
            };
            let documented: BTreeSet<&str> =
                rows.iter().filter_map(|row| next(&super::places::parts(&row.key), &table)).collect();
            for name in quoted(listed).filter(|name| !documented.contains(name)) {
                let key = written(&[&table[..], &[Step::Key(name.to_owned())]].concat()).replace("[0]", "[]");
                let row = format!("| `{key}` | unit | range | default | meaning |");
                self.found.faults.insert(format!("`{key}` is taken and has no row: add {row}"));
            }
            self.found.tables += 1;
        }
    }

    /// A key without a default is needed, and one with a default may be left out, which is the same as writing it.
    fn presence(&mut self, document: &Value, place: &[Step], row: &Row) {
        let left_out = self.read(&without(document, place));
        let name = parts(&row.key).pop().unwrap_or_default().to_owned();
        if row.is_required() {
            match left_out {
                Err(error) if error.to_string().contains(&name) => self.found.required += 1,
                other => self
                    .fault(row, format_args!("may be left out, so its row needs a default: {:?}", other.map(|_| ()))),
            }
        } else if let Some(default) = literal(row) {
            let given = self.read(&with(document, place, default));
            match (left_out, given) {
                (Ok(left_out), Ok(given)) if format!("{left_out:?}") == format!("{given:?}") => {
                    self.found.defaults += 1
                }
                (Err(error), _) | (_, Err(error)) => {
                    self.fault(row, format_args!("has no default {}: {error}", row.default))
                }
                _ => self.fault(row, format_args!("left out is not the same as with its default, {}", row.default)),
            }
        } else if let Err(error @ Error::Malformed { .. }) = left_out {
            self.fault(row, format_args!("is required, so its row has no default: {error}"));
        }
    }

    /// Where the row lists words, a value may be these and no other.
    fn words(&mut self, document: &Value, place: &[Step], row: &Row) {
        let listed: BTreeSet<&str> = row.words().into_iter().collect();
        if listed.is_empty() || !at(document, place).is_str() {
            return;
        }
        let message =
            self.read(&with(document, place, Value::String(UNKNOWN.to_owned()))).map(drop).unwrap_err().to_string();
        let taken = message.split_once(", expected ").map(|(_, words)| quoted(words).collect::<BTreeSet<&str>>());
        if taken.as_ref() != Some(&listed) {
            self.fault(row, format_args!("has the words {listed:?} in its row: {message}"));
        }
        self.found.words += 1;
    }

    /// Both ends of the range are taken, and what lies beyond is refused with that range.
    fn range(&mut self, document: &Value, place: &[Step], row: &Row) {
        let below = |step: Step| [place, &[step]].concat();
        let is_number = |value: &Value| value.is_integer() || value.is_float();
        if let Some(list) = at(document, place).as_array().filter(|list| !list.is_empty()) {
            let is_of_numbers = list.iter().all(is_number);
            if let Some(counts) = if is_of_numbers { row.count() } else { row.ends } {
                self.counts(document, place, row, counts);
            }
            if let Some(ends) = row.ends.filter(|_| is_of_numbers) {
                // The first is the least one of `[least, greatest]`.
                self.ends(
                    document,
                    [&below(Step::Element(0)), &below(Step::Element(list.len() - 1))],
                    place,
                    row,
                    ends,
                );
            }
        } else if let Some(ends) = row.ends {
            match at(document, place) {
                Value::Table(table) => {
                    let leaf = below(Step::Key(table.keys().next().unwrap().clone()));
                    self.ends(document, [&leaf, &leaf], place, row, ends);
                }
                value if is_number(value) => self.ends(document, [place, place], place, row, ends),
                // The length of a text.
                _ => {}
            }
        }
    }

    fn ends(&mut self, document: &Value, leaves: [&[Step]; 2], place: &[Step], row: &Row, ends: Ends) {
        for (side, leaf) in leaves.into_iter().enumerate() {
            let Some(end) = ends[side] else { continue };
            let beyond = if side == 0 { -1.0 } else { 1.0 };
            let (at_end, outside) = match at(document, leaf) {
                Value::Integer(_) => (Value::Integer(end as i64), Value::Integer((end + beyond) as i64)),
                _ => (Value::Float(end), Value::Float(end + beyond * 1e-6 * end.abs().max(1.0))),
            };
            self.compare(&with(document, leaf, outside), &with(document, leaf, at_end), place, row, ends);
            self.found.ends += 1;
        }
    }

    fn counts(&mut self, document: &Value, place: &[Step], row: &Row, ends: Ends) {
        let [Some(least), Some(most)] = ends.map(|end| end.map(|end| end as usize)) else { return };
        let first = &at(document, place)[0];
        let list = |n: usize| with(document, place, Value::Array(vec![first.clone(); n]));
        self.compare(&list(most + 1), &list(most), place, row, ends);
        // An empty list may be the default.
        if row.is_required() || 1 < least {
            self.compare(&list(least - 1), &list(least), place, row, ends);
        }
        self.found.counts += 1;
    }

    /// `outside` is refused with the row's range, and `at_end` not for its range.
    fn compare(&mut self, outside: &Value, at_end: &Value, place: &[Step], row: &Row, ends: Ends) {
        match self.read(outside).map(drop).map_err(|error| stated(&error, place).ok_or(error)) {
            Err(Ok((range, unit))) => {
                if (0..2).any(|side| ends[side].is_some() && ends[side] != range[side]) {
                    self.fault(
                        row,
                        format_args!("has the range {} in its row, and {range:?} in the reader", row.range),
                    );
                }
                if !unit.is_empty() && unit != row.unit {
                    self.fault(row, format_args!("has the unit {} in its row, and {unit} in the reader", row.unit));
                }
            }
            other => self.fault(row, format_args!("is not refused outside of {}: {other:?}", row.range)),
        }
        if let Some((range, _)) = self.read(at_end).err().and_then(|error| stated(&error, place)) {
            self.fault(row, format_args!("is refused at an end of {}: {range:?}", row.range));
        }
    }
}

/// The range and the unit that an error states for the key at a place.
fn stated(error: &Error, place: &[Step]) -> Option<(Ends, String)> {
    let place = written(place);
    match error {
        Error::Invalid { key, expected, .. } => {
            key.strip_prefix(&place).filter(|rest| rest.is_empty() || rest.starts_with(['[', '.']))?;
            let only = expected.strip_prefix("must be ").filter(|only| only.parse::<f64>().is_ok());
            let range = match only {
                Some(only) => format!("{only}..{only}"),
                None => expected.strip_prefix("must lie in ")?.to_owned(),
            };
            Some((ends(&range)?, range.split_once(' ').map(|(_, unit)| unit.to_owned()).unwrap_or_default()))
        }
        Error::Malformed { message, .. } if message.contains("expected a whole number in 0..4294967295") => {
            message.contains(place.rsplit('.').next()?).then_some(([Some(0.0), Some(u32::MAX.into())], String::new()))
        }
        _ => None,
    }
}

/// The default where the row states a value.
fn literal(row: &Row) -> Option<Value> {
    let word = row.default.trim_matches('`');
    let parsed = format!("default = {word}").parse::<toml::Table>().ok().and_then(|mut table| table.remove("default"));
    parsed.or_else(|| row.words().contains(&word).then(|| Value::String(word.to_owned())))
}

/// What a list of the parser has between backticks.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split("; the line is").next().unwrap_or_default().split('`').skip(1).step_by(2)
}
