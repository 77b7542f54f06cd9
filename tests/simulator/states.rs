//! What a batch may go on from: whatever a file holds, a batch that takes it computes finite numbers.

use std::sync::Arc;

use offtrack::layout::{Column, Truck};
use offtrack::simulator::{Autoreset, RouteChoice, Simulator};
use offtrack::world::World;

use crate::{batch_on, benchmark, engines};

/// Every number that a step gives.
fn numbers(simulator: &Simulator) -> Vec<f32> {
    let columns = [
        Column::Observation,
        Column::NextObservation,
        Column::Extras,
        Column::NextExtras,
        Column::Reward,
        Column::Terms,
    ];
    let batch = simulator.batch();
    columns.iter().flat_map(|&column| bytemuck::pod_collect_to_vec::<u8, f32>(batch.column(column))).collect()
}

/// A truck on its way.
fn driven(world: &Arc<World>, engine: &offtrack::simulator::Engine) -> Simulator {
    let all = (0..world.routes.len() as u32).collect();
    let mut simulator = batch_on(engine, world, 1, 3, RouteChoice::Drawn(all));
    (0..12).for_each(|_| simulator.step_at_random());
    simulator
}

#[test]
fn a_state_with_any_number_replaced_is_refused_or_gives_finite_observations_and_rewards() {
    let floats =
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38, -1e38, f32::MAX, 1e7, 2000.0, -300.0, 5.0, -1.0, 0.5, 1e-38];
    let words = floats.into_iter().map(f32::to_bits).chain([0, 1, 23, 1000, u32::MAX - 1]);
    let words: Vec<u32> = words.collect();
    for name in ["attard2023", "laden2026"] {
        let world = Arc::new(benchmark(name).1);
        let (mut n_refused, mut n_taken) = (0, 0);
        // The same check stands before every engine.
        let (_, engine) = &engines()[0];
        let mut simulator = driven(&world, engine);
        let kept = simulator.batch().clone();
        for column in Column::of_trucks() {
            for at in (0..column.width()).step_by(4) {
                for word in &words {
                    let mut changed = kept.column(column).to_vec();
                    changed[at..at + 4].copy_from_slice(&word.to_le_bytes());
                    let found =
                        simulator.restore(|other| Some(if other == column { &changed } else { kept.column(other) }));
                    if found.is_err() {
                        n_refused += 1;
                        continue;
                    }
                    n_taken += 1;
                    for autoreset in [Autoreset::Disabled, Autoreset::SameStep] {
                        simulator.set_autoreset(autoreset);
                        for step in 0..6 {
                            assert!(
                                numbers(&simulator).iter().all(|number| number.is_finite()),
                                "{name}: {column:?} byte {at}, {word:x}, step {step}"
                            );
                            simulator.step_at_random();
                        }
                    }
                }
            }
        }
        assert!(1500 < n_refused && 500 < n_taken, "{n_refused} {n_taken}");
    }
}

/// A change of a truck, and how the message begins that refuses it.
type Case = (fn(&mut Truck), String);

#[test]
fn a_state_that_no_truck_can_have_is_refused_by_column_truck_field_and_value() {
    let world = Arc::new(benchmark("attard2023").1);
    for (name, engine) in engines() {
        let mut simulator = batch_on(&engine, &world, 4, 3, RouteChoice::Drawn(vec![0, 1, 2]));
        let kept = simulator.batch().clone();
        let lock = world.rigs[0].steer_max * 1.001;
        let cases: [Case; 4] = [
            (|truck| truck.position.x = f32::NAN, "truck[2].position[0]: NaN; must lie in ".to_owned()),
            (|truck| truck.speed = f32::INFINITY, "truck[2].speed: inf; must lie in -1000.0..1000.0".to_owned()),
            (|truck| truck.steering = 5.0, format!("truck[2].steering: 5.0; must lie in -{lock:?}..{lock:?}")),
            (|truck| truck.held = 23, "truck[2].held: 23; must lie in 0..1".to_owned()),
        ];
        for (change, expected) in cases {
            let mut trucks = kept.truck.clone();
            change(&mut trucks[2]);
            let bytes = |column| {
                Some(if column == Column::Truck { bytemuck::cast_slice(&trucks) } else { kept.column(column) })
            };
            let message = simulator.restore(bytes).unwrap_err().to_string();
            assert!(message.starts_with(&expected), "{name}: {message}");
            assert!(simulator.batch().columns() == kept.columns(), "{name}: the batch is as it was");
        }
    }
}

#[test]
fn a_truck_that_waits_is_refused_where_the_next_episode_begins_in_the_same_step() {
    let world = Arc::new(benchmark("attard2023").1);
    for (name, engine) in engines() {
        let mut simulator = driven(&world, &engine);
        simulator.set_autoreset(Autoreset::NextStep);
        while simulator.batch().truck[0].held == 0 {
            simulator.step_at_random();
        }
        let kept = simulator.batch().clone();
        simulator.restore(|column| Some(kept.column(column))).unwrap();
        simulator.set_autoreset(Autoreset::SameStep);
        let message = simulator.restore(|column| Some(kept.column(column))).unwrap_err().to_string();
        assert!(
            message.starts_with("truck[0].held: 1; no truck waits with the autoreset same_step"),
            "{name}: {message}"
        );
    }
}
