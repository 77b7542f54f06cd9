//! Files that a command is asked to write: each its own, and none of those that it reads.

use std::path::{Path, PathBuf};

use offtrack::files::reader::{TEXT_LIMIT, read_text, shown_path};
use offtrack::files::writer::Output;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::run_file::RunFile;
use toml::Value;

/// A flag and the file that it names, if it is given.
pub type Named<'a> = (&'static str, Option<&'a Path>);

/// Files of a training run in its folder, which commands read or with which it goes on.
pub fn of_run(folder: &Path) -> impl Iterator<Item = PathBuf> {
    RunFile::ALL.into_iter().filter(|file| *file != RunFile::Page).map(move |file| file.of(folder))
}

/// Files that lead from one to the next by the names in them, at most: a benchmark, a roundabout, its map.
const DEPTH: usize = 3;

/// An error if two of the files to be written are one, or one of them is a file that is read, or one that such a file
/// names: a vehicle of a benchmark, which the second would replace; or if one is a folder or in one that there is
/// not, so that what was computed for it would be lost.
pub fn distinct(written: &[Named], read: &[Named]) -> Result<(), Error> {
    let mut named = Vec::new();
    for (flag, file) in read {
        file.iter().for_each(|file| add_named(file, DEPTH, &mut |file| named.push((*flag, file))));
    }
    let named: Vec<Named> = named.iter().map(|(flag, file)| (*flag, Some(file.as_path()))).collect();
    for (index, (flag, file)) in written.iter().enumerate() {
        let Some(file) = file else { continue };
        let same = |others: &[Named]| {
            others.iter().find(|(_, other)| other.is_some_and(|other| is_same(file, other))).map(|(other, _)| *other)
        };
        let own = || same(&written[..index]).or_else(|| same(read)).map(|other| format!("is the file of {other} too"));
        let found = own().or_else(|| same(&named).map(|other| format!("is named in the file of {other}")));
        if let Some(found) = found {
            let expected = format!("{found}: name another one");
            return Err(Error::Setting { name: flag, value: file.display().to_string(), expected });
        }
        if file.is_dir() {
            let expected = "is a folder; a file is needed".to_owned();
            return Err(Error::Setting { name: flag, value: shown_path(file), expected });
        }
        if let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty())
            && !std::fs::metadata(folder).map_err(Error::write(file))?.is_dir()
        {
            return Err(Error::write(file)(std::io::ErrorKind::NotADirectory.into()));
        }
        // A pipe would wait for its reader.
        if !file.exists() || file.is_file() {
            Output::create(file).map_err(Error::write(file))?;
        }
    }
    Ok(())
}

/// Tells of the files whose paths stand as texts in a TOML file, and in those.
fn add_named(file: &Path, depth: usize, tell: &mut impl FnMut(PathBuf)) {
    // Whatever its ending: a pipe would be read empty.
    let may_name = 0 < depth && file.is_file();
    let text = may_name.then(|| read_text(file, TEXT_LIMIT).ok()).flatten();
    let mut values: Vec<Value> =
        text.and_then(|text| text.parse::<toml::Table>().ok()).map(Value::Table).into_iter().collect();
    while let Some(value) = values.pop() {
        match value {
            Value::Table(table) => values.extend(table.into_iter().map(|(_, value)| value)),
            Value::Array(array) => values.extend(array),
            Value::String(text) => {
                let named = file.parent().unwrap_or(Path::new("")).join(text);
                if named.is_file() {
                    add_named(&named, depth - 1, tell);
                    tell(named);
                }
            }
            _ => {}
        }
    }
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
    if let Ok(file) = file.canonicalize() {
        return Some(file);
    }
    let folder = file.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    // A folder that is not there yet may be made by the command.
    let folder = if folder == file { None } else { resolved(folder) };
    Some(folder?.join(file.file_name()?))
}
