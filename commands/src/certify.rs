//! Shows which routes can be completed at all: searches for action sequences that complete each from several starts,
//! and drives them again.
//!
//! A route that no search completed may still be possible: the report names the searches made and the progress of the
//! best candidate.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use offtrack::files::reader::printable;
use offtrack::layout::Start;
use offtrack::map::procedural;
use offtrack::scenario::Split;

use offtrack_evaluation::certificate::attempt::{HOLD, attempt, passes};
use offtrack_evaluation::certificate::check_levels;
use offtrack_evaluation::certificate::file::{Certificate, CertifiedRoute, Found};
use offtrack_evaluation::certificate::verify;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;
use offtrack_evaluation::policies;

use crate::{outputs, progress, roads};

/// On the lane centre, and the four corners of the largest start errors.
const STARTS: [Start; 5] = [start(0.0, 0.0), start(1.0, 1.0), start(1.0, -1.0), start(-1.0, 1.0), start(-1.0, -1.0)];

const fn start(offset: f32, heading: f32) -> Start {
    Start { offset, heading, speed: 0.0, along: 0.0, vehicle: 0 }
}

/// Show which routes of a benchmark can be completed: search for actions that complete each of them.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A benchmark's name, or the path of its file. Without it attard2023; with --verify the file's own.
    #[arg(long)]
    benchmark: Option<String>,
    /// Which routes: `test`, `validation`, `train` or `all`.
    #[arg(long, default_value = "all", value_parser = ["test", "validation", "train", "all"])]
    split: String,
    /// Only this route of the split, 20m/N-left-4, or all of a roundabout's, 20m; repeatable. A random road need not be
    /// in the benchmark: wide/7/12/S-left-3, or all of wide/7/12.
    #[arg(long)]
    route: Vec<String>,
    /// Only trucks with this load, where the benchmark has several: the search drives the first of them.
    #[arg(long)]
    load: Option<String>,
    /// A policy file, or the name of a shipped policy: its own action sequence is then among the candidates.
    #[arg(long)]
    policy: Option<String>,
    /// Beam widths (candidates kept at each depth), tried in turn until one arrives, separated by commas.
    #[arg(long, value_delimiter = ',', default_value = "64,512,4096")]
    widths: Vec<usize>,
    /// Steps that each chosen action is held for. The widest search is repeated with 1.
    #[arg(long, default_value_t = HOLD)]
    hold: usize,
    /// Write the certificate to this file as JSON, after every route.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Drive the sequences of this file again and search for nothing; --route says where its roads are now.
    #[arg(long, conflicts_with_all = ["split", "policy", "widths", "hold", "json"])]
    verify: Option<PathBuf>,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    if !(1..=50).contains(&args.hold) {
        return Err(Error::Setting {
            name: "--hold",
            value: args.hold.to_string(),
            expected: "must lie in 1..50".into(),
        });
    }
    match &args.verify {
        Some(file) => again(file, args),
        None => certify(args),
    }
}

/// Drives a certificate's sequences again.
fn again(path: &Path, args: &Args) -> Result<(), Error> {
    let certificate = Certificate::read(path)?;
    let own = || {
        roads::benchmark(&certificate.benchmark).map_err(|error| {
            let what = "the path is from where the certificate was made; --benchmark says where it is now";
            Error::contents(path, format!("benchmark: {error}; {what}"))
        })
    };
    let scenario = args.benchmark.as_deref().map_or_else(own, roads::benchmark)?;
    let mut scenario = roads::with_load(scenario, args.load.as_deref())?;
    // Roads that the benchmark does not have are read or drawn again. Files of before do not say what was asked for.
    let is_random = |name: &String| name.rsplit_once('/').is_some_and(|(road, _)| procedural::address(road).is_some());
    let names: Vec<String> = certificate.routes.iter().map(|route| route.name.clone()).collect();
    if !args.route.is_empty() {
        roads::narrow(&mut scenario, "--route", &args.route, &Split::ALL)?;
    } else if !certificate.asked.is_empty() {
        roads::narrow(&mut scenario, "asked", &certificate.asked, &Split::ALL).map_err(|error| {
            let what = "a road's path is from where the certificate was made; --route says where it is now";
            Error::contents(path, format!("{error}; {what}"))
        })?;
    } else if names.iter().any(is_random) {
        roads::narrow(&mut scenario, "--route", &names, &Split::ALL)?;
    }
    let world = roads::world(&scenario)?;
    certificate.check(&scenario, &world, path)?;
    let arrived = verify::verify(&certificate, &world, path, |_| true)?.len();
    files::print(&format!("{}{arrived} sequences driven again: all arrived\n", table(&certificate)))
}

