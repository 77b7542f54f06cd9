//! Texts of one byte a character.

/// Characters of Windows-1252 from 0x80 to 0x9f; those of ISO-8859-1 there are control characters, which no file has.
const WINDOWS_1252: &str = "€\u{fffd}‚ƒ„…†‡ˆ‰Š‹Œ\u{fffd}Ž\u{fffd}\u{fffd}‘’“”•–—˜™š›œ\u{fffd}žŸ";
/// The text of bytes in Windows-1252 or ISO-8859-1.
pub(crate) fn text(bytes: &[u8]) -> String {
    let high: Vec<char> = WINDOWS_1252.chars().collect();
    let of = |&byte: &u8| if (0x80..0xa0).contains(&byte) { high[usize::from(byte - 0x80)] } else { char::from(byte) };
    bytes.iter().map(of).collect()
}
