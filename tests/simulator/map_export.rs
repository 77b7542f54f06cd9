//! Roads written as OpenDRIVE maps, and read back by this reader and by another.

use std::f64::consts::TAU;
use std::path::Path;

use glam::DVec2;
use offtrack::geometry::{Curve, Piece};
use offtrack::map::ground::{Edges, Ground, Kerb, Line};
use offtrack::map::opendrive::{Hand, Map, Options, exported};
use offtrack::map::{Road, procedural};

/// What kerbs and lanes may lose on the way out and back (m): they are sampled within 1 mm and fitted within 4 mm.
const LOST: f64 = 0.01;
/// The same beside corners of kerbs whose radius is below [`SHARP`], through which fewer points lead (m).
const LOST_AT_CORNERS: f64 = 0.04;
/// Radius of a corner that is sharp, and how far around it kerbs are fitted across it (m).
const SHARP: f64 = 1.2;
const AROUND: f64 = 1.5;
/// Arms end, or the world does, beyond this distance from the kerb of the island (m).
const REACH: f64 = 75.0;

/// The road at another place of a map, with traffic on one hand.
fn placed(name: &str, mirrored: bool) -> Road {
    let road = procedural::find(name).unwrap();
    let origin = DVec2::new(1234.5, -987.25);
    Road::on(road.name.clone(), Ground { origin, mirrored, ..road.ground().clone() })
}

