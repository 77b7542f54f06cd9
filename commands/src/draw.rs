//! Draws a roundabout, or a truck's swept path on one of its routes, or writes polygons and waypoints as JSON.

use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use offtrack::files::reader::shown;
use offtrack::files::shipped::{Kind, Source};
use offtrack::map::chosen::is_map;
use offtrack::map::route::Route;
use offtrack::map::{Gutter, Road};
use offtrack::scenario::{APPROACH, DEPARTURE, WAYPOINT_SPACING};
use offtrack::traffic::Network;
use offtrack::vehicle::Vehicle;
use offtrack_drawing::conflicts;
use offtrack_drawing::figure::{self, Straights};
use offtrack_drawing::sweep::{Driven, Sweep};
use offtrack_drawing::{json, rasterised};

use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;

use crate::import::PlaceArgs;
use crate::{outputs, roads};

/// Draw a roundabout, or a truck's swept path on one of its routes.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A roundabout's name, the path of its file or of an OpenDRIVE map (.xodr), or a random road: wide/7/12 is road 12
    /// of seed 7 of the distribution wide.
    roundabout: String,
    #[command(flatten)]
    place: PlaceArgs,
    /// The file to write: .svg, .png, or .json for polygons and waypoints.
    ///
    /// JSON: {"solids": [[[x, y], ...], ...], "drivable": [[[x, y], ...], ...], "routes": [{"name", "waypoints": [[x,
    /// y, heading], ...]}], "frame": {"origin", "hand"}} in metres and radians, x east, y north, the ring's centre at
    /// the origin, which lies at frame.origin in the map. On the hand "left" the simulator drives the road as its
    /// mirror image in the x axis. No polygon repeats its first point at its end; curves are within 1 cm. `drivable` is
    /// the surface's outer boundary, then one hole for each island. `solids` are the islands, then the ground beyond
    /// the outer boundary as two polygons, north and south, up to 5 m past the kerbs. So a point is drivable when an
    /// odd number of `drivable` contain it, and solid when any of `solids` does. With aprons there is `aprons`:
    /// [[outer edge, inner edge], ...].
    ///
    /// With --route also "sweep": {"vehicle", "load", "speed_kmh", "own_lane_suffices", "tractor_clearance",
    /// "trailer_clearance", with aprons "apron_clearance" (negative on one), "tractor_area", "trailer_area", "limits":
    /// [{"limit", "unit", "has", "needs", "exceeded", "stretches": [[from, to], ...]}, ...], "demands": [[station,
    /// steer angle, steer rate, lateral acceleration, load transfer ratio], ...]}. Clearances are the least, negative
    /// beyond a kerb (m). Areas are what a unit sweeps, as polygons within 5 mm: boundaries counter-clockwise, holes
    /// clockwise. The limits are lock (deg), steer_rate (deg/s), tyres (g) and rollover (ratio); `stretches` are
    /// stations of the front axle on the route (m) where one is exceeded. `demands` has a row every 0.25 m, in m, deg,
    /// deg/s, g and 1, left positive. `own_lane_suffices` is true where the path touches no kerb and the lock allows
    /// it.
    #[arg(short, long, verbatim_doc_comment)]
    output: PathBuf,
    /// Draw the swept path on this route: N-left-3, or 16m/N-left-3. JSON then lists this route alone. Lock, steer
    /// rate, tyres and rollover are compared with what the path needs, and printed.
    #[arg(long)]
    route: Option<String>,
    /// Draw the paths of cars and where those from different arms meet, as `traffic` drives them; not as JSON.
    #[arg(long, conflicts_with = "route")]
    traffic: bool,
    /// With --route: a vehicle's name, or the path of its file.
    #[arg(long, default_value = "daf_xf", requires = "route")]
    vehicle: String,
    /// With --route: one of the vehicle's loads.
    #[arg(long, default_value = "empty", requires = "route")]
    load: String,
    /// With --route: speed at which the front axle follows the lane's centre (km/h).
    #[arg(long, default_value_t = 30.0, requires = "route")]
    speed_kmh: f64,
    /// Whether gutters may be driven on.
    #[arg(
        long,
        default_value = "drivable",
        value_parser = PossibleValuesParser::new(["drivable", "solid"]).map(gutter)
    )]
    gutter: Gutter,
    /// Length of the routes before the ring (m).
    #[arg(long, default_value_t = APPROACH)]
    approach: f64,
    /// Length of the routes after the ring (m).
    #[arg(long, default_value_t = DEPARTURE)]
    departure: f64,
    /// Width of a PNG (pixels) [default: 1000].
    #[arg(long)]
    size: Option<u32>,
}

