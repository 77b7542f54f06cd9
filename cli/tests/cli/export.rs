//! `offtrack export` and `generate --xodr`: roads as files of other programs, and what `import` makes of them.

use serde_json::Value;

use crate::place::{Place, offtrack, refusal, succeed};

#[test]
fn a_road_is_written_as_a_map_and_as_features_that_become_the_same_road_again() {
    let place = Place::new();
    let outline = place.text("back.outline.toml");
    for (file, notes) in [("road.xodr", 0), ("road.geojson", 1)] {
        let file = place.text(file);
        let output = offtrack(&["export", "16m", "-o", &file]);
        succeed(&output);
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(said.contains("written: ") && said.contains("4 arms, 20 routes"), "{said}");
        let output = offtrack(&["import", &file, "-o", &outline]);
        succeed(&output);
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(said.contains("4 arms, 20 routes, island 7.85 m"), "{said}");
        assert!(notes <= said.matches("note: ").count(), "{said}");
        let json = place.text("back.json");
        succeed(&offtrack(&["draw", &outline, "--route", "W-right-2", "-o", &json]));
        assert_eq!(place.json("back.json")["sweep"]["own_lane_suffices"], true);
    }
}

#[test]
fn features_state_the_frame_that_is_named_and_degrees_are_refused() {
    let place = Place::new();
    let file = place.text("road.geojson");
    succeed(&offtrack(&["export", "20m", "-o", &file, "--crs", "urn:ogc:def:crs:EPSG::25832"]));
    let mut written = place.json("road.geojson");
    assert_eq!(written["crs"]["properties"]["name"], "urn:ogc:def:crs:EPSG::25832");
    written["crs"]["properties"]["name"] = "urn:ogc:def:crs:OGC:1.3:CRS84".into();
    std::fs::write(&file, written.to_string()).unwrap();
    let said = refusal(&offtrack(&["import", &file, "-o", &place.text("a.outline.toml")]), 2);
    assert!(said.contains("crs") && said.contains("not degrees"), "{said}");
}

#[test]
fn what_a_road_cannot_be_written_as_is_refused_by_flag_and_value() {
    let place = Place::new();
    let (map, features) = (place.text("a.xodr"), place.text("a.geojson"));
    for (arguments, expected) in [
        (&["16m", "-o", "a.dwg"][..], "must end in .xodr or .geojson"),
        (&["16m", "-o", &map, "--crs", "EPSG:25832"], "--crs: EPSG:25832; is for .geojson"),
        (&["16m", "-o", &map, "--gutter", "solid"], "--gutter: solid; is for .geojson"),
        (&["16m", "-o", &features, "--crs", "two words"], "letters, digits and signs"),
        (&["no_such", "-o", &map], "no_such"),
        (&["16m", "-o", &map, "--ring", "1,2"], "--ring: 1,2"),
    ] {
        let said = refusal(&offtrack(&[&["export"], arguments].concat()), 2);
        assert!(said.contains(expected), "{expected}: {said}");
    }
    assert!(!place.file("a.xodr").exists());
}

#[test]
fn generated_roads_are_written_as_maps_of_the_same_roads_too() {
    let place = Place::new();
    let folder = place.text("roads");
    succeed(&offtrack(&["generate", "--seed", "7", "--first", "3", "--count", "2", "--xodr", "-o", &folder]));
    for index in [3, 4] {
        let map = std::fs::read_to_string(place.file(&format!("roads/wide-7-{index}.xodr"))).unwrap();
        let again = place.text("again.xodr");
        succeed(&offtrack(&["export", &format!("wide/7/{index}"), "-o", &again]));
        assert_eq!(map, std::fs::read_to_string(&again).unwrap());
    }
    let json: Value = {
        let (map, file) = (place.text("roads/wide-7-3.xodr"), place.text("a.json"));
        succeed(&offtrack(&["draw", &map, "-o", &file]));
        place.json("a.json")
    };
    assert_eq!(json["routes"].as_array().unwrap().len(), 20);
    // One of these three loses routes as a map; the others and all roads are written.
    let folder = place.text("some");
    let output = offtrack(&["generate", "--seed", "2026", "--count", "3", "--xodr", "-o", &folder]);
    succeed(&output);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("no map of it is written: wide/2026/1: routes: 20; as a map it has 17"), "{said}");
    for (file, is_there) in [("0.xodr", true), ("1.xodr", false), ("1.toml", true), ("2.xodr", true)] {
        assert_eq!(place.file(&format!("some/wide-2026-{file}")).exists(), is_there, "{file}");
    }
}

#[test]
fn features_are_valid_polygons_and_lines_without_a_turn_back() {
    let place = Place::new();
    let maps = crate::place::repository().join("scenarios/maps");
    for name in ["zala8", "zala25", "town03", "town03-crossing"] {
        let file = place.text("road.geojson");
        succeed(&offtrack(&["export", maps.join(format!("{name}.outline.toml")).to_str().unwrap(), "-o", &file]));
        for feature in place.json("road.geojson")["features"].as_array().unwrap() {
            let points = |value: &Value| -> Vec<[f64; 2]> {
                value.as_array().unwrap().iter().map(|p| [0, 1].map(|axis| p[axis].as_f64().unwrap())).collect()
            };
            let coordinates = &feature["geometry"]["coordinates"];
            match feature["geometry"]["type"].as_str().unwrap() {
                "Polygon" => {
                    let crossings = crossings(&points(&coordinates[0]));
                    assert!(crossings.is_empty(), "{name}, {}: {crossings:?}", feature["properties"]);
                }
                "LineString" => {
                    let line = points(coordinates);
                    let turns_back = line.windows(3).find(|three| {
                        let [one, other] = [0, 1].map(|i| [0, 1].map(|axis| three[i + 1][axis] - three[i][axis]));
                        one[0] * other[0] + one[1] * other[1] < 0.0
                    });
                    assert_eq!(turns_back, None, "{name}");
                }
                _ => {}
            }
        }
    }
}

/// Pairs of edges of a closed ring that cross, those of neighbours left out.
fn crossings(ring: &[[f64; 2]]) -> Vec<[usize; 2]> {
    let n = ring.len() - 1;
    let side = |a: [f64; 2], b: [f64; 2], p: [f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    let cross = |i: usize, j: usize| {
        let (a, b, c, d) = (ring[i], ring[i + 1], ring[j], ring[j + 1]);
        side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
    };
    let pairs = (0..n).flat_map(|i| (i + 2..n).map(move |j| [i, j]));
    pairs.filter(|&[i, j]| (i, j) != (0, n - 1) && cross(i, j)).collect()
}
