//! Files that commands read and write: benchmarks by name, results written whole or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use offtrack::reader::printable;
use serde::Serialize;

use crate::error::Error;

/// The repository that the program was built from.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new(".")).to_owned()
}

/// Prints a command's result: lines, in which names of files may stand. A closed standard output is an error, never a
/// panic.
pub fn print(text: &str) -> Result<(), Error> {
    std::io::stdout().write_all(harmless(text).as_bytes()).map_err(Error::write(Path::new("standard output")))
}

/// Prints JSON, which other programs may read: characters that a terminal obeys are escaped as JSON has it.
pub fn print_json(text: &str) -> Result<(), Error> {
    let mut shown = String::with_capacity(text.len() + 1);
    for c in text.chars() {
        if c == '\n' || printable(c.encode_utf8(&mut [0; 4])).chars().eq([c]) {
            shown.push(c);
        } else {
            shown.extend(c.encode_utf16(&mut [0; 2]).iter().map(|unit| format!("\\u{unit:04x}")));
        }
    }
    print(&(shown + "\n"))
}

/// Says one line on standard error, after the program's name. Nobody may be reading it: then the work goes on.
pub fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "offtrack: {}", printable(line));
}

/// `text` with its line ends, and without other characters that a terminal obeys.
pub fn harmless(text: &str) -> String {
    text.split('\n').map(printable).collect::<Vec<_>>().join("\n")
}

/// Writes `value` to `file` as indented JSON, whole or not at all.
pub fn write_json(file: &Path, value: &impl Serialize) -> Result<(), Error> {
    let mut text = serde_json::to_string_pretty(value).map_err(|error| Error::write(file)(error.into()))?;
    text.push('\n');
    write_whole(file, text.as_bytes())
}

/// Writes `bytes` to a temporary file beside `file` and renames it, so that `file` is never half written: not after a
/// crash, and not on a full disk. Temporary files that killed programs left in the folder are removed.
pub fn write_whole(file: &Path, bytes: &[u8]) -> Result<(), Error> {
    let folder = match file.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    remove_stale(folder);
    let mut temporary = temporary_in(folder).map_err(Error::write(file))?;
    let _listed = Listed::new(temporary.path());
    temporary.write_all(bytes).map_err(Error::write(file))?;
    temporary.as_file().sync_all().map_err(Error::write(file))?;
    temporary.persist(file).map_err(|error| Error::write(file)(error.error))?;
    Ok(())
}

/// Begin and end of a temporary file's name. The process that writes it stands between: `.offtrack-123-Xy9z2w.tmp`.
const TEMPORARY: (&str, &str) = (".offtrack-", ".tmp");
/// A temporary file that was not written to for this long is stale if its process does not exist here: a
/// folder may be shared with other machines and containers, whose processes cannot be seen.
const STALE: Duration = Duration::from_secs(60);

/// A temporary file that, once renamed, has the permissions of any new file.
fn temporary_in(folder: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let prefix = format!("{}{}-", TEMPORARY.0, std::process::id());
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(TEMPORARY.1);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Removes temporary files of processes that no longer run from `folder`. One that cannot be removed stays.
pub fn remove_stale(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let untouched = entry.metadata().and_then(|metadata| metadata.modified()).ok().and_then(|time| time.elapsed().ok());
        if entry.file_name().to_str().and_then(writer).is_some_and(|id| !runs(id)) && untouched.is_some_and(|age| STALE < age) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// The process that a temporary file's name states.
fn writer(name: &str) -> Option<u32> {
    name.strip_prefix(TEMPORARY.0)?.strip_suffix(TEMPORARY.1)?.split_once('-')?.0.parse().ok()
}

/// Whether this process may still run. Where there is no `/proc`, every process may.
fn runs(id: u32) -> bool {
    let processes = Path::new("/proc");
    !processes.join("self").exists() || processes.join(id.to_string()).exists()
}

/// Temporary files being written by this process.
static WRITING: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Keeps a temporary file on the list while it is being written.
struct Listed(PathBuf);

impl Listed {
    fn new(file: &Path) -> Listed {
        WRITING.lock().unwrap_or_else(PoisonError::into_inner).push(file.to_owned());
        Listed(file.to_owned())
    }
}

impl Drop for Listed {
    fn drop(&mut self) {
        WRITING.lock().unwrap_or_else(PoisonError::into_inner).retain(|file| *file != self.0);
    }
}

/// Removes the temporary files that this process is writing. For a process about to end at once: whatever is being
/// written is given up.
pub fn remove_temporaries() {
    for file in WRITING.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
        let _ = std::fs::remove_file(file);
    }
}

#[cfg(test)]
mod tests {
    use std::time::SystemTime;

    use super::*;

    #[test]
    fn temporary_files_of_killed_programs_are_removed_and_those_of_running_ones_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str, age: u64| {
            let path = folder.path().join(name);
            let file = std::fs::File::create(&path).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(age)).unwrap();
            path
        };
        // Above the largest process id of Linux, 2^22.
        let dead = place(".offtrack-4194999-abcdef.tmp", 90);
        let kept = [
            place(".offtrack-4194999-ghijkl.tmp", 5),
            place(&format!(".offtrack-{}-abcdef.tmp", std::process::id()), 90),
            place(".offtrack-x-abcdef.tmp", 90),
            place("offtrack-4194999-abcdef.tmp", 90),
        ];
        let target = folder.path().join("report.json");
        write_whole(&target, b"{}").unwrap();
        assert!(!dead.exists());
        assert!(kept.iter().all(|file| file.exists()));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), kept.len() + 1, "and nothing else is left");
    }

    #[test]
    fn temporary_files_being_written_are_removed_before_the_process_ends() {
        let folder = tempfile::tempdir().unwrap();
        let temporary = temporary_in(folder.path()).unwrap();
        let _listed = Listed::new(temporary.path());
        assert!(writer(temporary.path().file_name().unwrap().to_str().unwrap()) == Some(std::process::id()));
        remove_temporaries();
        assert!(!temporary.path().exists());
    }

    #[test]
    fn of_characters_that_a_terminal_obeys_only_line_ends_are_printed() {
        assert_eq!(harmless("a\n\u{1b}[2Jb\r\n\u{202e}c\n"), "a\n\\u{1b}[2Jb\\r\n\\u{202e}c\n");
        assert_eq!(harmless("Köln  µm²\n"), "Köln  µm²\n");
    }
}
