//! Files the commands read and write: benchmarks by name, results written whole or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::error::Error;

/// The file of a benchmark: a path as it is, or a name looked up in `scenarios/` here and, failing that, where the program was built.
pub fn benchmark(name: &str) -> Result<PathBuf, Error> {
    let path = PathBuf::from(name);
    if path.extension().is_some_and(|extension| extension == "toml") || path.is_file() {
        return Ok(path);
    }
    let here = Path::new("scenarios").join(name).with_extension("toml");
    let built = repository().join(&here);
    let candidates = [here, built];
    match candidates.iter().find(|candidate| candidate.is_file()) {
        Some(found) => Ok(found.clone()),
        None => Err(Error::Flag {
            flag: "benchmark",
            value: name.to_owned(),
            expected: format!("no file {}; give the name of a file under scenarios/ or a path ending in .toml", candidates[0].display()),
        }),
    }
}

/// The policy that comes with the program for a benchmark of this name: its own or, failing that, the one for `attard2023`, whose vehicle
/// and actions other benchmarks may share.
pub fn shipped_policy(benchmark: &str) -> PathBuf {
    let of = |name: &str| Path::new("training/policies").join(name).join("policy.safetensors");
    let places = |file: PathBuf| [file.clone(), repository().join(file)];
    let candidates = [of(benchmark), of("attard2023")].map(places);
    let found = candidates.iter().flatten().find(|candidate| candidate.is_file());
    // Where none is, the error of reading it names the file that should be there.
    found.unwrap_or(&candidates[1][0]).clone()
}

/// The repository that the program was built from.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new(".")).to_owned()
}

/// Prints a command's result. A reader that has gone is an error, never a panic.
pub fn print(text: &str) -> Result<(), Error> {
    std::io::stdout().write_all(text.as_bytes()).map_err(Error::write(Path::new("standard output")))
}

/// Writes `value` as indented JSON, replacing `file` in one move.
pub fn write_json(file: &Path, value: &impl Serialize) -> Result<(), Error> {
    let mut text = serde_json::to_string_pretty(value).map_err(|error| Error::write(file)(error.into()))?;
    text.push('\n');
    write_whole(file, text.as_bytes())
}

/// Writes `bytes` beside `file` and moves them into its place, so that a reader, a crash or a full disk never meets half a file.
pub fn write_whole(file: &Path, bytes: &[u8]) -> Result<(), Error> {
    let folder = match file.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let mut temporary = temporary_in(folder).map_err(Error::write(file))?;
    temporary.write_all(bytes).map_err(Error::write(file))?;
    temporary.as_file().sync_all().map_err(Error::write(file))?;
    temporary.persist(file).map_err(|error| Error::write(file)(error.error))?;
    Ok(())
}

/// A temporary file that, once moved into place, others may read as they may any new file.
fn temporary_in(folder: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}
