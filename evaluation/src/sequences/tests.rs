use std::sync::Arc;

use offtrack::layout::{Action, N_VALUES};
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{Engine, RouteChoice, Simulator};
use offtrack_policy::{Choice, Head, Layer, Normalisation, Policy, Squash};

use super::*;
use crate::device::Device;
use crate::evaluation::{Driven, Evaluation};
use crate::placed::placed;
use crate::policies::{Controller, LOOK_AHEAD, PurePursuit, UniformRandom};

fn continuous(name: &str) -> (Scenario, Arc<World>) {
    let mut scenario = Scenario::named(name).unwrap();
    scenario.keep(&[Split::Test]);
    let world = Arc::new(World::bake(&scenario).unwrap());
    (scenario, world)
}

fn driven(scenario: &Scenario, world: &Arc<World>, policy: &mut dyn Controller) -> Driven {
    let device = &Device::processor();
    let evaluation = Evaluation { scenario, world, split: Split::Test, episodes: 2, seed: 3, record: true, device };
    evaluation.drive(policy, &mut |_, _| {}).unwrap()
}

/// Steers by the first value of the articulation's angle and drives as fast as there is a speed for.
fn policy(world: &World) -> Policy {
    let n_commands = world.n_commands();
    let mut weights = vec![0.0; N_VALUES * n_commands];
    weights[21 * n_commands] = -3.0;
    let mut biases = vec![0.25; n_commands];
    biases[n_commands - 1] += 0.5;
    Policy {
        benchmark: "own".to_owned(),
        actions: world.actions.clone(),
        head: Head::Continuous { squash: Squash::Clip },
        normalisation: Normalisation::none(N_VALUES),
        extras: Vec::new(),
        vehicles: false,
        layers: vec![Layer { weights, biases }],
        ..Policy::shipped("attard2023").unwrap()
    }
}

#[test]
fn baselines_drive_by_commands_and_their_episodes_are_recorded_by_driving_them_again() {
    let (scenario, world) = continuous("attard2023-continuous");
    let mut arrived = Vec::new();
    for policy in [&mut PurePursuit::new(LOOK_AHEAD) as &mut dyn Controller, &mut UniformRandom { seed: 3 }] {
        let Driven { episodes, tracks, sequences } = driven(&scenario, &world, policy);
        assert!(matches!(sequences, Sequences::Commands(_)) && tracks.len() == episodes.len());
        for track in &tracks {
            let episode = &episodes[track.env];
            assert_eq!((track.ended, track.frames.len()), (episode.ended, episode.steps as usize + 1));
            assert!(track.frames[1..].iter().all(|frame| frame.command.is_some() && frame.action.is_none()));
        }
        arrived.push(episodes.iter().filter(|episode| episode.ended == offtrack::layout::Ended::Arrived).count());
    }
    // Pure pursuit by levels completes 9 of these 46, too: it ignores the room that a trailer needs.
    assert!(5 <= arrived[0] && arrived[1] == 0, "{arrived:?}");
}

#[test]
fn pure_pursuit_asks_for_its_own_angle_and_speed_where_levels_only_come_near_them() {
    let (scenario, world) = continuous("laden2026-continuous");
    let routes = RouteChoice::Drawn(scenario.split(Split::Test).to_vec());
    let mut simulator = Simulator::new(world.clone(), 64, 0, routes).unwrap();
    let mut pursuit = PurePursuit::new(LOOK_AHEAD);
    let mut commands = Vec::new();
    for _ in 0..60 {
        pursuit.step(&mut simulator).unwrap();
        commands.extend_from_slice(&simulator.batch().command);
    }
    let distinct = |value: fn(&Command) -> f32| {
        let mut values: Vec<u32> = commands.iter().map(|command| value(command).to_bits()).collect();
        values.sort_unstable();
        values.dedup();
        values.len()
    };
    assert!(1000 < distinct(|command| command.steering) && 100 < distinct(|command| command.speed));
}

#[test]
fn a_policy_of_commands_drives_by_its_outputs_and_one_of_the_other_kind_is_refused() {
    for name in ["attard2023-continuous", "laden2026-continuous"] {
        let (scenario, mut world) = continuous(name);
        // It reads no extras.
        Arc::make_mut(&mut world).params.n_extras = 0;
        let policy = policy(&world);
        let routes = RouteChoice::Drawn(scenario.split(Split::Test).to_vec());
        let mut simulator = Simulator::new(world.clone(), 32, 0, routes).unwrap();
        let mut controller = placed(policy.clone(), &Engine::Cpu, &world, Choice::Best).unwrap();
        for _ in 0..40 {
            let expected = policy.commands(&simulator.batch().observation);
            controller.step(&mut simulator).unwrap();
            for (command, row) in simulator.batch().command.iter().zip(expected.chunks(world.n_commands())) {
                assert_eq!((command.steering, command.speed), (row[0], row.get(1).copied().unwrap_or_default()));
            }
        }
        assert!(
            simulator.batch().command.iter().any(|command| command.steering != simulator.batch().command[0].steering)
        );
        let message = Policy::shipped("attard2023").unwrap().check(&world).unwrap_err().to_string();
        assert!(
            message.contains("chooses among 9 actions, and the benchmark takes commands (actions.kind"),
            "{message}"
        );
        let other = Policy { actions: vec![Action { steering: 0.1, speed: 8.0 }; 2], ..policy };
        assert!(other.check(&world).unwrap_err().to_string().contains("learned with another action table"));
    }
}
