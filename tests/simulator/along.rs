//! Starts anywhere along a route: where a truck then stands, and that it drives on from there, on every engine.

use std::sync::Arc;

use glam::DVec2;
use offtrack::layout::angle::wrapped;
use offtrack::layout::random::{self, Draw};
use offtrack::layout::{Start, Truck};
use offtrack::map::route::Route;
use offtrack::physics::{drawn_start, reference_point};
use offtrack::simulator::{Autoreset, Begin, RouteChoice, Simulator};
use offtrack::world::World;

use crate::episodes::rows;
use crate::{batch_on, benchmark, engines};

/// Trucks on one route each, route by route.
fn on_routes(world: &World, per_route: usize) -> RouteChoice {
    RouteChoice::Fixed((0..world.routes.len() as u32).flat_map(|route| vec![route; per_route]).collect())
}

fn along(fraction: f32) -> Start {
    Start { along: fraction, ..Start::default() }
}

/// Headings of both units once the reference point has followed a route's centre line for `length` metres: points that
/// are towed a centimetre at a time.
fn towed(world: &World, route: &Route, length: f64) -> [f64; 2] {
    let rig = &world.rigs[0];
    let (half, fifth_wheel) = (0.5 * f64::from(rig.wheelbase), f64::from(rig.fifth_wheel));
    let trailer_wheelbase = f64::from(rig.trailer_wheelbase);
    let ahead = DVec2::from_angle(route.centre_line.heading_at(0.0));
    let mut drive = route.centre_line.point_at(0.0) - half * ahead;
    let mut axles = drive + (fifth_wheel - trailer_wheelbase) * ahead;
    let (mut tractor, mut trailer) = (ahead, ahead);
    for step in 1..=(length / 0.01).ceil() as usize {
        let point = route.centre_line.point_at((0.01 * step as f64).min(length));
        tractor = (point - drive).normalize();
        drive = point - half * tractor;
        let hitch = drive + fifth_wheel * tractor;
        trailer = (hitch - axles).normalize();
        axles = hitch - trailer_wheelbase * trailer;
    }
    [tractor.to_angle(), trailer.to_angle()]
}

#[test]
fn a_truck_that_begins_along_a_route_stands_as_one_that_has_followed_it_from_its_beginning() {
    let (scenario, mut world) = benchmark("attard2023-full");
    // Points that are towed do not slip.
    world.rigs[0].slip = 0.0;
    let (world, per_route) = (Arc::new(world), 12);
    let routes: Vec<&Route> = scenario.routes().map(|(_, route)| route).collect();
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, per_route * routes.len(), 0, on_routes(&world, per_route));
        let fractions = (0..simulator.n_envs()).map(|env| (env % per_route) as f32 / (per_route - 1) as f32);
        let starts: Vec<Start> = fractions.map(along).collect();
        simulator.reset_from(&starts).unwrap();
        let (batch, mut bent) = (simulator.batch(), 0.0_f64);
        for (env, truck) in batch.truck.iter().enumerate() {
            let route = routes[env / per_route];
            let waypoints = world.route_waypoints(truck.route);
            let last = waypoints.len() - 1;
            let first = ((starts[env].along * last as f32).round() as usize).min(last - 1);
            let (progress, lane) = (&batch.progress[env], &waypoints[first]);
            assert_eq!((progress.waypoint as usize, progress.passed), (first + 1, 0), "{name}: {truck:?}");
            let point = reference_point(world.rigs[0].wheelbase, truck);
            // Positions of up to 60 m are exact to 4 um in f32.
            assert!(point.distance(lane.position) < 3e-5, "{name}: {truck:?}");
            let expected = towed(&world, route, scenario.spacing * first as f64);
            let found = [truck.heading, truck.trailer_heading];
            for (found, expected) in found.into_iter().zip(expected) {
                let off = wrapped(found - expected as f32).to_degrees().abs();
                assert!(off < 0.6, "{name}: {off} deg at waypoint {first} of {}", route.name);
            }
            bent = bent.max(f64::from(wrapped(truck.heading - truck.trailer_heading)).to_degrees().abs());
        }
        assert!(25.0 < bent, "{name}: a trailer straight behind would pass, {bent}");
    }
}

#[test]
fn any_waypoint_but_the_last_can_be_named_by_its_fraction_of_the_route() {
    let world = Arc::new(benchmark("attard2023").1);
    let n = world.routes[3].n_waypoints;
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, n as usize, 0, RouteChoice::Fixed(vec![3; n as usize]));
        let starts: Vec<Start> = (0..n).map(|index| along(index as f32 / (n - 1) as f32)).collect();
        simulator.reset_from(&starts).unwrap();
        let next: Vec<u32> = simulator.batch().progress.iter().map(|progress| progress.waypoint).collect();
        let expected: Vec<u32> = (0..n).map(|index| index.min(n - 2) + 1).collect();
        assert_eq!(next, expected, "{name}");
    }
}

