//! Maps as people have them, OpenDRIVE 1.4 to 1.8: a ring with four arms, and what editors and converters make of it.

use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec2;
use offtrack::map::Road;
use offtrack::map::opendrive::{Hand, Imported, Map, Options};

pub fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/maps").join(name)
}

/// The text of a ring with an island of 15 m, one lane of 5 m, and four arms of a lane in and a lane out.
pub fn plain() -> String {
    fs::read_to_string(file("plain_ring.xodr")).unwrap()
}

pub fn parsed(text: &str) -> Map {
    Map::parse(Path::new("ring.xodr"), text, Hand::Map).unwrap()
}

fn refusal(text: &str) -> String {
    Map::parse(Path::new("ring.xodr"), text, Hand::Map).unwrap_err().to_string()
}

pub fn imported(map: &Map) -> Imported {
    map.ground(&map.rings()[0], &Options::default()).unwrap()
}

pub fn arms(imported: &Imported) -> Vec<&str> {
    imported.ground.arms.iter().map(|arm| arm.name.as_str()).collect()
}

/// `text` with every `from` of road 1 replaced, which leads east from (38, 0).
pub fn in_road_1(text: &str, from: &str, to: &str) -> String {
    let replaced =
        |line: &str| if line.contains(" id=\"1\" junction") { line.replace(from, to) } else { line.to_owned() };
    let changed = text.lines().map(replaced).collect::<Vec<_>>().join("\n");
    assert_ne!(changed, text, "{from}");
    changed
}

/// The ring with its eastern arm cut in two after 10 m: road 1 leads to road 801 by a link, and 801 back to 1 by
/// another.
fn continued(link: &str, back: &str, more: &str) -> String {
    let text = plain();
    let road = text.lines().find(|line| line.contains(" id=\"1\" junction")).unwrap();
    let junction = "<predecessor elementType=\"junction\" elementId=\"900\"/>";
    let near = road.replace("length=\"70\"", "length=\"10\"").replace(junction, &format!("{junction}{link}"));
    let far = road
        .replace(junction, back)
        .replace("id=\"1\" junction", "id=\"801\" junction")
        .replace("x=\"38\"", "x=\"48\"");
    text.replace(road, &format!("{near}\n{far}")).replace("</OpenDRIVE>", &format!("{more}</OpenDRIVE>"))
}

/// All sixteen routes, 45 m before and after the ring: longer than what is left of an arm that was cut.
fn assert_drivable(map: &Map) {
    let roundabout = Road::on("ring".to_owned(), imported(map).ground);
    assert_eq!(roundabout.routes(45.0, 45.0, 2.0).unwrap().len(), 16);
}

#[test]
fn lanes_that_a_section_of_one_side_does_not_describe_go_on() {
    let text = plain();
    let lanes = text.lines().find(|line| line.contains(" id=\"1\" junction")).unwrap();
    let (_, left) = lanes.split_once("<left>").unwrap();
    let (left, _) = left.split_once("</left>").unwrap();
    let single =
        format!("</laneSection><laneSection s=\"5\" singleSide=\"true\"><left>{left}</left></laneSection></lanes>");
    let linked = |text: &str, id: &str| {
        let link = format!("<link><predecessor id=\"{id}\"/><successor id=\"{id}\"/></link><width");
        text.replace(
            &format!("<lane id=\"{id}\" type=\"driving\" level=\"false\"><link></link><width"),
            &format!("<lane id=\"{id}\" type=\"driving\" level=\"false\">{link}"),
        )
    };
    let map = parsed(&linked(&linked(&in_road_1(&text, "</laneSection></lanes>", &single), "1"), "-1"));
    assert_drivable(&map);
    // Sections of either side that begin together are one.
    let both = in_road_1(&text, "<laneSection s=\"0\">", "<laneSection s=\"0\" singleSide=\"true\">");
    let both = in_road_1(&both, "<right>", "</laneSection><laneSection s=\"0\" singleSide=\"true\"><right>");
    assert_drivable(&parsed(&both));
}

