//! A roundabout file as written, and the checks of single values and of the order of arms.

use std::ops::RangeInclusive;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::alignment::{Alignment, Way};
use super::corner::WrittenCorner;
use super::ring::Ring;
use crate::files::reader::{Error, Reader, shown};
use crate::geometry::Bend;
use crate::map::ground::{self, Hand};
use crate::map::route::Lane;

/// The smallest radius of a bend in a lane; no vehicle follows a smaller one (m).
const SHARPEST_LANE: f64 = 1.0;
/// Widths that a lane may have; a truck uses all of the wide ring lane of a small roundabout (m).
const LANE_WIDTHS: RangeInclusive<f64> = 2.5..=12.0;

/// Least radius of what an apron leaves of its island (m).
pub(crate) const BEHIND_APRON: f64 = 0.5;

/// The file as written. Its values are not checked yet.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Written {
    #[serde(default, skip_serializing_if = "is_right")]
    pub(crate) hand: Hand,
    pub(crate) ring: WrittenRing,
    pub(crate) arm: Vec<WrittenArm>,
}

#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WrittenRing {
    pub(crate) island_radius: f64,
    pub(crate) gutter: f64,
    pub(crate) lane_width: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) lanes: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) apron: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) island_gutter: Option<Vec<WrittenDirection>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) mouth_gutter: Option<Vec<WrittenDirection>>,
}

#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WrittenArm {
    pub(crate) name: String,
    pub(crate) bearing_deg: f64,
    pub(crate) length: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) lane_width: Option<f64>,
    pub(crate) entry: WrittenWay,
    pub(crate) exit: WrittenWay,
    #[serde(default, skip_serializing_if = "WrittenCorner::is_empty")]
    pub(crate) corner: WrittenCorner,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) splitter: Vec<WrittenPoint>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) splitter_gutter: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) kerb_gutter: Option<Vec<WrittenStation>>,
}

#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WrittenWay {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) lanes: Option<usize>,
    pub(crate) kerb: WrittenAlignment,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) left: Option<WrittenAlignment>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) right: Option<WrittenAlignment>,
}

#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WrittenAlignment {
    pub(crate) points: Vec<WrittenPoint>,
    pub(crate) ring_radius: f64,
}

#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WrittenPoint {
    pub(crate) along: f64,
    pub(crate) offset: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) radius: Option<f64>,
}

/// The width of a kerb's gutter at a station of the kerb.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WrittenStation {
    pub(crate) station: f64,
    pub(crate) width: f64,
}

/// The width of a gutter of the ring in a direction from its centre.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WrittenDirection {
    pub(crate) bearing_deg: f64,
    pub(crate) width: f64,
}

/// The alignments of a carriageway.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Carriageway {
    pub(super) kerb: Alignment,
    /// Centre lines of its lanes from the kerb: the right one and, if there are two, the left one.
    pub(super) lanes: Vec<Alignment>,
}

