use std::path::Path;
use std::sync::Arc;

use offtrack::field::Field;
use offtrack::geometry::Outline;
use offtrack::layout::{Clearance, N_RAYS, N_VALUES, Start};
use offtrack::scenario::Scenario;
use offtrack::simulator::{RouteChoice, Simulator};
use rand::SeedableRng;

use super::*;
use crate::generator::Generator;

fn scenario() -> Scenario {
    Scenario::read(&crate::repository().join(Path::new("scenarios/attard2023.toml"))).unwrap()
}

/// The world mirrored at the x axis: left-hand traffic, clockwise.
fn mirrored(scenario: &Scenario) -> World {
    let mut world = World::bake(scenario).unwrap();
    let flip = glam::Vec2::new(1.0, -1.0);
    for waypoint in &mut world.waypoints {
        waypoint.position *= flip;
        waypoint.direction *= flip;
    }
    for preview in &mut world.previews {
        preview.heading = -preview.heading;
    }
    for route in &mut world.routes {
        std::mem::swap(&mut route.crossing_left, &mut route.crossing_right);
    }
    let bake = |place: &offtrack::scenario::Place| {
        let kerbs = place.roundabout.kerbs(scenario.gutter);
        Field::bake(&Outline::new(kerbs.loops.iter().map(|curve| curve.mirrored()).collect()), scenario.cell)
    };
    world.fields = scenario.places.iter().map(bake).collect();
    world
}

#[test]
fn a_mirrored_truck_in_a_mirrored_world_has_mirrored_observations_and_the_same_rewards() {
    let scenario = scenario();
    let world = World::bake(&scenario).unwrap();
    let mirror = Mirror::of(&world).unwrap();
    let n_routes = world.routes.len();
    let routes: Vec<u32> = (0..4 * n_routes).map(|env| (env % n_routes) as u32).collect();
    let begin = |world: World, side: f32| {
        let choice = RouteChoice::Fixed(routes.clone());
        let mut simulator = Simulator::new(Arc::new(world), routes.len(), 0, choice).unwrap();
        let start = |env: usize| Start {
            offset: side * (env as f32 * 0.37).sin(),
            heading: side * (env as f32 * 0.73).sin(),
            ..Start::default()
        };
        simulator.reset_from(&(0..routes.len()).map(start).collect::<Vec<_>>()).unwrap();
        simulator
    };
    let (mut real, mut image) = (begin(world, 1.0), begin(mirrored(&scenario), -1.0));
    let rng = &mut Generator::seed_from_u64(5);
    let (mut n_ranges, mut n_grazing, mut n_steps, mut mirrored) = (0, 0, 0, 0.0f32);
    for _ in 0..60 {
        let held: Vec<bool> =
            real.batch().truck.iter().zip(&image.batch().truck).map(|(one, other)| one.held + other.held > 0).collect();
        // Mostly straight on, so that trucks come as far as the ring.
        let actions: Vec<u32> =
            routes.iter().map(|_| if rng.random_bool(0.5) { 4 } else { rng.random_range(1..8) }).collect();
        let images: Vec<u32> = actions.iter().map(|&action| mirror.actions[action as usize]).collect();
        real.step(&actions).unwrap();
        image.step(&images).unwrap();
        let (one, other) = (real.batch(), image.batch());
        for env in (0..routes.len()).filter(|&env| !held[env]) {
            n_steps += 1;
            // A truck that misses a kerb by less than the field's error may hit its image.
            assert!(
                one.ended[env] == other.ended[env]
                    || nearest(&one.clearance[env]).min(nearest(&other.clearance[env])).abs() < 0.02
            );
            // A waypoint is worth 100; the price on the lane distance differs by rounding.
            assert!(one.ended[env] != other.ended[env] || (one.reward[env] - other.reward[env]).abs() < 0.1);
            let expected = mirror.observation(&one.next_observation[env]);
            for (index, (found, expected)) in other.next_observation[env].iter().zip(expected).enumerate() {
                mirrored = mirrored.max((expected - one.next_observation[env][index]).abs());
                if (first_ray()..first_ray() + N_RAYS).contains(&index) {
                    // A ray is right to 2 cm of the 20 m that it reaches, but for one that grazes a kerb.
                    n_ranges += 1;
                    n_grazing += usize::from(0.003 < (found - expected).abs());
                } else {
                    // Headings differ by f32's rounding, added up over the steps so far.
                    assert!((found - expected).abs() < 1e-4, "truck {env}, value {index}: {found} for {expected}");
                }
            }
        }
    }
    assert!(10_000 < n_steps, "{n_steps}");
    assert!(1000 * n_grazing < n_ranges, "{n_grazing} of {n_ranges}");
    // What was compared was not the same to both sides.
    assert!(1.0 < mirrored, "{mirrored}");
}

