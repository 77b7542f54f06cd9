//! What follows the end of an episode, streams of trucks, and episodes that the caller begins: on every engine.

use std::sync::Arc;

use offtrack::layout::{Column, Ended, N_VALUES, Start, Stream};
use offtrack::simulator::{Autoreset, Batch, Begin, RouteChoice, Simulator};

use crate::episodes::{all_routes, rows};
use crate::{batch_on, benchmark, engines};

/// The bytes of one truck's row of every column.
fn row(batch: &Batch, env: usize) -> Vec<u8> {
    let width = |bytes: &[u8]| bytes.len() / batch.n_envs();
    batch.columns().iter().flat_map(|(_, bytes)| bytes[env * width(bytes)..][..width(bytes)].to_vec()).collect()
}

/// What a truck does in a step that it makes, whatever the batch around it.
fn action(env: usize, steps: usize) -> u32 {
    ((3 * env + steps / 7) % 9) as u32
}

/// Steps every truck by [`action`].
fn step(simulator: &mut Simulator, steps: usize) {
    let actions: Vec<u32> = (0..simulator.n_envs()).map(|env| action(env, steps)).collect();
    simulator.step(&actions).unwrap();
}

#[test]
fn a_truck_that_ended_begins_its_next_episode_in_the_next_step_and_that_is_no_env_step() {
    let world = Arc::new(benchmark("attard2023").1);
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 48, 5, all_routes(&world));
        simulator.set_autoreset(Autoreset::NextStep);
        let (mut began, mut driven) = (0, 0);
        for steps in 0..300 {
            let before = simulator.batch().clone();
            step(&mut simulator, steps);
            let after = simulator.batch();
            for env in 0..48 {
                let (was, is) = (&before.truck[env], &after.truck[env]);
                if was.held == 1 {
                    began += 1;
                    assert_eq!((is.held, is.steps, is.episode), (0, 0, was.episode + 1), "{name}");
                    assert_eq!((after.ended[env], after.reward[env]), (Ended::Running as u32, 0.0));
                    assert_eq!(after.terms[env], Default::default());
                    assert!(
                        after.observation[env] == after.next_observation[env]
                            && after.observation[env] != before.observation[env]
                    );
                } else {
                    driven += 1;
                    assert_eq!((is.steps, is.episode), (was.steps + 1, was.episode));
                    assert_eq!(is.held == 1, after.ended[env] != Ended::Running as u32);
                    assert!(after.observation[env] == after.next_observation[env]);
                }
            }
        }
        assert!(100 < began, "{began}");
        assert_eq!(simulator.tally().unwrap().env_steps(), driven, "{name}");
    }
}

#[test]
fn the_modes_drive_the_same_episodes() {
    let world = Arc::new(benchmark("attard2023").1);
    /// Episode, end, reward and observation after a step.
    type Made = (u32, u32, f32, [f32; N_VALUES]);
    /// The first steps that each truck makes.
    fn episodes(simulator: &mut Simulator, autoreset: Autoreset) -> Vec<Vec<Made>> {
        let n_envs = simulator.n_envs();
        simulator.set_autoreset(autoreset);
        let mut made: Vec<Vec<_>> = vec![Vec::new(); n_envs];
        while made.iter().any(|made| made.len() < 150) {
            let held: Vec<Begin> = (0..n_envs)
                .filter(|&env| autoreset == Autoreset::Disabled && simulator.batch().truck[env].held == 1)
                .map(|env| Begin { env, ..Begin::default() })
                .collect();
            simulator.begin(&held).unwrap();
            let driving: Vec<bool> = simulator.batch().truck.iter().map(|truck| truck.held == 0).collect();
            let episode: Vec<u32> = simulator.batch().truck.iter().map(|truck| truck.episode).collect();
            let actions: Vec<u32> = (0..n_envs).map(|env| action(env, made[env].len())).collect();
            simulator.step(&actions).unwrap();
            let batch = simulator.batch();
            for env in (0..n_envs).filter(|&env| driving[env]) {
                made[env].push((episode[env], batch.ended[env], batch.reward[env], batch.next_observation[env]));
            }
        }
        made.iter_mut().for_each(|made| made.truncate(150));
        made
    }
    for (name, engine) in engines() {
        let driven = |autoreset| episodes(&mut batch_on(&engine, &world, 24, 9, all_routes(&world)), autoreset);
        let same_step = driven(Autoreset::SameStep);
        assert!(same_step.iter().all(|made| 0 < made.last().unwrap().0), "{name}: every truck began a second episode");
        assert!(same_step == driven(Autoreset::NextStep), "{name}");
        assert!(same_step == driven(Autoreset::Disabled), "{name}");
    }
}

