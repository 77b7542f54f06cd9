//! Where the paths of cars meet: the stretches on which those from different arms follow or cross, the ring traffic
//! that is yielded to beside an entry, and the lines before which cars wait.

use std::collections::BTreeMap;

use glam::DVec2;
use offtrack::map::route::{Lane, Route};
use offtrack::map::{Gutter, Road};
use offtrack::traffic::units::metres;
use offtrack::traffic::{Kind, Network};
use svg::node::element::{Definitions, Group, Path};

use crate::Error;
use crate::figure::{Straights, composed};
use crate::legend::{Entry, Swatch};
use crate::lettering::Lettering;
use crate::road::{RoadLayers, lane_colour};
use crate::view::{View, colour};

/// Width of a stretch (m).
const WIDTH: f64 = 1.8;
/// Half the length of a line before which cars wait (m).
const HALF_LINE: f32 = 1.4;
/// Distance between points of a stretch (m).
const SPACING: f32 = 0.5;

/// The paths of a road and their zones, as SVG text. `road` is the road as it is driven, `network` its tables, `routes`
/// those of [`Road::seen`], made with `straights`.
///
/// # Errors
///
/// [`Error::Typeface`].
pub fn drawn(
    road: &Road,
    network: &Network,
    routes: &[Route],
    straights: Straights,
    gutter: Gutter,
) -> Result<String, Error> {
    let lettering = Lettering::new()?;
    let view = View::around(routes.iter().flat_map(|route| &route.waypoints).map(|waypoint| waypoint.position));
    let seen = road.seen();
    let layers = RoadLayers::new(&view, &lettering, &seen, routes, straights, gutter);
    let mirrored = view.for_mirrored();
    let driven = if road.is_mirrored() { &mirrored } else { &view };
    let zones = Zones { network, view: driven, is_mirrored: road.is_mirrored() };
    let map = Group::new()
        .add(layers.surface())
        .add(zones.stretches(Kind::Follow, colour::FOLLOWED))
        .add(zones.stretches(Kind::Cross, colour::CROSSED))
        .add(zones.stretches(Kind::Soft, colour::BESIDE))
        .add(zones.paths())
        .add(layers.kerbs())
        .add(zones.lines())
        .add(layers.arm_names());
    let n = network.paths.len();
    let line = format!("{n} paths from {} entry lanes; where those from different arms meet.", network.sources.len());
    let title = format!("Traffic on {}", road.name);
    let mut legend = vec![
        Entry::new(Swatch::Area(colour::FOLLOWED), "paths run together: cars follow"),
        Entry::new(Swatch::Area(colour::CROSSED), "paths cross: one car at a time"),
        Entry::new(Swatch::Area(colour::BESIDE), "yielded to beside an entry"),
        Entry::new(Swatch::Line(colour::INK, 4.0, ""), "line before which cars wait"),
    ];
    legend.extend(zones.path_legend());
    Ok(composed(&view, &lettering, &title, &[&line], Definitions::new(), map, &legend))
}

struct Zones<'a> {
    network: &'a Network,
    /// For points of the road as it is driven.
    view: &'a View,
    is_mirrored: bool,
}

