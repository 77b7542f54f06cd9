//! Pixels that shapes are painted on, with anti-aliasing.

use glam::DVec2;
use resvg::tiny_skia::{
    Color, FillRule, LineCap, Paint, Path, PathBuilder, PixmapMut, Shader, Stroke, StrokeDash, Transform,
};

use crate::lettering::{Align, Lettering};

/// Shapes with a point further than this from the upper left corner are left out: the painter's numbers are fixed-point
/// (px).
const FAR: f64 = 16000.0;

/// A colour as `#rrggbb`, and how opaque it is.
#[derive(Clone, Copy)]
pub struct Ink(pub &'static str, pub f32);

impl Ink {
    /// Red, green and blue.
    pub fn channels(self) -> [u8; 3] {
        let hex = u32::from_str_radix(self.0.trim_start_matches('#'), 16).unwrap_or(0);
        [16, 8, 0].map(|bits| (hex >> bits) as u8)
    }

    fn paint(self) -> Paint<'static> {
        let [red, green, blue] = self.channels();
        let alpha = (255.0 * self.1).round() as u8;
        Paint { shader: Shader::SolidColor(Color::from_rgba8(red, green, blue, alpha)), ..Paint::default() }
    }
}

/// A picture, or rows of one. Points are pixels from its upper left corner, x right, y down; what lies outside is cut
/// off.
pub struct Canvas<'a> {
    pixels: PixmapMut<'a>,
}

impl<'a> Canvas<'a> {
    /// A canvas on opaque RGBA pixels `[rows, width, 4]`; `None` without any.
    pub fn on(rgba: &'a mut [u8], width: u32) -> Option<Canvas<'a>> {
        let height = rgba.len() as u32 / (4 * width);
        Some(Canvas { pixels: PixmapMut::from_bytes(rgba, width, height)? })
    }

    /// Everything in one colour.
    pub fn cover(&mut self, ink: Ink) {
        let [red, green, blue] = ink.channels();
        self.pixels.fill(Color::from_rgba8(red, green, blue, 255));
    }

    /// What lies inside an odd number of closed lines.
    pub fn areas<L: AsRef<[DVec2]>>(&mut self, loops: &[L], ink: Ink) {
        self.fill(path(loops, true), ink);
    }

    /// A polygon with an edge `width` wide.
    pub fn polygon(&mut self, corners: &[DVec2], fill: Ink, edge: Ink, width: f64) {
        let Some(path) = path(&[corners], true) else { return };
        self.pixels.fill_path(&path, &fill.paint(), FillRule::EvenOdd, Transform::identity(), None);
        self.pixels.stroke_path(&path, &edge.paint(), &stroke(width), Transform::identity(), None);
    }

    /// Open lines, or closed ones.
    pub fn lines<L: AsRef<[DVec2]>>(&mut self, lines: &[L], closed: bool, ink: Ink, width: f64) {
        self.stroke(path(lines, closed), ink, stroke(width));
    }

    /// Open lines of dashes `dash` long, `gap` apart.
    pub fn dashes(&mut self, lines: &[Vec<DVec2>], ink: Ink, width: f64, [dash, gap]: [f64; 2]) {
        let dash = StrokeDash::new(vec![dash as f32, gap as f32], 0.0);
        self.stroke(path(lines, false), ink, Stroke { dash, ..stroke(width) });
    }

    /// Dots of one size.
    pub fn dots(&mut self, at: &[DVec2], radius: f64, ink: Ink) {
        let mut builder = PathBuilder::new();
        for p in at.iter().filter(|p| is_near(p)) {
            builder.push_circle(p.x as f32, p.y as f32, radius as f32);
        }
        let Some(path) = builder.finish() else { return };
        // Dots that meet are one.
        self.pixels.fill_path(&path, &ink.paint(), FillRule::Winding, Transform::identity(), None);
    }

    /// One line of text with its base line at `at`.
    pub fn words(&mut self, lettering: &Lettering, words: &str, at: DVec2, size: f64, align: Align, ink: Ink) {
        let path = lettering.path(words, at, size, align);
        // The typeface is light: a thin stroke keeps it readable.
        self.stroke(path.clone(), ink, stroke(0.035 * size));
        self.fill(path, ink);
    }

    fn fill(&mut self, path: Option<Path>, ink: Ink) {
        let Some(path) = path else { return };
        self.pixels.fill_path(&path, &ink.paint(), FillRule::EvenOdd, Transform::identity(), None);
    }

    fn stroke(&mut self, path: Option<Path>, ink: Ink, stroke: Stroke) {
        let Some(path) = path else { return };
        self.pixels.stroke_path(&path, &ink.paint(), &stroke, Transform::identity(), None);
    }
}

fn stroke(width: f64) -> Stroke {
    Stroke { width: width as f32, line_cap: LineCap::Butt, ..Stroke::default() }
}

/// Lines as one path, without those that go far away; `None` if nothing is left.
fn path<L: AsRef<[DVec2]>>(lines: &[L], closed: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for line in lines.iter().map(AsRef::as_ref).filter(|line| line.iter().all(is_near)) {
        for (n, p) in line.iter().enumerate() {
            if n == 0 { builder.move_to(p.x as f32, p.y as f32) } else { builder.line_to(p.x as f32, p.y as f32) }
        }
        if closed {
            builder.close();
        }
    }
    builder.finish()
}

/// Whether a point is a number, and near enough to be painted.
fn is_near(p: &DVec2) -> bool {
    p.abs().cmplt(DVec2::splat(FAR)).all()
}
