//! Files that a command is asked to write: each its own, and none of those that it reads.

use std::path::{Path, PathBuf};

use offtrack_evaluation::error::Error;

/// A flag and the file that it names, if it is given.
pub type Named<'a> = (&'static str, Option<&'a Path>);

/// Files that commands read in the folder of a training run.
pub fn of_run(folder: &Path) -> [PathBuf; 3] {
    ["config.toml", "metrics.csv", "report.json"].map(|name| folder.join(name))
}

/// An error if two of the files to be written are one, or one of them is a file that is read. The second would replace
/// the first.
pub fn distinct(written: &[Named], read: &[Named]) -> Result<(), Error> {
    for (index, (flag, file)) in written.iter().enumerate() {
        let Some(file) = file else { continue };
        let others = written[..index].iter().chain(read);
        if let Some((other, _)) = others.into_iter().find(|(_, other)| other.is_some_and(|other| is_same(file, other)))
        {
            let expected = format!("is the file of {other} too: name another one");
            return Err(Error::Setting { name: flag, value: file.display().to_string(), expected });
        }
    }
    Ok(())
}

/// Whether two paths lead to one file, which may not be there yet. What is written to a device or a pipe replaces
/// nothing.
fn is_same(file: &Path, other: &Path) -> bool {
    let replaces = !file.exists() || file.is_file();
    replaces && resolved(file).is_some_and(|file| resolved(other) == Some(file))
}

/// The path without links, as far as there is something; where a link leads to nothing yet, that.
fn resolved(file: &Path) -> Option<PathBuf> {
    let file = match file.read_link() {
        Ok(to) if !file.exists() => &file.parent().unwrap_or(Path::new("")).join(to),
        _ => file,
    };
    let folder = file.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    file.canonicalize().ok().or_else(|| Some(folder.canonicalize().ok()?.join(file.file_name()?)))
}
