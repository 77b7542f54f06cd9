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
}
