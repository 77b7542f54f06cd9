//! Actions that are commands: a steer angle and a speed in place of an index.

use std::fs;
use std::sync::Arc;

use offtrack::layout::random::{Draw, signed_unit, words};
use offtrack::layout::shared::Named;
use offtrack::layout::{Action, Column, Command};
use offtrack::observer::Observer;
use offtrack::scenario::{ActionKind, Disturbances, Scenario};
use offtrack::simulator::{Error, RouteChoice, Simulator};
use offtrack::world::World;

use crate::episodes::{all_routes, rows};
use crate::left_hand::{left_hand, text};
use crate::{batch_on, benchmark, engines, scenarios};

const N_ENVS: usize = 64;

fn world(name: &str, change: impl FnOnce(&mut Scenario)) -> Arc<World> {
    let mut scenario = benchmark(name).0;
    change(&mut scenario);
    Arc::new(World::bake(&scenario).unwrap())
}

/// A command for each truck, another one in each step.
fn commands(n_envs: usize, step: u32) -> Vec<Command> {
    let command = |env: usize| {
        let [steering, speed, ..] = words(9, env as u32, step, 0).map(signed_unit);
        Command { steering, speed }
    };
    (0..n_envs).map(command).collect()
}

/// What a column of a batch has.
fn bytes(simulator: &Simulator, column: Column) -> Vec<u8> {
    simulator.batch().column(column).to_vec()
}

#[test]
fn commands_that_equal_levels_drive_as_the_levels_to_the_last_bit() {
    let (levels, continuous) = (world("attard2023", |_| ()), world("attard2023-continuous", |_| ()));
    let steer_levels = benchmark("attard2023").0.steer_levels;
    for (name, engine) in engines() {
        let [mut one, mut other] =
            [&levels, &continuous].map(|world| batch_on(&engine, world, N_ENVS, 7, all_routes(world)));
        for step in 0..120 {
            let actions: Vec<u32> = (0..N_ENVS as u32).map(|env| words(3, env, step / 4, 0)[0] % 9).collect();
            // Of one speed a command's second value is of no account.
            let command = |&action: &u32| Command { steering: steer_levels[action as usize] as f32, speed: -0.25 };
            one.step(&actions).unwrap();
            other.step_with(&actions.iter().map(command).collect::<Vec<_>>()).unwrap();
        }
        assert!(one.batch().truck.iter().any(|truck| 0 < truck.episode), "{name}: nobody has begun a second episode");
        for &column in Column::ALL.iter().filter(|column| !matches!(column, Column::Action | Column::Command)) {
            assert!(bytes(&one, column) == bytes(&other, column), "{name}: {column:?}");
        }
    }
}

#[test]
fn a_command_is_a_fraction_of_the_lock_and_goes_from_the_lowest_to_the_highest_speed() {
    let world = world("laden2026-continuous", |_| ());
    let lock = world.rigs[0].steer_max;
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 5, 1, RouteChoice::Fixed(vec![3; 5]));
        let asked = [(-1.0, -1.0), (1.0, 1.0), (0.0, 0.0), (0.123_456, -0.5), (-0.7, 0.5)];
        simulator.step_with(&asked.map(|(steering, speed)| Command { steering, speed })).unwrap();
        let expected = [10.0f32, 30.0, 20.0, 15.0, 25.0];
        for ((control, (steering, _)), kmh) in simulator.batch().control.iter().zip(asked).zip(expected) {
            assert_eq!(control.steering, steering * lock, "{name}");
            assert!((control.target_speed - kmh / 3.6).abs() < 1e-6, "{name}: {}", control.target_speed);
        }
        // The wheels follow at the vehicle's rate: after a step they are on their way.
        let turned = simulator.batch().truck[1].steering;
        assert!(0.0 <= turned && turned < 0.2 * lock, "{name}: {turned}");
        (0..40).for_each(|_| simulator.step_with(&[Command { steering: 0.05, speed: -1.0 }; 5]).unwrap());
        let followed = simulator.batch().truck[1].steering;
        assert!((followed - 0.05 * lock).abs() < 1e-6, "{name}: {followed}");
    }
}

#[test]
fn a_command_may_change_the_target_speed_within_its_bounds() {
    let world = world("laden2026-continuous", |scenario| {
        scenario.speed_changes = vec![-5.0 / 3.6, 3.0 / 3.6];
        scenario.start_speed = Some([20.0 / 3.6; 2]);
    });
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 1, 0, RouteChoice::Fixed(vec![3]));
        for (speed, expected) in [(-1.0, 15.0), (1.0, 18.0), (0.25, 18.0), (0.0, 17.0), (-1.0, 12.0), (-1.0, 10.0)] {
            simulator.step_with(&[Command { steering: 0.0, speed }]).unwrap();
            let found = simulator.batch().control[0].target_speed * 3.6;
            assert!((found - expected).abs() < 1e-4, "{name}: {found} km/h, expected {expected}");
        }
    }
}

