//! How near a unit comes to the kerbs along a path, and where it is over one; the area that it sweeps.

use glam::DVec2;

use crate::geometry::area::{Area, counter_clockwise, points};
use crate::geometry::{Outline, Piece};

/// Distance between the points of an outline at which clearance is computed (m).
const BETWEEN_POINTS: f64 = 0.05;
/// The same on the path of a corner from a pose to the next that leads over a kerb (m).
const BETWEEN_CORNERS: f64 = 0.01;
/// What lies between these points, or between two poses, counts where it is nearer by more than this (m).
const NEARER: f64 = 0.005;
/// How deep an overlap that no point of the outline shows is at least: it is looked for so far inside (m).
const HIDDEN: f64 = 0.002;
/// Largest distance of a swept area's corner that is left out from the edge without it (m).
const SIMPLIFIED: f64 = 0.005;
/// Parts and holes that are smaller are left out (m²).
const SMALLEST: f64 = 1e-3;

/// How near a unit comes to the kerbs along a path.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitClearance {
    /// Least signed distance from the kerbs of what the unit sweeps, negative beyond one (m).
    pub least: f64,
    /// The point of the unit's outline where that is (m).
    pub at: DVec2,
    /// For each section on which the unit overlaps solid ground: its deepest point, and the depth (m).
    pub overlaps: Vec<(DVec2, f64)>,
}

/// The point of a unit that is nearest to a kerb or deepest in one, its signed distance (m), and whether it overlaps.
type Near = (DVec2, f64, bool);

impl UnitClearance {
    /// Of a unit with its corners in order around it at each pose; corners move straight from pose to pose, as those of
    /// [`swept_area`] do, with which it agrees within 5 mm.
    pub fn of(path: &[[DVec2; 4]], kerbs: &Outline) -> UnitClearance {
        let at_poses: Vec<Near> = path.iter().map(|corners| at_pose(corners, kerbs)).collect();
        let least = at_poses.iter().map(|near| near.1).fold(f64::INFINITY, f64::min);
        let mut found = UnitClearance { least: f64::INFINITY, at: DVec2::ZERO, overlaps: Vec::new() };
        let mut overlapping = false;
        let mut take = |(at, distance, overlaps): Near| {
            if distance < found.least {
                (found.least, found.at) = (distance, at);
            }
            if overlaps {
                let depth = -distance.min(0.0);
                match found.overlaps.last_mut().filter(|_| overlapping) {
                    Some(section) if depth <= section.1 => {}
                    Some(section) => *section = (at, depth),
                    None => found.overlaps.push((at, depth)),
                }
            }
            overlapping = overlaps;
        };
        for (index, &near) in at_poses.iter().enumerate() {
            take(near);
            let Some(&next) = at_poses.get(index + 1) else { break };
            let (from, to) = (&path[index], &path[index + 1]);
            let moved = (0..4).map(|corner| from[corner].distance(to[corner])).fold(0.0, f64::max);
            // No point moves farther than a corner, and half of that from the nearer pose.
            if 0.5 * (near.1 + next.1 - moved) < least.max(0.0)
                && let Some(between) = between(from, to, kerbs)
                && between.1 < near.1.min(next.1) - NEARER
            {
                take((between.0, between.1, between.2 || (near.2 && next.2)));
            }
        }
        found
    }
}

/// At a pose.
fn at_pose(corners: &[DVec2; 4], kerbs: &Outline) -> Near {
    let (at, mut distance) = nearest(corners, kerbs);
    if kerbs.intersects_rectangle(corners) {
        // A narrow nose may lie between two points of the outline: the overlap is decided exactly.
        if -HIDDEN < distance && kerbs.intersects_rectangle(&within(corners, HIDDEN)) {
            distance = -HIDDEN;
        }
        return (at, distance, true);
    }
    let centre = (corners[0] + corners[2]) / 2.0;
    let nearby = kerbs.near(centre, corners[0].distance(centre));
    let exact = least((0..4).map(|side| nearby.nearest_of(corners[side], corners[(side + 1) % 4])));
    if exact.1 < distance - NEARER { (exact.0, exact.1, false) } else { (at, distance, false) }
}

