//! Curves of arcs and segments through polylines, within a tolerance.
//!
//! Each piece is as long as the tolerance lets it be. An outline's pieces meet at points of the polyline and may form
//! corners there; a line's pieces are pairs of arcs that share their tangents, so its heading has no step.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec2;

use super::{Curve, Piece, wrapped};

/// Points of a polyline are at most this far apart when a curve is compared with it (m).
const STEP: f64 = 0.5;
/// Most points that one piece replaces.
const MOST_POINTS: usize = 4000;

/// The closed polyline as a closed curve: every one of its points is within `tolerance` of the curve, and between them
/// the curve is within `tolerance` of the polyline (m).
///
/// The curve goes around as the polyline does. It is empty for fewer than three points.
pub fn fitted_outline(polyline: &[DVec2], tolerance: f64) -> Curve {
    bulging_outline(polyline, tolerance, tolerance)
}

/// The same, but that the curve may be `bulge` from the polyline between its points (m).
pub fn bulging_outline(polyline: &[DVec2], tolerance: f64, bulge: f64) -> Curve {
    let mut points = distinct(polyline);
    while 1 < points.len() && points[0].distance(points[points.len() - 1]) < 1e-9 {
        points.pop();
    }
    if points.len() < 3 {
        return Curve::default();
    }
    // Beginning at the sharpest corner, so that no piece ends where none has to.
    let n = points.len();
    let turn = |i: usize| (points[i] - points[(i + n - 1) % n]).angle_to(points[(i + 1) % n] - points[i]).abs();
    let sharpest = (0..n).fold(0, |best, i| if turn(best) + 1e-9 < turn(i) { i } else { best });
    points.rotate_left(sharpest);
    points.push(points[0]);
    let points = dense(&points);
    // No piece may reach around the whole loop: its ends would coincide.
    let third = points.len().div_ceil(3);
    let pieces = greedy(&points, |from, to| {
        let piece = (to - from <= third).then(|| arc_through(&points[from..=to], tolerance)).flatten();
        piece.filter(|piece| bulge_of(&points[from..=to], piece) <= bulge).map(|piece| vec![piece])
    });
    Curve { pieces: joined(pieces) }
}

/// The polyline as a curve of the same ends whose heading has no step: every one of its points is within `tolerance` of
/// the curve (m).
pub fn fitted_line(polyline: &[DVec2], tolerance: f64) -> Curve {
    let points = dense(&distinct(polyline));
    if points.len() < 2 {
        return Curve::default();
    }
    let tangents = tangents(&points);
    let mut stations = vec![0.0];
    for pair in points.windows(2) {
        stations.push(stations[stations.len() - 1] + pair[0].distance(pair[1]));
    }
    let pieces = greedy(&points, |from, to| {
        let pieces = biarc(points[from], tangents[from], points[to], tangents[to])?;
        // A pair of arcs much longer than what it replaces has gone around.
        if 1.1 * (stations[to] - stations[from]) + 1e-6 < pieces.iter().map(Piece::length).sum::<f64>() {
            return None;
        }
        let meeting = pieces[0].end();
        let across = tangents_between(&pieces);
        let first = from + points[from..=to].partition_point(|&p| (p - meeting).dot(across) < 0.0);
        let off = farthest(&points[from..first], &pieces[0]).max(farthest(&points[first..=to], &pieces[1]));
        (off <= tolerance).then_some(pieces)
    });
    Curve { pieces }
}

/// Largest distance of points beside a piece from it: from its line or circle (m).
fn farthest(points: &[DVec2], piece: &Piece) -> f64 {
    let farthest = |distance: &dyn Fn(DVec2) -> f64| points.iter().map(|&p| distance(p)).fold(0.0, f64::max);
    match *piece {
        Piece::Segment { from, to } => {
            let ahead = (to - from).normalize_or_zero();
            farthest(&|p| ahead.perp_dot(p - from).abs())
        }
        Piece::Arc { centre, radius, .. } => farthest(&|p| (p.distance(centre) - radius).abs()),
    }
}

/// Largest distance of a piece from the polyline of these points, on its line or circle, between two of them (m).
fn bulge_of(points: &[DVec2], piece: &Piece) -> f64 {
    match *piece {
        Piece::Segment { .. } => 0.0,
        Piece::Arc { radius, .. } => {
            let chord = points.windows(2).map(|pair| pair[0].distance(pair[1])).fold(0.0, f64::max);
            radius - (radius * radius - chord * chord / 4.0).max(0.0).sqrt()
        }
    }
}

