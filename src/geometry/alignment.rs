//! Road alignments: points joined by straights, each corner rounded by an arc, the last straight led into a circle.

use std::f64::consts::TAU;

use glam::DVec2;

use super::{Curve, Piece};

/// A corner of an alignment: the intersection of two straights, and the radius of the arc that rounds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    /// Intersection of the straights (m).
    pub at: DVec2,
    /// Radius of the arc between them; 0 leaves the corner sharp (m).
    pub radius: f64,
}

/// A bend that does not fit: its arc would begin before the one before it ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Misfit {
    /// Index of the bend.
    pub bend: usize,
    /// The largest radius that fits, all others unchanged (m).
    pub largest: f64,
}

/// The curve along `bends`. The first and the last are its ends; if it is `closed`, they are joined and rounded too.
///
/// # Errors
///
/// The first bend whose arc does not fit.
pub fn rounded(bends: &[Bend], closed: bool) -> Result<Curve, Misfit> {
    let n = bends.len();
    let inner = |index: usize| closed || (0 < index && index + 1 < n);
    let arcs: Vec<Rounding> = (0..n)
        .map(|index| {
            let (before, after) = (bends[(index + n - 1) % n].at, bends[(index + 1) % n].at);
            if inner(index) { Rounding::new(before, bends[index], after) } else { Rounding::none(bends[index].at) }
        })
        .collect();
    let mut pieces = Vec::new();
    for index in 0..if closed { n } else { n.saturating_sub(1) } {
        let next = (index + 1) % n;
        let (here, there) = (&arcs[index], &arcs[next]);
        let free = bends[index].at.distance(bends[next].at) - here.tangent - there.tangent;
        if free < -1e-9 || !free.is_finite() {
            let at_fault = if here.tangent < there.tangent { next } else { index };
            let rounding = &arcs[at_fault];
            return Err(Misfit {
                bend: at_fault,
                largest: (bends[at_fault].radius * (1.0 + free / rounding.tangent)).max(0.0),
            });
        }
        if 1e-9 < free {
            pieces.push(Piece::Segment { from: here.end, to: there.begin });
        }
        pieces.extend(there.arc);
    }
    Ok(Curve { pieces })
}

/// The arc of `radius` that leads the straight from `origin` in `direction` (of length 1) into the circle of radius
/// `circle` around the plane's origin, which is travelled counter-clockwise, and the direction from the plane's origin
/// to the point of contact (rad).
///
/// A straight that would cut the circle is led in by a right turn from outside; one that would pass it, by a left turn
/// wider than the circle. `None` if no such arc begins ahead.
pub fn to_circle(origin: DVec2, direction: DVec2, circle: f64, radius: f64) -> Option<(Piece, f64)> {
    let (ahead, left) = (-origin.dot(direction), direction.perp_dot(-origin));
    let turn = if left < circle { -1.0 } else { 1.0 };
    // The arc's centre lies `radius` beside the straight, and `apart` from the circle's centre because the circles are
    // tangent.
    let apart = circle - turn * radius;
    let begin = ahead - (apart.powi(2) - (left - turn * radius).powi(2)).sqrt();
    if begin.is_nan() || begin < 0.0 || (0.0 < turn && radius <= circle) {
        return None;
    }
    let centre = origin + direction * begin + direction.perp() * turn * radius;
    let from = (direction.perp() * -turn).to_angle();
    // The point of contact is on the line through the two centres: between them, or beyond the circle's.
    let arrival = (centre * -turn).to_angle();
    let until = (-centre).to_angle();
    let sweep = turn * (turn * (until - from)).rem_euclid(TAU);
    Some((Piece::Arc { centre, radius, from, sweep }, arrival))
}

struct Rounding {
    /// Distance from the bend's point to either end of its arc (m).
    tangent: f64,
    begin: DVec2,
    end: DVec2,
    arc: Option<Piece>,
}

impl Rounding {
    fn none(at: DVec2) -> Rounding {
        Rounding { tangent: 0.0, begin: at, end: at, arc: None }
    }

    fn new(before: DVec2, bend: Bend, after: DVec2) -> Rounding {
        let (arriving, leaving) = ((bend.at - before).normalize_or_zero(), (after - bend.at).normalize_or_zero());
        let turn = arriving.angle_to(leaving);
        let tangent = bend.radius * (turn / 2.0).tan().abs();
        if bend.radius == 0.0 || turn.abs() < 1e-9 {
            return Rounding::none(bend.at);
        }
        let begin = bend.at - arriving * tangent;
        let centre = begin + arriving.perp() * bend.radius * turn.signum();
        let from = (begin - centre).to_angle();
        let arc = Piece::Arc { centre, radius: bend.radius, from, sweep: turn };
        Rounding { tangent, begin, end: bend.at + leaving * tangent, arc: Some(arc) }
    }
}
