//! How wide a path is that both units sweep, measured across a line: the front axle's path, or the lane's centre line.

use std::f64::consts::FRAC_PI_2;

use glam::DVec2;

use super::Pose;
use crate::layout::Rig;

/// Largest reach of a cross-section to either side (m).
const ASIDE: f64 = 30.0;
/// Points of the line that are nearer than this do not bound a cross-section: between them it is the polyline's own
/// corners that count (m).
const NEAR: f64 = 0.9;
/// Farthest that a front axle comes along a line from one pose to the next (m).
const STRIDE: f64 = 4.0;

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

/// How far along a line a truck lies behind its front axle and ahead of it, at most (m). A trailer that cuts a bend's
/// inside lies along more of the line than it is long: at most half a circle over its chord.
fn reach(rig: &Rig) -> (f64, f64) {
    let [wheelbase, fifth_wheel, trailer_wheelbase] =
        [rig.wheelbase, rig.fifth_wheel, rig.trailer_wheelbase].map(f64::from);
    let trailer = fifth_wheel - trailer_wheelbase;
    let rear = f64::from(rig.tractor_body.rear).min(trailer + f64::from(rig.trailer_body.rear));
    let front = f64::from(rig.tractor_body.front).max(trailer + f64::from(rig.trailer_body.front));
    (FRAC_PI_2 * (wheelbase - rear), FRAC_PI_2 * (front - wheelbase).max(0.0) + 1.0)
}

/// The path of the front axle (m).
pub fn front_path(rig: &Rig, path: &[Pose]) -> Vec<DVec2> {
    path.iter().map(|pose| pose.position + f64::from(rig.wheelbase) * DVec2::from_angle(pose.heading)).collect()
}

