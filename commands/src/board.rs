//! `offtrack board`: entries of policies with what they claim, each simulated again to the last bit, as a table.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use offtrack::files::reader::shown_path;
use offtrack::map::procedural;
use offtrack::scenario::{Scenario, Split};
use offtrack::world::World;
use offtrack_evaluation::actions::Recorded;
use offtrack_evaluation::board::{Board, Claim, Drive, Entry, Row, Stretch};
use offtrack_evaluation::device::Device;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::outcomes::Outcomes;
use offtrack_evaluation::policies::Controller;
use offtrack_evaluation::{Driven, Evaluation, files, usual_episodes};

use crate::{outputs, policies, progress, roads};

/// Most roads drawn from a seed.
const MOST_ROADS: u32 = 10_000;

/// Simulate each entry of a board again, to the last bit, and print the table.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Files of entries, board/*.toml; board/README.md has their keys.
    #[arg(required = true, value_name = "ENTRY")]
    entries: Vec<PathBuf>,
    /// Exit with code 1 if an entry does not come to what it claims; each is named with the first thing that differs.
    #[arg(long)]
    check: bool,
    /// Add what was simulated to entries that claim nothing yet.
    #[arg(long, conflicts_with = "check")]
    claim: bool,
    /// Drive every policy on random roads of this seed, too, with its own vehicle and actions: a seed that nobody knew
    /// when the entry was made.
    #[arg(long)]
    roads_seed: Option<u32>,
    /// With --roads-seed: number of roads, with all their routes.
    #[arg(long, default_value_t = 100, requires = "roads_seed")]
    roads: u32,
    /// Write the rows to this file as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Write the rows to this file as CSV.
    #[arg(long)]
    csv: Option<PathBuf>,
    /// Write the tables to this file in Markdown.
    #[arg(long)]
    markdown: Option<PathBuf>,
}

/// Runs the command; true where every entry is as it claims, or nobody asked.
pub fn run(args: &Args) -> Result<bool, Error> {
    let written =
        [("--json", args.json.as_deref()), ("--csv", args.csv.as_deref()), ("--markdown", args.markdown.as_deref())];
    let read: Vec<outputs::Named> = args.entries.iter().map(|file| ("ENTRY", Some(file.as_path()))).collect();
    outputs::distinct(&written, &read)?;
    if !(1..=MOST_ROADS).contains(&args.roads) {
        let expected = format!("must lie in 1..{MOST_ROADS}");
        return Err(Error::Setting { name: "--roads", value: args.roads.to_string(), expected });
    }
    // All of them, before the first is driven.
    let entries: Vec<Entry> = args.entries.iter().map(|file| Entry::read(file)).collect::<Result<_, _>>()?;
    let driving = args.entries.iter().zip(&entries).filter_map(|(file, entry)| entry.driving_file(file));
    let files: Vec<PathBuf> = driving.collect();
    let read: Vec<outputs::Named> = files.iter().map(|file| ("ENTRY", Some(file.as_path()))).collect();
    outputs::distinct(&written, &read)?;
    let mut rows = Vec::new();
    for (file, entry) in args.entries.iter().zip(&entries) {
        rows.push(row(args, file, entry).map_err(|error| of_entry(file, error))?);
    }
    let all_hold = rows.iter().all(|row| row.differs.is_empty());
    let board = Board::new(rows);
    // Each of them, whether or not another could be written.
    let done = [
        files::print(&board.markdown()),
        args.json.as_deref().map_or(Ok(()), |file| files::write_json(file, &board)),
        args.csv.as_deref().map_or(Ok(()), |file| files::write_whole(file, board.csv().as_bytes())),
        args.markdown.as_deref().map_or(Ok(()), |file| files::write_whole(file, board.markdown().as_bytes())),
    ];
    done.into_iter().collect::<Result<(), Error>>()?;
    Ok(all_hold || !args.check)
}

/// An error about what an entry asks for, by the entry's name.
fn of_entry(file: &Path, error: Error) -> Error {
    let message = error.to_string();
    let is_named = message.starts_with(&shown_path(file).to_string());
    if error.is_wrong_input() && !is_named { Error::contents(file, message) } else { error }
}

