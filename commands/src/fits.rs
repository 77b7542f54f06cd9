//! Says whether vehicles fit through roads: a row for each route and vehicle, as a table and as files, which a later
//! call of the same command continues.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant, SystemTime};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use offtrack::files::reader::shown as number;
use offtrack::files::shipped::{Kind, Source};
use offtrack::map::chosen::is_map;
use offtrack::map::opendrive::Map;
use offtrack::map::{Gutter, Road};
use offtrack::vehicle::Vehicle;
use offtrack_drawing::fits::sheet::{self, Head, Shown};
use offtrack_drawing::fits::{dxf, geojson, pdf};
use offtrack_evaluation::certificate::attempt::{HOLD, passes};
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;
use offtrack_evaluation::fits::table::{Units, csv, table, verdicts};
use offtrack_evaluation::fits::{Asked, Case, Results, Row, case};
use rayon::prelude::*;

use crate::import::PlaceArgs;
use crate::once::once;
use crate::progress::Bar;
use crate::{draw, export, roads, terminal};

/// Time between two writes of results that come quickly.
const WRITE_EVERY: Duration = Duration::from_secs(2);
/// Results are by name: each must have its own.
const TWICE: &str = "is named twice, and results are by name; give each once, or rename a file";

/// Say whether vehicles fit through roads, on their lane's centre line or by some way that a search finds.
///
/// The exit code is 1 where something does not fit. The same command continues after it was stopped.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Roads: names of roundabouts, paths of their files or of OpenDRIVE maps (.xodr), or random roads, as `draw` takes
    /// them.
    #[arg(required = true, value_name = "ROAD")]
    roads: Vec<String>,
    #[command(flatten)]
    place: PlaceArgs,
    /// A vehicle's name, or the path of its file; repeatable. `all` are those that come with the program.
    #[arg(long, required = true)]
    vehicle: Vec<String>,
    /// One of the vehicles' loads.
    #[arg(long, default_value = "empty")]
    load: String,
    /// Speed of the vehicle, from its start on (km/h).
    #[arg(long, default_value_t = 15.0)]
    speed_kmh: f64,
    /// Distance that tractor and trailer must keep from every kerb (m).
    #[arg(long, default_value_t = 0.0, value_name = "M")]
    clearance: f64,
    /// Only this route of each road, N-left-3, or of one, 16m/N-left-3; repeatable. All without it.
    #[arg(long)]
    route: Vec<String>,
    /// Whether gutters may be driven on.
    #[arg(
        long,
        default_value = "drivable",
        value_parser = PossibleValuesParser::new(["drivable", "solid"]).map(draw::gutter)
    )]
    gutter: Gutter,
    /// Candidates that the search for a way keeps, tried in turn until it finds one, separated by commas.
    #[arg(long, value_delimiter = ',', default_value = "64,512")]
    widths: Vec<usize>,
    /// Print feet and mph in place of metres and km/h, and feet on the sheets; the other files have metres.
    #[arg(long)]
    feet: bool,
    /// The name of the map's coordinate frame, to be stated in GeoJSON, such as urn:ogc:def:crs:EPSG::25832.
    #[arg(long, value_name = "NAME", value_parser = export::crs)]
    crs: Option<String>,
    /// The folder to write: fits.json, fits.csv, verdicts.csv, of each road a sheet at scale, ROAD.svg and ROAD.pdf,
    /// and the swept paths of each vehicle, ROAD-VEHICLE.dxf and ROAD-VEHICLE.geojson.
    #[arg(short, long)]
    output: PathBuf,
}

impl Args {
    fn vehicle_names(&self) -> impl Iterator<Item = &str> {
        self.vehicle.iter().flat_map(|name| match name.as_str() {
            "all" => Kind::Vehicle.names().collect::<Vec<&str>>(),
            name => vec![name],
        })
    }

    fn units(&self) -> Units {
        if self.feet { Units::Feet } else { Units::Metric }
    }
}

