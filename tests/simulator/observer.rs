//! An observer sees what the simulator sees, to the last bit, from poses in the map's frame.

use std::sync::Arc;

use glam::DVec2;
use offtrack::layout::{Control, Ended, Truck};
use offtrack::observer::{Observed, Observer, Pose, State, Telemetry};
use offtrack::scenario::Scenario;
use offtrack::simulator::{Batch, Error, RouteChoice, Simulator};
use offtrack::world::World;

use crate::benchmark;
use crate::left_hand::{left_hand, text, world};

/// A truck's pose on the map.
fn pose(observer: &Observer, truck: &Truck) -> Pose {
    let frame = observer.frame();
    Pose {
        position: frame.to_map(truck.position.as_dvec2()),
        heading: frame.angle(truck.heading.into()),
        trailer_heading: frame.angle(truck.trailer_heading.into()),
        speed: truck.speed,
    }
}

/// What its electronics say there.
fn telemetry(observer: &Observer, truck: &Truck, control: &Control) -> Telemetry {
    let side = |value: f32| observer.frame().angle(value.into()) as f32;
    Telemetry {
        steering: side(truck.steering),
        target_speed: control.target_speed,
        acceleration: truck.acceleration,
        lateral_acceleration: side(truck.lateral_acceleration),
        trailer_roll: side(truck.trailer_roll),
        trailer_roll_rate: side(truck.trailer_roll_rate),
        load_transfer_ratios: [truck.tractor_load_transfer_ratio, truck.trailer_load_transfer_ratio].map(side),
    }
}

/// An observer of each truck of a batch, at its start.
fn observers(world: &Arc<World>, batch: &Batch) -> Vec<Observer> {
    let observer = |(env, truck): (usize, &Truck)| {
        let mut observer = Observer::new(world.clone(), truck.route, truck.vehicle).unwrap();
        let seen = observer.begin(&pose(&observer, truck)).unwrap();
        assert_eq!(seen.values.map(f32::to_bits), batch.observation[env].map(f32::to_bits), "{truck:?}");
        assert_eq!((seen.extras, seen.progress), (batch.extras[env], batch.progress[env]));
        observer
    };
    batch.truck.iter().enumerate().map(observer).collect()
}

/// Drives trucks at random over every route of a world, each observed beside it; returns how many episodes ended.
fn compare(name: &str, world: &Arc<World>, n_trucks: usize) -> usize {
    let n_routes = world.routes.len() as u32;
    let routes = RouteChoice::Fixed((0..n_trucks as u32).map(|env| env % n_routes).collect());
    let mut simulator = Simulator::new(world.clone(), n_trucks, 3, routes).unwrap();
    let mut observers = observers(world, simulator.batch());
    let mut ends = 0;
    for step in 0..60 {
        let held: Vec<u32> = simulator.batch().truck.iter().map(|truck| truck.held).collect();
        simulator.step_at_random();
        let batch = simulator.batch();
        for env in (0..n_trucks).filter(|&env| held[env] == 0) {
            let (observer, truck) = (&mut observers[env], &batch.truck[env]);
            let telemetry = telemetry(observer, truck, &batch.control[env]);
            let seen = observer.observe(&pose(observer, truck), &telemetry).unwrap();
            let place = format!("{name}, step {step}, {}", world.route_names[truck.route as usize]);
            assert_eq!(seen.values.map(f32::to_bits), batch.next_observation[env].map(f32::to_bits), "{place}");
            assert_eq!(seen.extras.map(f32::to_bits), batch.next_extras[env].map(f32::to_bits), "{place}");
            assert_eq!((seen.progress, seen.clearance), (batch.progress[env], batch.clearance[env]), "{place}");
            assert_eq!(seen.ended as u32, batch.ended[env], "{place}");
            ends += usize::from(seen.ended != Ended::Running);
        }
    }
    ends
}

