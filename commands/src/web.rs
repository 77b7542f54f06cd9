//! `offtrack web`: one HTML file in which trucks drive live in a browser, by the simulator's own shaders.

use std::path::{Path, PathBuf};

use offtrack::files::reader::{read_bytes, shown_path};
use offtrack::files::shipped::{Kind, Source};
use offtrack::scenario::{ActionKind, Scenario, Split};
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;
use offtrack_evaluation::kept::{self, Kept};
use offtrack_evaluation::live::bake::{STAMP, vehicle_beyond};
use offtrack_evaluation::live::{self, Ground, Live, Part, TrainingRun};
use offtrack_evaluation::policies::{self, rule};
use offtrack_evaluation::run_file::RunFile;
use offtrack_policy::Policy;

use crate::once::once;
use crate::{outputs, roads};

/// The benchmarks of a page of which nothing else is asked.
const BENCHMARKS: [&str; 2] = ["attard2023", "laden2026"];
/// Most bytes of what bakes roads in a page: ten times what it takes.
const MOST_BAKER: u64 = 32 << 20;
/// Most bytes of a table: what a device of WebGPU binds at its default limits.
const MOST_TABLE: usize = 128 << 20;
/// The word that stands for every split.
const ALL: &str = "all";

/// Write a page on which thousands of trucks drive live, for a browser with WebGPU.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A benchmark's name, or the path of its file; repeatable [default: attard2023 laden2026; with --run the run's].
    #[arg(long)]
    benchmark: Vec<String>,
    /// A policy file, or the name of a shipped policy; repeatable. Without it, and without --run, the shipped policies
    /// for the benchmarks.
    #[arg(long)]
    policy: Vec<String>,
    /// The folder of a training run: a slider goes through the policies that it kept on its way.
    #[arg(long)]
    run: Option<PathBuf>,
    /// Only this road, 20m, or this route, 20m/N-left-4; repeatable. A random road need not be in a benchmark:
    /// wide/7/12.
    #[arg(long)]
    road: Vec<String>,
    /// Which routes: `test` (unseen in training), `validation`, `train` or `all`.
    #[arg(long, default_value = ALL, value_parser = ["test", "validation", "train", ALL])]
    split: String,
    /// Seed of routes, start poses and random actions that the page begins with.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// What bakes roads in the page by name and from files that are dropped on it: the simulator as WebAssembly.
    #[arg(long, value_name = "FILE")]
    baker: Option<PathBuf>,
    /// Write the benchmark alone, as a file to drop on such a page.
    #[arg(long, conflicts_with_all = ["policy", "run", "seed", "baker"])]
    world: bool,
    /// The file to write.
    #[arg(short, long)]
    output: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let run = args.run.as_deref().map(training_run).transpose()?;
    let benchmarks: Vec<String> = match (args.benchmark.as_slice(), &run) {
        ([], Some(run)) => vec![run.left.benchmark.clone()],
        ([], None) => BENCHMARKS.map(str::to_owned).into(),
        (asked, _) => asked.to_vec(),
    };
    let files_of = |flag: &'static str, names: &[String]| -> Vec<(&'static str, Option<PathBuf>)> {
        names.iter().map(|name| (flag, Some(PathBuf::from(name)))).collect()
    };
    let of_run = run.iter().flat_map(TrainingRun::policies).map(|(_, policy)| policy.name.clone());
    let of_run = files_of("--run", &of_run.collect::<Vec<_>>());
    let mut read = [files_of("--benchmark", &benchmarks), files_of("--policy", &args.policy), of_run].concat();
    read.extend(files_of("--road", &args.road));
    read.push(("--baker", args.baker.clone()));
    read.extend(args.run.iter().flat_map(|folder| outputs::of_run(folder)).map(|file| ("--run", Some(file))));
    let read: Vec<outputs::Named> = read.iter().map(|(flag, file)| (*flag, file.as_deref())).collect();
    outputs::distinct(&[("--output", Some(&args.output))], &read)?;
    if let (true, [_, _, ..]) = (args.world, benchmarks.as_slice()) {
        let (value, expected) = (benchmarks.join(", "), "a world file holds one benchmark: name one".to_owned());
        return Err(Error::Setting { name: "--benchmark", value, expected });
    }
    for (flag, values) in [("--benchmark", &args.benchmark), ("--policy", &args.policy)] {
        // The page would list it twice.
        once(flag, values.iter().cloned(), "is given twice: once is enough")?;
    }
    // All that is named is read before the roads are baked.
    let baker = args.baker.as_deref().map(baker).transpose()?;
    let named = args.policy.iter().map(|name| named(name)).collect::<Result<Vec<Policy>, Error>>()?;
    let scenarios = benchmarks.iter().map(|name| scenario(name, args)).collect::<Result<Vec<Scenario>, Error>>()?;
    let sources = benchmarks.iter().map(|name| Ok(Source::find(Kind::Benchmark, name)?));
    let sources = sources.collect::<Result<Vec<Source>, Error>>()?;
    let baker = baker.filter(|_| can_bake(&sources));
    let each = benchmarks.iter().zip(scenarios).zip(&sources);
    let grounds = each.map(|((name, scenario), source)| ground(name, scenario, source, args));
    let grounds = grounds.collect::<Result<Vec<Ground>, Error>>()?;
    if let (true, [ground]) = (args.world, grounds.as_slice()) {
        return printed(&ground.write(&args.output)?);
    }
    for (policy, name) in named.iter().zip(&args.policy) {
        check(policy, name, "--policy", &grounds)?;
    }
    let policies = match (args.policy.as_slice(), &run) {
        ([], None) => shipped(&grounds)?,
        _ => named,
    };
    for (_, policy) in run.iter().flat_map(TrainingRun::policies) {
        check(policy, &policy.name, "--run", &grounds).map_err(|error| match args.benchmark.as_slice() {
            [] => error,
            _ => Error::Setting {
                name: "--benchmark",
                value: benchmarks.join(", "),
                expected: format!("{error}; without it the page has the run's own, {}", policy.benchmark),
            },
        })?;
    }
    printed(&Live { grounds, policies, run, baker, seed: args.seed }.write(&args.output)?)
}

