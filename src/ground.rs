//! What a road is for everything behind it: kerb faces, lane edges, arms and routes around one ring.
//!
//! A roundabout by parameters and one imported from a map both give a [`Ground`]. The ring's centre is the origin, and
//! traffic keeps to the right.

mod outline_file;

use crate::geometry::{Curve, Outline};
use crate::route::Lane;

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
#[derive(Debug, Clone)]
pub enum Edges {
    /// This far from the kerb faces everywhere \[m].
    Beside(f64),
    /// On outlines of their own.
    Own(Outline),
}

/// A road that leads to the ring.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// Its name, a part of the names of its routes.
    pub name: String,
    /// Direction in which it leaves the ring, counter-clockwise from east \[rad].
    pub bearing: f64,
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
    /// Its centre line.
    pub line: Curve,
    /// Reach of a crossing line from the centre line to its left and to its right, over all lanes of the ring \[m].
    pub crossing: (f64, f64),
    /// Widths of its lane: on the entry arm, in the ring, on the exit arm \[m].
    pub widths: [f64; 3],
}

/// A ring with its arms, ready to be driven on.
#[derive(Debug, Clone)]
pub struct Ground {
    /// Radius of the central island's kerb face; 0 where there is no ring but a junction \[m].
    pub island_radius: f64,
    /// Radius of the ring's outer kerb face, or of the circle around the junction; approaches and departures are measured from this circle \[m].
    pub outer_radius: f64,
    /// Radii of the centre lines of the ring's lanes, the innermost first; none in a junction \[m].
    pub lane_radii: Vec<f64>,
    /// The arms, counter-clockwise.
    pub arms: Vec<Arm>,
    /// The kerb faces.
    pub faces: Outline,
    /// What each loop of the faces belongs to.
    pub kerbs: Vec<Kerb>,
    /// The edges of the lanes.
    pub edges: Edges,
    /// The centre lines of all lanes, to be shown.
    pub lanes: Vec<Curve>,
    /// Every route, ordered by entry arm, lane and exit.
    pub lines: Vec<Line>,
}
