//! How wide a path is that both units sweep, measured across a line: the front axle's path, or the lane's centre line.

use std::f64::consts::PI;

use glam::DVec2;

use super::Pose;
use crate::layout::Rig;

/// Reach of a truck behind its front axle, and ahead of it, of which the cross-sections are measured (m).
const BEHIND: f64 = 26.0;
const AHEAD: f64 = 4.0;
/// Reach of a cross-section to either side (m).
const ASIDE: f64 = 9.0;
/// Fraction of a bend's radius that a cross-section reaches on the inside: beyond the centre it would be another one.
const INSIDE: f64 = 0.9;

/// What is swept on either side of a point of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// The point of the line (m).
    pub at: DVec2,
    /// Farthest to the right of the line, left positive (m).
    pub right: f64,
    /// Farthest to the left of the line, left positive (m).
    pub left: f64,
}

impl Section {
    /// Width of what is swept (m).
    pub fn width(&self) -> f64 {
        self.left - self.right
    }
}

/// The path of the front axle (m).
pub fn front_path(rig: &Rig, path: &[Pose]) -> Vec<DVec2> {
    path.iter().map(|pose| pose.position + f64::from(rig.wheelbase) * DVec2::from_angle(pose.heading)).collect()
}

/// What both units sweep across `line`, at each of its points that any pose covers. The front axle of pose i is beside
/// the point `beside[i]`.
pub fn sections(rig: &Rig, path: &[Pose], line: &[DVec2], beside: &[usize]) -> Vec<Section> {
    let mut spans = vec![(f64::INFINITY, f64::NEG_INFINITY); line.len()];
    let stations = stations(line);
    let across: Vec<(DVec2, f64, f64)> = (0..line.len()).map(|index| across(line, &stations, index)).collect();
    for (pose, &index) in path.iter().zip(beside) {
        let units = [pose.tractor_corners(rig), pose.trailer_corners(rig)];
        let first = stations.partition_point(|&station| station < stations[index] - BEHIND);
        let last = stations.partition_point(|&station| station < stations[index] + AHEAD);
        for point in first..last {
            let (left, least, most) = across[point];
            for unit in &units {
                if let Some((low, high)) = cut(unit, line[point], left)
                    && low < most
                    && least < high
                {
                    widen(&mut spans[point], low.max(least), high.min(most));
                }
            }
        }
        // A corner between two cross-sections reaches farther than its sides do at either.
        for corner in units.as_flattened() {
            let along = |&point: &usize| across[point].0.perp_dot(*corner - line[point]).abs();
            let reaches = |&point: &usize| {
                let (left, least, most) = across[point];
                (least..=most).contains(&left.dot(*corner - line[point]))
            };
            let nearest = (first..last).filter(reaches).min_by(|a, b| along(a).total_cmp(&along(b)));
            if let Some(point) = nearest.filter(|point| along(point) < 1.0) {
                let aside = across[point].0.dot(*corner - line[point]);
                widen(&mut spans[point], aside, aside);
            }
        }
    }
    let covered = spans.iter().zip(line).filter(|((right, left), _)| right <= left);
    covered.map(|(&(right, left), &at)| Section { at, right, left }).collect()
}

/// Largest distance of the trailer's axles from the path of the front axle, and the place of the axles there (m).
pub fn off_tracking(rig: &Rig, path: &[Pose]) -> (f64, DVec2) {
    let front = front_path(rig, path);
    let (mut found, mut first) = ((0.0, DVec2::ZERO), 0);
    for (index, pose) in path.iter().enumerate() {
        while first + 1 < index && BEHIND < front[first].distance(front[index]) {
            first += 1;
        }
        let off = |pair: &[DVec2]| {
            let along = pair[1] - pair[0];
            let part = ((pose.trailer_position - pair[0]).dot(along) / along.length_squared().max(1e-12)).min(1.0);
            // Where the path begins, the axles are behind it on the straight.
            pose.trailer_position.distance(pair[0] + part * along)
        };
        let nearest = front[first..=index].windows(2).map(off).fold(f64::INFINITY, f64::min);
        if nearest.is_finite() && found.0 < nearest {
            found = (nearest, pose.trailer_position);
        }
    }
    found
}

/// For each pose the point of `line` beside its front axle, none behind the one before.
pub fn beside(rig: &Rig, path: &[Pose], line: &[DVec2]) -> Vec<usize> {
    let (stations, mut index) = (stations(line), 0);
    let next = |front: DVec2| {
        let last = stations.partition_point(|&station| station < stations[index] + AHEAD);
        let nearest = (index..last).min_by(|&a, &b| line[a].distance(front).total_cmp(&line[b].distance(front)));
        index = nearest.unwrap_or(index);
        index
    };
    front_path(rig, path).into_iter().map(next).collect()
}

fn stations(line: &[DVec2]) -> Vec<f64> {
    let mut stations = vec![0.0];
    stations.extend(line.windows(2).scan(0.0, |sum, pair| {
        *sum += pair[0].distance(pair[1]);
        Some(*sum)
    }));
    stations
}

