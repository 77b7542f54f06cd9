//! Writes files: whole or not at all, and otherwise as a shell's `>` does.
//!
//! Symbolic links are followed, and what is not a regular file (a device, a pipe, standard output) is written into as
//! it is. A regular file is replaced in one move once all of it is on the disk; owner and permissions stay those of the
//! file that it replaces. One whose owner cannot be kept so is written over once everything is in a file beside it.

mod temporary;
#[cfg(test)]
mod tests;

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, ErrorKind, Seek, Write};
use std::path::{Path, PathBuf};

use temporary::Temporary;
pub use temporary::remove_temporaries;

/// Most links from one to the next, as Linux has it.
const MOST_LINKS: usize = 40;

/// A file being written. Dropped before [`Output::finish`], a regular file stays as it was.
#[derive(Debug)]
pub struct Output(Way);

/// How a file is written.
#[derive(Debug)]
enum Way {
    /// A temporary file will take the place of `target`, a path without links.
    Replaced { target: PathBuf, temporary: Temporary },
    /// A file that must stay itself: what the temporary file holds is copied into it.
    Copied { into: File, temporary: Temporary },
    /// What cannot be replaced is written into.
    Opened(File),
}

impl Output {
    /// Begins to write `file`.
    ///
    /// # Errors
    ///
    /// `file` is a folder, may not be written, or its folder may not.
    pub fn create(file: &Path) -> io::Result<Output> {
        let found = match fs::metadata(file) {
            Ok(found) => found,
            Err(error) if error.kind() == ErrorKind::NotFound => {
                let target = followed(file);
                return Ok(Output(Way::Replaced { temporary: Temporary::create(folder_of(&target), None)?, target }));
            }
            Err(error) => return Err(error),
        };
        if found.is_dir() {
            return Err(ErrorKind::IsADirectory.into());
        }
        if let Some(stream) = standard_stream(&found) {
            return Ok(Output(Way::Opened(stream)));
        }
        // A file that may not be written must not be replaced either.
        let opened = OpenOptions::new().write(true).open(file)?;
        if !found.is_file() {
            return Ok(Output(Way::Opened(opened)));
        }
        let target = followed(file);
        let temporary = Temporary::create(folder_of(&target), Some(&found))?;
        if keep_access(&found, temporary.file()).is_err() {
            // Nobody but root can give a file away: one of another owner stays itself.
            return Ok(Output(Way::Copied { into: opened, temporary }));
        }
        Ok(Output(Way::Replaced { target, temporary }))
    }

    /// Puts what was written into its place. A regular file is on the disk before; one that belongs to another user,
    /// whose owner only root could keep, is copied into, and holds a part of it if that fails.
    ///
    /// # Errors
    ///
    /// The disk is full or broken, or the folder may not be written any more.
    pub fn finish(self) -> io::Result<()> {
        if let Way::Replaced { temporary, .. } | Way::Copied { temporary, .. } = &self.0 {
            temporary.file().sync_all()?;
        }
        let copied = if let Way::Copied { into, .. } = &self.0 { Some(into.try_clone()?) } else { None };
        let target = if let Way::Replaced { target, .. } = &self.0 { Some(target.clone()) } else { None };
        self.finish_unsynced()?;
        target.iter().for_each(|target| sync_name(target));
        copied.map_or(Ok(()), |into| into.sync_all())
    }

    /// Puts what was written into its place without waiting for the disk: after a crash of the system the file may have
    /// lost bytes.
    ///
    /// # Errors
    ///
    /// The errors of [`Output::finish`].
    pub fn finish_unsynced(self) -> io::Result<()> {
        match self.0 {
            Way::Replaced { target, temporary } => temporary.put(&target),
            Way::Copied { mut into, temporary } => {
                let mut whole = temporary.file();
                whole.rewind()?;
                into.set_len(0)?;
                io::copy(&mut whole, &mut into).map(drop)
            }
            Way::Opened(_) => Ok(()),
        }
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.0 {
            Way::Replaced { temporary, .. } | Way::Copied { temporary, .. } => temporary.file().write(bytes),
            Way::Opened(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writes `bytes` to `file`, whole or not at all.
///
/// # Errors
///
/// The errors of [`Output::create`] and [`Output::finish`].
pub fn write_whole(file: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut output = Output::create(file)?;
    output.write_all(bytes)?;
    output.finish()
}

/// The path that `file` stands for once symbolic links are followed. It need not exist.
pub fn followed(file: &Path) -> PathBuf {
    let mut path = file.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(next) = fs::read_link(&path) else { break };
        path = folder_of(&path).join(next);
    }
    path
}

/// Gives `file` the owner and the permissions of another.
///
/// # Errors
///
/// This user may not give files to that owner.
pub fn keep_access(of: &Metadata, file: &File) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let own = file.metadata()?;
        if (own.uid(), own.gid()) != (of.uid(), of.gid()) {
            std::os::unix::fs::fchown(file, Some(of.uid()), Some(of.gid()))?;
        }
    }
    file.set_permissions(of.permissions())
}

/// Waits until the name of a file that was put into its place is on the disk, where the system lets a folder be opened
/// for that.
pub fn sync_name(file: &Path) {
    #[cfg(unix)]
    let _ = File::open(folder_of(file)).and_then(|folder| folder.sync_all());
    #[cfg(not(unix))]
    let _ = file;
}

/// The folder that a path lies in.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Standard output or error if `found` is where it goes. Opened a second time, a regular file would be written from its
/// beginning by both.
#[cfg(unix)]
fn standard_stream(found: &Metadata) -> Option<File> {
    use std::os::fd::AsFd;
    use std::os::unix::fs::MetadataExt;

    let (output, error) = (io::stdout(), io::stderr());
    // What cannot be printed is not this file's failure.
    let _ = (&output).flush();
    let streams = [output.as_fd(), error.as_fd()]
        .into_iter()
        .filter_map(|stream| stream.try_clone_to_owned().map(File::from).ok());
    let is_found = |own: Metadata| (own.dev(), own.ino()) == (found.dev(), found.ino());
    streams.into_iter().find(|stream| stream.metadata().is_ok_and(is_found))
}

#[cfg(not(unix))]
fn standard_stream(_: &Metadata) -> Option<File> {
    None
}