/// The policies of the training run in a folder, each named by its file.
fn training_run(folder: &Path) -> Result<TrainingRun, Error> {
    let wrong = |expected: String| Error::Setting { name: "--run", value: folder.display().to_string(), expected };
    if !RunFile::Config.of(folder).is_file() {
        return Err(wrong("the folder of a run is needed, with the config.toml that it left".to_owned()));
    }
    let left = RunFile::Policy.of(folder);
    if !RunFile::Kept.of(folder).is_file() {
        return Err(wrong(format!(
            "it keeps no policies, as a run does from its first update on: --policy {} shows the one that it left",
            left.display()
        )));
    }
    let last = Policy::load(&left)?;
    if last.has_memory() {
        return Err(wrong(format!(
            "its policy sees {} observations, as refinement.frames has it, and a page drives by the latest alone: a \
             run without it is needed",
            last.frames.n
        )));
    }
    let kept = kept::read(folder)?;
    let load = |kept: &Kept| Ok((*kept, Policy::load(&kept.file(folder))?));
    let kept = kept.iter().map(load).collect::<Result<Vec<_>, Error>>()?;
    let name = folder.file_name().map_or_else(|| shown_path(folder), |name| name.to_string_lossy().into_owned());
    Ok(TrainingRun { name, kept, left: last })
}

/// What the parts of the file weigh.
fn printed(parts: &[Part]) -> Result<(), Error> {
    let line = |(part, n_bytes): &Part| format!("{part:<18} {:>9.1} kB\n", *n_bytes as f64 / 1e3);
    files::print(&parts.iter().map(line).collect::<String>())
}

/// Whether a page can bake roads for all of these benchmarks; a note says why not.
fn can_bake(sources: &[Source]) -> bool {
    let beyond = sources.iter().find_map(|source| Some((source, vehicle_beyond(source)?)));
    if let Some((source, vehicle)) = &beyond {
        let words = "a page cannot read that file: it is written without --baker";
        files::say(&format!("note: {source}: has the vehicle {vehicle}, and {words}"));
    }
    beyond.is_none()
}

/// A benchmark with the routes asked for, as pages have it.
fn scenario(name: &str, args: &Args) -> Result<Scenario, Error> {
    let mut scenario = roads::benchmark(name)?;
    let split = Split::named(&args.split);
    if !args.road.is_empty() {
        let splits = split.map_or(Split::ALL.to_vec(), |split| vec![split]);
        roads::narrow(&mut scenario, "--road", &args.road, &splits)?;
    }
    if let Some(split) = split {
        roads::keep(&mut scenario, split, name)?;
    }
    if scenario.action_kind == ActionKind::Continuous {
        let expected = "a page steers by levels: the same benchmark with actions.steer_levels is needed".to_owned();
        return Err(Error::Setting { name: "actions.kind", value: "continuous".to_owned(), expected });
    }
    Ok(live::shown(scenario))
}

