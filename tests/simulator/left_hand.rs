//! Left-hand traffic: a road is driven as its mirror image, to the last bit, and mirrored back where it is seen.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use glam::DVec2;
use offtrack::layout::Start;
use offtrack::map::{Gutter, Road};
use offtrack::scenario::Scenario;
use offtrack::simulator::RouteChoice;
use offtrack::world::World;

use crate::episodes::{all_routes, rows};
use crate::{batch_on, engines};

mod text;

pub(crate) use text::left_hand;

const MIRROR: DVec2 = DVec2::new(1.0, -1.0);

/// A shipped roundabout file's text.
pub(crate) fn text(name: &str) -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/roundabouts").join(name).with_extension("toml");
    fs::read_to_string(file).unwrap()
}

fn pair(name: &str) -> [Road; 2] {
    [text(name), left_hand(&text(name))].map(|text| Road::from_toml("road", &text).unwrap())
}

/// The benchmark of one roundabout, and its world.
pub(crate) fn world(folder: &Path, roundabout: &str, gutter: &str) -> (Scenario, Arc<World>) {
    fs::write(folder.join("road.toml"), roundabout).unwrap();
    let benchmark = format!(
        "vehicle = \"daf_xf\"\nload = \"empty\"\ngutter = \"{gutter}\"\n[actions]\n\
         steer_levels = [-0.8, -0.4, 0.0, 0.4, 0.8]\n\
         speeds_kmh = [30.0]\n[sensors]\nrange = 20.0\n[reward]\nwaypoint = 100.0\nlane_distance = -1.5\n\
         lane_distance_limit = 4.0\n\
         failure = -500.0\n[[roundabout]]\nfile = \"road.toml\"\ntrain = \"all\"\n"
    );
    fs::write(folder.join("benchmark.toml"), benchmark).unwrap();
    let scenario = Scenario::read(&folder.join("benchmark.toml")).unwrap();
    let world = World::bake(&scenario).unwrap();
    (scenario, Arc::new(world))
}

#[test]
fn a_left_hand_world_driven_with_mirrored_actions_is_the_mirrored_right_hand_one_to_the_last_bit() {
    let folder = tempfile::tempdir().unwrap();
    for gutter in ["drivable", "solid"] {
        let [(_, right), (_, left)] =
            [text("16m-maps"), left_hand(&text("16m-maps"))].map(|text| world(folder.path(), &text, gutter));
        for (name, engine) in engines() {
            // The mirror image is driven: the action that mirrors another has its index.
            let [mut one, mut other] = [&right, &left].map(|world| batch_on(&engine, world, 256, 7, all_routes(world)));
            for _ in 0..60 {
                one.step_at_random();
                other.step_at_random();
            }
            assert!(rows(one.batch()) == rows(other.batch()), "{name}, {gutter}");
            assert!(one.batch().truck.iter().any(|truck| 0 < truck.episode), "nobody has begun a second episode");
            // From anywhere along the routes, too.
            let starts: Vec<Start> =
                (0..256).map(|env| Start { along: env as f32 / 255.0, ..Start::default() }).collect();
            for simulator in [&mut one, &mut other] {
                simulator.reset_from(&starts).unwrap();
                (0..10).for_each(|_| simulator.step_at_random());
            }
            assert!(rows(one.batch()) == rows(other.batch()), "{name}, {gutter}");
        }
    }
}

#[test]
fn a_left_hand_world_is_another_one_than_the_same_file_with_right_hand_traffic() {
    let folder = tempfile::tempdir().unwrap();
    let [(_, right), (_, left)] =
        [text("20m-maps"), left_hand(&text("16m-maps"))].map(|text| world(folder.path(), &text, "drivable"));
    let [mut one, mut other] =
        [&right, &left].map(|world| batch_on(&engines()[0].1, world, 64, 7, RouteChoice::Drawn(vec![0, 1])));
    (0..30).for_each(|_| one.step_at_random());
    (0..30).for_each(|_| other.step_at_random());
    assert!(rows(one.batch()) != rows(other.batch()));
}

