//! Keys of a training file set from the command line: `--benchmark mine.toml`, `--set learning.n_steps=5`.

use toml::{Table, Value};

use crate::config::Config;
use crate::error::Error;

/// What a training file says of other benchmarks: no key of it holds for another one.
const OF_OTHERS: [&str; 4] = ["training_benchmark", "reward", "also_evaluate", "validation.benchmark"];

/// Sets `benchmark` and takes out what the file says of others, so that this one is trained on, validated on and
/// evaluated.
pub(super) fn set_benchmark(table: &mut Table, benchmark: &str) {
    table.insert("benchmark".to_owned(), Value::String(benchmark.to_owned()));
    for key in OF_OTHERS {
        remove(table, key);
    }
}

/// Sets what each of `settings` says, `KEY=VALUE`, in the file's `table`; nothing after the `=` takes the key out.
pub(super) fn set(table: &mut Table, settings: &[String]) -> Result<(), Error> {
    settings.iter().try_for_each(|setting| one(table, setting))
}

fn one(table: &mut Table, setting: &str) -> Result<(), Error> {
    let wrong = |expected: String| Error::setting("--set", setting, expected);
    let (key, value) =
        setting.split_once('=').ok_or_else(|| wrong("KEY=VALUE is needed, as in learning.n_steps=5".into()))?;
    let path: Vec<&str> = key.trim().split('.').collect();
    let [tables @ .., last] = path.as_slice() else { return Err(wrong("a key is needed before the `=`".into())) };
    if let [key @ ("base" | "without"), ..] = path.as_slice() {
        return Err(wrong(format!("{key} stands in a training file alone: write one with it, and give that file")));
    }
    if path.iter().any(|part| part.is_empty()) {
        return Err(wrong("a key is needed before the `=`, its parts joined by single points".into()));
    }
    if value.trim().is_empty() {
        return if remove(table, key.trim()) { Ok(()) } else { check_known(&path).map_err(wrong) };
    }
    let mut table = table;
    for part in tables {
        let inner = table.entry(*part).or_insert_with(|| Value::Table(Table::new()));
        table = inner.as_table_mut().ok_or_else(|| wrong(format!("{part} is a value and has no keys below it")))?;
    }
    table.insert((*last).to_owned(), parsed(value.trim()));
    Ok(())
}

/// What is wrong with a key that no training file has: one alone is read as a file, which stops at it.
fn check_known(path: &[&str]) -> Result<(), String> {
    let mut value = Value::Boolean(true);
    for part in path.iter().rev() {
        value = Value::Table(Table::from_iter([((*part).to_owned(), value)]));
    }
    match value.try_into::<Config>() {
        Err(error) if error.message().starts_with("unknown field") => {
            Err(format!("{}; no training file has it", error.message()))
        }
        Err(error) if error.message().starts_with("invalid type: map") => {
            Err("has no keys below it; no training file has it".to_owned())
        }
        _ => Ok(()),
    }
}

/// Takes a key out, `replay_buffer.priority`; false where there is none.
pub(super) fn remove(table: &mut Table, key: &str) -> bool {
    match key.split_once('.') {
        None => table.remove(key).is_some(),
        Some((part, rest)) => {
            table.get_mut(part).and_then(Value::as_table_mut).is_some_and(|inner| remove(inner, rest))
        }
    }
}

/// A TOML value; what is none is a word.
fn parsed(value: &str) -> Value {
    let read = toml::from_str::<Table>(&format!("value = {value}")).ok();
    // Lines after the first could set other keys.
    let alone = read.filter(|table| table.len() == 1).and_then(|mut table| table.remove("value"));
    alone.unwrap_or_else(|| Value::String(value.to_owned()))
}
