//! `offtrack draw`: its files agree with the library's roundabout.

use std::path::{Path, PathBuf};
use std::process::Output;

use glam::DVec2;
use offtrack::geometry::Outline;
use offtrack::map::{Gutter, Road};
use serde_json::Value;

use crate::place::program;

type Polygon = Vec<DVec2>;

#[test]
fn the_polygons_follow_the_kerbs_within_a_centimetre_both_ways() {
    for (word, gutter) in [("drivable", Gutter::Drivable), ("solid", Gutter::Solid)] {
        let written = written(&["--gutter", word]);
        let kerbs = roundabout().kerbs(gutter);
        let drivable = polygons(&written["drivable"]);
        assert!(furthest(&drivable, &kerbs) < 0.01);
        let beside =
            |p: DVec2| drivable.iter().flat_map(sides).map(|(a, b)| to_segment(p, a, b)).fold(f64::INFINITY, f64::min);
        let along = kerbs
            .loops
            .iter()
            .flat_map(|curve| (0..1000).map(move |n| curve.point_at(curve.length() * f64::from(n) / 1000.0)));
        assert!(along.map(beside).fold(0.0, f64::max) < 0.01);
        // The comparison can fail: without every other corner the polygons leave the kerbs.
        let coarse: Vec<Polygon> =
            drivable.iter().map(|polygon| polygon.iter().step_by(2).copied().collect()).collect();
        assert!(0.01 < furthest(&coarse, &kerbs));
    }
}

#[test]
fn a_point_is_in_a_solid_exactly_where_it_is_not_in_the_drivable_polygons() {
    let written = written(&[]);
    let (solids, drivable) = (polygons(&written["solids"]), polygons(&written["drivable"]));
    let kerbs = roundabout().kerbs(Gutter::Drivable);
    let mut seen = [0, 0];
    for (x, y) in (-43..43).flat_map(|x| (-43..43).map(move |y| (2.0 * f64::from(x) + 0.37, 2.0 * f64::from(y) + 0.61)))
    {
        let p = DVec2::new(x, y);
        // Chords and kerbs differ by up to a centimetre.
        if kerbs.distance(p) < 0.01 {
            continue;
        }
        let odd = drivable.iter().filter(|polygon| contains(polygon, p)).count() % 2 == 1;
        let solid = solids.iter().filter(|polygon| contains(polygon, p)).count();
        assert_eq!((odd, solid), (kerbs.contains(p), usize::from(!kerbs.contains(p))), "{p}");
        seen[usize::from(odd)] += 1;
    }
    assert!(seen.iter().all(|&n| 500 < n), "{seen:?}");
}

#[test]
fn no_polygon_repeats_its_first_point_and_one_polygon_stands_for_each_island() {
    let written = written(&[]);
    let (solids, drivable) = (polygons(&written["solids"]), polygons(&written["drivable"]));
    assert!(solids.iter().chain(&drivable).all(|polygon| 2 < polygon.len() && polygon.first() != polygon.last()));
    let loops = roundabout().kerbs(Gutter::Drivable).loops.len();
    assert_eq!((drivable.len(), solids.len()), (loops, loops - 1 + 2), "the islands, and the ground north and south");
}

#[test]
fn the_waypoints_are_the_librarys() {
    let written = written(&["--approach", "30", "--departure", "20"]);
    let routes = roundabout().routes(30.0, 20.0, 2.0).expect("the arms are long enough");
    let listed = written["routes"].as_array().expect("a list");
    assert_eq!(listed.len(), routes.len());
    for (listed, route) in listed.iter().zip(&routes) {
        assert_eq!(listed["name"], route.name.as_str());
        let waypoints = listed["waypoints"].as_array().expect("a list");
        assert_eq!(waypoints.len(), route.waypoints.len());
        for (listed, waypoint) in waypoints.iter().zip(&route.waypoints) {
            let [x, y, heading] = [0, 1, 2].map(|n| listed[n].as_f64().expect("a number"));
            // Positions are written to a tenth of a millimetre, headings to a millionth of a radian.
            assert!(DVec2::new(x, y).distance(waypoint.position) < 1e-4 && (heading - waypoint.heading).abs() < 1e-6);
        }
    }
}

