//! How near a unit comes to the kerbs along a path, and where it is over one; the area that it sweeps.

use glam::DVec2;

use crate::geometry::area::{Area, counter_clockwise, points};
use crate::geometry::{Outline, Piece};

/// Distance between the points of an outline at which clearance is computed (m).
const BETWEEN_POINTS: f64 = 0.05;
/// How deep an overlap that no point of the outline shows is at least: it is looked for so far inside (m).
const HIDDEN: f64 = 0.002;
/// Largest distance of a swept area's corner that is left out from the edge without it (m).
const SIMPLIFIED: f64 = 0.005;
/// Parts and holes that are smaller are left out (m²).
const SMALLEST: f64 = 1e-3;

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
/// clockwise, none with its first point repeated (m). Poses are so near to each other that corners move straight.
pub fn swept_area(path: &[[DVec2; 4]]) -> Vec<Vec<DVec2>> {
    // Halves are united with halves: all at once, every part would be cut by all that it overlaps.
    fn united(path: &[[DVec2; 4]]) -> Area {
        if path.len() <= 3 {
            return Area::union(path.windows(2).flat_map(|pair| swept_between(&pair[0], &pair[1])));
        }
        let middle = path.len() / 2;
        united(&path[..=middle]).plus(&united(&path[middle..]))
    }
    united(path)
        .simplified(SIMPLIFIED)
        .tidied(SIMPLIFIED, SMALLEST)
        .parts
        .iter()
        .flatten()
        .map(|contour| points(contour))
        .collect()
}

/// What a rectangle sweeps between two poses: itself at both, and what each side sweeps. Their hull would fill what
/// lies between the inner sides of one that turns.
fn swept_between(from: &[DVec2; 4], to: &[DVec2; 4]) -> Vec<Vec<DVec2>> {
    let mut parts = vec![from.to_vec(), to.to_vec()];
    for side in 0..4 {
        let next = (side + 1) % 4;
        parts.extend(swept_by_side([from[side], from[next]], [to[side], to[next]]));
    }
    parts.into_iter().map(counter_clockwise).collect()
}

/// What a side sweeps whose ends move straight.
fn swept_by_side([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> Vec<Vec<DVec2>> {
    // One that turns about a point of its own sweeps two triangles, and so does one whose ends change places.
    if let Some(p) = crossing([a, b], [c, d]) {
        vec![vec![a, p, c], vec![b, p, d]]
    } else if let Some(p) = crossing([a, c], [b, d]) {
        vec![vec![a, p, b], vec![c, p, d]]
    } else {
        vec![vec![a, b, d, c]]
    }
}

/// Where two segments cross, if they do.
fn crossing([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> Option<DVec2> {
    Piece::Segment { from: a, to: b }.meetings(&Piece::Segment { from: c, to: d }).pop()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Curve;

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

    #[test]
    fn a_rectangle_on_a_circle_sweeps_up_to_its_inner_side() {
        // 13 m long and 2.5 m wide, its middle on a circle of 13 m, poses 0.2 m apart.
        let pose = |angle: f64| {
            let (centre, along) = (13.0 * DVec2::from_angle(angle), DVec2::from_angle(angle).perp());
            [(6.5, 1.25), (6.5, -1.25), (-6.5, -1.25), (-6.5, 1.25)].map(|(x, y)| centre + x * along - y * along.perp())
        };
        let path: Vec<[DVec2; 4]> = (0..=400).map(|index| pose(f64::from(index) * 0.2 / 13.0)).collect();
        let area = swept_area(&path);
        let [inner, outer] = [false, true].map(|outer| {
            let radii = area.iter().flatten().map(|p| p.length());
            radii.fold(
                if outer { 0.0 } else { f64::INFINITY },
                |found, r| if outer { r.max(found) } else { r.min(found) },
            )
        });
        assert_eq!(area.len(), 2, "the circle is closed");
        assert!((inner - 11.75).abs() < 0.006 && (outer - 14.25f64.hypot(6.5)).abs() < 0.006, "{inner} {outer}");
    }
}
