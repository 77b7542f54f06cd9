//! A road and swept paths as GeoJSON, for GIS and CAD programs: in metres, in the frame of the road's map.
//!
//! RFC 7946 has longitudes and latitudes alone, and leaves other frames to prior arrangement. Sites are surveyed and
//! drawn in metres: their frame is named by the member `crs` of the GeoJSON before it, where it is known.

use glam::DVec2;
use offtrack::geometry::{Curve, ROUNDED, counter_clockwise};
use offtrack::map::ground::Kerb;
use offtrack::map::{Gutter, Road};
use offtrack::vehicle::swept::{Pose, front_path};
use offtrack_evaluation::polygons::to;
use serde_json::{Map, Value, json};

use super::panel::Shown;
use super::stations;

/// Largest distance of a chord from its arc (m).
const CHORD: f64 = 5e-4;
/// Points of a line nearer than this to the one before are left out (m).
const SAME: f64 = 2e-3;

/// The road as it lies in the world, its kerbs, the lines of its routes and its centre, with the swept paths of one
/// vehicle. `crs` names the frame of its map.
///
/// # Errors
///
/// A coordinate that is not finite.
pub fn geojson(road: &Road, gutter: Gutter, shown: &[&Shown], crs: Option<&str>) -> serde_json::Result<String> {
    let ground = road.ground();
    let frame = Frame { origin: ground.origin };
    let mut features = vec![feature(
        json!({"part": "centre", "road": road.name, "island_radius": ground.island_radius}),
        "Point",
        frame.position(DVec2::ZERO),
    )];
    for curve in &road.kerbs(gutter).loops {
        let of = match road.nearest_kerb(curve.point_at(0.0)) {
            Kerb::Outer => "outer".to_owned(),
            Kerb::Island => "island".to_owned(),
            Kerb::Splitter(arm) => format!("splitter {}", ground.arms[arm].name),
        };
        // An exterior ring of RFC 7946 is counter-clockwise, an island's too.
        features.push(feature(
            json!({"part": "kerb", "of": of}),
            "Polygon",
            json!([frame.ring(&counter_clockwise(curve.polygon(CHORD)))]),
        ));
    }
    for apron in road.aprons() {
        let rings: Vec<Vec<DVec2>> = apron.loops.iter().map(|curve| curve.polygon(CHORD)).collect();
        features.push(feature(json!({"part": "apron"}), "MultiPolygon", frame.areas(&rings)));
    }
    for line in &ground.lines {
        let name = format!("{}-{}-{}", ground.arms[line.entry].name, line.lane.name(), line.exit);
        features.push(feature(
            json!({"part": "lane", "route": name, "widths": line.widths}),
            "LineString",
            frame.curve(&line.line),
        ));
    }
    for one in shown {
        features.extend(swept(one, &frame));
    }
    let mut collection = Map::new();
    collection.insert("type".into(), "FeatureCollection".into());
    if let Some(name) = crs {
        collection.insert("crs".into(), json!({"type": "name", "properties": {"name": name}}));
    }
    collection.insert("features".into(), features.into());
    let mut text = serde_json::to_string(&collection)?;
    // A line for each feature.
    text = text.replace("{\"geometry\"", "\n{\"geometry\"");
    text.push('\n');
    Ok(text)
}

/// The features of a swept path.
fn swept(one: &Shown, frame: &Frame) -> Vec<Value> {
    let (route, vehicle, fits) = (one.row.movement(), &one.row.vehicle, one.row.verdict());
    let of = |part: &str| json!({"part": part, "route": route, "vehicle": vehicle, "fits": fits});
    let mut features = Vec::new();
    for (part, rings) in ["swept_tractor", "swept_trailer"].into_iter().zip(one.areas()) {
        features.push(feature(of(part), "MultiPolygon", frame.areas(rings)));
    }
    let poses = &one.path.poses;
    let points = |of: fn(&Pose) -> DVec2| poses.iter().map(of).collect::<Vec<_>>();
    for (part, line) in [
        ("front_axle", front_path(&one.path.rig, poses)),
        ("drive_axle", points(|pose| pose.position)),
        ("trailer_axles", points(|pose| pose.trailer_position)),
    ] {
        features.push(feature(of(part), "LineString", frame.positions(&line)));
    }
    let units = one.path.corners();
    for (index, station) in stations(poses) {
        for (part, unit) in ["tractor", "trailer"].into_iter().zip(&units) {
            let mut properties = of(part);
            properties["station"] = to(100.0, station).into();
            features.push(feature(properties, "Polygon", json!([frame.ring(&unit[index])])));
        }
    }
    let (unit, nearest) = one.row.shown().nearest();
    let mut properties = of("clearance");
    properties["unit"] = unit.into();
    properties["clearance"] = nearest.clearance.into();
    features.push(feature(properties, "Point", json!([nearest.x, nearest.y])));
    features
}

fn feature(properties: Value, kind: &str, coordinates: Value) -> Value {
    json!({"geometry": {"type": kind, "coordinates": coordinates}, "properties": properties, "type": "Feature"})
}

/// Where the road lies in its map.
struct Frame {
    origin: DVec2,
}

impl Frame {
    fn position(&self, p: DVec2) -> Value {
        let p = self.origin + p;
        json!([to(ROUNDED, p.x), to(ROUNDED, p.y)])
    }

    fn positions(&self, points: &[DVec2]) -> Value {
        points.iter().map(|&p| self.position(p)).collect()
    }

