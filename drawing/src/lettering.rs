//! Text as outlines of an embedded typeface, so that a picture needs no fonts.

use std::fmt::Write;

use glam::DVec2;
use svg::node::element::{Group, Path};
use ttf_parser::{Face, FaceParsingError, OutlineBuilder};

use crate::figure::number;

/// Which part of a line of text is at its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    Left,
    Middle,
    Right,
}

/// The typeface.
pub struct Lettering {
    face: Face<'static>,
}

impl Lettering {
    pub fn new() -> Result<Lettering, FaceParsingError> {
        Ok(Lettering { face: Face::parse(epaint_default_fonts::UBUNTU_LIGHT, 0)? })
    }

    /// Width of `words` in text of `size` \[px].
    pub fn width(&self, words: &str, size: f64) -> f64 {
        let advance = |letter| self.face.glyph_index(letter).and_then(|glyph| self.face.glyph_hor_advance(glyph)).unwrap_or(0);
        words.chars().map(|letter| f64::from(advance(letter))).sum::<f64>() * self.scale(size)
    }

    /// One line of text with its base line at `at` \[px].
    pub fn text(&self, words: &str, at: DVec2, size: f64, align: Align, colour: &str) -> Path {
        // The typeface is light: a thin stroke keeps it readable in small pictures.
        let weight = number(0.035 * size);
        self.outlines(words, at, size, align).set("fill", colour).set("stroke", colour).set("stroke-width", weight).set("aria-label", words)
    }

    /// The same with a light rim, to be read over a map.
    pub fn text_on_map(&self, words: &str, at: DVec2, size: f64, align: Align, colour: &str) -> Group {
        let rim = self.outlines(words, at, size, align).set("fill", "white").set("stroke", "white");
        let rim = rim.set("stroke-width", number(0.3 * size)).set("stroke-linejoin", "round").set("stroke-opacity", 0.85);
        Group::new().add(rim).add(self.text(words, at, size, align, colour))
    }

    fn outlines(&self, words: &str, at: DVec2, size: f64, align: Align) -> Path {
        let shift = match align {
            Align::Left => 0.0,
            Align::Middle => 0.5,
            Align::Right => 1.0,
        };
        let mut pen = Pen { data: String::new(), at: at - DVec2::new(shift * self.width(words, size), 0.0), scale: self.scale(size) };
        for glyph in words.chars().filter_map(|letter| self.face.glyph_index(letter)) {
            // A glyph without an outline, such as a space, only moves the pen.
            self.face.outline_glyph(glyph, &mut pen);
            pen.at.x += f64::from(self.face.glyph_hor_advance(glyph).unwrap_or(0)) * pen.scale;
        }
        Path::new().set("d", pen.data)
    }

    fn scale(&self, size: f64) -> f64 {
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
