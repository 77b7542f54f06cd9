//! Records of maps and outlines that are easily misread: doubled junctions, crossfall of old versions, ranges of
//! parameters, offsets; loops beside the road.

use std::fs;
use std::path::Path;

use offtrack::files::cache::Loading;
use offtrack::map::Road;
use offtrack::map::opendrive::{Hand, Map};
use offtrack::scenario::Scenario;

use crate::map_kinds::{file, imported, parsed, plain};
use crate::scenarios;

fn warnings(text: &str) -> String {
    parsed(text).warnings().collect::<Vec<_>>().join("\n")
}

#[test]
fn connections_of_a_junction_that_is_written_twice_count_together() {
    let text = plain();
    let (begin, end) = (text.find("<junction ").unwrap(), text.find("</junction>").unwrap());
    let head = text[begin..].split_inclusive('>').next().unwrap();
    let second = begin + head.len() + text[begin + head.len()..end].find("</connection>").unwrap() + 13;
    let split = format!("{}</junction>{head}{}", &text[..second], &text[second..]);
    assert_eq!(imported(&parsed(&split)).ground.lines.len(), imported(&parsed(&text)).ground.lines.len());
    assert!(warnings(&split).contains("has the id of an earlier junction; its connections count as that one's"));
}

#[test]
fn a_ring_is_warned_of_its_own_roads_however_many_others_are_odd() {
    let odd = "<road name=\"\" length=\"1\" id=\"ODD\" junction=\"-1\"><planView><geometry s=\"0\" x=\"300\" y=\"0\" \
               hdg=\"0\" length=\"1\"><line/></geometry></planView></road>";
    let others: String = (0..1500).map(|index| odd.replace("ODD", &format!("odd{index}"))).collect();
    // Road 1 is odd in more ways than are told of one road.
    let many = "<object type=\"trafficIsland\" s=\"0\" t=\"0\"/>".repeat(30);
    let own = crate::map_kinds::in_road_1(&plain(), "</road>", &format!("<objects>{many}</objects></road>"));
    let map = parsed(&own.replacen("<road ", &format!("{others}<road "), 1));
    let of_road_1 = |warnings: &[String]| {
        let own = warnings.iter().filter(|warning| warning.starts_with("road 1,") || warning.starts_with("road 1:"));
        own.map(|warning| warning.contains("has more that is odd")).collect::<Vec<_>>()
    };
    assert_eq!(map.warnings().filter(|warning| warning.ends_with("has no lanes")).count(), 1500);
    let all: Vec<String> = map.warnings().map(str::to_owned).collect();
    let told = of_road_1(&all);
    assert!(told.len() == 21 && told[20] && !told[..20].contains(&true), "{told:?}");
    assert_eq!(of_road_1(&imported(&map).warnings), told);
}

#[test]
fn what_is_not_read_is_warned_of_includes_links_along_a_road_and_further_links_of_a_lane() {
    let changed = |from: &str, to: &str| {
        let text = plain();
        assert!(text.contains(from), "{from}");
        warnings(&text.replacen(from, to, 1))
    };
    let said = changed("<road ", "<include file=\"more.xodr\"/><road ");
    assert!(said.contains("1 includes of other files are not read: put what they have here"), "{said}");
    let said = changed("<junction ", "<junction type=\"virtual\" ");
    assert!(said.contains("is virtual: only roads that end at a junction are joined by it"), "{said}");
    let said = changed("contactPoint=\"start\"/>", "elementS=\"3\" elementDir=\"+\"/>");
    assert!(said.contains("leads to a place along a road (elementS); only ends of roads are joined"), "{said}");
    let said = changed("<successor id=\"-1\"/>", "<successor id=\"-1\"/><successor id=\"-2\"/>");
    assert!(said.contains("has several links successor; the first is read"), "{said}");
}

#[test]
fn the_crossfall_of_old_versions_is_warned_of_on_either_side() {
    for side in ["left", "right", "both"] {
        let profile = format!(
            "</planView><lateralProfile><crossfall side=\"{side}\" s=\"0\" a=\"0.0996687\" b=\"0\" c=\"0\" d=\"0\"/>\
             </lateralProfile>"
        );
        let said = warnings(&plain().replacen("</planView>", &profile, 1));
        assert!(said.contains("crossfall (superelevation, crossfall, shape), up to 10.0 % on road "), "{said}");
    }
}

#[test]
fn a_range_that_is_none_is_refused_and_an_offset_that_is_no_number_counts_as_0_with_a_warning() {
    let spline = |range: &str| {
        let form = format!(
            "<paramPoly3 aU=\"0\" bU=\"1\" cU=\"0\" dU=\"0\" aV=\"0\" bV=\"0\" cV=\"0\" dV=\"0\" pRange=\"{range}\"/>"
        );
        plain().replacen("<line/>", &form, 1)
    };
    assert!(plain().contains("<line/>"));
    assert!(warnings(&spline("arcLength")).is_empty());
    let said = Map::parse(Path::new("ring.xodr"), &spline("arclength"), Hand::Map).unwrap_err().to_string();
    assert!(said.contains("paramPoly3: pRange: \"arclength\"; must be \"arcLength\" or \"normalized\""), "{said}");
    let header = |offset: &str| {
        let text = plain();
        let at = text.find("</header>").expect("the map has a header with children");
        format!("{}<offset {offset}/>{}", &text[..at], &text[at..])
    };
    let said = warnings(&header("x=\"500,5\" y=\"0\" z=\"0\" hdg=\"0\""));
    assert!(said.contains("its x is no number, and counts as 0"), "{said}");
}

