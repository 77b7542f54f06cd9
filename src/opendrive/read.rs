//! OpenDRIVE's XML to records: every number finite and within bounds, every error with road, lane and line.
//!
//! A file that contradicts itself is read with a warning; one that cannot be understood is refused.

use std::collections::HashSet;
use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

use super::Hand;
use super::objects::islands;
use super::records::{Connection, Cubic, Geometry, Height, Kind, Lane, Link, Records, Road, Section, Shape};
use super::xml::{attribute, child, children, line};
use crate::reader::{Error, Reader, shortened};

/// Largest file \[bytes].
pub(super) const FILE_LIMIT: u64 = 256 << 20;
/// Most elements of a file that are read.
const MOST_ELEMENTS: usize = 4_000_000;
/// Most nodes of a file: elements, comments and the text between them.
const MOST_NODES: u32 = 8_000_000;
/// Deepest nesting of elements.
const DEEPEST: u16 = 64;
/// Longest road \[m].
const LONGEST: f64 = 100_000.0;
/// Largest coordinate \[m].
const FARTHEST: f64 = 1e8;
/// Sharpest curvature of a reference line \[1/m].
const SHARPEST: f64 = 10.0;
/// Most that one piece of a reference line turns \[rad].
const MOST_TURN: f64 = 30.0;
/// Widest lane \[m].
const WIDEST: f64 = 1000.0;
/// A reference line whose pieces leave a gap beyond this is warned of \[m].
const GAP: f64 = 0.01;
/// A grade beyond this is warned of.
const GRADE: f64 = 0.03;
/// A lane above this is raised \[m].
pub(super) const RAISED: f64 = 0.02;
/// A raised lane of at most this width is a kerb \[m].
pub(super) const KERB_WIDTH: f64 = 1.0;
/// Most warnings that are kept.
const MOST_WARNINGS: usize = 1000;

/// The records of a file's text.
pub(super) fn records(file: &Path, text: &str, hand: Hand) -> Result<Records, Error> {
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let malformed = |message: String| Error::Malformed { file: file.to_owned(), message: shortened(&message, 300) };
    let document = Document::parse_with_options(text, options).map_err(|error| malformed(format!("is no OpenDRIVE map: {error}")))?;
    let root = document.root_element();
    if root.tag_name().name() != "OpenDRIVE" {
        return Err(malformed(format!("is no OpenDRIVE map: the first element is <{}>, not <OpenDRIVE>", root.tag_name().name())));
    }
    check_size(&document).map_err(malformed)?;
    let mut source = Source { reader: Reader::of(file), document: &document, records: Records::default() };
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
        let connections = source.junction(node)?;
        source.records.junctions.entry(attribute(node, "id").to_owned()).or_insert(connections);
    }
    source.records.mirrored = match hand {
        Hand::Right => false,
        Hand::Left => true,
        Hand::Map => source.left_hand(root),
    };
    let signals = root.descendants().filter(|node| node.has_tag_name("signal")).count();
    if 0 < signals {
        source.records.warnings.push(format!("{signals} signals are not read"));
    }
    let mut records = source.records;
    if records.mirrored {
        records.mirror();
    }
    let known: HashSet<&str> = records.roads.iter().map(|road| road.id.as_str()).collect();
    let mut missing = Vec::new();
    for road in &records.roads {
        for link in [&road.predecessor, &road.successor].into_iter().flatten() {
            match link {
                Link::Road(id, _) if !known.contains(id.as_str()) => missing.push((road.id.clone(), format!("road {id}"))),
                Link::Junction(id) if !records.junctions.contains_key(id) => missing.push((road.id.clone(), format!("junction {id}"))),
                _ => {}
            }
        }
    }
    for (road, what) in missing.into_iter().take(MOST_WARNINGS) {
        records.warnings.push(format!("road {road}: is linked to {what}, which the file does not have; it is a dead end"));
    }
    records.warnings.truncate(MOST_WARNINGS);
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

