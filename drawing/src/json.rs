//! A road's kerbs as polygons, its routes as waypoints and a swept path, for other programs.

use glam::DVec2;
use offtrack::map::route::Route;
use offtrack::map::{Gutter, Road};
use offtrack_evaluation::polygons::{Polygon, corners, drivable as drivable_of, rounded, to};
use serde::Serialize;

use crate::sweep::{self, Sweep};

/// Extent of solid ground beyond the outermost kerb (m).
const MARGIN: f64 = 5.0;

#[derive(Serialize)]
struct Written<'a> {
    solids: Vec<Polygon>,
    drivable: Vec<Polygon>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    aprons: Vec<Vec<Polygon>>,
    routes: Vec<WrittenRoute<'a>>,
    frame: Frame,
    #[serde(skip_serializing_if = "Option::is_none")]
    sweep: Option<sweep::Written<'a>>,
}

/// Where the road lies in its map.
#[derive(Serialize)]
struct Frame {
    /// The ring's centre there, which is the origin here (m).
    origin: [f64; 2],
    /// The hand of traffic: on `left` the simulator drives the road as its mirror image in the x axis.
    hand: &'static str,
}

#[derive(Serialize)]
struct WrittenRoute<'a> {
    name: &'a str,
    waypoints: Vec<[f64; 3]>,
}

/// Polygons and waypoints as one line of JSON, in metres and radians: `{"solids": [[[x, y], ...], ...], "drivable":
/// [[[x, y], ...], ...], "routes": [{"name", "waypoints": [[x, y, heading], ...]}], "frame": {"origin", "hand"}}`.
///
/// `drivable` is the outer boundary, then one hole for each island; `solids` are the islands, then the ground beyond
/// the boundary as two polygons. With aprons there is `aprons`, of each its outer and its inner edge. Curves are within
/// 1 cm. `road` is as it is driven, `routes` are as they are seen. With a swept path there is `sweep`, as `offtrack
/// draw --help` describes it.
///
/// # Errors
///
/// A coordinate that is not finite.
pub fn written(road: &Road, gutter: Gutter, routes: &[Route], sweep: Option<&Sweep>) -> serde_json::Result<String> {
    let (seen, origin) = (road.seen(), road.ground().origin);
    let kerbs = seen.kerbs(gutter);
    let (boundary, islands) = corners(&kerbs);
    let ground = boundary.first().map(|points| ground(points)).into_iter().flatten();
    let solids = islands.iter().cloned().chain(ground).map(|points| rounded(&points)).collect();
    let aprons = seen.aprons().iter().map(drivable_of).collect();
    let drivable = drivable_of(&kerbs);
    let hand = if road.is_mirrored() { "left" } else { "right" };
    let frame = Frame { origin: [origin.x, origin.y], hand };
    let routes = routes.iter().map(|route| WrittenRoute {
        name: &route.name,
        waypoints: route
            .waypoints
            .iter()
            .map(|w| [to(1e4, w.position.x), to(1e4, w.position.y), to(1e6, w.heading)])
            .collect(),
    });
    let sweep = sweep.map(Sweep::written);
    let mut text =
        serde_json::to_string(&Written { solids, drivable, aprons, routes: routes.collect(), frame, sweep })?;
    text.push('\n');
    Ok(text)
}

/// The ground around a counter-clockwise boundary, cut at its westernmost and easternmost points into a northern and a
/// southern polygon.
fn ground(boundary: &[DVec2]) -> [Vec<DVec2>; 2] {
    let n = boundary.len();
    let furthest =
        |sign: f64| (0..n).max_by(|&a, &b| (sign * boundary[a].x).total_cmp(&(sign * boundary[b].x))).unwrap_or(0);
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
