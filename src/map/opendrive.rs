//! Roundabouts from OpenDRIVE maps: reads a `.xodr` file, finds the rings in it, and makes one of them a
//! [`Ground`](crate::map::ground::Ground).
//!
//! XML becomes records, records become strips of lanes, strips a directed graph and a surface. A ring is a hole in that
//! surface with traffic around it. All coordinates are moved to the ring's centre before anything is rounded.

mod records; // what the file says
mod xml; // elements and attributes
mod encoding; // bytes -> text
mod source; // a document that is being read
mod read; // XML -> records
mod plan; // reference lines
mod sections; // lane sections
mod level; // grades and crossfall
mod whole; // what is seen once all was read
mod mirror; // left-hand traffic -> right-hand traffic
mod objects; // traffic islands given as objects
mod reference_line; // points and headings along a road
mod lanes; // lanes as strips
mod links; // what the file says of lanes that follow
mod graph; // which lane leads into which
mod cells; // things near a point
mod surface; // what can be driven on
mod rings; // where the roundabouts are
mod crossings; // lanes in and out of a ring, arms
mod paths; // ways through a ring
mod bypass; // lanes that pass beside a ring
mod lines; // ways -> routes
mod surroundings; // a map around a point
mod bridges; // roads above others
mod build; // a ring as a `Ground`
mod junction; // ways through a junction as a `Ground`
mod export; // a road as a map

use std::path::Path;

use glam::DVec2;

use crate::files::reader::{Error, Reader, read_bytes};
pub use build::{Imported, Options};
pub use export::exported;
use graph::Graph;
pub use junction::{Junction, RoadLane, Way};
use lanes::Strip;
use records::{Concerns, Records, Warning};
pub use rings::{Refused, Ring};

/// Which hand of traffic a map has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Hand {
    /// What the map itself says; right where it says nothing.
    #[default]
    Map,
    /// Right, whatever the map says.
    Right,
    /// Left, whatever the map says.
    Left,
}

/// Chords of lanes leave their curves by at most this much where rings are looked for (m).
const COARSE: f64 = 0.02;
/// Chords of routes' centre lines leave their curves by at most this much before arcs are fitted; headings matter
/// too (m).
const FINEST: f64 = 1e-4;

/// A map that was read.
#[derive(Debug)]
pub struct Map {
    file: std::path::PathBuf,
    records: Records,
    strips: Vec<Strip>,
    graph: Graph,
    rings: Vec<Ring>,
    refused: Vec<Refused>,
}

impl Map {
    /// Reads a map of at most 256 MiB and finds its rings.
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is no OpenDRIVE map, or a value that makes no sense, with road, lane and line.
    /// What is only odd is a warning.
    pub fn read(file: &Path, hand: Hand) -> Result<Map, Error> {
        Map::from_bytes(file, read_bytes(file, read::FILE_LIMIT)?, hand)
    }

    /// Reads a map from the file's bytes and finds its rings; `file` names the map in errors.
    ///
    /// # Errors
    ///
    /// The errors of [`Map::read`] but for files that cannot be read.
    pub fn from_bytes(file: &Path, bytes: Vec<u8>, hand: Hand) -> Result<Map, Error> {
        Map::parse(file, &encoding::text(file, bytes)?, hand)
    }

    /// Reads a map from the file's text and finds its rings; `file` names the map in errors.
    ///
    /// # Errors
    ///
    /// The errors of [`Map::read`] but for files that cannot be read.
    pub fn parse(file: &Path, text: &str, hand: Hand) -> Result<Map, Error> {
        let mut records = read::records(file, text, hand)?;
        let against = records.against_hand();
        records.warnings.extend(against.map(|text| Warning { concerns: Concerns::EveryPlace, text }));
        let strips = lanes::strips(&records, COARSE).map_err(|_| {
            let expected = "must be fewer: cut the map down to the roads around the roundabout";
            Reader::of(file).invalid("road", "more than 2000 km or 10 million points of lanes", expected)
        })?;
        let graph = Graph::new(&records, &strips);
        let (rings, refused) = rings::rings(&records, &strips, &graph);
        Ok(Map { file: file.to_owned(), records, strips, graph, rings, refused })
    }

    /// The map's roundabouts, the largest first.
    pub fn rings(&self) -> Vec<Ring> {
        self.rings.iter().map(|ring| Ring { centre: self.outside(ring.centre), ..*ring }).collect()
    }

    /// Holes in the paved surface that are no roundabouts, the largest first.
    pub fn refused(&self) -> Vec<Refused> {
        self.refused.iter().map(|refused| Refused { centre: self.outside(refused.centre), ..refused.clone() }).collect()
    }

    /// What is odd in the file, and what was done about it.
    pub fn warnings(&self) -> impl Iterator<Item = &str> {
        self.records.warnings.iter().chain(&self.graph.warnings).map(|warning| warning.text.as_str())
    }

    /// Which roads pass above others, and how far: a level map paves both.
    pub fn bridges(&self) -> Vec<String> {
        bridges::bridges(&self.records, self.strips.iter().filter(|strip| strip.is_driven()))
    }

    /// By what its header moves the map, x, y and z (m), then a turn (rad), where that is not nothing. It is not done:
    /// all coordinates are the file's.
    pub fn header_offset(&self) -> Option<[f64; 4]> {
        self.records.offset
    }

    /// Whether the map has left-hand traffic: what is imported from it is its mirror image in the x axis.
    pub fn is_mirrored(&self) -> bool {
        self.records.mirrored
    }

    /// Number of roads.
    pub fn n_roads(&self) -> usize {
        self.records.roads.len()
    }

    /// The ring whose centre is nearest to a point of the map (m).
    ///
    /// # Errors
    ///
    /// A map without a ring.
    pub fn nearest(&self, p: DVec2) -> Result<Ring, Error> {
        let distance = |ring: &Ring| ring.centre.distance(p);
        let nearest = self.rings().into_iter().min_by(|one, other| distance(one).total_cmp(&distance(other)));
        nearest.ok_or_else(|| {
            let (roads, holes) = (self.n_roads(), self.refused.len());
            let mut expected = format!(
                "no roundabout here: {roads} roads around {holes} islands and blocks, none of them a circle \
                         with one-way traffic around it: `--check` says what each lacks"
            );
            // One that a road passes above is paved over.
            if let Some(bridge) = self.bridges().first() {
                expected += &format!("; {bridge}: a map without that road would do");
            }
            Reader::of(&self.file).invalid("ring", format_args!("({:.1}, {:.1})", p.x, p.y), expected)
        })
    }

    /// One of the map's rings with its arms and routes.
    ///
    /// # Errors
    ///
    /// A ring that no truck could be sent through: without arms, or without a way from one to another.
    pub fn ground(&self, ring: &Ring, options: &Options) -> Result<Imported, Error> {
        build::ground(self, &Ring { centre: self.outside(ring.centre), ..*ring }, options)
    }

    /// A point of the records in the map's own coordinates, or the other way round.
    fn outside(&self, p: DVec2) -> DVec2 {
        if self.records.mirrored { DVec2::new(p.x, -p.y) } else { p }
    }
}
