//! Batches and scenarios that are refused: too large for the memory, or with values that no truck could be stepped
//! with.

use std::path::Path;
use std::sync::Arc;

use offtrack::files::cache::Loading;
use offtrack::layout::{Column, Stream};
use offtrack::scenario::{ActionKind, Scenario};
use offtrack::simulator::{Begin, Error, RouteChoice, Simulator};
use offtrack::world::World;

use crate::benchmark;

#[test]
fn a_batch_too_large_for_the_memory_is_refused_with_its_size_and_what_would_fit() {
    let world = Arc::new(benchmark("attard2023").1);
    let width: usize = Column::of_trucks().map(|column| column.width()).sum();
    let new = |n_envs| Simulator::new(world.clone(), n_envs, 0, RouteChoice::Drawn(vec![0]));
    for n_envs in [1 << 40, 1 << 62, usize::MAX] {
        let error = new(n_envs).unwrap_err();
        let Error::BatchTooLarge { n_envs: found, n_bytes, fitting } = error else { panic!("{error}") };
        assert_eq!((found, n_bytes), (n_envs, n_envs as u128 * width as u128));
        assert!(1_000 < fitting && fitting < 1 << 32, "{fitting}");
        let message = error.to_string();
        assert!(
            [n_envs.to_string(), n_bytes.to_string(), fitting.to_string()].iter().all(|part| message.contains(part)),
            "{message}"
        );
    }
    // More than the machine has, less than it grants: filling the columns would end the process.
    let Err(Error::BatchTooLarge { fitting, .. }) = new(1 << 40) else { panic!() };
    assert!(matches!(new(2 * fitting as usize), Err(Error::BatchTooLarge { .. })));
}

#[test]
fn a_truck_that_is_to_begin_twice_at_once_is_refused_and_leaves_the_batch() {
    let world = Arc::new(benchmark("attard2023").1);
    let mut simulator = Simulator::new(world, 2, 0, RouteChoice::Drawn(vec![0])).unwrap();
    let before = simulator.batch().clone();
    let of = |env: usize| Begin { env, ..Begin::default() };
    let error = simulator.begin(&[of(1), Begin { stream: Some(Stream { seed: 5, env: 7 }), ..of(1) }]).unwrap_err();
    assert_eq!(error, Error::RepeatedTruck { position: 1, index: 1 });
    assert!(simulator.batch().columns() == before.columns());
    assert_eq!(simulator.streams()[1], Stream { seed: 0, env: 1 });
}

#[test]
fn gathering_more_rows_than_fit_is_refused_and_leaves_the_batch() {
    let world = Arc::new(benchmark("attard2023").1);
    let mut simulator = Simulator::new(world, 2, 0, RouteChoice::Drawn(vec![0])).unwrap();
    assert_eq!(simulator.gather(&[0, 2]).unwrap_err(), Error::UnknownTruck { position: 1, index: 2, n_envs: 2 });
    assert_eq!(simulator.n_envs(), 2);
}

fn scenario() -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/attard2023.toml");
    Scenario::read(&path).unwrap()
}

/// The message about a scenario after a change.
fn refused(change: impl FnOnce(&mut Scenario)) -> String {
    let mut scenario = scenario();
    change(&mut scenario);
    World::bake(&scenario).map(|_| "accepted".to_owned()).unwrap_or_else(|error| error.to_string())
}

#[test]
fn a_scenario_changed_in_memory_is_checked_before_it_is_baked() {
    assert_eq!(refused(|_| ()), "accepted");
    assert!(
        refused(|scenario| scenario.load = "feathers".to_owned()).starts_with("load: \"feathers\"; the vehicle has ")
    );
    assert_eq!(refused(|scenario| scenario.speeds.clear()), "speeds: empty; at least one value is needed");
    assert_eq!(refused(|scenario| scenario.steer_levels.clear()), "steer_levels: empty; at least one value is needed");
    let continuous = refused(|scenario| scenario.action_kind = ActionKind::Continuous);
    assert_eq!(continuous, "steer_levels: 9 values; continuous actions have none");
    assert_eq!(refused(|scenario| scenario.speeds[0] = f64::NAN), "speeds[0]: NaN; must lie in 0..100");
    assert!(refused(|scenario| scenario.places.clear()).starts_with("places: no routes; "));
    assert!(refused(|scenario| scenario.places[0].routes[0].waypoints.truncate(1)).contains("1 waypoints; at least 2"));
    assert!(refused(|scenario| scenario.n_substeps = 0).starts_with("n_substeps: 0; "));
    let coarse = refused(|scenario| (scenario.step, scenario.n_substeps) = (1.0, 1));
    assert_eq!(coarse, "n_substeps: 1; must lie in 2..1000");
    assert_eq!(refused(|scenario| scenario.n_substeps = 101), "n_substeps: 101; must lie in 1..100");
    let traffic = Scenario::named("traffic2026").unwrap().traffic;
    let slow = refused(|scenario| (scenario.step, scenario.traffic) = (0.2, traffic));
    assert_eq!(slow, "step: 0.2; 0.1 with traffic: so long are its steps");
    let near = refused(|scenario| scenario.stray_distance = 0.5);
    assert!(near.starts_with("stray_distance: 0.5; at least spacing, "), "{near}");
    assert!(refused(|scenario| scenario.cell = 1e-9).starts_with("cell: 0.000000001; "));
    let short =
        refused(|scenario| (scenario.vehicle.trailer.wheelbase, scenario.vehicle.model.slip_lever) = (3.766, 9.0));
    assert_eq!(short, "vehicle.model.slip_lever: 9; must lie in 0..3.756");
    let rigid = refused(|scenario| scenario.vehicle.tractor.suspension.roll_gain = 0.0);
    assert!(rigid.starts_with("vehicle.tractor.suspension.roll_gain: 0; must lie in 0.000001.."), "{rigid}");
}

