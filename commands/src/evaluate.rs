//! `offtrack evaluate`: a policy on every route of a benchmark's split, as a table, as JSON, as a page.

use std::path::{Path, PathBuf};

use offtrack::files::reader::{self, shown_path};
use offtrack::scenario::{Scenario, Split};
use offtrack::world::World;
use offtrack_evaluation::actions;
use offtrack_evaluation::avoidable::{self, contacts};
use offtrack_evaluation::certificate::attempt::{HOLD, passes};
use offtrack_evaluation::certificate::beam::Pass;
use offtrack_evaluation::certificate::{certified, check_delay, check_table};
use offtrack_evaluation::comparison::Asked;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::failures::Example;
use offtrack_evaluation::outcomes::Outcomes;
use offtrack_evaluation::page::Page;
use offtrack_evaluation::possible::to_search;
use offtrack_evaluation::recording::Of;
use offtrack_evaluation::report::{Episode, Report, Summary};
use offtrack_evaluation::run_file::RunFile;
use offtrack_evaluation::{Driven, Evaluation, Sequences, legend, usual_episodes};
use offtrack_evaluation::{files, provenance};
use serde::Serialize;
use serde_json::Value;

use crate::{devices, outputs, policies, progress, record, roads, terminal};

/// Most bytes of a run's report and of its figures.
const RUN_LIMIT: u64 = 64 << 20;

/// Most causes of failure of which an example is filmed.
const FILMS: usize = 5;

/// Evaluate a policy on a benchmark's routes.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Columns of the table:\n{}", legend(100)))]
pub struct Args {
    #[command(flatten)]
    policy: policies::Choice,
    /// A benchmark's name, or the path of its file.
    #[arg(long, default_value = "attard2023")]
    benchmark: String,
    /// Which routes: `test` (unseen in training), `validation` or `train`.
    #[arg(long, default_value = "test", value_parser = roads::split())]
    split: Split,
    /// Only this route of the split, 20m/N-left-4, or all of a roundabout's, 20m; repeatable. A random road need not be
    /// in the benchmark: wide/7/12/S-left-3, or all of wide/7/12.
    #[arg(long)]
    route: Vec<String>,
    /// Only trucks with this load, where the benchmark has several.
    #[arg(long)]
    load: Option<String>,
    /// Episodes on each route; without it 30, and fewer where there are more than 100 routes: about 3,000 in all.
    #[arg(long)]
    episodes: Option<usize>,
    /// Seed of the start poses and of random actions.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Write the report to this file as JSON, with each episode's outcome, for `offtrack compare`.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Write the actions of every episode to this file, with which an entry of `offtrack board` is driven again.
    #[arg(long)]
    actions: Option<PathBuf>,
    /// Write a page to this file, for a browser, that shows the report and every episode; of more than 4000 episodes
    /// those that failed and a sample of the others.
    #[arg(long)]
    html: Option<PathBuf>,
    /// With --html: the folder of the training run that has left this policy, to show its curves too.
    #[arg(long, requires = "html")]
    run: Option<PathBuf>,
    /// A certificate of `offtrack certify`: success over the routes that it shows to be possible is reported too.
    #[arg(long)]
    certified: Option<PathBuf>,
    /// Write films to this folder, which must have none yet, of one episode of each of the five commonest causes of
    /// failure.
    #[arg(long)]
    films: Option<PathBuf>,
    /// Search for actions that complete the own start of each episode that did not arrive, and report success over the
    /// episodes whose start is so shown to be possible.
    #[arg(long)]
    certify: bool,
    /// With --certify: beam widths (candidates kept at each depth), tried in turn until one arrives, separated by
    /// commas. The widest search is repeated with a choice at every step.
    #[arg(long, value_delimiter = ',', default_value = "64,512", requires = "certify")]
    widths: Vec<usize>,
    /// Search from so long before each contact with another vehicle (s) for actions that avoid it, and report how many
    /// could have been avoided.
    #[arg(
        long,
        value_name = "SECONDS,...",
        value_delimiter = ',',
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "3,1"
    )]
    avoidable: Option<Vec<f64>>,
    #[command(flatten)]
    device: devices::Choice,
}

/// What `--json` writes: the report, and where it comes from.
#[derive(Serialize)]
struct Written<'a> {
    #[serde(flatten)]
    report: &'a Report,
    /// The processor's name and number of cores.
    machine: String,
    /// What stepped the trucks: `cpu`, or the graphics adapter's name.
    device: &'a str,
    /// The commit that the program was built from.
    commit: String,
    /// What was asked, to be asked again.
    asked: &'a Asked,
}

