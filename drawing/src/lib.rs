//! Pictures: roundabouts, swept paths, episodes and measurements, as SVG, PNG and GIF.
//!
//! A PNG is the SVG rasterised: both show the same on every machine, because letters are drawn as outlines too.

pub mod chart; // measurements as lines
pub mod episode; // a recorded episode, still or moving
pub mod film; // a recorded episode as GIF
mod isolines; // lines of equal distance
mod legend;
mod lettering; // text as outlines
pub mod polygons; // curves as points
pub mod recording; // an episode, step by step
mod road; // a roundabout from above
pub mod sheet; // a map with axes, title and legend
pub mod sweep; // what a truck covers on its route

use resvg::{tiny_skia, usvg};

/// What drawing can fail with.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// The picture as a PNG, `width` pixels wide.
pub fn rasterised(svg: &str, width: u32) -> Result<Vec<u8>, Failure> {
    let tree = usvg::Tree::from_str(svg, &usvg::Options::default())?;
    let pixels = painted(&tree, width, None)?;
    let colours: Vec<u8> = pixels.data().chunks_exact(4).flat_map(|pixel| [0, 1, 2].map(|channel| stepped(pixel[channel]))).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, pixels.width(), pixels.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&colours)?;
    writer.finish()?;
    Ok(bytes)
}

/// The picture in pixels, `width` wide, over another of the same size or over nothing.
fn painted(tree: &usvg::Tree, width: u32, ground: Option<&tiny_skia::Pixmap>) -> Result<tiny_skia::Pixmap, Failure> {
    let scale = width as f32 / tree.size().width();
    let height = (tree.size().height() * scale).round().max(1.0) as u32;
    let mut pixels = match ground {
        Some(ground) => ground.clone(),
        None => tiny_skia::Pixmap::new(width, height).ok_or("the picture is too large")?,
    };
    resvg::render(tree, tiny_skia::Transform::from_scale(scale, scale), &mut pixels.as_mut());
    Ok(pixels)
}

/// Width of the steps between the values of a colour's channel: too small to see, and they halve a PNG.
const COLOUR_STEP: u8 = 15;

/// A channel's nearest step. The paper is opaque, so that a pixel's channels are its colour.
fn stepped(channel: u8) -> u8 {
    (channel.saturating_add(COLOUR_STEP / 2) / COLOUR_STEP) * COLOUR_STEP
}
