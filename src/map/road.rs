//! A road: its name and what is driven on, whether it came from parameters, from a map or was drawn at random.

use std::f64::consts::TAU;

use glam::DVec2;

use super::ground::{Edges, Ground, Kerb, Line};
use super::parametric::lane;
use super::route::{Lane, LeavesWorld, Route, waypoints};
use crate::geometry::{Curve, Outline};

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

/// Largest distance of a chord of a kerb from it (m).
const CHORD: f64 = 0.005;

/// A ring with its arms, or the ways through a junction, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Road {
    /// The file's stem, `20m`.
    pub name: String,
    pub(super) ground: Ground,
}

impl Road {
    /// A roundabout by what is driven on, from a map.
    pub fn on(name: String, ground: Ground) -> Road {
        Road { name, ground }
    }

    /// What is driven on.
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    /// The names of the arms in the order of the file: counter-clockwise, clockwise in left-hand traffic.
    pub fn arms(&self) -> impl Iterator<Item = &str> {
        self.ground.arms.iter().map(|arm| arm.name.as_str())
    }

    /// Least angle between the bearings of two neighbouring arms (rad).
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

    /// Radius of the central island's kerb face; 0 on a crossing (m).
    pub fn island_radius(&self) -> f64 {
        self.ground.island_radius
    }

    /// Width of the strip between a kerb's face and the lane beside it; 0 where it is not the same everywhere (m).
    pub fn gutter(&self) -> f64 {
        match self.ground.edges {
            Edges::Beside(gutter) => gutter,
            Edges::Own(_) => 0.0,
        }
    }

    /// Radius of the outer kerb's face; approaches and departures are measured from this circle (m).
    pub fn outer_radius(&self) -> f64 {
        self.ground.outer_radius
    }

    /// Radii of the centre lines of the ring's lanes, the innermost first (m).
    pub fn lane_radii(&self) -> Vec<f64> {
        self.ground.lane_radii.clone()
    }

    /// The edge of the drivable surface; aprons are behind it, see [`Road::unit_kerbs`].
    pub fn kerbs(&self, gutter: Gutter) -> Outline {
        match (gutter, &self.ground.edges) {
            (Gutter::Drivable, _) => self.ground.faces.clone(),
            (Gutter::Solid, Edges::Beside(gutter)) => self.ground.faces.offset(*gutter),
            (Gutter::Solid, Edges::Own(edges)) => edges.clone(),
        }
    }

    /// The edge of the drivable surface as closed lines in the frame of the map that the road is from, the drivable
    /// side on their left; chords leave the edge by at most 5 mm, and no line repeats its first point (m).
    pub fn kerb_lines(&self, gutter: Gutter) -> Vec<Vec<DVec2>> {
        let frame = self.ground.frame();
        let line = |curve: &Curve| {
            let mut points: Vec<DVec2> = curve.polyline(CHORD).into_iter().map(|p| frame.to_map(p)).collect();
            points.pop();
            if frame.mirrored {
                points.reverse();
            }
            points
        };
        self.kerbs(gutter).loops.iter().map(line).collect()
    }

    /// The kerb whose face is nearest to `p`, also behind an apron.
    pub fn nearest_kerb(&self, p: DVec2) -> Kerb {
        let all = self.ground.kerbs.iter().zip(&self.ground.faces.loops).map(|(&kerb, face)| (face.distance(p), kerb));
        all.fold((f64::INFINITY, Kerb::Outer), |best, other| if other.0 < best.0 { other } else { best }).1
    }

    /// Widths of a route's lane: on the entry arm, in the ring, on the exit arm (m).
    pub fn lane_widths(&self, route: &Route) -> [f64; 3] {
        self.line_of(route).map_or([0.0; 3], |line| line.widths)
    }

    /// Index of the arm that a route leaves by.
    pub fn exit_arm(&self, route: &Route) -> usize {
        self.line_of(route).map_or((route.entry + route.exit as usize) % self.ground.arms.len(), |line| line.exit_arm)
    }

    fn line_of(&self, route: &Route) -> Option<&Line> {
        self.ground
            .lines
            .iter()
            .find(|line| (line.entry, line.lane, line.exit) == (route.entry, route.lane, route.exit))
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
    /// it, with waypoints every `spacing` (m).
    ///
    /// # Errors
    ///
    /// An arm that is too short, with the longest approach or departure that fits.
    pub fn routes(&self, approach: f64, departure: f64, spacing: f64) -> Result<Vec<Route>, LeavesWorld> {
        let lines = &self.ground.lines;
        let stations = |line: &Line| lane::ring_stations(&line.line, self.ground.outer_radius);
        let stations: Vec<(f64, f64)> = lines.iter().map(stations).collect();
        for (part, asked, end) in [("approach", approach, 0), ("departure", departure, 1)] {
            // Where several are too short the shortest says what would do.
            let lengths = lines.iter().zip(&stations);
            let lengths = lengths.map(|(line, (reaches, left))| ([*reaches, line.line.length() - left][end], line));
            let Some((longest, line)) = lengths.min_by(|one, other| one.0.total_cmp(&other.0)) else { continue };
            if longest < asked {
                let arm = [line.entry, line.exit_arm][end];
                let (arm, roundabout) = (self.ground.arms[arm].name.clone(), self.name.clone());
                return Err(LeavesWorld { part, asked, longest, arm, roundabout, reason: line.ends[end].clone() });
            }
        }
        let mut routes = Vec::new();
        for (&Line { entry, lane, exit, ref line, crossing, .. }, &(reaches, left)) in lines.iter().zip(&stations) {
            let arm = &self.ground.arms[entry];
            let after = line.length() - left;
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

    /// Whether the road has left-hand traffic: it is driven as its mirror image in the x axis.
    pub fn is_mirrored(&self) -> bool {
        self.ground.mirrored
    }

    /// The roundabout as it lies in the world, for pictures and results: mirrored back where it has left-hand traffic.
    /// Routes have the same names; see [`Ground::seen`].
    pub fn seen(&self) -> Road {
        Road { name: self.name.clone(), ground: self.ground.seen() }
    }

    /// A route of this roundabout as it lies in the world.
    pub fn seen_route(&self, route: &Route) -> Route {
        if self.is_mirrored() { route.mirrored() } else { route.clone() }
    }
}
