//! Stage by stage, from the states that the simulator's own tests compare its engines in.

use std::collections::HashMap;
use std::sync::Arc;

use offtrack::engine::Autoreset;
use offtrack::engine::stages::{Case, Kernel, STAGES, Stage};
use offtrack::layout::Column;
use offtrack::map::Gutter;
use offtrack::scenario::Scenario;
use offtrack::simulator::{Batch, RouteChoice, Simulator};
use offtrack::world::World;
use offtrack_evaluation::live::Ground;
use serde_json::{Value, json};

use super::compare::{Agreement, agreements, written};
use super::page::{columns, done, written as page_of};
use super::states::{disturbed_world, fleet_world, varied, world};
use crate::place::Place;

/// Trucks: the first of those that the engines are compared with.
const N_ENVS: usize = 4096;
/// The seed of the simulator's tests.
const SEED: u32 = 3;

/// Columns of the first trucks.
fn first(batch: &Batch) -> HashMap<Column, Vec<u8>> {
    Column::of_trucks().map(|column| (column, batch.column(column)[..N_ENVS * column.width()].to_vec())).collect()
}

/// The columns' bytes, one after the other.
fn joined(batch: &Batch) -> Vec<u8> {
    batch.columns().into_iter().flat_map(|(_, bytes)| bytes).copied().collect()
}

fn kernels(world: &World, stage: Stage) -> Vec<&'static str> {
    let case = Case::of(world, Autoreset::SameStep);
    case.working(stage.kernels().iter()).map(Kernel::name).collect()
}

fn compared(stage: Stage, here: &Batch, there: &[u8]) -> Vec<Agreement> {
    let there = columns(there, N_ENVS, false);
    let (written, _) = written(stage);
    written.iter().flat_map(|&c| agreements(c, here.column(c), there[&c], &[true; N_ENVS])).collect()
}

/// Compares all stages on a world; on each stage first on one that is wrong in a number which it notices.
fn compare(right: &Arc<World>) {
    let place = Place::new();
    let (_, varied) = varied(right, false);
    let start = first(&varied);
    let all: Vec<u32> = (0..right.routes.len() as u32).collect();
    let mut simulator = Simulator::new(right.clone(), N_ENVS, SEED, RouteChoice::Drawn(all)).unwrap();
    // Columns of vehicles have no rows.
    simulator.restore(|column| Some(start.get(&column).map_or(&[], Vec::as_slice))).unwrap();
    let (mut worlds, mut jobs, mut files) = (vec![right.clone()], Vec::new(), HashMap::new());
    let mut batches = Vec::new();
    let mut stages: Vec<Value> = Vec::new();
    for stage in STAGES {
        let name = stage.name();
        let asked = json!({ "name": name, "kernels": kernels(right, stage), "from": name });
        files.insert(name.to_owned(), joined(simulator.batch()));
        if let (_, Some(change)) = written(stage) {
            let mut wrong = World::clone(right);
            change(&mut wrong);
            jobs.push(json!({
                "kind": "stages", "name": "wrong", "world": worlds.len(), "n": N_ENVS, "seed": SEED, "stages": [asked],
            }));
            worlds.push(Arc::new(wrong));
        }
        stages.push(asked);
        batches.push(simulator.batch().clone());
        simulator.run_stage(stage);
    }
    batches.push(simulator.batch().clone());
    jobs.push(json!({
        "kind": "stages", "name": "right", "world": 0, "n": N_ENVS, "seed": SEED, "stages": stages,
    }));
    let scenario = Scenario::named("attard2023-full").unwrap();
    let grounds = worlds
        .into_iter()
        .map(|world| Ground { scenario: scenario.clone(), world, text: None, is_whole: false })
        .collect();
    let given = done(&page_of(grounds, Vec::new(), &place.file("page.html")), &jobs, files);
    for (index, stage) in STAGES.into_iter().enumerate() {
        let (name, (written, change)) = (stage.name(), written(stage));
        let [before, after] = [&batches[index], &batches[index + 1]];
        let there = &given[&format!("right.{name}")];
        let fails = |there: &[u8]| compared(stage, after, there).iter().any(|agreement| !agreement.holds());
        assert!(written.is_empty() || fails(&joined(before)), "{name}: a stage that changes nothing would pass");
        if change.is_some() {
            assert!(fails(&given[&format!("wrong.{name}")]), "{name}: a number off by a thousandth would pass");
        }
        for agreement in compared(stage, after, there) {
            println!("{name} | {agreement}");
            assert!(agreement.holds(), "{name}: {agreement:?}");
        }
        let there = columns(there, N_ENVS, false);
        for column in Column::of_trucks().filter(|column| !written.contains(column)) {
            assert!(before.column(column) == there[&column], "{name} touches {column:?}");
        }
    }
}

#[test]
fn every_stage_does_the_same_in_a_browser_and_touches_nothing_else() {
    compare(&world(Gutter::Drivable));
}

#[test]
fn every_stage_does_the_same_in_a_browser_for_trucks_of_many_kinds_and_loads() {
    compare(&fleet_world());
}

#[test]
fn every_stage_does_the_same_in_a_browser_where_noise_and_delays_come_between_a_policy_and_the_truck() {
    compare(&disturbed_world());
}
