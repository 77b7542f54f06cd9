//! A thousand trucks on the training roads of a benchmark, each with actions of its own.
//!
//! `cargo run --release --example step`

use std::error::Error;

use offtrack::prelude::*;

fn main() -> Result<(), Box<dyn Error>> {
    let scenario = Scenario::named("attard2023")?;
    let routes = RouteChoice::Drawn(scenario.split(Split::Train).to_vec());
    let mut simulator = Simulator::new(World::bake(&scenario)?.into(), 1_000, 0, routes)?;
    let n_actions = simulator.world().actions.len() as u32;
    // The truck's index decides: every ninth drives straight on, the others turn as far as their action says.
    let actions: Vec<u32> = (0..1_000).map(|env| env % n_actions).collect();
    for _ in 0..200 {
        simulator.step(&actions)?;
    }
    let tally = simulator.tally()?;
    println!("{} env steps, {} episodes ended", tally.env_steps(), tally.episodes());
    for ended in Ended::ALL.into_iter().filter(|&ended| ended != Ended::Running) {
        println!("{:>18} {}", ended.name(), tally.ended(ended));
    }
    Ok(())
}
