//! How near a unit comes to the kerbs along a path, and where it is over one; the area that it sweeps.

use glam::DVec2;

use crate::geometry::Outline;
use crate::geometry::area::{Area, points};

/// Distance between the points of an outline at which clearance is computed (m).
const BETWEEN_POINTS: f64 = 0.05;
/// How deep an overlap that no point of the outline shows is at least: it is looked for so far inside (m).
const HIDDEN: f64 = 0.002;
/// Largest distance of a swept area's corner that is left out from the edge without it (m).
const SIMPLIFIED: f64 = 0.005;

/// How near a unit comes to the kerbs along a path.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitClearance {
    /// Least signed distance of the unit's outline from the kerbs, negative beyond one (m).
    pub least: f64,
    /// The point of the unit's outline where that is (m).
    pub at: DVec2,
    /// For each section on which the unit overlaps solid ground: its deepest point, and the depth (m).
    pub overlaps: Vec<(DVec2, f64)>,
}

impl UnitClearance {
    /// Of a unit with its corners in order around it at each pose.
    pub fn of(path: &[[DVec2; 4]], kerbs: &Outline) -> UnitClearance {
        let mut found = UnitClearance { least: f64::INFINITY, at: DVec2::ZERO, overlaps: Vec::new() };
        let mut overlapping = false;
        for corners in path {
            let (deepest, mut distance) = nearest(corners, kerbs);
            // A narrow nose may lie between two points of the outline: the overlap is decided exactly.
            let overlaps = kerbs.intersects_rectangle(corners);
            if overlaps && -HIDDEN < distance && kerbs.intersects_rectangle(&within(corners, HIDDEN)) {
                distance = -HIDDEN;
            }
            if distance < found.least {
                (found.least, found.at) = (distance, deepest);
            }
            if overlaps {
                let depth = -distance.min(0.0);
                match found.overlaps.last_mut().filter(|_| overlapping) {
                    Some(section) if depth <= section.1 => {}
                    Some(section) => *section = (deepest, depth),
                    None => found.overlaps.push((deepest, depth)),
                }
            }
            overlapping = overlaps;
        }
        found
    }
}

/// A rectangle with each side moved inwards (m).
fn within(corners: &[DVec2; 4], by: f64) -> [DVec2; 4] {
    std::array::from_fn(|index| {
        let corner = corners[index];
        let along = |other: usize| (corners[other % 4] - corner).normalize_or_zero() * by;
        corner + along(index + 1) + along(index + 3)
    })
}

/// The point of a rectangle's outline with the least signed distance from the kerbs, and that distance (m).
pub fn nearest(corners: &[DVec2; 4], kerbs: &Outline) -> (DVec2, f64) {
    let centre = (corners[0] + corners[2]) / 2.0;
    let nearby = kerbs.near(centre, corners[0].distance(centre));
    let points = (0..4).flat_map(|side| {
        let (from, to) = (corners[side], corners[(side + 1) % 4]);
        let n = (from.distance(to) / BETWEEN_POINTS).ceil();
        (0..n as usize).map(move |step| from.lerp(to, step as f64 / n))
    });
    points
        .map(|p| (p, nearby.signed_distance(p)))
        .fold((centre, f64::INFINITY), |least, here| if here.1 < least.1 { here } else { least })
}

/// The area that a rectangle sweeps from pose to pose as polygons within 5 mm: boundaries counter-clockwise, holes
/// clockwise, none with its first point repeated (m).
pub fn swept_area(path: &[[DVec2; 4]]) -> Vec<Vec<DVec2>> {
    // Halves are united with halves: all at once, every hull would be cut by all that it overlaps.
    fn united(path: &[[DVec2; 4]]) -> Area {
        if path.len() <= 3 {
            return Area::union(path.windows(2).map(|pair| hull(pair.concat())));
        }
        let middle = path.len() / 2;
        united(&path[..=middle]).plus(&united(&path[middle..]))
    }
    united(path).simplified(SIMPLIFIED).parts.iter().flatten().map(|contour| points(contour)).collect()
}

