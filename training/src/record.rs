//! Records one episode: as data, as a moving picture, or as a still with the swept paths of both units.
//!
//! The truck drives among those of an examination with the same seed, so that its episode is the very one that `evaluate` counts.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use indicatif::{ProgressBar, ProgressStyle};
use offtrack::roundabout::Roundabout;
use offtrack::route::Route;
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::world::World;

use crate::drivers::{self, Driver, PURSUIT_LOOK_AHEAD};
use crate::error::Error;
use crate::files;
use crate::recording::{Map, Measures, Recorder, Recording, centre_line};

/// Record one episode as data (.json).
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A policy file, `pursuit` (pure pursuit of the centre line) or `random`.
    #[arg(long)]
    policy: String,
    /// One of the benchmark's routes, to learn on or to be examined on: 20m/N-left-3.
    #[arg(long)]
    route: String,
    /// The file to write.
    #[arg(short, long)]
    output: PathBuf,
    /// A benchmark's name, or the path of its file.
    #[arg(long, default_value = "attard2023")]
    benchmark: String,
    /// What the start poses are drawn from.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Which of the route's episodes in an examination, from 0.
    #[arg(long, default_value_t = 0)]
    episode: usize,
    /// How many episodes a route that examination has.
    #[arg(long, default_value_t = 30)]
    episodes: usize,
    /// With `pursuit`: distance to the point pursued [m].
    #[arg(long, default_value_t = PURSUIT_LOOK_AHEAD, allow_negative_numbers = true)]
    look_ahead: f32,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    format(&args.output)?;
    if !(1..=100_000).contains(&args.episodes) {
        return Err(Error::Flag { flag: "--episodes", value: args.episodes.to_string(), expected: "must lie in 1..100000".into() });
    }
    if args.episodes <= args.episode {
        let expected = format!("must lie in 0..{}: --episodes says how many there are", args.episodes - 1);
        return Err(Error::Flag { flag: "--episode", value: args.episode.to_string(), expected });
    }
    let scenario = Scenario::read(&files::benchmark(&args.benchmark)?)?;
    let chosen = Chosen::new(&scenario, &args.route)?;
    let world = Arc::new(World::bake(&scenario));
    let mut driver = drivers::named(&args.policy, args.look_ahead, args.seed, &world)?;
    let recording = recorded(args, &scenario, &world, &chosen, driver.as_mut())?;
    let mut text = serde_json::to_string(&recording).map_err(|error| Error::write(&args.output)(error.into()))?;
    text.push('\n');
    files::write_whole(&args.output, text.as_bytes())
}

fn format(output: &Path) -> Result<(), Error> {
    match output.extension().and_then(|extension| extension.to_str()) {
        Some("json") => Ok(()),
        _ => {
            let value = output.display().to_string();
            Err(Error::Flag { flag: "--output", value, expected: "must end in .json".into() })
        }
    }
}

/// A route of a benchmark, where it runs and where it stands in its split.
struct Chosen<'a> {
    route: &'a Route,
    roundabout: &'a Roundabout,
    split: Split,
    place: usize,
}

impl<'a> Chosen<'a> {
    fn new(scenario: &'a Scenario, name: &str) -> Result<Chosen<'a>, Error> {
        let Some((index, (place, route))) = scenario.routes().enumerate().find(|(_, (_, route))| route.name == name) else {
            return Err(Error::Flag { flag: "--route", value: name.to_owned(), expected: known(scenario, name) });
        };
        let within = |split: Split| Some((split, scenario.split(split).iter().position(|&other| other as usize == index)?));
        let (split, in_split) = within(Split::Test).or_else(|| within(Split::Train)).expect("a benchmark's route is in one of its splits");
        Ok(Chosen { route, roundabout: &scenario.places[place].roundabout, split, place: in_split })
    }
}

/// The routes that a wrong name may have meant: those of the roundabout it begins with, or one of each.
fn known(scenario: &Scenario, name: &str) -> String {
    let of = |place: &offtrack::scenario::Place| place.routes.iter().map(|route| route.name.clone()).collect::<Vec<_>>();
    let meant = scenario.places.iter().find(|place| name.split('/').next() == Some(&place.roundabout.name));
    let names = meant.map_or_else(|| scenario.places.iter().filter_map(|place| of(place).first().cloned()).collect(), of);
    let (from, list) = (&scenario.name, names.join(", "));
    match meant {
        Some(place) => format!("of {} the benchmark {from} has {list}", place.roundabout.name),
        None => format!("a route of the benchmark {from} is needed, such as {list}"),
    }
}

/// Drives the examination that the episode belongs to until the episode has ended.
fn recorded(args: &Args, scenario: &Scenario, world: &Arc<World>, chosen: &Chosen, driver: &mut dyn Driver) -> Result<Recording, Error> {
    let trucks: Vec<u32> = scenario.split(chosen.split).iter().flat_map(|&route| std::iter::repeat_n(route, args.episodes)).collect();
    let env = chosen.place * args.episodes + args.episode;
    let limit = world.routes[trucks[env] as usize].step_limit;
    let mut simulator = Simulator::new(world.clone(), trucks.len(), args.seed, RouteChoice::Fixed(trucks))?;
    let mut recorder = Recorder::new(world, simulator.batch(), [env]);
    let bar = ProgressBar::new(limit.into()).with_style(
        ProgressStyle::with_template("driving {bar:30} {pos} steps, {elapsed}").unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    let mut actions = Vec::new();
    while recorder.is_running() {
        driver.act(world, simulator.batch(), &mut actions);
        simulator.step(&actions)?;
        recorder.follow(world, simulator.batch());
        bar.inc(1);
    }
    bar.finish_and_clear();
    let track = recorder.finish().remove(0);
    Ok(Recording {
        benchmark: scenario.name.clone(),
        route: chosen.route.name.clone(),
        policy: driver.name().to_owned(),
        seed: args.seed,
        episode: args.episode,
        episodes: args.episodes,
        step: scenario.step,
        ended: track.ended.name().to_owned(),
        vehicle: Measures::of(world),
        actions: world.actions.iter().map(|action| [action.steering, action.speed]).collect(),
        map: Map::of(chosen.roundabout, scenario.gutter),
        centre_line: centre_line(chosen.route),
        frames: track.frames,
    })
}
