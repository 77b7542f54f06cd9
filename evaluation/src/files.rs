//! What commands read, write and print: benchmarks by name, results written whole or not at all, text that does nothing
//! to a terminal.

use std::io::Write;
use std::path::Path;

use offtrack::files::reader::printable;
use offtrack::files::writer;
use serde::Serialize;

use crate::error::Error;

pub use writer::remove_temporaries;

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

/// JSON of what ends with a list: `head` has that list empty, and each of its `rows` gets a line.
///
/// # Errors
///
/// A row that cannot be written as JSON, and a head whose last key is no list.
pub(crate) fn json_lines(head: &str, rows: &[impl Serialize]) -> serde_json::Result<String> {
    let open = head.strip_suffix('}').and_then(|head| head.trim_end().strip_suffix(']'));
    let open = open.ok_or_else(|| serde::ser::Error::custom("the last key is no list"))?;
    let rows: Vec<String> = rows.iter().map(serde_json::to_string).collect::<Result<_, _>>()?;
    Ok(format!("{open}\n{}\n]}}", rows.join(",\n")))
}

/// Says one line on standard error, after the program's name. Nobody may be reading it: then the work goes on.
pub fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "offtrack: {}", printable(line));
}

/// An error for what is there and is no folder.
///
/// # Errors
///
/// [`Error::Contents`] with its path.
pub fn check_folder(folder: &Path) -> Result<(), Error> {
    if folder.exists() && !folder.is_dir() {
        return Err(Error::contents(folder, "is a file; a folder is needed"));
    }
    Ok(())
}

/// Makes a folder, and those that it lies in.
///
/// # Errors
///
/// [`Error::Contents`] for a file of that name, [`Error::Write`].
pub fn make_folder(folder: &Path) -> Result<(), Error> {
    check_folder(folder)?;
    std::fs::create_dir_all(folder).map_err(Error::write(folder))
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

/// Writes `bytes` to `file`, as [`writer::write_whole`] does: whole or not at all, or into what is no regular file.
pub fn write_whole(file: &Path, bytes: &[u8]) -> Result<(), Error> {
    writer::write_whole(file, bytes).map_err(Error::write(file))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_characters_that_a_terminal_obeys_only_line_ends_are_printed() {
        assert_eq!(harmless("a\n\u{1b}[2Jb\r\n\u{202e}c\n"), "a\n\\u{1b}[2Jb\\r\n\\u{202e}c\n");
        assert_eq!(harmless("Köln  µm²\n"), "Köln  µm²\n");
    }
}
