//! Writes a road for other programs: as an OpenDRIVE map, or as GeoJSON.

use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use offtrack::files::reader::shown_path;
use offtrack::map::chosen::is_map;
use offtrack::map::drawing::is_geojson;
use offtrack::map::opendrive::{self, Map};
use offtrack::map::{Gutter, Road};
use offtrack_drawing::fits::geojson;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;

use crate::import::PlaceArgs;
use crate::{draw, outputs, roads};

/// Longest name of a coordinate frame (characters).
const LONGEST_NAME: usize = 200;

/// An error where a map's coordinates are not in the frame that is named: its header has an offset, which is not
/// applied.
pub fn check_frame(map: &Map, crs: Option<&String>) -> Result<(), Error> {
    let (Some(name), Some(_)) = (crs, map.header_offset()) else { return Ok(()) };
    let expected = "the map's header has an offset, which is not applied: its coordinates are in no such frame";
    Err(Error::Setting { name: "--crs", value: name.clone(), expected: expected.to_owned() })
}

/// Write a road for other programs: as an OpenDRIVE map, or its kerbs and lanes as GeoJSON.
///
/// In a map the junction has a connecting road for each route, arms have a road for each lane, and kerbs and the ring's
/// lanes are roads, too. Coordinates are those of the map or drawing that the road is from, in metres.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A roundabout's name, the path of its file or of an OpenDRIVE map (.xodr), or a random road, as `draw` takes it.
    road: String,
    #[command(flatten)]
    place: PlaceArgs,
    /// The file to write: .xodr, or .geojson.
    #[arg(short, long)]
    output: PathBuf,
    /// In GeoJSON: whether gutters may be driven on.
    #[arg(
        long,
        default_value = "drivable",
        value_parser = PossibleValuesParser::new(["drivable", "solid"]).map(draw::gutter)
    )]
    gutter: Gutter,
    /// In GeoJSON: the name of the map's coordinate frame, such as urn:ogc:def:crs:EPSG::25832. None is stated without
    /// it.
    #[arg(long, value_name = "NAME", value_parser = crs)]
    crs: Option<String>,
}

/// The name of a coordinate frame.
pub fn crs(name: &str) -> Result<String, String> {
    let is_name = !name.is_empty() && name.len() <= LONGEST_NAME && name.chars().all(|c| c.is_ascii_graphic());
    is_name.then(|| name.to_owned()).ok_or_else(|| {
        format!("must be 1 to {LONGEST_NAME} letters, digits and signs, as in urn:ogc:def:crs:EPSG::25832")
    })
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let file = Path::new(&args.road);
    if !is_map(file) {
        args.place.check_absent()?;
    }
    let is_geojson = is_geojson(&args.output);
    let refused = |name: &'static str, value: String, expected: &str| {
        Err(Error::Setting { name, value, expected: expected.to_owned() })
    };
    if !is_geojson && !is_map(&args.output) {
        return refused("--output", args.output.display().to_string(), "must end in .xodr or .geojson");
    }
    if !is_geojson && args.gutter == Gutter::Solid {
        return refused("--gutter", "solid".into(), "is for .geojson: a map has gutters as shoulders; leave it out");
    }
    if let Some(name) = args.crs.as_ref().filter(|_| !is_geojson) {
        return refused("--crs", name.clone(), "is for .geojson: leave it out");
    }
    outputs::distinct(&[("--output", Some(&args.output))], &[("ROAD", Some(file))])?;
    let road = if is_map(file) {
        let map = Map::read(file, args.place.hand)?;
        check_frame(&map, args.crs.as_ref())?;
        Road::in_map(file, &map, &args.place.choice())?
    } else {
        roads::road(&args.road, &args.place)?
    };
    let text = if is_geojson {
        geojson(&road.seen(), args.gutter, &[], args.crs.as_deref())
            .map_err(|error| Error::write(&args.output)(error.into()))?
    } else {
        opendrive::exported(&road)?
    };
    files::write_whole(&args.output, text.as_bytes())?;
    let (arms, routes) = (road.ground().arms.len(), road.ground().lines.len());
    files::print(&format!("written: {}: {arms} arms, {routes} routes\n", shown_path(&args.output)))
}
