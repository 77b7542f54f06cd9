//! Routes, kerbs and vehicles as arrays, for baselines and pictures of one's own.

use glam::{DVec2, Vec2};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use offtrack::geometry::Curve;
use offtrack::layout::Rig;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::worlds::Place;

/// Positions, or positions and headings, a row each.
pub type Points<'py> = Bound<'py, PyArray2<f64>>;
/// Waypoints of a route, the width of its lane at each, centres of lanes, kerbs.
pub type Lines<'py> = (Points<'py>, Bound<'py, PyArray1<f64>>, Vec<Points<'py>>, Vec<Points<'py>>);

/// Largest distance of a chord from the curve that it stands for (m).
const CHORD: f64 = 0.005;

/// A route's lines in the frame that it is driven in.
pub fn lines<'py>(py: Python<'py>, place: &Place, route: u32) -> PyResult<Lines<'py>> {
    let (world, scenario) = (&place.world, &place.scenario);
    let road = &scenario.places[world.routes[route as usize].roundabout as usize].roundabout;
    let (_, driven) = scenario.routes().nth(route as usize).expect("a world has the routes of its scenario");
    let rows = world.route_waypoints(route).iter().zip(world.route_previews(route));
    let waypoints: Vec<f64> = rows
        .flat_map(|(waypoint, preview)| [waypoint.position.x, waypoint.position.y, preview.heading].map(f64::from))
        .collect();
    let n = waypoints.len() / 3;
    let [before, between, after] = road.lane_widths(driven);
    let leaves = driven.centre_line.length() - scenario.departure;
    let width = |index: usize| match index as f64 * scenario.spacing {
        station if station < scenario.approach => before,
        station if station < leaves => between,
        _ => after,
    };
    let lanes = road.lanes().iter().map(|lane| line(py, lane)).collect::<PyResult<_>>()?;
    let kerbs = road.kerbs(scenario.gutter).loops.iter().map(|kerb| line(py, kerb)).collect::<PyResult<_>>()?;
    Ok((PyArray1::from_vec(py, waypoints).reshape([n, 3])?, PyArray1::from_iter(py, (0..n).map(width)), lanes, kerbs))
}

fn line<'py>(py: Python<'py>, curve: &Curve) -> PyResult<Points<'py>> {
    let points: Vec<DVec2> = curve.polyline(CHORD);
    PyArray1::from_iter(py, points.iter().flat_map(|point| [point.x, point.y])).reshape([points.len(), 2])
}

/// Distance of each of `points`, `[n, 2]`, from the nearest kerb of a route's road, negative off the road.
pub fn kerb_distances<'py>(
    py: Python<'py>,
    place: &Place,
    route: u32,
    points: &PyReadonlyArray2<f64>,
) -> Bound<'py, PyArray1<f32>> {
    let field = place.world.route_field(route);
    let points = points.as_array();
    PyArray1::from_iter(
        py,
        points.rows().into_iter().map(|point| field.distance(Vec2::new(point[0] as f32, point[1] as f32))),
    )
}

/// Lengths (m), mass (kg) and limits (SI, rad) of a vehicle by name.
pub fn dimensions<'py>(py: Python<'py>, rig: &Rig) -> PyResult<Bound<'py, PyDict>> {
    let (tractor, trailer) = (&rig.tractor_body, &rig.trailer_body);
    let dict = PyDict::new(py);
    for (name, value) in [
        ("wheelbase", rig.wheelbase),
        ("fifth_wheel", rig.fifth_wheel),
        ("trailer_wheelbase", rig.trailer_wheelbase),
        ("tractor_front", tractor.front),
        ("tractor_rear", tractor.rear),
        ("tractor_width", 2.0 * tractor.half_width),
        ("trailer_front", trailer.front),
        ("trailer_rear", trailer.rear),
        ("trailer_width", 2.0 * trailer.half_width),
        ("steer_max", rig.steer_max),
        ("steer_rate", rig.steer_rate),
        ("acceleration_min", rig.acceleration_min),
        ("acceleration_max", rig.acceleration_max),
        ("trailer_mass", rig.trailer_mass),
    ] {
        dict.set_item(name, value)?;
    }
    Ok(dict)
}
