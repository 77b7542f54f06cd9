//! Roundabouts from OpenDRIVE maps: found, driven, written and read again; broken maps refused.

use std::f64::consts::PI;
use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec2;
use offtrack::files::reader::Error;
use offtrack::geometry::Outline;
use offtrack::map::chosen::Choice;
use offtrack::map::ground::Edges;
use offtrack::map::opendrive::{Hand, Map, Options};
use offtrack::map::{Gutter, Kerb, Road};
use offtrack::scenario::{Scenario, Split};
use offtrack::world::World;
use proptest::prelude::*;

fn map(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/maps").join(name)
}

fn ring() -> Road {
    Road::from_map(&map("sumo_ring22.xodr"), &Choice::default()).unwrap()
}

fn turn(from: f64, to: f64) -> f64 {
    ((to - from + PI).rem_euclid(2.0 * PI) - PI).abs()
}

#[test]
fn the_ring_of_a_map_is_found_with_its_radius_and_arms() {
    let read = Map::read(&map("sumo_ring22.xodr"), Hand::Map).unwrap();
    let [ring] = read.rings()[..] else { panic!("{:?}", read.rings()) };
    // The network was made with this centre and this radius; netconvert draws the circle as a 32-gon.
    assert!(ring.centre.distance(DVec2::new(140.0, 140.0)) < 0.05 && (ring.radius - 22.05).abs() < 0.3, "{ring:?}");
    let roundabout = self::ring();
    assert_eq!(roundabout.arms().collect::<Vec<_>>(), ["E", "N", "W", "S"].map(str::to_owned).to_vec());
    assert_eq!(roundabout.routes(40.0, 35.0, 2.0).unwrap().len(), 16);
    assert_eq!(roundabout.nearest_kerb(DVec2::new(20.0, 0.0)), Kerb::Island);
}

#[test]
fn routes_of_a_map_are_smooth_stay_on_the_road_and_lead_where_their_names_say() {
    let roundabout = ring();
    let faces = roundabout.kerbs(Gutter::Drivable);
    let arms: Vec<String> = roundabout.arms().map(str::to_owned).collect();
    for route in roundabout.routes(40.0, 35.0, 2.0).unwrap() {
        for pair in route.centre_line.pieces.windows(2) {
            let step = turn(pair[0].heading_at(pair[0].length()), pair[1].heading_at(0.0));
            assert!(
                pair[0].end().distance(pair[1].start()) < 1e-6 && step < 3f64.to_radians(),
                "{}: {step}",
                route.name
            );
        }
        for waypoint in &route.waypoints {
            assert!(1.0 < faces.signed_distance(waypoint.position), "{} at {}", route.name, waypoint.position);
        }
        // Where a route ends, its exit arm is the nearest by bearing.
        let bearing = |p: DVec2| ((p.to_angle() / (PI / 2.0)).round() as i64).rem_euclid(4);
        let (first, last) = (route.waypoints[0].position, route.waypoints[route.waypoints.len() - 1].position);
        let east_first = ["E", "N", "W", "S"];
        assert_eq!(east_first[bearing(first) as usize], arms[route.entry]);
        assert_eq!(east_first[bearing(last) as usize], arms[roundabout.exit_arm(&route)], "{}", route.name);
    }
}

#[test]
fn lanes_edges_lie_on_the_road_up_to_the_kerb_faces() {
    let roundabout = ring();
    let (faces, edges) = (roundabout.kerbs(Gutter::Drivable), roundabout.kerbs(Gutter::Solid));
    let points: Vec<DVec2> = edges.loops.iter().flat_map(|curve| curve.polyline(0.01)).collect();
    // Both are fitted within 5 mm.
    assert!(points.iter().all(|&p| -0.011 < faces.signed_distance(p)));
    assert!(200 < points.len());
}

#[test]
fn an_outline_file_gives_what_the_map_gave_and_is_written_as_it_was_read() {
    let roundabout = ring();
    let text = roundabout.ground().text(&["made for a test".to_owned()]);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ring.outline.toml");
    fs::write(&file, &text).unwrap();
    let read = Road::read(&file).unwrap();
    assert_eq!(read.name, "ring");
    let apart = |one: &Outline, other: &Outline| {
        one.loops.iter().flat_map(|curve| curve.polyline(0.01)).map(|p| other.distance(p)).fold(0.0, f64::max)
    };
    for gutter in [Gutter::Drivable, Gutter::Solid] {
        // Coordinates are rounded to 0.01 mm.
        assert!(apart(&read.kerbs(gutter), &roundabout.kerbs(gutter)) < 1e-4);
    }
    let (routes, before) = (read.routes(40.0, 35.0, 2.0).unwrap(), roundabout.routes(40.0, 35.0, 2.0).unwrap());
    for (one, other) in routes.iter().zip(&before) {
        assert_eq!(one.name.rsplit('/').next(), other.name.rsplit('/').next());
        assert!((one.centre_line.length() - other.centre_line.length()).abs() < 1e-3, "{}", one.name);
    }
    assert!(matches!(read.ground().edges, Edges::Own(_)));
    assert!(read.ground().frame().origin.distance(roundabout.ground().frame().origin) < 1e-5);
    assert!(100.0 < read.ground().origin.x);
    // Numbers are as short once rounded, so a second writing changes at most their last digit.
    let again = read.ground().text(&["made for a test".to_owned()]);
    assert_eq!(again.lines().count(), text.lines().count());
}