/// The road that is read from the map that it is written as.
fn read_back(road: &Road) -> (Map, Ground) {
    let text = exported(road).unwrap();
    let map = Map::parse(Path::new("back.xodr"), &text, Hand::Map).unwrap();
    assert_eq!(map.warnings().collect::<Vec<_>>(), Vec::<&str>::new(), "{}", road.name);
    assert_eq!(map.rings().len(), 1, "{}: {:?}", road.name, map.rings());
    let ring = map.nearest(road.ground().origin).unwrap();
    let found = map.ground(&ring, &Options::default()).unwrap().ground;
    // The arms' names are those of the arms in the same direction.
    let apart = |one: f64, other: f64| (one - other + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
    let own = &road.ground().arms;
    let name = |bearing: f64| {
        let nearest = own
            .iter()
            .min_by(|one, other| apart(one.bearing, bearing).abs().total_cmp(&apart(other.bearing, bearing).abs()));
        nearest.unwrap().name.clone()
    };
    let mut arms: Vec<String> = found.arms.iter().map(|arm| name(arm.bearing)).collect();
    // Names go around the map; the first arm lies in the east of either.
    if map.is_mirrored() {
        arms[1..].reverse();
    }
    (
        Map::parse(Path::new("back.xodr"), &text, Hand::Map).unwrap(),
        map.ground(&ring, &Options { arms }).unwrap().ground,
    )
}

/// Points of a curve every 20 cm, as far as the world surely reaches.
fn points(curve: &Curve, reach: f64) -> impl Iterator<Item = DVec2> {
    let points: Vec<DVec2> = (0..(curve.length() / 0.2) as usize).map(|i| curve.point_at(i as f64 * 0.2)).collect();
    points.into_iter().filter(move |p| p.length() < reach)
}

fn key(ground: &Ground, line: &Line) -> (String, &'static str, u32, String) {
    let arm = |index: usize| ground.arms[index].name.clone();
    (arm(line.entry), line.lane.name(), line.exit, arm(line.exit_arm))
}

#[test]
fn a_road_that_is_written_as_a_map_is_read_back_with_its_routes_and_kerbs_within_a_centimetre() {
    let names = ["16m", "40m", "32m-maps", "50m-maps", "wide/7/3", "wide/7/10", "wide/7/26"];
    for (name, mirrored) in names.into_iter().map(|name| (name, false)).chain([("16m", true)]) {
        let road = placed(name, mirrored);
        let own = road.ground();
        let (map, found) = read_back(&road);
        assert_eq!((map.is_mirrored(), found.mirrored), (mirrored, mirrored), "{name}");
        assert!(found.origin.distance(own.origin) < 1e-3, "{name}: {}", found.origin);
        assert!((found.island_radius - own.island_radius).abs() < 1e-3, "{name}: {}", found.island_radius);
        let reach = own.island_radius + REACH;
        let mut keys = [key_list(own), key_list(&found)];
        keys.iter_mut().for_each(|keys| keys.sort());
        assert_eq!(keys[0], keys[1], "{name}");
        for line in &own.lines {
            let other = found.lines.iter().find(|other| key(&found, other) == key(own, line)).unwrap();
            for p in points(&line.line, reach) {
                assert!(other.line.distance(p) < LOST, "{name} {:?} at {p}", key(own, line));
            }
            for (one, other) in line.widths.iter().zip(other.widths) {
                assert!((one - other).abs() < LOST, "{name}: {:?} {:?}", line.widths, other);
            }
        }
        assert_eq!(found.faces.loops.len(), own.faces.loops.len(), "{name}");
        let sharp = |piece: &&Piece| matches!(piece, Piece::Arc { radius, .. } if *radius < SHARP);
        let corners: Vec<&Piece> = own.faces.loops.iter().flat_map(|curve| &curve.pieces).filter(sharp).collect();
        for (one, other) in [(own, &found), (&found, own)] {
            for p in one.faces.loops.iter().flat_map(|curve| points(curve, reach)) {
                let at_corner = corners.iter().any(|corner| corner.distance(p) < AROUND);
                let off = other.faces.distance(p);
                assert!(off < if at_corner { LOST_AT_CORNERS } else { LOST }, "{name}: {off} at {p}");
            }
        }
    }
}

#[test]
fn wide_gutters_of_a_road_that_is_written_as_a_map_are_read_back() {
    let arm = |index: u32| {
        format!(
            "[[arm]]\nname = \"A{index}\"\nbearing_deg = {}\nlength = 90.0\n\
             entry.kerb = {{ points = [{{ along = 30.0, offset = 6.0 }}], ring_radius = 12.0 }}\n\
             exit.kerb = {{ points = [{{ along = 30.0, offset = -6.0 }}], ring_radius = 12.0 }}\n",
            90 * index
        )
    };
    let ring = "[ring]\nisland_radius = 14.0\nlanes = 1\nlane_width = 4.0\ngutter = 2.0\n";
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wide.toml");
    std::fs::write(&file, ring.to_owned() + &(0..4).map(arm).collect::<String>()).unwrap();
    let road = Road::read(&file).unwrap();
    let (_, found) = read_back(&road);
    let Edges::Own(edges) = &found.edges else { panic!("a map has edges of its own") };
    let all: Vec<DVec2> = edges.loops.iter().flat_map(|curve| points(curve, 87.0)).collect();
    assert!(2000 < all.len());
    for p in all {
        // Lanes win over gutters, and those that lead into the ring reach a little over the island's.
        let off = (road.ground().faces.distance(p) - 2.0).abs();
        assert!(off < 0.3, "{off} at {p}");
    }
}

fn key_list(ground: &Ground) -> Vec<(String, &'static str, u32, String)> {
    ground.lines.iter().map(|line| key(ground, line)).collect()
}

#[test]
fn another_reader_finds_every_lane_of_a_road_that_is_written_as_a_map() {
    let road = placed("16m", false);
    let (map, _) = read_back(&road);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("road.xodr");
    std::fs::write(&file, exported(&road).unwrap()).unwrap();
    let network = xodr::load_file(&file).unwrap();
    let theirs: Vec<Vec<DVec2>> = network
        .lanes()
        .iter()
        .filter(|lane| lane.kind.is_drivable())
        .map(|lane| lane.center.points().iter().map(|p| DVec2::new(f64::from(p.x), f64::from(p.y))).collect())
        .collect();
    let ours = map.lane_centres(0.002);
    assert!(20 + 10 < ours.len(), "{}", ours.len());
    let distance = |p: DVec2, line: &[DVec2]| {
        let pieces = line.windows(2).map(|pair| Piece::Segment { from: pair[0], to: pair[1] });
        pieces.map(|piece| piece.distance(p)).fold(f64::INFINITY, f64::min)
    };
    // What lies between carriageways has widths with corners, which the other reader samples elsewhere.
    for (lane, centre) in ours.into_iter().filter(|(lane, _)| lane.lane < 0) {
        let nearest = theirs
            .iter()
            .map(|other| centre.iter().map(|&p| distance(p, other)).fold(0.0, f64::max))
            .fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.02, "{lane}: {nearest}");
    }
}

