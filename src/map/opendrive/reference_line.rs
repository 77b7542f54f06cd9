//! The reference line of a road: points and headings along lines, arcs, spirals and cubics.
//!
//! Spirals are integrated by Gauss-Legendre quadrature, exact to 1e-9 m. A `poly3` is a cubic of u, so stations along
//! it are turned into u first.

use glam::DVec2;

use super::records::{Geometry, RoadRecord, Shape, active};

/// Abscissae and weights of Gauss-Legendre quadrature of eight points on -1..1, the positive half.
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_27),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// The integral of `f` from `from` to `to` in `n` equal parts.
fn integral(from: f64, to: f64, n: usize, f: impl Fn(f64) -> DVec2) -> DVec2 {
    let half = (to - from) / (2.0 * n as f64);
    let mut sum = DVec2::ZERO;
    for part in 0..n {
        let middle = from + half * (2 * part + 1) as f64;
        for (x, weight) in GAUSS {
            sum += weight * (f(middle - half * x) + f(middle + half * x));
        }
    }
    sum * half
}

/// A cubic's value and derivative.
fn cubic([a, b, c, d]: [f64; 4], x: f64) -> (f64, f64) {
    (a + x * (b + x * (c + x * d)), b + x * (2.0 * c + x * 3.0 * d))
}

/// The u at which the arc length of `v(u)` from 0 is `s`.
fn abscissa(v: [f64; 4], s: f64) -> f64 {
    let speed = |u: f64| cubic(v, u).1.hypot(1.0);
    // The curve is never shorter than u, so u lies in 0..s. A speed that varies much needs more parts.
    let fastest = speed(0.0).max(speed(s / 2.0)).max(speed(s));
    let parts = (4.0 + fastest.min(60.0)) as usize;
    let length = |u: f64| integral(0.0, u, parts, |u| DVec2::new(speed(u), 0.0)).x;
    let (mut low, mut high, mut u) = (0.0, s, s / fastest);
    for _ in 0..60 {
        let missing = length(u) - s;
        if missing.abs() < 1e-11 * s.max(1.0) {
            break;
        }
        if missing < 0.0 {
            low = u
        } else {
            high = u
        }
        let newton = u - missing / speed(u);
        u = if low < newton && newton < high { newton } else { (low + high) / 2.0 };
    }
    u
}

impl Geometry {
    /// Point and heading `s` metres from the piece's beginning (m), (rad).
    pub(super) fn pose(&self, s: f64) -> (DVec2, f64) {
        let turn = DVec2::from_angle(self.heading);
        let placed = |local: DVec2, heading: f64| (self.origin + turn.rotate(local), self.heading + heading);
        match self.shape {
            Shape::Line => placed(DVec2::new(s, 0.0), 0.0),
            Shape::Arc(curvature) => {
                let angle = curvature * s;
                // sin(x)/x and (1 - cos(x))/x stay exact for curvatures near 0.
                let half = angle / 2.0;
                let sinc = if half.abs() < 1e-6 { 1.0 - half * half / 6.0 } else { half.sin() / half };
                placed(s * sinc * DVec2::from_angle(half), angle)
            }
            Shape::Spiral(from, to) => {
                let rate = if 0.0 < self.length { (to - from) / self.length } else { 0.0 };
                let angle = |s: f64| s * (from + s * rate / 2.0);
                let turned = from.abs().max((from + rate * s).abs()) * s.abs();
                let parts = (turned / 0.5).ceil().clamp(1.0, 1e5) as usize;
                placed(integral(0.0, s, parts, |s| DVec2::from_angle(angle(s))), angle(s))
            }
            Shape::Poly3(v) => {
                let u = abscissa(v, s);
                let (value, slope) = cubic(v, u);
                placed(DVec2::new(u, value), slope.atan())
            }
            Shape::ParamPoly3 { u, v, normalised } => {
                let p = if normalised { s / self.length.max(1e-9) } else { s };
                let ((x, along), (y, across)) = (cubic(u, p), cubic(v, p));
                let ahead = DVec2::new(along, across);
                placed(DVec2::new(x, y), if ahead.length_squared() < 1e-24 { 0.0 } else { ahead.to_angle() })
            }
        }
    }

    /// The piece's last point (m).
    pub(super) fn end(&self) -> DVec2 {
        self.pose(self.length).0
    }
}

