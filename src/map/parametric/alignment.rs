//! A kerb or a lane of one carriageway: bends on the way from the arm's end towards the ring, and the arc that leads
//! into the ring.
//!
//! Coordinates are those of an entry: x along the arm's bearing, y to the right of a vehicle that enters. An exit is
//! stored as its mirror image.

use glam::DVec2;

use crate::geometry::{Bend, Curve, Misfit, Piece, rounded, to_circle};

/// Which carriageway of an arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    Entry,
    Exit,
}

impl Way {
    pub(super) fn name(self) -> &'static str {
        match self {
            Way::Entry => "entry",
            Way::Exit => "exit",
        }
    }

    /// The curve moved from the alignment's frame into the world.
    pub(super) fn placed(self, curve: &Curve, bearing: f64) -> Curve {
        match self {
            Way::Entry => curve.turned(bearing),
            Way::Exit => curve.mirrored().turned(bearing),
        }
    }

    fn point(self, p: DVec2, bearing: f64) -> DVec2 {
        let mirror = if self == Way::Entry { 1.0 } else { -1.0 };
        DVec2::from_angle(bearing).rotate(p * DVec2::new(1.0, mirror))
    }
}

/// Why an alignment is no curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Fault {
    /// The arc at this point does not fit; largest radius that does (m).
    Point(usize, f64),
    /// No arc of `ring_radius` leads the last straight into the ring.
    Ring,
    /// The last straights of two arms do not meet.
    Apart,
    /// The arc between two arms does not fit; largest radius that does (m).
    Corner(f64),
    /// The arc at this point of the next arm does not fit; largest radius that does (m).
    NextPoint(usize, f64),
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Alignment {
    /// The arm's end, then the points of the file; the last is where the last straight aims.
    pub(super) bends: Vec<Bend>,
    pub(super) ring_radius: f64,
}

impl Alignment {
    /// The curve from the arm's end to where it touches the circle of radius `circle` around the ring's centre, and the
    /// direction from the centre to that point (rad).
    pub(super) fn lead(&self, circle: f64) -> Result<(Curve, f64), Fault> {
        let (legs, origin, direction) = self.last_straight();
        let (arc, arrival) = to_circle(origin, direction, circle, self.ring_radius).ok_or(Fault::Ring)?;
        let mut bends = legs.to_vec();
        bends.push(Bend { at: arc.start(), radius: 0.0 });
        let mut curve = rounded(&bends, false).map_err(|misfit| self.fault(misfit))?;
        curve.pieces.push(arc);
        Ok((curve, arrival))
    }

    /// The alignment `distance` to the left of this one, which leads to the circle of radius `circle`; `None` if a bend
    /// is too sharp for it (m).
    pub(super) fn beside(&self, distance: f64, circle: f64) -> Option<Alignment> {
        let n = self.bends.len();
        let direction = |index: usize| (self.bends[index + 1].at - self.bends[index].at).normalize_or_zero();
        let mut bends = Vec::with_capacity(n);
        for (index, bend) in self.bends.iter().enumerate() {
            let (arriving, leaving) = (direction(index.max(1) - 1), direction(index.min(n - 2)));
            // The moved straights meet on the bisector of the bend.
            let bisector = (arriving + leaving).perp();
            let reach = 2.0 * distance / bisector.length_squared();
            let turn = arriving.perp_dot(leaving).signum();
            let radius = if bend.radius == 0.0 { 0.0 } else { bend.radius - turn * distance };
            if radius < 0.0 || !reach.is_finite() {
                return None;
            }
            bends.push(Bend { at: bend.at + bisector * reach, radius });
        }
        // The arc into the ring turns right, and widens to the left, unless the last straight passes the ring.
        let (_, origin, direction) = self.last_straight();
        let passes = circle <= direction.perp_dot(-origin);
        let ring_radius = self.ring_radius + if passes { -distance } else { distance };
        (0.0 < ring_radius).then_some(Alignment { bends, ring_radius })
    }

    /// All bends but the last, and the origin and direction of the last straight.
    fn last_straight(&self) -> (&[Bend], DVec2, DVec2) {
        let n = self.bends.len();
        let origin = self.bends[n - 2].at;
        (&self.bends[..n - 1], origin, (self.bends[n - 1].at - origin).normalize_or_zero())
    }

    /// The first bend is the arm's end, which is not a point of the file: point 0 is bend 1.
    fn fault(&self, misfit: Misfit) -> Fault {
        if misfit.bend == 0 || self.bends.len() <= misfit.bend + 1 {
            Fault::Ring
        } else {
            Fault::Point(misfit.bend - 1, misfit.largest)
        }
    }
}

/// The curve from the end of one arm to the end of the next outside the ring: the corner of the last straights, rounded
/// by `radius` (m).
pub(super) fn around(entry: (&Alignment, f64), exit: (&Alignment, f64), radius: f64) -> Result<Curve, Fault> {
    let placed = |alignment: &Alignment, way: Way, bearing: f64| -> Vec<Bend> {
        alignment.bends.iter().map(|bend| Bend { at: way.point(bend.at, bearing), radius: bend.radius }).collect()
    };
    let mut bends = placed(entry.0, Way::Entry, entry.1);
    let mut after = placed(exit.0, Way::Exit, exit.1);
    let (Some(aim), Some(after_aim)) = (bends.pop(), after.pop()) else { return Err(Fault::Apart) };
    let (from, after_from) = (bends[bends.len() - 1].at, after[after.len() - 1].at);
    let (ahead, after_ahead) = (aim.at - from, after_aim.at - after_from);
    let turn = ahead.perp_dot(after_ahead);
    let fraction = (after_from - from).perp_dot(after_ahead) / turn;
    let after_fraction = (after_from - from).perp_dot(ahead) / turn;
    if !(fraction.is_finite() && 0.0 < fraction && 0.0 < after_fraction) {
        return Err(Fault::Apart);
    }
    let corner = bends.len();
    bends.push(Bend { at: from + fraction * ahead, radius });
    let total = bends.len() + after.len();
    bends.extend(after.into_iter().rev());
    rounded(&bends, false).map_err(|misfit| match misfit.bend {
        bend if bend < corner && 0 < bend => Fault::Point(bend - 1, misfit.largest),
        bend if corner < bend && bend + 1 < total => Fault::NextPoint(total - bend - 2, misfit.largest),
        _ => Fault::Corner(misfit.largest),
    })
}

/// The arc of the circle of radius `circle` between two directions from its centre, counter-clockwise by `sweep`.
pub(super) fn ring_arc(circle: f64, from: f64, sweep: f64) -> Piece {
    Piece::Arc { centre: DVec2::ZERO, radius: circle, from, sweep }
}
