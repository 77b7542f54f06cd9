//! Curves as points: kerbs as polygons, and lines.

use glam::DVec2;
use offtrack::geometry::{Curve, Outline, ROUNDED};

/// Largest distance of a chord to its arc, half of the documented 1 cm (m).
const TOLERANCE: f64 = 0.005;
/// The points of a line, open or closed (m). A closed one does not repeat its first point.
pub type Polygon = Vec<[f64; 2]>;

/// The edges of the drivable area: the outer boundary counter-clockwise, then the islands clockwise.
pub fn drivable(kerbs: &Outline) -> Vec<Polygon> {
    let (boundary, islands) = corners(kerbs);
    boundary.iter().chain(&islands).map(|points| rounded(points)).collect()
}

/// A curve from its beginning to its end.
pub fn line(curve: &Curve) -> Polygon {
    rounded(&curve.polyline(TOLERANCE))
}

/// The kerbs' corners: of the boundaries, the largest first, and of the islands.
pub fn corners(kerbs: &Outline) -> (Vec<Vec<DVec2>>, Vec<Vec<DVec2>>) {
    // Loops keep the drivable side on their left: the boundary turns counter-clockwise, islands clockwise.
    let (mut boundary, islands): (Vec<_>, Vec<_>) = kerbs.loops.iter().partition(|curve| 0.0 < curve.signed_area());
    boundary.sort_by(|a, b| b.signed_area().total_cmp(&a.signed_area()));
    let closed = |curve: &Curve| curve.polygon(TOLERANCE);
    (boundary.into_iter().map(closed).collect(), islands.into_iter().map(closed).collect())
}

/// The polygon of `points`, rounded to a tenth of a millimetre.
pub fn rounded(points: &[DVec2]) -> Polygon {
    points.iter().map(|p| [to(ROUNDED, p.x), to(ROUNDED, p.y)]).collect()
}

/// A number rounded to so many parts of 1.
pub fn to(parts: f64, value: f64) -> f64 {
    (value * parts).round() / parts
}
