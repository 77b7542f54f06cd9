//! A roundabout by its parameters: ring, arms, kerbs, lanes and splitter islands, as arcs and segments.
//!
//! Traffic around an island at the origin; left-hand traffic is driven as its mirror image. Parameters that describe no
//! roundabout are refused when the file is read, so the kerbs and lanes of a [`Roundabout`] never fail.

mod alignment;
mod check;
mod corner;
mod ends; // arms prolonged
mod gutter; // widths that differ
mod hand; // left-hand traffic
mod kerb;
mod lane;
pub mod map; // a ring of a map
mod ring;
mod roundabout_keys;
#[cfg(test)]
mod tests;
mod text;

/// A roundabout as a file has it.
pub(crate) mod written {
    pub(crate) use super::corner::WrittenCorner;
    pub(crate) use super::roundabout_keys::{Written, WrittenAlignment, WrittenArm, WrittenPoint, WrittenRing, WrittenWay};
}

use std::f64::consts::TAU;
use std::path::Path;

use glam::DVec2;

use crate::files::reader::{Error, Reader};
use crate::files::shipped::{Kind, Source};
use crate::geometry::{Curve, Outline};
pub use crate::map::ground::Kerb;
use crate::map::ground::{self, Edges, Ground, Line};
use crate::map::route::{Lane, LeavesWorld, Route, waypoints};
use lane::{Lanes, RouteLine};
use ring::Ring;
use roundabout_keys::{Arm, Written};

/// Whether trucks may drive on the gutter, the strip between the lanes and the kerb.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Gutter {
    /// The kerb's face is solid; the gutter is road.
    #[default]
    Drivable,
    /// The lane's edge is solid: kerbs are grown by the gutter's width.
    Solid,
}

/// Stages of the check of a roundabout, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stage {
    /// Single values, and the order of the arms.
    Values,
    /// Kerbs that fit and do not cross, splitter islands on the road.
    Kerbs,
    /// Lanes that lead into the ring, and routes that follow it.
    Lanes,
    /// Lanes clear of kerbs.
    Clear,
    /// Lanes of an arm beside each other.
    Beside,
}

/// A checked roundabout.
#[derive(Debug, Clone, PartialEq)]
pub struct Roundabout {
    /// The file's stem, `20m`.
    pub name: String,
    ground: Ground,
}

impl Roundabout {
    /// Reads a roundabout file. Every fault that a roundabout can have is found here.
    ///
    /// # Errors
    ///
    /// The file and, for a value that makes no sense, its key, the value and what would do.
    pub fn read(path: &Path) -> Result<Roundabout, Error> {
        Roundabout::from_source(&Source::Disk(path.to_owned()))
    }

    /// A roundabout that comes with the library: `16m`, `20m`, `32m`, `40m` or `50m`.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`], which lists the known names.
    pub fn named(name: &str) -> Result<Roundabout, Error> {
        Roundabout::from_source(&Source::named(Kind::Roundabout, name)?)
    }

    /// Reads a file where `name_or_path` ends in `.toml` or is the path of a file: parameters, an outline
    /// (`.outline.toml`), or an OpenDRIVE map with one ring (`.xodr`); else the same as [`Roundabout::named`].
    ///
    /// # Errors
    ///
    /// Those of [`Roundabout::read`] and [`Roundabout::named`].
    pub fn find(name_or_path: &str) -> Result<Roundabout, Error> {
        Roundabout::from_source(&Source::find(Kind::Roundabout, name_or_path)?)
    }

    /// A roundabout from the text of a roundabout file. `name` is its name, and stands for the file in errors.
    ///
    /// # Errors
    ///
    /// Those of [`Roundabout::read`].
    pub fn from_toml(name: &str, text: &str) -> Result<Roundabout, Error> {
        Roundabout::parsed(name.to_owned(), Path::new(name), text)
    }

    pub(crate) fn from_source(source: &Source) -> Result<Roundabout, Error> {
        if let Source::Disk(file) = source
            && map::is_map(file)
        {
            return Roundabout::from_map(file, &map::Choice::default());
        }
        let (name, file) = (source.stem(), source.shown());
        match name.strip_suffix(".outline") {
            Some(name) => Ok(Roundabout::on(name.to_owned(), Ground::parse(&file, &source.text()?)?)),
            None => Roundabout::parsed(name, &file, &source.text()?),
        }
    }

    fn parsed(name: String, file: &Path, text: &str) -> Result<Roundabout, Error> {
        let (reader, written) = Reader::parse::<Written>(file, text)?;
        Roundabout::checked(name, reader, written)
    }

