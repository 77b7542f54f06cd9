//! A kerb or a lane of one carriageway while it is drawn: the corners of its straights, led into the ring.
//!
//! Coordinates are those of an entry: x along the arm's bearing, y to the right of a vehicle that enters. An exit is
//! drawn as its mirror image.

use glam::DVec2;

use super::Reason;
use crate::geometry::{Bend, to_circle};
use crate::map::parametric::written::{WrittenAlignment, WrittenPoint};

/// Part of a straight that the bend at its end may take.
const TAKEN: f64 = 0.48;

/// The arm's end, the bends on the way in, and the last straight.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Line {
    /// Bends from the arm's end inwards; the last begins the last straight.
    pub(super) bends: Vec<Bend>,
    /// Direction of the last straight, of length 1.
    pub(super) direction: DVec2,
    /// Radius of the arc that leads it into the ring (m).
    pub(super) ring_radius: f64,
}

impl Line {
    /// The line `distance` to the left of this one; `None` where a bend is too sharp for it (m).
    pub(super) fn beside(&self, distance: f64) -> Option<Line> {
        let n = self.bends.len();
        let direction = |index: usize| {
            if index + 1 < n {
                (self.bends[index + 1].at - self.bends[index].at).normalize_or_zero()
            } else {
                self.direction
            }
        };
        let mut bends = Vec::with_capacity(n);
        for (index, bend) in self.bends.iter().enumerate() {
            let (arriving, leaving) = (direction(index.saturating_sub(1)), direction(index));
            // The moved straights meet on the bisector of the bend.
            let bisector = (arriving + leaving).perp();
            let radius =
                if bend.radius == 0.0 { 0.0 } else { bend.radius - arriving.perp_dot(leaving).signum() * distance };
            if radius < 0.0 {
                return None;
            }
            bends.push(Bend { at: bend.at + bisector * (2.0 * distance / bisector.length_squared()), radius });
        }
        Some(Line { bends, direction: self.direction, ring_radius: self.ring_radius + distance })
    }

    /// Radius of the widest arc that leads the last straight into a circle without taking all of it (m).
    pub(super) fn widest_arc(&self, circle: f64) -> f64 {
        let last = self.bends[self.bends.len() - 1].at;
        let (ahead, left) = (-last.dot(self.direction), self.direction.perp_dot(-last));
        ((0.9 * ahead).powi(2) - circle.powi(2) + left.powi(2)) / (2.0 * (circle - left)).max(1e-9)
    }

    /// Direction from the ring's centre to where the line meets a circle around it, from the arm's bearing (rad).
    pub(super) fn arrival(&self, circle: f64) -> Option<f64> {
        to_circle(self.bends[self.bends.len() - 1].at, self.direction, circle, self.ring_radius)
            .map(|(_, arrival)| arrival)
    }

    /// Makes each bend as wide as its straights allow where it is wider. `circle` is the radius of the circle that the
    /// line leads into (m).
    pub(super) fn fit(&mut self, circle: f64) -> Result<(), Reason> {
        let n = self.bends.len();
        let last = self.bends[n - 1].at;
        let (arc, _) = to_circle(last, self.direction, circle, self.ring_radius).ok_or(Reason::NoArc)?;
        let free = arc.start().distance(last);
        for index in 1..n {
            let (before, here) = (self.bends[index - 1].at, self.bends[index].at);
            let (leaving, after) = match self.bends.get(index + 1) {
                Some(next) => ((next.at - here).normalize_or_zero(), TAKEN * next.at.distance(here)),
                None => (self.direction, 0.95 * free),
            };
            let half = ((here - before).normalize_or_zero().angle_to(leaving) / 2.0).abs().tan();
            let most = (TAKEN * before.distance(here)).min(after) / half.max(1e-9);
            self.bends[index].radius = self.bends[index].radius.min(most);
        }
        Ok(())
    }

    /// Length of the last straight that its bend takes (m).
    pub(super) fn tangent(&self) -> f64 {
        let n = self.bends.len();
        let arriving =
            if 1 < n { (self.bends[n - 1].at - self.bends[n - 2].at).normalize_or_zero() } else { self.direction };
        self.bends[n - 1].radius * (arriving.angle_to(self.direction) / 2.0).abs().tan()
    }

    /// Where the line's straights, prolonged where the bends are, lie at this distance along the arm (m).
    pub(super) fn y(&self, x: f64) -> f64 {
        let after = self.bends.iter().position(|bend| bend.at.x <= x).unwrap_or(self.bends.len());
        let (from, along) = match after {
            0 => (self.bends[0].at, DVec2::NEG_X),
            after if after < self.bends.len() => {
                (self.bends[after - 1].at, self.bends[after].at - self.bends[after - 1].at)
            }
            after => (self.bends[after - 1].at, self.direction),
        };
        from.y + (x - from.x) * along.y / along.x
    }

    /// The line as a file has it. `side` is 1 for an entry, -1 for an exit.
    pub(super) fn written(&self, side: f64) -> WrittenAlignment {
        let last = self.bends[self.bends.len() - 1].at;
        // The last straight aims at its point nearest to the ring's centre.
        let aim = last + self.direction * last.dot(-self.direction).max(1.0);
        let bends = self.bends.iter().skip(1);
        let point = |at: DVec2, radius: Option<f64>| WrittenPoint {
            along: millimetres(at.x),
            offset: millimetres(side * at.y),
            radius,
        };
        let points = bends.map(|bend| point(bend.at, Some(millimetres(bend.radius)))).chain([point(aim, None)]);
        WrittenAlignment { points: points.collect(), ring_radius: millimetres(self.ring_radius) }
    }
}

/// Rounded to millimetres, never to -0: the text of a road must not depend on a platform's last bit (m).
pub(super) fn millimetres(value: f64) -> f64 {
    (value * 1e3).round() / 1e3 + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> Line {
        let bend = |x: f64, y: f64, radius: f64| Bend { at: DVec2::new(x, y), radius };
        let bends = vec![bend(90.0, 8.0, 0.0), bend(50.0, 8.0, 30.0), bend(30.0, 10.0, 500.0)];
        Line { bends, direction: DVec2::new(-1.0, 0.3).normalize(), ring_radius: 15.0 }
    }

    #[test]
    fn a_line_beside_keeps_its_distance_on_every_straight() {
        let (line, beside) = (line(), line().beside(2.0).unwrap());
        for x in [80.0, 60.0, 25.0] {
            let steep = if x < 30.0 { line.direction } else { DVec2::NEG_X };
            assert!(((line.y(x) - beside.y(x)) * steep.x.abs() - 2.0).abs() < 1e-9, "{x}");
        }
        assert_eq!(beside.bends[1].radius, 32.0);
        assert!(line.beside(-31.0).is_none());
    }

    #[test]
    fn a_bend_that_is_too_wide_becomes_as_wide_as_fits() {
        let mut line = line();
        line.fit(20.0).unwrap();
        assert_eq!(line.bends[1].radius, 30.0);
        assert!(line.bends[2].radius < 500.0 && 10.0 < line.bends[2].radius);
        line.direction = DVec2::new(-0.1, 1.0).normalize();
        assert_eq!(line.fit(20.0), Err(Reason::NoArc));
    }

    #[test]
    fn a_rounded_number_has_three_decimals_and_no_minus_before_zero() {
        assert_eq!(
            [1.23449, -0.0004, -2.0006].map(millimetres).map(|value| value.to_string()),
            ["1.234", "0", "-2.001"]
        );
    }
}
