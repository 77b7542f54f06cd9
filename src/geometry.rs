//! Exact plane geometry: segments, arcs, the curves they form, and the outlines that curves enclose.
//!
//! Right-handed frame, x east, y north, metres and radians. Arcs are not approximated by polygons: distances, crossings
//! and rays are computed on the arcs themselves.

pub(crate) mod area; // polygons with holes
mod alignment;
mod circle;
mod fit;
mod meeting;
mod offset;
mod outline;
#[cfg(test)]
mod tests;

use std::f64::consts::{PI, TAU};

use glam::DVec2;

pub use alignment::{Bend, Misfit, rounded, to_circle};
pub use area::{ROUNDED, counter_clockwise};
pub(crate) use circle::fitted_circle;
pub(crate) use fit::arc_of_height;
pub use fit::{bulging_outline, fitted_line, fitted_outline};
pub use outline::{Nearby, Outline};

/// A straight or a circular piece of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Piece {
    /// A straight piece.
    Segment {
        /// Where the segment begins (m).
        from: DVec2,
        /// Where the segment ends (m).
        to: DVec2,
    },
    /// A circular piece.
    Arc {
        /// Centre of the arc's circle (m).
        centre: DVec2,
        /// Radius of the arc's circle, positive (m).
        radius: f64,
        /// Direction from the centre to the arc's beginning (rad).
        from: f64,
        /// Angle covered, positive counter-clockwise, at most a full turn either way (rad).
        sweep: f64,
    },
}

impl Piece {
    /// Length along the piece (m).
    pub fn length(&self) -> f64 {
        match *self {
            Piece::Segment { from, to } => from.distance(to),
            Piece::Arc { radius, sweep, .. } => radius * sweep.abs(),
        }
    }

    /// First point (m).
    pub fn start(&self) -> DVec2 {
        match *self {
            Piece::Segment { from, .. } => from,
            Piece::Arc { centre, radius, from, .. } => centre + radius * DVec2::from_angle(from),
        }
    }

    /// Last point (m).
    pub fn end(&self) -> DVec2 {
        match *self {
            Piece::Segment { to, .. } => to,
            Piece::Arc { centre, radius, from, sweep } => centre + radius * DVec2::from_angle(from + sweep),
        }
    }

    /// The point `s` metres from the beginning, `s` within the piece (m).
    pub fn point_at(&self, s: f64) -> DVec2 {
        match *self {
            Piece::Segment { from, to } => from + (to - from).normalize_or_zero() * s,
            Piece::Arc { centre, radius, from, sweep } => {
                centre + radius * DVec2::from_angle(from + s / radius * sweep.signum())
            }
        }
    }

    /// Direction of travel `s` metres from the beginning, in (-pi, pi] (rad).
    pub fn heading_at(&self, s: f64) -> f64 {
        match *self {
            Piece::Segment { from, to } => (to - from).to_angle(),
            Piece::Arc { radius, from, sweep, .. } => wrapped(from + (s / radius + PI / 2.0) * sweep.signum()),
        }
    }

