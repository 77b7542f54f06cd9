//! A chart: panels side by side, each with lines over two axes and its legend below.

mod axis;

use std::fmt::Write;

use glam::DVec2;
use svg::Document;
use svg::node::element::{Circle, Group, Path, Rectangle, Title};

use crate::Error;
use crate::legend::{self, Entry, Swatch};
use crate::lettering::{Align, Lettering};
use crate::view::{colour, number};
pub(crate) use axis::{Axis, axes};

/// Upper left corner of the first panel's plot (px).
const CORNER: DVec2 = DVec2::new(92.0, 118.0);
/// Size of a plot (px).
const PLOT: DVec2 = DVec2::new(440.0, 380.0);
/// Distance from one plot's right edge to the next one's left (px).
const GAP: f64 = 104.0;
/// Distance from a plot's lower edge to its legend: numbers and axis title (px).
const AXIS: f64 = 62.0;
/// Margin to the right of the last plot and below the longest legend (px).
const MARGIN: f64 = 24.0;

/// Colours for lines that colour-blind readers can distinguish: P. Tol's "muted" scheme and two more.
pub const LINES: [&str; 11] = [
    "#332288", "#cc6677", "#117733", "#88ccee", "#882255", "#ddaa33", "#44aa99", "#999933", "#aa4499", "#661100",
    "#777777",
];

/// A picture of panels.
pub struct Chart {
    /// The first line.
    pub title: String,
    /// Further lines below it.
    pub subtitles: Vec<String>,
    /// Side by side, from left to right.
    pub panels: Vec<Panel>,
}

/// Lines over the same axes.
pub struct Panel {
    /// Above the plot.
    pub title: &'static str,
    /// Title of the horizontal axis, with its unit.
    pub x: &'static str,
    /// Title of the vertical axis, with its unit.
    pub y: &'static str,
    /// How values lie along both axes.
    pub scales: Scales,
    /// Lines in the order of the legend.
    pub lines: Vec<Line>,
}

/// How values lie along the axes of a panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scales {
    /// A factor has the same length everywhere.
    Logarithmic,
    /// A difference has; from 0 on.
    Linear,
}

/// A line of a panel.
pub struct Line {
    /// Words in the legend; without them the line is not in it.
    pub name: Option<&'static str>,
    /// The line's colour as SVG writes it, such as one of [`LINES`].
    pub colour: &'static str,
    /// Measured, or for comparison.
    pub kind: Kind,
    /// Points from left to right, in the units of the axes. Over logarithmic ones both coordinates are positive.
    pub points: Vec<DVec2>,
}

/// How a line looks.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// Measured: a mark at each point, with its least and greatest value where they are known, in the order of the
    /// points.
    Measured(Vec<(f64, f64)>),
    /// Measured at so many points that they need no marks.
    Curve,
    /// For comparison: dashed.
    Reference,
}

impl Chart {
    /// The chart as SVG text.
    ///
    /// # Errors
    ///
    /// [`Error::Typeface`].
    pub fn drawn(&self) -> Result<String, Error> {
        let lettering = Lettering::new()?;
        let n_panels = self.panels.len().max(1) as f64;
        let width = CORNER.x + n_panels * PLOT.x + (n_panels - 1.0) * GAP + MARGIN;
        let letters = lettering.fitting(&self.title, 23.0, width - 48.0);
        let mut group = Group::new();
        let mut lowest = 0.0f64;
        for (index, panel) in self.panels.iter().enumerate() {
            let corner = CORNER + DVec2::new(index as f64 * (PLOT.x + GAP), 0.0);
            let (drawn, bottom) = panel.drawn(&lettering, corner);
            group = group.add(drawn);
            lowest = lowest.max(bottom);
        }
        let height = (lowest + MARGIN).ceil();
        // The last row and column of pixels may be partly outside the page: the paper covers them.
        let paper = Rectangle::new().set("width", width + 2.0).set("height", height + 2.0).set("fill", "white");
        let mut document = Document::new()
            .set("viewBox", (0.0, 0.0, width, height))
            .set("width", width)
            .set("height", height)
            .add(Title::new(self.title.as_str()))
            .add(paper)
            .add(lettering.text(&self.title, DVec2::new(24.0, 32.0), letters, Align::Left, colour::INK));
        for (index, words) in self.subtitles.iter().enumerate() {
            let at = DVec2::new(24.0, 56.0 + 19.0 * index as f64);
            document = document.add(lettering.text(words, at, 14.5, Align::Left, colour::FAINT));
        }
        Ok(format!("{}\n", document.add(group)))
    }
}