#[test]
fn a_faulty_outline_file_is_refused_with_its_key() {
    let text = ring().ground().text(&[]);
    let folder = tempfile::tempdir().unwrap();
    let refused = |from: &str, to: &str| {
        let file = folder.path().join("ring.outline.toml");
        assert!(text.contains(from), "{from}");
        fs::write(&file, text.replacen(from, to, 1)).unwrap();
        Road::read(&file).unwrap_err().to_string()
    };
    for (from, to, key) in [
        ("origin = [1", "origin = [1e9, 0] #", "origin[0]: "),
        ("island_radius = ", "island_radius = 1000", "island_radius: "),
        ("name = \"N\"", "name = \"N/W\"", "arm[1].name: \"N/W\""),
        ("of = \"outer\"", "of = \"island\"", "face[0].of: 0 outer loops"),
        ("to = \"N\"", "to = \"X\"", "route[0].to: \"X\"; must be one of E, N, W, S"),
        ("exit = 1", "exit = 9", "route[0].exit: 9"),
        ("crossing = [", "crossing = [1000", "route[0].crossing[0]"),
    ] {
        let message = refused(from, to);
        assert!(message.contains("ring.outline.toml: ") && message.contains(key), "{message}");
    }
}

#[test]
fn a_map_without_a_roundabout_says_so() {
    let message = Road::from_map(&map("maliput_Roundabout.xodr"), &Choice::default()).unwrap_err().to_string();
    assert!(
        message.contains("maliput_Roundabout.xodr: ring: ") && message.contains("no roundabout here: 1 roads"),
        "{message}"
    );
}

/// Roads, lanes and junctions mirrored in the x axis as text: a left-hand twin of a right-hand map.
#[test]
fn a_left_hand_map_gives_the_roundabout_of_its_mirror_image() {
    let text = fs::read_to_string(map("sumo_ring22.xodr")).unwrap();
    let document = left_hand(&text);
    let left = Map::parse(Path::new("left.xodr"), &document, Hand::Map).unwrap();
    assert!(left.is_mirrored());
    let ring = left.rings()[0];
    assert!(ring.centre.distance(DVec2::new(140.0, -140.0)) < 0.05, "{ring:?}");
    let (twin, right) = (left.ground(&ring, &Options::default()).unwrap().ground, self::ring());
    // Arms are named by where they lie in the map: north of the left-hand one is south of its mirror image.
    assert_eq!(twin.arms.iter().map(|arm| arm.name.as_str()).collect::<Vec<_>>(), ["E", "S", "W", "N"]);
    // Names that are given go around the map as everywhere, counter-clockwise from east.
    let arms = ["first", "second", "third", "fourth"].map(str::to_owned).to_vec();
    let given = left.ground(&ring, &Options { arms: arms.clone() }).unwrap().ground;
    assert_eq!(
        given.arms.iter().map(|arm| arm.name.as_str()).collect::<Vec<_>>(),
        ["first", "fourth", "third", "second"]
    );
    let few = left.ground(&ring, &Options { arms: arms[..2].to_vec() }).unwrap_err();
    assert!(few.to_string().contains("the ring has 4 arms, at 3, 93, 183, 273 deg"), "{few}");
    assert_eq!(twin.lines.len(), right.ground().lines.len());
    for (one, other) in twin.lines.iter().zip(&right.ground().lines) {
        assert!(one.line.point_at(30.0).distance(other.line.point_at(30.0)) < 0.01);
        // And on the map each lies where the other's mirror image does.
        let [left, right] = [(&twin, one), (right.ground(), other)]
            .map(|(ground, line)| ground.frame().to_map(line.line.point_at(30.0)));
        assert!(left.distance(DVec2::new(right.x, -right.y)) < 0.01 && 50.0 < right.y, "{left}, {right}");
    }
}

/// The text of a map of lines and parametric cubics mirrored in the x axis, with left-hand traffic.
fn left_hand(text: &str) -> String {
    let mut mirrored = String::new();
    for line in text.lines() {
        let mut line = line.to_owned();
        if line.trim_start().starts_with("<road ") {
            line = line.replacen("<road ", "<road rule=\"LHT\" ", 1);
        }
        let negate = |line: &str, key: &str| match line.split_once(&format!(" {key}=\"")) {
            Some((before, after)) => match after.strip_prefix('-') {
                Some(after) => format!("{before} {key}=\"{after}"),
                None => format!("{before} {key}=\"-{after}"),
            },
            None => line.to_owned(),
        };
        let keys: &[&str] = match line.trim_start().split([' ', '/', '>']).next().unwrap() {
            "<geometry" => &["y", "hdg"],
            "<paramPoly3" => &["aV", "bV", "cV", "dV"],
            "<laneOffset" => &["a", "b", "c", "d"],
            "<lane" | "<predecessor" | "<successor" => &["id"],
            "<laneLink" => &["from", "to"],
            _ => &[],
        };
        for key in keys {
            line = negate(&line, key);
        }
        line = line.replace(" id=\"-0\"", " id=\"0\"");
        line = match line.trim() {
            "<right>" => "<left>".into(),
            "</right>" => "</left>".into(),
            "<left>" => "<right>".into(),
            "</left>" => "</right>".into(),
            _ => line,
        };
        mirrored += &line;
        mirrored.push('\n');
    }
    mirrored
}