/// Direction of a pair of pieces where they meet.
fn tangents_between(pieces: &[Piece]) -> DVec2 {
    DVec2::from_angle(pieces[1].heading_at(0.0))
}

/// The points that differ from the one before.
fn distinct(polyline: &[DVec2]) -> Vec<DVec2> {
    let mut points: Vec<DVec2> = Vec::with_capacity(polyline.len());
    for &p in polyline {
        if points.last().is_none_or(|last| 1e-6 < last.distance(p)) {
            points.push(p);
        }
    }
    points
}

/// The polyline with points at most [`STEP`] apart.
fn dense(points: &[DVec2]) -> Vec<DVec2> {
    let mut dense: Vec<DVec2> = points.first().copied().into_iter().collect();
    for pair in points.windows(2) {
        let parts = (pair[0].distance(pair[1]) / STEP).ceil().clamp(1.0, 1e5);
        dense.extend((1..=parts as usize).map(|part| pair[0].lerp(pair[1], part as f64 / parts)));
    }
    dense
}

/// Direction at each point: that of the circle through it and its neighbours.
fn tangents(points: &[DVec2]) -> Vec<f64> {
    let n = points.len();
    let chord = |i: usize| points[i + 1] - points[i];
    (0..n)
        .map(|i| {
            if i == 0 || i + 1 == n {
                let (near, next) = if i == 0 { (0, 1) } else { (n - 2, n.saturating_sub(3)) };
                if n < 3 {
                    return chord(near).to_angle();
                }
                // Half the turn to the next chord, in proportion to their lengths.
                let turn = wrapped(chord(near).to_angle() - chord(next).to_angle());
                let part = chord(near).length() / (chord(near).length() + chord(next).length());
                return chord(near).to_angle() + turn * part;
            }
            let (before, after) = (chord(i - 1), chord(i));
            let turn = wrapped(after.to_angle() - before.to_angle());
            before.to_angle() + turn * before.length() / (before.length() + after.length())
        })
        .collect()
}

/// Pieces from the first point to the last, each group as long as `fit` finds one. Neighbouring points are always
/// joined, by a segment if need be.
fn greedy(points: &[DVec2], fit: impl Fn(usize, usize) -> Option<Vec<Piece>>) -> Vec<Piece> {
    let last = points.len() - 1;
    let mut pieces = Vec::new();
    let mut from = 0;
    while from < last {
        let most = last.min(from + MOST_POINTS);
        let (mut reached, mut best) = (from + 1, fit(from, from + 1));
        let mut step = 1;
        let mut beyond = most + 1;
        while reached < most && step < beyond - from {
            let to = (from + 2 * step).min(most);
            match fit(from, to) {
                Some(found) => (reached, best) = (to, Some(found)),
                None => {
                    beyond = to;
                    break;
                }
            }
            step *= 2;
        }
        while reached + 1 < beyond && reached < most {
            let to = (reached + beyond) / 2;
            match fit(from, to) {
                Some(found) => (reached, best) = (to, Some(found)),
                None => beyond = to,
            }
        }
        pieces.extend(best.unwrap_or_else(|| vec![Piece::Segment { from: points[from], to: points[reached] }]));
        from = reached;
    }
    pieces
}

