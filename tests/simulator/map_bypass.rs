//! Lanes that pass beside a ring.

use std::fs;
use std::path::Path;

use glam::DVec2;
use offtrack::map::Road;
use offtrack::map::opendrive::{Hand, Imported, Map, exported};

use crate::map_kinds::{arms, file, imported, parsed, plain};

#[test]
fn a_bypass_far_from_its_arms_is_a_lane_of_the_arms_that_it_joins() {
    let map = Map::read(&file("bypass_apart.xodr"), Hand::Map).unwrap();
    let with = imported(&map);
    assert_eq!(arms(&with), ["E", "N", "W", "S"]);
    assert!(
        with.warnings
            .iter()
            .any(|warning| warning.contains("passes beside the ring to") && warning.contains("next to the kerb")),
        "{:?}",
        with.warnings
    );
    let (plain, lane) = (parsed(&plain()), |imported: &Imported| imported.ground.lane_radii.clone());
    let without = imported(&plain);
    assert_eq!(with.ground.lines.len(), without.ground.lines.len() + 1);
    assert!(lane(&with).len() == 1 && (lane(&with)[0] - lane(&without)[0]).abs() < 0.1);
    let roundabout = Road::on("ring".to_owned(), with.ground);
    for route in roundabout.routes(40.0, 35.0, 2.0).unwrap() {
        // Exits are counted as without it, and its own route stays outside the ring.
        assert_eq!(roundabout.exit_arm(&route), (route.entry + route.exit as usize) % 4, "{}", route.name);
        let outside = route.waypoints.iter().all(|waypoint| roundabout.outer_radius() < waypoint.position.length());
        assert_eq!(outside, route.name == "ring/E-right-1", "{}", route.name);
    }
}

#[test]
fn a_bypass_that_comes_from_no_arm_is_left_out_with_a_warning() {
    let text = fs::read_to_string(file("bypass_apart.xodr")).unwrap();
    let kept = |line: &&str| ![" id=\"700\" ", " id=\"701\" "].iter().any(|id| line.contains(id));
    let map = parsed(&text.lines().filter(kept).collect::<Vec<_>>().join("\n"));
    let found = imported(&map);
    assert_eq!((arms(&found), found.ground.lines.len()), (vec!["E", "N", "W", "S"], 16));
    let warning = found.warnings.iter().find(|warning| warning.contains("passes beside the ring")).unwrap();
    assert!(warning.ends_with("and is left out: it comes from the road of no arm"), "{warning}");
}

#[test]
fn a_bypass_is_written_as_a_map_and_read_back_whatever_the_widths_of_its_lanes() {
    let map = Map::read(&file("bypass_apart.xodr"), Hand::Map).unwrap();
    for width in [3.5, 4.25] {
        let mut ground = imported(&map).ground;
        let outer = ground.outer_radius;
        let bypass = ground.lines.iter_mut().find(|line| outer < line.line.distance(DVec2::ZERO)).unwrap();
        bypass.widths[1] = width;
        let text = exported(&Road::on("ring".to_owned(), ground)).unwrap();
        let again = Map::parse(Path::new("again.xodr"), &text, Hand::Map).unwrap();
        let lines = &imported(&again).ground.lines;
        assert_eq!(lines.len(), 17);
        assert_eq!(lines.iter().filter(|line| outer < line.line.distance(DVec2::ZERO)).count(), 1);
    }
}
