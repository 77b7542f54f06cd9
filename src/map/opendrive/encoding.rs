//! The text of a map's bytes: UTF-8, UTF-16 and the two encodings of one byte a character that maps are found in.

use std::path::Path;

use super::xml::shown;
use crate::files::reader::{Error, shortened};
use crate::files::windows_1252;

/// Where the declaration of an encoding is looked for (bytes).
const HEAD: usize = 200;

/// The text of a map's bytes, in the encoding that its byte order mark or its first line declares.
///
/// # Errors
///
/// A compressed file, or one in an encoding that is not read, with what would do.
pub(super) fn text(file: &Path, bytes: Vec<u8>) -> Result<String, Error> {
    let malformed = |message: String| Error::Malformed { file: file.to_owned(), message: shortened(&message, 300) };
    let pairs = |of: fn([u8; 2]) -> u16, bytes: &[u8]| -> Result<String, Error> {
        let (pairs, rest) = bytes.as_chunks::<2>();
        let text = if rest.is_empty() {
            String::from_utf16(&pairs.iter().map(|&pair| of(pair)).collect::<Vec<_>>()).ok()
        } else {
            None
        };
        text.ok_or_else(|| malformed("is no valid UTF-16; save it as UTF-8".into()))
    };
    match bytes.as_slice() {
        [0x1f, 0x8b, ..] => return Err(malformed("is compressed by gzip; unpack it with gunzip first".into())),
        [b'P', b'K', 3, 4, ..] => {
            return Err(malformed("is a zip archive; unpack it first and give the .xodr file in it".into()));
        }
        [0xff, 0xfe, rest @ ..] => return pairs(u16::from_le_bytes, rest),
        [0xfe, 0xff, rest @ ..] => return pairs(u16::from_be_bytes, rest),
        [b'<', 0, ..] => return pairs(u16::from_le_bytes, &bytes),
        [0, b'<', ..] => return pairs(u16::from_be_bytes, &bytes),
        _ => {}
    }
    let encoding = declared(&bytes[..bytes.len().min(HEAD)]);
    if ["iso-8859-1", "latin1", "windows-1252", "cp1252"].contains(&encoding.as_str()) {
        return Ok(windows_1252::text(&bytes));
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let declared = if encoding.is_empty() {
            String::new()
        } else if encoding.eq_ignore_ascii_case("utf-8") {
            ", which it declares to be".to_owned()
        } else {
            format!(", and its encoding, {}, is not read", shown(&encoding))
        };
        malformed(format!(
            "is no valid UTF-8 from byte {at} on{declared}; save it as UTF-8 and declare that in its first line"
        ))
    })
}

/// The encoding that an XML declaration names, in lower case; empty without one.
fn declared(head: &[u8]) -> String {
    let head = String::from_utf8_lossy(head).to_lowercase();
    let declaration = head.split_once("?>").map_or("", |(declaration, _)| declaration);
    let value = declaration.split_once("encoding").map_or("", |(_, value)| value);
    let value = value.trim_start_matches(|c: char| c.is_whitespace() || c == '=');
    value.trim_start_matches(['"', '\'']).split(['"', '\'']).next().unwrap_or("").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<String, String> {
        text(Path::new("m.xodr"), bytes.to_vec()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_map_is_read_in_the_encoding_that_it_declares() {
        for encoding in ["ISO-8859-1", "latin1", "windows-1252"] {
            let head = format!("<?xml version='1.0' encoding='{encoding}'?><road name='Stra");
            let bytes = [head.as_bytes(), b"\xdfe \x80'/>"].concat();
            assert!(read(&bytes).unwrap().ends_with("Straße €'/>"));
        }
        let words: Vec<u16> = "<a name='ß'/>".encode_utf16().collect();
        let bytes = |of: fn(u16) -> [u8; 2]| words.iter().flat_map(|&word| of(word)).collect::<Vec<u8>>();
        let (little, big) = (bytes(u16::to_le_bytes), bytes(u16::to_be_bytes));
        for bytes in [&little, &big, &[&[0xff, 0xfe], &little[..]].concat(), &[&[0xfe, 0xff], &big[..]].concat()] {
            assert_eq!(read(bytes).unwrap(), "<a name='ß'/>");
        }
        assert_eq!(read("<a name='ß'/>".as_bytes()).unwrap(), "<a name='ß'/>");
    }

    #[test]
    fn bytes_that_are_no_text_are_refused_with_what_would_do() {
        for (bytes, expected) in [
            (&b"\x1f\x8b\x08"[..], "m.xodr: is compressed by gzip; unpack it with gunzip first"),
            (b"PK\x03\x04", "m.xodr: is a zip archive"),
            (b"<\0a", "m.xodr: is no valid UTF-16"),
            (b"<a \xdf/>", "m.xodr: is no valid UTF-8 from byte 3 on; save it as UTF-8"),
            (b"<?xml version='1.0' encoding='koi8-r'?>\xdf", "its encoding, koi8-r, is not read"),
            (
                b"<?xml version='1.0' encoding='UTF-8'?>\xdf",
                "from byte 38 on, which it declares to be; save it as UTF-8",
            ),
        ] {
            let message = read(bytes).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}