    /// Distance from `p` to the nearest point of the piece (m).
    pub fn distance(&self, p: DVec2) -> f64 {
        match *self {
            Piece::Segment { from, to } => {
                let along = to - from;
                let fraction = ((p - from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                p.distance(from + fraction * along)
            }
            Piece::Arc { centre, radius, .. } => {
                let out = p - centre;
                if self.faces(out) {
                    (out.length() - radius).abs()
                } else {
                    p.distance(self.start()).min(p.distance(self.end()))
                }
            }
        }
    }

    /// This piece in the opposite direction.
    pub fn reversed(&self) -> Piece {
        match *self {
            Piece::Segment { from, to } => Piece::Segment { from: to, to: from },
            Piece::Arc { centre, radius, from, sweep } => {
                Piece::Arc { centre, radius, from: from + sweep, sweep: -sweep }
            }
        }
    }

    /// This piece turned counter-clockwise around the origin by `angle` (rad).
    pub fn turned(&self, angle: f64) -> Piece {
        let turn = DVec2::from_angle(angle);
        match *self {
            Piece::Segment { from, to } => Piece::Segment { from: turn.rotate(from), to: turn.rotate(to) },
            Piece::Arc { centre, radius, from, sweep } => {
                Piece::Arc { centre: turn.rotate(centre), radius, from: from + angle, sweep }
            }
        }
    }

    /// The mirror image of the piece in the x axis.
    pub fn mirrored(&self) -> Piece {
        let mirror = DVec2::new(1.0, -1.0);
        match *self {
            Piece::Segment { from, to } => Piece::Segment { from: from * mirror, to: to * mirror },
            Piece::Arc { centre, radius, from, sweep } => {
                Piece::Arc { centre: centre * mirror, radius, from: -from, sweep: -sweep }
            }
        }
    }

    /// The part between `from` and `to` metres from the beginning.
    pub fn part(&self, from: f64, to: f64) -> Piece {
        match *self {
            Piece::Segment { .. } => Piece::Segment { from: self.point_at(from), to: self.point_at(to) },
            Piece::Arc { centre, radius, from: angle, sweep } => Piece::Arc {
                centre,
                radius,
                from: angle + from / radius * sweep.signum(),
                sweep: (to - from) / radius * sweep.signum(),
            },
        }
    }

    /// The piece `distance` to the left of this one, or to the right of it if negative; `None` if an arc would shrink
    /// to nothing (m).
    pub fn beside(&self, distance: f64) -> Option<Piece> {
        match *self {
            Piece::Segment { from, to } => {
                let left = (to - from).normalize_or_zero().perp() * distance;
                Some(Piece::Segment { from: from + left, to: to + left })
            }
            Piece::Arc { centre, radius, from, sweep } => {
                let radius = radius - distance * sweep.signum();
                (0.0 < radius).then_some(Piece::Arc { centre, radius, from, sweep })
            }
        }
    }

    /// Whether an arc has a point in direction `out` from its centre; always for a segment.
    pub(crate) fn faces(&self, out: DVec2) -> bool {
        match *self {
            Piece::Segment { .. } => true,
            Piece::Arc { from, sweep, .. } => {
                let half = sweep.abs() / 2.0;
                PI <= half || out.length() * half.cos() <= out.dot(DVec2::from_angle(from + sweep / 2.0))
            }
        }
    }

    /// Station of `p`, a point of the piece: its distance from the beginning along the piece (m).
    pub(crate) fn station(&self, p: DVec2) -> f64 {
        match *self {
            Piece::Segment { from, to } => (p - from).dot((to - from).normalize_or_zero()).clamp(0.0, self.length()),
            Piece::Arc { centre, radius, from, sweep } => {
                let turned = ((p - centre).to_angle() - from) * sweep.signum();
                // Rounding may put a point just before the beginning, which must not count as nearly a full turn.
                let slack = (TAU - sweep.abs()) / 2.0;
                let turned = (turned + slack).rem_euclid(TAU) - slack;
                turned.clamp(0.0, sweep.abs()) * radius
            }
        }
    }
}

/// A chain of pieces, each beginning where the one before it ends; closed where the last ends at the first's beginning.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curve {
    /// The pieces in order of travel.
    pub pieces: Vec<Piece>,
}

impl Curve {
    /// A whole circle, counter-clockwise from east.
    pub fn circle(centre: DVec2, radius: f64) -> Curve {
        Curve { pieces: vec![Piece::Arc { centre, radius, from: 0.0, sweep: TAU }] }
    }

    /// Length along the curve (m).
    pub fn length(&self) -> f64 {
        self.pieces.iter().map(Piece::length).sum()
    }

    /// The point `s` metres from the beginning, `s` clamped to the curve; the origin for a curve without pieces (m).
    pub fn point_at(&self, s: f64) -> DVec2 {
        self.piece_at(s).map_or(DVec2::ZERO, |(piece, s)| piece.point_at(s))
    }

    /// Direction of travel `s` metres from the beginning, `s` clamped to the curve, in (-pi, pi] (rad).
    pub fn heading_at(&self, s: f64) -> f64 {
        self.piece_at(s).map_or(0.0, |(piece, s)| piece.heading_at(s))
    }

    /// Radius of the tightest arc; infinite for a curve without arcs (m).
    pub fn least_radius(&self) -> f64 {
        let radius = |piece: &Piece| match *piece {
            Piece::Arc { radius, .. } => radius,
            Piece::Segment { .. } => f64::INFINITY,
        };
        self.pieces.iter().map(radius).fold(f64::INFINITY, f64::min)
    }