fn nearest(clearance: &Clearance) -> f32 {
    clearance.tractor.min(clearance.trailer)
}

#[test]
fn the_image_of_an_image_is_the_thing_itself_and_the_middle_stays() {
    let mirror = Mirror::of(&World::bake(&scenario()).unwrap()).unwrap();
    let seen: [f32; N_VALUES] = std::array::from_fn(|index| 0.01 * index as f32 - 0.3);
    assert_eq!(mirror.observation(&mirror.observation(&seen)), seen);
    assert_ne!(mirror.observation(&seen), seen);
    assert_eq!(mirror.actions, [8, 7, 6, 5, 4, 3, 2, 1, 0]);
    // The rearmost pair of the trailer's sensors; the tractor's from left to right, of which the seventh looks ahead.
    assert_eq!([44, 45, 46, 52, 58].map(|index| mirror.values[index].0), [45, 44, 58, 52, 46]);
}

#[test]
fn an_action_table_or_sensors_without_an_image_are_refused() {
    let mut world = World::bake(&scenario()).unwrap();
    world.actions[8].steering *= 0.9;
    let message = Mirror::of(&world).unwrap_err().to_string();
    assert!(
        message.starts_with(
            "learning.mirror_augmentation: true; steering -32.0 deg is in the action table and its opposite is not"
        ),
        "{message}"
    );
    let mut world = World::bake(&scenario()).unwrap();
    world.rays[0][3].origin.x += 0.5;
    let message = Mirror::of(&world).unwrap_err().to_string();
    assert!(message.contains("distance sensor 2 has no mirror image"), "{message}");
}

#[test]
fn half_of_a_sample_is_mirrored_whole_transitions_at_a_time() {
    let mirror = Mirror::of(&World::bake(&scenario()).unwrap()).unwrap();
    let one = [0.1; N_VALUES];
    let rows = 2000;
    let mut sample = Sample {
        observation: vec![one; rows],
        action: vec![6; rows],
        reward: vec![1.0; rows],
        discount: vec![0.9; rows],
        next_observation: vec![[0.2; N_VALUES]; rows],
        weight: vec![1.0; rows],
        row: vec![0; rows],
    };
    mirror.mirror_half(&mut sample, &mut Generator::seed_from_u64(1));
    let mut n_mirrored = 0;
    for row in 0..rows {
        let mirrored = sample.action[row] == 2;
        n_mirrored += usize::from(mirrored);
        let expected = |seen: [f32; N_VALUES]| if mirrored { mirror.observation(&seen) } else { seen };
        assert_eq!((sample.observation[row], sample.next_observation[row]), (expected(one), expected([0.2; N_VALUES])));
        assert!(mirrored || sample.action[row] == 6);
    }
    // Four deviations of 2,000 throws of a coin.
    assert!(n_mirrored.abs_diff(rows / 2) < 90, "{n_mirrored}");
}

#[test]
fn what_is_observed_of_vehicles_is_mirrored_by_its_table_behind_the_extras() {
    let text =
        Scenario::text_of("traffic2026").unwrap().replace("vehicles = true", "vehicles = true\nextras = \"blind\"");
    let mut scenario = Scenario::parse("among", &text, None, &offtrack::files::cache::Loading::PLAIN).unwrap();
    scenario.retain(|_, route| route.name.starts_with("16m"));
    let mirror = Mirror::of(&World::bake(&scenario).unwrap()).unwrap();
    const N: usize = N_VALUES + 5 + offtrack::layout::N_AROUND;
    assert_eq!(mirror.images().0.len(), N);
    let seen: [f32; N] = std::array::from_fn(|index| 0.01 * index as f32 + 0.01);
    let image = mirror.observation(&seen);
    for values in &VEHICLE_VALUES {
        for index in N_VALUES + 5 + values.first..N_VALUES + 5 + values.first + values.n {
            let sided = values.name.ends_with("_left");
            assert_eq!(image[index], if sided { -seen[index] } else { seen[index] }, "{}", values.name);
        }
    }
}