#[test]
fn a_start_at_the_first_waypoint_is_what_a_start_has_always_been() {
    let world = Arc::new(benchmark("attard2023").1);
    for (name, engine) in engines() {
        let choice = on_routes(&world, 1);
        let [mut drawn, mut stated] =
            [(); 2].map(|()| batch_on(&engine, &world, world.routes.len(), 3, choice.clone()));
        let starts = (0..world.routes.len() as u32).map(|env| {
            let [offset, heading, ..] = random::words(3, env, 0, Draw::Pose as u32).map(random::signed_unit);
            // Nearer to the first waypoint than to the second.
            Start { offset, heading, along: 1e-3, ..Start::default() }
        });
        stated.reset_from(&starts.collect::<Vec<_>>()).unwrap();
        assert!(rows(drawn.batch()) == rows(stated.batch()), "{name}");
        assert!(stated.batch().truck.iter().all(|truck| truck.heading == truck.trailer_heading), "{name}");
        drawn.reset_from(&vec![along(0.5); world.routes.len()]).unwrap();
        assert!(rows(drawn.batch()) != rows(stated.batch()), "{name}");
    }
}

#[test]
fn a_truck_on_a_road_that_tilts_begins_as_it_leans() {
    let mut scenario = benchmark("attard2023").0;
    scenario.load = "laden_high".into();
    scenario.vehicle.model.crossfall = 0.05;
    let world = Arc::new(World::bake(&scenario).unwrap());
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 2, 0, RouteChoice::Fixed(vec![3; 2]));
        simulator.reset_from(&[Start::default(), along(0.01)]).unwrap();
        let leaning: Vec<f32> = (0..5)
            .map(|_| {
                simulator.step(&[4; 2]).unwrap();
                simulator.batch().truck[0].load_transfer_ratio()
            })
            .collect();
        assert!(leaning.iter().all(|ratio| 0.1 < *ratio && (ratio - leaning[0]).abs() < 1e-3), "{name}: {leaning:?}");
    }
}

#[test]
fn errors_of_a_start_along_a_route_move_and_turn_the_truck_as_a_whole() {
    let world = Arc::new(benchmark("attard2023").1);
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 2, 0, RouteChoice::Fixed(vec![3; 2]));
        let off = Start { offset: 1.0, heading: -0.5, ..along(0.5) };
        simulator.reset_from(&[along(0.5), off]).unwrap();
        let [on, off] = [&simulator.batch().truck[0], &simulator.batch().truck[1]];
        let articulation = |truck: &Truck| wrapped(truck.heading - truck.trailer_heading);
        assert!((wrapped(off.heading - on.heading).to_degrees() + 1.0).abs() < 1e-4, "{name}");
        assert!((articulation(off) - articulation(on)).abs() < 1e-6 && 0.1 < articulation(on).abs(), "{name}");
        let moved = [on, off].map(|truck| reference_point(world.rigs[0].wheelbase, truck));
        assert!((moved[0].distance(moved[1]) - 0.3).abs() < 2e-5, "{name}: {moved:?}");
        assert_eq!((on.steering, on.trailer_roll), (off.steering, off.trailer_roll), "{name}");
    }
}

#[test]
fn a_truck_that_begins_in_a_bend_neither_leaves_it_nor_sways() {
    let (scenario, world) = benchmark("attard2023");
    let world = Arc::new(world);
    // Where each route's lane turns by the same angle between five waypoints: on the ring.
    let on_ring = |route: u32| {
        let previews = world.route_previews(route);
        let turn = |index: usize| wrapped(previews[index + 1].heading - previews[index].heading);
        (12..previews.len() - 8)
            .find(|&at| (at - 8..at + 4).all(|near| (turn(near) - turn(at)).abs() < 1e-3 && 0.05 < turn(at)))
    };
    let found: Vec<(u32, usize)> =
        (0..world.routes.len() as u32).filter_map(|route| Some((route, on_ring(route)?))).collect();
    assert!(10 < found.len(), "{found:?}");
    let straight = scenario.steer_levels.iter().position(|&level| level == 0.0).unwrap() as u32;
    for (name, engine) in engines() {
        let routes = found.iter().map(|(route, _)| *route).collect();
        let mut simulator = batch_on(&engine, &world, found.len(), 0, RouteChoice::Fixed(routes));
        let fraction =
            |&(route, at): &(u32, usize)| along(at as f32 / (world.routes[route as usize].n_waypoints - 1) as f32);
        simulator.reset_from(&found.iter().map(fraction).collect::<Vec<_>>()).unwrap();
        let begun = simulator.batch().truck.clone();
        // One step, in which the wheels have hardly begun to turn back.
        simulator.step(&vec![straight; found.len()]).unwrap();
        let batch = simulator.batch();
        for ((truck, before), progress) in batch.truck.iter().zip(&begun).zip(&batch.progress) {
            assert!(0.05 < before.steering && 0.01 < before.trailer_roll.abs(), "{name}: {before:?}");
            let ratio = |truck: &Truck| truck.trailer_load_transfer_ratio;
            assert!((ratio(truck) - ratio(before)).abs() < 0.1 * ratio(before).abs(), "{name}: {truck:?} {before:?}");
            assert!(progress.lane_distance < 0.1, "{name}: {progress:?}");
        }
    }
}