#[test]
fn roads_joined_by_a_direct_junction_are_one_arm() {
    let link = "<successor elementType=\"junction\" elementId=\"950\"/>";
    let back = "<predecessor elementType=\"junction\" elementId=\"950\"/>";
    // One connection, from road 1 alone: it holds for both directions.
    let junction = "<junction id=\"950\" type=\"direct\"><connection id=\"0\" incomingRoad=\"1\" linkedRoad=\"801\" \
                    contactPoint=\"start\">\
        <laneLink from=\"-1\" to=\"-1\"/><laneLink from=\"1\" to=\"1\"/></connection></junction>";
    let map = parsed(&continued(link, back, junction));
    assert_drivable(&map);
    assert_eq!(map.warnings().count(), 0);
}

#[test]
fn lanes_without_links_are_joined_by_place_where_their_roads_are_linked() {
    let link = "<successor elementType=\"road\" elementId=\"801\" contactPoint=\"start\"/>";
    let back = "<predecessor elementType=\"road\" elementId=\"1\" contactPoint=\"end\"/>";
    for (link, back) in [(link, back), (link, ""), ("", back)] {
        let map = parsed(&continued(link, back, ""));
        assert_drivable(&map);
        let warnings: Vec<&str> = map.warnings().collect();
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        assert!(
            warnings.contains(
                &"road 1 lane -1: has no link to a lane, and is joined to road 801 lane -1, which begins there"
            ),
            "{warnings:?}"
        );
    }
    // The same through a junction whose connections have no lane links.
    let (link, back) = (
        "<successor elementType=\"junction\" elementId=\"950\"/>",
        "<predecessor elementType=\"junction\" elementId=\"950\"/>",
    );
    let junction = "<junction id=\"950\"><connection id=\"0\" incomingRoad=\"1\" connectingRoad=\"801\" \
                    contactPoint=\"start\"/></junction>";
    let map = parsed(&continued(link, back, junction));
    assert!(map.warnings().any(|warning| warning.contains(
        "road 1 lane -1: has no link to a lane, and is joined to \
        road 801 lane -1"
    )));
}

#[test]
fn an_arm_that_ends_early_is_refused_with_what_the_map_says_there() {
    for (link, expected) in [
        ("", "road 1 is linked to no road there"),
        (
            "<successor elementType=\"junction\" elementId=\"950\"/>",
            "junction 950 has no connection that fits for road 1 lane 1",
        ),
        (
            "<successor elementType=\"road\" elementId=\"99\" contactPoint=\"start\"/>",
            "road 99, which the map does not have",
        ),
    ] {
        let map = parsed(&continued(link, "", "<junction id=\"950\"/>"));
        let Imported { ground, warnings, .. } = imported(&map);
        assert!(
            warnings.iter().any(|warning| warning.contains("arm E: a lane begins 48.0 m from the centre: ")),
            "{warnings:?}"
        );
        let message = Road::on("ring".to_owned(), ground).routes(45.0, 45.0, 2.0).unwrap_err().to_string();
        assert!(message.contains("m fit: ") && message.contains(expected), "{message}");
    }
}

#[test]
fn lanes_are_joined_across_a_section_of_no_length() {
    let text = plain();
    let link = |id: i32| {
        format!(
            "<lane id=\"{id}\" type=\"driving\" level=\"false\"><link><predecessor id=\"{id}\"/><successor \
             id=\"{id}\"/></link>"
        )
    };
    let linked = [1, -1].iter().fold(text, |text, id| {
        in_road_1(&text, &format!("<lane id=\"{id}\" type=\"driving\" level=\"false\"><link></link>"), &link(*id))
    });
    let road = linked.lines().find(|line| line.contains(" id=\"1\" junction")).unwrap();
    let (_, section) = road.split_once("<laneSection s=\"0\">").unwrap();
    let (section, _) = section.split_once("</laneSection>").unwrap();
    for stations in [&["0", "30", "30"][..], &["0", "0"], &["0", "70"]] {
        let sections: String =
            stations.iter().map(|s| format!("<laneSection s=\"{s}\">{section}</laneSection>")).collect();
        let map = parsed(&linked.replace(
            &format!("<laneSection s=\"0\">{section}</laneSection></lanes></road>"),
            &format!("{sections}</lanes></road>"),
        ));
        assert!(map.warnings().any(
            |warning| warning.starts_with("road ") && warning.contains("has no length; lanes are joined across it")
        ));
        assert_drivable(&map);
    }
}

