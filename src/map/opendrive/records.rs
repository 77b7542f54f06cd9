//! An OpenDRIVE map as records: what a file says of roads, lanes and junctions, in SI units, right-hand traffic.
//!
//! A left-hand map is mirrored in the x axis when it is read, so whatever follows knows right-hand traffic alone.

use std::collections::{BTreeMap, HashMap};

use glam::DVec2;

/// A polynomial `a + b x + c x² + d x³` that holds from `start` on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cubic {
    /// Where the polynomial begins: x is counted from here (m).
    pub(super) start: f64,
    /// a, b, c, d.
    pub(super) factors: [f64; 4],
}

impl Cubic {
    /// Value at station `s`, before its beginning that at its beginning (m).
    pub(super) fn at(&self, s: f64) -> f64 {
        let [a, b, c, d] = self.factors;
        let x = (s - self.start).max(0.0);
        a + x * (b + x * (c + x * d))
    }
}

/// How a road lies in space.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Level {
    /// Largest rise along the road, as a fraction of the length.
    pub(super) grade: f64,
    /// Largest rise across the road, by its superelevation and its shape together at most, as a fraction of the width.
    pub(super) crossfall: f64,
    /// Heights of its reference line; none where the map says nothing of them.
    pub(super) elevation: Vec<Cubic>,
}

/// The record that holds at `s` of those sorted by `start`: the last that begins at or before it, or the first.
pub(super) fn active<T>(records: &[T], s: f64, start: impl Fn(&T) -> f64) -> Option<&T> {
    let after = records.partition_point(|record| start(record) <= s);
    records.get(after.saturating_sub(1))
}

/// Which form a piece of the reference line has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    Line,
    /// The arc's curvature, left positive (1/m).
    Arc(f64),
    /// Curvature at the spiral's beginning and at its end, linear between (1/m).
    Spiral(f64, f64),
    /// v as a cubic of u, in the frame of its beginning.
    Poly3([f64; 4]),
    /// u and v as cubics of a parameter, which runs from 0 to 1 if `normalised`, else to the length.
    ParamPoly3 {
        u: [f64; 4],
        v: [f64; 4],
        normalised: bool,
    },
}

/// A piece of a reference line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Geometry {
    /// Station of the piece's beginning (m).
    pub(super) start: f64,
    /// The piece's beginning (m).
    pub(super) origin: DVec2,
    /// Direction at the beginning (rad).
    pub(super) heading: f64,
    /// The piece's length (m).
    pub(super) length: f64,
    pub(super) shape: Shape,
}

/// What a lane is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Vehicles drive on it.
    Lane,
    /// Level with the lanes: shoulders, stops, parking, cycle tracks.
    Flat,
    /// A kerb's strip.
    Kerb,
    /// Walks, medians, borders: solid unless a lane lies on them.
    Solid,
    /// One of these that trucks have access to: solid to a tractor, drivable to its trailer.
    Apron,
    /// Nothing is known of it.
    Nothing,
}

impl Kind {
    /// What a lane of this type is for; `None` if the type is not known.
    pub(super) fn named(name: &str) -> Option<Kind> {
        Some(match name {
            "driving" | "bidirectional" | "entry" | "exit" | "onRamp" | "offRamp" | "connectingRamp" | "slipLane"
            | "bus" | "taxi" | "HOV" | "mwyEntry" | "mwyExit" => Kind::Lane,
            "shoulder" | "stop" | "parking" | "biking" => Kind::Flat,
            "curb" => Kind::Kerb,
            "sidewalk" | "walking" | "median" | "border" | "restricted" => Kind::Solid,
            "none" | "tram" | "rail" | "roadWorks" => Kind::Nothing,
            _ => return None,
        })
    }
}

/// Height of a lane above the road from `start` on, counted from the section's beginning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Height {
    pub(super) start: f64,
    /// The greater of the inner and the outer edge's (m).
    pub(super) height: f64,
}

