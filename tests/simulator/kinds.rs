//! Roundabouts of every kind: one to three ring lanes, one or two lanes a carriageway, an island of 1.5 m.
#![expect(clippy::unwrap_used, reason = "a test that cannot read its file must fail")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec2;
use offtrack::field::Field;
use offtrack::geometry::{Curve, Piece, to_circle, wrapped};
use offtrack::layout::{Ended, N_RAYS};
use offtrack::map::route::{Lane, Route};
use offtrack::map::{Gutter, Road};
use offtrack::scenario::Scenario;
use offtrack::simulator::RouteChoice;
use offtrack::vehicle::swept::{own_lane_suffices, swept_path};
use offtrack::world::World;

use crate::field::near_kerbs;
use crate::{batch_on, benchmark, engines, sense};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const NAMES: [&str; 3] = ["compact", "mini", "three-lanes"];

fn file(name: &str) -> PathBuf {
    Path::new(ROOT).join("tests/data/roundabouts").join(name).with_extension("toml")
}

fn roundabout(name: &str) -> Road {
    Road::read(&file(name)).unwrap()
}

fn routes(name: &str) -> Vec<Route> {
    roundabout(name).routes(40.0, 35.0, 2.0).unwrap()
}

/// All routes of the three roundabouts as a benchmark on disk.
fn all_routes() -> Scenario {
    let text = std::fs::read_to_string(Path::new(ROOT).join("scenarios/attard2023.toml")).unwrap();
    let head = &text[..text.find("[[roundabout]]").unwrap()];
    let head = head.replace("vehicles/", &format!("{ROOT}/scenarios/vehicles/"));
    let places: String =
        NAMES.iter().map(|name| format!("[[roundabout]]\nfile = {:?}\ntrain = \"all\"\n", file(name))).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("kinds.toml");
    std::fs::write(&path, head + &places).unwrap();
    Scenario::read(&path).unwrap()
}

#[test]
fn every_lane_of_an_entry_has_its_routes() {
    let names = |name: &str| -> Vec<String> {
        routes(name).iter().map(|route| route.name.split_once('/').unwrap().1.to_owned()).collect()
    };
    let [compact, mini, three_lanes] = NAMES.map(names);
    assert_eq!(
        compact,
        [
            "E-right-1",
            "E-right-2",
            "E-right-3",
            "NW-right-1",
            "NW-right-2",
            "NW-right-3",
            "S-right-1",
            "S-right-2",
            "S-right-3"
        ]
    );
    let one_lane = |arm: &str| (1..=4).map(|exit| format!("{arm}-right-{exit}")).collect::<Vec<_>>();
    assert_eq!(mini, ["E", "N", "W", "S"].map(one_lane).concat());
    let two_lanes =
        |arm: &str| ["left-2", "left-3", "left-4", "right-1", "right-2"].map(|way| format!("{arm}-{way}")).to_vec();
    assert_eq!(three_lanes, [two_lanes("E"), two_lanes("N"), one_lane("W"), two_lanes("S")].concat());
}

#[test]
fn ring_lanes_are_counted_from_the_outer_kerb() {
    for (name, outer, radii) in [
        ("compact", 18.0, vec![14.0]),
        ("mini", 13.5, vec![7.5]),
        ("three-lanes", 20.0 + 1.0 + 3.0 * 3.8, vec![22.4, 26.2, 30.0]),
    ] {
        let roundabout = roundabout(name);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(near(roundabout.outer_radius(), outer), "{name}: {}", roundabout.outer_radius());
        assert!(
            roundabout.lane_radii().iter().zip(&radii).all(|(&a, &b)| near(a, b)),
            "{name}: {:?}",
            roundabout.lane_radii()
        );
        assert_eq!(roundabout.lane_radii().len(), radii.len());
        for route in routes(name) {
            let of_lane = roundabout.lane_radii()[radii.len() - 1 - usize::from(route.lane == Lane::Left)];
            let around = |piece: &Piece| match piece {
                Piece::Arc { centre, radius, .. } => *centre == DVec2::ZERO && *radius == of_lane,
                Piece::Segment { .. } => false,
            };
            // The first exits of `mini` pass outside the ring.
            assert_eq!(route.centre_line.pieces.iter().any(around), name != "mini" || 1 < route.exit, "{}", route.name);
        }
    }
}

