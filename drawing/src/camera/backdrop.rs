//! What does not change in the pictures of a route: the road, the route on it and its name.

use glam::DVec2;
use offtrack::geometry::Curve;
use offtrack::map::route::Route;
use offtrack::map::{Gutter, Road};
use offtrack::scenario::Scenario;

use super::canvas::{Canvas, Ink};
use crate::legend::chevron_corners;
use crate::lettering::{Align, Lettering};
use crate::view::{View, colour};

/// Margin around the ring and around the path of the truck's middle (m).
const MARGIN: f64 = 6.0;
/// Distance between arrows on the route, at the scale of the pens (px).
const BETWEEN_ARROWS: f64 = 75.0;
/// Dashes of a lane's centre line, and the gaps between them (px).
const LANE_DASHES: [f64; 2] = [6.0, 5.0];
/// Extent of the ground that is shown of a route that is not known (m).
const NOWHERE: f64 = 50.0;
/// Longest words of a caption beside the name.
const LONGEST: [&str; 2] = ["100.0 km/h", "trailer collided"];

/// Sizes that depend on the picture's alone.
#[derive(Clone, Copy)]
pub struct Format {
    /// Side of the picture (px).
    pub side: u32,
    /// Height of the caption above the map (px).
    pub caption: u32,
    /// Width of a line of width 1 (px).
    pub pen: f64,
}

impl Format {
    pub fn new(side: u32) -> Format {
        let text = (f64::from(side) / 34.0).max(11.0);
        // Lines keep their widths in pictures of common sizes; they are thinner in small ones and wider in large ones.
        Format {
            side,
            caption: (1.6 * text).ceil() as u32,
            pen: (f64::from(side) / 480.0).min(1.0).max(f64::from(side) / 960.0),
        }
    }

    /// Size of the text if the caption is not too long for it (px).
    fn text(self) -> f64 {
        f64::from(self.caption) / 1.6
    }
}

/// The background of a route's pictures.
pub struct Backdrop {
    /// Index of the route in the world.
    pub route: u32,
    /// Where points of the world that is driven lie, in pixels below the caption.
    pub view: View,
    /// RGBA, `[side, side, 4]`, opaque.
    pub pixels: Vec<u8>,
    /// Size of the caption's text (px).
    pub text: f64,
    /// Where the speed begins: left end of its base line (px).
    pub speed_at: DVec2,
    /// Where the end in words ends: right end of its base line (px).
    pub ended_at: DVec2,
}

impl Backdrop {
    /// The backdrop of a route of the scenario; bare ground if it has no such route.
    pub fn new(scenario: &Scenario, route: u32, format: Format, lettering: &Lettering) -> Backdrop {
        let found = scenario.routes().nth(route as usize).map(|(place, line)| {
            let driven = &scenario.places[place].roundabout;
            (driven.seen(), driven.seen_route(line), driven.is_mirrored())
        });
        let side = f64::from(format.side);
        let size = DVec2::new(side, f64::from(format.side - format.caption));
        let view = match &found {
            Some((roundabout, line, _)) => View::fitted(shown(scenario, roundabout, line), size, MARGIN),
            None => View::fitted([-NOWHERE, NOWHERE].map(DVec2::splat).into_iter(), size, 0.0),
        };
        let name = found.as_ref().map_or("", |(_, line, _)| line.name.as_str());
        let gap = format.text();
        let width =
            [name, LONGEST[0], LONGEST[1]].map(|words| lettering.width(words, format.text()) + gap).iter().sum::<f64>();
        let text = format.text() * (side / width).min(1.0);
        let base = f64::from(format.caption) / 2.0 + 0.35 * text;
        let name_at = DVec2::new(0.5 * text, base);
        let speed_at = name_at + DVec2::new(lettering.width(name, text) + text, 0.0);

        let mut pixels = vec![255; 4 * (format.side * format.side) as usize];
        let (above, below) = pixels.split_at_mut(4 * (format.caption * format.side) as usize);
        if let Some(mut caption) = Canvas::on(above, format.side) {
            caption.words(lettering, name, name_at, text, Align::Left, Ink(colour::INK, 1.0));
        }
        if let Some(mut map) = Canvas::on(below, format.side) {
            map.cover(Ink(colour::SOLID, 1.0));
            if let Some((roundabout, line, _)) = &found {
                draw_road(&mut map, &view, format.pen, roundabout);
                draw_route(&mut map, &view, format.pen, roundabout, line);
                draw_kerbs(&mut map, &view, format.pen, roundabout, scenario.gutter);
            }
        }
        let view = if found.as_ref().is_some_and(|&(_, _, mirrored)| mirrored) { view.for_mirrored() } else { view };
        Backdrop { route, view, pixels, text, speed_at, ended_at: DVec2::new(side - 0.5 * text, base) }
    }
}