impl Written<'_> {
    /// Writes it with the outcomes, which have a line for each route.
    fn write(&self, file: &Path, outcomes: &Outcomes) -> Result<(), Error> {
        let text = || -> serde_json::Result<String> {
            let head = serde_json::to_string_pretty(self)?;
            let head = head.strip_suffix("\n}").unwrap_or(&head);
            Ok(format!("{head},\n  \"outcomes\": {}\n}}\n", outcomes.json()?))
        };
        files::write_whole(file, text().map_err(|error| Error::write(file)(error.into()))?.as_bytes())
    }
}

/// An error for flags that make no sense, alone or together; gives the widths of the searches.
fn checked(args: &Args) -> Result<Vec<Pass>, Error> {
    if let Some(episodes) = args.episodes.filter(|episodes| !(1..=100_000).contains(episodes)) {
        return Err(Error::Setting {
            name: "--episodes",
            value: episodes.to_string(),
            expected: "must lie in 1..100000".into(),
        });
    }
    let passes = passes(&args.widths, HOLD)?;
    let of_run: Vec<PathBuf> = args.run.iter().flat_map(|folder| outputs::of_run(folder)).collect();
    let mut read = vec![("--certified", args.certified.as_deref()), ("--benchmark", Some(Path::new(&args.benchmark)))];
    read.extend(of_run.iter().map(|file| ("--run", Some(file.as_path()))));
    read.extend(args.route.iter().map(|road| ("--route", Some(Path::new(road)))));
    outputs::distinct(
        &[("--json", args.json.as_deref()), ("--actions", args.actions.as_deref()), ("--html", args.html.as_deref())],
        &[&args.policy.files()[..], &read[..]].concat(),
    )?;
    args.films.as_deref().map(check_no_films).transpose()?;
    Ok(passes)
}

/// An error where what is asked for cannot be had in this world.
fn check_world(args: &Args, scenario: &Scenario, world: &World) -> Result<(), Error> {
    if args.certify {
        check_table(world)?;
        check_delay(world)?;
    }
    if let Some(seconds) = &args.avoidable {
        avoidable::check(scenario, world, seconds)?;
    }
    if args.actions.is_some() { actions::check_levels(world) } else { Ok(()) }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let passes = checked(args)?;
    let device = args.device.open()?;
    let split = args.split;
    let asked = args.policy.asked(&args.benchmark, args.load.as_deref(), &args.route);
    let scenario = roads::asked(&asked, split)?;
    let world = roads::world(&scenario)?;
    check_world(args, &scenario, &world)?;
    let mut policy = args.policy.open(&scenario, &world, &device.engine, args.seed)?;
    let n_routes = scenario.split(split).len();
    let episodes = args.episodes.unwrap_or_else(|| usual_episodes(n_routes));
    let (run, metrics) = match &args.run {
        Some(folder) => {
            let run = read_run(folder)?;
            args.policy.check_is_of(folder, &scenario, &world)?;
            run
        }
        None => (Value::Null, None),
    };
    let possible =
        args.certified.as_ref().map(|file| certified(file, &scenario, &world, scenario.split(split))).transpose()?;
    let (seed, record) = (args.seed, args.html.is_some());
    let evaluation = Evaluation { scenario: &scenario, world: &world, split, episodes, seed, record, device: &device };
    let driven = {
        let bar = progress::Bar::new("evaluating", "episodes", episodes * n_routes);
        evaluation.drive(policy.as_mut(), &mut |done, all| bar.set(done, all))?
    };
    let mut report = reported(args, &evaluation, policy.name(), &driven, &passes)?;
    let Driven { episodes: finished, tracks, sequences } = driven;
    report.certified = possible.and_then(|possible| {
        let chunks = scenario.split(split).iter().zip(finished.chunks(episodes));
        let kept: Vec<&Episode> =
            chunks.filter(|(route, _)| possible.contains(route)).flat_map(|(_, chunk)| chunk).collect();
        Summary::of(kept.into_iter(), scenario.step)
    });
    // Each of them, whether or not another could be written.
    let done = [
        files::print(&printed(&report, episodes)),
        args.json.as_deref().map_or(Ok(()), |file| {
            let (machine, commit) = (provenance::machine(), provenance::commit());
            let written = Written { report: &report, machine, device: &device.name, commit, asked: &asked };
            written.write(file, &evaluation.outcomes(&finished))
        }),
        args.actions.as_deref().map_or(Ok(()), |file| sequences.write(file, &world)),
        args.html.as_deref().map_or(Ok(()), |file| {
            Page { scenario: &scenario, world: &world, evaluation: &report, tracks: &tracks, run, metrics }.write(file)
        }),
        args.films.as_deref().map_or(Ok(()), |folder| write_films(folder, &evaluation, &report, &sequences)),
    ];
    done.into_iter().collect()
}

