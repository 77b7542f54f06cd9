//! The page's bytes: sections of several kinds, each kind a line of its name and of its sections as gzip in base64.

use std::collections::HashMap;

use serde::Serialize;

use super::Part;
use crate::page::packed;

/// The kind of sections that hold distances.
const DISTANCES: &str = "distances";
/// Sections begin at multiples of so many bytes: scripts look at them as words.
const ALIGNMENT: usize = 4;

/// Sections by kind. Equal ones are kept once: benchmarks share roads.
#[derive(Default)]
pub(super) struct Packed {
    kinds: Vec<(&'static str, Vec<u8>)>,
    sections: Vec<Section>,
    /// Sections by their bytes.
    known: HashMap<Vec<u8>, usize>,
}

/// Where a section lies in its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(super) struct Section {
    kind: &'static str,
    at: usize,
    size: usize,
}

impl Packed {
    /// The index of a section with these pairs of stored distances: as [`differences`], of which `data.js` makes them
    /// again. They take a third of the room.
    pub(super) fn add_distances(&mut self, pairs: &[u32]) -> usize {
        self.add(DISTANCES, &differences(pairs))
    }

    /// The index of a section with these bytes.
    pub(super) fn add(&mut self, kind: &'static str, bytes: &[u8]) -> usize {
        // Scripts read distances alone as differences.
        let is_alike = |&&known: &&usize| (self.sections[known].kind == DISTANCES) == (kind == DISTANCES);
        if let Some(&known) = self.known.get(bytes).filter(is_alike) {
            return known;
        }
        let place = self.kinds.iter().position(|(known, _)| *known == kind).unwrap_or_else(|| {
            self.kinds.push((kind, Vec::new()));
            self.kinds.len() - 1
        });
        let all = &mut self.kinds[place].1;
        let index = self.sections.len();
        self.sections.push(Section { kind, at: all.len(), size: bytes.len() });
        self.known.insert(bytes.to_vec(), index);
        all.extend(bytes);
        all.resize(all.len().next_multiple_of(ALIGNMENT), 0);
        index
    }

    /// Where each section lies.
    pub(super) fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// The lines, and the length of each.
    pub(super) fn written(&self) -> std::io::Result<(String, Vec<Part>)> {
        let (mut lines, mut parts) = (String::new(), Vec::new());
        for (kind, bytes) in &self.kinds {
            let line = format!("{kind} {}\n", packed(bytes)?);
            parts.push((*kind, line.len()));
            lines += &line;
        }
        Ok((lines, parts))
    }

    /// Names and lengths of the kinds, and their bytes, one after the other.
    pub(super) fn raw(&self) -> (Vec<(&'static str, usize)>, Vec<u8>) {
        let lengths = self.kinds.iter().map(|(kind, bytes)| (*kind, bytes.len())).collect();
        (lengths, self.kinds.iter().flat_map(|(_, bytes)| bytes).copied().collect())
    }
}

/// Of each word's lower half, and of what its upper half has more, the difference to the word before as a zigzag number
/// (0, -1, 1, -2 are 0, 1, 2, 3): the lower bytes of all words, then the upper ones, of the one and then of the other.
/// Neighbouring distances differ little, and these bytes by less.
fn differences(pairs: &[u32]) -> Vec<u8> {
    let n = pairs.len();
    let mut bytes = vec![0; 4 * n];
    let mut before = [0i16; 2];
    for (index, &pair) in pairs.iter().enumerate() {
        let south = pair as i16;
        let now = [south, ((pair >> 16) as i16).wrapping_sub(south)];
        for half in 0..2 {
            let difference = now[half].wrapping_sub(before[half]);
            let zigzag = (difference << 1 ^ difference >> 15).to_le_bytes();
            bytes[2 * half * n + index] = zigzag[0];
            bytes[(2 * half + 1) * n + index] = zigzag[1];
        }
        before = now;
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_differences_to_the_pair_before_byte_by_byte() {
        // South 3 and north 5, then -1 and 300, then the least and the greatest: differences wrap.
        let pairs = [[3, 5], [-1, 300], [i16::MIN, i16::MAX]]
            .map(|[south, north]: [i16; 2]| u32::from(south as u16) | u32::from(north as u16) << 16);
        // Differences 3, -4, -32767; rises 2, 301, -1 and their differences 2, 299, -302.
        assert_eq!(differences(&pairs), [6, 7, 253, 0, 0, 255, 4, 86, 91, 0, 2, 2]);
    }

    #[test]
    fn equal_sections_are_kept_once_and_each_begins_at_a_word() {
        let mut packed = Packed::default();
        let added = [("code", "abcde"), ("roads", "xy"), ("code", "f"), ("roads", "abcde")];
        assert_eq!(added.map(|(kind, bytes)| packed.add(kind, bytes.as_bytes())), [0, 1, 2, 0]);
        let mut apart = Packed::default();
        assert_eq!([("code", "ab"), (DISTANCES, "ab")].map(|(kind, bytes)| apart.add(kind, bytes.as_bytes())), [0, 1]);
        let places = packed.sections().iter().map(|section| (section.kind, section.at, section.size));
        assert_eq!(places.collect::<Vec<_>>(), [("code", 0, 5), ("roads", 0, 2), ("code", 8, 1)]);
        let (lines, parts) = packed.written().unwrap();
        assert_eq!(parts.iter().map(|(_, n_bytes)| n_bytes).sum::<usize>(), lines.len());
        assert!(lines.starts_with("code H4sI") && lines.contains("\nroads H4sI"), "{lines}");
    }
}
