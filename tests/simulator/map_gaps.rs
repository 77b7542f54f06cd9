//! Maps whose roundabout would be missed, or read otherwise than it is meant: what is found, and what is said.

use std::path::Path;

use glam::DVec2;
use offtrack::geometry::Curve;
use offtrack::map::opendrive::{Hand, Map};

use crate::map_kinds::{arms, imported, in_road_1, parsed, plain};

/// What is said of a map, a line each.
fn said(map: &Map) -> String {
    map.warnings().collect::<Vec<_>>().join("\n")
}

/// The ring with a road of these attributes and contents beside its own.
fn with_road(attributes: &str, profile: &str, contents: &str) -> String {
    let lane = "<lane id=\"-1\" type=\"driving\"><width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane>";
    let road = format!(
        "<road id=\"7000\" junction=\"-1\" length=\"120\"><planView><geometry s=\"0\" {attributes} length=\"120\">\
         <line/></geometry></planView>{profile}<lanes><laneSection s=\"0\"><center><lane id=\"0\" type=\"none\"/>\
         </center><right>{lane}</right></laneSection></lanes>{contents}</road>"
    );
    plain().replace("</OpenDRIVE>", &format!("{road}</OpenDRIVE>"))
}

#[test]
fn a_ring_whose_lanes_do_not_quite_meet_is_found() {
    let whole = imported(&parsed(&plain())).ground;
    for gap in [0.03, 0.3] {
        let short = format!("length=\"{}\"", 8.56194490192 - gap);
        let line = |line: &str| match line.contains(" id=\"100\" junction") {
            true => line.replace("length=\"8.56194490192\"", &short),
            false => line.to_owned(),
        };
        let map = parsed(&plain().lines().map(line).collect::<Vec<_>>().join("\n"));
        assert_eq!(map.rings().len(), 1, "{gap} m");
        let ground = imported(&map).ground;
        assert_eq!((ground.arms.len(), ground.lines.len()), (4, whole.lines.len()), "{gap} m");
        assert!((ground.island_radius - whole.island_radius).abs() < 0.01, "{gap} m: {}", ground.island_radius);
    }
}

#[test]
fn an_island_that_is_an_object_on_pavement_is_a_ring() {
    // A lane as wide as the island leads through it.
    let object = "<objects><object id=\"1\" type=\"trafficIsland\" s=\"60\" t=\"-15\" radius=\"14.5\"/></objects>";
    let wide = with_road("x=\"-60\" y=\"15\" hdg=\"0\"", "", object);
    let road = wide.replace("length=\"120\"", "length=\"30\"").replace("x=\"-60\" y=\"15\"", "x=\"-15\" y=\"15\"");
    let paved = road.replace("s=\"60\"", "s=\"15\"").replace("a=\"3.5\"", "a=\"30\"");
    let ground = imported(&parsed(&paved)).ground;
    let off = |curve: &Curve| curve.polyline(1e-3).iter().map(|p| (p.length() - 14.5).abs()).fold(0.0, f64::max);
    assert_eq!(ground.arms.len(), 4);
    assert!(ground.faces.loops.iter().any(|curve| off(curve) < 0.02), "{}", ground.island_radius);
}

#[test]
fn an_arm_that_its_links_do_not_reach_is_said_to_be_left_out_where_the_ring_is_imported() {
    let moved = imported(&parsed(&in_road_1(&plain(), "x=\"38\" y=\"0\"", "x=\"38\" y=\"1.6\"")));
    assert_eq!(arms(&moved).len(), 3);
    let lost: Vec<&String> = moved.warnings.iter().filter(|warning| warning.contains("so it is left out")).collect();
    assert_eq!(lost.len(), 2, "{:?}", moved.warnings);
    assert!(lost[0].contains("road 1 lane 1: its link to road 400 lane -1 jumps by 1.60 m"), "{}", lost[0]);
}

#[test]
fn a_map_without_a_ring_says_which_road_passes_above_its_lanes() {
    let elevation = "<elevationProfile><elevation s=\"0\" a=\"7\" b=\"0\" c=\"0\" d=\"0\"/></elevationProfile>";
    let map = parsed(&with_road("x=\"-60\" y=\"0\" hdg=\"0\"", elevation, ""));
    let message = map.nearest(DVec2::ZERO).unwrap_err().to_string();
    assert!(message.contains("no roundabout here") && message.contains("; road 7000 passes 7.0 m above"), "{message}");
    assert_eq!(parsed(&plain()).bridges(), Vec::<String>::new());
}

#[test]
fn a_hand_of_traffic_that_the_links_of_junctions_contradict_is_warned_of() {
    let of = |hand: Hand| Map::parse(Path::new("ring.xodr"), &plain(), hand).unwrap();
    assert_eq!(said(&of(Hand::Map)), "");
    let left = said(&of(Hand::Left));
    assert!(left.ends_with("lead away from them in left-hand traffic: `--hand right` would do"), "{left}");
    assert!(imported(&of(Hand::Left)).warnings.contains(&left), "{left}");
}

#[test]
fn a_lane_with_traffic_both_ways_is_said_to_be_driven_on_one_way() {
    for (from, to) in [
        ("<lane id=\"1\" type=\"driving\"", "<lane id=\"1\" direction=\"both\" type=\"driving\""),
        ("<lane id=\"1\" type=\"driving\"", "<lane id=\"1\" type=\"bidirectional\""),
    ] {
        let said = said(&parsed(&in_road_1(&plain(), from, to)));
        assert!(said.contains("lane 1: has traffic both ways; it is driven on one way"), "{said}");
    }
}

#[test]
fn a_width_that_begins_late_is_before_what_it_is_there() {
    let late = "<width sOffset=\"4\" a=\"4\" b=\"0.5\" c=\"0\" d=\"0\"/>";
    let sloped = in_road_1(&plain(), "<width sOffset=\"0\" a=\"4\" b=\"0\" c=\"0\" d=\"0\"/>", late);
    let map = parsed(&sloped);
    assert_eq!(arms(&imported(&map)).len(), 4);
    // Both lanes of road 1 are 4 m wide where they meet the ring's.
    let ends: Vec<DVec2> =
        map.lane_centres(0.01).iter().flat_map(|(_, path)| [path[0], path[path.len() - 1]]).collect();
    for y in [2.0, -2.0] {
        let here = ends.iter().filter(|p| p.distance(DVec2::new(38.0, y)) < 1e-6).count();
        assert_eq!(here, 2, "y {y} m: one of road 1, one of the junction's: {ends:?}");
    }
}