impl Panel {
    /// The panel with its plot's upper left corner at `corner`, and how far down it reaches (px).
    fn drawn(&self, lettering: &Lettering, corner: DVec2) -> (Group, f64) {
        let end = corner + PLOT;
        let points = || self.lines.iter().flat_map(|line| &line.points);
        let spreads = self.lines.iter().flat_map(|line| match &line.kind {
            Kind::Measured(spread) => spread.as_slice(),
            Kind::Curve | Kind::Reference => &[],
        });
        let x = self.scales.axis(points().map(|p| p.x), corner.x, end.x);
        let values = points().map(|p| p.y).chain(spreads.flat_map(|&(low, high)| [low, high]));
        let y = self.scales.axis(values, end.y, corner.y);
        let mut group = Group::new().add(axes(lettering, &x, &y));
        let middle = DVec2::new(corner.x + 0.5 * PLOT.x, end.y + 44.0);
        group = group.add(lettering.text(self.x, middle, 15.0, Align::Middle, colour::INK));
        let upright = format!("rotate(-90 {} {})", corner.x - 62.0, corner.y + 0.5 * PLOT.y);
        let words = lettering.text(
            self.y,
            DVec2::new(corner.x - 62.0, corner.y + 0.5 * PLOT.y),
            15.0,
            Align::Middle,
            colour::INK,
        );
        group = group.add(words.set("transform", upright));
        group = group.add(lettering.text(
            self.title,
            DVec2::new(corner.x, corner.y - 10.0),
            16.0,
            Align::Left,
            colour::INK,
        ));
        // Lines for comparison lie below measured ones.
        let (references, measured): (Vec<&Line>, Vec<&Line>) =
            self.lines.iter().partition(|line| line.kind == Kind::Reference);
        for line in references.into_iter().chain(measured) {
            group = group.add(line.drawn(&x, &y));
        }
        let entries = self.lines.iter().filter_map(|line| {
            let swatch = if line.kind == Kind::Reference {
                Swatch::Line(line.colour, 1.4, "6 4")
            } else {
                Swatch::Line(line.colour, 2.4, "")
            };
            Some(Entry::new(swatch, line.name?))
        });
        let entries: Vec<Entry> = entries.collect();
        let (legend, height) = legend::drawn(lettering, &entries, DVec2::new(corner.x, end.y + AXIS), PLOT.x);
        (group.add(legend), end.y + AXIS + height)
    }
}

impl Scales {
    fn axis(self, values: impl Iterator<Item = f64>, from: f64, to: f64) -> Axis {
        match self {
            Scales::Logarithmic => Axis::logarithmic(values, from, to),
            Scales::Linear => Axis::linear_to_ticks(0.0, values.fold(0.0, f64::max), from, to),
        }
    }
}

impl Line {
    pub(crate) fn drawn(&self, x: &Axis, y: &Axis) -> Group {
        let position = |p: &DVec2| (number(x.at(p.x)), number(y.at(p.y)));
        let mut data = String::new();
        for (index, p) in self.points.iter().enumerate() {
            let (across, down) = position(p);
            // Writing to a string cannot fail.
            let _ = write!(data, "{}{across} {down}", if index == 0 { 'M' } else { 'L' });
        }
        let path =
            Path::new().set("d", data).set("fill", "none").set("stroke", self.colour).set("stroke-linejoin", "round");
        let spread = match &self.kind {
            Kind::Measured(spread) => spread,
            Kind::Curve => return Group::new().add(path.set("stroke-width", 2.4)),
            Kind::Reference => return Group::new().add(path.set("stroke-width", 1.4).set("stroke-dasharray", "6 4")),
        };
        let mut bars = String::new();
        for (p, &(low, high)) in self.points.iter().zip(spread) {
            let (across, low, high) = (x.at(p.x), y.at(low), y.at(high));
            let (left, across) = (number(across - 4.0), number(across));
            let (low, high) = (number(low), number(high));
            let _ = write!(bars, "M{left} {low}h8M{left} {high}h8M{across} {low}V{high}");
        }
        let bars = Path::new().set("d", bars).set("fill", "none").set("stroke", self.colour).set("stroke-width", 1.2);
        let mut group = Group::new().add(path.set("stroke-width", 2.4)).add(bars);
        for p in &self.points {
            let (across, down) = position(p);
            let mark = Circle::new().set("cx", across).set("cy", down).set("r", 3.6).set("fill", self.colour);
            group = group.add(mark.set("stroke", "white").set("stroke-width", 1.0));
        }
        group
    }
}
