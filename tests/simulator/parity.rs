//! The device against the CPU, stage by stage and step by step: from the same states, value by value.

mod apron;
mod around;
mod compare;
mod states;
mod vehicles;

use std::sync::Arc;

use glam::Vec2;
use offtrack::engine::stages::{STAGES, Stage};
use offtrack::layout::angle::wrapped;
use offtrack::layout::random::{Draw, index_below, signed_unit, words};
use offtrack::layout::{Column, Ended, Truck, WaypointRow};
use offtrack::map::Gutter;
use offtrack::physics::drive_max;
use offtrack::physics::reference_point;
use offtrack::simulator::{Batch, RouteChoice, Simulator};
use offtrack::world::World;

use crate::on_device::engine;
use crate::{batch_on, engines};
use compare::{Agreement, agreements, written};
use states::{
    ENOUGH, N_ENVS, continuous_world, disturbed_world, fleet_world, late_continuous_world, on_each_roundabout, put,
    varied, world,
};

/// A quantity this near to a threshold may fall on either side of it within the engines' bounds.
const MARGIN: f32 = 1e-4;

fn simulators(world: &Arc<World>, choice: &RouteChoice) -> [Simulator; 2] {
    [
        Simulator::new(world.clone(), N_ENVS, 3, choice.clone()).unwrap(),
        batch_on(&engine(), world, N_ENVS, 3, choice.clone()),
    ]
}

/// A device that computes with a world that is wrong in one number.
fn wrong_device(world: &World, choice: &RouteChoice, change: fn(&mut World)) -> Simulator {
    let mut world = world.clone();
    change(&mut world);
    batch_on(&engine(), &Arc::new(world), N_ENVS, 3, choice.clone())
}

/// Whether a decision about a truck was closer than the margin, in the step or stage that led from `before` to `after`.
fn is_close_call(world: &World, before: &Batch, after: &Batch, env: usize) -> bool {
    let (params, truck, clearance) = (&world.params, &after.truck[env], &after.clearance[env]);
    let rig = world.rig(&before.truck[env]);
    let near = |value: f32, limit: f32| (value - limit).abs() < MARGIN;
    let point = reference_point(world.rig(truck).wheelbase, truck);
    let waypoints = world.route_waypoints(truck.route);
    // The waypoints that were passed, and the next one. A truck that begins again has passed none.
    let begins = before.truck[env].episode != truck.episode;
    let next = (if begins { after } else { before }).progress[env].waypoint;
    let tried = next as usize..waypoints.len().min(after.progress[env].waypoint as usize + 1);
    let at_a_line = waypoints.get(tried).unwrap_or_default().iter().any(|waypoint| {
        let offset = point - waypoint.position;
        near(offset.dot(waypoint.direction), 0.0) || near(offset.length(), params.stray_distance)
    });
    // By what has been asked for, which may be a command and late.
    let error = after.control[env].target_speed - before.truck[env].speed;
    let asked = rig.speed_gain * error;
    // Drive and brakes have lags of their own.
    let asks_for = after.control[env].acceleration;
    at_a_line
        || is_close_call_as_seen(world, after, env)
        || near(error.abs(), rig.speed_integral_band)
        || near(asked, rig.speed_braking)
        || near(asked, drive_max(rig, before.truck[env].speed))
        || (asks_for != 0.0 && near(asks_for, 0.0))
        || near(clearance.tractor, 0.0)
        || near(clearance.trailer, 0.0)
        || near(
            truck.tractor_load_transfer_ratio.abs().max(truck.trailer_load_transfer_ratio.abs()),
            params.rollover_ratio,
        )
        || near(wrapped(truck.heading - truck.trailer_heading).abs(), params.jackknife_angle)
        || near(after.progress[env].waypoint_distance, params.stray_distance)
}

