//! Records episodes: as a film, or one as data or as a still with the swept paths of both units.
//!
//! The truck drives in the batch of an evaluation with the same seed, so that its episode is the one that `evaluate`
//! counts.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use offtrack::map::procedural;
use offtrack::map::route::Route;
use offtrack::map::{Gutter, Road};
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::Engine;
use offtrack::world::World;

use offtrack_drawing::comparison::Comparison;
use offtrack_drawing::episode::Scene;
use offtrack_drawing::film::{self, Take};
use offtrack_drawing::rasterised;
use offtrack_evaluation::episodes::Episodes;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;
use offtrack_evaluation::policies::Controller;
use offtrack_evaluation::recording::{Of, Recorder, Recording, Track};

use crate::once::once;
use crate::{devices, outputs, policies, progress, roads};

/// Record an episode: as a film, as a picture with the swept paths of both units, or as data.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    policy: policies::Choice,
    /// One of the benchmark's routes, of any split: 20m/N-left-4; or one of a random road: wide/7/12/S-left-3. A film
    /// may have several, each with its own --route, one after another.
    #[arg(long, required = true)]
    route: Vec<String>,
    /// Only trucks with this load, where the benchmark has several. Given several times, a film shows each load in
    /// turn, and a .png or .svg one beside the other, with speed and load transfer over the distance along the route.
    #[arg(long)]
    load: Vec<String>,
    /// The file to write: .gif, .png, .svg, or .json for data.
    ///
    /// A film runs at twice the speed and shows the distance sensors. JSON: {"benchmark", "route", "policy", "seed",
    /// "episode", "episodes", "step" (s), "ended", "class": {"vehicle", "load"}: their names, where the benchmark has
    /// several, "vehicle": dimensions and sensors of the truck that drove, "actions": [[steer angle, speed], ...],
    /// "map": {"drivable", "lanes"}, "centre_line", "frames": [...], "vehicles": [[...], ...]: in each frame the others
    /// by slot, of which a trailer's is 40 more than its tractor's}. Frame 0 is the start, frame n the state after step
    /// n, the step that ended the episode included. Metres, seconds and radians, x east, y north, the ring's centre at
    /// the origin.
    #[arg(short, long, verbatim_doc_comment)]
    output: PathBuf,
    /// A benchmark's name, or the path of its file.
    #[arg(long, default_value = "attard2023")]
    benchmark: String,
    /// Seed of the start poses and of random actions.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Which of the route's episodes in an evaluation, from 0.
    #[arg(long, default_value_t = 0)]
    episode: usize,
    /// How many episodes a route that evaluation has: start poses depend on it.
    #[arg(long, default_value_t = 30)]
    episodes: usize,
    /// Width of a film or a PNG (pixels); by default 720 for a film, 1000 for a PNG.
    #[arg(long)]
    size: Option<u32>,
    #[command(flatten)]
    device: devices::Choice,
}

/// The format of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Gif,
    Png,
    Svg,
    Json,
}