#[test]
fn a_truck_with_a_stream_drives_as_the_one_of_that_seed_and_index_wherever_it_stands() {
    let world = Arc::new(benchmark("attard2023").1);
    for (name, engine) in engines() {
        let mut whole = batch_on(&engine, &world, 20, 41, all_routes(&world));
        let mut other = batch_on(&engine, &world, 3, 7, all_routes(&world));
        // Other trucks have driven before, and one goes on.
        (0..40).for_each(|_| other.step_at_random());
        let untouched = row(other.batch(), 1);
        let stream = |env| Some(Stream { seed: 41, env });
        other
            .begin(&[
                Begin { env: 2, stream: stream(17), ..Begin::default() },
                Begin { env: 0, stream: stream(4), ..Begin::default() },
            ])
            .unwrap();
        assert!(untouched == row(other.batch(), 1), "{name}: a truck that was not named stays as it was");
        assert_eq!(
            other.streams(),
            [Stream { seed: 41, env: 4 }, Stream { seed: 7, env: 1 }, Stream { seed: 41, env: 17 }]
        );
        for _ in 0..400 {
            whole.step_at_random();
            other.step_at_random();
        }
        let (whole, other) = (whole.batch(), other.batch());
        for (env, of) in [(0, 4), (2, 17)] {
            assert_eq!(row(other, env), row(whole, of), "{name}: truck {env}");
            assert!(0 < other.truck[env].episode, "{name}: a later episode is drawn from the stream too");
        }
        assert_ne!(row(other, 1), row(whole, 1), "{name}: another seed");
    }
}

#[test]
fn an_episode_begins_on_the_stated_route_at_the_stated_start_and_the_next_one_is_drawn_again() {
    let world = Arc::new(benchmark("attard2023").1);
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 4, 3, RouteChoice::Drawn(vec![0, 1, 2]));
        simulator.set_autoreset(Autoreset::Disabled);
        step(&mut simulator, 0);
        let before = rows(simulator.batch());
        let start = Start { offset: 0.5, heading: -1.0, ..Start::default() };
        simulator.begin(&[Begin { env: 1, route: Some(30), start: Some(start), ..Begin::default() }]).unwrap();
        let batch = simulator.batch();
        assert!(before != rows(batch));
        assert_eq!((batch.truck[1].route, batch.truck[1].episode, batch.truck[1].steps), (30, 1, 0), "{name}");
        let mut stated = batch_on(&engine, &world, 1, 0, RouteChoice::Fixed(vec![30]));
        stated.reset_from(&[start]).unwrap();
        assert_eq!(batch.observation[1], stated.batch().observation[0], "{name}");
        simulator.begin(&[Begin { env: 1, ..Begin::default() }]).unwrap();
        let truck = simulator.batch().truck[1];
        assert!(truck.route < 3 && truck.episode == 2, "{name}: {truck:?}");
        let before = rows(simulator.batch());
        for (wrong, message) in [
            (Begin { env: 4, ..Begin::default() }, "indices[1]: 4; the batch has trucks 0..3".to_owned()),
            (Begin { route: Some(75), ..Begin::default() }, "routes: 75; the world has routes 0..74".to_owned()),
            (
                Begin { start: Some(Start { offset: f32::NAN, heading: 0.0, ..Start::default() }), ..Begin::default() },
                "starts[0].offset: NaN; must lie in -1..1, a fraction of the largest error or range".to_owned(),
            ),
        ] {
            assert_eq!(
                simulator.begin(&[Begin { env: 2, ..Begin::default() }, wrong]).unwrap_err().to_string(),
                message
            );
            assert!(before == rows(simulator.batch()), "{name}: nothing has begun");
        }
    }
}

#[test]
fn chosen_columns_are_read_as_the_batch_has_them() {
    let world = Arc::new(benchmark("attard2023").1);
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 33, 3, all_routes(&world));
        for _ in 0..30 {
            simulator.step_at_random();
        }
        let columns = [Column::Reward, Column::Observation, Column::Truck];
        // Before all are read, and after.
        let first: Vec<Vec<u8>> =
            simulator.read(&columns).unwrap().into_iter().map(|bytes| bytes.into_owned()).collect();
        let batch = simulator.batch();
        for ((column, bytes), again) in columns.iter().zip(&first).zip(simulator.read(&columns).unwrap()) {
            assert!(bytes == batch.column(*column) && bytes[..] == *again, "{name}: {column:?}");
        }
        assert!(first[1].iter().any(|&byte| byte != 0));
    }
}

#[test]
fn a_held_truck_waits_for_its_caller() {
    let world = Arc::new(benchmark("attard2023").1);
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 16, 5, all_routes(&world));
        simulator.set_autoreset(Autoreset::Disabled);
        (0..200).for_each(|steps| step(&mut simulator, steps));
        let held = simulator.batch().truck.iter().position(|truck| truck.held == 1).unwrap();
        let before = row(simulator.batch(), held);
        step(&mut simulator, 200);
        // The action column is the caller's.
        assert_eq!(row(simulator.batch(), held)[4..], before[4..], "{name}");
    }
}
