use std::sync::Arc;

use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{RouteChoice, Simulator};

use super::*;

fn scenario() -> Scenario {
    Scenario::named("attard2023").unwrap()
}

/// Two trucks on the first two test routes that steer hard left until each collides: their tracks, and the batch after
/// every step.
fn driven(scenario: &Scenario) -> (Arc<World>, Vec<Track>, Vec<Batch>) {
    let world = Arc::new(World::bake(scenario).unwrap());
    let routes = scenario.split(Split::Test)[..2].to_vec();
    let mut simulator = Simulator::new(world.clone(), 2, 3, RouteChoice::Fixed(routes)).unwrap();
    let mut recorder = Recorder::new(&world, simulator.batch(), [1, 0]);
    let mut states = vec![simulator.batch().clone()];
    while recorder.is_running() {
        simulator.step(&[8, 6]).unwrap();
        recorder.follow(&world, simulator.batch());
        states.push(simulator.batch().clone());
    }
    (world, recorder.finish(), states)
}

#[test]
fn frames_are_the_simulators_states_from_the_start_to_the_last_step() {
    let (world, tracks, states) = driven(&scenario());
    assert_eq!(tracks.iter().map(|track| track.env).collect::<Vec<_>>(), [1, 0]);
    assert_ne!(tracks[0].frames.len(), tracks[1].frames.len(), "one truck is held while the other drives on");
    for Track { env, ended, frames } in tracks {
        let last = &states[frames.len() - 1];
        assert_eq!((ended as u32, frames.len()), (last.ended[env], last.truck[env].steps as usize + 1));
        assert!(ended.failed(), "{ended:?}");
        for (n, (frame, batch)) in frames.iter().zip(&states).enumerate() {
            let truck = &batch.truck[env];
            // Half of a rounding step, and as much again for f32 at 60 m.
            let same = |parts: f64, a: f32, b: f32| assert!(f64::from((a - b).abs()) <= 0.51 / parts + 4e-6, "frame {n}: {a} {b}");
            same(MILLI, frame.position[0], truck.position.x);
            same(MILLI, frame.position[1], truck.position.y);
            same(MILLI, frame.trailer_position[0], truck.trailer_position(world.rig(truck)).x);
            same(ANGLE, frame.trailer_heading, truck.trailer_heading);
            same(ANGLE, frame.articulation, wrapped(truck.heading - truck.trailer_heading));
            same(ANGLE, frame.steering, truck.steering);
            same(MILLI, frame.lane_distance, batch.progress[env].lane_distance);
            same(MILLI, frame.ranges[28], batch.ranges[env][28]);
            same(MILLI, frame.trailer_load_transfer_ratio, truck.trailer_load_transfer_ratio);
            if n == 0 {
                assert_eq!((frame.action, frame.reward), (None, 0.0));
            } else {
                assert_eq!(frame.action, Some([8, 6][env]));
                same(MILLI, frame.reward, batch.reward[env]);
                same(MILLI, frame.tractor_clearance, batch.clearance[env].tractor);
            }
        }
        // A reset computes no clearance; a truck in its lane is clear of the kerbs.
        assert!(0.3 < frames[0].tractor_clearance && 0.3 < frames[0].trailer_clearance);
    }
}

#[test]
fn a_recording_read_back_is_the_recording() {
    let scenario = scenario();
    let (world, mut tracks, _) = driven(&scenario);
    let (roundabout, route) = scenario.routes().nth(scenario.split(Split::Test)[1] as usize).unwrap();
    let recording = Recording {
        benchmark: scenario.name.clone(),
        route: route.name.clone(),
        policy: "pursuit".to_owned(),
        seed: 3,
        episode: 0,
        episodes: 1,
        step: scenario.step,
        ended: tracks[0].ended.name().to_owned(),
        vehicle: Measures::of(&world),
        actions: world.actions.iter().map(|action| [action.steering, action.speed]).collect(),
        map: Map::of(&scenario.places[roundabout].roundabout, scenario.gutter),
        centre_line: centre_line(&scenario.places[roundabout].roundabout, route),
        frames: tracks.remove(0).frames,
    };
    let text = serde_json::to_string(&recording).unwrap();
    assert_eq!(serde_json::from_str::<Recording>(&text).unwrap(), recording);
}

#[test]
fn the_tracks_of_a_left_hand_road_are_the_mirror_image_of_what_was_driven() {
    let (world, tracks, _) = driven(&scenario());
    let right = Roundabout::named("16m").unwrap();
    let left = Roundabout::on("16m".into(), offtrack::ground::Ground { mirrored: true, ..right.ground().clone() });
    assert_eq!(tracks[0].clone().seen(&right), tracks[0]);
    let seen = tracks[0].clone().seen(&left);
    for (frame, driven) in seen.frames.iter().zip(&tracks[0].frames) {
        assert_eq!(frame.position, [driven.position[0], 0.0 - driven.position[1]]);
        assert_eq!((frame.heading, frame.articulation), (0.0 - driven.heading, 0.0 - driven.articulation));
        assert_eq!((frame.steering, frame.speed, frame.action), (0.0 - driven.steering, driven.speed, driven.action));
        // The foremost trailer ray on the left is that on the right, the tractor's leftmost its rightmost.
        assert_eq!((frame.ranges[0], frame.ranges[16]), (driven.ranges[1], driven.ranges[28]));
    }
    assert!(seen.frames.iter().any(|frame| frame.steering != 0.0));
    assert_eq!(seen.seen(&left), tracks[0]);
    // The truck is symmetric: its mirror image has the same sensors.
    assert_eq!(Measures::of(&world).seen(&left), Measures::of(&world));
    let (map, mirrored) = (Map::of(&right, Gutter::Drivable), Map::of(&left, Gutter::Drivable));
    let north = |map: &Map| map.drivable[0].iter().map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max);
    let south = |map: &Map| map.drivable[0].iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    assert!((north(&map) + south(&mirrored)).abs() < 0.02 && (south(&map) + north(&mirrored)).abs() < 0.02);
}