/// A benchmark baked, which a command was given as `name`.
fn ground(name: &str, scenario: Scenario, source: &Source, args: &Args) -> Result<Ground, Error> {
    let world = roads::world(&scenario)?;
    let text = match source {
        Source::Embedded(_) => None,
        source => Some(source.text()?),
    };
    let is_whole = text.is_none() && args.road.is_empty() && args.split == ALL;
    let ground = Ground { scenario, world, text, is_whole };
    check_tables(&ground, name, MOST_TABLE).map(|()| ground)
}

/// An error if a table of a benchmark, which a command was given as `name`, has more than `most` bytes.
fn check_tables(ground: &Ground, name: &str, most: usize) -> Result<(), Error> {
    ground.table_above(most).map_or(Ok(()), |(table, n_bytes)| {
        let expected = format!(
            "its table {table} has {n_bytes} bytes, and a browser's device takes {most}: ask for fewer of its {} roads \
             by --road or --split",
            ground.scenario.places.len()
        );
        Err(Error::Setting { name: "--benchmark", value: name.to_owned(), expected })
    })
}

/// What bakes roads in the page: the bytes of `file`.
fn baker(file: &Path) -> Result<Vec<u8>, Error> {
    let bytes = read_bytes(file, MOST_BAKER)?;
    let is_wasm = bytes.starts_with(b"\0asm");
    if is_wasm && bytes.windows(STAMP.len()).any(|part| part == STAMP.as_bytes()) {
        return Ok(bytes);
    }
    let what = if is_wasm { "is WebAssembly of another program or version" } else { "is no WebAssembly" };
    let expected = format!("{what}: build it by web/build.sh {}, as docs/web.md says", shown_path(file));
    Err(Error::Setting { name: "--baker", value: file.display().to_string(), expected })
}

/// The shipped policies that can drive on a benchmark and have its name, alone or before a hyphen, or, where there are
/// none, all that can.
fn shipped(grounds: &[Ground]) -> Result<Vec<Policy>, Error> {
    let names = Policy::shipped_names();
    let policies = names.into_iter().map(Policy::shipped).collect::<Result<Vec<Policy>, _>>()?;
    let mut is_chosen = vec![false; names.len()];
    for Ground { scenario, world, .. } in grounds {
        let able: Vec<usize> = (0..names.len()).filter(|&index| policies[index].check(world).is_ok()).collect();
        let is_own = |index: usize| {
            let rest = names[index].strip_prefix(scenario.name.as_str());
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
        };
        let has_own = able.iter().any(|&index| is_own(index));
        for index in able {
            is_chosen[index] |= !has_own || is_own(index);
        }
    }
    Ok(policies.into_iter().zip(is_chosen).filter_map(|(policy, is_chosen)| is_chosen.then_some(policy)).collect())
}

/// A policy that a flag names.
fn named(name: &str) -> Result<Policy, Error> {
    if rule::under(name).is_some() || [rule::YIELDS, rule::FOLLOWS].contains(&name) {
        let expected = "a page has no rule, which decides on the processor: a policy is needed, by its name or its \
                        file; offtrack evaluate --html shows episodes by a rule";
        return Err(Error::Setting { name: "--policy", value: name.to_owned(), expected: expected.to_owned() });
    }
    policies::learned(name)
}

/// An error unless a policy, which `flag` has named by `value`, can drive somewhere on the page.
fn check(policy: &Policy, value: &str, flag: &'static str, grounds: &[Ground]) -> Result<(), Error> {
    if !policy.is_plain() {
        let expected = "a page drives by layers over the values of one step, with an output an action: this policy \
                        has a memory, sees several steps, reads some of the values or gives commands"
            .to_owned();
        return Err(Error::Setting { name: flag, value: value.to_owned(), expected });
    }
    let mut checks = grounds.iter().map(|ground| policy.check(&ground.world));
    match checks.next() {
        Some(Err(error)) if checks.all(|check| check.is_err()) => Err(error.into()),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use offtrack::map::Road;
    use offtrack::world::World;

    use super::*;

    #[test]
    fn a_benchmark_with_a_table_that_a_browsers_device_does_not_take_is_refused_with_what_would_do() {
        let scenario = Scenario::named("attard2023").unwrap().on(Road::named("16m").unwrap()).unwrap();
        let world = World::bake(&scenario).unwrap().into();
        let ground = Ground { scenario, world, text: None, is_whole: false };
        let n_bytes = ground.world.all_fields().map(|field| field.values.len() * size_of::<u32>()).sum::<usize>();
        check_tables(&ground, "mine.toml", n_bytes).unwrap();
        let said = check_tables(&ground, "mine.toml", n_bytes - 1).unwrap_err().to_string();
        let expected = format!("--benchmark: mine.toml; its table corners has {n_bytes} bytes");
        assert!(said.starts_with(&expected) && said.contains("--road or --split"), "{said}");
    }
}
