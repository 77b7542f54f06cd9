//! Lists the roundabouts or junctions of an OpenDRIVE map, checks it, or writes one of them, or that of a drawing, as
//! an outline file.

mod drawing; // a DXF file

use std::collections::HashSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use glam::DVec2;
use offtrack::files::reader::{Error as InputError, Reader, shown_path};
use offtrack::map::chosen::Choice;
use offtrack::map::drawing::is_drawing;
use offtrack::map::ground::Line;
use offtrack::map::opendrive::{Hand, Imported, Map, Options, RoadLane, Way};
use serde::Serialize;

use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;

use crate::outputs;
use drawing::DrawingArgs;

/// List the roundabouts or junctions of an OpenDRIVE map, check it, or write one of them as an outline file.
#[derive(Debug, clap::Args)]
#[command(group(clap::ArgGroup::new("action").args(["list", "junctions", "check", "output"]).required(true)))]
pub struct Args {
    /// The map, a .xodr file, or a drawing, a .dxf or .geojson file.
    map: PathBuf,
    #[command(flatten)]
    drawing: DrawingArgs,
    /// Print the roundabouts found, and how many islands and blocks are none.
    #[arg(long, conflicts_with_all = ["ring", "ways", "arms", "junctions", "check", "output"])]
    list: bool,
    /// Print the ways through every junction, as --way takes them.
    #[arg(long, conflicts_with_all = ["ring", "ways", "arms", "check", "output"])]
    junctions: bool,
    /// Print all warnings about the map and its roundabouts, and why every other island or block is none.
    #[arg(long, conflicts_with = "output")]
    check: bool,
    /// Write one roundabout to this file, NAME.outline.toml: what is driven on, without the map.
    #[arg(short, long, required_unless_present_any = ["list", "junctions", "check"])]
    output: Option<PathBuf>,
    /// With --output: also write where the roundabout lies in the map, its hand of traffic, arms and routes as JSON.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["list", "junctions", "check"])]
    json: Option<PathBuf>,
    #[command(flatten)]
    place: PlaceArgs,
    /// Names of the arms, counter-clockwise from east: E,N,W. Without them they are named by compass.
    #[arg(long, value_delimiter = ',')]
    arms: Vec<String>,
}

/// Which place of a map.
#[derive(Debug, Clone, clap::Args)]
pub struct PlaceArgs {
    /// A point of the map near the roundabout's centre, X,Y (m); needed where a map has several.
    #[arg(long, value_name = "X,Y", value_parser = point, allow_hyphen_values = true)]
    pub ring: Option<DVec2>,
    /// A way through a junction in place of a roundabout, from a road's lane to another's: 12:-1,30:1. May be given
    /// several times; `offtrack import MAP --junctions` lists them.
    #[arg(long = "way", value_name = "ROAD:LANE,ROAD:LANE", value_parser = way, conflicts_with = "ring")]
    pub ways: Vec<Way>,
    /// The map's hand of traffic: what the map says, right or left.
    #[arg(long, default_value = "map", value_parser = PossibleValuesParser::new(["map", "right", "left"]).map(hand))]
    pub hand: Hand,
}

impl PlaceArgs {
    /// The ring or the ways that the flags choose.
    pub fn choice(&self) -> Choice {
        Choice { ring: self.ring, hand: self.hand, ways: self.ways.clone(), ..Choice::default() }
    }

    /// An error if one of the flags is given for a roundabout that is no map.
    pub fn check_absent(&self) -> Result<(), Error> {
        let given = [
            ("--ring", self.ring.map(|p| format!("{},{}", p.x, p.y))),
            ("--way", self.ways.first().map(|way| format!("{},{}", way.from, way.to))),
            ("--hand", word(self.hand).map(str::to_owned)),
        ];
        let Some((flag, Some(value))) = given.into_iter().find(|(_, value)| value.is_some()) else { return Ok(()) };
        Err(Error::Setting {
            name: flag,
            value,
            expected: "is for an OpenDRIVE map, a file that ends in .xodr; leave it out".into(),
        })
    }
}

