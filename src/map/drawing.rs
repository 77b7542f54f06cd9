//! Roads from drawings: kerbs and lane centre lines of a DXF or GeoJSON file as a [`Ground`](super::ground::Ground).
//!
//! A drawing has no meaning but its layers: closed outlines of kerbs on one, on another a line for each way through the
//! ring, from the end of its entry arm to the end of its exit arm, in the direction of travel; on a third there may be
//! aprons. What is drawn otherwise on these layers is refused with its place; other layers are left out.

mod dxf; // polylines, lines and arcs on their layers
mod pairs; // group codes and values
mod unit; // of lengths
mod geojson; // polygons and lines by a property
mod site; // what is drawn, as a road
mod closed; // outlines of kerbs
mod ways; // their lines, joined
mod aprons; // their edges among the kerbs
#[cfg(test)]
mod tests;

use std::path::Path;

use glam::DVec2;

use dxf::folded;
pub use site::Drawn;
pub use unit::Unit;

use crate::files::reader::{Error, read_bytes};
use crate::files::windows_1252;
use crate::geometry::Curve;

/// Most bytes of a drawing.
const FILE_LIMIT: u64 = 128 << 20;

/// Whether a file is a drawing by its name.
pub fn is_drawing(file: &Path) -> bool {
    is_named(file, &["dxf"]) || is_geojson(file)
}

/// Whether a file is GeoJSON by its name.
pub fn is_geojson(file: &Path) -> bool {
    is_named(file, &["geojson"])
}

fn is_named(file: &Path, extensions: &[&str]) -> bool {
    let of = |extension: &std::ffi::OsStr| extensions.iter().any(|known| extension.eq_ignore_ascii_case(known));
    file.extension().is_some_and(of)
}

/// Whether two names are of the same layer: as in a DXF, capitals do not count.
pub fn is_same_layer(one: &str, other: &str) -> bool {
    // Most names are ASCII, and a drawing has many entities.
    one.eq_ignore_ascii_case(other) || !(one.is_ascii() && other.is_ascii()) && folded(one) == folded(other)
}

/// How a drawing is read.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    /// Layer of the kerbs' closed outlines; of GeoJSON the value of the property `part` or `layer`.
    pub kerbs: String,
    /// Layer of the ways' centre lines.
    pub lanes: String,
    /// Layer of the aprons' edges, which need not be there.
    pub aprons: String,
    /// Unit of its coordinates; what the drawing says without one, of GeoJSON metres.
    pub unit: Option<Unit>,
    /// Width of the lanes (m) that say none.
    pub lane_width: f64,
    /// A point near the ring's centre in the drawing's frame (m); without one the centre that GeoJSON has, else the
    /// largest island.
    pub ring: Option<DVec2>,
    /// Names of the arms, counter-clockwise from east; by compass without them.
    pub arms: Vec<String>,
}

/// Reads the road that is drawn on these layers.
///
/// # Errors
///
/// The file and what is wrong: no DXF in ASCII, a unit that is unknown, an outline that is open, a layer without
/// anything, coordinates in degrees, and so on, each with its line or feature and what would do.
pub fn read(file: &Path, layers: &Layers) -> Result<Drawn, Error> {
    parse(file, &text(file, &read_bytes(file, FILE_LIMIT)?), layers)
}

/// The text of a drawing's bytes: UTF-8, and of a DXF that is none the code page that most have.
fn text(file: &Path, bytes: &[u8]) -> String {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) if is_geojson(file) => String::from_utf8_lossy(bytes).into_owned(),
        Err(_) => windows_1252::text(bytes),
    }
}

fn parse(file: &Path, text: &str, layers: &Layers) -> Result<Drawn, Error> {
    let drawing =
        if is_geojson(file) { geojson::drawing(file, text, layers)? } else { Drawing::parse(file, text, layers)? };
    site::drawn(file, drawing, layers)
}

/// A curve on one of the layers.
#[derive(Debug, Clone)]
struct Entity {
    curve: Curve,
    is_closed: bool,
    /// Whether it runs counter-clockwise whichever way it leads, as an ARC of a DXF file.
    is_arc: bool,
    /// Where it stands in the file: `line 12`, `feature 3`.
    place: String,
    /// Widths of a lane on its entry arm, in the ring and on its exit arm, where it says them (m).
    widths: Option<[f64; 3]>,
}

/// What is drawn on the layers.
#[derive(Debug, Clone, Default)]
struct Drawing {
    kerbs: Vec<Entity>,
    lanes: Vec<Entity>,
    /// Edges of aprons, the outer ones, the inner ones or both.
    aprons: Vec<Entity>,
    /// The ring's centre, where the file has it (m).
    centre: Option<DVec2>,
    /// What was left out or done, in words.
    notes: Vec<String>,
}
