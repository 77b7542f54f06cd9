use std::sync::Arc;

use offtrack::scenario::Split;
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
    for Track { env, vehicle, ended, frames, vehicles } in tracks {
        assert!(vehicles.is_empty());
        assert_eq!(vehicle, 0);
        let last = &states[frames.len() - 1];
        assert_eq!((ended as u32, frames.len()), (last.ended[env], last.truck[env].steps as usize + 1));
        assert!(ended.failed(), "{ended:?}");
        for (n, (frame, batch)) in frames.iter().zip(&states).enumerate() {
            let truck = &batch.truck[env];
            // Half of a rounding step, and as much again for f32 at 60 m.
            let same = |parts: f64, a: f32, b: f32| {
                assert!(f64::from((a - b).abs()) <= 0.51 / parts + 4e-6, "frame {n}: {a} {b}")
            };
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
    let of = Of {
        scenario: &scenario,
        world: &world,
        roundabout: &scenario.places[roundabout].roundabout,
        route,
        policy: "pursuit",
        seed: 3,
    };
    let recording = of.recording(0, 1, tracks.remove(0));
    let text = serde_json::to_string(&recording).unwrap();
    assert_eq!(serde_json::from_str::<Recording>(&text).unwrap(), recording);
}

#[test]
fn the_tracks_of_a_left_hand_road_are_the_mirror_image_of_what_was_driven() {
    let (world, tracks, _) = driven(&scenario());
    let right = Road::named("16m").unwrap();
    let left = Road::on("16m".into(), offtrack::map::ground::Ground { mirrored: true, ..right.ground().clone() });
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
    assert_eq!(Measures::of(&world, 0).seen(&left), Measures::of(&world, 0));
    let (map, mirrored) = (Map::of(&right, Gutter::Drivable), Map::of(&left, Gutter::Drivable));
    let north = |map: &Map| map.drivable[0].iter().map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max);
    let south = |map: &Map| map.drivable[0].iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    assert!((north(&map) + south(&mirrored)).abs() < 0.02 && (south(&map) + north(&mirrored)).abs() < 0.02);
}

#[test]
fn a_truck_of_a_fleet_is_drawn_with_the_dimensions_and_the_sensors_that_it_drove_with() {
    let mut scenario = Scenario::named("laden2026").unwrap();
    scenario.keep(&[Split::Test]);
    let world = Arc::new(World::bake(&scenario).unwrap());
    let route = scenario.split(Split::Test)[0];
    let mut simulator = Simulator::new(world.clone(), 40, 3, RouteChoice::Fixed(vec![route; 40])).unwrap();
    let mut recorder = Recorder::new(&world, simulator.batch(), 0..40);
    let starts = simulator.batch().truck.clone();
    for _ in 0..5 {
        simulator.step(&[22; 40]).unwrap();
        recorder.follow(&world, simulator.batch());
    }
    let (mut lengths, mut classes) = (Vec::new(), Vec::new());
    for (track, start) in recorder.finish().iter().zip(&starts) {
        let (rig, measures) = (world.rig(start), Measures::of(&world, track.vehicle));
        assert_eq!(track.vehicle, start.vehicle);
        assert_eq!(measures.trailer_wheelbase, to(MILLI, rig.trailer_wheelbase));
        assert_eq!(measures.tractor_rays[0][0], to(MILLI, world.rays_of(rig)[N_TRAILER_RAYS].origin.x));
        // The trailer's axles lie where both positions of a frame say: at the drawn wheelbase behind the kingpin.
        for frame in &track.frames {
            let kingpin = |position: [f32; 2], heading: f32, ahead: f32| {
                [position[0] + ahead * heading.cos(), position[1] + ahead * heading.sin()]
            };
            let a = kingpin(frame.position, frame.heading, measures.fifth_wheel);
            let b = kingpin(frame.trailer_position, frame.trailer_heading, measures.trailer_wheelbase);
            // Positions are rounded to 1 mm, headings to 0.1 mrad.
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 0.004, "{a:?} {b:?}");
        }
        lengths.push(measures.trailer_wheelbase.to_bits());
        classes.push(Class::of(&world, track.vehicle).unwrap().to_string());
    }
    for (mut values, least) in [(lengths.iter().map(u32::to_string).collect::<Vec<_>>(), 20), (classes, 5)] {
        values.sort();
        values.dedup();
        assert!(least <= values.len(), "{values:?}");
    }
}
