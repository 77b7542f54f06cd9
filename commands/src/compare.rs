//! `offtrack compare`: evaluations of different policies, episode by episode from the same starts.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use offtrack::scenario::Scenario;
use offtrack::world::World;
use offtrack_evaluation::comparison::{Asked, Comparison, Side};
use offtrack_evaluation::device::Device;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::page::comparison::{ComparisonPage, MOST_PAIRS, Pair};
use offtrack_evaluation::recording::Track;
use offtrack_evaluation::{Driven, Evaluation, files};

use crate::{outputs, policies, progress, roads};

/// Compare policies by their evaluations, in pairs of episodes from the same starts.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Files of `offtrack evaluate --json`, two or more: those after the first are compared with it. A folder is one
    /// side of several training seeds: each of its files *.json is the evaluation of one; mean and worst count, and
    /// intervals are over seeds and routes. Of fewer than five seeds they are too narrow.
    #[arg(required = true, value_name = "SIDE")]
    sides: Vec<PathBuf>,
    /// Write the comparison to this file as JSON, with every episode in which sides differ.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Write every figure to this file as CSV, a row each.
    #[arg(long)]
    csv: Option<PathBuf>,
    /// Write the tables to this file in Markdown.
    #[arg(long)]
    markdown: Option<PathBuf>,
    /// Write the tables to this file for LaTeX, with the rules of the package booktabs.
    #[arg(long)]
    latex: Option<PathBuf>,
    /// Write a page to this file, for a browser, that plays both sides of episodes that one side alone completes. The
    /// first file of each side is driven again, by the policy that it names.
    #[arg(long)]
    html: Option<PathBuf>,
    /// With --html: the policies of the sides, in their order, where those that the files name have moved.
    #[arg(long, requires = "html")]
    policy: Vec<String>,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let written = [
        ("--json", args.json.as_deref()),
        ("--csv", args.csv.as_deref()),
        ("--markdown", args.markdown.as_deref()),
        ("--latex", args.latex.as_deref()),
        ("--html", args.html.as_deref()),
    ];
    let sides = Side::read_all(&args.sides)?;
    // The files of each side, and those that they were made with.
    let mut read: Vec<outputs::Named> = Vec::new();
    for (file, evaluated) in sides.iter().flat_map(|side| &side.files) {
        let Asked { policy, line, .. } = &evaluated.asked;
        let files = [Some(file.as_path()), policy.as_deref().and_then(policies::file_of), line.as_deref()];
        read.extend(files.map(|file| ("SIDE", file)));
    }
    read.extend(args.policy.iter().map(|policy| ("--policy", policies::file_of(policy))));
    outputs::distinct(&written, &read)?;
    if !args.policy.is_empty() && args.policy.len() != sides.len() {
        let expected = format!("{} are given; one for each of the {} sides", args.policy.len(), sides.len());
        return Err(Error::Setting { name: "--policy", value: args.policy.join(" "), expected });
    }
    let comparison = Comparison::of(&sides);
    let written = |file: &Option<PathBuf>, text: fn(&Comparison) -> String| {
        file.as_deref().map_or(Ok(()), |file| files::write_whole(file, text(&comparison).as_bytes()))
    };
    // Each of them, whether or not another could be written.
    let done = [
        files::print(&comparison.text()),
        args.json.as_deref().map_or(Ok(()), |file| files::write_json(file, &comparison)),
        written(&args.csv, Comparison::csv),
        written(&args.markdown, Comparison::markdown),
        written(&args.latex, Comparison::latex),
        args.html.as_deref().map_or(Ok(()), |file| write_page(file, &sides, &comparison, &args.policy)),
    ];
    done.into_iter().collect()
}

/// Drives the pairs again that one side alone completes, in the first file of each side, and writes the page.
fn write_page(file: &Path, sides: &[Side], comparison: &Comparison, policies: &[String]) -> Result<(), Error> {
    let (scenario, world) = driven_in(&sides[0])?;
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for (side, difference) in comparison.differences.iter().enumerate() {
        let differing = difference.episodes.iter().filter(|episode| episode.is_pair());
        pairs.extend(differing.map(|episode| (side + 1, episode.route_index * comparison.episodes + episode.episode)));
    }
    if MOST_PAIRS < pairs.len() {
        // From everywhere, not those of the first routes.
        pairs = (0..MOST_PAIRS).map(|index| pairs[index * pairs.len() / MOST_PAIRS]).collect();
    }
    let mut tracks: Vec<Vec<Track>> = Vec::new();
    for (index, side) in sides.iter().enumerate() {
        let own = pairs.iter().filter(|(other, _)| index == 0 || *other == index).map(|&(_, episode)| episode);
        tracks.push(driven(side, &scenario, &world, policies.get(index), &own.collect::<Vec<_>>())?);
    }
    let mut tracks: Vec<_> = tracks.into_iter().map(Vec::into_iter).collect();
    let pair = |&(side, _): &(usize, usize)| {
        Some(Pair { name: sides[side].name.clone(), first: tracks[0].next()?, own: tracks[side].next()? })
    };
    let pairs = pairs.iter().filter_map(pair).collect();
    let routes = sides[0].outcomes(0).routes.iter().map(|route| route.name.as_str()).collect();
    ComparisonPage { scenario: &scenario, world: &world, comparison, routes, pairs }.write(file)
}

/// What the first file of a side was driven in.
fn driven_in(side: &Side) -> Result<(Scenario, Arc<World>), Error> {
    let (_, evaluated) = &side.files[0];
    let scenario = roads::asked(&evaluated.asked, evaluated.split)?;
    let world = roads::world(&scenario)?;
    Ok((scenario, world))
}

/// Drives the first file of a side again and records these episodes.
fn driven(
    side: &Side,
    scenario: &Scenario,
    world: &Arc<World>,
    policy: Option<&String>,
    episodes: &[usize],
) -> Result<Vec<Track>, Error> {
    let (file, evaluated) = &side.files[0];
    let (seed, device) = (evaluated.seed, Device::processor());
    let mut asked = evaluated.asked.clone();
    if let Some(policy) = policy {
        asked.policy = Some(policy.clone());
    }
    let mut policy = policies::Choice::of(&asked).open(scenario, world, &device.engine, seed)?;
    let evaluation = Evaluation {
        scenario,
        world,
        split: evaluated.split,
        episodes: evaluated.outcomes.episodes,
        seed,
        record: false,
        device: &device,
    };
    let n_episodes = evaluated.outcomes.routes.len() * evaluation.episodes;
    let Driven { episodes: finished, sequences, .. } = {
        let bar = progress::Bar::new(&format!("driving {}", side.name), "episodes", n_episodes);
        evaluation.drive(policy.as_mut(), &mut |done, all| bar.set(done, all))?
    };
    let [found, expected] = [&evaluation.outcomes(&finished), &evaluated.outcomes];
    if found.world != expected.world || found.digest != expected.digest {
        let what = if found.world == expected.world { "episodes end otherwise" } else { "the benchmark is another" };
        let message = format!(
            "{what} when {} drives again: evaluate once more, or name the policy that drove with --policy",
            policy.name()
        );
        return Err(Error::contents(file, message));
    }
    evaluation.repeated(&sequences, episodes)
}