/// The format of the file, once what is asked for makes sense.
fn checked(args: &Args) -> Result<Format, Error> {
    let format = format(&args.output)?;
    outputs::distinct(&[("--output", Some(&args.output))], &args.policy.files())?;
    if let (Some(size), Format::Svg | Format::Json) = (args.size, format) {
        return Err(Error::Setting {
            name: "--size",
            value: size.to_string(),
            expected: "is for .gif and .png: leave it out".into(),
        });
    }
    if let Some(size) = args.size
        && !(200..=4000).contains(&size)
    {
        return Err(Error::Setting {
            name: "--size",
            value: size.to_string(),
            expected: "must lie in 200..4000 pixels".into(),
        });
    }
    if !(1..=100_000).contains(&args.episodes) {
        return Err(Error::Setting {
            name: "--episodes",
            value: args.episodes.to_string(),
            expected: "must lie in 1..100000".into(),
        });
    }
    if args.episodes <= args.episode {
        let expected = format!("must lie in 0..{}: --episodes says how many there are", args.episodes - 1);
        return Err(Error::Setting { name: "--episode", value: args.episode.to_string(), expected });
    }
    if format != Format::Gif && 1 < args.route.len() {
        let expected = "must end in .gif: other files hold one episode, one --route".to_owned();
        return Err(Error::Setting { name: "--output", value: args.output.display().to_string(), expected });
    }
    if format == Format::Json && 1 < args.load.len() {
        let expected = "must end in .gif, .png or .svg: data are of one episode, one --load".to_owned();
        return Err(Error::Setting { name: "--output", value: args.output.display().to_string(), expected });
    }
    once("--load", args.load.iter().cloned(), "is given twice; each load once")?;
    Ok(format)
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let format = checked(args)?;
    let engine = args.device.open()?.engine;
    let loads: Vec<Option<&str>> =
        if args.load.is_empty() { vec![None] } else { args.load.iter().map(|load| Some(load.as_str())).collect() };
    let each = || args.route.iter().flat_map(|route| loads.iter().map(move |&load| (route, load)));
    let scenarios =
        each().map(|(route, load)| scenario(args, route, load)).collect::<Result<Vec<Scenario>, Error>>()?;
    let chosen = |(scenario, (route, _)): (_, (&String, _))| Chosen::new(scenario, route);
    let chosen = scenarios.iter().zip(each()).map(chosen).collect::<Result<Vec<Chosen>, Error>>()?;
    let mut takes = Vec::new();
    for (scenario, chosen) in scenarios.iter().zip(&chosen) {
        let world = roads::world(scenario)?;
        let mut policy = args.policy.open(scenario, &world, &engine, args.seed)?;
        let track = driven(args, scenario, &world, &engine, chosen, policy.as_mut())?;
        let Chosen { roundabout, route, .. } = *chosen;
        let of = Of { scenario, world: &world, roundabout, route, policy: policy.name(), seed: args.seed };
        takes.push(recorded(&of, args.episode, args.episodes, track.seen(roundabout)));
    }
    let bytes = bytes(format, args.size, &takes);
    files::write_whole(&args.output, &bytes.map_err(unwritten(&args.output))?)
}

/// A recording and what is drawn around it.
struct Recorded {
    recording: Recording,
    /// The roundabout as it lies in the world.
    roundabout: Road,
    gutter: Gutter,
    route: Route,
    /// Distances along the route at which its ring begins and ends (m).
    ring: [f64; 2],
}

impl Recorded {
    fn scene(&self) -> Result<Scene<'_>, Failure> {
        Ok(Scene::new(&self.recording, &self.roundabout, self.gutter, &self.route)?)
    }
}

/// A failure to draw or to encode a picture.
type Failure = Box<dyn std::error::Error + Send + Sync>;

/// The error for a picture that cannot be made.
fn unwritten(file: &Path) -> impl Fn(Failure) -> Error {
    |failure| Error::write(file)(std::io::Error::other(failure))
}

/// The recording of a track, and what is drawn around it; see [`Of::recording`].
fn recorded(of: &Of, episode: usize, episodes: usize, track: Track) -> Recorded {
    let Of { scenario, roundabout, route, .. } = *of;
    let recording = of.recording(episode, episodes, track);
    let ring = [scenario.approach, route.centre_line.length() - scenario.departure];
    Recorded {
        recording,
        roundabout: roundabout.seen(),
        gutter: scenario.gutter,
        route: roundabout.seen_route(route),
        ring,
    }
}

/// Writes a film of a track, in the usual size.
pub(super) fn write_film(of: &Of, file: &Path, episode: usize, episodes: usize, track: Track) -> Result<(), Error> {
    let bytes = bytes(Format::Gif, None, &[recorded(of, episode, episodes, track)]).map_err(unwritten(file))?;
    files::write_whole(file, &bytes)
}

