//! A temporary file that takes the place of another once it is whole.
//!
//! Where the system has files without a name, it has none until the last moment, so that a killed program leaves
//! nothing behind. Elsewhere it has one, `.offtrack-123-0.tmp`, and a lock while it is written: one without a lock is
//! removed when something is next written to its folder.

use std::fs::{self, File, Metadata, OpenOptions, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Begin and end of a temporary file's name.
const NAME: (&str, &str) = (".offtrack-", ".tmp");

/// A file that will take the place of another.
#[derive(Debug)]
pub struct Temporary {
    file: File,
    /// None where the file has no name yet.
    name: Option<Name>,
}

impl Temporary {
    /// An empty file in `folder` with the permissions of any new one or, in place of a file of such `access`, no wider
    /// ones than that.
    pub(super) fn create(folder: &Path, access: Option<&Metadata>) -> io::Result<Temporary> {
        remove_stale(folder);
        let options = options(access);
        #[cfg(target_os = "linux")]
        if let Some(file) = unnamed(folder, options.clone()) {
            return Ok(Temporary { file, name: None });
        }
        Temporary::named(folder, options)
    }

    pub(super) fn named(folder: &Path, mut options: OpenOptions) -> io::Result<Temporary> {
        options.create_new(true);
        loop {
            let (name, file) = Name::free(folder, |path| options.open(path))?;
            // Another program may have seen the file before it was locked, and be about to remove it. Some file systems
            // have no locks; there no file is ever removed.
            let is_seen = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
            if !is_seen && name.0.exists() {
                return Ok(Temporary { file, name: Some(name) });
            }
        }
    }

    pub(super) fn file(&self) -> &File {
        &self.file
    }

    /// Moves the file to `target`, in place of what is there.
    pub(super) fn put(self, target: &Path) -> io::Result<()> {
        let name = match self.name {
            Some(name) => name,
            #[cfg(target_os = "linux")]
            None => {
                // Where there is nothing yet, the file needs no other name.
                match link(&self.file, target) {
                    Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                    linked => return linked,
                }
                Name::free(super::folder_of(target), |path| link(&self.file, path))?.0
            }
            #[cfg(not(target_os = "linux"))]
            None => return Err(ErrorKind::Unsupported.into()),
        };
        fs::rename(&name.0, target)
    }
}

/// How a file is opened: for writing, and for reading it back, for nobody whom `access` shuts out.
#[cfg_attr(not(unix), expect(unused_variables, reason = "elsewhere a new file has the permissions of its folder"))]
pub(super) fn options(access: Option<&Metadata>) -> OpenOptions {
    let mut options = OpenOptions::new();
    options.write(true).read(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
        options.mode(access.map_or(0o666, |access| access.mode() & 0o777));
    }
    options
}

/// A file without a name, locked. `None` where the file system has no such files or they could not get a name.
#[cfg(target_os = "linux")]
fn unnamed(folder: &Path, mut options: OpenOptions) -> Option<File> {
    use std::os::unix::fs::OpenOptionsExt;

    let file = options.custom_flags(rustix::fs::OFlags::TMPFILE.bits().cast_signed()).open(folder).ok()?;
    // The file may have a name for a moment, in `put`.
    let _ = file.try_lock();
    fs::metadata(descriptor(&file)).is_ok().then_some(file)
}

/// Gives a file a name, which must be free.
#[cfg(target_os = "linux")]
fn link(file: &File, path: &Path) -> io::Result<()> {
    use rustix::fs::{AtFlags, CWD, linkat};
    Ok(linkat(CWD, descriptor(file), CWD, path, AtFlags::SYMLINK_FOLLOW)?)
}

/// An open file's path among those of this process.
#[cfg(target_os = "linux")]
fn descriptor(file: &File) -> PathBuf {
    use std::os::fd::AsRawFd;
    PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd()))
}

/// Names of temporary files of this process.
static NAMES: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A name that is listed as long as it is held, and free afterwards.
#[derive(Debug)]
struct Name(PathBuf);

impl Name {
    /// The first name in `folder` under which `make` can make something.
    fn free<T>(folder: &Path, make: impl Fn(&Path) -> io::Result<T>) -> io::Result<(Name, T)> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        loop {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!("{}{}-{count}{}", NAME.0, std::process::id(), NAME.1));
            match make(&path) {
                // Another machine or container, whose processes have the same numbers, writes here too.
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
                Ok(made) => {
                    NAMES.lock().unwrap_or_else(PoisonError::into_inner).push(path.clone());
                    return Ok((Name(path), made));
                }
            }
        }
    }
}

impl Drop for Name {
    fn drop(&mut self) {
        // Once it has moved there is nothing to remove.
        let _ = fs::remove_file(&self.0);
        NAMES.lock().unwrap_or_else(PoisonError::into_inner).retain(|listed| *listed != self.0);
    }
}

/// Removes the temporary files that this process is writing. For a process about to end at once: whatever is being
/// written is given up.
pub fn remove_temporaries() {
    remove_listed(|_| true);
}

/// Removes those of this process's temporary files of which `is_removed` says so.
pub(super) fn remove_listed(is_removed: impl Fn(&Path) -> bool) {
    NAMES.lock().unwrap_or_else(PoisonError::into_inner).retain(|path| {
        let is_removed = is_removed(path);
        if is_removed {
            let _ = fs::remove_file(path);
        }
        !is_removed
    });
}

/// Removes temporary files that nobody writes any more from `folder`, the first time that this process writes there.
fn remove_stale(folder: &Path) {
    static SEEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
    let mut seen = SEEN.lock().unwrap_or_else(PoisonError::into_inner);
    if seen.iter().any(|known| known == folder) {
        return;
    }
    seen.push(folder.to_owned());
    drop(seen);
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let is_temporary =
            entry.file_name().to_str().is_some_and(|name| name.starts_with(NAME.0) && name.ends_with(NAME.1));
        let is_file = is_temporary && entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_file && File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}