/// A lane of a section.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Lane {
    /// Positive left of the reference line, negative right of it; never 0.
    pub(super) id: i32,
    pub(super) kind: Kind,
    /// Whether the lane is travelled against its side's direction.
    pub(super) reversed: bool,
    /// Widths, or distances of its outer border from the reference line if `bordered`; starts count from the section's.
    pub(super) widths: Vec<Cubic>,
    pub(super) bordered: bool,
    pub(super) heights: Vec<Height>,
    /// The lane that it continues in the previous section or road.
    pub(super) predecessor: Option<i32>,
    /// The lane that continues it in the next section or road.
    pub(super) successor: Option<i32>,
}

/// A stretch of a road with the same lanes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Section {
    /// Station of the section's beginning (m).
    pub(super) start: f64,
    /// Lanes from left to right, the centre lane left out.
    pub(super) lanes: Vec<Lane>,
}

/// What a road's beginning or end leads to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Link {
    /// A road's beginning (`true`) or end.
    RoadRecord(String, bool),
    Junction(String),
}

/// An object's outline that is solid: a traffic island.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Island {
    /// The island's corners in the map (m).
    pub(super) corners: Vec<DVec2>,
}

/// A road.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RoadRecord {
    pub(super) id: String,
    /// Length of its reference line (m).
    pub(super) length: f64,
    /// The junction that it is a part of.
    pub(super) junction: Option<String>,
    pub(super) predecessor: Option<Link>,
    pub(super) successor: Option<Link>,
    pub(super) plan: Vec<Geometry>,
    pub(super) offsets: Vec<Cubic>,
    pub(super) sections: Vec<Section>,
    pub(super) islands: Vec<Island>,
    /// How far it is from level.
    pub(super) level: Level,
}

impl RoadRecord {
    /// How far the lanes are moved to the left of the reference line at a station: not before the first record (m).
    pub(super) fn offset_at(&self, s: f64) -> f64 {
        let before = active(&self.offsets, s, |offset| offset.start).filter(|offset| offset.start <= s);
        before.map_or(0.0, |offset| offset.at(s))
    }

    /// Height of the reference line at a station (m).
    pub(super) fn height(&self, s: f64) -> f64 {
        active(&self.level.elevation, s, |elevation| elevation.start).map_or(0.0, |elevation| elevation.at(s))
    }

    /// Station where a section ends (m).
    pub(super) fn section_end(&self, section: usize) -> f64 {
        self.sections.get(section + 1).map_or(self.length, |next| next.start)
    }
}

/// A way through a junction.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Connection {
    pub(super) incoming: String,
    pub(super) connecting: String,
    /// Whether the connecting road is entered at its beginning.
    pub(super) at_start: bool,
    /// Lane of the incoming road, lane of the connecting one.
    pub(super) lanes: Vec<(i32, i32)>,
    /// Whether the connecting road leads on from the junction, rather than through it.
    pub(super) direct: bool,
}

/// Whom a warning of a file concerns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Concerns {
    /// Who reads the whole map. Of a place the same is found where it is imported, or it does not matter there.
    Map,
    /// Who imports a place with the road of this id, too.
    Road(String),
    /// Who imports any place, too.
    EveryPlace,
}

/// What is odd in a file, and what was done about it.
#[derive(Debug, Clone)]
pub(super) struct Warning {
    pub(super) concerns: Concerns,
    pub(super) text: String,
}

impl Warning {
    /// One that concerns who reads the whole map.
    pub(super) fn of_map(text: String) -> Warning {
        Warning { concerns: Concerns::Map, text }
    }
}

/// A map.
#[derive(Debug, Clone, Default)]
pub(super) struct Records {
    pub(super) roads: Vec<RoadRecord>,
    /// Index of a road by its id.
    pub(super) by_id: HashMap<String, usize>,
    /// Connections of a junction by its id.
    pub(super) junctions: HashMap<String, Vec<Connection>>,
    /// Whether the map has left-hand traffic, so that the records are its mirror image.
    pub(super) mirrored: bool,
    /// By what its header moves the map, which is not done: x, y and z (m), then a turn (rad). None if by nothing.
    pub(super) offset: Option<[f64; 4]>,
    /// Lane types that are not known, with their numbers of lanes.
    pub(super) unknown_types: BTreeMap<String, usize>,
    /// What is odd in the file, and what was done about it.
    pub(super) warnings: Vec<Warning>,
}