/// What both units sweep across `line`, at each of its points that any pose covers. The front axle of pose i is beside
/// the point `beside[i]`.
pub fn sections(rig: &Rig, path: &[Pose], line: &[DVec2], beside: &[usize]) -> Vec<Section> {
    let mut spans = vec![(f64::INFINITY, f64::NEG_INFINITY); line.len()];
    let (stations, (behind, ahead)) = (stations(line), reach(rig));
    let across: Vec<(DVec2, f64, f64)> =
        (0..line.len()).map(|index| across(line, &stations, index, behind + ahead)).collect();
    for (pose, &index) in path.iter().zip(beside) {
        let units = [pose.tractor_corners(rig), pose.trailer_corners(rig)];
        let first = stations.partition_point(|&station| station < stations[index] - behind);
        let last = stations.partition_point(|&station| station < stations[index] + ahead);
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
    let (front, (behind, _)) = (front_path(rig, path), reach(rig));
    let (mut found, mut first) = ((0.0, DVec2::ZERO), 0);
    for (index, pose) in path.iter().enumerate() {
        while first + 1 < index && behind < front[first].distance(front[index]) {
            first += 1;
        }
        let off = |(number, pair): (usize, &[DVec2])| {
            let along = pair[1] - pair[0];
            let part = (pose.trailer_position - pair[0]).dot(along) / along.length_squared().max(1e-12);
            // Where the path begins, the axles are behind it on the straight.
            let part = if first + number == 0 { part.min(1.0) } else { part.clamp(0.0, 1.0) };
            pose.trailer_position.distance(pair[0] + part * along)
        };
        let nearest = front[first..=index].windows(2).enumerate().map(off).fold(f64::INFINITY, f64::min);
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
        let last = stations.partition_point(|&station| station < stations[index] + STRIDE);
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

/// Direction to the left of a point of the line, and how far its cross-section reaches to the right and to the left,
/// bounded by points no farther along the line than `within` (m).
fn across(line: &[DVec2], stations: &[f64], index: usize, within: f64) -> (DVec2, f64, f64) {
    let (at, station) = (line[index], stations[index]);
    let first = stations.partition_point(|&other| other < station - within);
    let last = stations.partition_point(|&other| other < station + within);
    let left = (line[(index + 1).min(line.len() - 1)] - line[index.saturating_sub(1)]).normalize_or_zero().perp();
    let mut reaches = [ASIDE; 2];
    for other in line[first..last].iter().map(|&other| other - at).filter(|other| NEAR < other.length()) {
        // Where this other point is as near, in a bend its centre: beyond lies its own cross-section.
        let aside = left.dot(other);
        let side = usize::from(0.0 < aside);
        reaches[side] = reaches[side].min(other.length_squared() / (2.0 * aside.abs()).max(1e-9));
    }
    (left, -reaches[0], reaches[1])
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
    use std::f64::consts::PI;

    use super::super::swept_path;
    use super::*;
    use crate::geometry::{Curve, Piece};
    use crate::vehicle::Vehicle;

    const SPACING: f64 = 0.25;

    /// The poses of a truck at a crawl on a circle of this radius, after a straight (m).
    fn circle(vehicle: &Vehicle, radius: f64) -> (Rig, Curve, Vec<Pose>) {
        let rig = vehicle.rig("empty", 0.05, None);
        let arc = |from: f64| Piece::Arc { centre: DVec2::new(0.0, radius), radius, from, sweep: 1.5 * PI };
        let approach = Piece::Segment { from: DVec2::new(-30.0, 0.0), to: DVec2::ZERO };
        let line = Curve { pieces: vec![approach, arc(-0.5 * PI), arc(PI)] };
        let path = swept_path(&rig, &line, 0.1, SPACING);
        (rig, line, path)
    }

    #[test]
    fn a_steady_turn_is_as_wide_as_from_the_outer_front_corner_to_the_trailers_inner_side() {
        let vehicle = Vehicle::named("eu_4x2_13m6").unwrap();
        let (rig, line, path) = circle(&vehicle, 12.0);
        let points: Vec<DVec2> = (0..path.len()).map(|index| line.point_at(index as f64 * SPACING)).collect();
        let beside: Vec<usize> = (0..path.len()).collect();
        let sections = sections(&rig, &path, &points, &beside);
        // All but the last truck's length, where the trailer has not been yet, in the second turn.
        let steady = &sections[sections.len() - 200..sections.len() - 110];
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
    fn a_long_trailer_that_cuts_far_inside_a_bend_is_measured_whole() {
        let (rig, _, path) = circle(&Vehicle::named("us_wb67").unwrap(), 17.5);
        let front = front_path(&rig, &path);
        let own: Vec<usize> = (0..path.len()).collect();
        let widest = sections(&rig, &path, &front, &own).iter().map(Section::width).fold(0.0, f64::max);
        let (off, _) = off_tracking(&rig, &path);
        // Beside the axles' path half a trailer lies inside, beside the front axle's half a tractor outside.
        let least = off + f64::from(rig.trailer_body.half_width + rig.tractor_body.half_width);
        assert!(8.0 < off && least - 0.02 < widest && widest < least + 1.0, "{off} {widest} {least}");
    }

    #[test]
    fn off_tracking_of_a_double_bend_is_the_distance_to_the_nearest_point_of_the_front_axles_path() {
        let rig = Vehicle::named("us_wb67").unwrap().rig("empty", 0.05, None);
        let (radius, sweep) = (20.0, 0.35 * PI);
        let middle = DVec2::new(radius * sweep.sin(), radius * (1.0 - sweep.cos()));
        let left = Piece::Arc { centre: DVec2::new(0.0, radius), radius, from: -0.5 * PI, sweep };
        let centre = 2.0 * middle - DVec2::new(0.0, radius);
        let right = Piece::Arc { centre, radius, from: 0.5 * PI + sweep, sweep: -sweep };
        let end = 2.0 * middle;
        let pieces = vec![
            Piece::Segment { from: DVec2::new(-30.0, 0.0), to: DVec2::ZERO },
            left,
            right,
            Piece::Segment { from: end, to: end + DVec2::new(40.0, 0.0) },
        ];
        let path = swept_path(&rig, &Curve { pieces }, 0.1, SPACING);
        let front = front_path(&rig, &path);
        let nearest =
            |pose: &Pose| front.iter().map(|p| p.distance(pose.trailer_position)).fold(f64::INFINITY, f64::min);
        // At the start the axles are behind the path.
        let expected = path.iter().skip(120).map(nearest).fold(0.0, f64::max);
        let (off, _) = off_tracking(&rig, &path);
        assert!(1.0 < expected && (off - expected).abs() < 0.01, "{off} {expected}");
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
