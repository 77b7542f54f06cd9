//! A map around a point: the lanes and what can be driven on there, with that point as the origin.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::DVec2;

use super::Map;
use super::lanes::{Strip, sampled};
use super::records::Kind;
use super::surface::Surface;
use crate::geometry::area::{Area, corners_of_circle, points, signed_area, without_spikes};
use crate::geometry::{Curve, Outline, fitted_outline};

/// Chords of edges leave their curves by at most this much before arcs are fitted (m).
const FINE: f64 = 1e-3;
/// What arcs and segments may add to that (m).
pub(super) const FITTED: f64 = 4e-3;
/// How far beyond its island or its junction the world reaches (m).
pub(super) const REACH: f64 = 85.0;
/// How far beyond the world lanes are looked at (m).
const MARGIN: f64 = 10.0;
/// Islands smaller than this are left out (m²).
const SMALLEST: f64 = 0.02;

/// Contours of one connected part of a surface: its outer one, then its holes.
pub(super) type Part = Vec<Vec<[f64; 2]>>;

pub(super) fn moved(points: &[DVec2], centre: DVec2) -> Vec<DVec2> {
    points.iter().map(|&p| p - centre).collect()
}

/// The surface of the map around a point, which becomes the origin, up to `extent` from it and a little more (m).
pub(super) fn surface(map: &Map, centre: DVec2, extent: f64) -> Surface {
    let is_near = |island: &Vec<DVec2>| island.iter().any(|corner| corner.length() < extent + MARGIN);
    let islands = map.records.islands().map(|island| moved(island, centre)).filter(is_near);
    let strips: Vec<Strip> = nearby(map, centre, extent, FINE).into_iter().map(|(_, strip)| strip).collect();
    Surface::new(&strips, islands)
}

/// The parts of a surface within `extent` of the origin, clipped to that circle.
pub(super) fn clipped(surface: &Area, extent: f64) -> Vec<Part> {
    let corners = corners_of_circle(extent, FINE);
    let disc = Area::union(std::iter::once(
        (0..corners).map(|i| extent * DVec2::from_angle(i as f64 * TAU / corners as f64)).collect(),
    ));
    surface.common(&disc).parts
}

/// A part of a surface as arcs and segments around another origin, without spikes.
pub(super) fn outline(part: &Part, origin: DVec2) -> Outline {
    let kept = part.iter().filter(|contour| SMALLEST < signed_area(contour).abs());
    let curves = kept
        .map(|contour| without_spikes(contour, FITTED))
        .map(|contour| fitted_outline(&moved(&points(&contour), origin), FITTED));
    Outline::new(curves.filter(|curve: &Curve| !curve.pieces.is_empty()).collect())
}

/// The lanes of the map around a point, by index.
pub(super) fn lanes(map: &Map, centre: DVec2, extent: f64, tolerance: f64) -> Vec<(usize, Strip)> {
    let mut lanes = nearby(map, centre, extent, tolerance);
    lanes.retain(|(_, strip)| strip.kind == Kind::Lane);
    lanes
}

/// The strips of the map within `extent` of a point and a little more, sampled anew around it, with their indices.
pub(super) fn nearby(map: &Map, centre: DVec2, extent: f64, tolerance: f64) -> Vec<(usize, Strip)> {
    let near = |strip: &Strip| {
        let (low, high) = strip.bounds();
        centre.clamp(low, high).distance(centre) < extent + MARGIN
    };
    let mut found = Vec::new();
    let mut sections: HashMap<(usize, usize), Vec<Strip>> = HashMap::new();
    for (index, strip) in map.strips.iter().enumerate().filter(|(_, strip)| near(strip)) {
        let section = sections
            .entry((strip.road, strip.section))
            .or_insert_with(|| sampled(&map.records.roads[strip.road], strip.road, strip.section, tolerance));
        let Some(fine) = section.iter().find(|other| other.id == strip.id) else { continue };
        let (left, right, of) = (moved(&fine.left, centre), moved(&fine.right, centre), moved(&fine.centre, centre));
        found.push((index, Strip { left, right, centre: of, ..fine.clone() }));
    }
    found
}
