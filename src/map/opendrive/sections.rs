//! The lane sections of a road from its XML.
//!
//! A section may describe one side of the road alone (`singleSide`). The other side's lanes go on then, so such
//! sections are cut until every one has both sides.

use roxmltree::Node;

use super::read::RAISED;
use super::records::{Cubic, Height, Kind, Lane, Section};
use super::source::Source;
use super::xml::{attribute, child, children};
use crate::files::reader::Error;

/// Widest lane (m).
const WIDEST: f64 = 1000.0;
/// A section shorter than this has no lanes that could be driven on (m).
pub(super) const SHORTEST: f64 = 1e-6;
/// Most records of lanes that are repeated because a section describes the other side alone.
const MOST_REPEATED: usize = 1_000_000;

/// A section as it is written: the sides that it describes, left first.
struct Written {
    section: Section,
    sides: [bool; 2],
}

/// Whether a lane's access records have this rule for trucks.
fn has_for_trucks(lane: Node, rule: &str) -> bool {
    let is_for_trucks = |access: Node| {
        let restrictions = children(access, "restriction").map(|node| attribute(node, "type"));
        attribute(access, "rule") == rule
            && restrictions.chain([attribute(access, "restriction")]).any(|of| ["truck", "trucks"].contains(&of))
    };
    children(lane, "access").any(is_for_trucks)
}