fn widen(span: &mut (f64, f64), right: f64, left: f64) {
    *span = (span.0.min(right), span.1.max(left));
}

/// Direction to the left of a point of the line, and how far its cross-section reaches to the right and to the left.
fn across(line: &[DVec2], stations: &[f64], index: usize) -> (DVec2, f64, f64) {
    let (before, after) = (index.saturating_sub(4), (index + 4).min(line.len() - 1));
    let heading = |from: usize, to: usize| (line[to] - line[from]).to_angle();
    let ahead = (line[(index + 1).min(after)] - line[index.saturating_sub(1)]).normalize_or_zero();
    let length = 0.5 * (stations[after] - stations[before]);
    let bend = if before < index && index < after && 0.0 < length {
        let turn = heading(index, after) - heading(before, index);
        ((turn + PI).rem_euclid(2.0 * PI) - PI) / length
    } else {
        0.0
    };
    let inside = (INSIDE / bend.abs().max(1e-9)).min(ASIDE);
    let (right, left) = if 0.0 < bend { (-ASIDE, inside) } else { (-inside, ASIDE) };
    (ahead.perp(), right, left)
}

/// Where the line through `at` in a direction enters and leaves a rectangle: distances from `at` (m).
fn cut(corners: &[DVec2; 4], at: DVec2, direction: DVec2) -> Option<(f64, f64)> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for side in 0..4 {
        let (from, to) = (corners[side] - at, corners[(side + 1) % 4] - at);
        let (a, b) = (direction.perp_dot(from), direction.perp_dot(to));
        if (a <= 0.0) == (b <= 0.0) {
            continue;
        }
        let station = direction.dot(from.lerp(to, a / (a - b)));
        (low, high) = (low.min(station), high.max(station));
    }
    (low <= high).then_some((low, high))
}

#[cfg(test)]
mod tests {
    use super::super::swept_path;
    use super::*;
    use crate::geometry::{Curve, Piece};
    use crate::vehicle::Vehicle;

    const SPACING: f64 = 0.25;

    /// The poses of the EU truck at a crawl on a circle of this radius, after a straight (m).
    fn circle(radius: f64) -> (Rig, Curve, Vec<Pose>) {
        let rig = Vehicle::named("eu_4x2_13m6").unwrap().rig("empty", 0.05, None);
        let arc = |from: f64| Piece::Arc { centre: DVec2::new(0.0, radius), radius, from, sweep: 1.5 * PI };
        let approach = Piece::Segment { from: DVec2::new(-30.0, 0.0), to: DVec2::ZERO };
        let line = Curve { pieces: vec![approach, arc(-0.5 * PI), arc(PI)] };
        let path = swept_path(&rig, &line, 0.1, SPACING);
        (rig, line, path)
    }

    #[test]
    fn a_steady_turn_is_as_wide_as_from_the_outer_front_corner_to_the_trailers_inner_side() {
        let (rig, line, path) = circle(12.0);
        let points: Vec<DVec2> = (0..path.len()).map(|index| line.point_at(index as f64 * SPACING)).collect();
        let beside: Vec<usize> = (0..path.len()).collect();
        let sections = sections(&rig, &path, &points, &beside);
        // All but the last truck's length, where the trailer has not been yet, in the second turn.
        let steady = &sections[sections.len() - 200..sections.len() - 110];
        let vehicle = Vehicle::named("eu_4x2_13m6").unwrap();
        let turn = vehicle.single_track().at_front_radius(12.0).unwrap();
        let corner = DVec2::new(3.6 + 1.4, turn.tractor_radius + 0.5 * 2.55).length();
        let expected = corner - (turn.trailer_radius - 0.5 * 2.55);
        for section in steady {
            assert!((section.width() - expected).abs() < 0.01, "{section:?} {expected}");
        }
        let (off, _) = off_tracking(&rig, &path);
        assert!((off - turn.off_tracking()).abs() < 0.01, "{off} {turn:?}");
    }

    #[test]
    fn on_a_straight_a_truck_sweeps_its_own_width_and_does_not_off_track() {
        let rig = Vehicle::named("us_wb62").unwrap().rig("empty", 0.05, None);
        let line = Curve { pieces: vec![Piece::Segment { from: DVec2::ZERO, to: DVec2::new(80.0, 0.0) }] };
        let path = swept_path(&rig, &line, 5.0, SPACING);
        let points = front_path(&rig, &path);
        let found = beside(&rig, &path, &points);
        assert!(found.iter().copied().eq(0..path.len()), "{found:?}");
        for section in sections(&rig, &path, &points, &found) {
            assert!((section.left - 1.295).abs() < 1e-5 && (section.right + 1.295).abs() < 1e-5, "{section:?}");
        }
        assert!(off_tracking(&rig, &path).0 < 1e-6);
    }
}
