//! `offtrack web`: one HTML file in which trucks drive live in a browser, by the simulator's own shaders.

use std::path::PathBuf;

use offtrack::scenario::Split;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;
use offtrack_evaluation::live::{self, Ground, Live, Part};
use offtrack_evaluation::policies;
use offtrack_policy::Policy;

use crate::{outputs, roads};

/// The word that stands for every split.
const ALL: &str = "all";

/// Write a page on which thousands of trucks drive live, for a browser with WebGPU.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A benchmark's name, or the path of its file; repeatable.
    #[arg(long, default_values = ["attard2023", "laden2026"])]
    benchmark: Vec<String>,
    /// A policy file, or the name of a shipped policy; repeatable. Without it the shipped policies for the
    /// benchmarks.
    #[arg(long)]
    policy: Vec<String>,
    /// Only this road, 20m, or this route, 20m/N-left-3; repeatable. A random road need not be in a benchmark:
    /// wide/7/12.
    #[arg(long)]
    road: Vec<String>,
    /// Which routes: `test` (unseen in training), `validation`, `train` or `all`.
    #[arg(long, default_value = ALL, value_parser = ["test", "validation", "train", ALL])]
    split: String,
    /// Seed of routes, start poses and random actions that the page begins with.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Write the benchmark alone, as a file to drop on such a page.
    #[arg(long, conflicts_with_all = ["policy", "seed"])]
    world: bool,
    /// The file to write.
    #[arg(short, long)]
    output: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let files_of = |flag: &'static str, names: &[String]| -> Vec<(&'static str, Option<PathBuf>)> {
        names.iter().map(|name| (flag, Some(PathBuf::from(name)))).collect()
    };
    let read = [files_of("--benchmark", &args.benchmark), files_of("--policy", &args.policy)].concat();
    let read: Vec<outputs::Named> = read.iter().map(|(flag, file)| (*flag, file.as_deref())).collect();
    outputs::distinct(&[("--output", Some(&args.output))], &read)?;
    if let (true, [_, _, ..]) = (args.world, args.benchmark.as_slice()) {
        let (value, expected) = (args.benchmark.join(", "), "a world file holds one benchmark: name one".to_owned());
        return Err(Error::Setting { name: "--benchmark", value, expected });
    }
    let grounds = args.benchmark.iter().map(|name| ground(name, args)).collect::<Result<Vec<Ground>, Error>>()?;
    if let (true, [ground]) = (args.world, grounds.as_slice()) {
        return printed(&ground.write(&args.output)?);
    }
    let policies = if args.policy.is_empty() { shipped(&grounds)? } else { named(&args.policy, &grounds)? };
    printed(&Live { grounds, policies, seed: args.seed }.write(&args.output)?)
}

/// What the parts of the file weigh.
fn printed(parts: &[Part]) -> Result<(), Error> {
    let line = |(part, n_bytes): &Part| format!("{part:<18} {:>9.1} kB\n", *n_bytes as f64 / 1e3);
    files::print(&parts.iter().map(line).collect::<String>())
}

/// A benchmark with the routes asked for, baked.
fn ground(name: &str, args: &Args) -> Result<Ground, Error> {
    let mut scenario = roads::benchmark(name)?;
    let split = Split::ALL.into_iter().find(|split| split.name() == args.split);
    if !args.road.is_empty() {
        let splits = split.map_or(Split::ALL.to_vec(), |split| vec![split]);
        roads::narrow(&mut scenario, "--road", &args.road, &splits)?;
    }
    if let Some(split) = split {
        roads::keep(&mut scenario, split, name)?;
    }
    let scenario = live::shown(scenario);
    let world = roads::world(&scenario)?;
    if world.is_continuous() {
        let expected = "a page steers by levels: the same benchmark with actions.steer_levels is needed".to_owned();
        return Err(Error::Setting { name: "actions.kind", value: "continuous".to_owned(), expected });
    }
    Ok(Ground { scenario, world })
}

/// The shipped policies that can drive on a benchmark and have its name or, where there are none, all that can.
fn shipped(grounds: &[Ground]) -> Result<Vec<Policy>, Error> {
    let names = Policy::shipped_names();
    let policies = names.into_iter().map(Policy::shipped).collect::<Result<Vec<Policy>, _>>()?;
    let mut is_chosen = vec![false; names.len()];
    for Ground { scenario, world } in grounds {
        let able: Vec<usize> = (0..names.len()).filter(|&index| policies[index].check(world).is_ok()).collect();
        let has_own = able.iter().any(|&index| names[index].starts_with(&scenario.name));
        for index in able {
            is_chosen[index] |= !has_own || names[index].starts_with(&scenario.name);
        }
    }
    Ok(policies.into_iter().zip(is_chosen).filter_map(|(policy, is_chosen)| is_chosen.then_some(policy)).collect())
}

/// The policies that the flags name. Each must be able to drive somewhere on the page.
fn named(names: &[String], grounds: &[Ground]) -> Result<Vec<Policy>, Error> {
    let named = |name: &String| {
        let policy = policies::learned(name)?;
        if !policy.is_plain() {
            let expected =
                "a page drives by layers over the values of one step, with an output an action: this policy \
                            has a memory, reads some of the values or gives commands"
                    .to_owned();
            return Err(Error::Setting { name: "--policy", value: name.clone(), expected });
        }
        let mut checks = grounds.iter().map(|ground| policy.check(&ground.world));
        match checks.next() {
            Some(Err(error)) if checks.all(|check| check.is_err()) => Err(error.into()),
            _ => Ok(policy),
        }
    };
    names.iter().map(named).collect()
}
