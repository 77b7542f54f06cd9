//! A figure: a map with axes below a title and above a legend.

use std::fmt::Write;

use glam::DVec2;
use offtrack::geometry::{Curve, Piece};
use offtrack::map::route::Route;
use offtrack::map::{Gutter, Road};
use svg::Document;
use svg::node::element::{ClipPath, Definitions, Group, Path, Rectangle};

use crate::Error;
use crate::legend::{self, Entry};
use crate::lettering::{Align, Lettering};
use crate::road::RoadLayers;
use crate::sweep::Sweep;

/// Colours that differ for colour-blind readers and in grey: the hues of P. Tol's "vibrant" scheme. Channels of areas
/// are multiples of 15, which the quantisation of a PNG leaves as they are.
pub(crate) mod colour {
    pub const INK: &str = "#1a1a1a";
    pub const FAINT: &str = "#6e6e6e";
    pub const SOLID: &str = "#d2d2d2";
    pub const GUTTER: &str = "#f0e1c3";
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
}

/// Width of the page (px).
pub(crate) const WIDTH: f64 = 1000.0;
/// Margins from the page's left, right and upper edge to the map (px).
const LEFT: f64 = 48.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 72.0;
/// Base line of the first line below the title, and from one to the next (px).
const BELOW_TITLE: f64 = 58.0;
const LINE: f64 = 21.0;
/// Height of the numbers below the map (px).
const AXIS: f64 = 30.0;
/// Margin around the routes (m).
const MARGIN: f64 = 8.0;
/// With a swept path: length of the route shown before and after the ring (m).
const SHOWN: f64 = 25.0;

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
const PRINTED: Layout =
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

/// The roundabout with all its routes, as SVG text. `straights` are the lengths that `routes` were made with.
///
/// # Errors
///
/// [`Error::Typeface`].
pub fn roundabout(roundabout: &Road, routes: &[Route], straights: Straights, gutter: Gutter) -> Result<String, Error> {
    let lettering = Lettering::new()?;
    let view = View::around(routes.iter().flat_map(|route| &route.waypoints).map(|waypoint| waypoint.position));
    let road = RoadLayers::new(&view, &lettering, roundabout, routes, straights, gutter);
    let map = Group::new()
        .add(road.surface())
        .add(road.distances())
        .add(road.lanes())
        .add(road.kerbs())
        .add(road.routes())
        .add(road.arm_names());
    let legend: Vec<Entry> = road.legend().into_iter().chain(road.route_legend()).collect();
    let kind = if roundabout.island_radius() == 0.0 { "Junction" } else { "Roundabout" };
    let title = format!("{kind} {}: {} arms, {} routes", roundabout.name, roundabout.arms().count(), routes.len());
    let lanes: Vec<String> = roundabout.lane_radii().iter().map(|radius| format!("{radius:.2} m")).collect();
    let radius = roundabout.outer_radius();
    let subtitle = match &lanes[..] {
        [] => format!("Its arms begin {radius:.2} m from the middle of the junction."),
        [only] => format!("Lane centre at {only}, outer kerb at {radius:.2} m from the centre."),
        [inner @ .., last] => {
            format!("Lane centres at {} and {last}, outer kerb at {radius:.2} m from the centre.", inner.join(", "))
        }
    };
    Ok(composed(&view, &lettering, &title, &[&subtitle], Definitions::new(), map, &legend))
}

/// What a truck sweeps on one of the routes, as SVG text.
///
/// # Errors
///
/// [`Error::Typeface`].
pub fn swept_path(
    roundabout: &Road,
    routes: &[Route],
    straights: Straights,
    gutter: Gutter,
    sweep: &Sweep,
) -> Result<String, Error> {
    let lettering = Lettering::new()?;
    let line = sweep
        .route
        .centre_line
        .part(straights.approach - SHOWN, sweep.route.centre_line.length() - straights.departure + SHOWN);
    let layout = Layout { corner: DVec2::new(LEFT, TOP + LINE), ..PRINTED };
    let view = View::laid_out(line.polyline(0.1).into_iter(), &layout);
    let road = RoadLayers::new(&view, &lettering, roundabout, routes, straights, gutter);
    let solids = Path::new().set("d", view.frame() + &road.kerb_data()).set("clip-rule", "evenodd");
    let definitions = sweep.shapes(&view).add(ClipPath::new().set("id", "solids").add(solids));
    let overlaps = Group::new().set("clip-path", "url(#solids)").add(sweep.overlaps());
    let map = Group::new().add(road.surface()).add(sweep.areas()).add(road.distances()).add(road.lanes()).add(overlaps);
    let map = map.add(road.kerbs()).add(sweep.marks(&view, &lettering)).add(road.arm_names());
    let legend: Vec<Entry> = sweep.legend().into_iter().chain(road.legend()).collect();
    let [path, needs] = sweep.lines();
    Ok(composed(&view, &lettering, &sweep.verdict(), &[&path, &needs], definitions, map, &legend))
}

