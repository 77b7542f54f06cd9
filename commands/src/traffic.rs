//! Drives cars alone on roads and compares each entry with the Highway Capacity Manual: delay and level of service at
//! a demand, or the capacity beside circulating flows.

mod capacity;
mod demand;
mod service;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use offtrack::files::cache::Loading;
use offtrack::files::reader::shown;
use offtrack::map::Road;
use offtrack::map::chosen::is_map;
use offtrack::map::route::Lane;
use offtrack::traffic::survey::Counts;
use offtrack::traffic::{Mix, Network, Rules, Survey, together};
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;

use crate::import::PlaceArgs;
use crate::progress::Bar;
use crate::{outputs, plot, roads};

/// Steps of a minute.
const STEPS_A_MINUTE: u32 = 600;

/// Drive cars alone on roads: capacity, delay and level of service of each entry lane, beside those of the Highway
/// Capacity Manual.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Roads: names of roundabouts, paths of their files or of OpenDRIVE maps (.xodr), or random roads, as `draw` takes
    /// them.
    #[arg(required = true, value_name = "ROAD")]
    roads: Vec<String>,
    #[command(flatten)]
    place: PlaceArgs,
    /// Cars an hour: of the whole road, 1500, spread over all entry lanes and exits alike but for U-turns, of which
    /// there are a tenth; or of arms and from arm to arm, N=400,E-W=120, and no others.
    #[arg(long, default_value = "1500")]
    demand: String,
    /// Fraction of the cars that are of a kind: vans=0.25, 7 m long; buses=0.02, rigid_trucks=0.05 and
    /// tractor_trailers=0.03; rude=0.1, whose drivers let nobody in; repeatable.
    #[arg(long, value_name = "KIND=FRACTION")]
    share: Vec<String>,
    /// Time that is counted of each run, after two minutes in which the road fills (min).
    #[arg(long, default_value_t = 60)]
    minutes: u32,
    /// Number of runs.
    #[arg(long, default_value_t = 8)]
    runs: u32,
    /// Seed of the runs.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Measure capacities instead: what enters from a queue without end, arm by arm, beside flows of 0 to 1,200 cars an
    /// hour that the other arms feed.
    #[arg(long, conflicts_with = "demand")]
    capacity: bool,
    /// The file to write what is printed to, as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
    /// With --capacity: the file to plot capacities to over the circulating flow, beside the manual's curves, .svg or
    /// .png.
    #[arg(long, requires = "capacity")]
    plot: Option<PathBuf>,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    within("--minutes", args.minutes, 1, 1_440)?;
    within("--runs", args.runs, 1, 1_000)?;
    if let Some(plot) = &args.plot {
        plot::check("--plot", plot)?;
    }
    let read: Vec<outputs::Named> = args.roads.iter().map(|road| ("ROAD", Some(Path::new(road)))).collect();
    outputs::distinct(&[("--json", args.json.as_deref()), ("--plot", args.plot.as_deref())], &read)?;
    let mix = mix(&args.share)?;
    let roads: Vec<Road> = args.roads.iter().map(|name| roads::road(name, &args.place)).collect::<Result<_, _>>()?;
    if !args.roads.iter().any(|name| is_map(Path::new(name))) {
        args.place.check_absent()?;
    }
    let places = roads.into_iter().map(|road| Place::new(road, mix)).collect::<Result<Vec<Place>, Error>>()?;
    if args.capacity { capacity::run(args, &places, mix) } else { service::run(args, &places, mix) }
}

/// A road and its tables.
struct Place {
    road: Road,
    network: Network,
}

impl Place {
    fn new(road: Road, mix: Mix) -> Result<Place, Error> {
        let bake = |loading: &Loading| Network::cached(&road, mix.has_large(), loading.cache);
        let network = roads::loading("baking", bake);
        let network = network.map_err(|error| {
            let said = error.to_string();
            setting("ROAD", &road.name, said.strip_prefix(&format!("{}: ", road.name)).unwrap_or(&said))
        })?;
        Ok(Place { road, network })
    }

    fn survey<'a>(&'a self, rules: &'a Rules) -> Result<Survey<'a>, Error> {
        Survey::new(&self.network, rules).map_err(|error| setting("ROAD", &self.road.name, &error.to_string()))
    }

    /// Arm and lane of a source, as they are called on the road itself.
    fn source_name(&self, source: usize) -> (String, &'static str) {
        let source = &self.network.sources[source];
        let arm = self.road.arms().nth(source.entry as usize).unwrap_or_default();
        let lane = if source.lane == 0 { Lane::Right } else { Lane::Left };
        (arm.to_owned(), lane.seen(self.road.is_mirrored()).name())
    }
}

