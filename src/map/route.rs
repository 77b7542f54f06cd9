//! A route through a roundabout: the centre line of its lanes, and waypoints along it.
//!
//! A route keeps its lane, counted from the kerb on carriageways and ring alike; into an exit of one lane it leaves the
//! ring by that.

use glam::DVec2;

use crate::files::reader::shown;
use crate::geometry::Curve;

/// Whether a name means the route of this name: it is the route's own, its road's, or that of the distribution, or of
/// its seed, that the road was drawn from.
pub fn is_of(route: &str, name: &str) -> bool {
    route.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

/// A lane of a carriageway or of the ring, counted from the kerb.
///
/// Left and right are those of the world that is driven, where traffic keeps to the right. On a road with left-hand
/// traffic names of routes have the lane that a driver there would say: the one next to the kerb is `left`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Lane {
    /// The second from the kerb; an entry's leads into the second of the ring.
    Left,
    /// The first from the kerb; an entry's leads into the first of the ring.
    Right,
}

impl Lane {
    /// Both lanes, left first.
    pub const BOTH: [Lane; 2] = [Lane::Left, Lane::Right];

    /// The lane's part of a route's name.
    pub fn name(self) -> &'static str {
        match self {
            Lane::Left => "left",
            Lane::Right => "right",
        }
    }

    /// The lane's mirror image.
    pub fn mirrored(self) -> Lane {
        match self {
            Lane::Left => Lane::Right,
            Lane::Right => Lane::Left,
        }
    }

    /// The lane as it is called on a road that is driven as its mirror image, or as it is.
    pub fn seen(self, mirrored: bool) -> Lane {
        if mirrored { self.mirrored() } else { self }
    }

    /// Number of lanes between this one and the kerb: its index in lists of lanes.
    pub(crate) fn index(self) -> usize {
        match self {
            Lane::Left => 1,
            Lane::Right => 0,
        }
    }
}

/// A point of a route, and the route's direction there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// On the centre line (m).
    pub position: DVec2,
    /// Heading of the centre line, in (-pi, pi] (rad).
    pub heading: f64,
}

/// A route through a roundabout.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// Roundabout, entry arm, lane and exit number: `20m/N-left-3`.
    pub name: String,
    /// Index of the entry arm, in the order of the roundabout's file.
    pub entry: usize,
    /// The lane it keeps.
    pub lane: Lane,
    /// Exit number, counted in driving direction from the entry: counter-clockwise, clockwise in left-hand traffic; the
    /// number of arms is a U-turn.
    pub exit: u32,
    /// Approach lane, entry curve, ring arc, exit curve, departure lane; tangent-continuous.
    pub centre_line: Curve,
    /// Points along the centre line at the requested spacing, from its beginning to its end; only the last two may be
    /// nearer to each other.
    pub waypoints: Vec<Waypoint>,
    /// Reach of a waypoint's crossing line to its left and to its right; it covers all lanes of the ring (m).
    pub crossing: (f64, f64),
    /// Length of lane between the entry arm's end and the route's beginning (m).
    pub before: f64,
    /// Length of lane between the route's end and the exit arm's end (m).
    pub after: f64,
}

impl Route {
    /// The route's mirror image in the x axis, by the same name.
    pub fn mirrored(&self) -> Route {
        let (left, right) = self.crossing;
        let across = |w: &Waypoint| Waypoint { position: DVec2::new(w.position.x, -w.position.y), heading: -w.heading };
        Route {
            lane: self.lane.mirrored(),
            centre_line: self.centre_line.mirrored(),
            waypoints: self.waypoints.iter().map(across).collect(),
            crossing: (right, left),
            ..self.clone()
        }
    }
}

/// A route that would begin or end beyond the end of its arm.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "{part} of {} m leaves arm {arm} of {roundabout}; at most {} m fit{}",
    shown(*asked),
    (longest * 100.0).floor() / 100.0,
    reason.as_ref().map(|reason| format!(": {reason}")).unwrap_or_default()
)]
pub struct LeavesWorld {
    /// `approach` or `departure`.
    pub part: &'static str,
    /// The requested length (m).
    pub asked: f64,
    /// The largest length that fits on this arm (m).
    pub longest: f64,
    /// The arm's name.
    pub arm: String,
    /// The roundabout's name.
    pub roundabout: String,
    /// Why the arm's lanes end there, on a road from a map.
    pub reason: Option<String>,
}

/// Waypoints every `spacing` metres along `centre_line`, from its beginning to its end.
pub fn waypoints(centre_line: &Curve, spacing: f64) -> Vec<Waypoint> {
    let length = centre_line.length();
    // A remainder below a millimetre is rounding, not one more waypoint.
    let whole = ((length - 1e-3) / spacing).floor() as usize;
    let stations = (0..=whole).map(|index| index as f64 * spacing).chain([length]);
    stations.map(|s| Waypoint { position: centre_line.point_at(s), heading: centre_line.heading_at(s) }).collect()
}

#[cfg(test)]
mod tests {
    use super::is_of;

    #[test]
    fn a_route_goes_by_its_own_name_its_roads_and_that_of_what_the_road_was_drawn_from() {
        let of = |name: &str| is_of("wide/7/12/S-left-3", name);
        assert!(["wide/7/12/S-left-3", "wide/7/12", "wide/7", "wide"].into_iter().all(of));
        assert!(!["wide/7/1", "wide/7/12/S-left", "wide/7/12/S-left-30", "7/12"].into_iter().any(of));
    }
}