/// A whole page as SVG text, with lines of words below its title.
pub(crate) fn composed(
    view: &View,
    lettering: &Lettering,
    title: &str,
    lines: &[&str],
    definitions: Definitions,
    map: Group,
    legend: &[Entry],
) -> String {
    let bottom = view.point(view.low).y;
    let (legend, legend_height) =
        legend::drawn(lettering, legend, DVec2::new(LEFT, bottom + AXIS + 14.0), WIDTH - LEFT - RIGHT);
    let height = (bottom + AXIS + legend_height + 16.0).ceil();
    let paper = Rectangle::new().set("width", WIDTH).set("height", height).set("fill", "white");
    let edge =
        Path::new().set("d", view.frame()).set("fill", "none").set("stroke", colour::INK).set("stroke-width", 1.2);
    let clip = ClipPath::new().set("id", "map").add(Path::new().set("d", view.frame()));
    let fitted = |words: &str, base: f64, largest: f64, colour: &str| {
        let size = lettering.fitting(words, largest, WIDTH - LEFT - RIGHT);
        lettering.text(words, DVec2::new(LEFT, base), size, Align::Left, colour)
    };
    let line = |(index, words): (usize, &&str)| fitted(words, BELOW_TITLE + index as f64 * LINE, 16.0, colour::FAINT);
    let lines = lines.iter().enumerate().map(line).fold(Group::new(), |group, line| group.add(line));
    let document = Document::new()
        .set("viewBox", (0.0, 0.0, WIDTH, height))
        .set("width", WIDTH)
        .set("height", height)
        .add(svg::node::element::Title::new(title))
        .add(definitions.add(clip))
        .add(paper)
        .add(fitted(title, 32.0, 25.0, colour::INK))
        .add(lines)
        .add(map.set("clip-path", "url(#map)"))
        .add(edge)
        .add(axes(view, lettering))
        .add(scale_bar(view, lettering))
        .add(legend);
    format!("{document}\n")
}

/// Ticks and coordinates along the lower and the left edge.
fn axes(view: &View, lettering: &Lettering) -> Group {
    let extent = view.high - view.low;
    let every = if extent.x < 90.0 { 10.0 } else { 20.0 };
    let ticks = |low: f64, high: f64| {
        ((low / every).ceil() as i64..=(high / every).floor() as i64).map(move |tick| tick as f64 * every)
    };
    let mut data = String::new();
    let mut group = Group::new();
    for x in ticks(view.low.x, view.high.x) {
        let at = view.point(DVec2::new(x, view.low.y));
        let _ = write!(data, "M{} {}v6", number(at.x), number(at.y));
        group = group.add(lettering.text(&metres(x), at + DVec2::new(0.0, 21.0), 14.0, Align::Middle, colour::FAINT));
    }
    for y in ticks(view.low.y, view.high.y) {
        let at = view.point(DVec2::new(view.low.x, y));
        let _ = write!(data, "M{} {}h-6", number(at.x), number(at.y));
        group = group.add(lettering.text(&metres(y), at + DVec2::new(-9.0, 5.0), 14.0, Align::Right, colour::FAINT));
    }
    group.add(Path::new().set("d", data).set("stroke", colour::INK).set("stroke-width", 1.2))
}

/// A bar of ten metres in the map's lower right corner.
pub(crate) fn scale_bar(view: &View, lettering: &Lettering) -> Group {
    let right = view.point(DVec2::new(view.high.x, view.low.y)) - DVec2::new(16.0, 14.0);
    let length = 10.0 * view.scale;
    let box_corner = right - DVec2::new(length + 14.0, 32.0);
    let paper = Rectangle::new().set("x", number(box_corner.x)).set("y", number(box_corner.y)).set("rx", 4);
    let paper =
        paper.set("width", number(length + 24.0)).set("height", 42).set("fill", "white").set("fill-opacity", 0.85);
    let data = format!("M{} {}v6h{}v-6", number(right.x - length), number(right.y - 6.0), number(length));
    let bar = Path::new().set("d", data).set("fill", "none").set("stroke", colour::INK).set("stroke-width", 2.0);
    let words = lettering.text("10 m", right - DVec2::new(length / 2.0, 10.0), 15.0, Align::Middle, colour::INK);
    Group::new().add(paper).add(bar).add(words)
}

/// A coordinate with a typographic minus sign.
fn metres(value: f64) -> String {
    if value < 0.0 { format!("\u{2212}{}", -value) } else { value.abs().to_string() }
}