/// The corners of the convex hull, counter-clockwise (A. M. Andrew, "Another efficient algorithm for convex hulls in
/// two dimensions", 1979).
pub fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut kept: Vec<DVec2> = Vec::new();
        for p in points {
            while let [.., a, b] = kept[..]
                && (b - a).perp_dot(p - b) <= 0.0
            {
                kept.pop();
            }
            kept.push(p);
        }
        // The chain's last point is the other chain's first.
        kept.pop();
        kept
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Curve, Piece};

    #[test]
    fn a_hull_of_two_squares_has_their_outer_corners_counter_clockwise() {
        let square = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(|(x, y)| DVec2::new(x, y));
        let shifted = square.map(|p| p + DVec2::new(1.0, 0.5));
        let expected =
            [(0.0, 0.0), (2.0, 0.0), (3.0, 0.5), (3.0, 2.5), (1.0, 2.5), (0.0, 2.0)].map(|(x, y)| DVec2::new(x, y));
        assert_eq!(hull([square, shifted].concat()), expected);
    }

    #[test]
    fn the_point_of_a_body_nearest_to_a_kerb_may_lie_on_a_side() {
        let kerb = Outline::new(vec![Curve::circle(DVec2::ZERO, 50.0), Curve::circle(DVec2::new(0.0, -3.0), 2.0)]);
        let body = [(6.0, 1.2), (-6.0, 1.2), (-6.0, -1.2), (6.0, -1.2)].map(|(x, y)| DVec2::new(x, y));
        let (at, depth) = nearest(&body, &kerb);
        // The circle reaches up to y = -1, 0.2 m into the body; its nearest point to the side's middle lies straight
        // below.
        assert!((depth + 0.2).abs() < 1e-9 && at.distance(DVec2::new(0.0, -1.2)) < 1e-9, "{at} {depth}");
        // Past the circle and back: two sections, the least clearance is that of the deeper one.
        let moved = |x: f64, y: f64| body.map(|p| p + DVec2::new(x, y));
        let path = [moved(-20.0, 0.0), moved(0.0, 0.0), moved(20.0, 0.0), moved(0.0, -0.1), moved(0.0, 20.0)];
        let found = UnitClearance::of(&path, &kerb);
        let depths: Vec<f64> = found.overlaps.iter().map(|(_, depth)| (depth * 1e6).round() / 1e6).collect();
        assert_eq!(depths, [0.2, 0.3]);
        assert!((found.least + 0.3).abs() < 1e-9 && found.at.distance(DVec2::new(0.0, -1.3)) < 1e-9, "{found:?}");
    }

    #[test]
    fn a_nose_between_two_points_of_a_side_and_a_post_within_are_overlaps_of_some_depth() {
        let body = [(6.0, 1.2), (-6.0, 1.2), (-6.0, -1.2), (6.0, -1.2)].map(|(x, y)| DVec2::new(x, y));
        let around = |kerb: Curve| Outline::new(vec![Curve::circle(DVec2::ZERO, 50.0), kerb]);
        let triangle = |tip: f64| {
            // Half way between points of the side that are 5 cm apart.
            let corners = [(0.025, tip), (0.005, -3.0), (0.045, -3.0)].map(|(x, y)| DVec2::new(x, y));
            let pieces = (0..3).map(|index| Piece::Segment { from: corners[index], to: corners[(index + 2) % 3] });
            around(Curve { pieces: pieces.collect() })
        };
        let least = |kerb: &Outline| UnitClearance::of(&[body], kerb).least;
        assert!(0.0 < nearest(&body, &triangle(-1.16)).1, "no point lies in it");
        assert_eq!(least(&triangle(-1.16)), -HIDDEN);
        assert_eq!(least(&around(Curve::circle(DVec2::ZERO, 0.1))), -HIDDEN);
        // One that just touches has no depth.
        assert!(0.0 < least(&triangle(-1.1995)));
    }

    #[test]
    fn a_square_moved_along_itself_sweeps_a_rectangle() {
        let square = |x: f64| [(1.0, 1.0), (0.0, 1.0), (0.0, 0.0), (1.0, 0.0)].map(|(u, v)| DVec2::new(x + u, v));
        let area = swept_area(&[square(0.0), square(0.5), square(3.0)]);
        assert_eq!(area.len(), 1);
        let n = area[0].len();
        let size: f64 = (0..n).map(|i| area[0][i].perp_dot(area[0][(i + 1) % n])).sum::<f64>() / 2.0;
        // Corners lie on a grid of 0.06 mm.
        assert!((size - 4.0).abs() < 1e-3 && n == 4, "{area:?}");
    }
}
