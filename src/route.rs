//! A way through a roundabout: the centre line of its lanes, and waypoints along it.
//!
//! An entry lane keeps its index through the ring and out: left in, inner lane around, left out.

use glam::DVec2;

use crate::geometry::Curve;
use crate::reader::shown;

/// Which of the two lanes of a carriageway, seen in the direction of travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Lane {
    /// The lane beside the splitter island; leads into the inner lane of the ring.
    Left,
    /// The lane beside the kerb; leads into the outer lane of the ring.
    Right,
}

impl Lane {
    /// Both lanes, left first.
    pub const BOTH: [Lane; 2] = [Lane::Left, Lane::Right];

    /// As it stands in a route's name.
    pub fn name(self) -> &'static str {
        match self {
            Lane::Left => "left",
            Lane::Right => "right",
        }
    }
}

/// A point to be passed, and the direction in which to pass it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// On the centre line [m].
    pub position: DVec2,
    /// Of the centre line there, in (-pi, pi] [rad].
    pub heading: f64,
}

/// One way through a roundabout.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// Roundabout, entry arm, lane and exit number: `20m/N-left-3`.
    pub name: String,
    /// The arm it enters from, in the order of the roundabout's file.
    pub entry: usize,
    /// The lane it keeps all along.
    pub lane: Lane,
    /// Exit number, counted counter-clockwise from the entry; the number of arms is a U-turn.
    pub exit: u32,
    /// Approach lane, entry curve, ring arc, exit curve, departure lane; tangent-continuous.
    pub centre_line: Curve,
    /// Points along the centre line at the spacing asked for; the first is its beginning, the last its end, and only the last two may be
    /// nearer to each other.
    pub waypoints: Vec<Waypoint>,
    /// How far the crossing line of a waypoint reaches to the left and to the right of it, covering both lanes of the carriageway [m].
    pub crossing: (f64, f64),
    /// Length of lane between the entry arm's end and the route's beginning [m].
    pub before: f64,
    /// Length of lane between the route's end and the exit arm's end [m].
    pub after: f64,
}

/// A route that would begin or end beyond the end of its arm.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{part} of {} m leaves arm {arm} of {roundabout}; at most {} m fit", shown(*asked), (longest * 100.0).floor() / 100.0)]
pub struct LeavesWorld {
    /// `approach` or `departure`.
    pub part: &'static str,
    /// The length asked for [m].
    pub asked: f64,
    /// The longest that fits on this arm [m].
    pub longest: f64,
    /// The arm's name.
    pub arm: String,
    /// The roundabout's name.
    pub roundabout: String,
}

/// Waypoints every `spacing` metres along `centre_line`, from its beginning to its end.
pub fn waypoints(centre_line: &Curve, spacing: f64) -> Vec<Waypoint> {
    let length = centre_line.length();
    // A remainder below a millimetre is rounding, not one more waypoint.
    let whole = ((length - 1e-3) / spacing).floor() as usize;
    let stations = (0..=whole).map(|index| index as f64 * spacing).chain([length]);
    stations.map(|s| Waypoint { position: centre_line.point_at(s), heading: centre_line.heading_at(s) }).collect()
}
