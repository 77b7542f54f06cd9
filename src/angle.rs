//! Angles in plain f32 arithmetic, so that every engine can compute the same bits.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// `angle` brought into (-pi, pi], for an angle within a few turns of it.
#[inline]
pub fn wrapped(angle: f32) -> f32 {
    let turned = angle - TAU * (angle * (1.0 / TAU)).round();
    if turned <= -PI { turned + TAU } else { turned }
}

/// Angle of (x, y) from the x axis in (-pi, pi], 0 for the origin; within 4e-7 of the true one.
///
/// S. Moshier's Cephes polynomial for the arc tangent; library functions of different engines differ by more than this is off.
#[inline]
pub fn atan2(y: f32, x: f32) -> f32 {
    let (small, large) = (x.abs().min(y.abs()), x.abs().max(y.abs()));
    let ratio = small / large.max(f32::MIN_POSITIVE);
    // tan(pi/8): beyond it the polynomial works on the angle's difference from 45 deg.
    let steep = 0.414_213_56 < ratio;
    let reduced = if steep { (ratio - 1.0) / (ratio + 1.0) } else { ratio };
    let square = reduced * reduced;
    let series = ((0.080_537_445 * square - 0.138_776_85) * square + 0.199_777_11) * square - 0.333_329_5;
    let octant = series * square * reduced + reduced + if steep { FRAC_PI_4 } else { 0.0 };
    let quadrant = if x.abs() < y.abs() { FRAC_PI_2 - octant } else { octant };
    let half = if x < 0.0 { PI - quadrant } else { quadrant };
    if y < 0.0 { -half } else { half }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arc_tangent_agrees_with_the_library_all_around() {
        for i in 0..100_000 {
            let angle = f64::from(i) / 100_000.0 * std::f64::consts::TAU - std::f64::consts::PI;
            for radius in [1e-3, 1.0, 40.0] {
                let (y, x) = ((radius * angle.sin()) as f32, (radius * angle.cos()) as f32);
                let difference = f64::from(atan2(y, x)) - f64::from(y).atan2(f64::from(x));
                // Half an ulp of pi is 1.2e-7; the polynomial adds 2e-7.
                assert!(difference.abs() < 4e-7, "{x} {y}: {difference}");
            }
        }
        assert_eq!(atan2(0.0, 0.0), 0.0);
        assert_eq!(atan2(0.0, -1.0), PI);
    }

    #[test]
    fn a_wrapped_angle_points_the_same_way_and_lies_in_its_range() {
        for i in -4000..4000 {
            let angle = i as f32 * 0.005;
            let turned = wrapped(angle);
            assert!(-PI < turned && turned <= PI);
            // The rounding of an angle of 20 rad is 2e-6.
            assert!((turned.sin() - angle.sin()).abs() < 4e-6 && (turned.cos() - angle.cos()).abs() < 4e-6);
        }
        assert_eq!(wrapped(-PI), PI);
    }
}
