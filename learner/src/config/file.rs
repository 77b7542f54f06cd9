//! Training files by path or name, with their `base` merged in.

use std::path::{Path, PathBuf};

use offtrack::files::reader::{self, Reader, TEXT_LIMIT, read_text, said};
use toml::{Table, Value};

use super::set;
use crate::error::Error;
use offtrack_evaluation::error::Error as Evaluation;

/// The training files that come with the program.
const SHIPPED: [(&str, &str); 14] = [
    ("default", include_str!("../../configs/default.toml")),
    ("best", include_str!("../../configs/best.toml")),
    ("lane", include_str!("../../configs/lane.toml")),
    ("attard", include_str!("../../configs/attard.toml")),
    ("gpu", include_str!("../../configs/gpu.toml")),
    ("as-run", include_str!("../../configs/as-run.toml")),
    ("laden", include_str!("../../configs/laden.toml")),
    ("laden-50", include_str!("../../configs/laden-50.toml")),
    ("transfer", include_str!("../../configs/transfer.toml")),
    ("transfer-refined", include_str!("../../configs/transfer-refined.toml")),
    ("traffic", include_str!("../../configs/traffic.toml")),
    ("traffic-refined", include_str!("../../configs/traffic-refined.toml")),
    ("laden-gpu", include_str!("../../configs/laden-gpu.toml")),
    ("paper", include_str!("../../configs/paper.toml")),
];
/// Bases of bases: more than anyone needs, fewer than a circle.
const DEPTH: usize = 8;

/// A training file's keys, its own over those of its base.
pub(super) fn resolved(file: &Path) -> Result<Table, Error> {
    with_bases(file, 0)
}

fn with_bases(file: &Path, depth: usize) -> Result<Table, Error> {
    let mut table = table(file)?;
    let invalid = |value: String, expected: String| Reader::of(file).invalid("base", value, expected);
    let base = match table.remove("base") {
        None if table.contains_key("without") => {
            let expected = "stands beside `base` alone: without a base there is nothing to take out";
            return Err(Reader::of(file).invalid("without", "given", expected).into());
        }
        None => return Ok(table),
        Some(Value::String(base)) if depth < DEPTH => base,
        Some(Value::String(base)) => {
            let expected = format!("at most {DEPTH} files may follow each other: one of them is its own base");
            return Err(invalid(format!("{base:?}"), expected).into());
        }
        Some(other) => {
            return Err(invalid(other.to_string(), "must be the name or the path of a training file".to_owned()).into());
        }
    };
    // A copy of a shipped file names its base as that one does, and has none beside it.
    let name = Path::new(base.strip_suffix(".toml").unwrap_or(&base));
    let path = match shipped(file).is_some() || shipped(name).is_some() && !beside(file, &base).is_file() {
        true => name.to_owned(),
        false => beside(file, &base),
    };
    let mut merged = with_bases(&path, depth + 1).map_err(|error| match &error {
        Error::Evaluation(Evaluation::Input(reader::Error::Unreadable { file: missing, .. })) if *missing == path => {
            let known = SHIPPED.map(|(name, _)| name).join(", ");
            let expected = format!("{error}; must be a path ending in .toml, relative to this file, or one of {known}");
            invalid(format!("{base:?}"), expected).into()
        }
        _ => error,
    })?;
    for key in without(file, &mut table)? {
        let removed = set::remove(&mut merged, &key);
        if !removed {
            let expected = format!("{} has no such key: leave it out", path.display());
            return Err(Reader::of(file).invalid("without", format!("{key:?}"), expected).into());
        }
    }
    merge(&mut merged, table);
    Ok(merged)
}

/// The keys of its base that a training file does without.
fn without(file: &Path, table: &mut Table) -> Result<Vec<String>, Error> {
    let read = |value: Value| value.try_into::<Vec<String>>();
    let keys = table.remove("without").map(read).transpose();
    let expected = "must be a list of keys of the base, as in [\"validation\", \"replay_buffer.priority\"]";
    keys.map(Option::unwrap_or_default)
        .map_err(|error| Reader::of(file).invalid("without", said(&error), expected).into())
}

fn beside(file: &Path, base: &str) -> PathBuf {
    file.parent().unwrap_or(Path::new("")).join(base)
}

/// The text of a training file that comes with the program, by its name.
fn shipped(name: &Path) -> Option<&'static str> {
    let name = name.to_str()?;
    SHIPPED.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

fn table(file: &Path) -> Result<Table, Error> {
    let text = match shipped(file) {
        Some(text) => text.to_owned(),
        None if is_name(file) => {
            let known: Vec<&str> = SHIPPED.iter().map(|(name, _)| *name).collect();
            let expected = format!(
                "is no training file: the program comes with {}; or give a path ending in .toml",
                known.join(", ")
            );
            return Err(Error::contents(file, expected));
        }
        None => read_text(file, TEXT_LIMIT)?,
    };
    Ok(Reader::parse(file, &text)?.1)
}

/// A word that could be a name: no path, and no such file here.
fn is_name(file: &Path) -> bool {
    file.components().count() == 1 && file.extension().is_none() && !file.exists()
}

/// Puts `over`'s keys into `under`, tables key by key.
fn merge(under: &mut Table, over: Table) {
    for (key, value) in over {
        match (under.get_mut(&key), value) {
            (Some(Value::Table(under)), Value::Table(over)) => merge(under, over),
            (_, value) => drop(under.insert(key, value)),
        }
    }
}
