//! Counts what the threads of `sense` and `collide` do side by side on real trucks, without a card.
//!
//! `cargo run --release --example lanes -- [FILE]` writes JSON, to standard output without FILE. The CPU engine drives
//! trucks at random. Then each truck's rays and clearances are computed thread by thread as the shaders do it, and must
//! come to what the engine found. Each thread's samples are kept, and dealt to subgroups of 32 and 64 threads that run
//! in step: as the kernel does it, a thread for each ray, and with a queue of the rays of some trucks, from which a
//! thread that is done takes the next.

mod clearances;
mod field;
mod rays;
mod subgroups;

use std::error::Error;
use std::sync::Arc;

use offtrack::layout::Column;
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::world::World;
use serde_json::{Map, Value, json};

/// What is driven: trucks, and steps from the start of their first episodes.
const BENCHMARK: &str = "attard2023";
const N_ENVS: usize = 65_536;
const N_STEPS: usize = 120;
/// Threads that run in step: of NVIDIA's chips, and of RDNA 3 as RADV compiles for it.
const SUBGROUPS: [usize; 2] = [32, 64];
/// Trucks that share a workgroup's queue.
const QUEUES: [usize; 4] = [8, 16, 32, 64];
/// Largest difference to what the engine found (m). Its operations are these, in the same order.
const TOLERANCE: f32 = 1e-5;

fn main() -> Result<(), Box<dyn Error>> {
    let scenario = Scenario::named(BENCHMARK)?;
    let world = Arc::new(World::bake(&scenario)?);
    let routes = scenario.split(Split::Train).to_vec();
    let mut simulator = Simulator::new(world.clone(), N_ENVS, 0, RouteChoice::Drawn(routes))?;
    (0..N_STEPS).for_each(|_| simulator.step_at_random());
    let batch = simulator.batch();
    let begun = batch.truck.iter().filter(|truck| truck.steps == 0).count();
    let row_bytes: Map<String, Value> =
        Column::of_trucks().map(|column| (column.name().to_owned(), column.width().into())).collect();
    let result = json!({
        "benchmark": BENCHMARK,
        "trucks": N_ENVS,
        "steps": N_STEPS,
        "substeps": world.params.n_substeps,
        "trucks_that_have_just_begun": begun as f64 / N_ENVS as f64,
        "row_bytes": row_bytes,
        "sense": sensed(&rays::traces(&world, batch)?),
        "collide": collided(&clearances::traces(&world, batch)?)?,
    });
    let text = serde_json::to_string_pretty(&result)?;
    match std::env::args().nth(1) {
        Some(file) => std::fs::write(file, text + "\n")?,
        None => println!("{text}"),
    }
    Ok(())
}

/// What subgroups do for the rays of all trucks.
fn sensed(rays: &[field::Trace]) -> Value {
    let n_samples: usize = rays.iter().map(Vec::len).sum();
    let by_subgroup = SUBGROUPS.map(|width| {
        let queues =
            QUEUES.map(|n_trucks| (format!("queue of {n_trucks} trucks"), subgroups::queued(rays, n_trucks, width)));
        let all = std::iter::once(("a thread a ray".to_owned(), subgroups::in_step(rays, width))).chain(queues);
        let of_threads = all.map(|(name, counts)| (name, counts.a_truck(N_ENVS))).collect::<Map<_, _>>();
        (width.to_string(), Value::from(of_threads))
    });
    json!({
        "samples_a_truck": n_samples as f64 / N_ENVS as f64,
        "subgroups_of": by_subgroup.into_iter().collect::<Map<_, _>>(),
    })
}

/// What subgroups do for the clearances of all trucks: a thread a truck, and with teams for what is undecided.
fn collided(units: &[[clearances::Unit; 2]]) -> Result<Value, String> {
    let all = || units.iter().flatten();
    let undecided = all().filter(|unit| !unit.rounds.is_empty()).count();
    let by_subgroup = SUBGROUPS.map(|width| (width.to_string(), clearances::in_step(units, width)));
    Ok(json!({
        "deepest_stack_of_spans": all().map(|unit| unit.deepest).max(),
        "units_with_undecided_spans": undecided as f64 / all().count() as f64,
        "subgroups_of": by_subgroup.into_iter().collect::<Map<_, _>>(),
        "by_teams": clearances::by_teams(units)?,
    }))
}