impl Carriageway {
    /// The alignment of a lane, or the only one where there is no such lane.
    pub(super) fn lane(&self, lane: Lane) -> &Alignment {
        &self.lanes[lane.index().min(self.lanes.len() - 1)]
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Arm {
    pub(super) name: String,
    /// Counter-clockwise from east (rad).
    pub(super) bearing: f64,
    /// Distance from the ring's centre to the solid edge that ends the arm (m).
    pub(super) length: f64,
    /// Width of the carriageways' lanes (m).
    pub(super) lane_width: f64,
    pub(super) entry: Carriageway,
    pub(super) exit: Carriageway,
    /// Radius that joins the entry's kerb to the next arm's exit kerb outside the ring (m).
    pub(super) kerb_corner: Option<f64>,
    /// Radius of the right lane to the first exit outside the ring (m); without it the lane lies beside the kerb.
    pub(super) lane_corner: Option<f64>,
    /// Whether that lane follows the ring although the kerb does not.
    pub(super) lane_on_ring: bool,
    /// Corners of the splitter island's kerb face in the arm's frame; empty if there is no island.
    pub(super) splitter: Vec<Bend>,
}

impl Arm {
    pub(super) fn way(&self, way: Way) -> &Carriageway {
        if way == Way::Entry { &self.entry } else { &self.exit }
    }
}

/// The hand that is left out of a file.
fn is_right(hand: &Hand) -> bool {
    *hand == Hand::Right
}

impl Written {
    /// Ring and arms, with every value within its range and the arms in order.
    pub(super) fn checked(self, reader: &Reader) -> Result<(Ring, Vec<Arm>), Error> {
        let island_radius = reader.within("ring.island_radius", self.ring.island_radius, 1.5..=200.0, "m")?;
        let ring = Ring {
            island_radius,
            gutter: reader.within("ring.gutter", self.ring.gutter, 0.0..=3.0, "m")?,
            lane_width: reader.within("ring.lane_width", self.ring.lane_width, LANE_WIDTHS, "m")?,
            lanes: reader.count("ring.lanes", self.ring.lanes.unwrap_or(2), 1..=3)?,
            apron: reader.within(
                "ring.apron",
                self.ring.apron.unwrap_or(0.0),
                0.0..=island_radius - BEHIND_APRON,
                "m",
            )?,
        };
        reader.length("arm", self.arm.len(), 2..=8, "tables")?;
        let arms: Vec<Arm> = self
            .arm
            .into_iter()
            .enumerate()
            .map(|(index, arm)| arm.checked(reader, index, &ring))
            .collect::<Result<_, _>>()?;
        let mut around = 0.0;
        for (index, arm) in arms.iter().enumerate() {
            let key = |name: &str| format!("arm[{index}].{name}");
            if let Some(other) = arms[..index].iter().position(|other| other.name == arm.name) {
                return Err(reader.invalid(key("name"), &arm.name, format!("arm[{other}] has this name already")));
            }
            let next = &arms[(index + 1) % arms.len()];
            around += (next.bearing - arm.bearing).rem_euclid(std::f64::consts::TAU);
            let gap = (next.bearing - arm.bearing).rem_euclid(std::f64::consts::TAU);
            if gap == 0.0 || 1e-6 < around - std::f64::consts::TAU {
                let index = (index + 1) % arms.len();
                let bearing = next.bearing.to_degrees();
                return Err(reader.invalid(
                    format!("arm[{index}].bearing_deg"),
                    format_args!("{bearing:.1} deg"),
                    format!(
                        "arms must follow each other counter-clockwise, and {} comes before {}",
                        arm.name, next.name
                    ),
                ));
            }
        }
        Ok((ring, arms))
    }
}

impl WrittenArm {
    fn checked(self, reader: &Reader, index: usize, ring: &Ring) -> Result<Arm, Error> {
        let key = |name: &str| format!("arm[{index}].{name}");
        if !ground::Arm::may_be_named(&self.name) {
            let expected = format!("must be {}", ground::Arm::NAMES);
            return Err(reader.invalid(key("name"), format!("{:?}", self.name), expected));
        }
        let bearing = reader.within(&key("bearing_deg"), self.bearing_deg, -360.0..=360.0, "deg")?.to_radians();
        let length = reader.within(&key("length"), self.length, ring.outer() + 10.0..=1000.0, "m")?;
        let lane_width =
            reader.within(&key("lane_width"), self.lane_width.unwrap_or(ring.lane_width), LANE_WIDTHS, "m")?;
        let radius = |name: &str, value: Option<f64>| {
            value.map(|value| reader.within(&key(name), value, 0.1..=1000.0, "m")).transpose()
        };
        let splitter = self.splitter.iter().enumerate();
        let splitter = splitter.map(|(point, written)| {
            let at = |name: &str| key(&format!("splitter[{point}].{name}"));
            let radius = written.radius.ok_or_else(|| {
                reader.invalid(at("radius"), "missing", "every corner of a splitter island needs one")
            })?;
            let along = reader.within(&at("along"), written.along, 0.0..=length, "m")?;
            let offset = reader.within(&at("offset"), written.offset, -200.0..=200.0, "m")?;
            Ok(Bend { at: DVec2::new(along, offset), radius: reader.within(&at("radius"), radius, 0.1..=1000.0, "m")? })
        });
        let splitter: Vec<Bend> = splitter.collect::<Result<_, Error>>()?;
        if !splitter.is_empty() {
            reader.length(&key("splitter"), splitter.len(), 3..=16, "points")?;
        }
        let lane_on_ring = self.corner.lane_on_ring(reader, &key("corner.lane"))?;
        Ok(Arm {
            lane_on_ring,
            kerb_corner: radius("corner.kerb_radius", self.corner.kerb_radius)?,
            lane_corner: radius("corner.lane_radius", self.corner.lane_radius)?,
            entry: self.entry.checked(reader, &key("entry"), Way::Entry, length, lane_width, ring)?,
            exit: self.exit.checked(reader, &key("exit"), Way::Exit, length, lane_width, ring)?,
            name: self.name,
            bearing,
            length,
            lane_width,
            splitter,
        })
    }
}

impl WrittenWay {
    fn checked(
        self,
        reader: &Reader,
        key: &str,
        way: Way,
        length: f64,
        lane_width: f64,
        ring: &Ring,
    ) -> Result<Carriageway, Error> {
        let lanes = reader.count(&format!("{key}.lanes"), self.lanes.unwrap_or(ring.lanes.min(2)), 1..=2)?;
        if ring.lanes < lanes {
            let expected =
                format!("must be at most {}, as many lanes as the ring has: change it or ring.lanes", ring.lanes);
            return Err(reader.invalid(format!("{key}.lanes"), lanes, expected));
        }
        if lanes == 1 && self.left.is_some() {
            let expected = "this carriageway has one lane, which is `right`: give it two lanes or leave `left` out";
            return Err(reader.invalid(format!("{key}.left"), "given", expected));
        }
        let kerb = self.kerb.checked(reader, &format!("{key}.kerb"), way, length, 0.0)?;
        let lane = |written: Option<WrittenAlignment>, name: &str, distance: f64| match written {
            Some(written) => written.checked(reader, &format!("{key}.{name}"), way, length, SHARPEST_LANE),
            None => kerb.beside(distance, ring.outer()).ok_or_else(|| {
                reader.invalid(
                    format!("{key}.{name}"),
                    "missing",
                    "this kerb bends too sharply for a lane beside it: give the lane's points",
                )
            }),
        };
        let beside = ring.gutter + lane_width / 2.0;
        let left = if lanes == 2 { Some(lane(self.left, "left", beside + lane_width)?) } else { None };
        let right = lane(self.right, "right", beside)?;
        Ok(Carriageway { lanes: [right].into_iter().chain(left).collect(), kerb })
    }
}

impl WrittenAlignment {
    /// `least` is the smallest radius of a bend (m).
    fn checked(self, reader: &Reader, key: &str, way: Way, length: f64, least: f64) -> Result<Alignment, Error> {
        reader.length(&format!("{key}.points"), self.points.len(), 1..=8, "points")?;
        let last = self.points.len() - 1;
        let side = if way == Way::Entry { 1.0 } else { -1.0 };
        let mut bends = vec![Bend { at: DVec2::new(length, side * self.points[0].offset), radius: 0.0 }];
        for (index, point) in self.points.iter().enumerate() {
            let at = |name: &str| format!("{key}.points[{index}].{name}");
            let along = reader.within(&at("along"), point.along, -length..=length, "m")?;
            let before = bends[index].at.x;
            if before <= along {
                return Err(reader.invalid(
                    at("along"),
                    format_args!("{} m", shown(along)),
                    format!("must be less than {} m, because points lead inwards", shown(before)),
                ));
            }
            let offset = reader.within(&at("offset"), point.offset, -200.0..=200.0, "m")?;
            let radius = match (point.radius, index == last) {
                (Some(radius), false) => reader.within(&at("radius"), radius, least..=1000.0, "m")?,
                (None, true) => 0.0,
                (None, false) => {
                    return Err(reader.invalid(at("radius"), "missing", "every point but the last needs one"));
                }
                (Some(radius), true) => {
                    return Err(reader.invalid(
                        at("radius"),
                        format_args!("{} m", shown(radius)),
                        "the last point has none: ring_radius rounds the corner into the ring",
                    ));
                }
            };
            bends.push(Bend { at: DVec2::new(along, side * offset), radius });
        }
        let ring_radius = reader.within(&format!("{key}.ring_radius"), self.ring_radius, 0.1..=1000.0, "m")?;
        Ok(Alignment { bends, ring_radius })
    }
}