/// A document that is being read.
pub(super) struct Source<'a, 'i> {
    reader: Reader<'a>,
    document: &'a Document<'i>,
    pub(super) records: Records,
}

impl Source<'_, '_> {
    /// Where a node stands, for messages: `road 12, section s 0, lane -1, width`.
    fn place(&self, node: Node) -> String {
        let mut parts = Vec::new();
        for node in node.ancestors() {
            match node.tag_name().name() {
                "road" => parts.push(format!("road {}", shortened(attribute(node, "id"), 20))),
                "junction" => parts.push(format!("junction {}", shortened(attribute(node, "id"), 20))),
                "laneSection" => parts.push(format!("section s {}", shortened(attribute(node, "s"), 12))),
                "lane" => parts.push(format!("lane {}", shortened(attribute(node, "id"), 12))),
                "geometry" => parts.push(format!("geometry s {}", shortened(attribute(node, "s"), 12))),
                "planView" | "lanes" | "left" | "right" | "center" | "OpenDRIVE" | "" => {}
                other => parts.push(shortened(other, 20)),
            }
        }
        parts.reverse();
        parts.join(", ")
    }

    pub(super) fn warn(&mut self, node: Node, what: &str) {
        if self.records.warnings.len() < MOST_WARNINGS {
            self.records.warnings.push(format!("{}: {what}", self.place(node)));
        }
    }

    fn invalid(&self, node: Node, key: &str, value: &str, expected: impl Into<String>) -> Error {
        let key = format!("line {}: {}: {key}", line(self.document, node), self.place(node));
        self.reader.invalid(key, value, expected)
    }

    /// A number within `-limit..limit`, or `default` where the attribute is missing.
    pub(super) fn number(&self, node: Node, key: &str, default: Option<f64>, limit: f64) -> Result<f64, Error> {
        let Some(text) = node.attribute(key) else {
            return default.ok_or_else(|| self.invalid(node, key, "missing", format!("a number within {limit:e} of 0 is needed")));
        };
        match text.trim().parse::<f64>() {
            Ok(value) if value.abs() <= limit => Ok(value),
            _ => Err(self.invalid(node, key, &format!("{text:?}"), format!("must be a number within {limit:e} of 0"))),
        }
    }

    /// A station or a length.
    fn length(&self, node: Node, key: &str) -> Result<f64, Error> {
        let value = self.number(node, key, None, LONGEST)?;
        if value < -1e-6 {
            return Err(self.invalid(node, key, attribute(node, key), "must not be negative"));
        }
        Ok(value.max(0.0))
    }

    fn factors(&self, node: Node, keys: [&str; 4]) -> Result<[f64; 4], Error> {
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
    fn cubics<'a, 'i: 'a>(&mut self, nodes: impl Iterator<Item = Node<'a, 'i>>, start: &str) -> Result<Vec<Cubic>, Error> {
        let mut cubics = nodes.map(|node| self.cubic(node, start)).collect::<Result<Vec<_>, _>>()?;
        cubics.sort_by(|one, other| one.start.total_cmp(&other.start));
        Ok(cubics)
    }

