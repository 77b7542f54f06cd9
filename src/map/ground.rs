//! What a road is for everything behind it: kerb faces, lane edges, arms and routes around one ring.
//!
//! A roundabout by parameters and one imported from a map both give a [`Ground`]. The ring's centre is the origin, and
//! traffic keeps to the right: a road with left-hand traffic is driven as its mirror image in the x axis, and mirrored
//! back where it is shown.

mod outline_file;

use glam::DVec2;

use super::frame::Frame;
use super::parametric::lane::ring_stations;
use crate::geometry::{Curve, Outline};
use crate::map::route::Lane;

/// The hand of traffic that a file says its road has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Hand {
    /// Traffic keeps to the right.
    #[default]
    Right,
    /// Traffic keeps to the left.
    Left,
}

/// What a kerb belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kerb {
    /// The outer boundary: from arm to arm, and the arms' ends.
    Outer,
    /// The central island.
    Island,
    /// The splitter island of the arm with this index.
    Splitter(usize),
}

/// Where the lanes' edges lie.
#[derive(Debug, Clone, PartialEq)]
pub enum Edges {
    /// Distance of the edges from the kerb faces, the same everywhere (m).
    Beside(f64),
    /// Outlines on which the edges lie.
    Own(Outline),
}

/// A road that leads to the ring.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// The arm's name, a part of the names of its routes.
    pub name: String,
    /// Direction in which it leaves the ring, counter-clockwise from east (rad).
    pub bearing: f64,
}

impl Arm {
    /// What its name must be.
    pub(super) const NAMES: &str =
        "1 to 20 letters and digits, and neither outer nor island: routes and kerbs are named after arms";

    /// Whether it may have this name.
    pub(super) fn may_be_named(name: &str) -> bool {
        (1..=20).contains(&name.len())
            && name.chars().all(|c| c.is_ascii_alphanumeric())
            && !["outer", "island"].contains(&name)
    }
}

/// A route from the end of its entry arm to the end of its exit arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Index of the entry arm.
    pub entry: usize,
    /// The lane it keeps.
    pub lane: Lane,
    /// Exit number, counted counter-clockwise from the entry; the last is a U-turn.
    pub exit: u32,
    /// Index of the exit arm.
    pub exit_arm: usize,
    /// The route's centre line.
    pub line: Curve,
    /// Reach of a crossing line from the centre line to its left and to its right, over all lanes of the ring (m).
    pub crossing: (f64, f64),
    /// Widths of the route's lane: on the entry arm, in the ring, on the exit arm (m).
    pub widths: [f64; 3],
    /// Why the route begins, and why it ends, before the world does, as the map that it is from has it.
    pub ends: [Option<String>; 2],
}

/// A ring with its arms, ready to be driven on.
#[derive(Debug, Clone, PartialEq)]
pub struct Ground {
    /// Whether the road itself has left-hand traffic: all that follows is its mirror image in the x axis.
    pub mirrored: bool,
    /// The origin of all that follows, in the frame of the map that the road is from; 0 where it is from none (m).
    pub origin: DVec2,
    /// Radius of the central island's kerb face; 0 where there is no ring but a junction (m).
    pub island_radius: f64,
    /// Radius of the ring's outer kerb face, or of the circle around the junction; approaches and departures are
    /// measured from this circle (m).
    pub outer_radius: f64,
    /// Radii of the centre lines of the ring's lanes, the innermost first; none in a junction (m).
    pub lane_radii: Vec<f64>,
    /// The arms, counter-clockwise.
    pub arms: Vec<Arm>,
    /// The kerb faces.
    pub faces: Outline,
    /// What each loop of the faces belongs to.
    pub kerbs: Vec<Kerb>,
    /// The edges of the lanes.
    pub edges: Edges,
    /// The inner edges of aprons, each within the face of its island: a trailer may drive up to there.
    pub aprons: Vec<Curve>,
    /// The centre lines of all lanes, to be shown.
    pub lanes: Vec<Curve>,
    /// Every route, ordered by entry arm, lane and exit.
    pub lines: Vec<Line>,
}

impl Ground {
    /// Distance of a point of the road from the nearest gutter or, where there is none, kerb face; 0 or less on a
    /// gutter and off the road (m).
    pub(super) fn to_gutter(&self, p: DVec2) -> f64 {
        match &self.edges {
            Edges::Beside(width) => self.faces.signed_distance(p) - width,
            Edges::Own(edges) => edges.signed_distance(p),
        }
    }

    /// Where what is driven lies in the map that the road is from.
    pub fn frame(&self) -> Frame {
        Frame { origin: self.origin, mirrored: self.mirrored }
    }

    /// Stations at which a line enters and leaves the circle of the outer kerb; where it passes outside, twice that of
    /// its point nearest to the centre (m).
    pub fn ring_stations(&self, line: &Curve) -> (f64, f64) {
        ring_stations(line, self.outer_radius)
    }

    /// The road as it lies in the world: mirrored back where it has left-hand traffic. Lanes have the names that they
    /// have there; the arms stay in the order of travel, which is clockwise then.
    pub fn seen(&self) -> Ground {
        if !self.mirrored {
            return self.clone();
        }
        let outline = |outline: &Outline| Outline::new(outline.loops.iter().map(Curve::mirrored).collect());
        Ground {
            mirrored: false,
            arms: self.arms.iter().map(|arm| Arm { name: arm.name.clone(), bearing: -arm.bearing }).collect(),
            faces: outline(&self.faces),
            kerbs: self.kerbs.clone(),
            edges: match &self.edges {
                Edges::Beside(gutter) => Edges::Beside(*gutter),
                Edges::Own(edges) => Edges::Own(outline(edges)),
            },
            aprons: self.aprons.iter().map(Curve::mirrored).collect(),
            lanes: self.lanes.iter().map(Curve::mirrored).collect(),
            lines: self.lines.iter().map(Line::mirrored).collect(),
            lane_radii: self.lane_radii.clone(),
            ..*self
        }
    }
}

impl Line {
    fn mirrored(&self) -> Line {
        let (left, right) = self.crossing;
        Line { lane: self.lane.mirrored(), line: self.line.mirrored(), crossing: (right, left), ..self.clone() }
    }
}