/// The row of an entry, as it is simulated; what differs from its claims is said.
fn row(args: &Args, file: &Path, entry: &Entry) -> Result<Row, Error> {
    let driver = Driver { file, entry };
    let mut claims = String::new();
    let mut differs = Vec::new();
    let mut stretch = |key: &str, drive: &Drive| -> Result<Stretch, Error> {
        let scenario = driver.scenario(drive)?;
        let outcomes = driver.driven(&scenario, drive)?;
        match &drive.claim {
            Some(claim) => differs.extend(claim.differs(&outcomes).map(|what| format!("{key}: {what}"))),
            None if args.claim => claims += &Claim::toml(key, &outcomes),
            None => differs.push(format!("{key}: claims nothing yet; --claim adds what was simulated")),
        }
        Ok(Stretch::of(drive, &outcomes))
    };
    let home = stretch("home", &entry.home)?;
    let elsewhere = entry.elsewhere.as_ref().map(|drive| stretch("elsewhere", drive)).transpose()?;
    for what in &differs {
        files::say(&format!("{}: {what}", shown_path(file)));
    }
    if !claims.is_empty() {
        Entry::add(file, &claims)?;
    }
    let fresh = match args.roads_seed.filter(|_| entry.policy.is_some()) {
        Some(seed) => {
            let scenario = driver.on_roads(seed, args.roads)?;
            let episodes = usual_episodes(scenario.split(Split::Test).len());
            let drive = Drive { split: Split::Test, episodes, claim: None, ..entry.home.clone() };
            let benchmark = format!("{} on {} roads of wide/{seed}", drive.benchmark, args.roads);
            Some(Stretch { benchmark, ..Stretch::of(&drive, &driver.driven(&scenario, &drive)?) })
        }
        None => None,
    };
    Ok(Row { elsewhere, fresh, differs, ..Row::of(file, entry, home) })
}

/// What an entry drives with.
struct Driver<'a> {
    file: &'a Path,
    entry: &'a Entry,
}

impl Driver<'_> {
    /// The benchmark, with the routes of the split alone.
    fn scenario(&self, drive: &Drive) -> Result<Scenario, Error> {
        roads::asked(&self.entry.asked(self.file, drive), drive.split)
    }

    /// The benchmark at home on random roads of a seed, with all their routes.
    fn on_roads(&self, seed: u32, n_roads: u32) -> Result<Scenario, Error> {
        let home = self.scenario(&self.entry.home)?;
        let road = |index: u32| procedural::find(&format!("wide/{seed}/{index}"));
        let mut scenario = home.on(road(0)?)?;
        for index in 1..n_roads {
            scenario.add(road(index)?, Split::Test)?;
        }
        Ok(scenario)
    }

    fn driven(&self, scenario: &Scenario, drive: &Drive) -> Result<Outcomes, Error> {
        let (world, device) = (roads::world(scenario)?, Device::processor());
        let &Drive { split, episodes, seed, .. } = drive;
        let n_episodes = scenario.split(split).len() * episodes;
        let mut policy = self.policy(scenario, &world, &device, drive, n_episodes)?;
        let evaluation = Evaluation { scenario, world: &world, split, episodes, seed, record: false, device: &device };
        let bar = progress::Bar::new("simulating", "episodes", n_episodes);
        let Driven { episodes: finished, .. } =
            evaluation.drive(policy.as_mut(), &mut |done, all| bar.set(done, all))?;
        Ok(evaluation.outcomes(&finished))
    }

    fn policy(
        &self,
        scenario: &Scenario,
        world: &Arc<World>,
        device: &Device,
        drive: &Drive,
        n_episodes: usize,
    ) -> Result<Box<dyn Controller>, Error> {
        match self.entry.driving_file(self.file).filter(|_| self.entry.actions.is_some()) {
            Some(actions) => Ok(Box::new(Recorded::read(&actions, world, n_episodes)?)),
            None => {
                let asked = self.entry.asked(self.file, drive);
                policies::Choice::of(&asked).open(scenario, world, &device.engine, drive.seed)
            }
        }
    }
}
