//! Draws random roundabouts and writes them as ordinary files, with a contact sheet; or plots their distribution.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use offtrack::files::reader::{read_bytes, shown_path};
use offtrack::files::shipped::Kind;
use offtrack::map::procedural::{Distribution, RandomRoad, Reason, Refused, lane_clearance};
use offtrack::map::{Road, opendrive};
use offtrack_drawing::histograms::{Histograms, Panel};
use offtrack_drawing::sheet;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;

use crate::{outputs, plot, roads};

/// Roads drawn at most.
const MOST: u32 = 100_000;
/// Roads on a contact sheet at most.
const ON_SHEET: usize = 200;
/// Width of a PNG (pixels).
const WIDTH: u32 = 1600;

/// Draw random roundabouts and write them as files.
#[derive(Debug, clap::Args)]
#[command(group(clap::ArgGroup::new("target").args(["output", "plot"]).required(true).multiple(true)))]
pub struct Args {
    /// A distribution's name, or the path of its file.
    #[arg(long, default_value = "wide")]
    distribution: String,
    /// Seed of the roads: road i of a seed is the same for ever.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Number of roads.
    #[arg(long, default_value_t = 20)]
    count: u32,
    /// Index of the first road.
    #[arg(long, default_value_t = 0)]
    first: u32,
    /// Write each road to a file in this folder, wide-7-12.toml, and a contact sheet of the first 200:
    /// contact-sheet.svg and .png.
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Plot to this file, .svg or .png, how the roads' dimensions are distributed and where the shipped roundabouts
    /// lie.
    #[arg(long)]
    plot: Option<PathBuf>,
    /// Write each road as an OpenDRIVE map, too, wide-7-12.xodr, but for the few that lose routes or kerbs so: these
    /// are named.
    #[arg(long, requires = "output")]
    xodr: bool,
    /// Write over files of these names that the folder has already and that hold something else.
    #[arg(long, requires = "output")]
    overwrite: bool,
}

/// Files of the contact sheet.
const SHEETS: [&str; 2] = ["contact-sheet.svg", "contact-sheet.png"];

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    if !(1..=MOST).contains(&args.count) {
        return Err(Error::Setting {
            name: "--count",
            value: args.count.to_string(),
            expected: format!("must lie in 1..{MOST}"),
        });
    }
    let Some(last) = args.first.checked_add(args.count - 1) else {
        let expected = format!("must be at most {} for so many roads", u32::MAX - (args.count - 1));
        return Err(Error::Setting { name: "--first", value: args.first.to_string(), expected });
    };
    args.plot.as_ref().map(|file| plot::check("--plot", file)).transpose()?;
    let of_sheet = args.output.iter().flat_map(|folder| SHEETS.map(|name| folder.join(name))).collect::<Vec<_>>();
    let read: Vec<outputs::Named> = of_sheet.iter().map(|file| ("--output", Some(file.as_path()))).collect();
    let distribution = [("--distribution", Some(Path::new(&args.distribution)))];
    outputs::distinct(&[("--plot", args.plot.as_deref())], &[&read[..], &distribution].concat())?;
    let distribution = Distribution::find(&args.distribution)?;
    let indices: Vec<u32> = (args.first..=last).collect();
    let roads = roads::loading("drawing", |loading| distribution.roads(args.seed, &indices, loading))?;
    // All that can fail but the writing itself is done before anything is written.
    let sheets = match &args.output {
        Some(folder) => sheets(folder, &distribution, args, &roads)?,
        None => Vec::new(),
    };
    // About one road in thirty cannot be a map.
    let (mut maps, mut refused) = (Vec::new(), Vec::new());
    for road in roads.iter().filter(|_| args.xodr) {
        match map(&distribution, args.seed, road) {
            Ok(map) => maps.push(map),
            Err(error) => refused.push(format!("no map of it is written: {error}")),
        }
    }
    let drawn = |file| plot::bytes(file, Ok(histograms(&distribution, args, &roads)?), WIDTH);
    let plot = args.plot.as_deref().map(drawn).transpose()?;
    if let Some(folder) = &args.output {
        let file = |road: &RandomRoad| {
            (
                format!("{}-{}-{}.toml", distribution.name, args.seed, road.index),
                text(args, &distribution, road).into_bytes(),
            )
        };
        let files = || {
            let all = roads.iter().map(file).chain(maps.iter().chain(&sheets).cloned());
            all.map(|(name, bytes)| (folder.join(name), bytes))
        };
        if !args.overwrite {
            files().try_for_each(|(file, bytes)| free(&file, &bytes))?;
        }
        files::make_folder(folder)?;
        files().try_for_each(|(file, bytes)| files::write_whole(&file, &bytes))?;
    }
    refused.iter().for_each(|refused| files::say(refused));
    if let (Some(file), Some(bytes)) = (&args.plot, &plot) {
        files::write_whole(file, bytes)?;
    }
    files::print(&summary(&distribution, args, &roads))
}

/// An error if there is a file that holds anything else. One with the same bytes is what an earlier attempt has left.
fn free(file: &Path, bytes: &[u8]) -> Result<(), Error> {
    if !file.exists() || read_bytes(file, bytes.len() as u64).is_ok_and(|found| found == bytes) {
        return Ok(());
    }
    let expected =
        "exists and holds something else; another folder would do, or --overwrite to write over it".to_owned();
    Err(Error::Setting { name: "--output", value: file.display().to_string(), expected })
}

/// A road's file.
fn text(args: &Args, distribution: &Distribution, road: &RandomRoad) -> String {
    let RandomRoad { seed, index, attempt, .. } = road;
    // A path may hold line breaks, which would end the comment.
    let (name, given) = (&distribution.name, args.distribution.escape_debug());
    format!(
        "# A random roundabout: distribution {name}, seed {seed}, index {index}, attempt {attempt}.\n\
         # Made by: offtrack generate --distribution {given} --seed {seed} --first {index} --count 1\n\n{}",
        road.text()
    )
}

