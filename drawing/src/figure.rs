//! A figure: a map with axes below a title and above a legend.

use std::fmt::Write;

use glam::DVec2;
use offtrack::map::route::Route;
use offtrack::map::{Gutter, Road};
use svg::Document;
use svg::node::element::{ClipPath, Definitions, Group, Path, Rectangle};

use crate::Error;
use crate::legend::{self, Entry};
use crate::lettering::{Align, Lettering};
use crate::road::RoadLayers;
use crate::sweep::Sweep;
pub use crate::view::Straights;
use crate::view::{LEFT, Layout, PRINTED, RIGHT, TOP, View, WIDTH, colour, number};

/// Base line of the first line below the title, and from one to the next (px).
const BELOW_TITLE: f64 = 58.0;
const LINE: f64 = 21.0;
/// Height of the numbers below the map (px).
const AXIS: f64 = 30.0;
/// With a swept path: length of the route shown before and after the ring (m).
const SHOWN: f64 = 25.0;

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
    let kind = if roundabout.has_ring() { "Roundabout" } else { "Junction" };
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
    let definitions = road.solids().into_iter().fold(sweep.shapes(&view), Definitions::add);
    let overlaps = road.clipped(sweep.overlaps());
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
    bar(view, lettering, 10.0, "10 m")
}

/// A bar of this length in the lower right corner, with words for it (m).
pub(crate) fn bar(view: &View, lettering: &Lettering, length: f64, words: &str) -> Group {
    let right = view.point(DVec2::new(view.high.x, view.low.y)) - DVec2::new(16.0, 14.0);
    let length = length * view.scale;
    let box_corner = right - DVec2::new(length + 14.0, 32.0);
    let paper = Rectangle::new().set("x", number(box_corner.x)).set("y", number(box_corner.y)).set("rx", 4);
    let paper =
        paper.set("width", number(length + 24.0)).set("height", 42).set("fill", "white").set("fill-opacity", 0.85);
    let data = format!("M{} {}v6h{}v-6", number(right.x - length), number(right.y - 6.0), number(length));
    let bar = Path::new().set("d", data).set("fill", "none").set("stroke", colour::INK).set("stroke-width", 2.0);
    let words = lettering.text(words, right - DVec2::new(length / 2.0, 10.0), 15.0, Align::Middle, colour::INK);
    Group::new().add(paper).add(bar).add(words)
}

/// A coordinate with a typographic minus sign.
fn metres(value: f64) -> String {
    if value < 0.0 { format!("\u{2212}{}", -value) } else { value.abs().to_string() }
}