#[test]
fn what_is_seen_of_a_left_hand_road_is_the_mirror_image_of_what_is_driven() {
    for name in ["16m-maps", "50m-maps", "40m"] {
        let [right, left] = pair(name);
        assert!(left.is_mirrored() && !right.is_mirrored() && !left.seen().is_mirrored());
        for gutter in [Gutter::Drivable, Gutter::Solid] {
            let (driven, seen, twin) = (left.kerbs(gutter), left.seen().kerbs(gutter), right.kerbs(gutter));
            for step in 0..400 {
                let p = DVec2::from_angle(f64::from(step)) * (0.15 * f64::from(step));
                assert_eq!(driven.signed_distance(p).to_bits(), twin.signed_distance(p).to_bits(), "{name} at {p}");
                // Angles of arcs change their signs, and sines and cosines are rounded.
                assert!((seen.signed_distance(p * MIRROR) - driven.signed_distance(p)).abs() < 1e-9, "{name} at {p}");
            }
        }
        let (driven, seen) = (left.routes(40.0, 35.0, 2.0).unwrap(), left.seen().routes(40.0, 35.0, 2.0).unwrap());
        let twin = right.routes(40.0, 35.0, 2.0).unwrap();
        assert_eq!(driven.len(), twin.len());
        for ((driven, seen), twin) in driven.iter().zip(&seen).zip(&twin) {
            assert_eq!((&driven.centre_line, &driven.name), (&twin.centre_line, &seen.name));
            let mirrored = left.seen_route(driven);
            assert_eq!((mirrored.lane, mirrored.crossing), (seen.lane, seen.crossing));
            for (one, other) in
                [(&mirrored.waypoints, &seen.waypoints), (&mirrored.waypoints, &driven.mirrored().waypoints)]
                    .iter()
                    .flat_map(|(one, other)| one.iter().zip(other.iter()))
            {
                assert!(one.position.distance(other.position) < 1e-9);
            }
        }
    }
}

#[test]
fn a_left_hand_road_has_its_lanes_by_the_names_that_a_driver_there_would_say() {
    let [right, left] = pair("16m");
    // E-right-1 is the lane next to the kerb to the first exit; in left-hand traffic that lane is the left one, and the
    // first exit clockwise is N's mirror image.
    let names = |roundabout: &Road| {
        roundabout.routes(40.0, 35.0, 2.0).unwrap().into_iter().map(|route| route.name).collect::<Vec<_>>()
    };
    let (right, left) = (names(&right), names(&left));
    assert!(right.contains(&"road/E-right-1".to_owned()) && !right.contains(&"road/E-left-1".to_owned()));
    assert!(left.contains(&"road/E-left-1".to_owned()) && !left.contains(&"road/E-right-1".to_owned()));
}

#[test]
fn a_benchmark_names_the_routes_of_a_left_hand_road_as_they_are_there() {
    let folder = tempfile::tempdir().unwrap();
    let (scenario, world) = world(folder.path(), &left_hand(&text("16m")), "drivable");
    assert!(world.route_names.contains(&"road/E-left-1".to_owned()));
    assert_eq!(scenario.routes().count(), world.routes.len());
}

#[test]
fn an_error_in_a_left_hand_file_names_its_lane_and_says_that_positions_are_mirrored() {
    let text = left_hand(&text("16m")).replacen("ring_radius = 24.5", "ring_radius = 2400.5", 1);
    let message = Road::from_toml("road", &text).unwrap_err().to_string();
    assert!(message.starts_with("road: arm[0].entry.left.ring_radius: 2400.5 m; must lie in 0.1..1000 m"), "{message}");
    assert!(message.contains("mirror image"), "{message}");
}

#[test]
fn an_outline_file_keeps_the_hand_of_traffic() {
    let [right, left] = pair("16m-maps");
    let folder = tempfile::tempdir().unwrap();
    let read = |roundabout: &Road| {
        let file = folder.path().join("road.outline.toml");
        fs::write(&file, roundabout.ground().text(&[])).unwrap();
        Road::read(&file).unwrap()
    };
    assert!(read(&left).is_mirrored() && !read(&right).is_mirrored());
    assert_eq!(read(&left).routes(40.0, 35.0, 2.0).unwrap()[0].name, left.routes(40.0, 35.0, 2.0).unwrap()[0].name);
}