    /// Distance from `p` to the nearest point of the curve; infinite for a curve without pieces (m).
    pub fn distance(&self, p: DVec2) -> f64 {
        self.pieces.iter().map(|piece| piece.distance(p)).fold(f64::INFINITY, f64::min)
    }

    /// Points on the curve, both ends included, whose chords leave it by at most `tolerance` (m).
    pub fn polyline(&self, tolerance: f64) -> Vec<DVec2> {
        let mut points: Vec<DVec2> = self.pieces.first().map(Piece::start).into_iter().collect();
        for piece in &self.pieces {
            let chords = match *piece {
                Piece::Segment { .. } => 1.0,
                Piece::Arc { radius, sweep, .. } => {
                    let largest = 2.0 * (1.0 - tolerance / radius).clamp(-1.0, 1.0).acos();
                    (sweep.abs() / largest.max(1e-3)).ceil().max(1.0)
                }
            };
            points.extend((1..=chords as usize).map(|chord| piece.point_at(piece.length() * chord as f64 / chords)));
        }
        points
    }

    /// The points of a closed curve as a polygon, each once. Where the curve crosses itself in a loop of less than a
    /// few millimetres, as one that was fitted to a map may, the polygon does not.
    pub fn polygon(&self, tolerance: f64) -> Vec<DVec2> {
        let mut points = self.polyline(tolerance);
        points.pop();
        area::uncrossed(points)
    }

    /// This curve in the opposite direction.
    pub fn reversed(&self) -> Curve {
        Curve { pieces: self.pieces.iter().rev().map(Piece::reversed).collect() }
    }

    /// This curve turned counter-clockwise around the origin by `angle` (rad).
    pub fn turned(&self, angle: f64) -> Curve {
        Curve { pieces: self.pieces.iter().map(|piece| piece.turned(angle)).collect() }
    }

    /// The mirror image of the curve in the x axis, in the same order of travel.
    pub fn mirrored(&self) -> Curve {
        Curve { pieces: self.pieces.iter().map(Piece::mirrored).collect() }
    }

    /// The part between `from` and `to` metres from the beginning, both clamped to the curve.
    pub fn part(&self, from: f64, to: f64) -> Curve {
        let mut begin = 0.0;
        let mut pieces = Vec::new();
        for piece in &self.pieces {
            let length = piece.length();
            let (first, last) = ((from - begin).max(0.0), (to - begin).min(length));
            if first < last {
                pieces.push(if first == 0.0 && last == length { *piece } else { piece.part(first, last) });
            }
            begin += length;
        }
        Curve { pieces }
    }

    /// Station of the curve's point nearest to `p`: its distance from the beginning along the curve (m).
    pub fn station(&self, p: DVec2) -> f64 {
        let mut begin = 0.0;
        let mut best = (f64::INFINITY, 0.0);
        for piece in &self.pieces {
            let distance = piece.distance(p);
            if distance < best.0 {
                best = (distance, begin + piece.station(p));
            }
            begin += piece.length();
        }
        best.1
    }

    /// The whole curve in numbers, for keys of what is computed from it.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        let piece = |piece: &Piece| match *piece {
            Piece::Segment { from, to } => vec![0.0, from.x, from.y, to.x, to.y],
            Piece::Arc { centre, radius, from, sweep } => vec![1.0, centre.x, centre.y, radius, from, sweep],
        };
        std::iter::once(self.pieces.len() as f64).chain(self.pieces.iter().flat_map(piece)).collect()
    }

    /// The area enclosed by a closed curve, positive counter-clockwise (m²).
    pub fn signed_area(&self) -> f64 {
        let area = |piece: &Piece| match *piece {
            Piece::Segment { from, to } => from.perp_dot(to) / 2.0,
            Piece::Arc { centre, radius, sweep, .. } => {
                let (start, end) = (piece.start(), piece.end());
                (centre.perp_dot(end - start) + radius * radius * sweep) / 2.0
            }
        };
        self.pieces.iter().map(area).sum()
    }

    fn piece_at(&self, s: f64) -> Option<(&Piece, f64)> {
        let mut left = s.max(0.0);
        for piece in &self.pieces {
            let length = piece.length();
            if left < length {
                return Some((piece, left));
            }
            left -= length;
        }
        self.pieces.last().map(|piece| (piece, piece.length()))
    }
}

/// `angle` brought into (-pi, pi] (rad).
pub fn wrapped(angle: f64) -> f64 {
    PI - (PI - angle).rem_euclid(TAU)
}