impl RoadRecord {
    /// Point and heading of the reference line at station `s` (m), (rad).
    pub(super) fn pose(&self, s: f64) -> (DVec2, f64) {
        // A road that was read has at least one geometry. Where the next begins late, the one before goes on straight.
        active(&self.plan, s, |geometry| geometry.start).map_or((DVec2::ZERO, 0.0), |geometry| {
            let along = (s - geometry.start).max(0.0);
            let (p, heading) = geometry.pose(along.min(geometry.length));
            (p + (along - geometry.length).max(0.0) * DVec2::from_angle(heading), heading)
        })
    }

    /// The point `t` metres left of the reference line at station `s` (m).
    pub(super) fn point(&self, s: f64, t: f64) -> DVec2 {
        let (p, heading) = self.pose(s);
        p + t * DVec2::from_angle(heading).perp()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn at(shape: Shape, length: f64) -> Geometry {
        Geometry { start: 0.0, origin: DVec2::new(3.0, -2.0), heading: PI / 2.0, length, shape }
    }

    #[test]
    fn a_quarter_of_a_circle_ends_beside_its_centre_and_a_flat_arc_is_a_line() {
        let (p, heading) = at(Shape::Arc(0.1), 5.0 * PI).pose(5.0 * PI);
        assert!(p.distance(DVec2::new(-7.0, 8.0)) < 1e-12 && (heading - PI).abs() < 1e-12);
        let (p, _) = at(Shape::Arc(1e-15), 100.0).pose(100.0);
        assert!(p.distance(DVec2::new(3.0, 98.0)) < 1e-9);
    }

    /// C(1) and S(1) of Abramowitz and Stegun, table 7.7: the clothoid with curvature pi s has these coordinates.
    #[test]
    fn a_spiral_from_a_straight_ends_at_the_fresnel_integrals() {
        let spiral = Geometry { origin: DVec2::ZERO, heading: 0.0, ..at(Shape::Spiral(0.0, PI), 1.0) };
        let fresnel = DVec2::new(0.779_893_400_376_822_8, 0.438_259_147_390_354_8);
        assert!(spiral.end().distance(fresnel) < 1e-12, "{}", spiral.end());
        // A clothoid a hundred times as large, with 1e-9 m of the closed form.
        let large = Geometry { length: 100.0, shape: Shape::Spiral(0.0, PI / 100.0), ..spiral };
        assert!(large.end().distance(100.0 * fresnel) < 1e-9);
        // C(5) and S(5): thirteen turns.
        let long = Geometry { length: 5.0, shape: Shape::Spiral(0.0, 5.0 * PI), ..spiral };
        assert!(
            long.end().distance(DVec2::new(0.563_631_188_704_012_3, 0.499_191_381_917_116_9)) < 1e-9,
            "{}",
            long.end()
        );
    }

    #[test]
    fn a_spiral_of_constant_curvature_is_an_arc() {
        for s in [0.1, 4.0, 30.0] {
            let (spiral, arc) = (at(Shape::Spiral(-0.07, -0.07), 30.0).pose(s), at(Shape::Arc(-0.07), 30.0).pose(s));
            assert!(spiral.0.distance(arc.0) < 1e-11 && (spiral.1 - arc.1).abs() < 1e-12);
        }
    }

    /// v = u² has the arc length u sqrt(1 + 4u²) / 2 + asinh(2u) / 4.
    #[test]
    fn a_parabola_is_measured_along_itself() {
        let parabola = Geometry { origin: DVec2::ZERO, heading: 0.0, ..at(Shape::Poly3([0.0, 0.0, 1.0, 0.0]), 20.0) };
        for u in [0.01, 0.5, 2.0, 4.0f64] {
            let s = u * (1.0 + 4.0 * u * u).sqrt() / 2.0 + (2.0 * u).asinh() / 4.0;
            let (p, heading) = parabola.pose(s);
            assert!(p.distance(DVec2::new(u, u * u)) < 1e-9, "{u}: {p}");
            assert!((heading - (2.0 * u).atan()).abs() < 1e-9);
        }
    }

    #[test]
    fn both_ranges_of_a_cubics_parameter_give_the_same_curve() {
        let normalised = Shape::ParamPoly3 { u: [0.0, 20.0, 0.0, -1.0], v: [0.0, 0.0, 6.0, -2.0], normalised: true };
        let (u, v) = ([0.0, 1.0, 0.0, -1.0 / 8000.0], [0.0, 0.0, 6.0 / 400.0, -2.0 / 8000.0]);
        let lengths = Shape::ParamPoly3 { u, v, normalised: false };
        for s in [0.0, 7.0, 20.0] {
            let (one, other) = (at(normalised, 20.0).pose(s), at(lengths, 20.0).pose(s));
            assert!(one.0.distance(other.0) < 1e-12 && (one.1 - other.1).abs() < 1e-12);
        }
    }
}
