//! Gutters that differ from kerb to kerb and along a kerb, and the edges of the lanes that follow from them.
//!
//! A gutter covers every point that is no farther from its kerb's face than its width there. The lanes' edges are what
//! is left of the road, without slits that no wheel fits through.

use std::f64::consts::TAU;

use glam::DVec2;

use super::ring::Ring;
use super::roundabout_keys::{Written, WrittenDirection};
use crate::files::reader::{Error, Reader, shown};
use crate::geometry::area::{Area, counter_clockwise, points, signed_area};
use crate::geometry::{Curve, Outline, Piece, bulging_outline, wrapped};

/// Chords of faces and edges leave their curves by at most this much (m).
const FINE: f64 = 1e-3;
/// What arcs and segments may add to that (m).
const FITTED: f64 = 4e-3;
/// Gaps between gutters that are narrower are solid (m).
const SLIT: f64 = 0.1;
/// What is left with a smaller area is none (m²).
const PINHOLE: f64 = 0.01;
/// A width is applied at points at most this far apart, and nearer where it does not change linearly (m).
const SPACING: f64 = 0.5;
/// Least such distance (m).
const NEAREST: f64 = 0.01;
/// Most points of a gutter.
const MOST_POINTS: usize = 64;

/// A width that changes linearly from point to point.
#[derive(Debug, Clone, PartialEq)]
struct Profile {
    /// Station or angle, rising, and the width there (m).
    points: Vec<(f64, f64)>,
    /// Whether the last point is followed by the first, a turn later; else the widths at the ends hold beyond them.
    around: bool,
}

impl Profile {
    fn at(&self, x: f64) -> f64 {
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        let x = if self.around { first.0 + (x - first.0).rem_euclid(TAU) } else { x };
        let next = self.points.partition_point(|point| point.0 <= x);
        let (from, to) = match (next, self.around) {
            (0, _) => return first.1,
            (next, true) if next == self.points.len() => (last, (first.0 + TAU, first.1)),
            (next, false) if next == self.points.len() => return last.1,
            (next, _) => (self.points[next - 1], self.points[next]),
        };
        from.1 + (to.1 - from.1) * (x - from.0) / (to.0 - from.0)
    }
}

/// The gutters of a roundabout where one width does not do.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Gutters {
    /// Where nothing else is written (m).
    ring: f64,
    island: Option<Profile>,
    /// On the ring's outer circle, where arms open into it too.
    mouths: Option<Profile>,
    /// By arm: of the kerb from it to the next.
    kerbs: Vec<Option<Profile>>,
    /// Gutters of the arms with a splitter island, in the arms' order (m).
    splitters: Vec<f64>,
}

impl Written {
    /// The road's gutters, if they differ.
    pub(super) fn gutters(&self, reader: &Reader) -> Result<Option<Gutters>, Error> {
        let directions = |key: &str, written: &Option<Vec<WrittenDirection>>| {
            let points = written
                .as_ref()
                .map(|points| points.iter().map(|point| (point.bearing_deg, point.width)).collect::<Vec<_>>());
            points.map(|points| profile(reader, key, "bearing_deg", -360.0..=360.0, points)).transpose()
        };
        let island = directions("ring.island_gutter", &self.ring.island_gutter)?;
        let mouths = directions("ring.mouth_gutter", &self.ring.mouth_gutter)?;
        let (mut kerbs, mut splitters, mut differ) = (Vec::new(), Vec::new(), island.is_some() || mouths.is_some());
        for (index, arm) in self.arm.iter().enumerate() {
            let key = format!("arm[{index}].kerb_gutter");
            let points = arm
                .kerb_gutter
                .as_ref()
                .map(|points| points.iter().map(|point| (point.station, point.width)).collect());
            kerbs.push(points.map(|points| profile(reader, &key, "station", 0.0..=5000.0, points)).transpose()?);
            let key = format!("arm[{index}].splitter_gutter");
            let written = arm.splitter_gutter.map(|width| reader.within(&key, width, 0.0..=3.0, "m")).transpose()?;
            if written.is_some() && arm.splitter.is_empty() {
                return Err(reader.invalid(
                    key,
                    "given",
                    "this arm has no splitter island: give it one or leave this out",
                ));
            }
            differ |= written.is_some();
            if !arm.splitter.is_empty() {
                splitters.push(written.unwrap_or(self.ring.gutter));
            }
        }
        differ |= kerbs.iter().any(Option::is_some);
        Ok(differ.then_some(Gutters { ring: self.ring.gutter, island, mouths, kerbs, splitters }))
    }
}

