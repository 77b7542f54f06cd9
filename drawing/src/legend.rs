//! The legend: a sample and a few words for each element of a map, in columns.

use glam::DVec2;
use svg::Node;
use svg::node::element::{Circle, Group, Path, Rectangle};

use crate::lettering::{Align, Lettering};
use crate::view::{colour, number};

/// Size of the text (px).
pub const SIZE: f64 = 15.0;
/// Line spacing (px).
const LINE: f64 = 25.0;
/// Width of a sample and the gap after it (px).
const SAMPLE: f64 = 46.0;
/// Width of a sample alone (px).
const SWATCH: f64 = 36.0;

/// How an element of the map looks.
pub enum Swatch {
    /// Fill.
    Area(&'static str),
    /// Colour, width and dashes.
    Line(&'static str, f64, &'static str),
    /// A line with a direction.
    Arrow(&'static str),
    /// A ring around a point.
    Ring(&'static str),
}

/// One element of the map.
pub struct Entry {
    swatch: Swatch,
    words: String,
}

impl Entry {
    pub fn new(swatch: Swatch, words: impl Into<String>) -> Entry {
        Entry { swatch, words: words.into() }
    }
}

/// The legend with its upper left corner at `corner`, at most `width` wide, and its height (px).
pub fn drawn(lettering: &Lettering, entries: &[Entry], corner: DVec2, width: f64) -> (Group, f64) {
    drawn_with(lettering, entries, corner, width, |words, at| {
        lettering.text(words, at, SIZE, Align::Left, colour::INK).into()
    })
}

/// The same, its words drawn by `text` in letters of [`SIZE`] with their base line there (px).
pub fn drawn_with(
    lettering: &Lettering,
    entries: &[Entry],
    corner: DVec2,
    width: f64,
    text: impl Fn(&str, DVec2) -> Box<dyn Node>,
) -> (Group, f64) {
    let widest = entries.iter().map(|entry| lettering.width(&entry.words, SIZE)).fold(0.0, f64::max);
    let columns = ((width / (SAMPLE + widest + 12.0)).floor() as usize).clamp(1, 4);
    let rows = entries.len().div_ceil(columns);
    let mut group = Group::new();
    for (index, entry) in entries.iter().enumerate() {
        // Filled column by column.
        let (column, row) = (index / rows, index % rows);
        let at = corner + DVec2::new(column as f64 * width / columns as f64, (row as f64 + 0.5) * LINE);
        group = group.add(sample(&entry.swatch, at));
        group = group.add(text(&entry.words, at + DVec2::new(SAMPLE, 5.0)));
    }
    (group, rows as f64 * LINE)
}

/// A chevron with its tip at `at`, pointing along `direction` (px).
pub fn chevron(at: DVec2, direction: DVec2, colour: &str) -> Path {
    let [tip, left, notch, right] = chevron_corners(at, 9.0 * direction);
    let n = number;
    let data = format!(
        "M{} {}L{} {}L{} {}L{} {}Z",
        n(tip.x),
        n(tip.y),
        n(left.x),
        n(left.y),
        n(notch.x),
        n(notch.y),
        n(right.x),
        n(right.y)
    );
    Path::new().set("d", data).set("fill", colour).set("stroke", "white").set("stroke-width", 0.6)
}

/// Corners of a chevron with its tip at `at`, as long as `along` and pointing there (px).
pub fn chevron_corners(at: DVec2, along: DVec2) -> [DVec2; 4] {
    let side = along.perp() * (4.6 / 9.0);
    [at, at - along + side, at - 0.68 * along, at - along - side]
}

/// The sample of an entry; `at` is the middle of its left edge (px).
fn sample(swatch: &Swatch, at: DVec2) -> Group {
    let line = |colour: &str, width: f64| {
        let path = Path::new().set("d", format!("M{} {}h{SWATCH}", number(at.x), number(at.y))).set("fill", "none");
        path.set("stroke", colour).set("stroke-width", width)
    };
    match *swatch {
        Swatch::Area(fill) => {
            let area = Rectangle::new()
                .set("x", number(at.x))
                .set("y", number(at.y - 7.5))
                .set("width", SWATCH)
                .set("height", 15);
            Group::new().add(area.set("fill", fill).set("stroke", colour::FAINT).set("stroke-width", 0.8))
        }
        Swatch::Line(colour, width, "") => Group::new().add(line(colour, width)),
        Swatch::Line(colour, width, dashes) => Group::new().add(line(colour, width).set("stroke-dasharray", dashes)),
        Swatch::Arrow(colour) => {
            Group::new().add(line(colour, 1.8)).add(chevron(at + DVec2::new(SWATCH / 2.0 + 5.0, 0.0), DVec2::X, colour))
        }
        Swatch::Ring(colour) => {
            let ring = Circle::new()
                .set("cx", number(at.x + SWATCH / 2.0))
                .set("cy", number(at.y))
                .set("r", 8)
                .set("fill", "none");
            Group::new().add(ring.set("stroke", colour).set("stroke-width", 2.2))
        }
    }
}