#[test]
fn an_observer_sees_what_the_simulator_does_to_the_last_bit_on_every_route() {
    for (name, n_trucks) in [("attard2023", 300), ("laden2026", 300), ("maps2026", 300)] {
        let world = Arc::new(benchmark(name).1);
        assert!(100 < compare(name, &world, n_trucks), "{name}: hardly an episode ended");
    }
}

#[test]
fn on_a_left_hand_road_an_observer_sees_from_the_map_what_the_simulator_sees_in_the_mirror_image() {
    let folder = tempfile::tempdir().unwrap();
    let worlds = [text("16m-maps"), left_hand(&text("16m-maps"))].map(|text| world(folder.path(), &text, "solid").1);
    assert!(30 < compare("left", &worlds[1], 100));
    // The left-hand file is the right-hand road's mirror image: so is a pose there.
    let [mut right, mut left] = worlds.map(|world| Observer::new(world, 3, 0).unwrap());
    let start = right.waypoints().nth(8).unwrap();
    let at = |side: f64| Pose {
        position: DVec2::new(start.0.x - 1.0, side * start.0.y),
        heading: side * (start.1 + 0.1),
        trailer_heading: side * start.1,
        speed: 7.0,
    };
    let turned = |side: f32| Telemetry { steering: 0.2 * side, ..Telemetry::default() };
    let seen = [right.observe(&at(1.0), &turned(1.0)), left.observe(&at(-1.0), &turned(-1.0))].map(Result::unwrap);
    assert_eq!(seen[0], seen[1]);
    assert!((7..12).contains(&seen[0].progress.waypoint), "{:?}", seen[0].progress);
    let [there, here] = [&right, &left].map(|observer| observer.command(0, 0.0).unwrap());
    assert_eq!((there.steering, there.speed), (-here.steering, here.speed));
}

/// CARLA's own library has this point, 10 m along a lane of the map, on the centre of the lane.
#[test]
fn a_truck_on_a_lane_centre_of_the_map_is_on_the_lane_centre_of_its_route() {
    let (_, world) = benchmark("maps2026");
    let route = world.route_names.iter().position(|name| name == "town03/E-left-1").unwrap() as u32;
    let mut observer = Observer::new(Arc::new(world), route, 0).unwrap();
    assert_eq!(observer.frame().origin, DVec2::new(-0.4817, -0.265));
    let heading = 179.147_f64.to_radians();
    let back = 0.5 * f64::from(observer.rig().wheelbase) * DVec2::from_angle(heading);
    let position = DVec2::new(64.0475, 4.0220) - back;
    let seen = observer.begin(&Pose { position, heading, trailer_heading: heading, speed: 8.0 }).unwrap();
    assert!(seen.progress.lane_distance < 0.01, "{:?}", seen.progress);
    // A lane of 3.5 m leaves a truck of 2.55 m half a metre on each side.
    assert!(0.4 < seen.clearance.tractor && 0.4 < seen.clearance.trailer, "{:?}", seen.clearance);
}

/// An observer on a route, and a pose of its on a waypoint.
fn on_waypoint(world: &Arc<World>, waypoint: usize) -> (Observer, Pose) {
    let observer = Observer::new(world.clone(), 0, 0).unwrap();
    let (point, heading) = observer.waypoints().nth(waypoint).unwrap();
    let position = point - 0.5 * f64::from(observer.rig().wheelbase) * DVec2::from_angle(heading);
    (observer, Pose { position, heading, trailer_heading: heading, speed: 8.0 })
}

/// Whether all that a policy takes is finite and in range.
fn is_sound(seen: &Observed) -> bool {
    seen.values.iter().chain(&seen.extras).all(|value| (-1.001..=1.001).contains(value))
        && seen.clearance.tractor.is_finite()
        && seen.progress.lane_distance.is_finite()
}