/// A checked list of points; those with bearings are in degrees.
fn profile(
    reader: &Reader,
    key: &str,
    name: &str,
    range: std::ops::RangeInclusive<f64>,
    written: Vec<(f64, f64)>,
) -> Result<Profile, Error> {
    let around = name == "bearing_deg";
    let unit = if around { "deg" } else { "m" };
    reader.length(key, written.len(), 1..=MOST_POINTS, "points")?;
    let mut points: Vec<(f64, f64)> = Vec::new();
    for (index, &(x, width)) in written.iter().enumerate() {
        let x = reader.within(&format!("{key}[{index}].{name}"), x, range.clone(), unit)?;
        let width = reader.within(&format!("{key}[{index}].width"), width, 0.0..=3.0, "m")?;
        let (least, most) =
            (points.last().map(|last| last.0), if around { written[0].0 + 360.0 } else { f64::INFINITY });
        if least.is_some_and(|least| x <= least) || most <= x {
            let value = format_args!("{} {unit}", shown(x)).to_string();
            let expected = match (least, around) {
                (Some(least), true) => {
                    format!("must be more than {} deg and less than a turn after the first", shown(least))
                }
                (least, _) => {
                    format!("must be more than {} m, because points follow the kerb", shown(least.unwrap_or(0.0)))
                }
            };
            return Err(reader.invalid(format!("{key}[{index}].{name}"), value, expected));
        }
        points.push((x, width));
    }
    if around {
        points.iter_mut().for_each(|point| point.0 = point.0.to_radians());
    }
    Ok(Profile { points, around })
}

impl Gutters {
    /// The edges of the lanes between `faces`, whose first loop consists of the kerbs from each arm to the next, and
    /// the arms' ends; then come the island and the splitter islands.
    pub(super) fn edges(
        &self,
        reader: &Reader,
        ring: &Ring,
        faces: &Outline,
        corners: &[Curve],
    ) -> Result<Outline, Error> {
        let mut solid = Vec::new();
        for (index, corner) in corners.iter().enumerate() {
            let width = |s: f64, _| self.kerbs[index].as_ref().map_or(self.ring, |profile| profile.at(s));
            strip(corner, false, width, &mut solid);
            let next = &corners[(index + 1) % corners.len()];
            let end = Piece::Segment { from: corner.point_at(f64::INFINITY), to: next.point_at(0.0) };
            strip(&Curve { pieces: vec![end] }, false, |_, _| self.ring, &mut solid);
        }
        let at = |profile: &Profile, p: DVec2| profile.at(p.to_angle());
        strip(
            &faces.loops[1],
            true,
            |_, p| self.island.as_ref().map_or(self.ring, |profile| at(profile, p)),
            &mut solid,
        );
        for (&width, splitter) in self.splitters.iter().zip(faces.loops.iter().skip(2)) {
            strip(splitter, true, |_, _| width, &mut solid);
        }
        if let Some(mouths) = &self.mouths {
            strip(&Curve::circle(DVec2::ZERO, ring.outer()), true, |_, p| at(mouths, p), &mut solid);
        }
        let edges = left(faces, solid);
        // The outer boundary and the island, apart from each other.
        if edges.loops.len() < 2 {
            if self.mouths.is_some() {
                let expected = "with the others it leaves no way through; it must be 0 where an arm has its mouth";
                return Err(reader.invalid("ring.mouth_gutter", "given", expected));
            }
            let value = format_args!("{} m and others", shown(self.ring)).to_string();
            return Err(reader.invalid(
                "ring.gutter",
                value,
                "leave no way around the island: make the gutters narrower",
            ));
        }
        Ok(edges)
    }
}

