//! Speeds as actions: targets, changes of a target, stop and go, the speed at the start, and the clock.

use std::sync::Arc;

use offtrack::layout::{Action, Start, Truck};
use offtrack::scenario::{Clock, Scenario};
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::vehicle::Model;
use offtrack::vehicle::profile::Profile;
use offtrack::world::World;

use crate::fleet::all_drawn;
use crate::{batch_on, benchmark, engines};

const KMH: f64 = 1.0 / 3.6;

fn world(change: impl FnOnce(&mut Scenario)) -> Arc<World> {
    let mut scenario = benchmark("attard2023").0;
    scenario.load = "laden".to_owned();
    change(&mut scenario);
    Arc::new(World::bake(&scenario).unwrap())
}

/// The truck on route 3 after each of these actions, from the lane's centre.
fn driven(simulator: &mut Simulator, actions: impl IntoIterator<Item = u32>) -> Vec<Truck> {
    let step = |action| {
        simulator.step(&[action]).unwrap();
        simulator.batch().truck[0]
    };
    actions.into_iter().map(step).collect()
}

#[test]
fn a_target_of_0_stops_the_truck_and_holds_it_until_another_is_asked_for() {
    for lags in [false, true] {
        let world = world(|scenario| {
            (scenario.speeds, scenario.time_limit) = (Vec::from([0.0, 20.0 * KMH]), 20.0);
            if lags {
                scenario.vehicle.model = Model { drive_lag: 0.6, brake_lag: 0.5, yaw_lag: 1.0, ..Model::default() };
            }
        });
        for (name, engine) in engines() {
            let mut simulator = batch_on(&engine, &world, 1, 0, RouteChoice::Fixed(vec![3]));
            let trucks = driven(&mut simulator, std::iter::repeat_n(4, 80));
            let speeds: Vec<f32> = trucks.iter().map(|truck| truck.speed).collect();
            assert!(speeds.windows(2).all(|pair| pair[1] <= pair[0]), "{name}: {speeds:?}");
            let stopped = speeds.iter().position(|&speed| speed == 0.0).unwrap_or_else(|| panic!("{name}: {speeds:?}"));
            assert!(stopped < 60 && speeds[stopped..].iter().all(|&speed| speed == 0.0), "{name}: {speeds:?}");
            assert!(
                trucks[stopped..]
                    .iter()
                    .all(|truck| truck.position == trucks[79].position && truck.acceleration == 0.0)
            );
            let trucks = driven(&mut simulator, std::iter::repeat_n(13, 60));
            assert!(1.0 < trucks[59].speed && trucks[0].position != trucks[59].position, "{name}");
        }
    }
}

#[test]
fn brakes_that_act_late_do_not_drive_a_truck_backwards() {
    let world = world(|scenario| {
        (scenario.speeds, scenario.time_limit) = (Vec::from([2.0 * KMH, 30.0 * KMH]), 20.0);
        scenario.vehicle.model = Model { drive_lag: 2.0, brake_lag: 2.0, ..Model::default() };
        scenario.start_speed = Some([30.0 * KMH; 2]);
    });
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 1, 0, RouteChoice::Fixed(vec![3]));
        let speeds: Vec<f32> =
            driven(&mut simulator, std::iter::repeat_n(4, 150)).iter().map(|truck| truck.speed).collect();
        // It brakes on beyond 2 km/h, comes to a stop, and sets out again.
        assert!(speeds.iter().all(|&speed| 0.0 <= speed), "{name}: {speeds:?}");
        let stopped = speeds.iter().position(|&speed| speed < 0.01).unwrap_or_else(|| panic!("{name}: {speeds:?}"));
        assert!(speeds[stopped..].iter().any(|&speed| 0.1 < speed), "{name}: {speeds:?}");
    }
}

#[test]
fn an_action_may_change_the_target_speed_within_its_bounds() {
    let world = world(|scenario| {
        scenario.speeds = Vec::from([10.0 * KMH, 20.0 * KMH]);
        scenario.speed_changes = [-4.0, 0.0, 4.0].map(|change| change * KMH).into();
        scenario.start_speed = Some([15.0 * KMH; 2]);
    });
    assert_eq!(
        (world.params.n_actions, world.actions[4].speed, world.params.changes_speed),
        (27, (-4.0 * KMH) as f32, 1)
    );
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 1, 0, RouteChoice::Fixed(vec![3]));
        let mut target = |action: u32| {
            simulator.step(&[action]).unwrap();
            f64::from(simulator.batch().control[0].target_speed) / KMH
        };
        for (action, expected) in
            [(13, 15.0), (22, 19.0), (22, 20.0), (4, 16.0), (4, 12.0), (4, 10.0), (13, 10.0), (22, 14.0)]
        {
            let found = target(action);
            assert!((found - expected).abs() < 1e-4, "{name}: {found} km/h, expected {expected}");
        }
    }
}