    fn curve(&self, curve: &Curve) -> Value {
        let mut points = curve.polyline(CHORD);
        // Two points that are rounded to neighbours have no direction.
        let end = points.last().copied();
        points.dedup_by(|after, before| after.distance(*before) < SAME);
        if let (Some(last), Some(end)) = (points.last_mut(), end) {
            *last = end;
        }
        self.positions(&points)
    }

    /// A ring ends where it begins.
    fn ring(&self, points: &[DVec2]) -> Value {
        points.iter().chain(points.first()).map(|&p| self.position(p)).collect()
    }

    /// Polygons, each with the holes that follow it.
    fn areas(&self, rings: &[Vec<DVec2>]) -> Value {
        let mut polygons: Vec<Vec<Value>> = Vec::new();
        for ring in rings {
            match polygons.last_mut().filter(|_| signed_area(ring) < 0.0) {
                Some(polygon) => polygon.push(self.ring(ring)),
                None => polygons.push(vec![self.ring(ring)]),
            }
        }
        json!(polygons)
    }
}

/// The area of a polygon, positive counter-clockwise (m²).
fn signed_area(ring: &[DVec2]) -> f64 {
    let n = ring.len();
    (0..n).map(|i| ring[i].perp_dot(ring[(i + 1) % n])).sum::<f64>() / 2.0
}

#[cfg(test)]
mod tests {
    use offtrack::map::drawing::{Drawn, Layers, read};
    use offtrack::map::ground::{Ground, Line};

    use super::*;

    fn read_back(text: &str) -> Drawn {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("road.geojson");
        std::fs::write(&file, text).unwrap();
        let layers = Layers {
            kerbs: "KERB".into(),
            lanes: "LANE".into(),
            aprons: "APRON".into(),
            unit: None,
            lane_width: 3.5,
            ring: None,
            arms: Vec::new(),
        };
        read(&file, &layers).unwrap()
    }

    #[test]
    fn what_is_written_is_read_as_the_same_road_with_kerbs_within_two_millimetres_and_lanes_within_five() {
        for (name, mirrored) in [("20m", false), ("50m", false), ("16m", true)] {
            let road = Road::named(name).unwrap();
            let origin = DVec2::new(691_234.5, 5_334_987.25);
            let moved = Road::on("moved".into(), Ground { origin, mirrored, ..road.ground().clone() });
            let text = geojson(&moved.seen(), Gutter::Drivable, &[], Some("urn:ogc:def:crs:EPSG::25832")).unwrap();
            let Drawn { ground, notes } = read_back(&text);
            assert!(notes.iter().any(|note| note.contains("urn:ogc:def:crs:EPSG::25832")), "{notes:?}");
            assert!(ground.origin.distance(origin) < 1e-3 && ground.mirrored == mirrored, "{}", ground.origin);
            assert_eq!(ground.faces.loops.len(), road.ground().faces.loops.len());
            for p in ground.faces.loops.iter().flat_map(|curve| curve.polyline(0.01)) {
                assert!(road.ground().faces.distance(p) < 2e-3, "{name}: {p}");
            }
            // Arms may begin with another one, but routes and widths are the same.
            assert_eq!(ground.lines.len(), road.ground().lines.len());
            for line in &ground.lines {
                let same = road.ground().lines.iter().find(|other| {
                    line.line.polyline(0.5).into_iter().all(|p| other.line.distance(p) < 5e-3)
                        && (line.lane, line.exit) == (other.lane, other.exit)
                });
                let widths = |other: &Line| other.widths.iter().zip(line.widths).all(|(a, b)| (a - b).abs() < 1e-9);
                assert!(same.is_some_and(widths), "{name}");
            }
        }
    }

    #[test]
    fn without_a_name_no_frame_is_stated_and_rings_end_where_they_begin() {
        let road = Road::named("16m").unwrap();
        let text = geojson(&road, Gutter::Drivable, &[], None).unwrap();
        let written: Value = serde_json::from_str(&text).unwrap();
        assert!(written.get("crs").is_none() && written["type"] == "FeatureCollection");
        let features = written["features"].as_array().unwrap();
        assert_eq!(features.len(), 1 + road.ground().faces.loops.len() + road.ground().lines.len());
        let kerbs = features.iter().filter(|feature| feature["properties"]["part"] == "kerb");
        for ring in kerbs.map(|kerb| kerb["geometry"]["coordinates"][0].as_array().unwrap()) {
            assert!(3 < ring.len() && ring[0] == ring[ring.len() - 1]);
            let of = |p: &Value| DVec2::new(p[0].as_f64().unwrap(), p[1].as_f64().unwrap());
            let points: Vec<DVec2> = ring[1..].iter().map(of).collect();
            assert!(0.0 < signed_area(&points), "an exterior ring is counter-clockwise");
        }
        let of: Vec<&str> = features.iter().filter_map(|feature| feature["properties"]["of"].as_str()).collect();
        assert!(of.starts_with(&["outer", "island"]) && of[2].starts_with("splitter "), "{of:?}");
    }

    #[test]
    fn a_hole_of_a_swept_area_is_a_ring_of_the_polygon_around_it() {
        let square = |half: f64| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| half * DVec2::new(x, y)).to_vec()
        };
        let hole: Vec<DVec2> = square(1.0).into_iter().rev().collect();
        let frame = Frame { origin: DVec2::new(10.0, 0.0) };
        let written = frame.areas(&[square(3.0), hole, square(2.0)]);
        let sizes: Vec<usize> =
            written.as_array().unwrap().iter().map(|polygon| polygon.as_array().unwrap().len()).collect();
        assert_eq!(sizes, [2, 1]);
        assert_eq!(written[0][0][0], json!([7.0, -3.0]));
    }
}