#[test]
fn a_benchmark_drives_a_ring_of_a_map() {
    let folder = tempfile::tempdir().unwrap();
    let written = |keys: &str| {
        let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/attard2023.toml")).unwrap();
        let head = text.split("[[roundabout]]").next().unwrap().to_owned();
        let file = folder.path().join("map.toml");
        let vehicles = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/vehicles");
        let head = head.replace("\"vehicles/", &format!("\"{}/", vehicles.display()));
        fs::write(&file, format!("{head}[[roundabout]]\nfile = {:?}\ntest = \"all\"\n{keys}", map("sumo_ring22.xodr")))
            .unwrap();
        Scenario::read(&file)
    };
    let scenario = written("ring = [140, 140]\nname = \"sumo\"\narms = [\"A\", \"B\", \"C\", \"D\"]").unwrap();
    assert_eq!(scenario.split_names(Split::Test)[0], "sumo/A-right-1");
    let world = World::bake(&scenario).unwrap();
    assert_eq!(world.routes.len(), 16);
    let middle = world.route_waypoints(0)[10].position;
    assert!(1.0 < world.fields[0].distance(middle) && world.fields[0].distance(glam::Vec2::ZERO) < -5.0);
    let message = written("arms = [\"A\"]").unwrap_err().to_string();
    assert!(message.contains("the ring has 4 arms"), "{message}");
}

#[test]
fn values_out_of_range_are_refused_with_road_and_line() {
    let text = fs::read_to_string(map("maliput_Roundabout.xodr")).unwrap();
    let refused = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        Map::parse(Path::new("m.xodr"), &text.replacen(from, to, 1), Hand::Map).unwrap_err().to_string()
    };
    let message = refused("hdg=\"", "hdg=\"x");
    assert!(
        message.starts_with("m.xodr: line ") && message.contains("road ") && message.contains("hdg: \"x"),
        "{message}"
    );
    let message = Map::parse(Path::new("m.xodr"), "<a/>", Hand::Map).unwrap_err().to_string();
    assert!(message.contains("the first element is <a>, not <OpenDRIVE>"), "{message}");
    let deep = format!("<OpenDRIVE>{}{}</OpenDRIVE>", "<a>".repeat(200), "</a>".repeat(200));
    let message = Map::parse(Path::new("m.xodr"), &deep, Hand::Map).unwrap_err().to_string();
    assert!(message.contains("more than 64 deep"), "{message}");
}

/// What a map with faults gives: every attempt ends in a result or an error that names the file.
fn attempt(text: &str) -> Result<(), TestCaseError> {
    match Map::parse(Path::new("broken.xodr"), text, Hand::Map) {
        Ok(map) => {
            if let Some(ring) = map.rings().first() {
                let _ = map.ground(ring, &Options::default());
            }
        }
        Err(error @ (Error::Malformed { .. } | Error::Invalid { .. })) => {
            prop_assert!(error.to_string().starts_with("broken.xodr: "))
        }
        Err(error) => return Err(TestCaseError::fail(error.to_string())),
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn changed_bytes_of_a_map_give_a_result_or_an_error(
        at in any::<prop::sample::Index>(),
        byte in 32u8..127,
        dropped in 0usize..30,
    ) {
        let mut bytes = fs::read(map("maliput_Roundabout.xodr")).unwrap();
        let at = at.index(bytes.len());
        bytes[at] = byte;
        bytes.drain(at..(at + dropped).min(bytes.len()));
        attempt(&String::from_utf8_lossy(&bytes))?;
    }

    #[test]
    fn changed_values_of_a_map_give_a_result_or_an_error(
        at in any::<prop::sample::Index>(),
        value in prop::sample::select(vec!["0", "-1", "1e308", "nan", "inf", "1e-300", "99999", "", "x", "1000"]),
    ) {
        let text = fs::read_to_string(map("maliput_Roundabout.xodr")).unwrap();
        let body = text.find("<OpenDRIVE").unwrap();
        let quotes: Vec<usize> = text[body..].match_indices('"').map(|(quote, _)| body + quote).collect();
        let pair = at.index(quotes.len() / 2);
        attempt(&format!("{}{value}{}", &text[..quotes[2 * pair] + 1], &text[quotes[2 * pair + 1]..]))?;
    }
}
