//! Pictures of roundabouts, swept paths, episodes and measurements, as SVG, PNG and GIF.
//!
//! - [`figure::roundabout`] draws a roundabout with its routes, [`figure::swept_path`] a [`sweep::Sweep`] on one of
//!   them.
//! - [`offtrack_evaluation::recording::Recorder`] records episodes of a batch, [`episode::Scene`] draws one as a still,
//!   [`film::gif`] as a film.
//! - [`comparison::Comparison`] draws several on one route, with speed and load transfer along it.
//! - [`camera::Camera`] draws a truck as it is now, in RGB pixels, while it is stepped.
//! - [`sheet::drawn`] draws many roundabouts side by side, [`histograms::Histograms`] how their dimensions are
//!   distributed.
//! - [`conflicts::drawn`] draws where the paths of cars meet.
//! - [`chart::Chart`] draws measurements over two axes.
//! - [`fits::sheet`] shows at scale which vehicles fit through a road, [`fits::pdf`] is the same as PDF.
//! - [`rasterised`] makes a PNG of any of these SVGs. Text is drawn as outlines, so that pictures are equal on every
//!   machine.
//!
//! ```
//! use offtrack::map::{Gutter, Road};
//! use offtrack_drawing::figure::{self, Straights};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let roundabout = Road::named("16m")?;
//! let straights = Straights { approach: 40.0, departure: 35.0 };
//! let routes = roundabout.routes(straights.approach, straights.departure, 2.0)?;
//! let svg = figure::roundabout(&roundabout, &routes, straights, Gutter::Drivable)?;
//! # assert!(svg.starts_with("<svg "));
//! # Ok(())
//! # }
//! ```

pub mod camera; // a truck as it is now, in pixels
pub mod chart; // measurements as lines
pub mod comparison; // episodes on one route beside each other
pub mod conflicts; // where paths of cars meet
pub mod episode; // a recorded episode, still or moving
pub mod figure; // a map with axes, title and legend
pub mod film; // a recorded episode as GIF
pub mod fits; // sheets at scale for road designers
pub mod histograms; // how often values are drawn
pub mod json; // a road for other programs
mod isolines; // lines of equal distance
mod legend; // samples and words below a map
mod lettering; // text as outlines
pub mod limits; // where a path asks for more than the truck has
mod road; // the layers of a map
pub mod sheet; // many roundabouts side by side
mod stations; // how far along a route a truck is
pub mod sweep; // a truck's swept path on a route
mod view; // metres in pixels, and colours

use resvg::{tiny_skia, usvg};

/// Why a picture cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The embedded typeface cannot be read.
    #[error("the typeface cannot be read: {0}")]
    Typeface(#[from] ttf_parser::FaceParsingError),
    /// A text is not an SVG.
    #[error("the SVG cannot be read: {0}")]
    Svg(#[from] usvg::Error),
    /// A PNG cannot be encoded.
    #[error("the PNG cannot be encoded: {0}")]
    Png(#[from] png::EncodingError),
    /// A film cannot be encoded.
    #[error("the GIF cannot be encoded: {0}")]
    Gif(#[from] gif::EncodingError),
    /// The side of a camera's square pictures (pixels) is out of range.
    #[error(
        "a picture of {0} x {0} pixels cannot be drawn; its side must lie in {low}..={high} pixels",
        low = camera::SIDES.start(),
        high = camera::SIDES.end()
    )]
    Side(u32),
    /// The picture has no pixels, or more than its format can hold.
    #[error("a picture of {width} x {height} pixels cannot be drawn")]
    Size {
        /// Width asked for (pixels).
        width: u32,
        /// Height that follows from it (pixels).
        height: u32,
    },
}

/// The PNG of an SVG text, `width` pixels wide.
///
/// # Errors
///
/// [`Error::Svg`] for a text that is not an SVG, [`Error::Size`] for a width of 0 or one too large.
pub fn rasterised(svg: &str, width: u32) -> Result<Vec<u8>, Error> {
    let tree = usvg::Tree::from_str(svg, &usvg::Options::default())?;
    let pixels = painted(&tree, width, None)?;
    let colours: Vec<u8> =
        pixels.data().chunks_exact(4).flat_map(|pixel| [0, 1, 2].map(|channel| stepped(pixel[channel]))).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, pixels.width(), pixels.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&colours)?;
    writer.finish()?;
    Ok(bytes)
}

/// The picture in pixels, `width` wide, over a background of the same size.
fn painted(tree: &usvg::Tree, width: u32, background: Option<&tiny_skia::Pixmap>) -> Result<tiny_skia::Pixmap, Error> {
    let scale = width as f32 / tree.size().width();
    let height = (tree.size().height() * scale).round().max(1.0) as u32;
    let mut pixels = match background {
        Some(background) => background.clone(),
        None => tiny_skia::Pixmap::new(width, height).ok_or(Error::Size { width, height })?,
    };
    resvg::render(tree, tiny_skia::Transform::from_scale(scale, scale), &mut pixels.as_mut());
    Ok(pixels)
}

/// Quantisation step of a colour channel: too small to see, and it halves a PNG.
const COLOUR_STEP: u8 = 15;

/// The nearest quantised value of a channel. The paper is opaque, so a pixel's channels are its colour.
fn stepped(channel: u8) -> u8 {
    (channel.saturating_add(COLOUR_STEP / 2) / COLOUR_STEP) * COLOUR_STEP
}