#[test]
fn a_number_that_no_truck_can_have_is_refused_by_its_name_and_leaves_the_observer_as_it_was() {
    let world = Arc::new(benchmark("attard2023").1);
    let (mut observer, good) = on_waypoint(&world, 5);
    let first = observer.begin(&good).unwrap();
    for bad in [f64::NAN, f64::INFINITY, -1e9, 1e300] {
        for (name, pose) in [
            ("position[0]", Pose { position: DVec2::new(bad, 0.0), ..good }),
            ("position[1]", Pose { position: DVec2::new(0.0, bad), ..good }),
            ("heading", Pose { heading: bad, ..good }),
            ("trailer_heading", Pose { trailer_heading: bad, ..good }),
            ("speed", Pose { speed: bad as f32, ..good }),
        ] {
            let errors =
                [observer.begin(&pose), observer.observe(&pose, &Telemetry::default())].map(Result::unwrap_err);
            for error in errors {
                assert!(error.to_string().starts_with(&format!("{name}: ")), "{error}");
            }
        }
        let bad = bad as f32;
        for (name, telemetry) in [
            ("steering", Telemetry { steering: bad, ..Telemetry::default() }),
            ("target_speed", Telemetry { target_speed: bad, ..Telemetry::default() }),
            ("acceleration", Telemetry { acceleration: bad, ..Telemetry::default() }),
            ("lateral_acceleration", Telemetry { lateral_acceleration: bad, ..Telemetry::default() }),
            ("trailer_roll", Telemetry { trailer_roll: bad, ..Telemetry::default() }),
            ("trailer_roll_rate", Telemetry { trailer_roll_rate: bad, ..Telemetry::default() }),
            ("load_transfer_ratios[0]", Telemetry { load_transfer_ratios: [bad, 0.0], ..Telemetry::default() }),
            ("load_transfer_ratios[1]", Telemetry { load_transfer_ratios: [0.0, bad], ..Telemetry::default() }),
        ] {
            let error = observer.observe(&good, &telemetry).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{name}: ")) && error.contains("; must lie in "), "{error}");
        }
        assert!(observer.speed_control(bad, 1.0).is_err() && observer.speed_control(1.0, bad).is_err());
    }
    assert!(matches!(observer.command(99, 1.0), Err(Error::UnknownAction { action: 99, .. })));
    assert!(matches!(Observer::new(world.clone(), 999, 0), Err(Error::UnknownRoute { .. })));
    assert!(matches!(Observer::new(world, 0, 9), Err(Error::UnknownVehicle { .. })));
    assert_eq!(observer.begin(&good).unwrap(), first);
}

#[test]
fn an_odd_pose_that_a_truck_can_have_gives_a_sound_observation() {
    let world = Arc::new(benchmark("laden2026").1);
    let (mut observer, good) = on_waypoint(&world, 5);
    let turns = Pose { heading: good.heading + 400.0 * std::f64::consts::PI, ..good };
    let (seen, turned) = (observer.begin(&good).unwrap(), observer.begin(&turns).unwrap());
    // Headings and articulation; a ray that grazes a kerb may be longer by more.
    let apart = |index: usize| (seen.values[index] - turned.values[index]).abs();
    assert!((11..22).all(|index| apart(index) < 1e-6), "{seen:?}, {turned:?}");
    let folded = Pose { trailer_heading: good.heading + 170_f64.to_radians(), ..good };
    assert!(is_sound(&observer.begin(&folded).unwrap()));
    let seen = observer.observe(&folded, &Telemetry::default()).unwrap();
    assert!(is_sound(&seen) && matches!(seen.ended, Ended::Jackknifed | Ended::TrailerCollided), "{seen:?}");
    for pose in [
        Pose { position: DVec2::splat(9e3), ..good },
        Pose { speed: -900.0, ..good },
        Pose { heading: good.heading + std::f64::consts::PI, ..good },
    ] {
        assert!(is_sound(&observer.begin(&pose).unwrap()), "{pose:?}");
        let hard = Telemetry { steering: 1.5, trailer_roll: 1e5, acceleration: -1e6, ..Telemetry::default() };
        assert!(is_sound(&observer.observe(&pose, &hard).unwrap()), "{pose:?}");
    }
}

