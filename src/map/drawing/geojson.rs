//! Polygons and lines of a GeoJSON file, each by its property `part` or `layer`, in metres.
//!
//! Coordinates are those of a projected frame, as CAD and GIS programs have them. What looks like degrees is refused.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec2;
use serde::Deserialize;
use serde_json::Value;

use super::unit::reach;
use super::{Drawing, Entity, Layers, Unit, is_same_layer};
use crate::files::reader::{Error, Reader, shortened};
use crate::geometry::area::densified;
use crate::geometry::{Curve, Piece, fitted_outline};

/// Properties that name what a feature is, in this order.
const NAMES: [&str; 3] = ["part", "layer", "Layer"];
/// What the feature is that marks the ring's centre.
const CENTRE: &str = "centre";
/// Most features, and most points of a line.
const MOST_FEATURES: usize = 1_000_000;
const MOST_POINTS: usize = 100_000;
/// Largest coordinate (m).
const FARTHEST: f64 = 1e8;
/// Kerbs whose coordinates reach over less than this are in degrees: the smallest ring is wider.
const SMALLEST: f64 = 0.5;
/// Arcs and segments take the place of a kerb's points within this (m).
const FITTED: f64 = 1e-3;
/// Distance between points of a kerb to which arcs are fitted (m), and the longest that all closed kerbs are together
/// (m).
const STEP: f64 = 0.05;
const LONGEST: f64 = 50_000.0;

#[derive(Deserialize)]
struct Collection {
    #[serde(rename = "type")]
    kind: String,
    #[serde(default)]
    crs: Option<Value>,
    #[serde(default)]
    features: Vec<Feature>,
}

#[derive(Deserialize)]
struct Feature {
    #[serde(default)]
    properties: Option<serde_json::Map<String, Value>>,
    #[serde(default)]
    geometry: Option<Geometry>,
}

#[derive(Deserialize)]
struct Geometry {
    #[serde(rename = "type")]
    kind: String,
    #[serde(default)]
    coordinates: Value,
}