#[test]
fn pictures_show_every_lane_once() {
    // Lanes of the ring, of the entries, and of the exits.
    for (name, lanes) in [("compact", 1 + 3 + 3), ("mini", 1 + 4 + 4), ("three-lanes", 3 + 7 + 6)] {
        assert_eq!(roundabout(name).lanes().len(), lanes, "{name}");
    }
}

#[test]
fn a_crossing_line_covers_all_lanes_of_the_ring() {
    for (name, lane, expected) in [
        ("compact", Lane::Right, (3.5, 3.5)),
        ("mini", Lane::Right, (5.5, 5.5)),
        ("three-lanes", Lane::Right, (9.5, 1.9)),
        ("three-lanes", Lane::Left, (5.7, 5.7)),
    ] {
        let (left, right) = routes(name).into_iter().find(|route| route.lane == lane).unwrap().crossing;
        assert!((left - expected.0).abs() < 1e-9 && (right - expected.1).abs() < 1e-9, "{name}: {left}, {right}");
    }
}

#[test]
fn a_left_route_leaves_by_the_only_lane_of_an_exit() {
    let roundabout = roundabout("three-lanes");
    // W has one exit lane, S two.
    for (exit, together) in [(2, true), (3, false)] {
        let left = roundabout.line("E", Lane::Left, exit).unwrap();
        let end = left.point_at(f64::INFINITY);
        let right = roundabout.line(if exit == 2 { "E" } else { "N" }, Lane::Right, 2).unwrap();
        assert_eq!(end.distance(right.point_at(f64::INFINITY)) < 1e-9, together, "exit {exit}");
        assert!(!together || wrapped(left.heading_at(f64::INFINITY) - right.heading_at(f64::INFINITY)).abs() < 1e-9);
    }
    assert!(roundabout.line("W", Lane::Left, 2).is_none(), "W has no left entry lane");
    assert!(roundabout.line("E", Lane::Right, 3).is_none(), "with two lanes, the right one leads to two exits");
}

#[test]
fn routes_are_smooth_and_keep_off_the_kerbs() {
    for name in NAMES {
        let kerbs = roundabout(name).kerbs(Gutter::Drivable);
        for route in routes(name) {
            for joint in route.centre_line.pieces.windows(2) {
                let turn = wrapped(joint[1].heading_at(0.0) - joint[0].heading_at(joint[0].length()));
                // Angles are sums of several f64.
                assert!(turn.abs() < 1e-6, "{}: a kink of {turn} rad", route.name);
                assert!(joint[0].end().distance(joint[1].start()) < 1e-6, "{}: a gap", route.name);
            }
            let points = (0..(route.centre_line.length() * 4.0) as usize)
                .map(|step| route.centre_line.point_at(step as f64 / 4.0));
            let nearest = points.map(|p| kerbs.signed_distance(p)).fold(f64::INFINITY, f64::min);
            assert!(1.6 <= nearest, "{}: {nearest} m from a kerb", route.name);
        }
    }
}

#[test]
fn fields_are_within_three_centimetres_of_the_exact_distance() {
    for name in NAMES {
        for gutter in [Gutter::Drivable, Gutter::Solid] {
            let kerbs = roundabout(name).kerbs(gutter);
            let points = near_kerbs(&kerbs, &Field::bake(&kerbs, 0.5));
            assert!(20_000 < points.len(), "{name}: {}", points.len());
            let worst = points.iter().map(|(_, exact, baked)| (exact - baked).abs()).fold(0.0, f64::max);
            assert!(worst < 0.03, "{name} {gutter:?}: {worst}");
        }
    }
}