#[test]
fn a_benchmark_without_routes_is_named_in_the_error() {
    let message = refused(|scenario| scenario.places.clear());
    assert!(message.contains("the file of attard2023 must list some"), "{message}");
}

#[test]
fn brakes_that_drive_and_a_drive_that_brakes_are_refused() {
    let braking = refused(|scenario| scenario.vehicle.speed_control.braking = 0.5);
    assert!(braking.starts_with("vehicle.speed_control.braking: 0.5; must lie in "), "{braking}");
    let drive = refused(|scenario| scenario.vehicle.loads.get_mut("empty").unwrap().acceleration_max = -1.0);
    assert!(drive.starts_with("vehicle.loads.empty.acceleration_max: -1; must lie in "), "{drive}");
}

#[test]
fn a_number_of_a_scenario_that_is_not_one_is_refused_by_its_name() {
    type Field = (&'static str, fn(&mut Scenario) -> &mut f64);
    let fields: [Field; 23] = [
        ("step", |s| &mut s.step),
        ("cell", |s| &mut s.cell),
        ("spacing", |s| &mut s.spacing),
        ("steer_max", |s| s.steer_max.insert(0.0)),
        ("steer_levels[0]", |s| &mut s.steer_levels[0]),
        ("sensor_range", |s| &mut s.sensor_range),
        ("start_offset", |s| &mut s.start_offset),
        ("start_heading", |s| &mut s.start_heading),
        ("start_along", |s| &mut s.start_along),
        ("stray_distance", |s| &mut s.stray_distance),
        ("jackknife_angle", |s| &mut s.jackknife_angle),
        ("rollover_ratio", |s| &mut s.rollover_ratio),
        ("time_limit", |s| &mut s.time_limit),
        ("reward.waypoint", |s| &mut s.reward.waypoint),
        ("reward.lane_distance", |s| &mut s.reward.lane_distance),
        ("reward.lane_distance_limit", |s| &mut s.reward.lane_distance_limit),
        ("reward.clearance", |s| &mut s.reward.clearance),
        ("reward.clearance_limit", |s| &mut s.reward.clearance_limit),
        ("reward.failure", |s| &mut s.reward.failure),
        ("vehicle.tractor.wheelbase", |s| &mut s.vehicle.tractor.wheelbase),
        ("vehicle.trailer.kingpin_to_rear", |s| &mut s.vehicle.trailer.kingpin_to_rear),
        ("vehicle.tractor.suspension.track", |s| &mut s.vehicle.tractor.suspension.track),
        ("vehicle.speed_control.gain", |s| &mut s.vehicle.speed_control.gain),
    ];
    let mut scenario = scenario();
    for (name, field) in fields {
        let lock = scenario.steer_max;
        for wrong in [f64::NAN, f64::INFINITY, 1e308] {
            let before = std::mem::replace(field(&mut scenario), wrong);
            let error = scenario.check().unwrap_err();
            assert_eq!(error.key, name, "{error}");
            *field(&mut scenario) = before;
            scenario.steer_max = lock;
        }
    }
    assert!(scenario.check().is_ok());
}

#[test]
fn keys_of_a_file_that_exclude_each_other_are_refused_with_what_would_do() {
    let read = |change: [&str; 2]| {
        let text = Scenario::text_of("attard2023").unwrap();
        let changed = text.replacen(change[0], &format!("{}\n\n{}", change[1], change[0]), 1);
        Scenario::parse("own", &changed, None, &Loading::PLAIN).map(|_| ()).unwrap_err().to_string()
    };
    let near = read(["[reward]", "[routes]\nspacing = 5.0\n\n[ending]\nstray_distance = 3.0"]);
    assert!(near.contains("ending.stray_distance: 3 m; must be at least routes.spacing, 5 m"), "{near}");
    let coarse = read(["[reward]", "[time]\nstep = 1.0\nsubsteps = 1"]);
    assert!(coarse.contains("time.substeps: 1; must lie in 2..100: "), "{coarse}");
    let many = read(["[reward]", "[time]\nstep = 1.0\nsubsteps = 101"]);
    assert!(many.contains("time.substeps: 101; must lie in 1..100"), "{many}");
}