/// The area of a polygon, positive counter-clockwise.
fn area(ring: &Value) -> f64 {
    let points: Vec<[f64; 2]> = serde_json::from_value(ring.clone()).expect("points");
    let n = points.len();
    let cross = |i: usize| points[i][0] * points[(i + 1) % n][1] - points[i][1] * points[(i + 1) % n][0];
    (0..n).map(cross).sum::<f64>() / 2.0
}

#[test]
fn a_route_is_found_with_and_without_its_roundabouts_name_and_stands_alone_in_the_json() {
    for name in ["N-left-3", "16m/N-left-3"] {
        let written = written(&["--route", name]);
        assert_eq!(written["routes"].as_array().map(Vec::len), Some(1));
        assert_eq!(written["routes"][0]["name"], "16m/N-left-3");
        assert_eq!(written["frame"], serde_json::json!({"origin": [0.0, 0.0], "hand": "right"}));
        for unit in ["tractor", "trailer"] {
            let rings = written["sweep"][format!("{unit}_area")].as_array().expect("rings");
            let area: f64 = rings.iter().map(area).sum();
            assert!((200.0..900.0).contains(&area), "{unit}: {area}");
        }
    }
}

#[test]
fn every_extension_gets_a_file_of_its_kind() {
    let folder = tempfile::tempdir().expect("a folder");
    let png = folder.path().join("a.png");
    succeed(&[&place("20m"), "-o", text(&png), "--size", "400"]);
    let bytes = std::fs::read(&png).expect("written");
    assert_eq!(bytes[..8], *b"\x89PNG\r\n\x1a\n");
    assert_eq!(bytes[16..20], 400u32.to_be_bytes(), "the width stands first in a PNG's header");
    let svg = folder.path().join("a.svg");
    succeed(&[&place("20m"), "-o", text(&svg)]);
    let written = std::fs::read_to_string(&svg).expect("written");
    assert!(written.starts_with("<svg ") && written.contains("Roundabout 20m: 4 arms, 20 routes"));
    assert!(!written.contains("<text"), "letters are outlines, so that a picture needs no font");
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 2, "nothing else is left behind");
}

#[test]
fn the_title_of_a_swept_path_says_whether_the_own_lane_suffices() {
    let folder = tempfile::tempdir().expect("a folder");
    let svg = folder.path().join("a.svg");
    // Around the 16 m island a trailer cuts in by more than the lane is wide; past it on the outer lane it does not.
    for (route, verdict) in [("N-left-4", "its own lane does not suffice"), ("W-right-2", "its own lane suffices")] {
        succeed(&[&place("16m"), "-o", text(&svg), "--route", route]);
        let written = std::fs::read_to_string(&svg).expect("written");
        assert!(written.contains(&format!("16m/{route}: {verdict}")), "{route}");
    }
}

/// What a command printed, and the sweep of its JSON.
fn swept(roundabout: &str, arguments: &[&str]) -> (String, Value) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.json");
    let output = draw(&[&[roundabout, "-o", text(&file)], arguments].concat());
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    let written: Value = serde_json::from_slice(&std::fs::read(file).expect("written")).expect("JSON");
    (String::from_utf8(output.stdout).expect("text"), written["sweep"].clone())
}