impl Zones<'_> {
    fn lane(&self, path: usize) -> Lane {
        let lane = if self.network.source_of(path).lane == 0 { Lane::Right } else { Lane::Left };
        lane.seen(self.is_mirrored)
    }

    /// Path data of a part of a path.
    fn part(&self, path: usize, from: f32, to: f32) -> String {
        let steps = ((to - from) / SPACING).ceil().max(1.0) as usize;
        let station = |step: usize| from + (to - from) * step as f32 / steps as f32;
        let points: Vec<DVec2> =
            (0..=steps).map(|step| self.network.position(path, station(step)).as_dvec2()).collect();
        self.view.line(&points)
    }

    /// The stretches of one kind, each part of a path once.
    fn stretches(&self, kind: Kind, colour: &str) -> Group {
        let n = self.network.paths.len();
        let mut found: BTreeMap<usize, Vec<[f32; 2]>> = BTreeMap::new();
        for (a, b) in (0..n).flat_map(|a| (0..n).map(move |b| (a, b))) {
            if self.network.source_of(a).entry == self.network.source_of(b).entry {
                continue;
            }
            for zone in self.network.zones_of(a, b).iter().map(|zone| zone.stretch()).filter(|zone| zone.kind == kind) {
                // Who enters yields to what is on the other path.
                let (path, part) =
                    if kind == Kind::Soft { (b, [zone.b_in, zone.b_out]) } else { (a, [zone.a_in, zone.a_out]) };
                found.entry(path).or_default().push(part.map(metres));
            }
        }
        let data: String = found
            .into_iter()
            .flat_map(|(path, parts)| united(parts).into_iter().map(move |[from, to]| (path, from, to)))
            .map(|(path, from, to)| self.part(path, from, to))
            .collect();
        let stretches = Path::new().set("d", data).set("fill", "none").set("stroke", colour);
        Group::new().add(stretches.set("stroke-width", WIDTH * self.view.scale).set("stroke-linejoin", "round"))
    }

    /// The paths.
    fn paths(&self) -> Group {
        let path = |group: Group, path: usize| {
            let data = self.part(path, 0.0, self.network.paths[path].length());
            let line = Path::new().set("d", data).set("fill", "none").set("stroke", lane_colour(self.lane(path)));
            group.add(line.set("stroke-width", 1.0))
        };
        (0..self.network.paths.len()).fold(Group::new(), path)
    }

    /// The lines before which cars wait, across their paths.
    fn lines(&self) -> Group {
        let line = |(index, path): (usize, &offtrack::traffic::Path)| {
            let (place, along) = self.network.pose(index, path.line());
            let side = HALF_LINE * along.perp();
            self.view.line(&[(place - side).as_dvec2(), (place + side).as_dvec2()])
        };
        let waits = |(_, path): &(usize, &offtrack::traffic::Path)| path.line < path.length;
        let data: String = self.network.paths.iter().enumerate().filter(waits).map(line).collect();
        Group::new().add(Path::new().set("d", data).set("stroke", colour::INK).set("stroke-width", 4.0))
    }

    fn path_legend(&self) -> impl Iterator<Item = Entry> {
        let has = |lane: &Lane| (0..self.network.paths.len()).any(|path| self.lane(path) == *lane);
        Lane::BOTH.into_iter().filter(has).map(|lane| {
            let words = format!("path from a {} lane", lane.name());
            Entry::new(Swatch::Line(lane_colour(lane), 1.6, ""), words)
        })
    }
}

/// Stretches that overlap as one.
fn united(mut parts: Vec<[f32; 2]>) -> Vec<[f32; 2]> {
    parts.sort_by(|one, other| one[0].total_cmp(&other[0]));
    let mut united: Vec<[f32; 2]> = Vec::new();
    for [from, to] in parts {
        match united.last_mut() {
            Some(last) if from <= last[1] => last[1] = last[1].max(to),
            _ => united.push([from, to]),
        }
    }
    united
}

#[cfg(test)]
mod tests {
    use offtrack::scenario::{APPROACH, DEPARTURE, WAYPOINT_SPACING};

    use super::*;

    #[test]
    fn stretches_that_overlap_are_one() {
        assert_eq!(united(vec![[5.0, 6.0], [1.0, 3.0], [2.0, 2.5], [3.0, 4.0]]), [[1.0, 4.0], [5.0, 6.0]]);
    }

    #[test]
    fn a_ring_of_one_lane_has_nothing_crossed_and_one_of_two_has() {
        let picture = |road: Road| {
            let network = Network::bake(&road).unwrap();
            let straights = Straights { approach: APPROACH, departure: DEPARTURE };
            let routes = road.seen().routes(APPROACH, DEPARTURE, WAYPOINT_SPACING).unwrap();
            drawn(&road, &network, &routes, straights, Gutter::Drivable).unwrap()
        };
        let map = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/maps/zala8.outline.toml");
        let [one, two] = [Road::read(&map).unwrap(), Road::named("16m").unwrap()].map(picture);
        // A layer without stretches is a path without data.
        let crossed = |picture: &str| {
            let layer = picture.split("<path ").find(|path| path.contains(&format!("stroke=\"{}\"", colour::CROSSED)));
            layer.is_some_and(|layer| layer.contains("d=\"M"))
        };
        assert!(!crossed(&one) && crossed(&two));
    }
}
