//! Roads from drawings: kerbs and lane centre lines of a DXF file as a [`Ground`](super::ground::Ground).
//!
//! A drawing has no meaning but its layers: closed outlines of kerbs on one, on another a line for each way through the
//! ring, from the end of its entry arm to the end of its exit arm, in the direction of travel. What is drawn otherwise
//! on these layers is refused with its line; other layers are left out.

mod entities; // polylines, lines and arcs on their layers
mod pairs; // group codes and values
mod site; // what is drawn, as a road
#[cfg(test)]
mod tests;

use std::path::Path;

use glam::DVec2;

pub use entities::Unit;
pub use site::Drawn;

use crate::files::reader::{Error, read_bytes};

/// Most bytes of a drawing.
const FILE_LIMIT: u64 = 128 << 20;

/// Whether a file is a drawing by its name.
pub fn is_drawing(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("dxf"))
}

/// How a drawing is read.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    /// Layer of the kerbs' closed outlines.
    pub kerbs: String,
    /// Layer of the ways' centre lines.
    pub lanes: String,
    /// Unit of its coordinates; what the drawing says without one.
    pub unit: Option<Unit>,
    /// Width of all lanes (m).
    pub lane_width: f64,
    /// A point near the ring's centre in the drawing's frame (m); the largest island without one.
    pub ring: Option<DVec2>,
    /// Names of the arms, counter-clockwise from east; by compass without them.
    pub arms: Vec<String>,
}

/// Reads the road that is drawn on these layers.
///
/// # Errors
///
/// The file and what is wrong: no DXF in ASCII, a unit that is unknown, an outline that is open, a layer without
/// anything, and so on, each with its line and what would do.
pub fn read(file: &Path, layers: &Layers) -> Result<Drawn, Error> {
    let bytes = read_bytes(file, FILE_LIMIT)?;
    parse(file, &String::from_utf8_lossy(&bytes), layers)
}

fn parse(file: &Path, text: &str, layers: &Layers) -> Result<Drawn, Error> {
    let drawing = entities::Drawing::parse(file, text, layers)?;
    site::drawn(file, drawing, layers)
}