fn hand(word: String) -> Hand {
    match word.as_str() {
        "left" => Hand::Left,
        "right" => Hand::Right,
        _ => Hand::Map,
    }
}

/// The flag's word for a hand; none where the map decides.
fn word(hand: Hand) -> Option<&'static str> {
    match hand {
        Hand::Map => None,
        Hand::Right => Some("right"),
        Hand::Left => Some("left"),
    }
}

fn point(text: &str) -> Result<DVec2, String> {
    let expected = || "must be two numbers, X,Y".to_owned();
    let (x, y) = text.split_once(',').ok_or_else(expected)?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(expected);
    Ok(DVec2::new(number(x)?, number(y)?))
}

fn way(text: &str) -> Result<Way, String> {
    let end = |text: &str| {
        let (road, lane) = text.rsplit_once(':')?;
        Some(RoadLane { road: road.trim().to_owned(), lane: lane.trim().parse().ok()? })
    };
    let ends = text.rsplit_once(',').and_then(|(from, to)| end(from).zip(end(to)));
    ends.map(|(from, to)| Way { from, to }).ok_or_else(|| "must be two lanes, ROAD:LANE,ROAD:LANE".to_owned())
}

/// What `--json` writes of a place that was imported.
#[derive(Debug, Serialize)]
struct Written<'a> {
    /// The centre in the map's frame, x and y (m).
    origin: [f64; 2],
    /// The hand of traffic, `right` or `left`. Left-hand roads are driven as their mirror image in the x axis.
    hand: &'static str,
    /// Radius of the central island; none at a junction (m).
    island_radius: Option<f64>,
    /// In the order in which `--arms` takes names.
    arms: Vec<&'a str>,
    routes: Vec<String>,
    warnings: &'a [String],
}

impl Written<'_> {
    fn of(imported: &Imported) -> Written<'_> {
        let Imported { ground, centre, warnings } = imported;
        let arm = |index: usize| ground.arms[index].name.as_str();
        let route =
            |line: &Line| format!("{}-{}-{}", arm(line.entry), line.lane.seen(ground.mirrored).name(), line.exit);
        Written {
            origin: [centre.x, centre.y],
            hand: if ground.mirrored { "left" } else { "right" },
            island_radius: (0.0 < ground.island_radius).then_some(ground.island_radius),
            arms: imported.ground.arm_names(),
            routes: ground.lines.iter().map(route).collect(),
            warnings,
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    if is_drawing(&args.map) {
        return drawing::run(args);
    }
    args.drawing.check_absent()?;
    let choice = Choice { arms: args.arms.clone(), ..args.place.choice() };
    let map = Map::read(&args.map, choice.hand)?;
    if args.list {
        return list(&args.map, &map);
    }
    if args.junctions {
        return junctions(&args.map, &map);
    }
    if args.check {
        return check(&args.map, &map, &choice);
    }
    let Some(output) = &args.output else { return Ok(()) };
    check_output(args, output)?;
    let imported = choice.imported(&args.map, &map)?;
    files::write_whole(output, text(&args.map, output, &map, &choice, &imported)?.as_bytes())?;
    if let Some(file) = &args.json {
        files::write_json(file, &Written::of(&imported))?;
    }
    files::print(&summary(output, &imported, "warning"))
}

/// The files written must be outline files, and each its own.
fn check_output(args: &Args, output: &Path) -> Result<(), Error> {
    if !output.to_string_lossy().ends_with(".outline.toml") {
        let value = output.display().to_string();
        return Err(Error::Setting { name: "--output", value, expected: "must end in .outline.toml".into() });
    }
    outputs::distinct(&[("--output", Some(output)), ("--json", args.json.as_deref())], &[("MAP", Some(&args.map))])
}