#[test]
fn a_short_sharp_spiral_is_read_with_a_warning_and_one_that_turns_too_much_is_refused() {
    let spiral = |length: f64| {
        let piece = format!(
            "<geometry s=\"70\" x=\"108\" y=\"0\" hdg=\"0\" length=\"{length}\"><spiral curvStart=\"100\" \
             curvEnd=\"-100\"/></geometry></planView>"
        );
        in_road_1(&plain(), "</planView>", &piece)
    };
    let map = parsed(&spiral(0.01));
    assert!(map.warnings().any(|warning| warning
        == "road 1, geometry s 70: has a radius of 0.0100 m on a length of 0.0100 m; it is read as it is"));
    assert_drivable(&map);
    assert!(refusal(&spiral(0.31)).contains("road 1, geometry s 70, spiral: curvStart: 100; turns more than 30 rad"));
}

#[test]
fn grades_and_crossfall_are_warned_of_with_their_largest_value() {
    let with = |profile: &str| {
        let map = parsed(&in_road_1(&plain(), "</planView>", &format!("</planView>{profile}")));
        let at_ring = imported(&map).warnings.join("\n");
        (map.warnings().collect::<Vec<_>>().join("\n"), at_ring)
    };
    let (of_map, of_ring) =
        with("<elevationProfile><elevation s=\"0\" a=\"0\" b=\"0\" c=\"0.006\" d=\"-0.00005\"/></elevationProfile>");
    assert!(of_map.contains("road 1: has a grade of 24.0 %; the simulated road is level"), "{of_map}");
    assert!(of_ring.contains("grades of up to 24.0 % (road 1); the simulated road is level"), "{of_ring}");
    // Heights in pieces of 10 m, each level by itself.
    let pieces: String = (0..7)
        .map(|i| format!("<elevation s=\"{}\" a=\"{}\" b=\"0\" c=\"0\" d=\"0\"/>", 10 * i, f64::from(i) / 2.0))
        .collect();
    let (of_map, _) = with(&format!("<elevationProfile>{pieces}</elevationProfile>"));
    assert!(
        of_map.contains("road 1: has a grade of 5.0 %") && of_map.contains("elevation jumps by up to 0.50 m, at s "),
        "{of_map}"
    );
    let superelevation =
        "<lateralProfile><superelevation s=\"0\" a=\"-0.1\" b=\"-0.001\" c=\"0\" d=\"0\"/></lateralProfile>";
    let (of_map, of_ring) = with(superelevation);
    // tan(0.17) = 0.172.
    assert!(
        of_map.contains("1 of 20 roads have a crossfall (superelevation, crossfall, shape), up to 17.2 % on road 1"),
        "{of_map}"
    );
    assert!(of_ring.contains("crossfall of up to 17.2 % (road 1)"), "{of_ring}");
    // Steeper beyond the lanes, which end 4 m left of the reference line.
    let shape = "<lateralProfile><shape s=\"0\" t=\"0\" a=\"0\" b=\"0\" c=\"0.01\" d=\"0\"/><shape s=\"0\" t=\"50\" \
                 a=\"0\" b=\"9\" c=\"0\" d=\"0\"/></lateralProfile>";
    assert!(with(shape).0.contains("up to 8.0 % on road 1"), "{:?}", with(shape));
    let level = "<elevationProfile><elevation s=\"0\" a=\"120\" b=\"0.02\" c=\"0\" d=\"0\"/></elevationProfile>\
        <lateralProfile><superelevation s=\"0\" a=\"0.025\" b=\"0\" c=\"0\" d=\"0\"/></lateralProfile>";
    assert_eq!(with(level), (String::new(), String::new()));
}

#[test]
fn a_reversed_lane_is_travelled_against_its_side() {
    let ends = |text: &str| {
        let centres = parsed(text).lane_centres(0.01);
        let (_, centre) = centres.into_iter().find(|(lane, _)| (lane.road.as_str(), lane.lane) == ("1", -1)).unwrap();
        (centre[0], centre[centre.len() - 1])
    };
    let (near, far) = (DVec2::new(38.0, -2.0), DVec2::new(108.0, -2.0));
    let apart =
        |(from, to): (DVec2, DVec2), expected: (DVec2, DVec2)| from.distance(expected.0) + to.distance(expected.1);
    assert!(apart(ends(&plain()), (near, far)) < 1e-6);
    let reversed = in_road_1(&plain(), "<lane id=\"-1\" type", "<lane id=\"-1\" direction=\"reversed\" type");
    assert!(apart(ends(&reversed), (far, near)) < 1e-6);
}