/// Of the straight paths of the corners from a pose to the next: with the sides at both, they bound what is swept
/// between. None where nothing moves.
fn between(from: &[DVec2; 4], to: &[DVec2; 4], kerbs: &Outline) -> Option<Near> {
    let paths = || (0..4).map(|corner| (from[corner], to[corner])).filter(|(from, to)| from != to);
    let centre = (from[0] + to[2]) / 2.0;
    let radius = from.iter().chain(to).map(|corner| corner.distance(centre)).fold(0.0, f64::max);
    let nearby = kerbs.near(centre, radius);
    let mut found: Option<Near> = None;
    for (from, to) in paths() {
        let crossings = nearby.crossings(from, to);
        let near = if crossings.is_empty() && 0.0 <= nearby.signed_distance(from) {
            let (at, distance) = nearby.nearest_of(from, to);
            (at, distance, false)
        } else {
            let n = (from.distance(to) / BETWEEN_CORNERS).ceil();
            let points = (0..=n as usize).map(|step| from.lerp(to, step as f64 / n));
            // A narrow nose may lie between two of them.
            let points = points.chain(crossings.windows(2).map(|pair| pair[0].midpoint(pair[1])));
            let (at, distance) = least(points.map(|p| (p, nearby.signed_distance(p))));
            (at, distance.min(0.0), true)
        };
        let overlaps = near.2 || found.is_some_and(|found| found.2);
        found = Some(found.filter(|found| found.1 <= near.1).unwrap_or(near)).map(|(at, by, _)| (at, by, overlaps));
    }
    found
}

/// The point with the least distance.
fn least(points: impl Iterator<Item = (DVec2, f64)>) -> (DVec2, f64) {
    points.fold((DVec2::ZERO, f64::INFINITY), |least, here| if here.1 < least.1 { here } else { least })
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
    least(points.map(|p| (p, nearby.signed_distance(p))))
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
        // Nor is one as near as the side is.
        assert!((least(&triangle(-1.21)) - 0.01).abs() < 1e-9 && 0.02 < nearest(&body, &triangle(-1.21)).1);
        assert_eq!(least(&triangle(-1.16)), -HIDDEN);
        assert_eq!(least(&around(Curve::circle(DVec2::ZERO, 0.1))), -HIDDEN);
        // One that just touches has no depth.
        assert!(0.0 < least(&triangle(-1.1995)));
    }

    #[test]
    fn a_nose_between_two_poses_of_a_corner_that_swings_is_as_near_as_the_swept_area() {
        // 9 m long and 2.5 m wide, its rear on a circle of 10 m, poses 0.4 m apart; the outer front corner swings.
        let pose = |angle: f64| {
            let (rear, along) = (10.0 * DVec2::from_angle(angle), DVec2::from_angle(angle).perp());
            [(9.0, 1.25), (0.0, 1.25), (0.0, -1.25), (9.0, -1.25)].map(|(x, y)| rear + x * along - y * along.perp())
        };
        let path: Vec<[DVec2; 4]> = (0..12).map(|index| pose(f64::from(index) * 0.04)).collect();
        let outer = (0..4).max_by(|a, b| path[0][*a].length().total_cmp(&path[0][*b].length())).unwrap();
        let tip = path[5][outer].midpoint(path[6][outer]);
        let (out, across) = (tip.normalize(), tip.normalize().perp());
        let of = |path: &[[DVec2; 4]], by: f64| {
            let tip = tip + by * out;
            let corners = [tip, tip + 0.6 * out + 0.12 * across, tip + 0.6 * out - 0.12 * across];
            let pieces = (0..3).map(|index| Piece::Segment { from: corners[index], to: corners[(index + 1) % 3] });
            let nose = Curve { pieces: pieces.collect() };
            UnitClearance::of(path, &Outline::new(vec![Curve::circle(DVec2::ZERO, 50.0), nose]))
        };
        for by in [0.3, 0.02, 0.005] {
            let found = of(&path, by);
            assert!((found.least - by).abs() < 1e-6 && found.overlaps.is_empty(), "{by}: {found:?}");
        }
        let at_poses = of(&path[5..6], 0.005).least.min(of(&path[6..7], 0.005).least);
        assert!(0.05 < at_poses, "{at_poses}");
        // It lies within what is swept between two poses alone.
        let found = of(&path, -0.02);
        assert!(-0.02 < found.least && found.least < -0.002, "{found:?}");
        assert!(found.overlaps.len() == 1 && found.at.distance(tip) < 0.01, "{found:?}");
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