#[test]
fn a_command_outside_its_range_is_refused_by_truck_and_value_and_nothing_is_stepped() {
    let world = world("attard2023-continuous", |_| ());
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 3, 1, all_routes(&world));
        let before = rows(simulator.batch());
        let mut refused = |steering: f32, speed: f32| {
            let mut commands = [Command::default(); 3];
            commands[2] = Command { steering, speed };
            simulator.step_with(&commands).unwrap_err().to_string()
        };
        assert_eq!(refused(1.5, 0.0), "commands[2].steering: 1.5; must lie in -1..1");
        assert_eq!(refused(f32::NAN, 0.0), "commands[2].steering: NaN; must lie in -1..1");
        assert_eq!(refused(0.0, -1.000_000_1), "commands[2].speed: -1.0000001; must lie in -1..1");
        assert_eq!(refused(0.0, f32::INFINITY), "commands[2].speed: inf; must lie in -1..1");
        let short = simulator.step_with(&[Command::default(); 2]).unwrap_err();
        assert_eq!(short, Error::CommandCount { n_commands: 2, n_envs: 3 });
        assert!(rows(simulator.batch()) == before, "{name}");
    }
}

#[test]
fn indices_are_refused_where_commands_are_needed_and_commands_where_indices_are() {
    let [levels, continuous] = ["attard2023", "attard2023-continuous"].map(|name| world(name, |_| ()));
    let mut simulator = Simulator::new(continuous.clone(), 1, 0, all_routes(&continuous)).unwrap();
    assert_eq!(simulator.step(&[0]).unwrap_err(), Error::NeedsCommands);
    let mut simulator = Simulator::new(levels.clone(), 1, 0, all_routes(&levels)).unwrap();
    assert_eq!(simulator.step_with(&[Command::default()]).unwrap_err(), Error::NeedsIndices);
    let [levels, continuous] = [levels, continuous].map(|world| Observer::new(world, 0, 0).unwrap());
    assert_eq!(continuous.command(0, 5.0).unwrap_err(), Error::NeedsCommands);
    assert_eq!(levels.commanded(&Command::default(), 5.0).unwrap_err(), Error::NeedsIndices);
    let wrong = continuous.commanded(&Command { steering: 2.0, speed: 0.0 }, 5.0).unwrap_err().to_string();
    assert_eq!(wrong, "commands[0].steering: 2; must lie in -1..1");
}

#[test]
fn random_commands_are_uniform_and_a_function_of_seed_truck_episode_and_step_on_every_engine() {
    let world = world("laden2026-continuous", |_| ());
    let n_envs = 4096;
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, n_envs, 11, all_routes(&world));
        let mut sums = [0.0f64; 5];
        for _ in 0..4 {
            let trucks = simulator.batch().truck.clone();
            simulator.step_at_random();
            for ((env, truck), command) in (0..).zip(&trucks).zip(&simulator.batch().command) {
                let draw = (Draw::Action as u32).wrapping_add(truck.steps);
                let [steering, speed, ..] = words(11, env, truck.episode, draw).map(signed_unit);
                assert_eq!(
                    (command.steering.to_bits(), command.speed.to_bits()),
                    (steering.to_bits(), speed.to_bits())
                );
                let [x, y] = [steering, speed].map(f64::from);
                [x, y, x * x, y * y, x * y].iter().zip(&mut sums).for_each(|(value, sum)| *sum += value);
            }
        }
        let expected = [0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0, 0.0];
        for (sum, expected) in sums.iter().zip(expected) {
            let mean = sum / (4 * n_envs) as f64;
            assert!((mean - expected).abs() < 0.015, "{name}: {mean}, expected {expected}");
        }
    }
}