#[test]
fn ranges_are_exact_to_two_centimetres() {
    let world = benchmark("attard2023").1;
    let n_trucks = 500;
    for name in NAMES {
        let kerbs = roundabout(name).kerbs(Gutter::Drivable);
        let field = Field::bake(&kerbs, 0.5);
        for (on, engine) in engines() {
            let [wrong, grazing, met] = sense::errors(&engine, &world, &kerbs, &field, n_trucks);
            assert_eq!(wrong, 0, "{name}, {on}");
            assert!(
                grazing < 45 && n_trucks as usize * N_RAYS / 3 < met,
                "{name}, {on}: {grazing} graze, {met} meet a kerb"
            );
        }
    }
}

#[test]
fn trucks_start_clear_of_kerbs_on_every_route_and_can_be_stepped() {
    let scenario = all_routes();
    let world = Arc::new(World::bake(&scenario).unwrap());
    assert_eq!(world.routes.len(), 9 + 16 + 19);
    let n_envs = 4 * world.routes.len();
    let every_route: Vec<u32> = (0..n_envs as u32).map(|env| env % world.routes.len() as u32).collect();
    let straight = scenario.steer_levels.iter().position(|&level| level == 0.0).unwrap() as u32;
    for (on, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, n_envs, 3, RouteChoice::Fixed(every_route.clone()));
        simulator.step(&vec![straight; n_envs]).unwrap();
        assert!(simulator.batch().ended.iter().all(|&ended| ended == Ended::Running as u32), "{on}");
        let mut simulator =
            batch_on(&engine, &world, n_envs, 3, RouteChoice::Drawn((0..world.routes.len() as u32).collect()));
        let mut ended = 0;
        for _ in 0..200 {
            simulator.step_at_random();
            let batch = simulator.batch();
            assert!(
                batch.observation.as_flattened().iter().chain(&batch.reward).all(|value| value.is_finite()),
                "{on}"
            );
            ended += batch.ended.iter().filter(|&&ended| ended != Ended::Running as u32).count();
        }
        assert!(n_envs < ended, "{on}: only {ended} episodes ended");
    }
}

/// A way around the island of `mini` on the circle of `radius`, from the east entry to an exit, that begins and ends on
/// the lanes.
fn wide_way(radius: f64, exit: u32) -> Curve {
    let lane = 4.8 - 0.5 - 4.2 / 2.0;
    let (origin, ahead) = (DVec2::new(80.0, lane), -DVec2::X);
    let (into, arrival) = to_circle(origin, ahead, radius, 10.0).unwrap();
    let inward = Curve { pieces: vec![Piece::Segment { from: origin, to: into.start() }, into] };
    let bearing = f64::from(exit) * 90f64.to_radians();
    let outward = inward.mirrored().turned(bearing).reversed();
    let around = Piece::Arc { centre: DVec2::ZERO, radius, from: arrival, sweep: bearing - 2.0 * arrival };
    Curve { pieces: inward.pieces.into_iter().chain([around]).chain(outward.pieces).collect() }
}

#[test]
fn a_truck_passes_the_island_of_a_metre_and_a_half_to_every_exit() {
    let rig = benchmark("attard2023").1.rigs[0];
    let roundabout = roundabout("mini");
    let kerbs = roundabout.kerbs(Gutter::Drivable);
    let suffices = |line: &Curve| {
        own_lane_suffices(&rig, [&kerbs; 2], &swept_path(&rig, &line.part(20.0, line.length() - 20.0), 2.0, 0.25))
    };
    for exit in 1..=4 {
        assert!(suffices(&wide_way(9.0, exit)), "exit {exit}");
    }
    // With the front axle on the ring lane's centre the trailer runs over the island.
    assert!(!suffices(&roundabout.line("E", Lane::Right, 4).unwrap()));
}