/// Searches every route from every start.
fn certify(args: &Args) -> Result<(), Error> {
    let passes = passes(&args.widths, args.hold)?;
    let mut read = vec![
        ("--policy", args.policy.as_ref().map(Path::new)),
        ("--benchmark", args.benchmark.as_ref().map(Path::new)),
    ];
    read.extend(args.route.iter().map(|road| ("--route", Some(Path::new(road)))));
    outputs::distinct(&[("--json", args.json.as_deref())], &read)?;
    let benchmark = args.benchmark.as_deref().unwrap_or("attard2023");
    let scenario = roads::benchmark(benchmark)?;
    let mut scenario = roads::with_load(scenario, args.load.as_deref())?;
    let splits: Vec<Split> =
        Split::ALL.into_iter().filter(|split| args.split == "all" || args.split == split.name()).collect();
    if !args.route.is_empty() {
        roads::narrow(&mut scenario, "--route", &args.route, &splits)?;
    }
    let world = roads::world(&scenario)?;
    check_levels(&world)?;
    let policy = args.policy.as_deref().map(policies::learned).transpose()?;
    if let Some(policy) = &policy {
        policy.check(&world)?;
    }
    let mut routes: Vec<u32> = splits.iter().flat_map(|&split| scenario.split(split).to_vec()).collect();
    routes.sort_unstable();
    if routes.is_empty() {
        let expected = format!("the benchmark {} has no such routes", scenario.name);
        return Err(Error::Setting { name: "--split", value: args.split.clone(), expected });
    }
    let name = policy.as_ref().map(|policy| policy.name.clone());
    let mut certificate = Certificate::new(&scenario, &world, &args.split, name, passes.clone(), &STARTS);
    // As they were given, so that --verify finds files of one's own again.
    certificate.benchmark = benchmark.to_owned();
    certificate.asked = args.route.clone();
    let started = Instant::now();
    let bar = progress::Bar::new("certifying", "starts", routes.len() * STARTS.len());
    let mut failures = 0;
    for route in routes {
        let name = world.route_names[route as usize].clone();
        let mut found = Vec::new();
        for start in &STARTS {
            bar.say(&format!("{failures} not completed, {name}"));
            let one = attempt(&world, route, start, &passes, policy.as_ref())?;
            failures += usize::from(!one.arrived());
            certificate.env_steps += one.env_steps;
            found.push(one);
            bar.advance();
        }
        certificate.routes.push(CertifiedRoute { name, found });
        certificate.seconds = started.elapsed().as_secs_f64();
        if let Some(path) = &args.json {
            certificate.write(path)?;
        }
    }
    drop(bar);
    let path = args.json.as_deref().unwrap_or(Path::new("the search's result"));
    verify::verify(&certificate, &world, path, |_| true)?;
    files::print(&table(&certificate))
}

/// The result as text: the budget, the sums, and every route and start that was not completed.
fn table(certificate: &Certificate) -> String {
    let mut text = String::new();
    let passes: Vec<String> =
        certificate.passes.iter().map(|pass| format!("{} (held {})", pass.width, pass.hold)).collect();
    let all: Vec<&Found> = certificate.routes.iter().flat_map(|route| &route.found).collect();
    let _ = writeln!(
        text,
        "{}, {} routes: searched with {} candidates at each depth, {} env steps, {:.0} s",
        printable(&certificate.benchmark),
        certificate.split,
        passes.join(", then "),
        certificate.env_steps,
        certificate.seconds
    );
    for pass in &certificate.passes {
        let by =
            all.iter().filter(|found| found.arrived() && (found.width, found.hold) == (pass.width, pass.hold)).count();
        let _ = writeln!(text, "  {by} starts completed with {} (held {})", pass.width, pass.hold);
    }
    for route in &certificate.routes {
        for (found, [offset, heading]) in
            route.found.iter().zip(&certificate.starts).filter(|(found, _)| !found.arrived())
        {
            let (furthest, ended, steps) = (100.0 * found.progress, &found.ended, found.steps);
            let from = format!("from ({offset:+}, {heading:+})");
            let _ = writeln!(
                text,
                "  {:<18} {from}: not completed; {ended} after {furthest:.0} % of the way, step {steps}",
                route.name
            );
        }
    }
    let routes = certificate.routes.iter().filter(|route| route.certified()).count();
    let arrived = all.iter().filter(|found| found.arrived()).count();
    let _ = writeln!(
        text,
        "{routes}/{} routes completed from every start, {arrived}/{} starts",
        certificate.routes.len(),
        all.len()
    );
    text
}