/// What was written, after what is odd about it.
fn summary(output: &Path, Imported { ground, warnings, .. }: &Imported, word: &str) -> String {
    let mut summary = String::new();
    for warning in warnings {
        let _ = writeln!(summary, "{word}: {warning}");
    }
    let (arms, routes) = (ground.arms.len(), ground.lines.len());
    let island =
        if 0.0 < ground.island_radius { format!(", island {:.2} m", ground.island_radius) } else { String::new() };
    let _ = writeln!(summary, "written: {}: {arms} arms, {routes} routes{island}", shown_path(output));
    summary
}

/// The outline file, with where it is from; an error where its own reader would refuse it.
fn text(file: &Path, output: &Path, map: &Map, choice: &Choice, imported: &Imported) -> Result<String, Error> {
    let Imported { ground, centre, .. } = imported;
    // A name may hold line breaks, which would end the comment.
    let name = file.file_name().map(|name| name.to_string_lossy().escape_debug().to_string()).unwrap_or_default();
    let (what, mut flags) = match choice.ways.as_slice() {
        [] => ("roundabout", format!(" --ring {:.1},{:.1}", centre.x, centre.y)),
        ways => (
            "junction",
            ways.iter().map(|way| format!(" --way {},{}", way.from, way.to).escape_debug().to_string()).collect(),
        ),
    };
    if let Some(hand) = word(choice.hand) {
        let _ = write!(flags, " --hand {hand}");
    }
    if !choice.arms.is_empty() {
        let _ = write!(flags, " --arms {}", choice.arms.join(","));
    }
    let mut comment = vec![
        format!(
            "A {what} of the map {name}: its centre, here the origin, lies at ({:.4}, {:.4}) there.",
            centre.x, centre.y
        ),
        format!("Made by: offtrack import {name}{flags} -o NAME.outline.toml"),
    ];
    if map.is_mirrored() {
        comment.push("The map has left-hand traffic; this is its mirror image in the x axis.".into());
    }
    comment.push(
        "A path is a list of [x, y] and [x, y, bulge]: a straight or an arc ends there. Metres; docs/maps.md.".into(),
    );
    ground.checked_text(output, &comment).map_err(|error| of_input(error, file))
}

/// An error of an outline that is not written, by the file that it was read from.
fn of_input(error: InputError, input: &Path) -> Error {
    match error {
        InputError::Invalid { key, value, expected, .. } => {
            let key = format!("the outline that it becomes: {key}");
            InputError::Invalid { file: input.to_owned(), key, value, expected }.into()
        }
        other => other.into(),
    }
}

/// Prints the rings; a map without one that can be driven is wrong input.
fn list(file: &Path, map: &Map) -> Result<(), Error> {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let (mut drivable, mut refused) = (0, None);
    for ring in map.rings() {
        // Rounded, not -0.0.
        let [x, y] = [ring.centre.x, ring.centre.y].map(|value| (10.0 * value).round() / 10.0 + 0.0);
        let _ =
            write!(text, "ring {x:.1},{y:.1}: island {:.2} m, within {:.2} m of a circle", ring.radius, ring.residual);
        match map.ground(&ring, &Options::default()) {
            Ok(imported) => {
                let (arms, routes) = (imported.ground.arm_names().join(" "), imported.ground.lines.len());
                let _ = writeln!(text, "; arms {arms}; {routes} routes");
                drivable += 1;
            }
            Err(error) => {
                let _ = writeln!(text, "; cannot be driven: {error}");
                refused.get_or_insert(error);
            }
        }
    }
    let others = map.refused().len();
    if 0 < others {
        let _ = writeln!(text, "{others} other islands and blocks are none; --check says why");
    }
    files::print(&text)?;
    if map.rings().is_empty() {
        let expected = format!("no roundabout here: {} roads around {others} islands and blocks", map.n_roads());
        let none: InputError = Reader::of(file).invalid("ring", "none", expected);
        return Err(none.into());
    }
    match refused.filter(|_| drivable == 0) {
        Some(error) => Err(error.into()),
        None => Ok(()),
    }
}