/// Runs the command; whether everything fits.
pub fn run(args: &Args) -> Result<bool, Error> {
    let asked = asked(args)?;
    let roads: Vec<Road> = args.roads.iter().map(|name| roads::road(name, &args.place)).collect::<Result<_, _>>()?;
    let maps: Vec<&Path> = args.roads.iter().map(Path::new).filter(|file| is_map(file)).collect();
    if maps.is_empty() {
        args.place.check_absent()?;
    }
    for file in maps.into_iter().filter(|_| args.crs.is_some()) {
        export::check_frame(&Map::read(file, args.place.hand)?, args.crs.as_ref())?;
    }
    let vehicles: Vec<(String, Vehicle)> =
        args.vehicle_names().map(|name| vehicle(name, &args.load)).collect::<Result<_, _>>()?;
    once("ROAD", roads.iter().map(stem), TWICE)?;
    once("--vehicle", vehicles.iter().map(|(name, _)| name.clone()), TWICE)?;
    let both = roads.iter().flat_map(|road| vehicles.iter().map(|(name, _)| of_both(road, name)));
    once("ROAD-VEHICLE", both, TWICE)?;
    check_routes(&roads, &args.route)?;
    let mut results = Results::new(asked.clone(), humantime::format_rfc3339_seconds(SystemTime::now()).to_string());
    roads.iter().for_each(|road| results.add_road(road));
    vehicles.iter().for_each(|(name, vehicle)| results.add_vehicle(name, vehicle));
    files::make_folder(&args.output)?;
    let file = args.output.join("fits.json");
    check_files(args, &file, &roads, &vehicles)?;
    results.continue_from(&file)?;
    results.write(&file)?;
    let n_rows = wanted_rows(&roads, &args.route) * vehicles.len();
    let bar = Bar::new("answering", "routes and vehicles", n_rows);
    let work = Work { args, asked: &asked, vehicles: &vehicles, file, bar };
    let mut order = Vec::new();
    for road in &roads {
        order.extend(work.road(road, &mut results)?);
    }
    let Work { file, bar, .. } = work;
    drop(bar);
    // Rows of earlier calls that nobody asked for come first.
    let ranks = order.iter().enumerate().map(|(rank, (route, vehicle))| ((route.as_str(), vehicle.as_str()), rank));
    let ranks: HashMap<(&str, &str), usize> = ranks.collect();
    results.rows.sort_by_key(|row| ranks.get(&(row.route.as_str(), row.vehicle.as_str())).copied());
    results.write(&file)?;
    files::write_whole(&args.output.join("fits.csv"), csv(&results.rows).as_bytes())?;
    files::write_whole(&args.output.join("verdicts.csv"), verdicts(&results.rows).as_bytes())?;
    let asked_for = order.iter().filter(|(route, _)| case::is_asked(route, &args.route));
    let shown: Vec<Row> = asked_for.filter_map(|(route, vehicle)| results.row(route, vehicle).cloned()).collect();
    let units = args.units();
    let fit = shown.iter().filter(|row| row.fits).count();
    files::print(&format!(
        "{}{fit} of {} fit: {}, {} {}, {} {} from every kerb\n",
        table(&shown, terminal::width(), units),
        shown.len(),
        asked.load,
        units.exact_speed(asked.speed_kmh),
        units.of_speed(),
        units.length(asked.clearance),
        units.of_length()
    ))?;
    Ok(fit == shown.len())
}

/// A call of the command: what is asked of what, and where the results go.
struct Work<'a> {
    args: &'a Args,
    asked: &'a Asked,
    vehicles: &'a [(String, Vehicle)],
    /// The file of the results.
    file: PathBuf,
    bar: Bar,
}

impl Work<'_> {
    /// Answers what is not answered yet of a road and writes its sheets; gives route and vehicle of every row of it,
    /// those of a call before among them, in order.
    fn road(&self, road: &Road, results: &mut Results) -> Result<Vec<(String, String)>, Error> {
        // Sheets of all its routes, from a call before, stay.
        if wanted_rows(std::slice::from_ref(road), &self.args.route) == 0 {
            return Ok(Vec::new());
        }
        let mut cases = Vec::new();
        for (name, vehicle) in self.vehicles {
            let scenario = Case::scenario(self.asked, road, vehicle)?;
            let case = Case::new(self.asked, name, &scenario, roads::world(&scenario)?);
            let routes = case::wanted(&case.routes, &self.args.route);
            self.bar.say(&format!("{name} on {}", road.name));
            self.answer(&case, &routes, results)?;
            cases.push(case);
        }
        let seen = road.seen();
        let answered = cases.iter().flat_map(|case| (0..case.routes.len()).map(move |route| (case, route)));
        let answered: Vec<(&Case, usize, Row)> = answered
            .filter_map(|(case, route)| {
                Some((case, route, results.row(&case.routes[route].name, &case.vehicle)?.clone()))
            })
            .collect();
        let shown = answered.into_par_iter().map(|(case, route, row)| {
            let path = case.path(route, &row)?;
            Ok(Shown::new(row, case.routes[route].clone(), path))
        });
        let shown = shown.collect::<Result<Vec<Shown>, Error>>()?;
        let head = Head {
            vehicles: self.vehicles,
            assumptions: &results.assumptions_in(self.args.units()),
            clearance: self.asked.clearance,
            units: self.args.units(),
            gutter: self.asked.gutter,
            date: &results.date,
            version: &format!("{}, commit {}", results.program, results.commit),
        };
        self.write(&seen, &shown, &head)?;
        Ok(shown.into_iter().map(|one| (one.row.route, one.row.vehicle)).collect())
    }

    /// Answers the routes of a case that are not answered yet.
    fn answer(&self, case: &Case, routes: &[usize], results: &mut Results) -> Result<(), Error> {
        let is_missing = |&route: &usize| results.row(&case.routes[route].name, &case.vehicle).is_none();
        let missing: Vec<usize> = routes.iter().copied().filter(is_missing).collect();
        (missing.len()..routes.len()).for_each(|_| self.bar.advance());
        if missing.is_empty() {
            return Ok(());
        }
        let kept = Mutex::new((&mut *results, Ok(()), Instant::now()));
        case.answer(&missing, &|row| {
            if let Ok(mut kept) = kept.lock() {
                let (results, failure, written) = &mut *kept;
                let next = row.and_then(|row| {
                    results.rows.push(row);
                    if written.elapsed() < WRITE_EVERY {
                        return Ok(());
                    }
                    *written = Instant::now();
                    results.write(&self.file)
                });
                if failure.is_ok() {
                    *failure = next;
                }
            }
            self.bar.advance();
        })?;
        if let Ok((_, failure, _)) = kept.into_inner() {
            failure?;
        }
        results.write(&self.file)
    }

    /// Writes a road's sheets.
    fn write(&self, road: &Road, shown: &[Shown], head: &Head) -> Result<(), Error> {
        let file = |extension: &str| self.args.output.join(format!("{}.{extension}", stem(road)));
        let (drawn, printed) = (file("svg"), file("pdf"));
        let svg =
            sheet::drawn(road, shown, head).map_err(|error| Error::write(&drawn)(std::io::Error::other(error)))?;
        files::write_whole(&drawn, svg.as_bytes())?;
        let pdf = pdf(&svg, &sheet::title(road), head.date)
            .map_err(|error| Error::write(&printed)(std::io::Error::other(error)))?;
        files::write_whole(&printed, &pdf)?;
        for (name, _) in self.vehicles {
            let of: Vec<&Shown> = shown.iter().filter(|one| one.row.vehicle == *name).collect();
            let file = |extension: &str| self.args.output.join(format!("{}.{extension}", of_both(road, name)));
            let gutter = self.asked.gutter;
            files::write_whole(&file("dxf"), dxf(road, gutter, &of).as_bytes())?;
            let features = file("geojson");
            let text = geojson(road, gutter, &of, self.args.crs.as_deref())
                .map_err(|error| Error::write(&features)(error.into()))?;
            files::write_whole(&features, text.as_bytes())?;
        }
        Ok(())
    }
}

