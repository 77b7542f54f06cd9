//! A roundabout from a drawing, a DXF or GeoJSON file, as an outline file.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use offtrack::map::drawing::{self, Drawn, Layers, Unit, is_same_layer};
use offtrack::map::opendrive::Imported;

use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;

use super::{Args, Written, check_output, summary};

/// Width of lanes where nobody says it (m).
const LANE_WIDTH: f64 = 3.5;

/// How a drawing is read. Nothing is given of a map.
#[derive(Debug, Clone, clap::Args)]
pub struct DrawingArgs {
    /// Of a drawing: the layer of the kerbs' closed outlines; in GeoJSON the property `part` or `layer` says it
    /// [default: KERB].
    #[arg(long, value_name = "LAYER")]
    kerb_layer: Option<String>,
    /// Of a drawing: the layer of the lanes' centre lines, one for each way from an arm's end to another's, in the
    /// direction of travel [default: LANE].
    #[arg(long, value_name = "LAYER")]
    lane_layer: Option<String>,
    /// Of a drawing: the layer of the aprons' closed edges, inner ones, outer ones or both; it may be empty
    /// [default: APRON].
    #[arg(long, value_name = "LAYER")]
    apron_layer: Option<String>,
    /// Of a drawing: the unit of its coordinates, where it does not say it.
    #[arg(long, value_parser = PossibleValuesParser::new(Unit::NAMED.map(|(name, _)| name)).map(unit))]
    unit: Option<Unit>,
    /// Of a drawing: the width of the lanes that say none (m) [default: 3.5].
    #[arg(long, value_name = "M")]
    lane_width: Option<f64>,
}

fn unit(word: String) -> Unit {
    Unit::NAMED.into_iter().find(|(name, _)| *name == word).map_or(Unit::Metre, |(_, unit)| unit)
}

impl DrawingArgs {
    /// An error if one of the flags is given for a map.
    pub fn check_absent(&self) -> Result<(), Error> {
        let given = [
            ("--kerb-layer", self.kerb_layer.clone()),
            ("--lane-layer", self.lane_layer.clone()),
            ("--apron-layer", self.apron_layer.clone()),
            ("--unit", self.unit.map(|unit| unit.name().to_owned())),
            ("--lane-width", self.lane_width.map(|width| format!("{width} m"))),
        ];
        let Some((name, Some(value))) = given.into_iter().find(|(_, value)| value.is_some()) else { return Ok(()) };
        Err(Error::Setting {
            name,
            value,
            expected: "is for a drawing, a file that ends in .dxf or .geojson; leave it out".into(),
        })
    }
}

/// Writes the roundabout of a drawing.
pub fn run(args: &Args) -> Result<(), Error> {
    let flags = [
        ("--list", args.list.then(|| "given".to_owned())),
        ("--junctions", args.junctions.then(|| "given".to_owned())),
        ("--check", args.check.then(|| "given".to_owned())),
        ("--way", args.place.ways.first().map(|way| format!("{},{}", way.from, way.to))),
        ("--hand", super::word(args.place.hand).map(str::to_owned)),
    ];
    if let Some((name, Some(value))) = flags.into_iter().find(|(_, value)| value.is_some()) {
        return Err(Error::Setting {
            name,
            value,
            expected: "is for an OpenDRIVE map; of a drawing -o NAME.outline.toml writes the roundabout".into(),
        });
    }
    let Some(output) = &args.output else { return Ok(()) };
    check_output(args, output)?;
    let lane_width = args.drawing.lane_width.unwrap_or(LANE_WIDTH);
    if !(1.0..=20.0).contains(&lane_width) {
        return Err(Error::Setting {
            name: "--lane-width",
            value: format!("{lane_width} m"),
            expected: "must lie in 1..20 m".into(),
        });
    }
    let layer = |given: &Option<String>, usual: &str| given.clone().unwrap_or_else(|| usual.to_owned());
    let layers = Layers {
        kerbs: layer(&args.drawing.kerb_layer, "KERB"),
        lanes: layer(&args.drawing.lane_layer, "LANE"),
        aprons: layer(&args.drawing.apron_layer, "APRON"),
        unit: args.drawing.unit,
        lane_width,
        ring: args.place.ring,
        arms: args.arms.clone(),
    };
    let named = [("--kerb-layer", &layers.kerbs), ("--lane-layer", &layers.lanes), ("--apron-layer", &layers.aprons)];
    for (index, (flag, layer)) in named.iter().enumerate() {
        if let Some((other, _)) = named[..index].iter().find(|(_, other)| is_same_layer(other, layer)) {
            let expected = format!("is that of {other} too: each part is on a layer of its own");
            return Err(Error::Setting { name: flag, value: layer.to_string(), expected });
        }
    }
    let Drawn { ground, notes } = drawing::read(&args.map, &layers)?;
    let name = args.map.file_name().map(|name| name.to_string_lossy().escape_debug().to_string()).unwrap_or_default();
    let comment = [
        format!("A roundabout of the drawing {name}: its centre, here the origin, lies at `origin` there."),
        "A path is a list of [x, y] and [x, y, bulge]: a straight or an arc ends there. Metres; docs/maps.md.".into(),
    ];
    let text = ground.checked_text(output, &comment).map_err(|error| super::of_input(error, &args.map))?;
    files::write_whole(output, text.as_bytes())?;
    let imported = Imported { centre: ground.origin, ground, warnings: notes };
    if let Some(file) = &args.json {
        files::write_json(file, &Written::of(&imported))?;
    }
    files::print(&summary(output, &imported, "note"))
}