/// Whether the truck as it is observed, on the route as it is taken to lie, was closer than the margin to a line that
/// it passes.
fn is_close_call_as_seen(world: &World, after: &Batch, env: usize) -> bool {
    let disturbances = &world.disturbances;
    if disturbances.of_observation == 0 {
        return false;
    }
    let (pose, truck) = (&after.poses[env][0], &after.truck[env]);
    let [_, x, y, _] = words(3, env as u32, truck.episode, Draw::Offsets as u32).map(signed_unit);
    let position = pose.position - disturbances.map_offset * Vec2::new(x, y);
    let point = reference_point(world.rig(truck).wheelbase, &Truck { position, heading: pose.heading, ..*truck });
    world.route_waypoints(truck.route).iter().any(|waypoint| {
        let offset = point - waypoint.position;
        let distance = offset.length();
        let is_near = distance < 2.0 * world.params.stray_distance;
        is_near
            && (offset.dot(waypoint.direction).abs() < MARGIN
                || (distance - world.params.stray_distance).abs() < MARGIN)
    })
}

/// Which trucks must agree: all but the few with a close call.
fn judged(world: &World, before: &Batch, after: &Batch) -> Vec<bool> {
    let judged: Vec<bool> = (0..N_ENVS).map(|env| !is_close_call(world, before, after, env)).collect();
    let left_out = judged.iter().filter(|judged| !**judged).count();
    assert!(200 * left_out < N_ENVS, "{left_out} of {N_ENVS} are left out");
    judged
}

/// The agreement of two batches in some columns.
fn compared(here: &Batch, there: &Batch, columns: &[Column], counted: &[bool]) -> Vec<Agreement> {
    columns.iter().flat_map(|&column| agreements(column, here.column(column), there.column(column), counted)).collect()
}

fn assert_agreement(what: &str, compared: &[Agreement]) {
    for agreement in compared {
        println!("{what} | {agreement}");
        assert!(agreement.holds(), "{what}: {agreement:?}");
    }
}

/// The rows of held trucks and the columns other than `written` are as they were.
fn assert_untouched(before: &Batch, after: &Batch, written: &[Column]) {
    for (column, bytes) in before.columns() {
        let now = after.column(column);
        assert!(written.contains(&column) || bytes == now, "{column:?}");
        let width = bytes.len() / N_ENVS;
        let held = (0..N_ENVS).filter(|&env| before.truck[env].held == 1);
        assert!(
            held.map(|env| env * width..(env + 1) * width).all(|row| bytes[row.clone()] == now[row]),
            "{column:?} of held trucks"
        );
    }
}

#[test]
fn every_stage_does_the_same_to_every_value_and_touches_no_other() {
    let worlds = [
        (world(Gutter::Drivable), false),
        (world(Gutter::Solid), true),
        (fleet_world(), false),
        (disturbed_world(), false),
        (continuous_world(), false),
    ];
    for (world, fixed) in worlds {
        let (choice, mut before) = varied(&world, fixed);
        let counts = on_each_roundabout(&world, &before);
        assert!(counts.len() == 5 && counts.iter().all(|&count| ENOUGH <= count), "{counts:?}");
        assert_eq!(before.truck.iter().filter(|truck| truck.held == 1).count(), if fixed { N_ENVS / 16 } else { 0 });
        let [mut cpu, mut device] = simulators(&world, &choice);
        for stage in STAGES {
            let (name, (written, change)) = (stage.name(), written(stage));
            for simulator in [&mut cpu, &mut device] {
                put(simulator, &before);
                simulator.run_stage(stage);
            }
            let here = cpu.batch();
            let counted = judged(&world, &before, here);
            let fails =
                |there: &Batch| compared(here, there, written, &counted).iter().any(|agreement| !agreement.holds());
            assert!(written.is_empty() || fails(&before), "{name}: a stage that changes nothing would pass");
            // On fixed routes no truck begins another episode.
            if let (false, Some(change)) = (fixed, change) {
                let mut wrong = wrong_device(&world, &choice, change);
                put(&mut wrong, &before);
                wrong.run_stage(stage);
                assert!(fails(wrong.batch()), "{name}: a number off by a thousandth would pass");
            }
            assert_agreement(name, &compared(here, device.batch(), written, &counted));
            assert_untouched(&before, here, written);
            assert_untouched(&before, device.batch(), written);
            before = here.clone();
        }
        let [here, there] = [&cpu, &device].map(|simulator| simulator.tally().unwrap());
        assert_eq!(here, there);
        assert_eq!(here.env_steps() as usize, before.truck.len() - if fixed { N_ENVS / 16 } else { 0 });
    }
}

