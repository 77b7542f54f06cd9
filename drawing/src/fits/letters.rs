//! The letters of a sheet, which has many thousands: each glyph's outline stands in the picture once.

use std::cell::RefCell;
use std::collections::BTreeSet;

use glam::DVec2;
use svg::node::element::{Definitions, Group, Path, Use};
use ttf_parser::GlyphId;

use crate::lettering::{Align, Lettering, RIM, RIM_OPACITY, WEIGHT};
use crate::view::number;

/// Lines of text whose glyphs are used by name.
pub(super) struct Letters<'a> {
    lettering: &'a Lettering,
    used: RefCell<BTreeSet<GlyphId>>,
}

impl Letters<'_> {
    pub(super) fn of(lettering: &Lettering) -> Letters<'_> {
        Letters { lettering, used: RefCell::default() }
    }

    /// One line of text with its base line at `at` (px).
    pub(super) fn text(&self, words: &str, at: DVec2, size: f64, align: Align, colour: &str) -> Group {
        let (group, weight) = self.line(words, at, size, align);
        group.set("fill", colour).set("stroke", colour).set("stroke-width", weight).set("aria-label", words)
    }

    /// One line of text with a light rim, to be read over a map, with its base line at `at` (px).
    pub(super) fn text_on_map(&self, words: &str, at: DVec2, size: f64, align: Align, colour: &str) -> Group {
        let (rim, weight) = self.line(words, at, size, align);
        let rim = rim.set("fill", "white").set("stroke", "white").set("stroke-linejoin", "round");
        let rim = rim.set("stroke-width", number(RIM / WEIGHT * weight)).set("stroke-opacity", RIM_OPACITY);
        Group::new().add(rim).add(self.text(words, at, size, align, colour))
    }

    /// The outlines of all glyphs used, to be named by the lines of text.
    pub(super) fn defined(&self, definitions: Definitions) -> Definitions {
        let outline = |&glyph: &GlyphId| Path::new().set("id", name(glyph)).set("d", self.lettering.glyph(glyph));
        self.used.borrow().iter().map(outline).fold(definitions, Definitions::add)
    }

    /// The glyphs of a line in units of the typeface, and the width there of the stroke that keeps it readable.
    fn line(&self, words: &str, at: DVec2, size: f64, align: Align) -> (Group, f64) {
        let scale = self.lettering.scale(size);
        let left = self.lettering.left(words, at, size, align);
        let mut group =
            Group::new().set("transform", format!("translate({} {})scale({scale:.6})", number(left.x), number(left.y)));
        for (glyph, along) in self.lettering.placed(words, DVec2::ZERO, 1.0 / self.lettering.scale(1.0), Align::Left) {
            if self.lettering.glyph(glyph).is_empty() {
                continue;
            }
            self.used.borrow_mut().insert(glyph);
            group = group.add(Use::new().set("href", format!("#{}", name(glyph))).set("x", number(along.x)));
        }
        (group, WEIGHT / self.lettering.scale(1.0))
    }
}

fn name(glyph: GlyphId) -> String {
    format!("g{}", glyph.0)
}