impl Source<'_, '_> {
    /// The lane sections of a road of this length, each with both sides.
    pub(super) fn sections<'a, 'i: 'a>(
        &mut self,
        road: Node,
        nodes: impl Iterator<Item = Node<'a, 'i>>,
        length: f64,
    ) -> Result<Vec<Section>, Error> {
        let mut written = Vec::new();
        for node in nodes {
            written.push(self.section(node)?);
        }
        if written.is_empty() {
            self.warn(road, "has no lanes");
        }
        written.sort_by(|one, other| one.section.start.total_cmp(&other.section.start));
        let sections = self.whole(road, written)?;
        for (i, section) in sections.iter().enumerate() {
            let end = sections.get(i + 1).map_or(length, |next| next.start);
            if end - section.start < SHORTEST {
                self.warn(
                    road,
                    &format!("its lane section at s {} m has no length; lanes are joined across it", section.start),
                );
            }
        }
        Ok(sections)
    }

    fn section(&mut self, node: Node) -> Result<Written, Error> {
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
        let single = ["true", "1"].contains(&attribute(node, "singleSide"));
        let has = |sign: i32| lanes.iter().any(|lane| lane.id.signum() == sign);
        let sides = if single { [has(1), has(-1)] } else { [true; 2] };
        Ok(Written { section: Section { start, lanes }, sides })
    }

    fn lane(&mut self, node: Node) -> Result<Lane, Error> {
        let id = attribute(node, "id").parse::<i32>().ok().filter(|id| (-1000..=1000).contains(id) && *id != 0);
        let id = id.ok_or_else(|| {
            self.invalid(node, "id", &format!("{:?}", attribute(node, "id")), "must be a number in -1000..1000, not 0")
        })?;
        let widths = self.cubics(children(node, "width"), "sOffset")?;
        let borders = self.cubics(children(node, "border"), "sOffset")?;
        let mut heights = Vec::new();
        for height in children(node, "height") {
            let of = |key: &str| self.number(height, key, Some(0.0), 100.0);
            heights.push(Height { start: self.length(height, "sOffset")?, height: of("inner")?.max(of("outer")?) });
        }
        heights.sort_by(|one, other| one.start.total_cmp(&other.start));
        let is_raised = |height: &Height| RAISED < height.height;
        let begins_level = heights.first().is_none_or(|first| 0.0 < first.start || !is_raised(first));
        if heights.iter().any(is_raised) && (begins_level || !heights.iter().all(is_raised)) {
            self.warn(node, "is raised on a part of its way; it counts as raised on all of it");
        }
        let bordered = widths.is_empty() && !borders.is_empty();
        if !widths.is_empty() && !borders.is_empty() {
            self.warn(node, "has width and border; the border is not read");
        }
        if widths.is_empty() && borders.is_empty() {
            self.warn(node, "has neither width nor border; it counts as having none");
        }
        let widths = if bordered { borders } else { widths };
        if let Some(first) = widths.first().filter(|first| SHORTEST < first.start) {
            let start = first.start;
            self.warn(node, &format!("its width begins at sOffset {start} m; what it is there holds before, too"));
        }
        if let Some(width) = widths.iter().find(|width| !bordered && width.factors[0] < 0.0) {
            let (start, width) = (width.start, width.factors[0]);
            self.warn(node, &format!("its width at sOffset {start} m is {width} m; it counts as 0"));
        }
        if let Some(wide) = widths.iter().find(|width| !bordered && WIDEST < width.factors[0].abs()) {
            let value = format!("{} m", wide.factors[0]);
            return Err(self.invalid(node, "width", &value, format!("must be at most {WIDEST} m")));
        }
        let link = child(node, "link");
        for name in ["predecessor", "successor"] {
            if link.is_some_and(|link| 1 < children(link, name).count()) {
                self.warn(node, &format!("has several links {name}; the first is read"));
            }
        }
        let end = |name: &'static str| {
            link.and_then(|link| child(link, name)).and_then(|end| attribute(end, "id").parse::<i32>().ok())
        };
        let reversed = match attribute(node, "direction") {
            "reversed" => true,
            "" | "standard" | "both" => false,
            _ => {
                self.warn(node, "its direction is neither standard, reversed nor both; standard is taken");
                false
            }
        };
        let name = attribute(node, "type");
        // One that is linked to none is drivable ground, such as what lies between lanes.
        if (name == "bidirectional" || attribute(node, "direction") == "both") && link.is_some() {
            self.warn(node, "has traffic both ways; it is driven on one way, by the side that it lies on");
        }
        let kind = Kind::named(name).unwrap_or_else(|| {
            *self.records.unknown_types.entry(name.to_owned()).or_default() += 1;
            Kind::Nothing
        });
        let kind = if kind == Kind::Solid && has_for_trucks(node, "allow") { Kind::Apron } else { kind };
        if kind == Kind::Lane && has_for_trucks(node, "deny") {
            self.warn(node, "forbids trucks; it is driven on as other lanes are");
        }
        Ok(Lane {
            id,
            kind,
            reversed,
            widths,
            bordered,
            heights,
            predecessor: end("predecessor"),
            successor: end("successor"),
        })
    }

    /// Sections with both sides: where one describes a single side, the other side's lanes of the section before go on.
    fn whole(&mut self, road: Node, written: Vec<Written>) -> Result<Vec<Section>, Error> {
        let mut whole: Vec<Section> = Vec::new();
        for Written { section, sides } in written {
            let described = |lane: &Lane| sides[usize::from(lane.id < 0)];
            let Some(before) = whole.last_mut().filter(|_| sides != [true; 2]) else {
                whole.push(section);
                continue;
            };
            let later = section.start - before.start;
            let mut lanes: Vec<Lane> = section.lanes;
            if later < SHORTEST && !before.lanes.iter().any(described) {
                // Both sides of the same stretch.
                before.lanes.extend(lanes);
                before.lanes.sort_by_key(|lane| -lane.id);
                continue;
            }
            for lane in before.lanes.iter_mut().filter(|lane| !described(lane)) {
                // Records count from their section's beginning.
                let widths = lane.widths.iter().map(|width| Cubic { start: width.start - later, ..*width }).collect();
                let heights =
                    lane.heights.iter().map(|height| Height { start: height.start - later, ..*height }).collect();
                self.repeated += 1 + lane.widths.len() + lane.heights.len();
                lanes.push(Lane { widths, heights, predecessor: Some(lane.id), ..lane.clone() });
                lane.successor = Some(lane.id);
                if MOST_REPEATED < self.repeated {
                    let expected =
                        "must be fewer: with the lanes of the other side they are more than a million records";
                    return Err(self.invalid(road, "laneSection", "singleSide", expected));
                }
            }
            lanes.sort_by_key(|lane| -lane.id);
            whole.push(Section { start: section.start, lanes });
        }
        Ok(whole)
    }
}