#[test]
fn the_end_of_an_episode_stands_until_another_begins_and_the_first_pose_begins_one() {
    let world = Arc::new(benchmark("attard2023").1);
    let (mut observer, good) = on_waypoint(&world, 5);
    let aside = Pose { position: good.position + 40.0 * DVec2::from_angle(good.heading).perp(), ..good };
    let telemetry = Telemetry::default();
    let seen = observer.observe(&good, &telemetry).unwrap();
    assert_eq!((seen.progress.passed, seen.ended), (0, Ended::Running));
    let ended = observer.observe(&aside, &telemetry).unwrap().ended;
    assert!(ended.failed());
    let back = observer.observe(&good, &telemetry).unwrap();
    assert!(back.ended == ended && 0.0 < back.clearance.tractor);
    assert_eq!(observer.begin(&good).unwrap().ended, Ended::Running);
    let limit = world.step_limits[0];
    let last = (0..=limit).map(|_| observer.observe(&good, &telemetry).unwrap().ended).last().unwrap();
    assert_eq!(last, Ended::TimedOut);
}

#[test]
fn an_observer_goes_on_from_the_state_of_another_and_refuses_one_that_no_observer_has() {
    let world = Arc::new(benchmark("attard2023").1);
    let (mut one, good) = on_waypoint(&world, 5);
    one.begin(&good).unwrap();
    let ahead = Pose { position: good.position + 5.0 * DVec2::from_angle(good.heading), ..good };
    one.observe(&ahead, &Telemetry::default()).unwrap();
    one.speed_control(8.0, 8.2).unwrap();
    let mut other = Observer::new(world.clone(), 0, 0).unwrap();
    other.restore(&one.state()).unwrap();
    // Back at the first place: another waypoint than a new observer would have next.
    let seen = [&mut one, &mut other].map(|observer| observer.observe(&good, &Telemetry::default()).unwrap());
    assert_eq!(seen[0], seen[1]);
    assert!(on_waypoint(&world, 5).0.begin(&good).unwrap().progress.waypoint < seen[1].progress.waypoint);
    assert_eq!(one.speed_control(8.0, 8.2).unwrap(), other.speed_control(8.0, 8.2).unwrap());
    let state = other.state();
    assert!(other.restore(&State { waypoint: Some(9_999), ..state }).is_err());
    assert!(other.restore(&State { speed_error_integral: f32::NAN, ..state }).is_err());
    assert_eq!(other.state(), state);
}

#[test]
fn a_truck_where_a_route_passes_a_place_twice_begins_near_the_waypoint_that_is_known() {
    let world = Arc::new(benchmark("maps2026").1);
    let route = world.route_names.iter().position(|name| name == "town03/N-left-1").unwrap() as u32;
    let mut observer = Observer::new(world, route, 0).unwrap();
    // Beside the lane, toward where the route comes back.
    let (point, heading) = observer.waypoints().nth(24).unwrap();
    let (along, half) = (DVec2::from_angle(heading), 0.5 * f64::from(observer.rig().wheelbase));
    let position = point - half * along - 0.8 * along.perp();
    let pose = Pose { position, heading, trailer_heading: heading, speed: 8.0 };
    let next = |seen: Result<Observed, Error>| seen.unwrap().progress.waypoint;
    assert!(80 < next(observer.begin(&pose)));
    for known in [24, 25, 12, 40] {
        assert_eq!(next(observer.begin_near(&pose, known)), 25);
    }
    assert!(80 < next(observer.begin_near(&pose, 90)));
    let before = observer.state();
    let error = observer.begin_near(&pose, 9_999).unwrap_err().to_string();
    assert!(error.contains("waypoint") && error.contains("9999"), "{error}");
    assert_eq!(observer.state(), before);
}