/// A bar over all runs.
fn bar(n_runs: usize) -> Bar {
    Bar::new("driving", "runs", n_runs)
}

/// Writes what was found as JSON, where that is asked for.
fn write_json(args: &Args, value: &impl serde::Serialize) -> Result<(), Error> {
    args.json.as_ref().map_or(Ok(()), |file| files::write_json(file, value))
}

/// A line about vehicles that stood in a blocked ring for ever; empty where there were none.
fn taken_away(n: u64) -> String {
    match n {
        0 => String::new(),
        1 => "1 vehicle stood in a blocked ring for two minutes and was taken away.\n".to_owned(),
        n => format!("{n} vehicles stood in a blocked ring for two minutes and were taken away.\n"),
    }
}

fn setting(name: &'static str, value: &str, expected: &str) -> Error {
    Error::Setting { name, value: value.to_owned(), expected: expected.to_owned() }
}

fn within(name: &'static str, value: u32, least: u32, most: u32) -> Result<(), Error> {
    let expected = format!("must lie in {least}..{most}");
    if (least..=most).contains(&value) { Ok(()) } else { Err(setting(name, &value.to_string(), &expected)) }
}

/// The kinds of cars that the flags ask for.
fn mix(shares: &[String]) -> Result<Mix, Error> {
    let mut mix = Mix::default();
    for (index, share) in shares.iter().enumerate() {
        if shares[..index].iter().any(|other| other.split('=').next() == share.split('=').next()) {
            return Err(setting("--share", share, "its kind is given twice: leave one out"));
        }
        let parsed = share.split_once('=').and_then(|(kind, fraction)| Some((kind, fraction.parse::<f32>().ok()?)));
        let fraction = match parsed {
            Some(("vans", fraction)) => Some((&mut mix.vans, fraction)),
            Some(("rude", fraction)) => Some((&mut mix.rude, fraction)),
            Some(("buses", fraction)) => Some((&mut mix.large[0], fraction)),
            Some(("rigid_trucks", fraction)) => Some((&mut mix.large[1], fraction)),
            Some(("tractor_trailers", fraction)) => Some((&mut mix.large[2], fraction)),
            _ => None,
        };
        match fraction.filter(|(_, fraction)| (0.0..=1.0).contains(fraction)) {
            Some((of, fraction)) => *of = fraction,
            None => {
                let expected = "must be vans=F, buses=F, rigid_trucks=F, tractor_trailers=F or rude=F with F in 0..1";
                return Err(setting("--share", share, expected));
            }
        }
    }
    if 1.0 < together(mix.vans.into(), mix.large.map(f64::from)) {
        return Err(setting("--share", &shares.join(" "), "vans, buses and trucks must be at most 1 together"));
    }
    Ok(mix)
}

/// Large vehicles as fractions of all: those asked for, and those that came. Where one needs an oncoming lane a car
/// comes instead.
#[derive(Clone, Copy, serde::Serialize)]
struct LargeShare {
    asked: f64,
    came: f64,
    /// How many vehicles came.
    #[serde(skip)]
    of: u64,
}

impl LargeShare {
    fn of(mix: Mix, counts: &Counts) -> LargeShare {
        LargeShare { asked: mix.heavy(), came: counts.heavy(), of: counts.entered }
    }

    /// What a reader must know: far fewer came than were asked for.
    fn note(&self) -> Option<String> {
        let missing = (self.asked - self.came) * self.of as f64;
        // More than chance: three deviations of the count.
        let chance = 3.0 * (self.asked * self.of as f64).sqrt();
        (chance < missing).then(|| {
            let [asked, came] = [self.asked, self.came].map(|part| rounded(100.0 * part, 1));
            format!("{came} % were large, not {asked}: where one needs an oncoming lane a car comes instead.\n")
        })
    }
}

/// A number in a column, rounded.
fn rounded(value: f64, digits: i32) -> String {
    let unit = 10f64.powi(digits);
    shown((value * unit).round() / unit)
}

/// Lines of columns: the first two to the left, the others to the right.
fn table(rows: &[Vec<String>]) -> String {
    let n_columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..n_columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).enumerate();
        let cells = cells.map(|(column, (cell, &width))| match column {
            0 | 1 => format!("{cell:<width$}"),
            _ => format!("{cell:>width$}"),
        });
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}