/// Widths of a lane on the entry, in the ring and on the exit, with the key that says them (m).
type Widths = (&'static str, [f64; 3]);

impl Feature {
    /// What the feature is.
    fn part(&self) -> &str {
        let properties = self.properties.as_ref();
        NAMES.iter().find_map(|name| properties?.get(*name)?.as_str()).unwrap_or_default()
    }

    /// The widths that a lane says, three or one for all, with their key (m); an error names what is neither.
    fn widths(&self) -> Result<Option<Widths>, (&'static str, &Value)> {
        let given = |key| self.properties.as_ref().and_then(|all| all.get(key)).filter(|value| !value.is_null());
        if let Some(width) = given("width") {
            return width.as_f64().map(|width| Some(("width", [width; 3]))).ok_or(("width", width));
        }
        let Some(widths) = given("widths") else { return Ok(None) };
        let numbers = widths.as_array().and_then(|all| all.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>());
        let three = numbers.and_then(|numbers| numbers.try_into().ok());
        three.map(|three| Some(("widths", three))).ok_or(("widths", widths))
    }
}

/// What is drawn on the layers of a file's text.
pub(super) fn drawing(file: &Path, text: &str, layers: &Layers) -> Result<Drawing, Error> {
    let reader = Reader::of(file);
    let collection: Collection = serde_json::from_str(text).map_err(|error| Error::Malformed {
        file: file.to_owned(),
        message: shortened(&format!("is no GeoJSON: {error}"), 300),
    })?;
    if collection.kind != "FeatureCollection" {
        let kind = shortened(&collection.kind, 40);
        return Err(reader.invalid("type", format!("{kind:?}"), "must be \"FeatureCollection\""));
    }
    reader.count("features", collection.features.len(), 1..=MOST_FEATURES)?;
    check_extent(&reader, &collection.features, layers)?;
    let mut drawing = Drawing::default();
    let frame = frame(&reader, collection.crs.as_ref())?;
    let taken = if layers.unit.is_none() { ", and are taken for metres" } else { "" };
    drawing.notes.extend(frame.map(|name| format!("coordinates are those of {name}, in which `origin` lies{taken}")));
    let metres = layers.unit.map_or(1.0, Unit::metres);
    let mut others: BTreeMap<&str, usize> = BTreeMap::new();
    let mut left = LONGEST;
    for (index, feature) in collection.features.iter().enumerate() {
        let (part, place) = (feature.part(), format!("feature {}", index + 1));
        let is = |layer: &str| is_same_layer(part, layer);
        let Some(geometry) = &feature.geometry else {
            drawing.notes.push(format!("{place} has no geometry and is left out"));
            continue;
        };
        let shape = Shape { reader: &reader, place: &place, geometry, metres };
        if is(&layers.kerbs) {
            drawing.kerbs.extend(shape.kerbs(&mut left)?);
        } else if is(&layers.lanes) {
            let widths = feature.widths().map_err(|(key, value)| {
                let found = shortened(&value.to_string(), 40);
                let expected =
                    "must be a number, or `widths` a list of three: on the entry, in the ring, on the exit (m)";
                reader.invalid(format!("{place}: {key}"), found, expected)
            })?;
            drawing.lanes.extend(shape.lanes(widths)?);
        } else if is(&layers.aprons) {
            drawing.aprons.extend(shape.kerbs(&mut left)?);
        } else if is(CENTRE) && geometry.kind == "Point" {
            drawing.centre = Some(shape.point("coordinates", &geometry.coordinates)?);
        } else {
            *others.entry(part).or_default() += 1;
        }
    }
    for (layer, kind) in [(&layers.kerbs, &drawing.kerbs), (&layers.lanes, &drawing.lanes)] {
        if kind.is_empty() {
            let known: Vec<String> = others
                .iter()
                .map(|(part, n)| format!("{} ({n})", if part.is_empty() { "none" } else { part }))
                .collect();
            let has = if known.is_empty() { "nothing".into() } else { shortened(&known.join(", "), 300) };
            let expected = format!("a feature's property `part` or `layer` says what it is; the file has {has}");
            return Err(reader.invalid(format!("part {layer}"), "none", expected));
        }
    }
    reach(&reader, &drawing.kerbs)?;
    let left_out: usize = others.values().sum();
    if 0 < left_out {
        drawing.notes.push(format!("{left_out} features of {} other parts are left out", others.len()));
    }
    Ok(drawing)
}

/// The name of the coordinate frame that a file states; an error where it is one in degrees.
fn frame(reader: &Reader, crs: Option<&Value>) -> Result<Option<String>, Error> {
    let name = crs.and_then(|crs| crs.get("properties")?.get("name")?.as_str());
    let Some(name) = name.map(|name| shortened(&name.escape_debug().to_string(), 80)) else { return Ok(None) };
    let code = name.rsplit([':', '/']).next().unwrap_or_default();
    if ["CRS84", "CRS83", "CRS27"].iter().any(|known| name.ends_with(known)) || DEGREES.contains(&code) {
        return Err(reader.invalid("crs", name, PROJECT));
    }
    if MERCATOR.contains(&code) {
        let expected = "lengths are not true in it: project the file, as by ogr2ogr -t_srs EPSG:25832 site.geojson \
                        mercator.geojson";
        return Err(reader.invalid("crs", name, expected));
    }
    Ok(Some(name))
}

/// EPSG's codes of frames in degrees that maps have, and those of Mercator's projections of the whole earth.
const DEGREES: [&str; 9] = ["4326", "4258", "4269", "4267", "4230", "4277", "4283", "4490", "4979"];
const MERCATOR: [&str; 6] = ["3857", "3395", "3785", "900913", "102100", "102113"];

/// What would do in place of degrees.
const PROJECT: &str = "coordinates must be metres, not degrees: project them, as by ogr2ogr -t_srs EPSG:25832 \
                       site.geojson degrees.geojson";

/// An error if the kerbs' coordinates are as near to each other as they are in degrees, on either side of 180 deg too.
fn check_extent(reader: &Reader, features: &[Feature], layers: &Layers) -> Result<(), Error> {
    let mut positions = Vec::new();
    let kerbs = features.iter().filter(|feature| is_same_layer(feature.part(), &layers.kerbs));
    kerbs.filter_map(|kerb| kerb.geometry.as_ref()).for_each(|one| collect_positions(&one.coordinates, &mut positions));
    let on_earth = |p: &DVec2| p.x.abs() <= 180.0 && p.y.abs() <= 90.0;
    let extent = |place: fn(&DVec2) -> DVec2| {
        let ends = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (low, high) = positions.iter().map(place).fold(ends, |(low, high), p| (low.min(p), high.max(p)));
        high - low
    };
    let (own, around) = (extent(|p| *p), extent(|p| DVec2::new(p.x.rem_euclid(360.0), p.y)));
    let extent = if own.x <= around.x { own } else { around };
    if positions.is_empty() || !positions.iter().all(on_earth) || SMALLEST <= extent.max_element() {
        return Ok(());
    }
    Err(reader.invalid("kerbs", format!("reach over {:.6} by {:.6}", extent.x, extent.y), PROJECT))
}

/// The positions at any depth of a geometry's coordinates.
fn collect_positions(value: &Value, positions: &mut Vec<DVec2>) {
    let number = |axis: usize| value.get(axis).and_then(Value::as_f64);
    match (number(0), number(1)) {
        (Some(x), Some(y)) => positions.push(DVec2::new(x, y)),
        _ => value.as_array().into_iter().flatten().for_each(|part| collect_positions(part, positions)),
    }
}

/// The geometry of a feature.
struct Shape<'a> {
    reader: &'a Reader<'a>,
    place: &'a str,
    geometry: &'a Geometry,
    /// Length of a unit of its coordinates (m).
    metres: f64,
}