/// Adds the triangles that cover the strip of varying width on the left of a curve.
fn strip(curve: &Curve, closed: bool, width: impl Fn(f64, DVec2) -> f64, triangles: &mut Vec<Vec<DVec2>>) {
    let mut begin = 0.0;
    let mut before: Option<f64> =
        if closed { curve.pieces.last().map(|last| last.heading_at(last.length())) } else { None };
    for piece in &curve.pieces {
        let length = piece.length();
        let step = match piece {
            Piece::Segment { .. } => SPACING,
            Piece::Arc { radius, .. } => (8.0 * radius * FINE).sqrt().min(SPACING),
        };
        let steps = (length / step).ceil().max(1.0) as usize;
        let across = |i: f64| {
            let s = length * i / steps as f64;
            let p = piece.point_at(s);
            let width = width(begin + s, p);
            (p, p + DVec2::from_angle(piece.heading_at(s)).perp() * width, width)
        };
        let (first, _, at_first) = across(0.0);
        if let Some(before) = before {
            pie(first, at_first, before, wrapped(piece.heading_at(0.0) - before), triangles);
        }
        let at = |i: f64| width(begin + length * i / steps as f64, piece.point_at(length * i / steps as f64));
        let stations: Vec<f64> = (0..steps)
            .flat_map(|i| linear(&at, i as f64, (i + 1) as f64, NEAREST / step))
            .chain([steps as f64])
            .collect();
        for ends in stations.windows(2) {
            let ((a, a_left, from), (b, b_left, to)) = (across(ends[0]), across(ends[1]));
            if 0.0 < from.max(to) {
                triangles.extend([vec![a, b, b_left], vec![a, b_left, a_left]]);
            }
        }
        before = Some(piece.heading_at(length));
        begin += length;
    }
}

/// Beginnings of the parts of an interval in which a width is linear within a millimetre, or which are no longer than
/// `least`.
fn linear(width: &impl Fn(f64) -> f64, from: f64, to: f64, least: f64) -> Vec<f64> {
    let (first, last) = (width(from), width(to));
    let bent = |i: i32| {
        1e-3 < (width(from + (to - from) * f64::from(i) / 16.0) - (first + (last - first) * f64::from(i) / 16.0)).abs()
    };
    if to - from <= least || !(1..16).any(bent) {
        return vec![from];
    }
    let middle = (from + to) / 2.0;
    [linear(width, from, middle, least), linear(width, middle, to, least)].concat()
}

/// Adds the sector that opens on the left of a corner that turns right.
fn pie(corner: DVec2, radius: f64, heading: f64, turn: f64, triangles: &mut Vec<Vec<DVec2>>) {
    if -1e-9 < turn || radius <= 0.0 {
        return;
    }
    let steps = (-turn / (8.0 * FINE / radius).sqrt()).ceil().max(1.0) as usize;
    let at = |i: usize| corner + radius * DVec2::from_angle(heading + turn * i as f64 / steps as f64).perp();
    triangles.extend((0..steps).map(|i| vec![corner, at(i), at(i + 1)]));
}

/// What is left between the faces without the triangles.
fn left(faces: &Outline, triangles: Vec<Vec<DVec2>>) -> Outline {
    let polygon = |curve: &Curve| counter_clockwise(curve.polyline(FINE));
    let road = Area::union(faces.loops.iter().take(1).map(polygon))
        .minus(&Area::union(faces.loops.iter().skip(1).map(polygon)));
    let lanes = road.minus(&Area::union(triangles.into_iter().map(counter_clockwise)));
    let lanes = lanes.without_slits(SLIT, 0.0);
    let size = |part: &[Vec<[f64; 2]>]| part.iter().map(|contour| signed_area(contour)).sum::<f64>();
    let largest = lanes.parts.iter().max_by(|one, other| size(one).total_cmp(&size(other)));
    // Triangles side by side leave pinholes between them, which are no islands.
    let contours = largest.into_iter().flatten().filter(|contour| PINHOLE < signed_area(contour).abs());
    // Rounded corners stay: benchmarks with these edges keep their bits.
    let loops = contours.map(|contour| bulging_outline(&points(contour), FITTED, f64::INFINITY));
    Outline::new(loops.filter(|curve| !curve.pieces.is_empty()).collect())
}