#[test]
fn a_turn_that_the_truck_cannot_steer_is_not_said_to_fit() {
    let (said, sweep) = swept(&place("16m"), &["--route", "N-left-3", "--vehicle", "us_wb62", "--speed-kmh", "1"]);
    assert!(said.starts_with("16m/N-left-3: the lock does not suffice for its own lane\n"), "{said}");
    // At a crawl on the inner lane of 10.2 m the angle nears asin(5.94 / 10.2) = 35.6 deg; the ring ends before.
    assert!(said.contains("Too much for the truck: steer angle 34.8") && said.contains(" of 28.4 deg"), "{said}");
    assert_eq!(
        (&sweep["own_lane_suffices"], &sweep["limits"][0]["limit"]),
        (&Value::from(false), &Value::from("lock"))
    );
    assert_eq!(sweep["limits"][0]["exceeded"], true);
    let [from, to] = [0, 1].map(|end| sweep["limits"][0]["stretches"][0][end].as_f64().expect("a station"));
    let at = |row: &&Value| row[0].as_f64().is_some_and(|station| from <= station && station <= to);
    let demands = sweep["demands"].as_array().expect("a list");
    let beyond: Vec<&Value> = demands.iter().filter(at).collect();
    assert!(10 < beyond.len() && beyond.iter().all(|row| 28.4 < row[1].as_f64().expect("an angle").abs()));
    // With its own lock the study's truck can, and the picture says neither.
    let (said, sweep) = swept(&place("16m"), &["--route", "W-right-2", "--speed-kmh", "5"]);
    assert!(
        said.starts_with("16m/W-right-2: its own lane suffices\n") && said.contains("Within the truck's limits: "),
        "{said}"
    );
    assert_eq!(sweep["own_lane_suffices"], true);
}

#[test]
fn a_stiff_truck_at_90_kmh_around_a_small_island_exceeds_every_limit_in_title_words_and_json() {
    let folder = tempfile::tempdir().expect("a folder");
    let vehicle = folder.path().join("stiff.toml");
    let repository: PathBuf = [env!("CARGO_MANIFEST_DIR"), ".."].iter().collect();
    let own =
        std::fs::read_to_string(repository.join("scenarios/vehicles/eu_4x2_13m6.toml")).expect("the repository's file");
    assert!(own.contains("steer_max_deg = 40.0"));
    std::fs::write(&vehicle, own.replace("steer_max_deg = 40.0", "steer_max_deg = 5.0")).expect("written");
    let arguments = ["--route", "W-right-2", "--speed-kmh", "90", "--vehicle", text(&vehicle)];
    let (said, sweep) = swept(&place("16m"), &arguments);
    assert!(
        said.contains("the lock does not suffice for its own lane") && !said.contains("within its limits"),
        "{said}"
    );
    let limits = sweep["limits"].as_array().expect("a list");
    assert_eq!(limits.len(), 4);
    assert!(
        limits.iter().all(|limit| limit["exceeded"] == true && limit["has"].as_f64() < limit["needs"].as_f64()),
        "{limits:?}"
    );
    let svg = folder.path().join("a.svg");
    succeed(&[&[place("16m").as_str(), "-o", text(&svg)], &arguments[..]].concat());
    let drawn = std::fs::read_to_string(svg).expect("written");
    for words in [
        "the lock does not suffice for its own lane",
        "beyond the lock",
        "beyond the steer rate",
        "grip",
        "wheels lift",
    ] {
        assert!(drawn.contains(words), "{words}");
    }
}

#[test]
fn a_speed_that_the_truck_cannot_drive_is_told_apart_from_a_lane_that_is_too_narrow() {
    let (said, sweep) = swept(&place("50m"), &["--route", "E-right-2", "--load", "laden_high", "--speed-kmh", "60"]);
    assert!(said.contains("50m/E-right-2: its own lane ") && said.contains("60 km/h"), "{said}");
    assert!(said.contains("load transfer ratio "), "{said}");
    assert_eq!(sweep["limits"][3]["exceeded"], true);
}