#[test]
fn a_batch_that_began_along_its_routes_is_restored_and_goes_on_bit_for_bit() {
    let world = Arc::new(benchmark("attard2023").1);
    for (name, engine) in engines() {
        let begun = || {
            let mut simulator = batch_on(&engine, &world, 8 * world.routes.len(), 5, on_routes(&world, 8));
            simulator.set_autoreset(Autoreset::SameStep);
            simulator
        };
        let (mut driven, mut restored) = (begun(), begun());
        let starts: Vec<Start> = (0..driven.n_envs()).map(|env| along((env % 8) as f32 / 7.0)).collect();
        driven.reset_from(&starts).unwrap();
        let kept = driven.batch().clone();
        restored.restore(|column| Some(kept.column(column))).unwrap();
        for simulator in [&mut driven, &mut restored] {
            (0..30).for_each(|_| simulator.step_at_random());
        }
        assert!(rows(driven.batch()) == rows(restored.batch()), "{name}");
        assert!(driven.batch().truck.iter().any(|truck| truck.episode == 1), "{name}: nobody began again");
    }
}

#[test]
fn a_start_that_is_not_on_the_route_is_refused_by_truck_and_value_and_nothing_begins() {
    let world = Arc::new(benchmark("attard2023").1);
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 3, 0, RouteChoice::Fixed(vec![3; 3]));
        let before = rows(simulator.batch());
        for (wrong, value) in [(1.01, "1.01"), (-0.5, "-0.5"), (f32::NAN, "NaN"), (f32::INFINITY, "inf")] {
            let request = |env, start| Begin { env, start: Some(start), ..Begin::default() };
            let error = simulator.begin(&[request(0, along(0.5)), request(2, along(wrong))]).unwrap_err().to_string();
            assert_eq!(error, format!("starts[2]: {value} of the way along the route; must lie in 0..1"), "{name}");
            assert!(rows(simulator.batch()) == before, "{name}");
        }
    }
}

/// A benchmark whose starts are drawn up to this fraction along their routes.
fn drawn_world(start_along: f64) -> Arc<World> {
    let mut scenario = benchmark("attard2023").0;
    scenario.start_along = start_along;
    Arc::new(World::bake(&scenario).unwrap())
}

#[test]
fn a_benchmark_draws_starts_up_to_its_fraction_of_the_route_in_every_episode() {
    let (world, n_envs) = (drawn_world(0.8), 2048);
    for (name, engine) in engines() {
        let all = RouteChoice::Drawn((0..world.routes.len() as u32).collect());
        let mut simulator: Simulator = batch_on(&engine, &world, n_envs, 7, all);
        let mut later = 0;
        for _ in 0..40 {
            let batch = simulator.batch();
            let begun = (0..n_envs).filter(|&env| batch.truck[env].steps == 0);
            let fraction = |env: usize| {
                let truck = &batch.truck[env];
                later += usize::from(0 < truck.episode);
                let start = drawn_start(&world.params, 7, env as u32, truck.episode);
                let last = (world.routes[truck.route as usize].n_waypoints - 1) as f32;
                assert_eq!(batch.progress[env].waypoint, (start.along * last).round() as u32 + 1, "{name}");
                assert!((0.0..0.8).contains(&start.along), "{name}: {start:?}");
                start.along
            };
            let fractions: Vec<f32> = begun.map(fraction).collect();
            if fractions.len() == n_envs {
                // Uniform numbers below 0.8: their mean of 2048 deviates by 0.005.
                let mean = fractions.iter().sum::<f32>() / n_envs as f32;
                assert!((mean - 0.4).abs() < 0.02, "{name}: {mean}");
            }
            simulator.step_at_random();
        }
        assert!(200 < later, "{name}: {later}");
    }
}
