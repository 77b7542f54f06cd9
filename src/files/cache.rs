//! How work on many roads is done: what is kept of it for the next time, who is told how far it is, and who may stop
//! it.
//!
//! A [`Cache`] keeps results by their content: an entry holds the whole input that it was computed from, so a stale or
//! a damaged one is never used. Without a cache everything is computed anew, with the same result.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

use crate::files::reader::shown_path;
use crate::files::writer::Output;

/// How far work is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// What is being done, `drawing roads` or `baking`.
    pub what: &'static str,
    /// Roads that are done.
    pub done: usize,
    /// Roads in all.
    pub total: usize,
}

/// Threads for work on all cores: one a core, or as many as `RAYON_NUM_THREADS` asks for, up to four a core or, where
/// that is more, 16. More would be no faster, and their stacks alone may not fit into the address space.
pub fn n_threads() -> usize {
    let n_cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
    let asked = std::env::var("RAYON_NUM_THREADS")
        .ok()
        .and_then(|number| number.parse().ok())
        .filter(|&number: &usize| 0 < number);
    asked.map_or(n_cores, |asked| asked.min((4 * n_cores).max(16)))
}

/// Who is told of progress, from any thread.
pub type Watcher<'a> = dyn Fn(Progress) + Sync + 'a;

/// What [`crate::scenario::Scenario::load`] and [`crate::world::World::bake_with`] need beside their input.
#[derive(Clone, Copy)]
pub struct Loading<'a> {
    /// Where results are kept, if anywhere.
    pub cache: Option<&'a Cache>,
    /// Who is told of progress.
    pub watcher: &'a Watcher<'a>,
    /// Set by the caller to stop the work at its next road: it then ends with [`Stopped`].
    pub stop: &'a AtomicBool,
}

/// The caller stopped the work on many roads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped before all roads were done")]
pub struct Stopped;

impl From<Stopped> for crate::files::reader::Error {
    fn from(_: Stopped) -> crate::files::reader::Error {
        crate::files::reader::Error::Stopped
    }
}

/// Nobody sets it.
static NEVER: AtomicBool = AtomicBool::new(false);

impl Loading<'_> {
    /// Nothing is kept, nobody is told, and nobody stops the work.
    pub const PLAIN: Loading<'static> = Loading { cache: None, watcher: &|_| {}, stop: &NEVER };

    /// An error once the caller has stopped the work.
    pub(crate) fn check(&self) -> Result<(), Stopped> {
        if self.stop.load(Ordering::Relaxed) { Err(Stopped) } else { Ok(()) }
    }

    /// Counts a road of `total` as done and tells the watcher, one thread after the other, so that it hears no number
    /// after a higher one.
    pub(crate) fn count(&self, what: &'static str, done: &Mutex<usize>, total: usize) {
        let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
        *done += 1;
        (self.watcher)(Progress { what, done: *done, total });
    }
}

/// A folder of results.
#[derive(Debug)]
pub struct Cache {
    folder: PathBuf,
    /// Whether something was kept since the folder was last pruned.
    has_grown: AtomicBool,
    failure: Mutex<Option<io::Error>>,
}

/// First bytes of an entry: its kind and the version of its form.
const MAGIC: &[u8; 16] = b"offtrack cache 1";
/// Size up to which [`Cache::prune`] lets a folder grow (bytes).
const LIMIT: u64 = 4 << 30;

impl Cache {
    /// A cache in `folder`, which is made when something is kept.
    pub fn new(folder: &Path) -> Cache {
        Cache { folder: folder.to_owned(), has_grown: AtomicBool::new(false), failure: Mutex::new(None) }
    }