/// The recordings in the format asked for: a film of all of them, a picture of one or of several on one route, or the
/// first as data.
fn bytes(format: Format, size: Option<u32>, recorded: &[Recorded]) -> Result<Vec<u8>, Failure> {
    if format == Format::Json {
        let mut text = serde_json::to_string(&recorded[0].recording)?;
        text.push('\n');
        return Ok(text.into_bytes());
    }
    if format != Format::Gif {
        let svg = match recorded {
            [one] => one.scene()?.still(),
            several => Comparison {
                scenes: several.iter().map(Recorded::scene).collect::<Result<_, _>>()?,
                ring: several[0].ring,
            }
            .drawn()?,
        };
        return if format == Format::Png { Ok(rasterised(&svg, size.unwrap_or(1000))?) } else { Ok(svg.into_bytes()) };
    }
    let mut takes = Vec::new();
    for of in recorded {
        let frames = film::frames(of.recording.frames.len(), of.recording.step);
        takes.push(Take { scene: of.scene()?, frames });
    }
    let bar = progress::Bar::new("drawing", "frames", takes.iter().map(|take| take.frames.len()).sum());
    Ok(film::gif(&takes, size.unwrap_or(720), || bar.advance())?)
}

fn format(output: &Path) -> Result<Format, Error> {
    match output.extension().and_then(|extension| extension.to_str()) {
        Some("gif") => Ok(Format::Gif),
        Some("png") => Ok(Format::Png),
        Some("svg") => Ok(Format::Svg),
        Some("json") => Ok(Format::Json),
        _ => {
            let value = output.display().to_string();
            Err(Error::Setting { name: "--output", value, expected: "must end in .gif, .png, .svg or .json".into() })
        }
    }
}

/// A route of a benchmark, its roundabout, and its index in its split.
struct Chosen<'a> {
    route: &'a Route,
    roundabout: &'a Road,
    split: Split,
    in_split: usize,
}

impl<'a> Chosen<'a> {
    fn new(scenario: &'a Scenario, name: &str) -> Result<Chosen<'a>, Error> {
        let Some((index, (roundabout, route))) =
            scenario.routes().enumerate().find(|(_, (_, route))| route.name == name)
        else {
            return Err(roads::unknown(scenario, "--route", name));
        };
        let within =
            |split: Split| Some((split, scenario.split(split).iter().position(|&other| other as usize == index)?));
        let (split, in_split) =
            Split::ALL.into_iter().find_map(within).expect("a benchmark's route is in one of its splits");
        Ok(Chosen { route, roundabout: &scenario.places[roundabout].roundabout, split, in_split })
    }
}

/// The benchmark with the split of the route that is recorded or, where it does not have the route, on the road of the
/// route alone; with the trucks of one load, if it is named.
fn scenario(args: &Args, route: &str, load: Option<&str>) -> Result<Scenario, Error> {
    let mut scenario = roads::with_load(roads::benchmark(&args.benchmark)?, load)?;
    let of = |split: &&Split| scenario.split_names(**split).contains(&route);
    if let Some(&split) = Split::ALL.iter().find(of) {
        scenario.keep(&[split]);
        return Ok(scenario);
    }
    let Some((road, _)) = route.rsplit_once('/').filter(|(road, _)| procedural::address(road).is_some()) else {
        return Err(roads::unknown(&scenario, "--route", route));
    };
    if scenario.places.iter().any(|place| place.roundabout.name == road) {
        return Err(roads::unknown(&scenario, "--route", route));
    }
    Ok(scenario.on(procedural::find(road)?)?)
}

/// Drives the batch of the evaluation until the episode has ended.
fn driven(
    args: &Args,
    scenario: &Scenario,
    world: &Arc<World>,
    engine: &Engine,
    chosen: &Chosen,
    policy: &mut dyn Controller,
) -> Result<Track, Error> {
    let (routes, env) = (scenario.split(chosen.split), chosen.in_split * args.episodes + args.episode);
    let begun = Episodes::begin(engine.clone(), world.clone(), routes, args.episodes, args.seed)?;
    let mut simulator = begun.into_simulator();
    let mut recorder = Recorder::new(world, simulator.batch(), [env]);
    let most = world.most_steps(&simulator.batch().truck[env]);
    let bar = progress::Bar::new("driving", "steps", most);
    while recorder.is_running() {
        policy.step(&mut simulator)?;
        recorder.follow(world, simulator.batch());
        bar.advance();
    }
    drop(bar);
    // A device that failed in the last step reports it here.
    simulator.wait()?;
    Ok(recorder.finish().remove(0))
}
