//! Times how a policy acts on a graphics device: by its kernel, and by the learner's products of matrices.
//!
//! `cargo run --release --features gpu --example acting -- [ROUNDS] [TRUCKS]`: 21 rounds of 1024 trucks unless stated;
//! `-- shader` prints the kernel's module for narrow networks, for benches/machine_code.py.
//! Policies are the shipped one of attard2023, and an untrained network with hidden layers of 512, 512 and 1024;
//! actions are sampled. What is compared drives in turns within one process, and so do random actions: load from other
//! programs changes more slowly than the rounds. Printed as JSON are times of a step, the median and the fastest of the
//! rounds, and the median of the rounds' ratios.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::{Instant, SystemTime};

use offtrack::gpu::Columns;
use offtrack::layout::N_VALUES;
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{Engine, RouteChoice, Simulator};
use offtrack::world::World;
use offtrack_evaluation::provenance;
use offtrack_learner::backend::Backend;
use offtrack_learner::config::Config;
use offtrack_learner::exchange::Actor;
use offtrack_learner::network::Mlp;
use offtrack_learner::rollout::Rollout;
use offtrack_policy::device::DevicePolicy;
use offtrack_policy::{Choice, Policy, kernel};
use serde_json::json;

const BENCHMARK: &str = "attard2023";
/// Steps of a turn: they are requested, and then waited for.
const TURN: u32 = 4;

/// Trucks, and what chooses their actions.
enum Driven {
    Random(Simulator),
    Kernel(Simulator, Box<DevicePolicy>),
    Products(Box<dyn Rollout>, Actor),
}

impl Driven {
    fn step(&mut self) -> Result<(), Box<dyn Error>> {
        match self {
            Driven::Random(simulator) => simulator.step_at_random(),
            Driven::Kernel(simulator, policy) => {
                let batch = simulator.on_device().ok_or("the trucks are not on a device")?;
                policy.step(batch)?;
            }
            Driven::Products(rollout, actor) => rollout.drive(actor)?,
        }
        Ok(())
    }

    fn wait(&self) -> Result<(), Box<dyn Error>> {
        match self {
            Driven::Random(simulator) | Driven::Kernel(simulator, _) => simulator.wait()?,
            Driven::Products(rollout, _) => rollout.wait()?,
        }
        Ok(())
    }

    /// Time of a step, by those of a turn (us).
    fn turn(&mut self) -> Result<f64, Box<dyn Error>> {
        let begun = Instant::now();
        for _ in 0..TURN {
            self.step()?;
        }
        self.wait()?;
        Ok(1e6 * begun.elapsed().as_secs_f64() / f64::from(TURN))
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1).peekable();
    if arguments.peek().is_some_and(|word| word == "shader") {
        print!("{}", kernel::source(kernel::SHAPES[0], false));
        return Ok(());
    }
    let mut number = |usual: usize| arguments.next().map_or(Ok(usual), |word| word.parse());
    let (n_rounds, n_envs) = (number(21)?, number(1024)?);
    let scenario = Scenario::named(BENCHMARK)?;
    let world = Arc::new(World::bake(&scenario)?);
    let routes = scenario.split(Split::Test).to_vec();
    let backend = Backend::on_device(None)?;
    let Backend::Device(device) = &backend else { return Err("no device".into()) };
    let engine = Engine::Gpu { device: (**device).clone(), columns: Columns::new() };
    let simulator = || Simulator::on(engine.clone(), world.clone(), n_envs, 0, RouteChoice::Drawn(routes.clone()));
    let mut config = Config::read(Path::new("gpu"))?;
    (config.n_envs, config.replay_buffer.capacity) = (n_envs, n_envs);

    let shipped = Policy::shipped(BENCHMARK)?;
    let untrained = Mlp::untrained(&[N_VALUES, 512, 512, 1024, shipped.actions.len()], 0).plain_layers();
    let large = Policy { layers: untrained, name: "512, 512, 1024".into(), ..shipped.clone() };
    let mut runs = Vec::new();
    for policy in [shipped, large] {
        let mut rollout = backend.rollout(&config, &world, routes.clone(), None)?;
        rollout.set_normalisation(&policy.normalisation);
        let actor = backend.actor(Mlp::of_policy(&policy));
        let kernel = DevicePolicy::new(device, &policy, &world, Choice::Sampled { seed: 0 })?;
        let mut driven = [
            Driven::Random(simulator()?),
            Driven::Kernel(simulator()?, Box::new(kernel)),
            Driven::Products(rollout, actor),
        ];
        let mut times = [Vec::new(), Vec::new(), Vec::new()];
        // The first round compiles what it needs.
        for round in 0..=n_rounds {
            for (driven, times) in driven.iter_mut().zip(&mut times) {
                let time = driven.turn()?;
                if 0 < round {
                    times.push(time);
                }
            }
        }
        let ratio = median(times[2].iter().zip(&times[1]).map(|(products, kernel)| products / kernel));
        let of = |times: &[f64]| {
            let fastest = times.iter().copied().fold(f64::INFINITY, f64::min);
            json!({ "median_us": median(times.iter().copied()).round(), "fastest_us": fastest.round() })
        };
        runs.push(json!({
            "policy": policy.name,
            "at_random": of(&times[0]),
            "by_kernel": of(&times[1]),
            "by_products": of(&times[2]),
            "ratio": (100.0 * ratio).round() / 100.0,
        }));
    }
    let result = json!({
        "device": backend.name(),
        "machine": provenance::machine(),
        "commit": provenance::commit(),
        "date": humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
        "trucks": n_envs,
        "rounds": n_rounds,
        "runs": runs,
    });
    println!("{result:#}");
    Ok(())
}

/// The middle value.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}
