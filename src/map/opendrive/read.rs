//! OpenDRIVE's XML to records: every number finite and within bounds, every error with road, lane and line.
//!
//! A file that contradicts itself is read with a warning; one that cannot be understood is refused.

use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

use super::Hand;
use super::objects::islands;
use super::records::{Concerns, Connection, Level, Link, Records, RoadRecord, Warning};
use super::source::{LONGEST, Source};
use super::xml::{attribute, child, children, line, shown};
use crate::files::reader::{Error, Reader, shortened};

/// Largest file (bytes).
pub(super) const FILE_LIMIT: u64 = 256 << 20;
/// Most elements of a file that are read.
const MOST_ELEMENTS: usize = 4_000_000;
/// Most nodes of a file: elements, comments and the text between them.
const MOST_NODES: u32 = 8_000_000;
/// Deepest nesting of elements.
const DEEPEST: u16 = 64;
/// A lane above this is raised (m).
pub(super) const RAISED: f64 = 0.02;
/// A raised lane of at most this width is a kerb (m).
pub(super) const KERB_WIDTH: f64 = 1.0;

/// The records of a file's text.
pub(super) fn records(file: &Path, text: &str, hand: Hand) -> Result<Records, Error> {
    // A document type is passed over; one that declares entities could make a large map of a small file.
    let options =
        ParsingOptions { nodes_limit: MOST_NODES, allow_dtd: !text.contains("<!ENTITY"), ..ParsingOptions::default() };
    let malformed = |message: String| Error::Malformed { file: file.to_owned(), message: shortened(&message, 300) };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        malformed(match error {
            roxmltree::Error::DtdDetected => {
                "declares entities (<!ENTITY ...>), which are not read; put their text in their place".into()
            }
            error => format!("is no OpenDRIVE map: {}", error.to_string().escape_debug()),
        })
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "OpenDRIVE" {
        return Err(malformed(format!(
            "is no OpenDRIVE map: the first element is <{}>, not <OpenDRIVE>",
            shown(root.tag_name().name())
        )));
    }
    check_size(&document).map_err(malformed)?;
    let mut source = Source::new(Reader::of(file), &document);
    for node in children(root, "road") {
        let road = source.road(node)?;
        if source.records.by_id.contains_key(&road.id) {
            source.warn(node, "has the id of an earlier road; it is left out");
            continue;
        }
        source.records.by_id.insert(road.id.clone(), source.records.roads.len());
        source.records.roads.push(road);
    }
    for node in children(root, "junction") {
        if attribute(node, "type") == "virtual" {
            source.warn(node, "is virtual: only roads that end at a junction are joined by it");
        }
        let connections = source.junction(node)?;
        let id = attribute(node, "id");
        if source.records.junctions.contains_key(id) {
            source.warn(node, "has the id of an earlier junction; its connections count as that one's");
        }
        source.records.junctions.entry(id.to_owned()).or_default().extend(connections);
    }
    source.records.mirrored = match hand {
        Hand::Right => false,
        Hand::Left => true,
        Hand::Map => source.left_hand(root),
    };
    let offset = child(root, "header").and_then(|header| child(header, "offset"));
    if let Some(node) = offset {
        let mut offset = [0.0; 4];
        for (value, key) in offset.iter_mut().zip(["x", "y", "z", "hdg"]) {
            match attribute(node, key).trim().parse::<f64>() {
                Ok(given) if given.is_finite() => *value = given,
                _ if attribute(node, key).is_empty() => {}
                _ => source.warn(node, &format!("its {key} is no number, and counts as 0")),
            }
        }
        source.records.offset = (offset != [0.0; 4]).then_some(offset);
    }
    let signals = root.descendants().filter(|node| node.has_tag_name("signal")).count();
    if 0 < signals {
        source.records.warnings.push(Warning::of_map(format!("{signals} signals are not read")));
    }
    let includes = root.descendants().filter(|node| node.has_tag_name("include")).count();
    if 0 < includes {
        let text = format!("{includes} includes of other files are not read: put what they have here");
        source.records.warnings.push(Warning::of_map(text));
    }
    let mut records = source.records;
    if records.mirrored {
        records.mirror();
    }
    records.completed(&Reader::of(file))?;
    Ok(records)
}

/// An error if there are too many elements, or elements too deep in each other.
fn check_size(document: &Document) -> Result<(), String> {
    let mut depths: Vec<u16> = Vec::new();
    let mut elements = 0;
    for node in document.descendants() {
        let depth = node.parent().map_or(0, |parent| depths[parent.id().get_usize()] + 1);
        if DEEPEST < depth {
            return Err(format!("line {}: elements lie more than {DEEPEST} deep in each other", line(document, node)));
        }
        depths.push(depth);
        elements += usize::from(node.is_element());
    }
    match elements {
        0..=MOST_ELEMENTS => Ok(()),
        more => Err(format!("has {more} elements; at most {MOST_ELEMENTS} are read")),
    }
}

