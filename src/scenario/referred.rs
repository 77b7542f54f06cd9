//! Files that a benchmark or another file refers to.

use std::path::Path;

use crate::files::reader::{Error, Reader};
use crate::files::shipped::{Kind, Source};
use crate::map::chosen::is_map;

/// Reads the file that `source` refers to under `key`: by a path that ends in .toml or .xodr, or the shipped file of
/// this kind by its name. If there is no such file, the error names the key too.
pub(super) fn referred<T>(
    reader: &Reader,
    key: &str,
    source: &Source,
    kind: Kind,
    path: &Path,
    read: impl Fn(&Source) -> Result<T, Error>,
) -> Result<T, Error> {
    let is_path = is_map(path) || path.extension().is_some_and(|extension| extension == "toml");
    let found = if is_path { Ok(source.relative(path)) } else { Source::named(kind, &path.to_string_lossy()) };
    found.and_then(|source| read(&source)).map_err(|error| match error {
        Error::Unreadable { .. } | Error::NotAFile { .. } | Error::TooLarge { .. } | Error::UnknownName { .. } => {
            reader.invalid(key, format_args!("{:?}", path.display().to_string()), error.to_string())
        }
        error => error,
    })
}