    fn road(&mut self, node: Node) -> Result<Road, Error> {
        let id = attribute(node, "id").to_owned();
        let mut length = self.length(node, "length")?;
        let Some(plan_node) = child(node, "planView") else {
            return Err(self.invalid(node, "planView", "missing", "every road needs one"));
        };
        let mut plan = children(plan_node, "geometry").map(|node| self.geometry(node)).collect::<Result<Vec<_>, _>>()?;
        if plan.is_empty() {
            return Err(self.invalid(plan_node, "geometry", "missing", "every road needs at least one"));
        }
        plan.sort_by(|one, other| one.start.total_cmp(&other.start));
        let measured = plan.last().map_or(0.0, |last| last.start + last.length).min(LONGEST);
        if 0.01 < (measured - length).abs() {
            self.warn(node, &format!("has a length of {length:.3} m, but its geometries end at {measured:.3} m; they count"));
            length = measured;
        }
        self.check_plan(node, &plan);
        self.check_grade(node)?;
        let link = child(node, "link");
        let end = |name: &'static str| link.and_then(|link| child(link, name)).and_then(road_link);
        let lanes = child(node, "lanes");
        let offsets = match lanes {
            Some(lanes) => self.cubics(children(lanes, "laneOffset"), "s")?,
            None => Vec::new(),
        };
        let mut sections = Vec::new();
        for section in lanes.into_iter().flat_map(|lanes| children(lanes, "laneSection")) {
            sections.push(self.section(section)?);
        }
        if sections.is_empty() {
            self.warn(node, "has no lanes");
        }
        sections.sort_by(|one, other| one.start.total_cmp(&other.start));
        let junction = Some(attribute(node, "junction")).filter(|id| !id.is_empty() && *id != "-1").map(str::to_owned);
        let mut road = Road {
            id,
            length,
            junction,
            predecessor: end("predecessor"),
            successor: end("successor"),
            plan,
            offsets,
            sections,
            islands: Vec::new(),
        };
        road.islands = islands(self, node, &road)?;
        Ok(road)
    }

    fn geometry(&mut self, node: Node) -> Result<Geometry, Error> {
        let length = self.length(node, "length")?;
        let form = node.children().find(|child| child.is_element() && child.tag_name().name() != "userData");
        let curvature = |node: Node, key: &str| -> Result<f64, Error> {
            let curvature = self.number(node, key, None, SHARPEST)?;
            if MOST_TURN < curvature.abs() * length {
                return Err(self.invalid(node, key, attribute(node, key), format!("turns more than {MOST_TURN} rad on its length")));
            }
            Ok(curvature)
        };
        let shape = match form.map(|form| (form.tag_name().name(), form)) {
            Some(("line", _)) => Shape::Line,
            Some(("arc", form)) => Shape::Arc(curvature(form, "curvature")?),
            Some(("spiral", form)) => Shape::Spiral(curvature(form, "curvStart")?, curvature(form, "curvEnd")?),
            Some(("poly3", form)) => Shape::Poly3(self.factors(form, ["a", "b", "c", "d"])?),
            Some(("paramPoly3", form)) => Shape::ParamPoly3 {
                u: self.factors(form, ["aU", "bU", "cU", "dU"])?,
                v: self.factors(form, ["aV", "bV", "cV", "dV"])?,
                normalised: attribute(form, "pRange") != "arcLength",
            },
            other => {
                let found = other.map_or("missing".to_owned(), |(name, _)| format!("<{}>", shortened(name, 30)));
                return Err(self.invalid(node, "form", &found, "must be line, arc, spiral, poly3 or paramPoly3"));
            }
        };
        let origin = glam::DVec2::new(self.number(node, "x", None, FARTHEST)?, self.number(node, "y", None, FARTHEST)?);
        let heading = self.number(node, "hdg", None, 1e6)?;
        let geometry = Geometry { start: self.length(node, "s")?, origin, heading, length, shape };
        let far = |part: i32| geometry.pose(length * f64::from(part) / 4.0).0.abs().max_element();
        if let Some(far) = (0..=4).map(far).find(|far| !(0.0..=2.0 * FARTHEST).contains(far)) {
            return Err(self.invalid(node, "curve", &format!("{far:e} m"), "leads too far: its factors or its length are wrong"));
        }
        Ok(geometry)
    }

    fn section(&mut self, node: Node) -> Result<Section, Error> {
        let start = self.length(node, "s")?;
        let mut lanes: Vec<Lane> = Vec::new();
        for (side, sign) in [("left", 1), ("right", -1)] {
            for node in children(node, side).flat_map(|side| children(side, "lane")) {
                let lane = self.lane(node)?;
                if lane.id.signum() != sign || lanes.iter().any(|other| other.id == lane.id) {
                    self.warn(node, "has an id of the other side or of an earlier lane; it is left out");
                    continue;
                }
                lanes.push(lane);
            }
        }
        lanes.sort_by_key(|lane| -lane.id);
        Ok(Section { start, lanes })
    }

