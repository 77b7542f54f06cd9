//! Times a step of many trucks on many roads beside one on few.
//!
//! `cargo run --release --example many_roads -- [ROADS] [ROUNDS]`: 256 roads and 41 rounds unless stated. What is
//! compared is stepped in turns within one process, and the median of the rounds' ratios is printed: load from other
//! programs changes more slowly than the rounds. The five roads are those of attard2023-full; five roads of the same
//! distribution as the many tell what the roads themselves cost.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use offtrack::files::cache::{Cache, Loading};
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::world::World;

/// Numbers of trucks.
const N_ENVS: [usize; 2] = [16_384, 1_024];
/// Steps before the first round, in which the episodes, all started at once, spread out.
const SPREAD: usize = 150;
/// Time of a turn.
const TURN: Duration = Duration::from_millis(100);

/// A benchmark of random roads: that of `random2026` with as many others.
fn random(count: usize, loading: &Loading) -> Result<Scenario, Box<dyn Error>> {
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let text = std::fs::read_to_string(scenarios.join("random2026.toml"))?;
    let head = text
        .split("[procedural]")
        .next()
        .unwrap_or_default()
        .replace("\"vehicles/", &format!("\"{}/vehicles/", scenarios.display()));
    let distribution = scenarios.join("distributions/wide.toml");
    let folder = tempfile::tempdir()?;
    let file = folder.path().join(format!("random-{count}.toml"));
    let tail =
        format!("distribution = \"{}\"\nseed = 2026\ncount = {count}\ntrain = [0, {count}]\n", distribution.display());
    std::fs::write(&file, format!("{head}[procedural]\n{tail}"))?;
    Ok(Scenario::load(&file.display().to_string(), loading)?)
}

/// Trucks on all routes of a benchmark, once their episodes have spread out.
fn simulator(scenario: &Scenario, world: &Arc<World>, n_envs: usize) -> Result<Simulator, Box<dyn Error>> {
    let routes = Split::ALL.map(|split| scenario.split(split)).concat();
    let mut simulator = Simulator::new(world.clone(), n_envs, 1, RouteChoice::Drawn(routes))?;
    (0..SPREAD).for_each(|_| simulator.step_at_random());
    Ok(simulator)
}

/// Env steps a second in one turn.
fn speed(simulator: &mut Simulator) -> f64 {
    let (mut steps, begun) = (0, Instant::now());
    while begun.elapsed() < TURN {
        simulator.step_at_random();
        steps += simulator.n_envs();
    }
    steps as f64 / begun.elapsed().as_secs_f64()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() -> Result<(), Box<dyn Error>> {
    let numbers: Vec<usize> = std::env::args().skip(1).map(|word| word.parse()).collect::<Result<_, _>>()?;
    let number = |index: usize, default: usize| numbers.get(index).copied().unwrap_or(default).max(1);
    let (n_roads, rounds) = (number(0, 256), number(1, 41));
    let cache = Cache::of_user();
    let loading = Loading { cache: cache.as_ref(), ..Loading::PLAIN };
    let mut worlds = Vec::new();
    for scenario in [Scenario::named("attard2023-full")?, random(5, &loading)?, random(n_roads, &loading)?] {
        let world = Arc::new(World::bake_with(&scenario, &loading)?);
        println!("{} roads, {} routes, {:.1} MB", world.fields.len(), world.routes.len(), world.bytes() as f64 / 1e6);
        worlds.push((scenario, world));
    }
    for n_envs in N_ENVS {
        let mut simulators = Vec::new();
        for (scenario, world) in &worlds {
            simulators.push(simulator(scenario, world, n_envs)?);
        }
        let speeds: Vec<Vec<f64>> = (0..rounds).map(|_| simulators.iter_mut().map(speed).collect()).collect();
        let of = |index: usize| median(speeds.iter().map(|round| round[index]).collect());
        let ratio = |index: usize| median(speeds.iter().map(|round| round[2] / round[index]).collect());
        println!(
            "{n_envs:>6} trucks: {:.0}, {:.0} and {:.0} env steps/s; {n_roads} roads over five {:.3}, over five like \
             them {:.3}",
            of(0),
            of(1),
            of(2),
            ratio(0),
            ratio(1),
        );
    }
    Ok(())
}
