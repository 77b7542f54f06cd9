//! The five roundabouts against the measured ones: road edges and lane centre lines, in both directions. Those with the
//! maps' kerbs against the kerb faces and the edges of the lanes.
#![expect(clippy::unwrap_used, reason = "a test that cannot read its file must fail")]

use std::path::{Path, PathBuf};

use offtrack::geometry::{Piece, wrapped};
use offtrack::map::{Gutter, Road};
use offtrack_reference::deviation::{Measured, deviations};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const NAMES: [&str; 5] = ["16m", "20m", "32m", "40m", "50m"];

fn file(name: &str) -> PathBuf {
    Path::new(ROOT).join("scenarios/roundabouts").join(name).with_extension("toml")
}

fn roundabout(name: &str) -> Road {
    Road::read(&file(name)).unwrap()
}

fn measured(name: &str) -> Measured {
    let path = Path::new(ROOT).join("tests/data/measured").join(name).with_extension("json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn every_roundabout_file_is_one_of_the_five_or_has_the_kerbs_of_its_map() {
    let mut found: Vec<String> = std::fs::read_dir(Path::new(ROOT).join("scenarios/roundabouts"))
        .unwrap()
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    found.sort();
    let expected: Vec<String> = NAMES.iter().flat_map(|name| [(*name).to_owned(), format!("{name}-maps")]).collect();
    assert_eq!(found, expected);
}

#[test]
fn kerbs_and_lanes_lie_within_a_metre_of_the_measured_and_ring_kerbs_within_30_cm() {
    for name in NAMES {
        let rows = deviations(&roundabout(name), &measured(name)).unwrap();
        assert!(15 < rows.len(), "{name}: only {} rows", rows.len());
        for row in rows {
            // The bounds of scenarios/README.md: 0.3 m on the ring itself, 1.0 m elsewhere.
            let bound = if row.what == "island" || row.what == "ring" { 0.3 } else { 1.0 };
            assert!(row.from_measured.worst < bound, "{name}: {row:?}");
            assert!(row.from_model.worst < bound, "{name}: {row:?}");
        }
    }
}

#[test]
fn the_maps_kerb_faces_and_lane_edges_lie_within_30_cm_both_ways() {
    for name in NAMES {
        let rows = deviations(&roundabout(&format!("{name}-maps")), &measured(&format!("maps/{name}"))).unwrap();
        for what in ["faces", "edges"] {
            let row = rows.iter().find(|row| row.what == what).unwrap();
            assert!(300 < row.from_measured.points && 300 < row.from_model.points, "{name}: {row:?}");
            assert!(row.from_measured.worst < 0.3 && row.from_model.worst < 0.3, "{name}: {row:?}");
        }
    }
}

#[test]
fn the_five_with_one_gutter_everywhere_do_not_have_the_maps_kerbs() {
    for name in NAMES {
        let rows = deviations(&roundabout(name), &measured(&format!("maps/{name}"))).unwrap();
        let faces = rows.iter().find(|row| row.what == "faces").unwrap();
        assert!(0.3 < faces.from_measured.worst, "{name}: {faces:?}");
    }
}

#[test]
fn a_roundabout_turned_by_three_degrees_fails_the_comparison() {
    let text = std::fs::read_to_string(file("40m")).unwrap();
    let turned: String = text
        .lines()
        .map(|line| match line.strip_prefix("bearing_deg = ") {
            Some(bearing) => format!("bearing_deg = {}\n", bearing.parse::<f64>().unwrap() + 3.0),
            None => format!("{line}\n"),
        })
        .collect();
    let path = std::env::temp_dir().join(format!("offtrack-turned-{}.toml", std::process::id()));
    std::fs::write(&path, turned).unwrap();
    let rows = deviations(&Road::read(&path).unwrap(), &measured("40m")).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert!(rows.iter().any(|row| 1.0 < row.from_measured.worst));
}

#[test]
fn five_routes_leave_every_entry_each_smooth_and_clear_of_the_kerbs() {
    for name in NAMES {
        let roundabout = roundabout(name);
        let kerbs = roundabout.kerbs(Gutter::Drivable);
        let routes = roundabout.routes(40.0, 35.0, 2.0).unwrap();
        assert_eq!(routes.len(), 5 * roundabout.arms().count());
        for route in routes {
            for joint in route.centre_line.pieces.windows(2) {
                let turn = wrapped(joint[1].heading_at(0.0) - joint[0].heading_at(joint[0].length()));
                // Angles are sums of several f64.
                assert!(turn.abs() < 1e-6, "{}: a kink of {turn} rad", route.name);
                assert!(joint[0].end().distance(joint[1].start()) < 1e-6, "{}: a gap", route.name);
            }
            for piece in &route.centre_line.pieces {
                if let Piece::Arc { radius, .. } = piece {
                    // The tightest lane curve of the measured roundabouts has about this radius.
                    assert!(5.0 <= *radius, "{}: radius {radius} m", route.name);
                }
            }
            let nearest = (0..(route.centre_line.length() * 4.0) as usize)
                .map(|step| route.centre_line.point_at(step as f64 / 4.0));
            let nearest = nearest.map(|p| kerbs.signed_distance(p)).fold(f64::INFINITY, f64::min);
            // Half a lane of 3.7 m less 5 cm: some measured right lanes are 3.5 m wide.
            assert!(1.8 <= nearest, "{}: {nearest} m from a kerb", route.name);
        }
    }
}

#[test]
fn waypoints_stand_two_metres_apart_and_point_along_the_centre_line() {
    for name in NAMES {
        for route in roundabout(name).routes(40.0, 35.0, 2.0).unwrap() {
            let last = route.waypoints.len() - 1;
            for (index, waypoint) in route.waypoints.iter().enumerate() {
                let s = if index == last { route.centre_line.length() } else { index as f64 * 2.0 };
                assert!(waypoint.position.distance(route.centre_line.point_at(s)) < 1e-9);
                assert!(wrapped(waypoint.heading - route.centre_line.heading_at(s)).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn solid_gutters_leave_every_road_edge_half_a_metre_nearer() {
    for name in NAMES {
        let roundabout = roundabout(name);
        let (drivable, solid) = (roundabout.kerbs(Gutter::Drivable), roundabout.kerbs(Gutter::Solid));
        assert_eq!(drivable.loops.len(), solid.loops.len(), "{name}: an island vanished or merged");
        for point in solid.loops.iter().flat_map(|curve| curve.polyline(0.01)) {
            // Offset arcs and segments are exact; a micrometre is the tolerance of joining them.
            assert!(
                (drivable.signed_distance(point) - 0.5).abs() < 2e-6,
                "{name} at {point}: {}",
                drivable.signed_distance(point)
            );
        }
    }
}