#[test]
fn a_map_is_read_in_other_encodings_and_with_a_document_type() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ring.xodr");
    let read = |bytes: &[u8]| {
        fs::write(&file, bytes).unwrap();
        Map::read(&file, Hand::Map).map(|map| map.rings().len()).map_err(|error| error.to_string())
    };
    let named = in_road_1(&plain(), "<road name=\"\"", "<road name=\"Straße\"");
    let latin: Vec<u8> = named.replace("UTF-8", "ISO-8859-1").chars().map(|c| u8::try_from(c).unwrap()).collect();
    assert_eq!(read(&latin), Ok(1));
    let wide = format!("\u{feff}{}", named.replace("UTF-8", "UTF-16"));
    assert_eq!(read(&wide.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>()), Ok(1));
    assert_eq!(read(named.replace("<OpenDRIVE>", "<!DOCTYPE OpenDRIVE><OpenDRIVE>").as_bytes()), Ok(1));
    let entities = named.replace("<OpenDRIVE>", "<!DOCTYPE a [<!ENTITY b \"c\">]><OpenDRIVE>");
    assert!(read(entities.as_bytes()).unwrap_err().contains("declares entities"));
    assert!(read(&[0x1f, 0x8b, 8, 0]).unwrap_err().contains("unpack it with gunzip first"));
}

#[test]
fn lane_types_that_are_not_known_are_named_once_with_their_number_of_lanes() {
    let arms =
        |line: &str| if line.contains("length=\"70\"") { line.replace("driving", "shared") } else { line.to_owned() };
    let map = parsed(&plain().lines().map(arms).collect::<Vec<_>>().join("\n"));
    let warnings: Vec<&str> = map.warnings().collect();
    assert_eq!(warnings, ["lane types that are not known: \"shared\" (8 lanes); nothing is driven on there"]);
    let message = map.ground(&map.rings()[0], &Options::default()).unwrap_err().to_string();
    assert!(
        message.contains("arms: 0 on a circle")
            && message.ends_with("it has lane types that are not known: \"shared\" (8 lanes)"),
        "{message}"
    );
}

#[test]
fn a_link_that_turns_is_not_said_to_jump() {
    let text = plain();
    let line = text.lines().find(|line| line.contains(" id=\"300\" ")).unwrap();
    let value = |name: &str| -> f64 {
        let (_, after) = line.split_once(&format!(" {name}=\"")).unwrap();
        after.split_once('"').unwrap().0.parse().unwrap()
    };
    // Turned about the beginning of its lane, 2.5 m right of the reference line.
    let (heading, turned) = (value("hdg"), value("hdg") + 1.0);
    let right = |heading: f64| 2.5 * -DVec2::from_angle(heading).perp();
    let begin = DVec2::new(value("x"), value("y")) + right(heading) - right(turned);
    let set = |line: String, name: &str, value: f64| {
        let (before, after) = line.split_once(&format!(" {name}=\"")).unwrap();
        format!("{before} {name}=\"{value}\"{}", after.split_once('"').unwrap().1)
    };
    let changed = set(set(set(line.to_owned(), "hdg", turned), "x", begin.x), "y", begin.y);
    let turned = text.replace(line, &changed);
    let map = parsed(&turned);
    let warning =
        map.warnings().find(|warning| warning.starts_with("road 103 lane -1: its link to road 300 lane -1 ")).unwrap();
    assert!(warning.contains(" turns by ") && !warning.contains("jumps"), "{warning}");
    // A left-hand map's lanes have the numbers that they have in the map.
    let left = Map::parse(Path::new("ring.xodr"), &turned, Hand::Left).unwrap();
    assert!(!left.warnings().any(|warning| warning.contains("road 300 lane 1:")));
}