#[test]
fn a_late_command_takes_effect_after_its_delay_rounded_to_a_part_in_32767() {
    let late = Disturbances { action_delay: [2, 2], ..Disturbances::default() };
    let world = world("laden2026-continuous", |scenario| scenario.disturbances = late);
    let lock = world.rigs[0].steer_max;
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, N_ENVS, 5, all_routes(&world));
        let speeds: Vec<f32> = simulator.batch().control.iter().map(|control| control.target_speed).collect();
        let mut given = Vec::new();
        for step in 0..8 {
            given.push(commands(N_ENVS, step));
            simulator.step_with(&given[step as usize]).unwrap();
            for env in (0..N_ENVS).filter(|&env| simulator.batch().truck[env].episode == 0) {
                let control = &simulator.batch().control[env];
                let Some(command) = (step as usize).checked_sub(2).map(|earlier| given[earlier][env]) else {
                    assert_eq!((control.steering, control.target_speed), (0.0, speeds[env]), "{name}");
                    continue;
                };
                let error = control.steering / lock - command.steering;
                assert!(error.abs() < 0.6 / 32_767.0, "{name}, step {step}: {error}");
                let speed = (20.0 + 10.0 * command.speed) / 3.6;
                assert!((control.target_speed - speed).abs() < 1e-4, "{name}, step {step}");
            }
        }
        // Ends and middle are exact.
        let exact = [-1.0, 0.0, 1.0].map(|steering| Command { steering, speed: steering });
        let mut simulator = batch_on(&engine, &world, 3, 5, RouteChoice::Fixed(vec![3; 3]));
        (0..3).for_each(|_| simulator.step_with(&exact).unwrap());
        assert_eq!(simulator.batch().control.iter().map(|c| c.steering).collect::<Vec<_>>(), [-lock, 0.0, lock]);
    }
}

#[test]
fn a_left_hand_road_is_driven_by_commands_as_its_mirror_image_to_the_last_bit_and_steers_the_other_way_on_the_map() {
    let folder = tempfile::tempdir().unwrap();
    let [right, left] = [text("16m-maps"), left_hand(&text("16m-maps"))].map(|text| {
        let (mut scenario, _) = crate::left_hand::world(folder.path(), &text, "drivable");
        (scenario.action_kind, scenario.steer_levels) = (ActionKind::Continuous, Vec::new());
        Arc::new(World::bake(&scenario).unwrap())
    });
    for (name, engine) in engines() {
        let [mut one, mut other] = [&right, &left].map(|world| batch_on(&engine, world, 256, 7, all_routes(world)));
        for step in 0..60 {
            let commands = commands(256, step / 3);
            one.step_with(&commands).unwrap();
            other.step_with(&commands).unwrap();
        }
        assert!(rows(one.batch()) == rows(other.batch()), "{name}");
        assert!(one.batch().truck.iter().any(|truck| 0 < truck.episode), "nobody has begun a second episode");
    }
    let [right, left] = [right, left].map(|world| Observer::new(world, 0, 0).unwrap());
    for command in commands(8, 0) {
        let [right, left] = [&right, &left].map(|observer| observer.commanded(&command, 5.0).unwrap());
        let lock = 1.0 / command.steering * right.steering;
        assert!((lock - 40f32.to_radians()).abs() < 1e-5);
        assert_eq!((left.steering, left.speed), (-right.steering, right.speed));
    }
}

#[test]
fn keys_of_continuous_actions_that_make_no_sense_are_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    let source = scenarios();
    let text = fs::read_to_string(source.join("attard2023-continuous.toml")).unwrap();
    let text = text.replace("\"roundabouts/", &format!("\"{}/roundabouts/", source.display()));
    let text = text.replace("\"vehicles/", &format!("\"{}/vehicles/", source.display()));
    let file = folder.path().join("own.toml");
    let levels = "steer_levels = [-0.5, 0.5]\n";
    for (from, to, expected) in [
        ("speeds_kmh", format!("{levels}speeds_kmh"), "actions.steer_levels: 2 values; actions.kind is \"continuous\""),
        ("kind = \"continuous\"\n", String::new(), "actions.steer_levels: missing; it is needed unless actions.kind"),
        ("\"continuous\"", "\"smooth\"".to_owned(), "unknown variant `smooth`, expected `levels` or `continuous`"),
    ] {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        fs::write(&file, text.replace(from, &to)).unwrap();
        let error = Scenario::read(&file).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn the_action_table_of_continuous_actions_is_what_commands_of_minus_1_and_of_1_ask_for() {
    let (mut scenario, _) = benchmark("laden2026-continuous");
    scenario.steer_max = Some(0.5);
    let [slow, fast] = [10.0, 30.0].map(|kmh: f64| (kmh / 3.6) as f32);
    assert_eq!(scenario.actions(), [Action { steering: -0.5, speed: slow }, Action { steering: 0.5, speed: fast }]);
    let world = World::bake(&scenario).unwrap();
    assert!(world.is_continuous() && world.actions.len() == 2 && !benchmark("laden2026").1.is_continuous());
}
