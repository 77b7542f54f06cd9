//! Angles in plain f32 arithmetic, so that every engine can compute the same bits.

use glam::Vec2;

use crate::layout::shared::constants;

constants! {
    /// Half a turn.
    pub const PI: f32 = std::f32::consts::PI;
    /// A turn.
    pub const TAU: f32 = std::f32::consts::TAU;
    /// A quarter of a turn.
    const FRAC_PI_2: f32 = std::f32::consts::FRAC_PI_2;
    /// An eighth of a turn.
    const FRAC_PI_4: f32 = std::f32::consts::FRAC_PI_4;
    /// Quarters of a turn in a radian.
    const FRAC_2_PI: f32 = std::f32::consts::FRAC_2_PI;
    /// tan(pi/8): beyond it the arc tangent's polynomial works on the angle's difference from 45 deg.
    const STEEP: f32 = 0.414_213_56;
    /// Polynomial of the arc tangent up to pi/8, in the square, highest power first.
    const ARC_TANGENT: [f32; 4] = [0.080_537_445, -0.138_776_85, 0.199_777_11, -0.333_329_5];
    /// pi/2 in three parts, the first two short enough for exact products.
    const QUARTER: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];
    /// Polynomial of the sine up to pi/4, in the square, highest power first.
    const SINE: [f32; 3] = [-1.951_529_6e-4, 8.332_161e-3, -0.166_666_55];
    /// Polynomial of the cosine up to pi/4, in the square, highest power first.
    const COSINE: [f32; 3] = [2.443_315_7e-5, -1.388_731_6e-3, 4.166_664_6e-2];
    /// The smallest divisor.
    pub const TINY: f32 = f32::MIN_POSITIVE;
}

/// `angle` wrapped into (-pi, pi], for an angle within a few turns of it.
#[inline]
pub fn wrapped(angle: f32) -> f32 {
    let turned = angle - TAU * (angle * (1.0 / TAU)).round_ties_even();
    if turned <= -PI { turned + TAU } else { turned }
}

/// Angle of (x, y) from the x axis in (-pi, pi], 0 for the origin; within 4e-7 of the true one.
///
/// S. Moshier's Cephes polynomial for the arc tangent. Library functions of different engines differ by more than its
/// error.
#[inline]
pub fn arc_tangent(y: f32, x: f32) -> f32 {
    let (small, large) = (x.abs().min(y.abs()), x.abs().max(y.abs()));
    let ratio = small / large.max(TINY);
    let steep = STEEP < ratio;
    let reduced = if steep { (ratio - 1.0) / (ratio + 1.0) } else { ratio };
    let square = reduced * reduced;
    let series = ((ARC_TANGENT[0] * square + ARC_TANGENT[1]) * square + ARC_TANGENT[2]) * square + ARC_TANGENT[3];
    let octant = series * square * reduced + reduced + if steep { FRAC_PI_4 } else { 0.0 };
    let quadrant = if x.abs() < y.abs() { FRAC_PI_2 - octant } else { octant };
    let half = if x < 0.0 { PI - quadrant } else { quadrant };
    if y < 0.0 { -half } else { half }
}

/// 1.5 * 2^23: the sum with a small number has no bits left for a fraction.
const ROUNDER: f32 = 12_582_912.0;

/// Sine and cosine in plain arithmetic, within 1.2e-7 of the true ones for an angle within a few turns of 0.
///
/// S. Moshier's Cephes polynomials for an eighth of a turn. As fast as the library's, whose last bits differ between
/// engines.
#[inline]
pub fn sin_cos(angle: f32) -> (f32, f32) {
    // Added to a number this large, an angle is rounded to whole quarters, which stand in the lowest bits.
    let shifted = angle * FRAC_2_PI + ROUNDER;
    let quarter = shifted.to_bits();
    let count = shifted - ROUNDER;
    let rest = ((angle - count * QUARTER[0]) - count * QUARTER[1]) - count * QUARTER[2];
    let square = rest * rest;
    let sin = ((SINE[0] * square + SINE[1]) * square + SINE[2]) * square * rest + rest;
    let cos = ((COSINE[0] * square + COSINE[1]) * square + COSINE[2]) * square * square - 0.5 * square + 1.0;
    let (sin, cos) = if quarter & 1 == 0 { (sin, cos) } else { (cos, -sin) };
    if quarter & 2 == 0 { (sin, cos) } else { (-sin, -cos) }
}

/// Unit vector at `angle` from the x axis.
#[inline]
pub fn direction(angle: f32) -> Vec2 {
    let (sin, cos) = sin_cos(angle);
    Vec2::new(cos, sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_agree_with_the_library_over_several_turns() {
        for i in -200_000..=200_000 {
            let angle = i as f32 * 1e-4;
            let (sin, cos) = sin_cos(angle);
            let (true_sin, true_cos) = f64::from(angle).sin_cos();
            // Two units in the last place of a number near 1.
            assert!(
                (f64::from(sin) - true_sin).abs() < 1.2e-7 && (f64::from(cos) - true_cos).abs() < 1.2e-7,
                "{angle}"
            );
        }
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }

    #[test]
    fn the_arc_tangent_agrees_with_the_library_all_around() {
        for i in 0..100_000 {
            let angle = f64::from(i) / 100_000.0 * std::f64::consts::TAU - std::f64::consts::PI;
            for radius in [1e-3, 1.0, 40.0] {
                let (y, x) = ((radius * angle.sin()) as f32, (radius * angle.cos()) as f32);
                let difference = f64::from(arc_tangent(y, x)) - f64::from(y).atan2(f64::from(x));
                // Half an ulp of pi is 1.2e-7; the polynomial adds 2e-7.
                assert!(difference.abs() < 4e-7, "{x} {y}: {difference}");
            }
        }
        assert_eq!(arc_tangent(0.0, 0.0), 0.0);
        assert_eq!(arc_tangent(0.0, -1.0), PI);
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