/// The ring, and the path of a truck that begins and ends the route with both units on it.
fn shown(scenario: &Scenario, roundabout: &Road, route: &Route) -> impl Iterator<Item = DVec2> {
    let radius = roundabout.outer_radius();
    let whole = roundabout.arms().nth(route.entry).and_then(|entry| roundabout.line(entry, route.lane, route.exit));
    let path = whole.map_or_else(
        || route.centre_line.clone(),
        |whole| {
            let (behind, ahead) = scenario.vehicle.reach(scenario.start_heading);
            whole.part(route.before - behind, whole.length() - route.after + ahead)
        },
    );
    path.polyline(1.0).into_iter().chain([DVec2::splat(-radius), DVec2::splat(radius)])
}

fn draw_road(map: &mut Canvas, view: &View, pen: f64, roundabout: &Road) {
    for (area, ink) in [(Gutter::Drivable, colour::GUTTER), (Gutter::Solid, colour::ROAD)] {
        map.areas(&lines(view, &roundabout.kerbs(area).loops), Ink(ink, 1.0));
    }
    for apron in roundabout.aprons() {
        map.areas(&lines(view, &apron.loops), Ink(colour::APRON, 1.0));
    }
    map.dashes(
        &lines(view, &roundabout.lanes()),
        Ink(colour::LANE, 1.0),
        0.9 * pen,
        LANE_DASHES.map(|length| length * pen),
    );
}

fn draw_route(map: &mut Canvas, view: &View, pen: f64, roundabout: &Road, route: &Route) {
    let line = lines(view, std::slice::from_ref(&route.centre_line));
    let width = roundabout.lane_widths(route).into_iter().fold(f64::INFINITY, f64::min);
    map.lines(&line, false, Ink(colour::ROUTE, 0.16), width * view.scale);
    map.lines(&line, false, Ink(colour::ROUTE, 1.0), 1.6 * pen);
    let length = route.centre_line.length();
    let n = (length * view.scale / (BETWEEN_ARROWS * pen)).round().max(1.0);
    for arrow in 0..n as usize {
        let s = length * (arrow as f64 + 0.5) / n;
        let along = DVec2::from_angle(-route.centre_line.heading_at(s)) * 9.0 * pen;
        let tip = view.point(route.centre_line.point_at(s)) + 0.5 * along;
        map.polygon(&chevron_corners(tip, along), Ink(colour::ROUTE, 1.0), Ink(colour::ROAD, 1.0), 0.6 * pen);
    }
}

fn draw_kerbs(map: &mut Canvas, view: &View, pen: f64, roundabout: &Road, gutter: Gutter) {
    for kerbs in [&roundabout.kerbs(gutter).loops, &roundabout.ground().aprons] {
        map.lines(&lines(view, kerbs), true, Ink(colour::KERB, 1.0), 1.6 * pen);
    }
}

/// Curves as points, within a tenth of a pixel (px).
fn lines(view: &View, curves: &[Curve]) -> Vec<Vec<DVec2>> {
    let points = |curve: &Curve| curve.polyline(0.1 / view.scale).into_iter().map(|p| view.point(p)).collect();
    curves.iter().map(points).collect()
}