impl Source<'_, '_> {
    fn road(&mut self, node: Node) -> Result<RoadRecord, Error> {
        let id = attribute(node, "id").to_owned();
        let mut length = self.length(node, "length")?;
        let Some(plan_node) = child(node, "planView") else {
            return Err(self.invalid(node, "planView", "missing", "every road needs one"));
        };
        let plan = self.plan(plan_node)?;
        let measured = plan.last().map_or(0.0, |last| last.start + last.length).min(LONGEST);
        if 0.01 < (measured - length).abs() {
            self.warn(
                node,
                &format!("has a length of {length:.3} m, but its geometries end at {measured:.3} m; they count"),
            );
            length = measured;
        }
        let link = child(node, "link");
        let ends = ["predecessor", "successor"].map(|name| link.and_then(|link| child(link, name)));
        let [predecessor, successor] = ends.map(|end| end.and_then(|end| self.road_link(end)));
        let lanes = child(node, "lanes");
        let offsets = match lanes {
            Some(lanes) => self.cubics(children(lanes, "laneOffset"), "s")?,
            None => Vec::new(),
        };
        let sections =
            self.sections(node, lanes.into_iter().flat_map(|lanes| children(lanes, "laneSection")), length)?;
        let junction = Some(attribute(node, "junction")).filter(|id| !id.is_empty() && *id != "-1").map(str::to_owned);
        let mut road = RoadRecord {
            id,
            length,
            junction,
            predecessor,
            successor,
            plan,
            offsets,
            sections,
            islands: Vec::new(),
            level: Level::default(),
        };
        road.level = self.level(node, &road)?;
        road.islands = islands(self, node, &road)?;
        Ok(road)
    }

    fn junction(&mut self, node: Node) -> Result<Vec<Connection>, Error> {
        let mut connections = Vec::new();
        for connection in children(node, "connection") {
            let mut lanes = Vec::new();
            for link in children(connection, "laneLink") {
                match (attribute(link, "from").parse::<i32>(), attribute(link, "to").parse::<i32>()) {
                    (Ok(from), Ok(to)) => lanes.push((from, to)),
                    _ => self.warn(link, "has no lane numbers in `from` and `to`; it is left out"),
                }
            }
            // A direct junction joins roads without one between them.
            let direct =
                connection.attribute("connectingRoad").is_none() && connection.attribute("linkedRoad").is_some();
            let connecting = if direct { "linkedRoad" } else { "connectingRoad" };
            for key in ["incomingRoad", connecting] {
                let id = attribute(connection, key);
                if !self.records.by_id.contains_key(id) {
                    self.warn(connection, &format!("its {key} \"{}\" is no road; it is left out", shown(id)));
                }
            }
            connections.push(Connection {
                incoming: attribute(connection, "incomingRoad").to_owned(),
                connecting: attribute(connection, connecting).to_owned(),
                at_start: self.is_at_start(connection),
                lanes,
                direct,
            });
        }
        Ok(connections)
    }

    /// Whether a link or a connection touches the beginning of its road; one that says neither end is warned of.
    fn is_at_start(&mut self, node: Node) -> bool {
        let point = attribute(node, "contactPoint");
        if !["start", "end"].contains(&point) {
            self.warn(
                node,
                &format!("its contactPoint \"{}\" is neither start nor end; it counts as start", shown(point)),
            );
        }
        point != "end"
    }

    /// Whether most of the map's roads have left-hand traffic.
    fn left_hand(&mut self, root: Node) -> bool {
        let rule = |road: Node| attribute(road, "rule").to_ascii_uppercase();
        let rules: Vec<bool> = children(root, "road").map(|road| rule(road) == "LHT").collect();
        let unknown = |road: &Node| !["", "LHT", "RHT"].contains(&rule(*road).as_str());
        if let Some(road) = children(root, "road").find(unknown) {
            let rule = shown(attribute(road, "rule"));
            self.warn(road, &format!("its rule {rule} is neither RHT nor LHT; it counts as RHT"));
        }
        let left = rules.iter().filter(|&&left| left).count();
        if 0 < left && left < rules.len() {
            let text = format!(
                "{left} of {} roads have left-hand traffic, the others right-hand; most count for all",
                rules.len()
            );
            self.records.warnings.insert(0, Warning { concerns: Concerns::EveryPlace, text });
        }
        rules.len() < 2 * left
    }

    /// What an end of a road is linked to; one of another kind is warned of.
    fn road_link(&mut self, node: Node) -> Option<Link> {
        let id = attribute(node, "elementId").to_owned();
        if node.has_attribute("elementS") {
            self.warn(
                node,
                "leads to a place along a road (elementS); only ends of roads are joined, and it is not read",
            );
            return None;
        }
        match attribute(node, "elementType") {
            "road" => Some(Link::RoadRecord(id, self.is_at_start(node))),
            "junction" => Some(Link::Junction(id)),
            other => {
                let other = shown(other);
                self.warn(node, &format!("has the elementType {other}; must be road or junction, and is not read"));
                None
            }
        }
    }
}