    /// The roundabout that `written` describes, checked as a file is; `reader` names its origin in errors.
    pub(crate) fn checked(name: String, reader: Reader, written: Written) -> Result<Roundabout, Error> {
        Roundabout::staged(name, reader, written).map_err(|(_, error)| error)
    }

    /// The same; an error says in which stage of the check it was found.
    pub(crate) fn staged(name: String, reader: Reader, written: Written) -> Result<Roundabout, (Stage, Error)> {
        if written.is_left_hand() {
            let roundabout = Roundabout::staged(name, reader, written.mirrored());
            return roundabout
                .map(|Roundabout { name, ground }| Roundabout { name, ground: Ground { mirrored: true, ..ground } })
                .map_err(|(stage, error)| (stage, hand::as_written(error)));
        }
        let at = |stage: Stage| move |error: Error| (stage, error);
        let gutters = written.gutters(&reader).map_err(at(Stage::Values))?;
        let (ring, arms) = written.checked(&reader).map_err(at(Stage::Values))?;
        let (kerbs, corners) = kerb::kerbs(&reader, &ring, &arms).map_err(at(Stage::Kerbs))?;
        let lanes = Lanes::new(&reader, &ring, &arms).map_err(at(Stage::Lanes))?;
        check::lanes_clear_of_kerbs(&reader, &kerbs, &arms, &lanes).map_err(at(Stage::Clear))?;
        check::lanes_beside_each_other(&reader, &arms, &lanes).map_err(at(Stage::Beside))?;
        let edges = match gutters {
            Some(gutters) => Edges::Own(gutters.edges(&reader, &ring, &kerbs, &corners).map_err(at(Stage::Clear))?),
            None => Edges::Beside(ring.gutter),
        };
        Ok(Roundabout { name, ground: ground(&ring, &arms, kerbs, edges, &lanes) })
    }

    /// A roundabout by what is driven on, from a map.
    pub fn on(name: String, ground: Ground) -> Roundabout {
        Roundabout { name, ground }
    }

    /// What is driven on.
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    /// The names of the arms in the order of the file: counter-clockwise, clockwise in left-hand traffic.
    pub fn arms(&self) -> impl Iterator<Item = &str> {
        self.ground.arms.iter().map(|arm| arm.name.as_str())
    }

    /// Least angle between the bearings of two neighbouring arms \[rad].
    pub fn least_gap(&self) -> f64 {
        let arms = &self.ground.arms;
        let next = arms.iter().cycle().skip(1);
        arms.iter().zip(next).map(|(arm, next)| (next.bearing - arm.bearing).rem_euclid(TAU)).fold(TAU, f64::min)
    }

    /// Whether its lanes go round a central island; a crossing has none.
    pub fn has_ring(&self) -> bool {
        0.0 < self.ground.island_radius
    }

