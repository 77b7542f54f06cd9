//! What a random road keeps beside what every roundabout file must.

use std::f64::consts::TAU;

use glam::DVec2;

use super::Reason;
use super::distribution_keys::Rules;
use crate::geometry::{Curve, Outline, Piece};
use crate::map::route::Route;
use crate::map::{Gutter, Road};

impl Rules {
    /// Why the roundabout breaks one of the rules, if it does.
    pub(super) fn keeps(&self, roundabout: &Road) -> Result<(), Reason> {
        let routes = roundabout.routes(self.approach, self.departure, 5.0).map_err(|_| Reason::ArmTooShort)?;
        if routes.iter().any(|route| route.before < self.truck_behind || route.after < self.truck_ahead) {
            return Err(Reason::ArmTooShort);
        }
        let kerbs = roundabout.kerbs(Gutter::Drivable);
        // Routes that enter on one lane begin at one pose, unless the first exit has a lane of its own.
        let mut starts: Vec<DVec2> = Vec::new();
        for route in &routes {
            let start = route.centre_line.point_at(0.0);
            if !starts.contains(&start) {
                starts.push(start);
                if self
                    .poses(route)
                    .iter()
                    .any(|outline| clearance(&kerbs, outline, 0.05, self.start_clearance) < self.start_clearance)
                {
                    return Err(Reason::StartOnKerb);
                }
            }
        }
        if !is_sound(&roundabout.kerbs(Gutter::Solid), kerbs.loops.len()) {
            return Err(Reason::Gutter);
        }
        match lane_clearance(&kerbs, &routes, self.lane_clearance) < self.lane_clearance {
            true => Err(Reason::RouteNearKerb),
            false => Ok(()),
        }
    }

    /// The truck's outline at the beginning of a route, with each combination of the largest start errors.
    pub(super) fn poses(&self, route: &Route) -> [Curve; 4] {
        let (at, heading) = (route.centre_line.point_at(0.0), route.centre_line.heading_at(0.0));
        let side = DVec2::from_angle(heading).perp();
        [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(offset, turn)| {
            let ahead = DVec2::from_angle(heading + turn * self.start_heading_deg.to_radians());
            let at = at + offset * self.start_offset * side;
            let corner = |along: f64, left: f64| at + along * ahead + left * self.truck_width / 2.0 * ahead.perp();
            let (front, rear) = (self.truck_ahead, -self.truck_behind);
            let corners = [corner(front, 1.0), corner(rear, 1.0), corner(rear, -1.0), corner(front, -1.0)];
            Curve { pieces: (0..4).map(|n| Piece::Segment { from: corners[n], to: corners[(n + 1) % 4] }).collect() }
        })
    }
}

/// Whether an outline has so many loops and each is closed: kerbs moved by the gutter may have merged.
fn is_sound(outline: &Outline, n_loops: usize) -> bool {
    let joined = |(one, next): (&Piece, &Piece)| one.end().distance(next.start()) < 1e-6;
    let closed = |curve: &Curve| curve.pieces.iter().zip(curve.pieces.iter().cycle().skip(1)).all(joined);
    outline.loops.len() == n_loops && outline.loops.iter().all(closed)
}

/// Least distance from a route to an outline; once it is below `enough`, less is not looked for (m).
pub(super) fn lane_clearance(kerbs: &Outline, routes: &[Route], enough: f64) -> f64 {
    let mut pieces: Vec<Piece> = Vec::new();
    for &piece in routes.iter().flat_map(|route| &route.centre_line.pieces) {
        // Routes share their pieces, and together follow all of a ring lane.
        let piece = match piece {
            Piece::Arc { centre: DVec2::ZERO, radius, .. } => {
                Piece::Arc { centre: DVec2::ZERO, radius, from: 0.0, sweep: TAU }
            }
            piece => piece,
        };
        if !pieces.contains(&piece) {
            pieces.push(piece);
        }
    }
    let mut least = f64::INFINITY;
    for piece in pieces {
        if least < enough {
            break;
        }
        least = least.min(clearance(kerbs, &Curve { pieces: vec![piece] }, 0.25, enough));
    }
    least
}

/// Least distance from a curve to an outline, at stations `step` apart. Once it is below `enough`, a point below is
/// not looked for any more (m).
fn clearance(kerbs: &Outline, curve: &Curve, step: f64, enough: f64) -> f64 {
    let (length, mut s, mut least) = (curve.length(), 0.0, f64::INFINITY);
    while s <= length && enough <= least {
        let distance = kerbs.distance(curve.point_at(s));
        least = least.min(distance);
        // The distance changes by at most a metre a metre.
        s += (distance - enough.max(0.0)).max(step);
    }
    least.min(kerbs.distance(curve.point_at(length)))
}