/// An error where the folder has no results yet, and a file of another origin would be replaced.
fn check_files(args: &Args, results: &Path, roads: &[Road], vehicles: &[(String, Vehicle)]) -> Result<(), Error> {
    if results.exists() {
        return Ok(());
    }
    let sheets = roads.iter().flat_map(|road| ["svg", "pdf"].map(|extension| format!("{}.{extension}", stem(road))));
    let both = roads.iter().flat_map(|road| vehicles.iter().map(move |(name, _)| of_both(road, name)));
    let drawings = both.flat_map(|name| ["dxf", "geojson"].map(|extension| format!("{name}.{extension}")));
    let tables = ["fits.csv", "verdicts.csv"].map(str::to_owned);
    let mut all = sheets.chain(drawings).chain(tables).map(|name| args.output.join(name));
    let Some(file) = all.find(|file| file.exists()) else { return Ok(()) };
    let expected = "is there already, and no results of this command beside it: name another folder";
    Err(Error::Setting { name: "--output", value: file.display().to_string(), expected: expected.into() })
}

/// A road's name as that of a file.
fn stem(road: &Road) -> String {
    road.name.replace(['/', '\\'], "-")
}

/// The name of a road's files that are a vehicle's.
fn of_both(road: &Road, vehicle: &str) -> String {
    format!("{}-{vehicle}", stem(road))
}

/// What is asked, checked.
fn asked(args: &Args) -> Result<Asked, Error> {
    draw::check_speed(args.speed_kmh)?;
    if !(0.0..=5.0).contains(&args.clearance) {
        return Err(Error::Setting {
            name: "--clearance",
            value: format!("{} m", number(args.clearance)),
            expected: "must lie in 0..5 m".into(),
        });
    }
    passes(&args.widths, HOLD)?;
    Ok(Asked {
        load: args.load.clone(),
        speed_kmh: args.speed_kmh,
        clearance: args.clearance,
        gutter: args.gutter,
        widths: args.widths.clone(),
    })
}

/// A vehicle and the stem of its file.
fn vehicle(name: &str, load: &str) -> Result<(String, Vehicle), Error> {
    let vehicle = Vehicle::find(name)?;
    draw::check_load(&vehicle, load)?;
    Ok((Source::find(Kind::Vehicle, name)?.stem(), vehicle))
}

/// Names of all routes.
fn route_names(roads: &[Road]) -> Vec<String> {
    let routes = roads.iter().flat_map(|road| road.routes(0.0, 0.0, 10.0).unwrap_or_default());
    routes.map(|route| route.name).collect()
}

/// Every route asked for must be one of a road's.
fn check_routes(roads: &[Road], names: &[String]) -> Result<(), Error> {
    let known = route_names(roads);
    let unknown =
        names.iter().find(|name| !known.iter().any(|route| case::is_asked(route, std::slice::from_ref(name))));
    let Some(name) = unknown else { return Ok(()) };
    let expected = format!("the roads have {}", known.join(", "));
    Err(Error::Setting { name: "--route", value: name.clone(), expected })
}

/// Number of routes asked for.
fn wanted_rows(roads: &[Road], names: &[String]) -> usize {
    route_names(roads).iter().filter(|route| case::is_asked(route, names)).count()
}