/// Name and content of a road's map.
fn map(distribution: &Distribution, seed: u32, road: &RandomRoad) -> Result<(String, Vec<u8>), Error> {
    let text = opendrive::exported(&road.roundabout)?;
    Ok((format!("{}-{seed}-{}.xodr", distribution.name, road.index), text.into_bytes()))
}

/// Names and contents of the contact sheets.
fn sheets(
    folder: &Path,
    distribution: &Distribution,
    args: &Args,
    roads: &[RandomRoad],
) -> Result<Vec<(String, Vec<u8>)>, Error> {
    let shown: Vec<&Road> = roads.iter().take(ON_SHEET).map(|road| &road.roundabout).collect();
    let of = if shown.len() < roads.len() {
        format!("The first {} of {} random roads", shown.len(), roads.len())
    } else {
        format!("{} random road{}", shown.len(), if shown.len() == 1 { "" } else { "s" })
    };
    let title = format!("{of}: distribution {}, seed {}", distribution.name, args.seed);
    let svg = sheet::drawn(&title, &shown)
        .map_err(|error| Error::write(&folder.join(SHEETS[0]))(std::io::Error::other(error)))?;
    let bytes = |name: &str| plot::bytes(&folder.join(name), Ok(svg.clone()), WIDTH);
    SHEETS.into_iter().map(|name| Ok((name.to_owned(), bytes(name)?))).collect()
}

/// Histograms of the roads with the shipped roundabouts marked, as SVG text.
fn histograms(distribution: &Distribution, args: &Args, roads: &[RandomRoad]) -> Result<String, Error> {
    let (approach, departure) = (distribution.approach, distribution.departure);
    // Roundabouts with the maps' kerbs have the same dimensions as the others.
    let marked: Vec<String> =
        Kind::Roundabout.names().filter(|name| !name.ends_with("-maps")).map(str::to_owned).collect();
    let known: Vec<Road> = marked.iter().map(|name| Road::named(name)).collect::<Result<_, _>>()?;
    let panel = |x: &'static str, measure: &dyn Fn(&Road) -> f64| Panel {
        x,
        values: roads.iter().map(|road| measure(&road.roundabout)).collect(),
        marks: known.iter().map(measure).collect(),
    };
    let picture = Histograms {
        title: format!("{} random roads of {}, and the measured roundabouts", roads.len(), distribution.name),
        subtitle: format!("Seed {}. Each diamond is a measured roundabout.", args.seed),
        marked,
        panels: vec![
            panel("island radius [m]", &Road::island_radius),
            panel("outer radius of the ring [m]", &Road::outer_radius),
            panel("width of a ring lane [m]", &|roundabout| {
                let radii = roundabout.lane_radii();
                match radii.as_slice() {
                    [first, second, ..] => second - first,
                    _ => roundabout.outer_radius() - roundabout.island_radius() - 2.0 * roundabout.gutter(),
                }
            }),
            panel("arms", &|roundabout| roundabout.arms().count() as f64),
            panel("least gap between arms [deg]", &|roundabout| roundabout.least_gap().to_degrees()),
            panel("islands beside the central one", &|roundabout| {
                roundabout.kerbs(offtrack::map::Gutter::Drivable).loops.len() as f64 - 2.0
            }),
            panel("tightest radius of a route's centre line [m]", &|roundabout| {
                roundabout.routes(approach, departure, 5.0).map_or(f64::NAN, |routes| {
                    routes.iter().map(|route| route.centre_line.least_radius()).fold(f64::INFINITY, f64::min)
                })
            }),
            panel("least distance of a route from a kerb [m]", &|roundabout| {
                lane_clearance(roundabout, approach, departure)
            }),
            panel("mean length of a route [m]", &|roundabout| {
                roundabout.routes(approach, departure, 5.0).map_or(f64::NAN, |routes| {
                    routes.iter().map(|route| route.centre_line.length()).sum::<f64>() / routes.len() as f64
                })
            }),
        ],
    };
    let file = args.plot.as_deref().unwrap_or(Path::new("the plot"));
    picture.drawn().map_err(|error| Error::write(file)(std::io::Error::other(error)))
}

/// What was drawn, and why draws were refused.
fn summary(distribution: &Distribution, args: &Args, roads: &[RandomRoad]) -> String {
    let mut refused = Refused::default();
    roads.iter().for_each(|road| refused.add(&road.refused));
    let draws = refused.total() as usize + roads.len();
    let share = |n: usize| 100.0 * n as f64 / draws as f64;
    let mut text = String::new();
    let (name, seed, n) = (&distribution.name, args.seed, roads.len());
    let noun = if n == 1 { "road" } else { "roads" };
    // Writing to a string cannot fail.
    let follows = if 0 < refused.total() { "; refused:" } else { "" };
    let _ = writeln!(text, "{n} {noun} of {name}, seed {seed}: {:.1} % of {draws} draws are valid{follows}", share(n));
    let mut reasons = Reason::ALL.to_vec();
    reasons.sort_by_key(|&reason| std::cmp::Reverse(refused.count(reason)));
    for reason in reasons.into_iter().filter(|&reason| 0 < refused.count(reason)) {
        let count = refused.count(reason);
        let _ = writeln!(text, "{count:>7} {:>5.1} %  {}", share(count as usize), reason.words());
    }
    for path in [&args.output, &args.plot].into_iter().flatten() {
        let _ = writeln!(text, "written: {}", shown_path(path));
    }
    text
}