    /// Name of what lies between its arms: "ring", or "junction" on a crossing.
    pub fn between_arms(&self) -> &'static str {
        if self.has_ring() { "ring" } else { "junction" }
    }

    /// Radius of the central island's kerb face; 0 on a crossing \[m].
    pub fn island_radius(&self) -> f64 {
        self.ground.island_radius
    }

    /// Width of the strip between a kerb's face and the lane beside it; 0 where it is not the same everywhere \[m].
    pub fn gutter(&self) -> f64 {
        match self.ground.edges {
            Edges::Beside(gutter) => gutter,
            Edges::Own(_) => 0.0,
        }
    }

    /// Radius of the outer kerb's face; approaches and departures are measured from this circle \[m].
    pub fn outer_radius(&self) -> f64 {
        self.ground.outer_radius
    }

    /// Radii of the centre lines of the ring's lanes, the innermost first \[m].
    pub fn lane_radii(&self) -> Vec<f64> {
        self.ground.lane_radii.clone()
    }

    /// The edge of the drivable surface.
    pub fn kerbs(&self, gutter: Gutter) -> Outline {
        match (gutter, &self.ground.edges) {
            (Gutter::Drivable, _) => self.ground.faces.clone(),
            (Gutter::Solid, Edges::Beside(gutter)) => self.ground.faces.offset(*gutter),
            (Gutter::Solid, Edges::Own(edges)) => edges.clone(),
        }
    }

    /// The kerb whose face is nearest to `p`.
    pub fn nearest_kerb(&self, p: DVec2) -> Kerb {
        let all = self.ground.kerbs.iter().zip(&self.ground.faces.loops).map(|(&kerb, face)| (face.distance(p), kerb));
        all.fold((f64::INFINITY, Kerb::Outer), |best, other| if other.0 < best.0 { other } else { best }).1
    }

    /// Widths of a route's lane: on the entry arm, in the ring, on the exit arm \[m].
    pub fn lane_widths(&self, route: &Route) -> [f64; 3] {
        self.line_of(route).map_or([0.0; 3], |line| line.widths)
    }

    /// Index of the arm that a route leaves by.
    pub fn exit_arm(&self, route: &Route) -> usize {
        self.line_of(route).map_or((route.entry + route.exit as usize) % self.ground.arms.len(), |line| line.exit_arm)
    }

    fn line_of(&self, route: &Route) -> Option<&Line> {
        self.ground.lines.iter().find(|line| (line.entry, line.lane, line.exit) == (route.entry, route.lane, route.exit))
    }

    /// The centre lines of all lanes: those around the ring, the innermost first, then for every arm those that enter,
    /// then for every arm those that leave, the left one first.
    pub fn lanes(&self) -> Vec<Curve> {
        self.ground.lanes.clone()
    }

    /// The centre line of a route from the end of its entry arm to the end of its exit arm, or `None` if there is no
    /// such route.
    pub fn line(&self, entry: &str, lane: Lane, exit: u32) -> Option<Curve> {
        let entry = self.arms().position(|arm| arm == entry)?;
        let line = self.ground.lines.iter().find(|line| (line.entry, line.lane, line.exit) == (entry, lane, exit));
        line.map(|line| line.line.clone())
    }

    /// All routes, ordered by entry arm, lane and exit. They lead from `approach` before the ring to `departure` after
    /// it, with waypoints every `spacing` \[m].
    ///
    /// # Errors
    ///
    /// An arm that is too short, with the longest approach or departure that fits.
    pub fn routes(&self, approach: f64, departure: f64, spacing: f64) -> Result<Vec<Route>, LeavesWorld> {
        let mut routes = Vec::new();
        for &Line { entry, lane, exit, exit_arm, ref line, crossing, ref ends, .. } in &self.ground.lines {
            let (arm, exit_arm) = (&self.ground.arms[entry], &self.ground.arms[exit_arm]);
            let leaves = |part, asked, longest, arm: &ground::Arm, end: &Option<String>| {
                let (arm, roundabout, reason) = (arm.name.clone(), self.name.clone(), end.clone());
                Err(LeavesWorld { part, asked, longest, arm, roundabout, reason })
            };
            let (reaches, left) = lane::ring_stations(line, self.ground.outer_radius);
            let after = line.length() - left;
            if reaches < approach {
                return leaves("approach", approach, reaches, arm, &ends[0]);
            }
            if after < departure {
                return leaves("departure", departure, after, exit_arm, &ends[1]);
            }
            let centre_line = line.part(reaches - approach, left + departure);
            routes.push(Route {
                name: format!("{}/{}-{}-{exit}", self.name, arm.name, lane.seen(self.is_mirrored()).name()),
                entry,
                lane,
                exit,
                waypoints: waypoints(&centre_line, spacing),
                centre_line,
                crossing,
                before: reaches - approach,
                after: after - departure,
            });
        }
        Ok(routes)
    }
}

/// What is driven on, from checked parameters.
fn ground(ring: &Ring, arms: &[Arm], kerbs: Outline, edges: Edges, lanes: &Lanes) -> Ground {
    let lane_radii: Vec<f64> = (0..ring.lanes).rev().map(|from_kerb| ring.lane_radius(from_kerb)).collect();
    let rings = lane_radii.iter().map(|&radius| Curve::circle(DVec2::ZERO, radius));
    let line = |&RouteLine { entry, lane, exit, ref line }: &RouteLine| {
        let exit_arm = (entry + exit as usize) % arms.len();
        let widths = [arms[entry].lane_width, ring.lane_width, arms[exit_arm].lane_width];
        Line { entry, lane, exit, exit_arm, line: line.clone(), crossing: ring.crossing(lane), widths, ends: [None, None] }
    };
    Ground {
        mirrored: false,
        island_radius: ring.island_radius,
        outer_radius: ring.outer(),
        lanes: rings.chain(lanes.curves().cloned()).collect(),
        lane_radii,
        arms: arms.iter().map(|arm| ground::Arm { name: arm.name.clone(), bearing: arm.bearing }).collect(),
        faces: kerbs,
        kerbs: kerb::order(arms).collect(),
        edges,
        lines: lanes.routes().iter().map(line).collect(),
    }
}