/// The segment or arc from the first point to the last that passes all others within `tolerance`, if there is one.
fn arc_through(points: &[DVec2], tolerance: f64) -> Option<Piece> {
    let (from, to) = (points[0], points[points.len() - 1]);
    let length = from.distance(to);
    if length < 1e-9 {
        return None;
    }
    let farthest = |piece: &Piece| farthest(points, piece);
    let segment = Piece::Segment { from, to };
    // A segment where it is as good as an arc would be.
    if farthest(&segment) <= 0.2 * tolerance {
        return Some(segment);
    }
    let ahead = (to - from) / length;
    // Least squares of a flat arc's height over its chord, right of it positive.
    let (mut above, mut weights) = (0.0, 0.0);
    for &p in points {
        let local = p - from;
        let x = 2.0 * local.dot(ahead) / length - 1.0;
        let weight = 1.0 - x * x;
        above += -ahead.perp_dot(local) * weight;
        weights += weight * weight;
    }
    let guess = if 0.0 < weights { above / weights } else { 0.0 };
    let reach = 2.0 * tolerance + 0.3 * guess.abs();
    let (mut low, mut high) = (guess - reach, guess + reach);
    let off = |height: f64| arc_of_height(from, to, height).map_or(f64::INFINITY, |piece| farthest(&piece));
    // The largest distance has one minimum over the height: golden sections.
    let golden = (5f64.sqrt() - 1.0) / 2.0;
    let (mut one, mut other) = (high - golden * (high - low), low + golden * (high - low));
    let (mut at_one, mut at_other) = (off(one), off(other));
    for _ in 0..30 {
        if at_one.min(at_other) <= 0.7 * tolerance {
            break;
        }
        if at_one < at_other {
            (high, other, at_other) = (other, one, at_one);
            one = high - golden * (high - low);
            at_one = off(one);
        } else {
            (low, one, at_one) = (one, other, at_other);
            other = low + golden * (high - low);
            at_other = off(other);
        }
    }
    let best = if at_one < at_other { one } else { other };
    if at_one.min(at_other) <= tolerance { arc_of_height(from, to, best) } else { None }
}

/// The arc between two points whose middle is `height` right of the chord; a segment if it is flat, nothing if it is
/// more than half a circle (m).
pub(crate) fn arc_of_height(from: DVec2, to: DVec2, height: f64) -> Option<Piece> {
    let chord = to - from;
    let half = chord.length() / 2.0;
    if height.abs() < 1e-7 * half.max(1.0) {
        return Some(Piece::Segment { from, to });
    }
    if half < height.abs() {
        return None;
    }
    let radius = (half * half + height * height) / (2.0 * height.abs());
    let left = chord.normalize_or_zero().perp();
    // A left turn bulges to the right of its chord.
    let centre = (from + to) / 2.0 + left * height.signum() * (radius - height.abs());
    let sweep = 4.0 * (height / half).atan();
    Some(Piece::Arc { centre, radius, from: (from - centre).to_angle(), sweep })
}

/// Two arcs from one pose to another that share their tangent where they meet; segments where they are flat.
fn biarc(from: DVec2, heading: f64, to: DVec2, other: f64) -> Option<Vec<Piece>> {
    let (t1, t2) = (DVec2::from_angle(heading), DVec2::from_angle(other));
    let v = to - from;
    if FRAC_PI_2 < t1.angle_to(v).abs() || FRAC_PI_2 < v.angle_to(t2).abs() {
        return None;
    }
    // Both arcs' control points lie `d` from their ends along the tangents.
    let t = t1 + t2;
    let (a, b, c) = (2.0 * (1.0 - t1.dot(t2)), 2.0 * v.dot(t), -v.length_squared());
    let d = if a < 1e-9 { -c / b } else { (-b + (b * b - 4.0 * a * c).max(0.0).sqrt()) / (2.0 * a) };
    if !(d.is_finite() && 0.0 < d) {
        return None;
    }
    let meeting = (from + to + d * (t1 - t2)) / 2.0;
    Some(vec![tangent_arc(from, t1, meeting)?, tangent_arc_reversed(meeting, to, t2)?])
}

/// The arc that leaves `from` in direction `ahead` and ends at `to`.
fn tangent_arc(from: DVec2, ahead: DVec2, to: DVec2) -> Option<Piece> {
    let chord = to - from;
    let length = chord.length();
    if length < 1e-9 {
        return None;
    }
    let half_turn = ahead.angle_to(chord);
    if PI / 2.0 < half_turn.abs() {
        return None;
    }
    arc_of_height(from, to, length / 2.0 * (half_turn / 2.0).tan())
}

/// The arc from `from` that arrives at `to` in direction `ahead`.
fn tangent_arc_reversed(from: DVec2, to: DVec2, ahead: DVec2) -> Option<Piece> {
    tangent_arc(to, -ahead, from).map(|piece| piece.reversed())
}

