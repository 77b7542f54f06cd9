//! A document that is being read: numbers within bounds, and errors and warnings with road, lane and line.

use roxmltree::{Document, Node, NodeId};

use super::records::{Concerns, Cubic, Records, Warning};
use super::whole::LEVEL;
use super::xml::{attribute, line, shown};
use crate::files::reader::{Error, Reader};

/// Longest road (m).
pub(super) const LONGEST: f64 = 100_000.0;
/// Most warnings of one road or junction.
const MOST_WARNINGS: usize = 20;

/// A document that is being read.
pub(super) struct Source<'a, 'i> {
    pub(super) reader: Reader<'a>,
    pub(super) document: &'a Document<'i>,
    pub(super) records: Records,
    /// Records of lanes that were repeated so far.
    pub(super) repeated: usize,
    /// The road or junction that was last warned of, and how often.
    warned: (Option<NodeId>, usize),
}

impl<'a, 'i> Source<'a, 'i> {
    /// A document of which nothing is read yet.
    pub(super) fn new(reader: Reader<'a>, document: &'a Document<'i>) -> Source<'a, 'i> {
        Source { reader, document, records: Records::default(), repeated: 0, warned: (None, 0) }
    }
}

impl Source<'_, '_> {
    /// Where a node stands, for messages: `road 12, section s 0, lane -1, width`.
    fn place(&self, node: Node) -> String {
        let mut parts = Vec::new();
        for node in node.ancestors() {
            match node.tag_name().name() {
                "road" => parts.push(format!("road {}", shown(attribute(node, "id")))),
                "junction" => parts.push(format!("junction {}", shown(attribute(node, "id")))),
                "laneSection" => parts.push(format!("section s {}", shown(attribute(node, "s")))),
                "lane" => parts.push(format!("lane {}", shown(attribute(node, "id")))),
                "geometry" => parts.push(format!("geometry s {}", shown(attribute(node, "s")))),
                "planView" | "lanes" | "left" | "right" | "center" | "OpenDRIVE" | "" => {}
                other => parts.push(shown(other)),
            }
        }
        parts.reverse();
        parts.join(", ")
    }

    /// Warns of a node; the import of a place with its road repeats it.
    pub(super) fn warn(&mut self, node: Node, what: &str) {
        let road = node.ancestors().find(|node| node.has_tag_name("road"));
        let concerns = road.map_or(Concerns::Map, |road| Concerns::Road(attribute(road, "id").to_owned()));
        self.note(node, what, concerns);
    }

    /// Warns of a road that is not level; the import of a place with it tells the largest of what its roads have.
    pub(super) fn warn_of_level(&mut self, road: Node, what: &str) {
        self.note(road, &format!("{what}; {LEVEL}"), Concerns::Map);
    }

    fn note(&mut self, node: Node, what: &str, concerns: Concerns) {
        let whole = node.ancestors().take_while(|node| node.parent_element().is_some()).last().unwrap_or(node);
        let n = if self.warned.0 == Some(whole.id()) { self.warned.1 + 1 } else { 1 };
        self.warned = (Some(whole.id()), n);
        let text = match n {
            ..=MOST_WARNINGS => format!("{}: {what}", self.place(node)),
            n if n == MOST_WARNINGS + 1 => format!("{}: has more that is odd", self.place(whole)),
            _ => return,
        };
        self.records.warnings.push(Warning { concerns, text });
    }

    pub(super) fn invalid(&self, node: Node, key: &str, value: &str, expected: impl Into<String>) -> Error {
        let key = format!("line {}: {}: {key}", line(self.document, node), self.place(node));
        self.reader.invalid(key, value, expected)
    }

    /// A number within `-limit..limit`, or `default` where the attribute is missing.
    pub(super) fn number(&self, node: Node, key: &str, default: Option<f64>, limit: f64) -> Result<f64, Error> {
        let Some(text) = node.attribute(key) else {
            return default.ok_or_else(|| {
                self.invalid(node, key, "missing", format!("a number within {limit:e} of 0 is needed"))
            });
        };
        match text.trim().parse::<f64>() {
            Ok(value) if value.abs() <= limit => Ok(value),
            _ => Err(self.invalid(node, key, &format!("{text:?}"), format!("must be a number within {limit:e} of 0"))),
        }
    }

    /// A station or a length.
    pub(super) fn length(&self, node: Node, key: &str) -> Result<f64, Error> {
        let value = self.number(node, key, None, LONGEST)?;
        if value < -1e-6 {
            return Err(self.invalid(node, key, attribute(node, key), "must not be negative"));
        }
        Ok(value.max(0.0))
    }

    pub(super) fn factors(&self, node: Node, keys: [&str; 4]) -> Result<[f64; 4], Error> {
        let mut factors = [0.0; 4];
        for (factor, key) in factors.iter_mut().zip(keys) {
            *factor = self.number(node, key, Some(0.0), 1e30)?;
        }
        Ok(factors)
    }

    fn cubic(&self, node: Node, start: &str) -> Result<Cubic, Error> {
        Ok(Cubic { start: self.length(node, start)?, factors: self.factors(node, ["a", "b", "c", "d"])? })
    }

    /// Cubics in the order of their beginnings.
    pub(super) fn cubics<'a, 'i: 'a>(
        &mut self,
        nodes: impl Iterator<Item = Node<'a, 'i>>,
        start: &str,
    ) -> Result<Vec<Cubic>, Error> {
        let mut cubics = nodes.map(|node| self.cubic(node, start)).collect::<Result<Vec<_>, _>>()?;
        cubics.sort_by(|one, other| one.start.total_cmp(&other.start));
        Ok(cubics)
    }
}
