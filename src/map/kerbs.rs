//! What kerb faces say of a road whose shape was read: the ring's radii, what each of them belongs to, and where a
//! route comes too near to one.

use std::f64::consts::TAU;

use glam::DVec2;

use super::ground::{Arm, Kerb};
use crate::geometry::area::{encloses_origin, signed_area};
use crate::geometry::{Curve, Outline, Piece, wrapped};

/// A centre line that is nearer to a kerb than half a truck's width is warned of (m).
const NEAREST: f64 = 1.3;
/// Distance between the points of a line that are compared with kerbs first (m).
const STEP: f64 = 0.98;
/// Parts of it, where a kerb may be nearer between two of them.
const FINER: u32 = 20;

/// What keeps the outline that begins at `start`, one of these areas but not the `outer` one, from being a kerb: the
/// outer one, if it lies outside of that, or another one that it lies in.
pub(super) fn misplaced(areas: &[Outline], index: usize, start: DVec2, outer: usize) -> Option<usize> {
    let others = areas.iter().enumerate().filter(|&(other, _)| other != index);
    let mut wrong = others.filter(|&(other, area)| area.contains(start) != (other == outer));
    wrong.next().map(|(other, _)| other)
}

/// Radius of the ring's outer kerb: the island's and what is free beyond it between the arms.
pub(super) fn outer_radius(faces: &Outline, island_radius: f64) -> f64 {
    let mut free: Vec<f64> = (0..180)
        .map(|i| {
            let out = DVec2::from_angle(f64::from(i) * TAU / 180.0);
            faces.ray(out * (island_radius + 0.5), out, 50.0)
        })
        .filter(|&free| 2.0 < free)
        .collect();
    free.sort_by(f64::total_cmp);
    // A quarter of the angles at least lies between the mouths.
    let between = free.get(free.len() / 8).copied().unwrap_or(4.0);
    island_radius + 0.5 + between
}

/// Radius at which a line follows the ring: the middle of its distances from the centre (m).
pub(super) fn ring_radius(line: &[DVec2], island_radius: f64, outer_radius: f64) -> f64 {
    let mut radii: Vec<f64> = Vec::new();
    for pair in line.windows(2) {
        let middle = (pair[0] + pair[1]) / 2.0;
        let turning = middle.normalize_or_zero().perp_dot((pair[1] - pair[0]).normalize_or_zero());
        if middle.length() < outer_radius && 0.9 < turning {
            radii.push(middle.length());
        }
    }
    radii.sort_by(f64::total_cmp);
    radii.get(radii.len() / 2).copied().unwrap_or((island_radius + outer_radius) / 2.0)
}

/// What a loop of the kerb faces belongs to.
pub(super) fn kerb_of(curve: &Curve, arms: &[Arm]) -> Kerb {
    let contour: Vec<[f64; 2]> = curve.polyline(0.01).into_iter().map(DVec2::into).collect();
    if 0.0 < signed_area(&contour) {
        return Kerb::Outer;
    }
    if encloses_origin(&contour) {
        return Kerb::Island;
    }
    let bearing = curve.pieces.iter().map(Piece::start).sum::<DVec2>().to_angle();
    let apart = |arm: usize| wrapped(bearing - arms[arm].bearing).abs();
    let nearest = (0..arms.len()).min_by(|&one, &other| apart(one).total_cmp(&apart(other)));
    Kerb::Splitter(nearest.unwrap_or(0))
}

/// Where a line comes too near to a kerb, away from its ends, and how near it is there (m).
pub(super) fn closest(line: &Curve, faces: &Outline) -> Option<(f64, DVec2)> {
    let span = line.length() - 4.0 * NEAREST;
    if span < 0.0 {
        // A short line is all ends.
        return None;
    }
    let n = (span / STEP).ceil() as usize;
    let step = span / n.max(1) as f64;
    let near = |along: f64| (faces.signed_distance(line.point_at(2.0 * NEAREST + along)), along);
    let coarse: Vec<(f64, f64)> = (0..=n).map(|i| near(i as f64 * step)).collect();
    let nearer = |one: (f64, f64), other: (f64, f64)| if other.0 < one.0 { other } else { one };
    let mut least = coarse.iter().copied().fold((f64::INFINITY, 0.0), nearer);
    for pair in coarse.windows(2) {
        // A distance changes by no more than what is driven: elsewhere between two points there is nothing nearer.
        if 0.5 * (pair[0].0 + pair[1].0 - step) < least.0 {
            least =
                (1..FINER).map(|part| near(pair[0].1 + step * f64::from(part) / f64::from(FINER))).fold(least, nearer);
        }
    }
    Some((least.0, line.point_at(2.0 * NEAREST + least.1))).filter(|(distance, _)| *distance < NEAREST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kerb_is_found_wherever_it_is_along_a_line_of_any_length() {
        let rectangle = |from: DVec2, to: DVec2| {
            let corners = [from, DVec2::new(to.x, from.y), to, DVec2::new(from.x, to.y)];
            let side = |i: usize| Piece::Segment { from: corners[i], to: corners[(i + 1) % 4] };
            Curve { pieces: (0..4).map(side).collect() }
        };
        let short = Curve { pieces: vec![Piece::Segment { from: DVec2::ZERO, to: DVec2::new(4.0, 0.0) }] };
        let narrow = Outline::new(vec![rectangle(DVec2::new(-9.0, -1.0), DVec2::new(9.0, 1.0))]);
        assert_eq!(closest(&short, &narrow), None);
        for length in [20.0, 200.0, 1_000.0] {
            let line = Curve { pieces: vec![Piece::Segment { from: DVec2::ZERO, to: DVec2::new(length, 0.0) }] };
            let road = rectangle(DVec2::new(-9.0, -9.0), DVec2::new(length + 9.0, 9.0));
            assert_eq!(closest(&line, &Outline::new(vec![road.clone()])), None);
            for at in [3.0, 0.5 * length, length - 3.0] {
                // A post on the line, wherever the points lie, is as near as its middle.
                let post = rectangle(DVec2::new(at - 0.2, -0.2), DVec2::new(at + 0.2, 0.2));
                let (distance, place) = closest(&line, &Outline::new(vec![road.clone(), post])).unwrap();
                assert!((distance + 0.2).abs() < 0.03 && (place.x - at).abs() < 0.05, "{at}: {distance} {place}");
            }
        }
    }
}
