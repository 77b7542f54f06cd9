//! The circle through points.

use glam::DVec2;

/// A circle through points as well as may be: centre, radius, largest distance of a point from it (m).
pub(crate) fn fitted_circle(points: &[DVec2]) -> Option<(DVec2, f64, f64)> {
    let n = points.len() as f64;
    let mean = points.iter().sum::<DVec2>() / n;
    let (mut uu, mut uv, mut vv, mut uz, mut vz, mut zz) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for p in points {
        let d = *p - mean;
        let z = d.length_squared();
        (uu, uv, vv) = (uu + d.x * d.x, uv + d.x * d.y, vv + d.y * d.y);
        (uz, vz, zz) = (uz + d.x * z, vz + d.y * z, zz + z);
    }
    let determinant = uu * vv - uv * uv;
    if points.len() < 3 || determinant.abs() < 1e-9 * (uu + vv) * (uu + vv) {
        return None;
    }
    let offset = DVec2::new(uz * vv - vz * uv, vz * uu - uz * uv) / (2.0 * determinant);
    let radius = (offset.length_squared() + zz / n).sqrt();
    let centre = mean + offset;
    let residual = points.iter().map(|p| (p.distance(centre) - radius).abs()).fold(0.0, f64::max);
    residual.is_finite().then_some((centre, radius, residual))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_found_from_part_of_its_points() {
        let at = |angle: f64| DVec2::new(3.0, -4.0) + 7.0 * DVec2::from_angle(angle);
        let (centre, radius, residual) =
            fitted_circle(&(0..20).map(|i| at(f64::from(i) * 0.2)).collect::<Vec<_>>()).unwrap();
        assert!(centre.distance(DVec2::new(3.0, -4.0)) < 1e-9 && (radius - 7.0).abs() < 1e-9 && residual < 1e-9);
        assert_eq!(fitted_circle(&[DVec2::ZERO, DVec2::X, 2.0 * DVec2::X]), None);
    }
}
