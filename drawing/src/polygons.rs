//! A roundabout's kerbs as polygons and its routes as waypoints, for other programs.

use glam::DVec2;
use offtrack::geometry::{Curve, Outline};
use offtrack::map::route::Route;
use serde::Serialize;

use crate::sweep::{self, Sweep};

/// Largest distance of a chord to its arc, half of the documented 1 cm \[m].
const TOLERANCE: f64 = 0.005;
/// Extent of solid ground beyond the outermost kerb \[m].
const MARGIN: f64 = 5.0;

/// The points of a line, open or closed \[m]. A closed one does not repeat its first point.
pub type Polygon = Vec<[f64; 2]>;

#[derive(Serialize)]
struct Written<'a> {
    solids: Vec<Polygon>,
    drivable: Vec<Polygon>,
    routes: Vec<WrittenRoute<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sweep: Option<sweep::Written<'a>>,
}

#[derive(Serialize)]
struct WrittenRoute<'a> {
    name: &'a str,
    waypoints: Vec<[f64; 3]>,
}

/// Polygons and waypoints as one line of JSON, in metres and radians: `{"solids": [[[x, y], ...], ...], "drivable":
/// [[[x, y], ...], ...], "routes": [{"name", "waypoints": [[x, y, heading], ...]}]}`.
///
/// `drivable` is the outer boundary, then one hole for each island; `solids` are the islands, then the ground beyond
/// the boundary as two polygons. Curves are within 1 cm. With a swept path there is `sweep`, as `offtrack draw --help`
/// describes it.
///
/// # Errors
///
/// A coordinate that is not finite.
pub fn json(kerbs: &Outline, routes: &[Route], sweep: Option<&Sweep>) -> serde_json::Result<String> {
    let (boundary, islands) = corners(kerbs);
    let ground = boundary.first().map(|points| ground(points)).into_iter().flatten();
    let solids = islands.iter().cloned().chain(ground).map(|points| rounded(&points)).collect();
    let drivable = drivable(kerbs);
    let routes = routes.iter().map(|route| WrittenRoute {
        name: &route.name,
        waypoints: route.waypoints.iter().map(|w| [to(1e4, w.position.x), to(1e4, w.position.y), to(1e6, w.heading)]).collect(),
    });
    let sweep = sweep.map(Sweep::written);
    let mut text = serde_json::to_string(&Written { solids, drivable, routes: routes.collect(), sweep })?;
    text.push('\n');
    Ok(text)
}

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
fn corners(kerbs: &Outline) -> (Vec<Vec<DVec2>>, Vec<Vec<DVec2>>) {
    // Loops keep the drivable side on their left: the boundary turns counter-clockwise, islands clockwise.
    let (mut boundary, islands): (Vec<_>, Vec<_>) = kerbs.loops.iter().partition(|curve| 0.0 < curve.signed_area());
    boundary.sort_by(|a, b| b.signed_area().total_cmp(&a.signed_area()));
    let closed = |curve: &Curve| {
        let mut points = curve.polyline(TOLERANCE);
        points.pop();
        points
    };
    (boundary.into_iter().map(closed).collect(), islands.into_iter().map(closed).collect())
}

/// The ground around a counter-clockwise boundary, cut at its westernmost and easternmost points into a northern and a
/// southern polygon.
fn ground(boundary: &[DVec2]) -> [Vec<DVec2>; 2] {
    let n = boundary.len();
    let furthest = |sign: f64| (0..n).max_by(|&a, &b| (sign * boundary[a].x).total_cmp(&(sign * boundary[b].x))).unwrap_or(0);
    let (west, east) = (furthest(-1.0), furthest(1.0));
    // Clockwise along the boundary, so that the ground lies on the left.
    let back = |from: usize, to: usize| (0..=(from + n - to) % n).map(move |step| boundary[(from + n - step) % n]);
    let low = boundary.iter().copied().fold(DVec2::INFINITY, DVec2::min) - MARGIN;
    let high = boundary.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max) + MARGIN;
    let (west_end, east_end) = (DVec2::new(low.x, boundary[west].y), DVec2::new(high.x, boundary[east].y));
    let north = [east_end, high, DVec2::new(low.x, high.y), west_end].into_iter().chain(back(west, east)).collect();
    let south = [west_end, low, DVec2::new(high.x, low.y), east_end].into_iter().chain(back(east, west)).collect();
    [north, south]
}

/// To a tenth of a millimetre.
fn rounded(points: &[DVec2]) -> Polygon {
    points.iter().map(|p| [to(1e4, p.x), to(1e4, p.y)]).collect()
}

fn to(parts: f64, value: f64) -> f64 {
    (value * parts).round() / parts
}