#[test]
fn pieces_of_a_road_that_lie_apart_are_refused_with_road_and_geometry() {
    let second = |x: &str| {
        let pieces = format!(
            "length=\"35\"><line/></geometry><geometry s=\"35\" x=\"{x}\" y=\"0\" hdg=\"0\" length=\"35\"><line/>\
             </geometry></planView>"
        );
        in_road_1(&plain(), "length=\"70\"><line/></geometry></planView>", &pieces)
    };
    assert_drivable(&parsed(&second("73")));
    assert!(
        parsed(&second("90"))
            .warnings()
            .any(|warning| warning == "road 1: its reference line jumps by 17.000 m at s 35.00 m")
    );
    let message = refusal(&second("1e7"));
    assert!(
        message.contains("road 1, geometry s 35: x and y: 9999927.0 m away; must begin where the piece before it ends"),
        "{message}"
    );
    // One piece that is longer than it says, and a whole road elsewhere.
    let cubic = "<paramPoly3 aU=\"0\" bU=\"1e7\" cU=\"0\" dU=\"0\" aV=\"0\" bV=\"0\" cV=\"0\" dV=\"0\"/>";
    let message = refusal(&in_road_1(&plain(), "<line/>", cubic));
    assert!(
        message.contains("road 1, geometry s 0: curve: ") && message.contains("leads too far for a length of 70.000 m"),
        "{message}"
    );
    let message = refusal(&in_road_1(&plain(), "x=\"38\"", "x=\"1e7\""));
    assert!(
        message.contains("road 1, geometry s 0: x and y: 10000 km from the middle of the map; must be at most 500 km"),
        "{message}"
    );
}

#[test]
fn names_of_a_map_are_shown_without_what_a_terminal_would_obey() {
    let id = format!("1&#x9b;2J&#x202e;&#10;{}", "x".repeat(5000));
    let text = plain().replace(" id=\"1\" junction", &format!(" id=\"{id}\" junction"));
    let harmless = |message: &str| {
        assert!(!message.chars().any(|c| c.is_control() || c == '\u{202e}') && message.len() < 1000, "{message:?}");
    };
    let map = parsed(&text.replace(
        "elementId=\"900\"/></link><planView><geometry s=\"0\" x=\"38\"",
        "elementId=\"9&#x9b;\"/></link><planView><geometry s=\"0\" x=\"38\"",
    ));
    assert!(map.warnings().next().is_some());
    map.warnings().for_each(harmless);
    harmless(&refusal(&text.replace("hdg=\"0\"", "hdg=\"&#x9b;31m\"")));
    harmless(&refusal("<a>\u{9b}2J</b>"));
    harmless(&refusal("<a\u{9b}/>"));
}

/// A shoulder among lanes is paved but no lane: the lanes' edges go round it, where the kerb faces do not.
#[test]
fn an_outline_with_a_shoulder_among_its_lanes_is_read_again() {
    let lane = "<lane id=\"-1\" type=\"driving\" level=\"false\"><link></link><width sOffset=\"0\" a=\"4\" b=\"0\" \
                c=\"0\" d=\"0\"/></lane>";
    let widths = "<width sOffset=\"0\" a=\"0\" b=\"0\" c=\"0\" d=\"0\"/><width sOffset=\"20\" a=\"1\" b=\"0\" c=\"0\" \
                  d=\"0\"/>\
        <width sOffset=\"40\" a=\"0\" b=\"0\" c=\"0\" d=\"0\"/>";
    let beside = "<width sOffset=\"0\" a=\"2.5\" b=\"0\" c=\"0\" d=\"0\"/>";
    let more = format!(
        "{lane}<lane id=\"-2\" type=\"shoulder\">{widths}</lane><lane id=\"-3\" type=\"driving\">{beside}</lane>"
    );
    let map = parsed(&in_road_1(&plain(), lane, &more));
    let ground = imported(&map).ground;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ring.outline.toml");
    fs::write(&file, ground.checked_text(&file, &[]).unwrap()).unwrap();
    assert_eq!(Road::read(&file).unwrap().ground().lines.len(), 16);
    // What its reader refuses is not written.
    let mut narrow = ground;
    narrow.lines[3].widths[0] = 0.5;
    let message = narrow.checked_text(&file, &[]).unwrap_err().to_string();
    assert!(message.contains("route[3].widths: 0.5 m; must lie in 1..20 m"), "{message}");
}