#[test]
fn loops_of_an_outline_lie_inside_the_outer_one_and_in_no_other_and_an_island_around_the_centre() {
    let text = imported(&parsed(&plain())).ground.text(&[]);
    let square = |x: f64, side: f64| {
        let corners = [(-side, -side), (side, -side), (side, side), (-side, side)];
        let points = corners.map(|(dx, dy)| format!("[{}, {dy}]", x + dx));
        format!("[[face]]\nof = \"E\"\npath = [{}]\n\n", points.join(", "))
    };
    let folder = tempfile::tempdir().unwrap();
    let read = |text: &str| {
        let file = folder.path().join("ring.outline.toml");
        fs::write(&file, text).unwrap();
        Road::read(&file).map(|_| ()).map_err(|error| error.to_string())
    };
    let (before, after) = text.split_at(text.find("[[route]]").unwrap());
    let with = |more: &str| read(&format!("{before}{more}{after}"));
    for (loop_, said) in [
        (square(900.0, 1.0), "outside; must lie inside the outer loop, face["),
        (square(0.0, 1.0), "inside another; must not lie inside face["),
    ] {
        let found = with(&loop_).unwrap_err();
        assert!(found.contains("ring.outline.toml: face[") && found.contains(said), "{found}");
    }
    assert_eq!(read(&text), Ok(()));
}

#[test]
fn a_ring_that_is_nowhere_is_refused_by_its_key() {
    let map = file("plain_ring.xodr");
    let text = fs::read_to_string(scenarios().join("attard2023.toml")).unwrap();
    let head = text.split("[[roundabout]]").next().unwrap().replace("vehicles/", "");
    let vehicle = scenarios().join("vehicles");
    let head = head.replace("vehicle = \"", &format!("vehicle = \"{}/", vehicle.display()));
    let text = format!("{head}[[roundabout]]\nfile = {map:?}\nring = [nan, 0.0]\ntest = \"all\"\n");
    let said = Scenario::parse("mine", &text, None, &Loading::PLAIN).unwrap_err().to_string();
    assert!(said.contains("roundabout[0].ring[0]: NaN"), "{said}");
}

#[test]
fn links_to_roads_that_there_are_not_and_to_neither_end_are_warned_of() {
    let first = |key: &str, value: &str| {
        let text = plain();
        let at = text.find("<connection ").unwrap();
        let from = at + text[at..].find(&format!("{key}=\"")).unwrap() + key.len() + 2;
        let to = from + text[from..].find('"').unwrap();
        warnings(&format!("{}{value}{}", &text[..from], &text[to..]))
    };
    for (key, value, expected) in [
        ("connectingRoad", "77777", "its connectingRoad \"77777\" is no road; it is left out"),
        ("incomingRoad", "x", "its incomingRoad \"x\" is no road; it is left out"),
        ("contactPoint", "middle", "its contactPoint \"middle\" is neither start nor end; it counts as start"),
    ] {
        let said = first(key, value);
        assert!(said.contains(expected), "{said}");
    }
    assert!(warnings(&plain()).is_empty());
    let text = plain();
    let width = text.find("<width ").unwrap();
    let both = format!("{}<border sOffset=\"0\" a=\"1\" b=\"0\" c=\"0\" d=\"0\"/>{}", &text[..width], &text[width..]);
    assert!(warnings(&both).contains("has width and border; the border is not read"), "{}", warnings(&both));
}

#[test]
fn an_import_says_what_is_said_of_its_own_roads_and_not_of_others() {
    let text = plain();
    let road = text.lines().find(|line| line.contains(" id=\"1\" junction")).unwrap();
    let said = |text: &str| imported(&parsed(text)).warnings;
    let of_plain = said(&text).len();
    for (changed, expected) in [
        (format!("{road}\n{road}"), "road 1: has the id of an earlier road; it is left out"),
        (
            road.replace("<road ", "<road rule=\"XYZ\" "),
            "road 1: its rule XYZ is neither RHT nor LHT; it counts as RHT",
        ),
        (road.replace("<road ", "<road rule=\"LHT\" "), "1 of 20 roads have left-hand traffic"),
    ] {
        let warnings = said(&text.replace(road, &changed));
        assert_eq!(warnings.len(), of_plain + 1, "{warnings:?}");
        assert!(warnings[of_plain].starts_with(expected), "{warnings:?}");
    }
    let far = road.replace("x=\"38\"", "x=\"3800\"").replace(" id=\"1\" junction", " rule=\"XYZ\" id=\"12\" junction");
    let map = parsed(&text.replace(road, &format!("{road}\n{far}")));
    assert!(map.warnings().any(|warning| warning.starts_with("road 12: its rule XYZ")));
    assert_eq!(imported(&map).warnings.len(), of_plain);
}
