//! Error messages of bounded length: numbers, values and lines of a file in a form that can be read on a terminal and
//! does nothing to it.

use std::borrow::Cow;
use std::ops::RangeInclusive;
use std::path::Path;

/// Maximum length of the parser's own words (characters).
const LONGEST_MESSAGE: usize = 600;
/// Maximum length of a line that is repeated (characters).
const LONGEST_LINE: usize = 100;

/// Maximum length of a path (characters).
pub const LONGEST_PATH: usize = 400;

/// Characters beside the control characters that are not seen, or that move or hide what is beside them: the formats of
/// Unicode 16 (`Cf`), its separators of lines and paragraphs, and the plane of tags.
const UNSEEN: [RangeInclusive<char>; 19] = [
    '\u{ad}'..='\u{ad}',
    '\u{600}'..='\u{605}',
    '\u{61c}'..='\u{61c}',
    '\u{6dd}'..='\u{6dd}',
    '\u{70f}'..='\u{70f}',
    '\u{890}'..='\u{891}',
    '\u{8e2}'..='\u{8e2}',
    '\u{180e}'..='\u{180e}',
    '\u{200b}'..='\u{200f}',
    '\u{2028}'..='\u{202e}',
    '\u{2060}'..='\u{206f}',
    '\u{feff}'..='\u{feff}',
    '\u{fff9}'..='\u{fffb}',
    '\u{110bd}'..='\u{110bd}',
    '\u{110cd}'..='\u{110cd}',
    '\u{13430}'..='\u{1343f}',
    '\u{1bca0}'..='\u{1bca3}',
    '\u{1d173}'..='\u{1d17a}',
    '\u{e0000}'..='\u{e0fff}',
];

/// Whether a terminal would do something else with a character than show it.
fn is_unseen(c: char) -> bool {
    c.is_control() || (!c.is_ascii() && UNSEEN.iter().any(|range| range.contains(&c)))
}

/// `text` as one line without control characters, marks of direction and others that are not seen: each is written as
/// Rust would escape it, `\n` or `\u{1b}`.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_unseen) {
        return text.into();
    }
    let mut escaped = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        match c {
            '\t' | '\n' | '\r' => escaped.extend(c.escape_default()),
            c if is_unseen(c) => escaped.extend(c.escape_unicode()),
            c => escaped.push(c),
        }
    }
    escaped.into()
}

/// A path as messages show it.
pub fn shown_path(path: &Path) -> String {
    shortened(&path.display().to_string(), LONGEST_PATH)
}

/// `value` in at most two dozen characters: with an exponent from 1e7 on and below 1e-4.
pub fn shown(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || !size.is_finite() || (1e-4..1e7).contains(&size) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// `value` rounded to two decimals, or to as many more as it takes to differ from `limit`.
pub fn differing(value: f64, limit: f64) -> String {
    let rounded = (2..17).map(|decimals| format!("{value:.decimals$}"));
    let mut differing = rounded.filter(|text| text.len() < 24 && text.parse() != Ok(limit));
    differing.next().unwrap_or_else(|| shown(value))
}

/// `text`, [`printable`], where it then has at most `limit` characters, else its beginning and its end around an
/// ellipsis.
pub fn shortened(text: &str, limit: usize) -> String {
    let text = printable(text);
    let n = text.chars().count();
    if n <= limit {
        return text.into_owned();
    }
    let tail = limit / 3;
    let head: String = text.chars().take(limit - tail - 1).collect();
    let tail: String = text.chars().skip(n - tail).collect();
    format!("{head}…{tail}")
}

/// What is wrong in the words of the TOML parser, on one line.
pub fn said(error: &toml::de::Error) -> String {
    match error.message().trim() {
        // Where one of some words is wanted.
        "wanted string or table" | "invalid type: unit variant, expected string only" => {
            "invalid type, expected a string".to_owned()
        }
        message => {
            let message = message.replace('\n', ", ");
            match message.rsplit_once(", expected ") {
                Some((found, wanted)) if found.starts_with("invalid ") => {
                    format!("{}, expected {}", found_type(found), wanted_type(wanted))
                }
                _ => message,
            }
        }
    }
}

/// What was found where another type is wanted, in TOML's words.
fn found_type(found: &str) -> Cow<'_, str> {
    for (name, word) in [("map", "a table"), ("sequence", "an array"), ("floating point", "number")] {
        if let Some(rest) = found.strip_prefix("invalid type: ").and_then(|rest| rest.strip_prefix(name)) {
            return format!("invalid type: {word}{rest}").into();
        }
    }
    found.into()
}