/// The format of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Svg,
    Png,
    Json,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let format = format(&args.output)?;
    if let Some(size) = args.size.filter(|size| format != Format::Png || !(200..=8000).contains(size)) {
        let expected = if format == Format::Png { "must lie in 200..8000 pixels" } else { "is for .png: leave it out" };
        return Err(Error::Setting { name: "--size", value: size.to_string(), expected: expected.into() });
    }
    check_speed(args.speed_kmh)?;
    length("--approach", args.approach)?;
    length("--departure", args.departure)?;
    if !is_map(Path::new(&args.roundabout)) {
        args.place.check_absent()?;
    }
    if args.traffic && format == Format::Json {
        let expected = "must end in .svg or .png with --traffic".into();
        return Err(Error::Setting { name: "--output", value: args.output.display().to_string(), expected });
    }
    let read = [("ROUNDABOUT", &args.roundabout), ("--vehicle", &args.vehicle)];
    let read = read.map(|(flag, name)| (flag, Some(Path::new(name))));
    outputs::distinct(&[("--output", Some(&args.output))], &read)?;
    let driven = roads::road(&args.roundabout, &args.place)?;
    let roundabout = driven.seen();
    let routes = roundabout.routes(args.approach, args.departure, WAYPOINT_SPACING).map_err(|leaves| {
        let (flag, value) =
            if leaves.part == "approach" { ("--approach", args.approach) } else { ("--departure", args.departure) };
        Error::Setting { name: flag, value: format!("{value} m"), expected: leaves.to_string() }
    })?;
    let route = args.route.as_deref().map(|name| chosen(&routes, name)).transpose()?;
    let sweep = route.map(|route| sweep(args, &driven, &roundabout, route)).transpose()?;
    let bytes = if format == Format::Json {
        let shown = route.map_or(routes.as_slice(), std::slice::from_ref);
        let text = json::written(&driven, args.gutter, shown, sweep.as_ref());
        text.map_err(|error| Error::write(&args.output)(error.into()))?.into_bytes()
    } else {
        let straights = Straights { approach: args.approach, departure: args.departure };
        let page = match &sweep {
            None if args.traffic => {
                let network = Network::bake(&driven).map_err(|error| Error::Setting {
                    name: "ROUNDABOUT",
                    value: args.roundabout.clone(),
                    expected: error.to_string(),
                })?;
                conflicts::drawn(&driven, &network, &routes, straights, args.gutter)
            }
            None => figure::roundabout(&roundabout, &routes, straights, args.gutter),
            Some(sweep) => figure::swept_path(&roundabout, &routes, straights, args.gutter, sweep),
        };
        let drawn = page.and_then(|svg| {
            if format == Format::Png { rasterised(&svg, args.size.unwrap_or(1000)) } else { Ok(svg.into_bytes()) }
        });
        drawn.map_err(|error| Error::write(&args.output)(std::io::Error::other(error)))?
    };
    files::write_whole(&args.output, &bytes)?;
    match sweep {
        None => Ok(()),
        Some(sweep) => {
            let [path, needs] = sweep.lines();
            files::print(&format!("{}\n{path}\n{needs}\n", sweep.verdict()))
        }
    }
}

/// The path of the vehicle on a route of a road as it lies in the world, `seen`; `road` is as it is driven.
fn sweep<'a>(args: &Args, road: &Road, seen: &Road, route: &'a Route) -> Result<Sweep<'a>, Error> {
    let vehicle = Vehicle::find(&args.vehicle)?;
    check_load(&vehicle, &args.load)?;
    let name = Source::find(Kind::Vehicle, &args.vehicle)?.stem();
    let driven = Driven { vehicle: name, load: args.load.clone(), speed_kmh: args.speed_kmh };
    Ok(Sweep::new(&vehicle.seen_on(road), driven, &seen.unit_kerbs_beyond_ends(args.gutter), route))
}

fn format(output: &Path) -> Result<Format, Error> {
    match output.extension().and_then(|extension| extension.to_str()) {
        Some("svg") => Ok(Format::Svg),
        Some("png") => Ok(Format::Png),
        Some("json") => Ok(Format::Json),
        _ => {
            let value = output.display().to_string();
            Err(Error::Setting { name: "--output", value, expected: "must end in .svg, .png or .json".into() })
        }
    }
}

/// The constant speed of a path must be one that a truck drives.
pub fn check_speed(speed_kmh: f64) -> Result<(), Error> {
    if (1.0..=90.0).contains(&speed_kmh) {
        return Ok(());
    }
    Err(Error::Setting {
        name: "--speed-kmh",
        value: format!("{} km/h", shown(speed_kmh)),
        expected: "must lie in 1..90 km/h".into(),
    })
}

/// The load must be one of the vehicle's.
pub fn check_load(vehicle: &Vehicle, load: &str) -> Result<(), Error> {
    if vehicle.loads.contains_key(load) {
        return Ok(());
    }
    let loads: Vec<&str> = vehicle.loads.keys().map(String::as_str).collect();
    let expected = format!("the vehicle has {}", loads.join(", "));
    Err(Error::Setting { name: "--load", value: load.to_owned(), expected })
}

/// Whether a gutter may be driven on, as a flag says it.
pub fn gutter(word: String) -> Gutter {
    if word == "solid" { Gutter::Solid } else { Gutter::Drivable }
}

fn length(flag: &'static str, value: f64) -> Result<(), Error> {
    if (5.0..=500.0).contains(&value) {
        return Ok(());
    }
    Err(Error::Setting { name: flag, value: format!("{} m", shown(value)), expected: "must lie in 5..500 m".into() })
}

/// The route with this name; the roundabout's own name before it may be left out.
fn chosen<'a>(routes: &'a [Route], name: &str) -> Result<&'a Route, Error> {
    let short = |route: &'a Route| route.name.rsplit('/').next().unwrap_or(&route.name);
    routes.iter().find(|route| route.name == name || short(route) == name).ok_or_else(|| {
        let known: Vec<&str> = routes.iter().map(short).collect();
        Error::Setting {
            name: "--route",
            value: name.to_owned(),
            expected: format!("the roundabout has {}", known.join(", ")),
        }
    })
}