#[test]
fn trucks_begin_at_speeds_of_the_stated_range() {
    let world = world(|scenario| {
        scenario.speeds = Vec::from([10.0 * KMH, 30.0 * KMH]);
        scenario.start_speed = Some([5.0 * KMH, 25.0 * KMH]);
    });
    for (name, engine) in engines() {
        let choice = RouteChoice::Drawn((0..world.routes.len() as u32).collect());
        let mut simulator = batch_on(&engine, &world, 1024, 3, choice);
        let speeds: Vec<f64> = simulator.batch().truck.iter().map(|truck| f64::from(truck.speed) / KMH).collect();
        assert!(speeds.iter().all(|speed| (4.999..=25.001).contains(speed)), "{name}");
        // The mean of 1024 uniform numbers of a range of 20 deviates by 0.18.
        let mean = speeds.iter().sum::<f64>() / 1024.0;
        assert!((mean - 15.0).abs() < 0.6 && speeds.iter().any(|&speed| speed < 6.0), "{name}: {mean}");
        assert!(
            simulator
                .batch()
                .control
                .iter()
                .zip(&simulator.batch().truck)
                .all(|(control, truck)| control.target_speed == truck.speed)
        );
        let fastest = Start { speed: 1.0, ..Start::default() };
        simulator.reset_from(&[fastest; 1024]).unwrap();
        assert!((f64::from(simulator.batch().truck[9].speed) / KMH - 25.0).abs() < 1e-4, "{name}");
    }
}

#[test]
fn the_clock_counts_against_the_feasible_time_of_the_vehicle_on_the_route() {
    let change = |scenario: &mut Scenario| {
        (scenario.fleet, scenario.speeds, scenario.time_limit) = (Some(all_drawn()), Vec::from([0.0, 50.0 * KMH]), 2.0);
        scenario.start_speed = Some([5.0 * KMH; 2]);
    };
    let highest = world(change);
    let feasible = world(|scenario| {
        change(scenario);
        scenario.clock = Clock::Feasible;
    });
    let limit = |world: &World, route: u32, class: u32| world.step_limits[(route * 8 + class) as usize];
    for route in 0..feasible.routes.len() as u32 {
        // At the highest speed all are equal; a loaded vehicle takes longer than an empty one, and all longer than
        // that.
        assert!((0..8).all(|class| limit(&highest, route, class) == limit(&highest, route, 0)));
        assert!(limit(&highest, route, 0) < limit(&feasible, route, 0), "{route}");
        assert!((0..3).all(|class| limit(&feasible, route, class) <= limit(&feasible, route, class + 1)), "{route}");
    }
    let typical = offtrack::vehicle::Vehicle {
        model: all_drawn().members[0].vehicle.model.clone(),
        ..crate::physics::vehicle("daf_xf")
    };
    let time = Profile::of(&typical.rig("laden", 0.05, None), feasible.route_waypoints(5), 50.0 * KMH).time;
    assert_eq!(limit(&feasible, 5, 2), (2.0 * time / 0.1).ceil() as u32);
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &feasible, 64, 3, RouteChoice::Fixed(vec![5; 64]));
        // The trucks stand, and each runs out of time by its own clock.
        (0..900).for_each(|_| simulator.step(&[4; 64]).unwrap());
        let batch = simulator.batch();
        let timed_out = |env: usize| batch.ended[env] == offtrack::layout::Ended::TimedOut as u32;
        assert!(
            (0..64).all(|env| timed_out(env) && batch.truck[env].steps == feasible.step_limit(&batch.truck[env]) + 1),
            "{name}"
        );
    }
}

#[test]
fn the_steps_of_a_standing_truck_run_out() {
    let world = world(|scenario| (scenario.speeds, scenario.time_limit) = (Vec::from([0.0, 30.0 * KMH]), 1.0));
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 1, 0, RouteChoice::Fixed(vec![3]));
        let limit = world.step_limit(&Truck { route: 3, ..Truck::default() });
        driven(&mut simulator, std::iter::repeat_n(4, limit as usize + 1));
        assert_eq!(simulator.batch().ended[0], offtrack::layout::Ended::TimedOut as u32, "{name}");
    }
}

#[test]
fn the_action_table_has_steer_levels_times_speeds_or_changes() {
    let (mut scenario, _) = benchmark("attard2023");
    (scenario.steer_max, scenario.speeds) = (Some(1.0), Vec::from([3.0, 5.0]));
    assert_eq!(scenario.actions()[9], Action { steering: -0.8, speed: 5.0 });
    scenario.speed_changes = Vec::from([-1.0, 0.0, 1.0]);
    let actions = scenario.actions();
    assert_eq!((actions.len(), actions[26]), (27, Action { steering: 0.8, speed: 1.0 }));
}