/// Prints the ways through every junction; a map without one is wrong input.
fn junctions(file: &Path, map: &Map) -> Result<(), Error> {
    let mut text = String::new();
    let junctions = map.junctions();
    for junction in &junctions {
        let _ = writeln!(
            text,
            "junction {} at {:.1},{:.1}",
            junction.id.escape_debug(),
            junction.centre.x,
            junction.centre.y
        );
        for way in &junction.ways {
            let _ = writeln!(text, "  --way {}", format!("{},{}", way.from, way.to).escape_debug());
        }
    }
    files::print(&text)?;
    if junctions.is_empty() {
        let none: InputError = Reader::of(file).invalid(
            "junction",
            "none",
            format!("no lanes lead through one of its {} roads", map.n_roads()),
        );
        return Err(none.into());
    }
    Ok(())
}

/// Prints all warnings: about the map, and about the place that is chosen or else all its roundabouts.
fn check(file: &Path, map: &Map, choice: &Choice) -> Result<(), Error> {
    let mut text = String::new();
    let said: HashSet<&str> = map.warnings().collect();
    for warning in map.warnings() {
        let _ = writeln!(text, "{warning}");
    }
    let is_chosen = choice.ring.is_some() || !choice.ways.is_empty();
    let places: Vec<Result<Imported, InputError>> = if is_chosen {
        vec![choice.imported(file, map)]
    } else {
        map.rings().iter().map(|ring| map.ground(ring, &Options { arms: choice.arms.clone() })).collect()
    };
    // A ring below a bridge is not found.
    if places.is_empty() {
        map.bridges().iter().for_each(|bridge| {
            let _ = writeln!(text, "{bridge}");
        });
    }
    for place in &places {
        match place {
            // What is said of the map's roads is said above.
            Ok(Imported { warnings, .. }) => {
                for warning in warnings.iter().filter(|warning| !said.contains(warning.as_str())) {
                    let _ = writeln!(text, "{warning}");
                }
            }
            Err(error) => {
                let _ = writeln!(text, "{error}");
            }
        }
    }
    let warnings = text.lines().count();
    for refused in map.refused().iter().filter(|_| !is_chosen) {
        let (x, y) = (refused.centre.x, refused.centre.y);
        let _ = writeln!(text, "no ring at {x:.1},{y:.1}, {:.1} m: {}", refused.radius, refused.reason);
    }
    let _ = writeln!(text, "{warnings} warnings, {} roundabouts or junctions", places.len());
    files::print(&text)
}

#[cfg(test)]
mod tests {
    use offtrack::map::Road;
    use offtrack::map::ground::Ground;

    use super::*;

    #[test]
    fn a_left_hand_import_says_so_and_names_lanes_as_a_driver_there_would() {
        let right = Road::named("16m").unwrap();
        let of = |mirrored: bool| {
            let ground = Ground { mirrored, ..right.ground().clone() };
            let imported = Imported { ground, centre: DVec2::new(3.0, -4.0), warnings: Vec::new() };
            serde_json::to_value(Written::of(&imported)).unwrap()
        };
        let (right, left) = (of(false), of(true));
        assert_eq!((&right["hand"], &left["hand"]), (&"right".into(), &"left".into()));
        assert_eq!(left["origin"], serde_json::json!([3.0, -4.0]));
        let name = |said: &serde_json::Value| said["routes"][0].as_str().unwrap().to_owned();
        assert!(name(&right).contains("-left-") && name(&left).contains("-right-"), "{left}");
        // Counter-clockwise from east in the map, as `--arms` takes them.
        let arms = |names: [&str; 4]| serde_json::json!(names);
        assert_eq!((&right["arms"], &left["arms"]), (&arms(["E", "N", "W", "SW"]), &arms(["E", "SW", "W", "N"])));
    }
}