/// The report, with the searches that are asked for.
fn reported(
    args: &Args,
    evaluation: &Evaluation,
    policy: &str,
    driven: &Driven,
    passes: &[Pass],
) -> Result<Report, Error> {
    let finished = &driven.episodes;
    let searched = if args.certify {
        let bar = progress::Bar::new("certifying", "starts", to_search(finished).count());
        Some(evaluation.possible(finished, passes, &|| bar.advance())?)
    } else {
        None
    };
    let mut report = evaluation.summarised(policy, finished, searched);
    if let Some(seconds) = &args.avoidable {
        let bar = progress::Bar::new("avoiding", "contacts", contacts(finished).count());
        report.avoidable = Some(evaluation.avoidable(finished, &driven.sequences, seconds, &|| bar.advance())?);
    }
    Ok(report)
}

/// Films an example of each of the commonest causes of failure: `1-trailer-on-the-island.gif` and the like.
fn write_films(folder: &Path, evaluation: &Evaluation, report: &Report, sequences: &Sequences) -> Result<(), Error> {
    files::make_folder(folder)?;
    let causes = &report.failures[..report.failures.len().min(FILMS)];
    let indices: Vec<usize> = causes.iter().map(|cause| cause.example.index).collect();
    let &Evaluation { scenario, world, seed, .. } = evaluation;
    for (n, (cause, track)) in causes.iter().zip(evaluation.repeated(sequences, &indices)?).enumerate() {
        let Example { route: name, episode, .. } = &cause.example;
        let (place, route) =
            scenario.routes().find(|(_, route)| route.name == *name).expect("a report's routes are the scenario's");
        let of =
            Of { scenario, world, roundabout: &scenario.places[place].roundabout, route, policy: &report.policy, seed };
        let file = folder.join(format!("{}-{}.gif", n + 1, cause.cause.replace(' ', "-")));
        record::write_film(&of, &file, *episode, evaluation.episodes, track)?;
    }
    Ok(())
}

/// An error for a folder with films, such as those of another evaluation: they would stand among the new ones.
fn check_no_films(folder: &Path) -> Result<(), Error> {
    files::check_folder(folder)?;
    if !folder.exists() {
        return Ok(());
    }
    for entry in std::fs::read_dir(folder).map_err(Error::read(folder))? {
        let file = entry.map_err(Error::read(folder))?.path();
        if file.extension().is_some_and(|extension| extension == "gif") {
            let expected = format!("{} is in it: name another folder, or remove its films", shown_path(&file));
            return Err(Error::Setting { name: "--films", value: shown_path(folder), expected });
        }
    }
    Ok(())
}

/// What was evaluated, and the table.
fn printed(report: &Report, episodes: usize) -> String {
    let Report { benchmark, split, policy, seed, .. } = report;
    let noun = if episodes == 1 { "episode" } else { "episodes" };
    format!("policy {policy}; benchmark {benchmark}, {split} routes; {episodes} {noun} a route, seed {seed}\n\n")
        + &report.table(terminal::width())
}

/// A run's report, and the text of its metrics.csv.
fn read_run(folder: &Path) -> Result<(Value, Option<String>), Error> {
    let [report, metrics] = [RunFile::Report, RunFile::Metrics].map(|file| file.of(folder));
    let wrong = |message: String| Error::contents(&report, message);
    let text = reader::read_text(&report, RUN_LIMIT)?;
    let run: Value =
        serde_json::from_str(&text).map_err(|error| wrong(format!("{error}; a run's report is needed")))?;
    if run.get("env_steps").is_none() {
        return Err(wrong("has no env_steps; a run's report is needed, as `train` writes it".to_owned()));
    }
    Ok((run, Some(reader::read_text(&metrics, RUN_LIMIT)?)))
}
