//! Text as outlines of an embedded typeface, so that a picture needs no fonts.

use std::fmt::Write;

use glam::DVec2;
use resvg::tiny_skia;
use svg::node::element::{Group, Path};
use ttf_parser::{Face, FaceParsingError, GlyphId, OutlineBuilder};

use crate::view::number;

/// Which part of a line of text is at its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    Left,
    Middle,
    Right,
}

/// Width of the stroke of a letter as a fraction of the size: the typeface is light, and a thin stroke keeps it
/// readable in small pictures.
pub const WEIGHT: f64 = 0.035;
/// Width of the light rim behind one over a map, as a fraction of the size, and its opacity.
pub const RIM: f64 = 0.3;
pub const RIM_OPACITY: f64 = 0.85;

/// The typeface.
pub struct Lettering {
    face: Face<'static>,
}

impl Lettering {
    pub fn new() -> Result<Lettering, FaceParsingError> {
        Ok(Lettering { face: Face::parse(epaint_default_fonts::UBUNTU_LIGHT, 0)? })
    }

    /// Width of `words` in text of `size` (px).
    pub fn width(&self, words: &str, size: f64) -> f64 {
        let advance = |glyph| self.face.glyph_hor_advance(glyph).unwrap_or(0);
        self.glyphs(words).map(|glyph| f64::from(advance(glyph))).sum::<f64>() * self.scale(size)
    }

    /// The glyphs of a text: a box, the typeface's own, for what it has no letter for, and nothing for marks that only
    /// say how the letters beside them join.
    fn glyphs(&self, words: &str) -> impl Iterator<Item = GlyphId> {
        let joins = |letter: char| matches!(letter, '\u{200b}'..='\u{200f}' | '\u{2060}' | '\u{fe0f}');
        words.chars().filter(move |&letter| !joins(letter)).map(|letter| {
            // The first glyph of every typeface is that box.
            self.face.glyph_index(letter).unwrap_or(GlyphId(0))
        })
    }

    /// The size in which words are at most `width` wide, `largest` at most (px).
    pub fn fitting(&self, words: &str, largest: f64, width: f64) -> f64 {
        largest.min(width / self.width(words, 1.0).max(f64::MIN_POSITIVE))
    }

    /// One line of text with its base line at `at` (px).
    pub fn text(&self, words: &str, at: DVec2, size: f64, align: Align, colour: &str) -> Path {
        let outlines = self.outlines(words, at, size, align).set("fill", colour).set("stroke", colour);
        outlines.set("stroke-width", number(WEIGHT * size)).set("aria-label", words)
    }

    /// One line of text with a light rim, to be read over a map, with its base line at `at` (px).
    pub fn text_on_map(&self, words: &str, at: DVec2, size: f64, align: Align, colour: &str) -> Group {
        let rim = self.outlines(words, at, size, align).set("fill", "white").set("stroke", "white");
        let rim = rim.set("stroke-width", number(RIM * size)).set("stroke-linejoin", "round");
        let rim = rim.set("stroke-opacity", RIM_OPACITY);
        Group::new().add(rim).add(self.text(words, at, size, align, colour))
    }

    /// The outlines of one line of text with its base line at `at` (px); `None` for words without any.
    pub fn path(&self, words: &str, at: DVec2, size: f64, align: Align) -> Option<tiny_skia::Path> {
        let mut brush = Brush { path: tiny_skia::PathBuilder::new(), at, scale: self.scale(size) };
        for (glyph, at) in self.placed(words, at, size, align) {
            brush.at = at;
            self.face.outline_glyph(glyph, &mut brush);
        }
        brush.path.finish()
    }

    /// The outline of a glyph in units of the typeface, as path data; empty for one that draws nothing.
    pub fn glyph(&self, glyph: GlyphId) -> String {
        let mut pen = Pen { data: String::new(), at: DVec2::ZERO, scale: 1.0 };
        self.face.outline_glyph(glyph, &mut pen);
        pen.data
    }

    fn outlines(&self, words: &str, at: DVec2, size: f64, align: Align) -> Path {
        let mut pen = Pen { data: String::new(), at, scale: self.scale(size) };
        for (glyph, at) in self.placed(words, at, size, align) {
            pen.at = at;
            // A glyph without an outline, such as a space, draws nothing.
            self.face.outline_glyph(glyph, &mut pen);
        }
        Path::new().set("d", pen.data)
    }

    /// The glyphs of one line of text, each with the left end of its base line (px).
    pub fn placed(&self, words: &str, at: DVec2, size: f64, align: Align) -> impl Iterator<Item = (GlyphId, DVec2)> {
        let mut at = self.left(words, at, size, align);
        self.glyphs(words).map(move |glyph| {
            let left = at;
            at.x += f64::from(self.face.glyph_hor_advance(glyph).unwrap_or(0)) * self.scale(size);
            (glyph, left)
        })
    }

    /// The left end of the base line of a line of text (px).
    pub fn left(&self, words: &str, at: DVec2, size: f64, align: Align) -> DVec2 {
        let shift = match align {
            Align::Left => 0.0,
            Align::Middle => 0.5,
            Align::Right => 1.0,
        };
        at - DVec2::new(shift * self.width(words, size), 0.0)
    }

    /// Size of a unit of the typeface in text of `size` (px).
    pub fn scale(&self, size: f64) -> f64 {
        size / f64::from(self.face.units_per_em())
    }
}

/// Writes a letter's outline as path data.
struct Pen {
    data: String,
    at: DVec2,
    scale: f64,
}

impl Pen {
    fn draw(&mut self, command: char, points: &[(f32, f32)]) {
        self.data.push(command);
        for &(x, y) in points {
            let p = self.at + DVec2::new(f64::from(x), -f64::from(y)) * self.scale;
            // Writing to a string cannot fail.
            let _ = write!(self.data, "{} {} ", number(p.x), number(p.y));
        }
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.draw('M', &[(x, y)]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.draw('L', &[(x, y)]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.draw('Q', &[(x1, y1), (x, y)]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.draw('C', &[(x1, y1), (x2, y2), (x, y)]);
    }

    fn close(&mut self) {
        self.data.push('Z');
    }
}

/// Adds a letter's outline to a path that is painted at once.
struct Brush {
    path: tiny_skia::PathBuilder,
    at: DVec2,
    scale: f64,
}

impl Brush {
    fn point(&self, x: f32, y: f32) -> (f32, f32) {
        let p = self.at + DVec2::new(f64::from(x), -f64::from(y)) * self.scale;
        (p.x as f32, p.y as f32)
    }
}

impl OutlineBuilder for Brush {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.point(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.point(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.point(x1, y1), self.point(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.point(x1, y1), self.point(x2, y2), self.point(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}
