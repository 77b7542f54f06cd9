//! A DXF file in ASCII: pairs of a group code and a value, a line each.

use std::path::Path;

use crate::files::reader::{Error, Reader};

/// A group code with its value, and the line of the value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pair<'a> {
    pub(super) code: i32,
    pub(super) value: &'a str,
    pub(super) line: usize,
}

impl Pair<'_> {
    /// The value as a number.
    pub(super) fn number(&self, file: &Path) -> Result<f64, Error> {
        let number = self.value.parse::<f64>().ok().filter(|value| value.is_finite());
        number.ok_or_else(|| Reader::of(file).invalid(self.key(), self.value, "must be a finite number"))
    }

    /// The place of the value, for errors.
    pub(super) fn key(&self) -> String {
        format!("line {}", self.line)
    }
}

/// All pairs of a text.
pub(super) fn pairs<'a>(file: &Path, text: &'a str) -> Result<Vec<Pair<'a>>, Error> {
    let reader = Reader::of(file);
    if text.starts_with("AutoCAD Binary DXF") {
        return Err(reader.invalid("line 1", "a binary DXF", "save it as DXF in ASCII"));
    }
    let mut lines = text.lines().enumerate();
    let mut pairs = Vec::new();
    while let Some((index, code)) = lines.next() {
        let code = code.trim();
        if code.is_empty() && lines.clone().all(|(_, line)| line.trim().is_empty()) {
            break;
        }
        let number = code.parse::<i32>().map_err(|_| {
            reader.invalid(format!("line {}", index + 1), code, "a group code is needed there: is it a DXF in ASCII?")
        })?;
        let Some((index, value)) = lines.next() else {
            return Err(reader.invalid(
                format!("line {}", index + 1),
                code,
                "the file ends without the value of this code",
            ));
        };
        pairs.push(Pair { code: number, value: value.trim(), line: index + 1 });
    }
    match pairs.first() {
        Some(Pair { code: 0 | 999, .. }) => Ok(pairs),
        _ => Err(reader.invalid("line 1", "no section", "a DXF in ASCII is needed")),
    }
}
