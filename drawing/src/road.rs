//! The layers of a map: solids, gutters, distances, lanes, routes and the names of the arms.

use std::f64::consts::FRAC_PI_4;

use glam::DVec2;
use offtrack::field::Field;
use offtrack::geometry::{Curve, Outline};
use offtrack::map::route::{Lane, Route};
use offtrack::map::{Gutter, Road};
use offtrack::scenario::FIELD_CELL;
use svg::node::element::{ClipPath, Group, Path};

use crate::isolines::isolines;
use crate::legend::{Entry, Swatch, chevron};
use crate::lettering::{Align, Lettering};
use crate::view::{Straights, View, colour};

/// Least distance between arrows of one colour (m).
const APART: f64 = 5.0;
/// Distance from the ring to the name of an arm (m).
const TO_NAME: f64 = 23.0;

const LANE_DASHES: &str = "6 5";

/// A roundabout in a view; each method draws one layer.
pub(crate) struct RoadLayers<'a> {
    view: &'a View,
    lettering: &'a Lettering,
    roundabout: &'a Road,
    routes: &'a [Route],
    straights: Straights,
    gutter: Gutter,
    kerbs: Outline,
}

impl<'a> RoadLayers<'a> {
    pub(crate) fn new(
        view: &'a View,
        lettering: &'a Lettering,
        roundabout: &'a Road,
        routes: &'a [Route],
        straights: Straights,
        gutter: Gutter,
    ) -> RoadLayers<'a> {
        RoadLayers { view, lettering, roundabout, routes, straights, gutter, kerbs: roundabout.kerbs(gutter) }
    }

    /// Path data of the edges of the drivable area.
    fn kerb_data(&self) -> String {
        self.view.loops(&self.kerbs.loops)
    }

    /// Clips to what is solid to the tractor and, where that is something else, to the trailer.
    pub(crate) fn solids(&self) -> Vec<ClipPath> {
        let clip = |id: &str, kerbs: &Outline| {
            let data = self.view.frame() + &self.view.loops(&kerbs.loops);
            ClipPath::new().set("id", id).add(Path::new().set("d", data).set("clip-rule", "evenodd"))
        };
        let kerbs = self.roundabout.unit_kerbs(self.gutter);
        let of_trailer = kerbs.behind_aprons().map(|kerbs| clip("trailer_solids", kerbs));
        [clip("solids", &kerbs.tractor)].into_iter().chain(of_trailer).collect()
    }

    /// What is swept by the tractor and by the trailer, each clipped to what is solid to it by [`RoadLayers::solids`].
    pub(crate) fn clipped(&self, [tractor, trailer]: [Group; 2]) -> Group {
        let of_trailer = if self.roundabout.has_apron() { "url(#trailer_solids)" } else { "url(#solids)" };
        Group::new().add(trailer.set("clip-path", of_trailer)).add(tractor.set("clip-path", "url(#solids)"))
    }

    /// Path data of all edges.
    fn edge_data(&self) -> String {
        self.kerb_data() + &self.view.loops(&self.roundabout.ground().aprons)
    }

    /// Solid ground, gutters, road and aprons.
    pub(crate) fn surface(&self) -> Group {
        let fill = |outline: &Outline, colour: &str| {
            Path::new().set("d", self.view.loops(&outline.loops)).set("fill", colour).set("fill-rule", "evenodd")
        };
        let solid = self.view.polygon(&[
            self.view.low,
            DVec2::new(self.view.high.x, self.view.low.y),
            self.view.high,
            DVec2::new(self.view.low.x, self.view.high.y),
        ]);
        let surface = Group::new()
            .add(Path::new().set("d", solid).set("fill", colour::SOLID))
            .add(fill(&self.roundabout.kerbs(Gutter::Drivable), colour::GUTTER))
            .add(fill(&self.roundabout.kerbs(Gutter::Solid), colour::ROAD));
        let aprons = self.roundabout.aprons();
        aprons.iter().fold(surface, |surface, apron| surface.add(fill(apron, colour::APRON)))
    }

    /// Lines of equal distance to the kerbs.
    pub(crate) fn distances(&self) -> Group {
        let field = Field::bake(&self.kerbs, FIELD_CELL);
        let lines: String = isolines(&field, self.view).iter().map(|ring| self.view.line(ring)).collect();
        let lines =
            Path::new().set("d", lines).set("fill", "none").set("stroke", colour::CONTOUR).set("stroke-width", 0.8);
        Group::new().add(lines)
    }

    /// The centre lines of the lanes.
    pub(crate) fn lanes(&self) -> Group {
        let lanes: String = self.roundabout.lanes().iter().map(|lane| self.view.curve(lane)).collect();
        let lanes =
            Path::new().set("d", lanes).set("fill", "none").set("stroke", colour::LANE).set("stroke-width", 0.9);
        Group::new().add(lanes.set("stroke-dasharray", LANE_DASHES))
    }

    /// The edges of the drivable area.
    pub(crate) fn kerbs(&self) -> Group {
        Group::new().add(
            Path::new()
                .set("d", self.edge_data())
                .set("fill", "none")
                .set("stroke", colour::KERB)
                .set("stroke-width", 1.6),
        )
    }

    /// The centre lines of the lanes for a small map.
    pub(crate) fn thin_lanes(&self) -> Group {
        self.lanes().set("stroke-width", 0.5).set("opacity", 0.55)
    }

    /// The edges of the drivable area for a small map.
    pub(crate) fn thin_kerbs(&self) -> Group {
        let kerbs = Path::new().set("d", self.edge_data()).set("fill", "none").set("stroke", colour::KERB);
        Group::new().add(kerbs.set("stroke-width", 0.8))
    }

    /// All routes, with arrows on their approach, around the ring and on their departure.
    pub(crate) fn routes(&self) -> Group {
        let mut lines = Group::new();
        let mut arrows: Vec<(DVec2, f64, Lane)> = Vec::new();
        for route in self.routes {
            let line = Path::new().set("d", self.view.curve(&route.centre_line)).set("fill", "none");
            lines = lines.add(line.set("stroke", lane_colour(route.lane)).set("stroke-width", 1.6));
            for s in self.arrow_stations(&route.centre_line) {
                let at = route.centre_line.point_at(s);
                let heading = route.centre_line.heading_at(s);
                // Routes share lanes: one arrow serves all of them.
                let shares = |&(other, towards, lane): &(DVec2, f64, Lane)| {
                    lane == route.lane && other.distance(at) < APART && 0.0 < (towards - heading).cos()
                };
                if !arrows.iter().any(shares) {
                    arrows.push((at, heading, route.lane));
                }
            }
        }
        arrows.into_iter().fold(lines, |group, (at, heading, lane)| {
            group.add(chevron(self.view.point(at), DVec2::from_angle(-heading), lane_colour(lane)))
        })
    }

    /// Stations of the arrows of a route: two on its approach, one at every eighth of the ring, two on its departure
    /// (m).
    fn arrow_stations(&self, line: &Curve) -> Vec<f64> {
        let eighth = |s: f64| (line.point_at(s).to_angle() / FRAC_PI_4).floor();
        let (enters, leaves) = (self.straights.approach, line.length() - self.straights.departure);
        let around = (0..).map(|step| enters + 0.2 * f64::from(step)).take_while(|&s| s < leaves);
        let mut stations: Vec<f64> = around.filter(|&s| eighth(s) != eighth(s + 0.2)).collect();
        stations
            .extend([0.3, 0.75].into_iter().flat_map(|part| [part * enters, leaves + part * self.straights.departure]));
        stations
    }

    /// The arms' names, between their carriageways.
    pub(crate) fn arm_names(&self) -> Group {
        let mut group = Group::new();
        let Straights { approach, departure } = self.straights;
        let away = TO_NAME.min(approach).min(departure);
        for (arm, name) in self.roundabout.arms().enumerate() {
            // Beside the lanes farthest from the kerbs: those of the U-turn, or of the ways nearest to one.
            let farthest = |on_arm: &dyn Fn(&Route) -> bool| {
                let routes = self.routes.iter().filter(|route| on_arm(route));
                routes.min_by_key(|route| std::cmp::Reverse(route.exit)).map(|route| &route.centre_line)
            };
            let enters = farthest(&|route| route.entry == arm).map(|line| line.point_at(approach - away));
            let leaves = farthest(&|route| self.roundabout.exit_arm(route) == arm);
            let leaves = leaves.map(|line| line.point_at(line.length() - departure + away));
            let (Some(from), Some(to)) = (enters.or(leaves), leaves.or(enters)) else { continue };
            let at = (from + to) / 2.0;
            if self.view.shows(at, 2.0) {
                let at = self.view.point(at) + DVec2::new(0.0, 7.0);
                group = group.add(self.lettering.text_on_map(name, at, 20.0, Align::Middle, colour::INK));
            }
        }
        group
    }

    /// The legend's lines for a map with distances.
    pub(crate) fn legend(&self) -> Vec<Entry> {
        let mut legend = self.surface_legend();
        let distance = Entry::new(Swatch::Line(colour::CONTOUR, 1.2, ""), "distance to it, each metre");
        legend.insert(legend.len() - 1, distance);
        legend
    }

    /// The legend's lines for surface, kerbs and lanes.
    pub(crate) fn surface_legend(&self) -> Vec<Entry> {
        let gutter = match self.gutter {
            Gutter::Drivable => "gutter, drivable",
            Gutter::Solid => "gutter, solid",
        };
        let apron = Entry::new(Swatch::Area(colour::APRON), "apron, for trailers alone");
        let mut legend =
            vec![Entry::new(Swatch::Area(colour::SOLID), "solid"), Entry::new(Swatch::Area(colour::GUTTER), gutter)];
        legend.extend(self.roundabout.has_apron().then_some(apron));
        legend.push(Entry::new(Swatch::Line(colour::KERB, 1.6, ""), "edge of what is drivable"));
        legend.push(Entry::new(Swatch::Line(colour::LANE, 0.9, LANE_DASHES), "lane centre"));
        legend
    }

    /// The legend's lines for the routes.
    pub(crate) fn route_legend(&self) -> impl Iterator<Item = Entry> {
        let words = |lane| match lane {
            Lane::Left => "route from a left lane",
            Lane::Right => "route from a right lane",
        };
        let shown = Lane::BOTH.into_iter().filter(|lane| self.routes.iter().any(|route| route.lane == *lane));
        shown.map(move |lane| Entry::new(Swatch::Arrow(lane_colour(lane)), words(lane)))
    }
}

pub(crate) fn lane_colour(lane: Lane) -> &'static str {
    match lane {
        Lane::Left => colour::LEFT,
        Lane::Right => colour::RIGHT,
    }
}
