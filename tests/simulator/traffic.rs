//! Other vehicles around the trucks of a batch.

use std::sync::Arc;

use offtrack::files::cache::Loading;
use offtrack::layout::Column;
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::traffic::Row;
use offtrack::world::World;

/// The world of `attard2023` with a table `[traffic]`.
pub fn with_traffic(keys: &str) -> (Scenario, Arc<World>) {
    let text = Scenario::text_of("attard2023").unwrap() + "\n[traffic]\n" + keys;
    let scenario = Scenario::parse("traffic", &text, None, &Loading::PLAIN).unwrap();
    let world = Arc::new(World::bake(&scenario).unwrap());
    (scenario, world)
}

fn rows(simulator: &Simulator) -> Vec<Row> {
    simulator.batch().cars.iter().map(|words| *Row::of(words)).collect()
}

#[test]
fn a_batch_without_vehicles_has_no_rows_of_them() {
    let (scenario, world) = super::benchmark("attard2023");
    let choice = RouteChoice::Drawn(scenario.split(Split::Train).to_vec());
    let simulator = Simulator::new(Arc::new(world), 8, 1, choice).unwrap();
    assert!(simulator.batch().column(Column::Cars).is_empty());
    assert_eq!(simulator.bytes(), 8 * 1044);
}

#[test]
fn vehicles_drive_alike_whatever_the_batch_and_the_threads_and_restored_ones_go_on() {
    let (scenario, world) = with_traffic("demand = [900, 1500]\nvans = 0.25\nrude = [0.0, 0.3]\n");
    let routes = scenario.split(Split::Train).to_vec();
    let stepped = |n_envs: usize, n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| {
            let choice = RouteChoice::Drawn(routes.clone());
            let mut simulator = Simulator::new(world.clone(), n_envs, 3, choice).unwrap();
            simulator.steps_at_random(300);
            simulator
        })
    };
    let (few, mut many) = (stepped(5, 1), stepped(64, 2));
    assert_eq!(rows(&few), rows(&many)[..5]);
    assert!(rows(&many).iter().map(|row| row.cars.iter().filter(|car| car.is_there()).count()).sum::<usize>() > 200);
    let kept = many.batch().clone();
    many.steps_at_random(50);
    let mut again = stepped(64, 1);
    again.steps_at_random(10);
    let of = |column: Column| Some(kept.column(column));
    again.restore(of).unwrap();
    again.steps_at_random(50);
    assert_eq!(rows(&again), rows(&many));
}

#[test]
fn a_benchmark_with_a_bad_key_of_traffic_is_refused_by_key_and_value() {
    let text = Scenario::text_of("attard2023").unwrap();
    for (keys, expected) in [
        ("demand = [-1]", "traffic.demand[0]: -1 veh/h"),
        ("demand = []", "traffic.demand: 0"),
        ("demand = [300]\nvans = 2.0", "traffic.vans: 2"),
        ("demand = [300]\nrude = [0.3, 0.1]", "traffic.rude: [0.3, 0.1]"),
        ("demand = [300]\nwaiting = -5", "traffic.waiting: -5 s"),
        ("demand = [300]\n[time]\nstep = 0.05", "time.step: 0.05 s"),
        ("demand = [300]\nlorries = 1", "lorries"),
    ] {
        let text = format!("{text}\n[traffic]\n{keys}\n");
        let error = Scenario::parse("traffic", &text, None, &Loading::PLAIN).unwrap_err().to_string();
        assert!(error.contains(expected), "{keys}: {error}");
    }
}