#[test]
fn wrong_input_is_refused_with_exit_code_2_and_says_what_would_do() {
    let folder = tempfile::tempdir().expect("a folder");
    let [svg, png, gif, bare] = ["a.svg", "a.png", "a.gif", "a"].map(|name| folder.path().join(name));
    let place = place("20m");
    let svg = text(&svg);
    refuse(&[&place, "-o", text(&gif)], 2, "must end in .svg, .png or .json");
    refuse(&[&place, "-o", text(&bare)], 2, "must end in .svg, .png or .json");
    refuse(&[&place, "-o", text(&png), "--size", "199"], 2, "--size: 199; must lie in 200..8000 pixels");
    refuse(&[&place, "-o", svg, "--size", "400"], 2, "--size: 400; is for .png");
    refuse(&[&place, "-o", svg, "--route", "N-left-9"], 2, "--route: N-left-9; the roundabout has E-left-2, E-left-3,");
    refuse(
        &[&place, "-o", svg, "--route", "N-left-3", "--load", "bricks"],
        2,
        "--load: bricks; the vehicle has empty,",
    );
    refuse(
        &[&place, "-o", svg, "--route", "N-left-3", "--vehicle", "bus"],
        2,
        "vehicle: bus; must be a path ending in .toml or one of cn_18m1, daf_xf, ",
    );
    refuse(&[&place, "-o", svg, "--load", "laden"], 2, "--route <ROUTE>");
    refuse(
        &[&place, "-o", svg, "--route", "N-left-3", "--speed-kmh", "0"],
        2,
        "--speed-kmh: 0 km/h; must lie in 1..90 km/h",
    );
    refuse(
        &[&place, "-o", svg, "--route", "N-left-3", "--speed-kmh", "1e308"],
        2,
        "--speed-kmh: 1e308 km/h; must lie in 1..90 km/h",
    );
    refuse(&[&place, "-o", svg, "--approach", "1e308"], 2, "--approach: 1e308 m; must lie in 5..500 m");
    refuse(&[&place, "-o", svg, "--approach", "400"], 2, "--approach: 400 m; approach of 400 m leaves arm");
    refuse(&["21m", "-o", svg], 2, "roundabout: 21m; must be a path ending in .toml or one of 16m, ");
    refuse(&["wide/7/99999999999", "-o", svg], 2, "DISTRIBUTION/SEED/INDEX, as wide/7/12");
    refuse(&["nowhere.toml", "-o", svg], 2, "nowhere.toml: cannot be read");
    assert_eq!(
        std::fs::read_dir(folder.path()).expect("a folder").count(),
        0,
        "a refused picture leaves nothing behind"
    );
}

#[test]
fn a_folder_that_cannot_be_written_to_is_a_failure_with_exit_code_1() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["a.svg", "a.png", "a.json"] {
        refuse(&[&place("20m"), "-o", text(&folder.path().join("missing").join(name))], 1, "cannot be written");
    }
}

/// The largest distance of a point on a polygon's side from the kerbs (m).
fn furthest(polygons: &[Polygon], kerbs: &Outline) -> f64 {
    let points = polygons.iter().flat_map(sides).flat_map(|(a, b)| (0..9).map(move |n| a.lerp(b, f64::from(n) / 8.0)));
    points.map(|p| kerbs.distance(p)).fold(0.0, f64::max)
}

fn sides(polygon: &Polygon) -> impl Iterator<Item = (DVec2, DVec2)> {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(&a, &b)| (a, b))
}

fn to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let fraction = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    p.distance(a.lerp(b, fraction))
}

fn contains(polygon: &Polygon, p: DVec2) -> bool {
    let crossed =
        |&(a, b): &(DVec2, DVec2)| (a.y <= p.y) != (b.y <= p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
    sides(polygon).filter(crossed).count() % 2 == 1
}

fn polygons(value: &Value) -> Vec<Polygon> {
    let point = |value: &Value| DVec2::new(value[0].as_f64().expect("x"), value[1].as_f64().expect("y"));
    let list = |value: &Value| value.as_array().expect("a list").iter().map(point).collect();
    value.as_array().expect("a list").iter().map(list).collect()
}

fn roundabout() -> Road {
    Road::read(Path::new(&place("16m"))).expect("the repository's file")
}

fn written(arguments: &[&str]) -> Value {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.json");
    succeed(&[&[place("16m").as_str(), "-o", text(&file)], arguments].concat());
    serde_json::from_slice(&std::fs::read(file).expect("written")).expect("JSON")
}

fn place(name: &str) -> String {
    let repository: PathBuf = [env!("CARGO_MANIFEST_DIR"), ".."].iter().collect();
    text(&repository.join("scenarios/roundabouts").join(name).with_extension("toml")).to_owned()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}

fn draw(arguments: &[&str]) -> Output {
    program().arg("draw").args(arguments).output().expect("the program runs")
}

fn succeed(arguments: &[&str]) {
    let output = draw(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn refuse(arguments: &[&str], code: i32, message: &str) {
    let output = draw(arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    assert!(said.contains(message), "{arguments:?}: {said}");
}