/// A type in TOML's words, where the parser has Rust's.
fn wanted_type(wanted: &str) -> Cow<'_, str> {
    match wanted {
        "f32" | "f64" => "a number".into(),
        "u8" => whole_numbers(u8::MAX.into()).into(),
        "u16" => whole_numbers(u16::MAX.into()).into(),
        "u32" => whole_numbers(u32::MAX).into(),
        "u64" | "usize" => "a whole number from 0 on".into(),
        "i32" | "i64" => "a whole number".into(),
        "a sequence" => "an array".into(),
        "a map" => "a table".into(),
        _ if wanted.starts_with("struct ") => "a table".into(),
        _ => wanted.into(),
    }
}

fn whole_numbers(last: u32) -> String {
    format!("a whole number in 0..{last}")
}

/// What the TOML parser says of `text`, with the line, the table and the part of the line around the fault.
pub(super) fn malformed(text: &str, error: &toml::de::Error) -> String {
    let message = shortened(&said(error), LONGEST_MESSAGE);
    let Some(span) = error.span() else { return message };
    let at = (0..=span.start.min(text.len())).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0);
    // What a whole file lacks has an empty span at its beginning, whatever its first line is.
    let table = table_at(text, at).filter(|_| span != (0..0));
    if table.is_none() && message.starts_with("missing field") {
        return format!("{message} at the top level");
    }
    let begin = text[..at].rfind('\n').map_or(0, |end| end + 1);
    let line = text[begin..].lines().next().unwrap_or("");
    let (number, column) = (text[..begin].matches('\n').count() + 1, text[begin..at].chars().count());
    let table = table.map(|table| format!("{}: ", shortened(&table, LONGEST_LINE))).unwrap_or_default();
    format!("line {number}, column {}: {table}{message}; the line is: {}", column + 1, excerpt(line, column))
}

/// The part of a line around a column, with an ellipsis where it was cut.
fn excerpt(line: &str, column: usize) -> String {
    let n = line.chars().count();
    if n <= LONGEST_LINE {
        return printable(line.trim()).into_owned();
    }
    let from = column.saturating_sub(LONGEST_LINE / 2).min(n - LONGEST_LINE);
    let part: String = line.chars().skip(from).take(LONGEST_LINE).collect();
    let cut = |cut: bool| if cut { "…" } else { "" };
    format!("{}{}{}", cut(0 < from), printable(&part), cut(from + LONGEST_LINE < n))
}

/// The table that byte `at` lies in, `arm(1).entry.kerb`; `None` at the top level.
fn table_at(text: &str, at: usize) -> Option<String> {
    let end = text[at..].find('\n').map_or(text.len(), |end| at + end);
    // Name and number of the arrays of tables opened so far.
    let mut arrays: Vec<(&str, usize)> = Vec::new();
    let mut table = None;
    for line in text[..end].lines() {
        let Some((name, array)) = header(line) else { continue };
        if array {
            // Arrays inside the array are counted from 0 in each of its tables.
            arrays.retain(|(known, _)| !known.strip_prefix(name).is_some_and(|rest| rest.starts_with('.')));
            match arrays.iter_mut().find(|(known, _)| *known == name) {
                Some((_, count)) => *count += 1,
                None => arrays.push((name, 1)),
            }
        }
        table = Some(name);
    }
    let table = table?;
    let mut path = String::new();
    let mut begin = 0;
    for end in table.match_indices('.').map(|(dot, _)| dot).chain([table.len()]) {
        path += &table[begin..end];
        if let Some((_, count)) = arrays.iter().find(|(known, _)| *known == &table[..end]) {
            path += &format!("[{}]", count - 1);
        }
        begin = end;
    }
    Some(path)
}

/// The name in a table's header, and whether the table is one of an array.
fn header(line: &str) -> Option<(&str, bool)> {
    let line = line.trim_start();
    let array = line.starts_with("[[");
    let (name, rest) = if array { line[2..].split_once("]]")? } else { line.strip_prefix('[')?.split_once(']')? };
    let (name, rest) = (name.trim(), rest.trim_start());
    let named =
        name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') && !name.contains([',', '"', '\'', '[', ' ']);
    (named && (rest.is_empty() || rest.starts_with('#'))).then_some((name, array))
}
