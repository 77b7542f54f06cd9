//! A drawing that other programs wrote, ezdxf 1.4 and, from what that wrote, LibreCAD 2.2: light and old polylines,
//! lines and arcs in millimetres, on layers of its own, beside a text and a block; and features of GeoJSON, good and
//! bad.

use std::path::Path;

use glam::DVec2;
use offtrack::geometry::Curve;
use offtrack::map::Road;
use offtrack::map::drawing::{self, Drawn, Layers, Unit};
use serde_json::{Value, json};

/// Where the ring lies in the drawing (m).
const AT: DVec2 = DVec2::new(412.5, -88.25);

/// The drawings of both programs.
const FILES: [&str; 2] = ["ezdxf_16m.dxf", "librecad_16m.dxf"];

fn drawing(name: &str, kerbs: &str) -> Result<Drawn, offtrack::files::reader::Error> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/maps").join(name);
    let layers = Layers {
        kerbs: kerbs.into(),
        lanes: "C-LANE".into(),
        aprons: "APRON".into(),
        unit: None,
        lane_width: 4.0,
        ring: Some(AT),
        arms: Vec::new(),
    };
    drawing::read(&file, &layers)
}

#[test]
fn drawings_of_other_programs_are_the_road_that_they_were_drawn_from_within_a_millimetre() {
    for name in FILES {
        let Drawn { ground, notes } = drawing(name, "C-KERB").unwrap();
        let road = Road::named("16m").unwrap();
        let own = road.ground();
        assert!(ground.origin.distance(AT) < 1e-3 && !ground.mirrored, "{name}: {}", ground.origin);
        assert_eq!((ground.arms.len(), ground.lines.len(), ground.faces.loops.len()), (4, 4, own.faces.loops.len()));
        // The island is drawn of arcs, and the entities of one more layer are left out.
        assert!(notes.iter().any(|note| note.contains("joined")), "{name}: {notes:?}");
        assert!(notes.iter().any(|note| note.contains("2 entities on 1 other layers")), "{name}: {notes:?}");
        for p in ground.faces.loops.iter().flat_map(|face| face.polyline(0.01)) {
            assert!(own.faces.distance(p) < 1e-3, "{name}: {p}");
        }
        for line in &ground.lines {
            let is_near = |other: &Curve| line.line.polyline(0.5).iter().all(|&p| other.distance(p) < 1e-3);
            assert!(own.lines.iter().any(|other| is_near(&other.line)), "{name}");
        }
    }
}

#[test]
fn a_drawing_that_another_program_read_and_wrote_is_the_same_road_within_a_millimetre() {
    let [one, other] = FILES.map(|name| drawing(name, "C-KERB").unwrap().ground);
    for (face, same) in one.faces.loops.iter().zip(&other.faces.loops) {
        assert!(face.polyline(0.01).into_iter().all(|p| same.distance(p) < 1e-3));
    }
    for (line, same) in one.lines.iter().zip(&other.lines) {
        assert_eq!((line.lane, line.entry, line.exit), (same.lane, same.entry, same.exit));
        assert!(line.line.polyline(0.5).into_iter().all(|p| same.line.distance(p) < 1e-3));
    }
    // They are two drawings: their tables and entities are written otherwise.
    let text = |name| std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/maps").join(name)).unwrap();
    assert!(text(FILES[1]).starts_with(b"999\ndxfrw") && !text(FILES[0]).starts_with(b"999"));
}

#[test]
fn a_layer_that_the_drawing_does_not_have_is_refused_with_those_that_it_has() {
    for name in FILES {
        let said = drawing(name, "CURB").unwrap_err().to_string();
        assert!(said.contains(&format!("{name}: layer CURB: empty")) && said.contains("C-KERB ("), "{said}");
    }
}

/// The features of a ring of this radius with two ways past it, from west to east, and another part.
fn features() -> Value {
    let circle = |radius: f64| -> Vec<[f64; 2]> {
        let at = |i: u32| DVec2::from_angle(f64::from(i % 360).to_radians()) * radius + AT;
        (0..=360).map(|i| at(i).into()).collect()
    };
    let square: Vec<[f64; 2]> = [(-60.0, -30.0), (60.0, -30.0), (60.0, 30.0), (-60.0, 30.0), (-60.0, -30.0)]
        .map(|(x, y)| [AT.x + x, AT.y + y])
        .into();
    let way: Vec<[f64; 2]> = (0..=120)
        .map(|i| {
            let x = -59.0 + f64::from(i) * 118.0 / 120.0;
            [AT.x + x, AT.y - (14.0f64.powi(2) - x.clamp(-14.0, 14.0).powi(2)).sqrt()]
        })
        .collect();
    let back: Vec<[f64; 2]> = way.iter().map(|p| [2.0 * AT.x - p[0], 2.0 * AT.y - p[1]]).collect();
    let feature = |part: &str, kind: &str, coordinates: Value| {
        let geometry = json!({"type": kind, "coordinates": coordinates});
        json!({"type": "Feature", "properties": {"Layer": part}, "geometry": geometry})
    };
    json!({"type": "FeatureCollection", "features": [
        feature("kerb", "Polygon", json!([square, circle(10.0)])),
        feature("LANE", "LineString", json!(way)),
        feature("lane", "MultiLineString", json!([back])),
        feature("tree", "Point", json!([AT.x, AT.y, 300.0])),
    ]})
}

