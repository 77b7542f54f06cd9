//! Values observed beside the observation: what they are, in every track, on every engine, and in a mirror.

use std::sync::Arc;

use offtrack::layout::{EXTRAS, N_EXTRAS, ObservedExtras, Start};
use offtrack::simulator::{Autoreset, RouteChoice};
use offtrack::vehicle::GRAVITY;
use offtrack::world::World;

use crate::fleet::all_drawn;
use crate::{batch_on, benchmark, engines};

fn world(track: ObservedExtras) -> Arc<World> {
    let mut scenario = benchmark("attard2023").0;
    (scenario.fleet, scenario.extras) = (Some(all_drawn()), track);
    Arc::new(World::bake(&scenario).unwrap())
}

#[test]
fn each_extra_is_what_its_definition_says() {
    let world = world(ObservedExtras::Oracle);
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 64, 5, RouteChoice::Drawn(vec![1, 3, 5]));
        (0..12).for_each(|_| simulator.step_at_random());
        let batch = simulator.batch();
        for env in 0..64 {
            let (truck, found) = (&batch.truck[env], batch.extras[env]);
            let rig = world.rig(truck);
            // The definition in f64, from the columns alone.
            let expected = [
                f64::from(truck.steering) / f64::from(rig.steer_max),
                f64::from(batch.control[env].target_speed) / 27.8,
                f64::from(truck.acceleration) / 2.5,
                f64::from(truck.lateral_acceleration) / GRAVITY,
                f64::from(rig.trailer_wheelbase) / 10.0,
                f64::from(truck.trailer_roll) / 0.15,
                f64::from(truck.trailer_roll_rate) / 0.3,
                f64::from(rig.trailer_mass) / 40e3,
                f64::from(rig.rollover_threshold),
                f64::from(rig.lateral_acceleration_max) / GRAVITY,
                truck.tractor_load_transfer_ratio.into(),
                truck.trailer_load_transfer_ratio.into(),
            ];
            for ((extra, found), expected) in EXTRAS.iter().zip(found).zip(expected) {
                let near = (f64::from(found) - expected.clamp(-1.0, 1.0)).abs() < 1e-5;
                assert!(near, "{name}: {} of truck {env}: {found}, expected {expected}", extra.name);
            }
            assert!(found[3].abs() < 0.8 && (0.3..0.85).contains(&found[8]) && (0.41..0.78).contains(&found[9]));
        }
        let lateral: Vec<f32> = batch.extras.iter().map(|extras| extras[3]).collect();
        assert!(lateral.iter().any(|&value| 0.02 < value.abs()), "{name}: {lateral:?}");
    }
}

#[test]
fn a_track_observes_the_first_extras_and_leaves_the_others_0() {
    for (track, n) in [
        (ObservedExtras::None, 0),
        (ObservedExtras::Blind, 5),
        (ObservedExtras::Mass, 8),
        (ObservedExtras::Oracle, N_EXTRAS),
    ] {
        let world = world(track);
        for (name, engine) in engines() {
            let mut simulator = batch_on(&engine, &world, 32, 5, RouteChoice::Drawn(vec![1, 3, 5]));
            (0..20).for_each(|_| simulator.step_at_random());
            let batch = simulator.batch();
            for extras in batch.extras.iter().chain(&batch.next_extras) {
                assert!(extras[n..].iter().all(|&value| value == 0.0), "{name} {track:?}: {extras:?}");
                assert!(n < 5 || extras[4] != 0.0, "{name} {track:?}: {extras:?}");
            }
        }
        assert_eq!(track.names().len(), n);
    }
    assert!(!ObservedExtras::Blind.names().iter().any(|name| name.contains("mass") || name.contains("roll")));
    assert!(
        ObservedExtras::Mass.names().contains(&"trailer_mass")
            && !ObservedExtras::Mass.names().contains(&"rollover_threshold")
    );
}

#[test]
fn extras_differ_before_and_after_an_action_only_where_an_episode_ended() {
    let world = world(ObservedExtras::Oracle);
    for (name, engine) in engines() {
        for autoreset in [Autoreset::SameStep, Autoreset::NextStep] {
            let mut simulator = batch_on(&engine, &world, 256, 5, RouteChoice::Drawn((0..75).collect()));
            simulator.set_autoreset(autoreset);
            let mut ended = 0;
            for _ in 0..120 {
                simulator.step_at_random();
                let batch = simulator.batch();
                for env in 0..256 {
                    let differ = batch.extras[env] != batch.next_extras[env];
                    let ends = batch.ended[env] != 0 && autoreset == Autoreset::SameStep;
                    assert!(differ == ends, "{name}: truck {env} ended {}", batch.ended[env]);
                    ended += usize::from(batch.ended[env] != 0);
                }
            }
            assert!(50 < ended, "{name}: {ended}");
        }
    }
}

#[test]
fn a_mirrored_truck_has_the_mirrored_extras() {
    let mut world = World::clone(&world(ObservedExtras::Oracle));
    world.rigs.iter_mut().for_each(|rig| rig.crossfall = 0.0);
    let world = Arc::new(world);
    for (name, engine) in engines() {
        let extras = |side: f32, actions: &[u32]| {
            let mut simulator = batch_on(&engine, &world, 1, 0, RouteChoice::Fixed(vec![3]));
            simulator.reset_from(&[Start { heading: 0.5 * side, vehicle: 300, ..Start::default() }]).unwrap();
            actions.iter().for_each(|&action| simulator.step(&[action]).unwrap());
            simulator.batch().next_extras[0]
        };
        let (here, there) = (extras(1.0, &[6; 9]), extras(-1.0, &[2; 9]));
        for ((extra, here), there) in EXTRAS.iter().zip(here).zip(there) {
            assert!((extra.mirror * here - there).abs() < 1e-4, "{name}: {}: {here} and {there}", extra.name);
            assert!(extra.mirror == 1.0 || 1e-4 < here.abs(), "{name}: {} is 0: its sign shows nothing", extra.name);
        }
    }
}