    fn lane(&mut self, node: Node) -> Result<Lane, Error> {
        let id = attribute(node, "id").parse::<i32>().ok().filter(|id| (-1000..=1000).contains(id) && *id != 0);
        let id = id.ok_or_else(|| self.invalid(node, "id", &format!("{:?}", attribute(node, "id")), "must be a number in -1000..1000"))?;
        let widths = self.cubics(children(node, "width"), "sOffset")?;
        let borders = self.cubics(children(node, "border"), "sOffset")?;
        let mut heights = Vec::new();
        for height in children(node, "height") {
            let of = |key: &str| self.number(height, key, Some(0.0), 100.0);
            heights.push(Height { start: self.length(height, "sOffset")?, height: of("inner")?.max(of("outer")?) });
        }
        heights.sort_by(|one, other| one.start.total_cmp(&other.start));
        let bordered = widths.is_empty() && !borders.is_empty();
        if widths.is_empty() && borders.is_empty() {
            self.warn(node, "has neither width nor border; it counts as having none");
        }
        let widths = if bordered { borders } else { widths };
        if let Some(wide) = widths.iter().find(|width| !bordered && WIDEST < width.factors[0].abs()) {
            let value = format!("{} m", wide.factors[0]);
            return Err(self.invalid(node, "width", &value, format!("must be at most {WIDEST} m")));
        }
        let link = child(node, "link");
        let end = |name: &'static str| link.and_then(|link| child(link, name)).and_then(|end| attribute(end, "id").parse::<i32>().ok());
        Ok(Lane {
            id,
            kind: Kind::named(attribute(node, "type")),
            widths,
            bordered,
            heights,
            predecessor: end("predecessor"),
            successor: end("successor"),
        })
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
            connections.push(Connection {
                incoming: attribute(connection, "incomingRoad").to_owned(),
                connecting: attribute(connection, "connectingRoad").to_owned(),
                at_start: attribute(connection, "contactPoint") != "end",
                lanes,
            });
        }
        Ok(connections)
    }

    /// Whether most of the map's roads have left-hand traffic.
    fn left_hand(&mut self, root: Node) -> bool {
        let rules: Vec<bool> = children(root, "road").map(|road| attribute(road, "rule") == "LHT").collect();
        let left = rules.iter().filter(|&&left| left).count();
        if 0 < left && left < rules.len() {
            let both = format!("{left} of {} roads have left-hand traffic, the others right-hand; most count for all", rules.len());
            self.records.warnings.push(both);
        }
        rules.len() < 2 * left
    }

    /// Warns of gaps in a reference line.
    fn check_plan(&mut self, node: Node, plan: &[Geometry]) {
        for pair in plan.windows(2) {
            let gap = pair[0].end().distance(pair[1].origin);
            if GAP < gap {
                self.warn(node, &format!("its reference line jumps by {gap:.3} m at s {:.2} m", pair[1].start));
            }
        }
    }

    /// Warns of a steep road.
    fn check_grade(&mut self, node: Node) -> Result<(), Error> {
        let records = children(node, "elevationProfile").flat_map(|profile| children(profile, "elevation")).collect::<Vec<_>>();
        let mut steepest: f64 = 0.0;
        for record in records {
            steepest = steepest.max(self.number(record, "b", Some(0.0), 1e9)?.abs());
        }
        if GRADE < steepest {
            self.warn(node, &format!("has a grade of {:.1} %; the simulated road is level", 100.0 * steepest));
        }
        Ok(())
    }
}

fn road_link(node: Node) -> Option<Link> {
    let id = attribute(node, "elementId").to_owned();
    match attribute(node, "elementType") {
        "road" => Some(Link::Road(id, attribute(node, "contactPoint") != "end")),
        "junction" => Some(Link::Junction(id)),
        _ => None,
    }
}