#[test]
fn a_road_whose_arms_end_at_its_ring_is_refused_with_the_length_that_would_do() {
    let road = placed("16m", false);
    let short = Road::on("short".into(), Ground { outer_radius: 84.0, ..road.ground().clone() });
    let said = exported(&short).unwrap_err().to_string();
    assert!(said.contains("short: arm ") && said.contains("prolong the arm"), "{said}");
}

#[test]
fn what_is_paved_between_lanes_is_in_the_map_however_long_the_arms_are() {
    for (name, lengths) in [("50m", [85.0, 130.0]), ("32m", [115.0, 300.0]), ("40m-maps", [110.0, 130.0])] {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenarios/roundabouts/{name}.toml"));
        let keys = std::fs::read_to_string(file).unwrap();
        for length in lengths {
            let line = |line: &str| match line.starts_with("length = ") {
                true => format!("length = {length:?}\n"),
                false => format!("{line}\n"),
            };
            let folder = tempfile::tempdir().unwrap();
            let file = folder.path().join("long.toml");
            std::fs::write(&file, keys.lines().map(line).collect::<String>()).unwrap();
            let text = exported(&Road::read(&file).unwrap()).unwrap_or_else(|error| panic!("{name}: {error}"));
            // No width falls to nothing between two that are wide, as where a line meets itself.
            let widths = |road: &str| -> Vec<f64> {
                let width = |rest: &str| rest.split_once(" a=\"")?.1.split('"').next()?.parse().ok();
                road.split("<width ").skip(1).filter_map(width).collect()
            };
            for road in text.split("<road ").filter(|road| road.contains(" middle\"")) {
                let widths = widths(road);
                assert!(
                    2 < widths.len()
                        && !widths.windows(3).any(|three| 0.05 < three[0] && three[1] < 1e-6 && 0.05 < three[2]),
                    "{name}: {widths:?}"
                );
            }
        }
    }
}

#[test]
fn an_import_that_paves_more_than_its_routes_is_refused_by_the_kerbs_that_would_be_lost() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/maps/zala8.outline.toml");
    let said = exported(&Road::read(&file).unwrap()).unwrap_err().to_string();
    assert!(said.contains("zala8: kerbs: ") && said.contains("keep the map that the road is from"), "{said}");
}

#[test]
fn names_with_markup_are_escaped_in_a_map() {
    let road = placed("20m", false);
    let named = Road::on("a<b>&\"c\"".into(), road.ground().clone());
    let text = exported(&named).unwrap();
    assert!(text.contains("name=\"a&lt;b&gt;&amp;&quot;c&quot;\"") && !text.contains("a<b>"));
    assert_eq!(Map::parse(Path::new("named.xodr"), &text, Hand::Map).unwrap().rings().len(), 1);
}