    /// The user's cache: `$OFFTRACK_CACHE`, else `offtrack` in `$XDG_CACHE_HOME` or in `~/.cache`. `None` where no such
    /// folder is known or `$OFFTRACK_CACHE` is empty.
    pub fn of_user() -> Option<Cache> {
        let folder = match std::env::var_os("OFFTRACK_CACHE") {
            Some(folder) if folder.is_empty() => return None,
            Some(folder) => PathBuf::from(folder),
            None => match std::env::var_os("XDG_CACHE_HOME").filter(|folder| !folder.is_empty()) {
                Some(folder) => PathBuf::from(folder).join("offtrack"),
                None => std::env::home_dir()?.join(".cache/offtrack"),
            },
        };
        Some(Cache::new(&folder))
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What was kept of this `kind` for the input `key`. `None` too where the entry is damaged or cannot be read.
    pub(crate) fn get(&self, kind: &str, key: &[u8]) -> Option<Vec<u8>> {
        let mut bytes = fs::read(self.file(kind, key)).ok()?;
        let (content, checksum) = bytes.split_at_checked(bytes.len().checked_sub(8)?)?;
        if checksum != fnv_1a(content).to_le_bytes() {
            return None;
        }
        let payload =
            content.strip_prefix(MAGIC)?.strip_prefix(&(key.len() as u64).to_le_bytes())?.strip_prefix(key)?.len();
        let end = bytes.len() - 8;
        bytes.truncate(end);
        Some(bytes.split_off(end - payload))
    }

    /// Keeps `payload` for the input `key`: whole or not at all. Where that fails the work is done again the next time;
    /// [`Cache::failure`] says why.
    pub(crate) fn put(&self, kind: &str, key: &[u8], payload: &[u8]) {
        if let Err(error) = self.try_put(kind, key, payload)
            && let Ok(mut failure) = self.failure.lock()
        {
            failure.get_or_insert(error);
        }
    }

    fn try_put(&self, kind: &str, key: &[u8], payload: &[u8]) -> io::Result<()> {
        self.has_grown.store(true, Ordering::Relaxed);
        fs::create_dir_all(&self.folder)?;
        let mut content = [MAGIC, &(key.len() as u64).to_le_bytes()[..], key, payload].concat();
        content.extend(fnv_1a(&content).to_le_bytes());
        let mut output = Output::create(&self.file(kind, key))?;
        output.write_all(&content)?;
        // A crash of the system may damage it; then it is not used.
        output.finish_unsynced()
    }

    /// Why something could not be kept: the folder and the first reason.
    pub fn failure(&self) -> Option<String> {
        let failure = self.failure.lock().ok()?;
        failure.as_ref().map(|error| format!("{}: cannot keep results: {error}", shown_path(&self.folder)))
    }

    /// Removes the entries that were written longest ago until the folder has at most 4 GiB. Does nothing where nothing
    /// was kept since the last time.
    pub fn prune(&self) {
        if self.has_grown.swap(false, Ordering::Relaxed) {
            self.prune_to(LIMIT);
        }
    }

    fn prune_to(&self, limit: u64) {
        let Ok(entries) = fs::read_dir(&self.folder) else { return };
        let known = |entry: &fs::DirEntry| entry.path().extension().is_some_and(|extension| extension == "cache");
        let mut files: Vec<(SystemTime, u64, PathBuf)> = entries
            .flatten()
            .filter(known)
            .filter_map(|entry| {
                let facts = entry.metadata().ok()?;
                Some((facts.modified().ok()?, facts.len(), entry.path()))
            })
            .collect();
        files.sort();
        let mut total: u64 = files.iter().map(|(_, size, _)| size).sum();
        for (_, size, file) in files {
            if total <= limit {
                break;
            }
            if fs::remove_file(file).is_ok() {
                total -= size;
            }
        }
    }

    fn file(&self, kind: &str, key: &[u8]) -> PathBuf {
        self.folder.join(format!("{kind}-{:016x}.cache", fnv_1a(key)))
    }
}

/// 64-bit FNV-1a.
pub(crate) fn fnv_1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_kept_comes_back_for_its_own_input_alone() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(&folder.path().join("made"));
        assert_eq!(cache.get("field", b"input"), None);
        cache.put("field", b"input", b"result");
        assert_eq!(cache.get("field", b"input").as_deref(), Some(&b"result"[..]));
        assert_eq!(cache.get("field", b"other"), None);
        assert_eq!(cache.get("roads", b"input"), None);
        assert_eq!(cache.failure(), None);
        // An entry of another input under the same name, as two inputs of equal hash would have it.
        fs::rename(cache.file("field", b"input"), cache.file("field", b"other")).unwrap();
        assert_eq!(cache.get("field", b"other"), None);
    }

    #[test]
    fn a_damaged_entry_is_not_used() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path());
        cache.put("field", b"input", b"result");
        let file = cache.file("field", b"input");
        let whole = fs::read(&file).unwrap();
        for at in 0..whole.len() {
            let mut changed = whole.clone();
            changed[at] ^= 1;
            fs::write(&file, changed).unwrap();
            assert_eq!(cache.get("field", b"input"), None, "byte {at}");
            fs::write(&file, &whole[..at]).unwrap();
            assert_eq!(cache.get("field", b"input"), None, "cut at {at}");
        }
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_reported_and_loses_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("file"), "").unwrap();
        let cache = Cache::new(&folder.path().join("file"));
        cache.put("field", b"input", b"result");
        assert!(cache.failure().unwrap().contains("cannot keep results"));
    }

    #[test]
    fn pruning_removes_the_oldest_entries_and_nothing_of_others() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path());
        fs::write(folder.path().join("notes.txt"), vec![0; 1000]).unwrap();
        for index in 0..4u8 {
            cache.put("field", &[index], &[index; 100]);
            let time = SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(u64::from(index) + 1);
            fs::File::options().write(true).open(cache.file("field", &[index])).unwrap().set_modified(time).unwrap();
        }
        cache.prune_to(300);
        let kept: Vec<bool> = (0..4u8).map(|index| cache.get("field", &[index]).is_some()).collect();
        assert_eq!(kept, [false, false, true, true]);
        assert!(folder.path().join("notes.txt").exists());
    }
}