#[test]
fn the_speed_control_asks_for_what_the_simulators_does_to_the_last_bit() {
    let world = Arc::new(World::bake(&Scenario::named("laden2026").unwrap()).unwrap());
    let n_actions = world.actions.len() as u32;
    let mut simulator = Simulator::new(world.clone(), 8, 1, RouteChoice::Fixed(vec![0; 8])).unwrap();
    let mut observers = observers(&world, simulator.batch());
    for step in 0..30 {
        let trucks = simulator.batch().truck.clone();
        let actions: Vec<u32> = (0..8).map(|env| (4 + 9 * (step / 8 + env)) % n_actions).collect();
        simulator.step(&actions).unwrap();
        for env in (0..8).filter(|&env| trucks[env].held == 0) {
            let (control, observer) = (simulator.batch().control[env], &mut observers[env]);
            let target = observer.command(actions[env], trucks[env].speed).unwrap();
            assert_eq!((target.steering, target.speed), (control.steering, control.target_speed));
            let acceleration = observer.speed_control(trucks[env].speed, target.speed).unwrap();
            assert_eq!(acceleration.to_bits(), control.acceleration.to_bits(), "step {step}, truck {env}");
        }
    }
}

#[test]
fn an_observation_allocates_nothing() {
    let world = Arc::new(benchmark("attard2023").1);
    let (mut observer, pose) = on_waypoint(&world, 5);
    let telemetry = Telemetry::default();
    let observing = allocation_counter::measure(|| {
        observer.begin(&pose).unwrap();
        (0..100).for_each(|_| assert_eq!(observer.observe(&pose, &telemetry).unwrap().ended, Ended::Running));
    });
    assert_eq!(observing.count_total, 0);
    let collecting = allocation_counter::measure(|| drop(observer.waypoints().collect::<Vec<_>>()));
    assert!(0 < collecting.count_total, "the counter counts");
}

#[test]
fn a_benchmark_with_its_vehicles_as_their_files_have_them_draws_no_dimension() {
    let scenario = Scenario::named("laden2026").unwrap().typical();
    let (table, typical) = (scenario.vehicles(), scenario.typical_rigs(0.05));
    for (class, rig) in typical.iter().enumerate() {
        let rows: Vec<_> = table.iter().filter(|entry| entry.class == class).collect();
        assert!(!rows.is_empty() && rows.len() < 10);
        assert!(rows.iter().all(|row| row.vehicle.trailer.wheelbase as f32 == rig.trailer_wheelbase));
    }
}

#[test]
fn kerbs_and_waypoints_in_the_maps_frame_are_those_that_are_driven_between() {
    let folder = tempfile::tempdir().unwrap();
    let (scenario, left) = world(folder.path(), &left_hand(&text("16m")), "drivable");
    let (maps, on_map) = benchmark("maps2026");
    for (scenario, world) in [(scenario, left), (maps, Arc::new(on_map))] {
        let place = &scenario.places[0];
        let (observer, kerbs) = (Observer::new(world, 0, 0).unwrap(), place.roundabout.kerbs(scenario.gutter));
        let (frame, lines) = (observer.frame(), place.roundabout.kerb_lines(scenario.gutter));
        assert!(frame.mirrored || frame.origin != DVec2::ZERO);
        assert_eq!(lines.len(), kerbs.loops.len());
        for (line, kerb) in lines.iter().zip(&kerbs.loops) {
            assert!(line.iter().all(|&p| kerb.distance(frame.to_driven(p)) < 1e-6));
            let area = |(a, b): (&DVec2, &DVec2)| 0.5 * a.perp_dot(*b);
            let enclosed: f64 = line.iter().zip(line.iter().cycle().skip(1)).map(area).sum();
            assert!((enclosed - kerb.signed_area()).abs() < 0.01 * enclosed.abs(), "the drivable side is on the left");
        }
        let route = &place.routes[0];
        for ((p, heading), waypoint) in observer.waypoints().zip(&route.waypoints) {
            assert!(frame.to_driven(p).distance(waypoint.position) < 1e-4);
            assert!((frame.angle(heading) - waypoint.heading).abs() < 1e-6);
        }
        assert_eq!(observer.waypoints().count(), route.waypoints.len());
    }
}
