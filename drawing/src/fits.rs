//! What `offtrack fits` hands to a road designer: a sheet at scale of a road, as SVG and as PDF, and its swept
//! paths as DXF and GeoJSON.

mod dxf; // swept paths for a CAD program
mod geojson; // a road and swept paths for a GIS program
mod letters; // each glyph once
mod page; // the content of a PDF
mod panel; // one route and vehicle on the sheet
mod paper; // which paper at which scale
mod pdf; // an SVG of paths as PDF
pub mod sheet; // panels, title block, legend

pub use dxf::dxf;
pub use geojson::geojson;
pub use pdf::pdf;

use offtrack::vehicle::swept::Pose;

/// Distance between the outlines at stations (m).
const BETWEEN_OUTLINES: f64 = 5.0;

/// The poses at which outlines are drawn, by index, with their distances along the path (m).
fn stations(poses: &[Pose]) -> Vec<(usize, f64)> {
    let (mut next, mut station) = (0.0, 0.0);
    let mut stations = Vec::new();
    for (index, pose) in poses.iter().enumerate() {
        if 0 < index {
            station += pose.position.distance(poses[index - 1].position);
        }
        if next <= station {
            next += BETWEEN_OUTLINES;
            stations.push((index, station));
        }
    }
    stations
}