/// A number of the world, a stage that notices it to be off, and a change of it.
type Noticed = (&'static str, Stage, fn(&mut World));

/// Numbers that a device computes with.
const NOTICED: [Noticed; 14] = [
    ("slip_growth", Stage::Drive, |world| world.rigs.iter_mut().for_each(|rig| rig.slip_growth *= 1.01)),
    ("understeer", Stage::Drive, |world| world.rigs.iter_mut().for_each(|rig| rig.understeer *= 1.01)),
    ("fifth_wheel_load", Stage::Drive, |world| world.rigs.iter_mut().for_each(|rig| rig.fifth_wheel_load *= 1.01)),
    ("yaw_lag", Stage::Drive, |world| world.rigs.iter_mut().for_each(|rig| rig.yaw_lag *= 1.01)),
    ("steer_delay", Stage::Drive, |world| {
        world.rigs.iter_mut().for_each(|rig| rig.steer_delay = rig.steer_delay.max(5) - 1)
    }),
    ("position_offset", Stage::Follow, |world| world.disturbances.position_offset *= 1.01),
    ("heading_offset", Stage::Follow, |world| world.disturbances.heading_offset *= 1.01),
    ("position_noise", Stage::Follow, |world| world.disturbances.position_noise *= 1.01),
    ("heading_noise", Stage::Follow, |world| world.disturbances.heading_noise *= 1.01),
    ("observation_delay", Stage::Follow, |world| world.disturbances.n_observation_delays -= 1),
    ("range_noise", Stage::Sense, |world| world.disturbances.range_noise *= 1.01),
    ("dropped_rays", Stage::Sense, |world| world.disturbances.dropped_rays *= 1.1),
    ("map_offset", Stage::Observe, |world| world.disturbances.map_offset *= 1.01),
    ("action_delay", Stage::Steer, |world| world.disturbances.n_action_delays -= 1),
];

/// Asserts that a stage on the device agrees with the CPU engine's from these states, and does not with the number off.
fn assert_noticed(world: &Arc<World>, choice: &RouteChoice, before: &Batch, (key, stage, change): Noticed) {
    let [mut cpu, mut device] = simulators(world, choice);
    let mut wrong = wrong_device(world, choice, change);
    for simulator in [&mut cpu, &mut device, &mut wrong] {
        put(simulator, before);
        simulator.run_stage(stage);
    }
    let counted = judged(world, before, cpu.batch());
    let (written, _) = written(stage);
    assert_agreement(key, &compared(cpu.batch(), device.batch(), written, &counted));
    let wrong = compared(cpu.batch(), wrong.batch(), written, &counted);
    assert!(wrong.iter().any(|agreement| !agreement.holds()), "{key}: a wrong number would pass");
}

#[test]
fn every_number_of_tyres_delays_and_disturbances_counts_on_the_device() {
    let world = disturbed_world();
    let (choice, before) = varied(&world, false);
    for noticed in NOTICED {
        assert_noticed(&world, &choice, &before, noticed);
    }
}

/// Numbers of the vehicle and the route that decide how a truck stands which begins along its route.
const OF_STARTS: [Noticed; 11] = [
    ("start_along", Stage::Reset, |world| world.params.start_along *= 0.99),
    ("start_offset", Stage::Reset, |world| world.params.start_offset *= 1.001),
    ("start_heading", Stage::Reset, |world| world.params.start_heading *= 1.001),
    ("wheelbase", Stage::Reset, |world| world.rigs.iter_mut().for_each(|rig| rig.wheelbase *= 1.001)),
    ("fifth_wheel", Stage::Reset, |world| world.rigs.iter_mut().for_each(|rig| rig.fifth_wheel += 0.001)),
    ("trailer_wheelbase", Stage::Reset, |world| world.rigs.iter_mut().for_each(|rig| rig.trailer_wheelbase *= 1.001)),
    ("understeer", Stage::Reset, |world| world.rigs.iter_mut().for_each(|rig| rig.understeer *= 1.01)),
    ("slip", Stage::Reset, |world| world.rigs.iter_mut().for_each(|rig| rig.slip *= 1.01)),
    ("roll", Stage::Reset, |world| world.rigs.iter_mut().for_each(|rig| rig.tractor_roll.input[1] *= 1.001)),
    ("stiffness", Stage::Reset, |world| world.rigs.iter_mut().for_each(|rig| rig.trailer_roll.transition[2] *= 1.001)),
    ("crossfall", Stage::Reset, |world| world.rigs.iter_mut().for_each(|rig| rig.crossfall += 0.001)),
];

#[test]
fn a_truck_begins_along_its_route_alike_and_every_number_of_its_stance_counts_on_the_device() {
    let mut world = World::clone(&fleet_world());
    world.params.start_along = 1.0;
    let world = Arc::new(world);
    let (choice, mut before) = varied(&world, false);
    // All trucks begin again.
    before.ended.fill(Ended::Arrived as u32);
    for noticed in OF_STARTS {
        assert_noticed(&world, &choice, &before, noticed);
    }
}

/// Numbers of commands, and of late ones, that a device computes with.
const OF_COMMANDS: [Noticed; 5] = [
    ("lock", Stage::Steer, |world| world.actions[1].steering *= 1.001),
    ("lowest speed", Stage::Steer, |world| world.actions[0].speed *= 1.001),
    ("highest speed", Stage::Steer, |world| world.actions[1].speed *= 1.001),
    ("action_delay", Stage::Steer, |world| world.disturbances.n_action_delays = 3),
    ("kind", Stage::Steer, |world| world.params.n_actions = 2),
];

#[test]
fn every_number_of_a_command_counts_on_the_device_whether_it_comes_late_or_not() {
    // A late command is no state of a world with indices.
    for (world, cases) in [(continuous_world(), [0, 1, 2, 4]), (late_continuous_world(), [0, 1, 2, 3])] {
        let (choice, before) = varied(&world, false);
        for noticed in cases.map(|case| OF_COMMANDS[case]) {
            assert_noticed(&world, &choice, &before, noticed);
        }
    }
}

#[test]
fn a_whole_step_from_any_state_ends_alike_for_every_reason_there_is() {
    let world = world(Gutter::Drivable);
    let (choice, before) = varied(&world, false);
    let [mut cpu, mut device] = simulators(&world, &choice);
    let mut wrong = wrong_device(&world, &choice, |world| world.rigs[0].wheelbase *= 1.001);
    // Reset overwrites what decided the end: look at it before.
    for simulator in [&mut cpu, &mut device] {
        put(simulator, &before);
        STAGES[..STAGES.len() - 1].iter().for_each(|&stage| simulator.run_stage(stage));
    }
    let counted = judged(&world, &before, cpu.batch());
    let decisive =
        compared(cpu.batch(), device.batch(), &[Column::Truck, Column::Clearance, Column::Progress], &counted);
    assert!(decisive.iter().all(|agreement| agreement.worst < MARGIN), "the margin is too small: {decisive:?}");
    let mut codes = [0; Ended::ALL.len()];
    cpu.batch()
        .ended
        .iter()
        .zip(&counted)
        .filter(|(_, counted)| **counted)
        .for_each(|(&code, _)| codes[code as usize] += 1);
    println!("{codes:?}");
    // Trucks alone touch no vehicle.
    let codes = Ended::WITHOUT_VEHICLES.map(|ended| codes[ended as usize]);
    assert!(codes.iter().all(|&count| 100 <= count), "{codes:?}");
    for simulator in [&mut cpu, &mut device, &mut wrong] {
        put(simulator, &before);
        simulator.step(&before.action).unwrap();
    }
    let here = cpu.batch();
    // Trucks alone have no rows of vehicles.
    let columns: Vec<Column> = Column::of_trucks().collect();
    for there in [&before, wrong.batch()] {
        assert!(compared(here, there, &columns, &counted).iter().any(|agreement| !agreement.holds()));
        assert!(compared(here, there, &[Column::Ended], &counted).iter().any(|agreement| !agreement.holds()));
    }
    assert_agreement("step", &compared(here, device.batch(), &columns, &counted));
}

#[test]
fn the_largest_rewards_that_a_benchmark_may_give_are_summed_alike() {
    let mut world = World::clone(&world(Gutter::Drivable));
    let (choice, before) = varied(&world.clone().into(), false);
    // Whole numbers, which every engine adds up to the same reward, as large as what 24 hard braking vehicles may cost.
    let weights = &mut world.reward;
    (weights.waypoint, weights.failure) = (2e8, -2e8);
    (weights.lane_distance, weights.clearance) = (0.0, 0.0);
    let [here, there] = simulators(&Arc::new(world), &choice).map(|mut simulator| {
        put(&mut simulator, &before);
        simulator.step(&before.action).unwrap();
        (
            simulator.batch().reward.iter().map(|&reward| f64::from(reward)).sum::<f64>(),
            simulator.tally().unwrap().reward(),
        )
    });
    assert_eq!(here.0, here.1);
    assert_eq!(there, here);
}

#[test]
fn routes_poses_and_actions_are_drawn_alike_to_the_last_bit() {
    // A world where a pose consists of its drawn numbers alone.
    let mut world = World::clone(&world(Gutter::Drivable));
    (world.params.start_offset, world.params.start_heading, world.rigs[0].wheelbase) = (1.0, 1.0, 0.0);
    world
        .waypoints
        .iter_mut()
        .for_each(|waypoint| *waypoint = WaypointRow { position: Vec2::ZERO, direction: Vec2::X });
    world.previews.iter_mut().for_each(|preview| preview.heading = 0.0);
    let world = Arc::new(world);
    let (n_envs, seed, n_actions) = (16_384, 0xdead_beef, world.params.n_actions);
    // More entries than 16 bits count.
    let routes: Vec<u32> = (0..70_001).map(|index| index % world.routes.len() as u32).collect();
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, n_envs, seed, RouteChoice::Drawn(routes.clone()));
        for round in 0..4 {
            let mut before = simulator.batch().clone();
            before.ended.fill(Ended::Arrived as u32);
            for (env, truck) in (0..).zip(&mut before.truck) {
                [truck.episode, truck.steps, ..] = words(7, env, round, 0);
            }
            put(&mut simulator, &before);
            simulator.step_at_random();
            let action = |seed: u32, env: u32, truck: &Truck| {
                index_below(
                    words(seed, env, truck.episode, (Draw::Action as u32).wrapping_add(truck.steps))[0],
                    n_actions,
                )
            };
            let drawn = simulator.batch().action.clone();
            let agreeing = |seed| {
                (0..)
                    .zip(&before.truck)
                    .zip(&drawn)
                    .filter(|((env, truck), drawn)| action(seed, *env, truck) == **drawn)
                    .count()
            };
            assert_eq!(agreeing(seed), n_envs, "actions on the {name}");
            assert!(agreeing(seed + 1) < n_envs / 5, "another seed would pass");

            put(&mut simulator, &before);
            simulator.run_stage(Stage::Reset);
            let first = |seed: u32, env: u32, episode: u32| {
                let [offset, heading, ..] = words(seed, env, episode, Draw::Pose as u32).map(signed_unit);
                (
                    routes[index_below(words(seed, env, episode, Draw::Route as u32)[0], routes.len() as u32) as usize],
                    offset,
                    heading,
                )
            };
            let trucks = (0..).zip(before.truck.iter().zip(&simulator.batch().truck));
            let agreeing = |seed| {
                let agrees = |(env, (before, after)): &(u32, (&Truck, &Truck))| {
                    after.episode == before.episode + 1
                        && first(seed, *env, after.episode) == (after.route, after.position.y, after.heading)
                };
                trucks.clone().filter(agrees).count()
            };
            assert_eq!(agreeing(seed), n_envs, "routes and poses on the {name}");
            assert_eq!(agreeing(seed + 1), 0, "another seed would pass");
        }
    }
}
