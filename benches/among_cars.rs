//! Drives a truck that follows and yields among cars over all routes of the study, prints how the episodes ended, and
//! what the cars cost.
//!
//! `cargo run --release -p offtrack-evaluation --example among_cars -- [TIMES] [RUDE] [DEMAND]... [FILE.json]`: each
//! route 3 times, no rude drivers, 300, 900, 1,500 and 2,100 veh/h unless stated. The time of a step is that of a truck
//! on all cores: on empty roads, among cars, and among cars that it observes, by the same actions; medians of five
//! turns. A file gets the times.

#[path = "../evaluation/tests/among_cars/driver.rs"]
#[expect(clippy::unwrap_used, reason = "it is a helper of tests too")]
mod driver;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use driver::{Ends, driven, simulator, world};
use offtrack::world::World;
use offtrack_evaluation::{files, provenance};
use serde_json::json;

const SEED: u32 = 7;

/// Turns in which the worlds are driven.
const TURNS: usize = 5;

/// Time of a truck's step in a world by these actions (us).
fn replayed(world: &Arc<World>, times: usize, actions: &[Vec<u32>]) -> f64 {
    let mut simulator = simulator(world, times, SEED);
    let (mut seconds, mut steps) = (0.0, 0);
    for actions in actions {
        steps += simulator.batch().truck.iter().filter(|truck| truck.held == 0).count();
        let begun = Instant::now();
        simulator.step(actions).expect("the actions are the world's");
        seconds += begun.elapsed().as_secs_f64();
    }
    seconds * 1e6 / steps as f64
}

/// Medians of these times in each of some worlds, which are driven in turns.
fn medians<const N: usize>(worlds: [&Arc<World>; N], times: usize, actions: &[Vec<u32>]) -> [f64; N] {
    let turns = [(); TURNS].map(|()| worlds.map(|world| replayed(world, times, actions)));
    std::array::from_fn(|index| {
        let mut all = turns.map(|turn| turn[index]);
        all.sort_by(f64::total_cmp);
        all[TURNS / 2]
    })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    let file = words.pop_if(|word| word.ends_with(".json"));
    let numbers: Vec<f64> = words.iter().map(|word| word.parse()).collect::<Result<_, _>>()?;
    let mut times_of = Vec::new();
    let number = |index: usize, default: f64| numbers.get(index).copied().unwrap_or(default);
    let (times, rude) = (number(0, 3.0).max(1.0) as usize, number(1, 0.0));
    let demands = numbers.get(2..).filter(|demands| !demands.is_empty()).unwrap_or(&[300.0, 900.0, 1500.0, 2100.0]);
    for demand in demands {
        let (mut scenario, world) = world(&format!("demand = [{demand}]\nvans = 0.25\nrude = {rude}\n"));
        scenario.observes_vehicles = true;
        let observed = Arc::new(World::bake(&scenario)?);
        (scenario.traffic, scenario.observes_vehicles) = (None, false);
        let empty = Arc::new(World::bake(&scenario)?);
        let Ends {
            arrived,
            met_vehicle,
            was_met,
            touched_kerb,
            other,
            overlaps,
            hard_brakings,
            met_on,
            cars,
            steps,
            actions,
        } = driven(&world, times, SEED);
        let n = (arrived + met_vehicle + was_met + touched_kerb + other) as f64;
        let percent = |count: usize| 100.0 * count as f64 / n;
        let [alone, among, observing] = medians([&empty, &world, &observed], times, &actions);
        println!(
            "{demand} veh/h: {n} episodes, arrived {:.1} %, met a vehicle {:.1} %, was met {:.2} % {met_on:?}, \
             kerb {:.1} %, other {:.1} %, {overlaps} overlaps of cars, hard brakings an episode {:.2}; {:.1} cars; \
             {alone:.2} us a step on an empty road, {:.2} times that among cars, {:.2} where they are observed",
            percent(arrived),
            percent(met_vehicle),
            percent(was_met),
            percent(touched_kerb),
            percent(other),
            hard_brakings as f64 / n,
            cars as f64 / steps as f64,
            among / alone,
            observing / alone
        );
        times_of.push(json!({
            "vehicles_per_hour": demand,
            "cars": cars as f64 / steps as f64,
            "step_on_an_empty_road_us": alone,
            "among_cars": among / alone,
            "where_they_are_observed": observing / alone,
        }));
    }
    let Some(file) = file else { return Ok(()) };
    let written = json!({
        "machine": provenance::machine(),
        "what": "a step of 0.1 s, two sub-steps, 29 rays, of a truck on all cores; medians of five turns",
        "times": times_of,
    });
    files::write_json(Path::new(&file), &written)?;
    Ok(())
}
