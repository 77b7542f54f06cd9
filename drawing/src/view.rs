//! How metres become pixels: the view of a map on its page, and the colours and numbers that it is drawn with.

use std::fmt::Write;

use glam::DVec2;
use offtrack::geometry::{Curve, Piece};

/// Colours that differ for colour-blind readers and in grey: the hues of P. Tol's "vibrant" scheme. Channels of areas
/// are multiples of 15, which the quantisation of a PNG leaves as they are.
pub(crate) mod colour {
    pub const INK: &str = "#1a1a1a";
    pub const FAINT: &str = "#6e6e6e";
    pub const SOLID: &str = "#d2d2d2";
    pub const GUTTER: &str = "#f0e1c3";
    pub const APRON: &str = "#e1b496";
    pub const ROAD: &str = "#ffffff";
    pub const KERB: &str = "#333333";
    pub const CONTOUR: &str = "#b5c4cf";
    pub const LANE: &str = "#8c8c8c";
    pub const LEFT: &str = "#0077bb";
    pub const RIGHT: &str = "#ee7733";
    pub const TRACTOR: &str = "#0077bb";
    pub const TRAILER: &str = "#ee7733";
    pub const SWEPT_BY_TRACTOR: &str = "#b4d2f0";
    pub const SWEPT_BY_TRAILER: &str = "#ffd2b4";
    pub const DRIVE_AXLE: &str = "#004a80";
    pub const TRAILER_AXLES: &str = "#a84300";
    pub const OVERLAP: &str = "#c2003a";
    pub const ROUTE: &str = "#228833";
    pub const RAY: &str = "#aa3377";
    pub const FOLLOWED: &str = "#96d2c3";
    pub const CROSSED: &str = "#e1695a";
    pub const BESIDE: &str = "#aa3377";
    pub const CAR: &str = "#5a7887";
    pub const VAN: &str = "#87785a";
    pub const BRAKES: &str = "#e11e1e";
    pub const RUDE: &str = "#aa3377";
}

/// Width of the page (px).
pub(crate) const WIDTH: f64 = 1000.0;
/// Margins from the page's left, right and upper edge to the map (px).
pub(crate) const LEFT: f64 = 48.0;
pub(crate) const RIGHT: f64 = 16.0;
pub(crate) const TOP: f64 = 72.0;
/// Margin around the routes (m).
const MARGIN: f64 = 8.0;
/// Lengths of the routes before and after the ring (m).
#[derive(Debug, Clone, Copy)]
pub struct Straights {
    /// Length before the ring (m).
    pub approach: f64,
    /// Length after the ring (m).
    pub departure: f64,
}

/// The transformation from the roundabout (metres, x east, y north) to the page (pixels, x right, y down).
pub(crate) struct View {
    /// South-west and north-east corner of the map (m).
    pub low: DVec2,
    pub high: DVec2,
    /// Pixels in a metre (px/m).
    pub scale: f64,
    /// Upper left corner of the map on the page (px).
    corner: DVec2,
    /// Whether points are those of the mirror image in the x axis, which low and high are not.
    mirrored: bool,
}

/// Position and size of a map on its page.
pub(crate) struct Layout {
    /// Upper left corner of the map (px).
    pub corner: DVec2,
    /// Width of the map (px).
    pub width: f64,
    /// Margin around the points that must be shown (m).
    pub margin: f64,
    /// Least ratio of the map's width to its height.
    pub ratio: f64,
}

/// The layout of a still. The ratio limits the height of the page.
pub(crate) const PRINTED: Layout =
    Layout { corner: DVec2::new(LEFT, TOP), width: WIDTH - LEFT - RIGHT, margin: MARGIN, ratio: 0.85 };

impl View {
    /// All of the given points with a margin.
    pub fn around(points: impl Iterator<Item = DVec2>) -> View {
        View::laid_out(points, &PRINTED)
    }

    /// All of the given points in a map of another layout.
    pub fn laid_out(points: impl Iterator<Item = DVec2>, layout: &Layout) -> View {
        let (low, high) =
            points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let (low, high) = (low - layout.margin, high + layout.margin);
        // The map is at least half as high as wide.
        let centre = (low + high) / 2.0;
        let extent = high - low;
        let extent = extent.max(DVec2::new(extent.y * layout.ratio, extent.x * 0.5));
        View {
            low: centre - extent / 2.0,
            high: centre + extent / 2.0,
            scale: layout.width / extent.x,
            corner: layout.corner,
            mirrored: false,
        }
    }

    /// All of the given points with `margin` around them (m), in the middle of a map that fills a picture of `size`
    /// (px).
    pub fn fitted(points: impl Iterator<Item = DVec2>, size: DVec2, margin: f64) -> View {
        let (low, high) =
            points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let scale = (size / (high - low + 2.0 * margin)).min_element();
        let (centre, half) = ((low + high) / 2.0, size / scale / 2.0);
        View { low: centre - half, high: centre + half, scale, corner: DVec2::ZERO, mirrored: false }
    }

    /// Where `p` lies on the page (px).
    pub fn point(&self, p: DVec2) -> DVec2 {
        let y = if self.mirrored { -p.y } else { p.y };
        self.corner + DVec2::new(p.x - self.low.x, self.high.y - y) * self.scale
    }

    /// This view for points of the mirror image in the x axis.
    pub fn for_mirrored(&self) -> View {
        View { mirrored: true, ..*self }
    }

    /// Whether the map shows `p`, at least `margin` metres from its edge.
    pub fn shows(&self, p: DVec2, margin: f64) -> bool {
        (self.low + margin).cmple(p).all() && p.cmple(self.high - margin).all()
    }

    /// Path data of a curve; arcs stay arcs.
    pub fn curve(&self, curve: &Curve) -> String {
        let mut data = String::new();
        for (index, piece) in curve.pieces.iter().enumerate() {
            if index == 0 {
                self.step(&mut data, 'M', piece.start());
            }
            match *piece {
                Piece::Segment { to, .. } => self.step(&mut data, 'L', to),
                Piece::Arc { radius, sweep, .. } => {
                    // Path data cannot express a whole circle as one arc, so arcs are halved.
                    let (r, turn) = (number(radius * self.scale), u8::from(sweep < 0.0));
                    for end in [piece.point_at(piece.length() / 2.0), piece.end()] {
                        self.step(&mut data, format!("A{r} {r} 0 0 {turn} "), end);
                    }
                }
            }
        }
        data
    }

    /// Path data of closed curves.
    pub fn loops(&self, loops: &[Curve]) -> String {
        loops.iter().map(|curve| self.curve(curve) + "Z").collect()
    }

    /// Path data of an open line.
    pub fn line(&self, points: &[DVec2]) -> String {
        let mut data = String::new();
        for (index, &p) in points.iter().enumerate() {
            self.step(&mut data, if index == 0 { 'M' } else { 'L' }, p);
        }
        data
    }

    /// Path data of a closed line.
    pub fn polygon(&self, points: &[DVec2]) -> String {
        self.line(points) + "Z"
    }

    /// Path data of the map's edge.
    pub fn frame(&self) -> String {
        self.polygon(&[self.low, DVec2::new(self.high.x, self.low.y), self.high, DVec2::new(self.low.x, self.high.y)])
    }

    fn step(&self, data: &mut String, command: impl std::fmt::Display, to: DVec2) {
        let p = self.point(to);
        // Writing to a string cannot fail.
        let _ = write!(data, "{command}{} {}", number(p.x), number(p.y));
    }
}

/// A number for path data, rounded to a hundredth of a pixel.
pub(crate) fn number(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}
