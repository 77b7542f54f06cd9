//! What `offtrack fits` hands to a road designer: a sheet at scale of a road, as SVG and as PDF, and its swept
//! paths as DXF.

mod dxf; // swept paths for a CAD program
mod panel; // one route and vehicle on the sheet
mod paper; // which paper at which scale
mod pdf; // an SVG of paths as PDF
pub mod sheet; // panels, title block, legend

pub use dxf::dxf;
pub use pdf::pdf;
