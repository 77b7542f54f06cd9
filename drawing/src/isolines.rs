//! Contour lines of the distance to the kerbs, from the baked field.

use contour::ContourBuilder;
use glam::DVec2;
use offtrack::field::Field;

use crate::view::View;

/// Sampling distance of the field: fine enough for ridges between two lines half a metre apart (m).
const STEP: f64 = 0.2;
/// A point nearer than this to the line between its neighbours is left out (m).
const STRAIGHT: f64 = 0.02;

/// The contour lines at every whole metre within the view.
pub fn isolines(field: &Field, view: &View) -> Vec<Vec<DVec2>> {
    let low = view.low - STEP;
    let count = |extent: f64| (extent / STEP).ceil() as usize + 3;
    let (columns, rows) = (count(view.high.x - view.low.x), count(view.high.y - view.low.y));
    let node = |index: usize| low + STEP * DVec2::new((index % columns) as f64, (index / columns) as f64);
    let values: Vec<f64> = (0..columns * rows).map(|index| f64::from(field.distance(node(index).as_vec2()))).collect();
    let highest = values.iter().copied().fold(0.0, f64::max);
    let levels: Vec<f64> = (1..).map(f64::from).take_while(|&level| level < highest).collect();
    // The builder takes values at the middles of cells.
    let corner = low - STEP / 2.0;
    let builder =
        ContourBuilder::new(columns, rows, true).x_origin(corner.x).y_origin(corner.y).x_step(STEP).y_step(STEP);
    // The builder fails only when the number of values is not columns * rows.
    let lines = builder.lines(&values, &levels).unwrap_or_default();
    let rings = lines.iter().flat_map(|line| line.geometry());
    rings.map(|ring| thinned(ring.coords().map(|p| DVec2::new(p.x, p.y)))).collect()
}

/// The points without those on a straight line.
fn thinned(points: impl Iterator<Item = DVec2>) -> Vec<DVec2> {
    let mut kept: Vec<DVec2> = Vec::new();
    // Points left out since the last kept one, the newest last.
    let mut pending: Vec<DVec2> = Vec::new();
    for p in points {
        if let (Some(&from), Some(&newest)) = (kept.last(), pending.last()) {
            let along = (p - from).normalize_or_zero();
            if pending.iter().any(|q| STRAIGHT < along.perp_dot(*q - from).abs()) {
                kept.push(newest);
                pending.clear();
            }
            pending.push(p);
        } else if kept.is_empty() {
            kept.push(p);
        } else {
            pending.push(p);
        }
    }
    kept.extend(pending.last());
    kept
}