fn read_features(features: &str, unit: Option<Unit>) -> Result<Drawn, String> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("site.geojson");
    std::fs::write(&file, features).unwrap();
    let (kerbs, lanes, aprons) = ("KERB".into(), "LANE".into(), "APRON".into());
    let layers = Layers { kerbs, lanes, aprons, unit, lane_width: 4.0, ring: None, arms: Vec::new() };
    drawing::read(&file, &layers).map_err(|error| error.to_string())
}

#[test]
fn features_are_a_road_by_their_layer_in_metres_or_the_unit_that_is_asked_for() {
    let Drawn { ground, notes } = read_features(&features().to_string(), None).unwrap();
    assert!(ground.origin.distance(AT) < 1e-3 && (ground.island_radius - 10.0).abs() < 2e-3, "{ground:?}");
    assert_eq!((ground.faces.loops.len(), ground.lines.len(), ground.arms.len()), (2, 2, 2));
    assert!(notes.iter().any(|note| note.contains("1 features of 1 other parts")), "{notes:?}");
    let mut less = features();
    less["features"][2]["geometry"].take();
    let Drawn { ground: one_way, notes } = read_features(&less.to_string(), None).unwrap();
    assert!(
        one_way.lines.len() == 1 && notes.contains(&"feature 3 has no geometry and is left out".into()),
        "{notes:?}"
    );
    let Drawn { ground, .. } = read_features(&features().to_string(), Some(Unit::Foot)).unwrap();
    assert!((ground.island_radius - 3.048).abs() < 2e-3, "{}", ground.island_radius);
}

#[test]
fn bad_features_are_refused_by_their_number_and_what_would_do() {
    let changed = |change: &dyn Fn(&mut Value)| {
        let mut features = features();
        change(&mut features);
        read_features(&features.to_string(), None).unwrap_err()
    };
    let geometry = |features: &mut Value, index: usize| features["features"][index]["geometry"].take();
    type Change = Box<dyn Fn(&mut Value)>;
    let cases: [(Change, &str); 15] = [
        (Box::new(|f| f["type"] = "Feature".into()), "type: \"Feature\"; must be \"FeatureCollection\""),
        (
            Box::new(|f| drop(f["features"][0]["geometry"]["coordinates"][1].as_array_mut().unwrap().pop())),
            "feature 1: coordinates[1]: 360 positions; is open",
        ),
        (
            Box::new(|f| f["features"][1]["geometry"]["type"] = "Polygon".into()),
            "feature 2: geometry: Polygon; must be",
        ),
        (Box::new(|f| f["features"][0]["geometry"]["type"] = "Point".into()), "feature 1: geometry: Point; must be"),
        (
            Box::new(|f| f["features"][1]["geometry"]["coordinates"][3] = json!([1.0, null])),
            "feature 2: coordinates[3]: [1.0,null]; must be a position",
        ),
        (Box::new(|f| f["features"][1]["geometry"]["coordinates"][3][0] = json!(1e9)), "feature 2: coordinates[3]"),
        (
            Box::new(|f| f["features"][0]["geometry"]["coordinates"][0][1][0] = json!(9e7)),
            "feature 1: coordinates[0]: kerbs are more than 50 km long",
        ),
        (Box::new(|f| f["features"][1]["geometry"]["coordinates"] = json!([])), "feature 2: coordinates: no positions"),
        (Box::new(|f| f["features"][0]["properties"] = Value::Null), "part KERB: none; a feature's property `part`"),
        (Box::new(|f| f["features"][1]["properties"]["width"] = json!(0.0)), "feature 2: width: 0 m"),
        (Box::new(|f| f["features"][1]["properties"]["width"] = json!("4.5")), "feature 2: width: \"4.5\"; must be"),
        (Box::new(|f| f["features"][1]["properties"]["widths"] = json!([4, 4])), "feature 2: widths: [4,4]; must be"),
        (Box::new(|f| f["features"][1]["properties"]["widths"] = json!([4, 4, null])), "a list of three"),
        (
            Box::new(|f| f["crs"] = json!({"type": "name", "properties": {"name": "EPSG:4326"}})),
            "crs: EPSG:4326; coordinates must be metres, not degrees",
        ),
        (
            Box::new(|f| f["crs"] = json!({"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3857"}})),
            "crs: urn:ogc:def:crs:EPSG::3857; lengths are not true in it",
        ),
    ];
    for (change, expected) in cases {
        let said = changed(&change);
        assert!(said.contains("site.geojson: ") && said.contains(expected), "{expected}: {said}");
    }
    // Degrees, by how little the kerbs reach over.
    let said = changed(&|features| {
        for index in 0..3 {
            let text = geometry(features, index).to_string();
            let mut shape: Value = serde_json::from_str(&text).unwrap();
            shrink(&mut shape["coordinates"]);
            features["features"][index]["geometry"] = shape;
        }
    });
    assert!(said.contains("kerbs: reach over 0.0012") && said.contains("ogr2ogr"), "{said}");
    for text in ["", "{}", "[1, 2]", "{\"type\": \"FeatureCollection\", \"features\": [NaN]}"] {
        assert!(read_features(text, None).is_err(), "{text}");
    }
    let text = features().to_string();
    for at in (0..text.len()).step_by(997) {
        assert!(read_features(&text[..at], None).is_err());
    }
}

/// Metres as about so many degrees.
fn shrink(coordinates: &mut Value) {
    match coordinates {
        Value::Array(parts) => parts.iter_mut().for_each(shrink),
        Value::Number(_) => *coordinates = json!(coordinates.as_f64().unwrap() * 1e-5),
        _ => {}
    }
}