impl Shape<'_> {
    /// The kerbs of polygons, each ring one, or of lines; `left` is how long closed ones may be yet (m).
    fn kerbs(&self, left: &mut f64) -> Result<Vec<Entity>, Error> {
        let is_ring = matches!(self.geometry.kind.as_str(), "Polygon" | "MultiPolygon");
        let mut kerbs = Vec::new();
        for (key, points) in self.lines(&["Polygon", "MultiPolygon", "LineString", "MultiLineString"])? {
            let is_closed = 3 < points.len() && points[0] == points[points.len() - 1];
            if is_ring && !is_closed {
                let expected = "is open: a ring has four positions or more and ends where it begins";
                return Err(self.reader.invalid(
                    format!("{}: {key}", self.place),
                    format!("{} positions", points.len()),
                    expected,
                ));
            }
            *left -= points.windows(2).map(|pair| pair[0].distance(pair[1])).sum::<f64>();
            if *left < 0.0 {
                // All but metres, which the file's are taken for.
                let units = Unit::listed(&Unit::NAMED[1..]);
                let expected = format!("cut the file down to the roundabout, or give --unit {units}");
                let long = format!("kerbs are more than {:.0} km long by then", LONGEST / 1000.0);
                return Err(self.reader.invalid(format!("{}: {key}", self.place), long, expected));
            }
            // Points this near to each other give arcs that leave the straights between corners by nothing.
            let curve =
                if is_closed { fitted_outline(&densified(&points[1..], STEP), FITTED) } else { straight(&points) };
            kerbs.push(self.entity(&key, curve, is_closed, None)?);
        }
        Ok(kerbs)
    }

    /// The centre lines of lanes.
    fn lanes(&self, given: Option<Widths>) -> Result<Vec<Entity>, Error> {
        for (key, width) in given.iter().flat_map(|(key, widths)| widths.iter().map(move |width| (key, *width))) {
            self.reader.within(&format!("{}: {key}", self.place), width, 1.0..=20.0, "m")?;
        }
        let widths = given.map(|(_, widths)| widths);
        let lines = self.lines(&["LineString", "MultiLineString"])?;
        lines.into_iter().map(|(key, points)| self.entity(&key, straight(&points), false, widths)).collect()
    }

    fn entity(&self, key: &str, curve: Curve, is_closed: bool, widths: Option<[f64; 3]>) -> Result<Entity, Error> {
        if curve.pieces.is_empty() {
            return Err(self.reader.invalid(
                format!("{}: {key}", self.place),
                "no length",
                "its positions must differ",
            ));
        }
        Ok(Entity { curve, is_closed, is_arc: false, place: self.place.to_owned(), widths })
    }

    /// The lists of points of a geometry of one of these kinds, each with its key.
    fn lines(&self, kinds: &[&str]) -> Result<Vec<(String, Vec<DVec2>)>, Error> {
        let kind = self.geometry.kind.as_str();
        if !kinds.contains(&kind) {
            let expected = format!("must be {}", kinds.join(", "));
            return Err(self.reader.invalid(format!("{}: geometry", self.place), shortened(kind, 40), expected));
        }
        let depth = match kind {
            "LineString" => 0,
            "Polygon" | "MultiLineString" => 1,
            _ => 2,
        };
        let mut lines = Vec::new();
        self.collect("coordinates".to_owned(), &self.geometry.coordinates, depth, &mut lines)?;
        Ok(lines)
    }

    fn collect(
        &self,
        key: String,
        value: &Value,
        depth: u32,
        lines: &mut Vec<(String, Vec<DVec2>)>,
    ) -> Result<(), Error> {
        let array = value.as_array().filter(|array| !array.is_empty());
        let array = array.ok_or_else(|| {
            self.reader.invalid(format!("{}: {key}", self.place), "no positions", "must be a list of positions, [x, y]")
        })?;
        if 0 < depth {
            let parts = array.iter().enumerate();
            return parts
                .into_iter()
                .try_for_each(|(i, part)| self.collect(format!("{key}[{i}]"), part, depth - 1, lines));
        }
        self.reader.count(&format!("{}: {key}", self.place), array.len(), 2..=MOST_POINTS)?;
        let points = array.iter().enumerate().map(|(i, p)| self.point(&format!("{key}[{i}]"), p));
        lines.push((key.clone(), points.collect::<Result<_, _>>()?));
        Ok(())
    }

    /// A position; its height is left out.
    fn point(&self, key: &str, value: &Value) -> Result<DVec2, Error> {
        let number = |axis: usize| value.get(axis).and_then(Value::as_f64);
        let (Some(x), Some(y)) = (number(0), number(1)) else {
            let found = shortened(&value.to_string(), 40);
            return Err(self.reader.invalid(format!("{}: {key}", self.place), found, "must be a position, [x, y]"));
        };
        let of = |value: f64| {
            self.reader.within(&format!("{}: {key}", self.place), value * self.metres, -FARTHEST..=FARTHEST, "m")
        };
        Ok(DVec2::new(of(x)?, of(y)?))
    }
}

/// The straights from point to point.
fn straight(points: &[DVec2]) -> Curve {
    let pairs = points.windows(2).filter(|pair| 1e-6 < pair[0].distance(pair[1]));
    Curve { pieces: pairs.map(|pair| Piece::Segment { from: pair[0], to: pair[1] }).collect() }
}