#[test]
fn an_apron_is_a_border_of_the_map_that_trucks_have_access_to_and_is_read_back_within_a_centimetre() {
    for mirrored in [false, true] {
        let mut road = placed("16m", mirrored);
        let radius = road.island_radius() - 2.0;
        road = Road::on(
            road.name.clone(),
            Ground { aprons: vec![Curve::circle(DVec2::ZERO, radius)], ..road.ground().clone() },
        );
        let (map, found) = read_back(&road);
        assert_eq!((found.aprons.len(), found.faces.loops.len()), (1, road.ground().faces.loops.len()));
        for p in found.aprons[0].polyline(0.01) {
            assert!((p.length() - radius).abs() < LOST, "{p}");
        }
        assert!((found.island_radius - road.island_radius()).abs() < 1e-3 && map.is_mirrored() == mirrored);
        let text = exported(&road).unwrap();
        let access = "<access sOffset=\"0\" rule=\"allow\" restriction=\"truck\"/>";
        assert_eq!(text.matches(access).count(), 2);
        let ground = |text: &str| {
            let map = Map::parse(Path::new("back.xodr"), text, Hand::Map).unwrap();
            let ring = map.nearest(road.ground().origin).unwrap();
            map.ground(&ring, &Options::default()).unwrap()
        };
        // As OpenDRIVE 1.8 has it; without access the border is solid, and half an apron is none.
        let nested = "<access sOffset=\"0\" rule=\"allow\"><restriction type=\"truck\"/></access>";
        assert_eq!(ground(&text.replace(access, nested)).ground.aprons.len(), 1);
        assert_eq!(ground(&text.replace(access, "")).ground.aprons, []);
        let half = ground(&text.replacen(access, "", 1));
        assert!(half.ground.aprons.is_empty() && half.warnings.iter().any(|warning| warning.contains("apron")));
        // One that covers the whole island, as in the middle of a mini-roundabout: half a metre stays solid.
        let covers = ground(&text.replace("a=\"2.000000000\"", &format!("a=\"{:.9}\"", road.island_radius() - 1e-3)));
        assert_eq!(covers.ground.aprons, [Curve::circle(DVec2::ZERO, 0.5)], "{:?}", covers.warnings);
        // A seam in its middle is not an island; what stands there is.
        for (rest, core) in [(0.03, 0.5), (0.3, 0.5), (0.7, 0.7)] {
            let width = format!("a=\"{:.9}\"", road.island_radius() - rest);
            let found = ground(&text.replace("a=\"2.000000000\"", &width));
            let [apron] = &found.ground.aprons[..] else { panic!("{rest}: {:?}", found.warnings) };
            assert!(apron.polyline(0.01).iter().all(|p| (p.length() - core).abs() < LOST), "{rest}");
        }
        let corners: String = (0..24)
            .map(|corner| 3.0 * DVec2::from_angle(TAU * f64::from(corner) / 24.0))
            .map(|p| format!("<cornerLocal u=\"{}\" v=\"{}\" z=\"0\"/>", p.x, p.y))
            .collect();
        let width = format!("a=\"{:.9}\"", road.island_radius() - 1e-3);
        let with = text.replace("a=\"2.000000000\"", &width);
        let (before, after) = with.split_at(with.find(&width).unwrap());
        // At the centre, on the side of the island's edge on which the apron is.
        let lane = &before[before.rfind("<lane id=\"").unwrap()..];
        let t = if lane.starts_with("<lane id=\"-") { -road.island_radius() } else { road.island_radius() };
        let with_monument = |t: f64| {
            let monument = format!(
                "</lanes><objects><object id=\"1\" type=\"trafficIsland\" s=\"0\" t=\"{t}\" hdg=\"0\"><outlines>\
                 <outline>{corners}</outline></outlines></object></objects>",
            );
            ground(&format!("{before}{}", after.replacen("</lanes>", &monument, 1)))
        };
        let beside = with_monument(t / 2.0);
        assert!(beside.ground.aprons.is_empty() && beside.warnings.iter().any(|warning| warning.contains("obstacles")));
        let found = with_monument(t);
        let [apron] = &found.ground.aprons[..] else { panic!("{:?}", found.warnings) };
        for p in apron.polyline(0.01) {
            assert!((p.length() - 3.0).abs() < 0.05, "{p}");
        }
    }
}

#[test]
fn an_apron_of_a_splitter_island_is_refused_since_a_map_would_lose_it() {
    let road = placed("16m", false);
    let own = road.ground();
    let splitter =
        own.faces.loops.iter().zip(&own.kerbs).find(|(_, kerb)| matches!(kerb, Kerb::Splitter(_))).unwrap().0;
    let (low, high) = offtrack::geometry::Outline::new(vec![splitter.clone()]).bounds();
    let apron = Curve::circle((low + high) / 2.0, 0.05);
    let with = Road::on("splitter".into(), Ground { aprons: vec![apron], ..own.clone() });
    let said = exported(&with).unwrap_err().to_string();
    assert!(said.contains("splitter: aprons: lost") && said.contains("central island would do"), "{said}");
}