/// Neighbouring segments in one line become one.
fn joined(pieces: Vec<Piece>) -> Vec<Piece> {
    let mut joined: Vec<Piece> = Vec::with_capacity(pieces.len());
    for piece in pieces {
        if let (Some(Piece::Segment { from, to: middle }), Piece::Segment { to, .. }) = (joined.last().copied(), piece)
            && (Piece::Segment { from, to }).distance(middle) < 1e-6
        {
            joined.pop();
            joined.push(Piece::Segment { from, to });
            continue;
        }
        joined.push(piece);
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A clothoid of curvature `rate * s`, in steps of 10 cm.
    fn clothoid(rate: f64, length: f64) -> Vec<DVec2> {
        let mut points = vec![DVec2::ZERO];
        let n = (length / 1e-3) as usize;
        let mut p = DVec2::ZERO;
        for i in 0..n {
            let s = (i as f64 + 0.5) * 1e-3;
            p += 1e-3 * DVec2::from_angle(rate * s * s / 2.0);
            if (i + 1) % 100 == 0 {
                points.push(p);
            }
        }
        points
    }

    fn farthest(points: &[DVec2], curve: &Curve) -> f64 {
        points.iter().map(|&p| curve.distance(p)).fold(0.0, f64::max)
    }

    #[test]
    fn a_line_has_no_step_in_its_heading_and_stays_within_the_tolerance() {
        let points = clothoid(0.002, 40.0);
        let curve = fitted_line(&points, 0.005);
        assert!(farthest(&points, &curve) <= 0.005);
        assert!(curve.pieces.len() <= 12, "{}", curve.pieces.len());
        for pair in curve.pieces.windows(2) {
            assert!(pair[0].end().distance(pair[1].start()) < 1e-9);
            assert!(wrapped(pair[1].heading_at(0.0) - pair[0].heading_at(pair[0].length())).abs() < 1e-6);
        }
        assert!((curve.length() - 40.0).abs() < 1e-3);
        // The curve has no point far from the polyline either.
        let polyline =
            Curve { pieces: points.windows(2).map(|pair| Piece::Segment { from: pair[0], to: pair[1] }).collect() };
        assert!(farthest(&curve.polyline(1e-3), &polyline) <= 0.006);
    }

    #[test]
    fn a_rounded_square_is_eight_pieces_and_a_circle_a_few_arcs() {
        let mut points = Vec::new();
        for corner in 0..4 {
            let turn = DVec2::from_angle(f64::from(corner) * FRAC_PI_2);
            points.extend((0..=10).map(|i| {
                turn.rotate(DVec2::new(10.0, 10.0) + 3.0 * DVec2::from_angle(f64::from(i) * FRAC_PI_2 / 10.0))
            }));
        }
        let square = fitted_outline(&points, 0.02);
        assert!((8..=12).contains(&square.pieces.len()), "{}", square.pieces.len());
        assert!(farthest(&points, &square) <= 0.02);
        assert!(square.pieces[0].start().distance(square.pieces[square.pieces.len() - 1].end()) < 1e-9);
        let circle: Vec<DVec2> = (0..200).map(|i| 8.0 * DVec2::from_angle(f64::from(i) * PI / 100.0)).collect();
        let circle = fitted_outline(&circle, 0.005);
        assert!(circle.pieces.len() <= 5 && (circle.signed_area() - 64.0 * PI).abs() < 0.1);
    }

    #[test]
    fn a_sharp_corner_stays_where_it_is() {
        let triangle = [DVec2::ZERO, DVec2::new(30.0, 0.0), DVec2::new(0.0, 20.0)];
        let curve = fitted_outline(&triangle, 0.005);
        assert_eq!(curve.pieces.len(), 3);
        assert!(triangle.iter().all(|&p| curve.pieces.iter().any(|piece| piece.start().distance(p) < 1e-12)));
    }

    #[test]
    fn corners_of_rectangles_of_any_size_are_not_rounded() {
        for index in 0..60 {
            let (length, width) = (2.0 + 0.13 * f64::from(index), 0.7 + 0.05 * f64::from(index % 7));
            let corners = [[0.0, 0.0], [length, 0.0], [length, width], [0.0, width]];
            let turn = DVec2::from_angle(0.1 * f64::from(index));
            let curve = fitted_outline(&corners.map(|corner| turn.rotate(DVec2::from(corner))), 0.004);
            assert!((curve.signed_area() - length * width).abs() < 0.02, "{length} {width}: {}", curve.signed_area());
        }
    }
}
