//! Ways through the junctions of a map, chosen by road and lane, as a [`Ground`](crate::map::ground::Ground): a
//! crossing instead of a ring.

use std::collections::HashMap;
use std::fmt;

use glam::DVec2;

use super::build::{Imported, Options, Refusals, Site};
use super::crossings::{ArmLanes, Crossing, arms, crossings};
use super::lanes::{Strip, sampled};
use super::lines::CROSSING;
use super::paths::{Network, Way as Lanes};
use super::surroundings::{self, Part, REACH, clipped, outline};
use super::xml::shown;
use super::{COARSE, FINEST, Map};
use crate::files::reader::{Error, Reader};
use crate::geometry::area::encloses;
use crate::map::route::Lane;

/// How far beyond its junction the circle lies on which arms begin (m).
const BEYOND: f64 = 0.5;
/// Least radius of that circle (m).
const SMALLEST: f64 = 5.0;
/// Largest radius of that circle (m).
const LARGEST: f64 = 60.0;

/// A lane of a map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RoadLane {
    /// The road's id.
    pub road: String,
    /// The lane's number: negative right of the road's reference line, positive left of it.
    pub lane: i32,
}

impl fmt::Display for RoadLane {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.road, self.lane)
    }
}

/// A way through a map, from a lane to another that the map's links lead to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Way {
    /// Where the way comes from.
    pub from: RoadLane,
    /// Where the way leads.
    pub to: RoadLane,
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {}", self.from, self.to)
    }
}

/// The ways through one junction.
#[derive(Debug, Clone, PartialEq)]
pub struct Junction {
    /// The junction's id in the map.
    pub id: String,
    /// Middle of its lanes in the map's own coordinates (m).
    pub centre: DVec2,
    /// Every way through it.
    pub ways: Vec<Way>,
}

impl Map {
    /// The centre line of every lane that is driven on, a section at a time, in its direction of travel and the map's
    /// own coordinates; chords leave their curves by at most `tolerance` (m).
    pub fn lane_centres(&self, tolerance: f64) -> Vec<(RoadLane, Vec<DVec2>)> {
        let mut centres = Vec::new();
        for (index, road) in self.records.roads.iter().enumerate() {
            for section in 0..road.sections.len() {
                for strip in sampled(road, index, section, tolerance).into_iter().filter(Strip::is_driven) {
                    let path = strip.path().into_iter().map(|p| self.outside(p)).collect();
                    centres.push((self.road_lane(&strip), path));
                }
            }
        }
        centres
    }

    /// The map's junctions that lanes lead through, in the order of their ids, numbers first.
    pub fn junctions(&self) -> Vec<Junction> {
        let network = self.network();
        let mut inside: HashMap<&str, Vec<usize>> = HashMap::new();
        for (index, strip) in self.strips.iter().enumerate().filter(|(_, strip)| strip.is_driven()) {
            if let Some(id) = self.junction_of(strip) {
                inside.entry(id).or_default().push(index);
            }
        }
        let mut junctions: Vec<Junction> = Vec::new();
        for (id, strips) in inside {
            let outside = |&&index: &&usize| self.junction_of(&self.strips[index]) != Some(id);
            let entries = strips.iter().flat_map(|&strip| self.graph.previous[strip].iter().filter(outside));
            let exits = strips.iter().flat_map(|&strip| self.graph.next[strip].iter().filter(outside));
            let crossing = |&strip: &usize| Crossing { inwards: true, at: DVec2::ZERO, strips: vec![strip] };
            let (mut entries, mut exits): (Vec<usize>, Vec<usize>) =
                (entries.copied().collect(), exits.copied().collect());
            for ends in [&mut entries, &mut exits] {
                ends.sort_unstable();
                ends.dedup();
            }
            let mut ways: Vec<Way> = Vec::new();
            for &entry in &entries {
                // Of a lane from the junction to itself, the beginning is no way out.
                let exits: Vec<usize> = exits.iter().copied().filter(|&exit| exit != entry).collect();
                let arms: Vec<ArmLanes> =
                    exits.iter().map(|exit| ArmLanes { entries: Vec::new(), exits: vec![crossing(exit)] }).collect();
                let found = network.ways(&crossing(&entry), &arms).into_iter();
                // Through this junction alone.
                let through = |(_, way): &Lanes| way[1..way.len() - 1].iter().all(|strip| strips.contains(strip));
                let inner = found.filter(|(_, way)| 2 < way.len()).filter(through);
                ways.extend(inner.map(|((arm, _), _)| Way {
                    from: self.road_lane(&self.strips[entry]),
                    to: self.road_lane(&self.strips[exits[arm]]),
                }));
            }
            if !ways.is_empty() {
                let centre = self.outside(middle(strips.iter().flat_map(|&strip| &self.strips[strip].centre)));
                junctions.push(Junction { id: id.to_owned(), centre, ways });
            }
        }
        junctions.sort_by_key(|junction| (junction.id.parse::<u64>().unwrap_or(u64::MAX), junction.id.clone()));
        junctions
    }

    /// Ways through the map as a [`Ground`](crate::map::ground::Ground) around the junctions that they lead through.
    ///
    /// Arms are named as a ring's are and exits counted as there, over all roads of these junctions. The circle around
    /// the junctions takes the place of the ring's outer kerb, and there is no island.
    ///
    /// # Errors
    ///
    /// No way, a road or lane that the map does not have, a way that its links do not lead along, junctions too far
    /// from each other, or ways that would have the same name.
    pub fn through(&self, ways: &[Way], options: &Options) -> Result<Imported, Error> {
        let name = ways.iter().map(Way::to_string).collect::<Vec<_>>().join(", ");
        let refused = Refusals { reader: Reader::of(&self.file), place: format!("way {}", shown(&name)) };
        if ways.is_empty() {
            return Err(refused.error("ways", "none", "at least one is needed"));
        }
        let whole = self.network();
        let mut found: Vec<(&Way, Vec<usize>)> = Vec::new();
        for way in ways {
            found.push((way, self.way(&refused, &whole, way)?));
        }
        let (origin, circle) = self.around(&refused, &found)?;
        let extent = circle + REACH;

        let surface = surroundings::surface(self, origin, extent);
        let on_road = self.strips[found[0].1[found[0].1.len() / 2]].path();
        let p = on_road[on_road.len() / 2] - origin;
        let around = |part: &Part| encloses(&part[0], p) && part.iter().skip(1).all(|hole| !encloses(hole, p));
        let part = |area| clipped(area, extent).into_iter().find(around);
        let no_surface = || refused.error("surface", "none", "its lanes have no width there");
        let faces = outline(&part(&surface.faces).ok_or_else(no_surface)?, DVec2::ZERO);
        let edges = outline(&part(&surface.edges).ok_or_else(no_surface)?, DVec2::ZERO);

        let fine = surroundings::lanes(self, origin, extent, FINEST);
        let network = Network {
            records: &self.records,
            graph: &self.graph,
            strips: fine.iter().map(|(index, strip)| (*index, strip)).collect(),
        };
        let (indices, coarse): (Vec<usize>, Vec<Strip>) =
            surroundings::nearby(self, origin, extent, COARSE).into_iter().unzip();
        let lanes = arms(&crossings(&coarse, &indices, &self.graph, circle), circle);
        let site = Site { map: self, refused: &refused, network: &network, origin, extent, circle, faces, edges };
        site.imported(&lanes, options, |routes| {
            for (way, strips) in &found {
                let crosses = format!("must cross the circle of {circle:.1} m around the junction on a lane");
                let route = route(&network.continued(strips, extent), strips, &lanes);
                let route = route.ok_or_else(|| refused.error("way", shown(&way.to_string()), crosses))?;
                let (entry, lane, exit, _) = route;
                if routes.lines.iter().any(|line| (line.entry, line.lane, line.exit) == (entry, lane, exit)) {
                    let same = routes.name(entry, lane, exit);
                    return Err(refused.error(
                        "way",
                        shown(&way.to_string()),
                        format!("is {same}, as an earlier one is; leave one of them out"),
                    ));
                }
                routes.add(route, &((0, 0), strips.clone()), |_, width| (CROSSING * width, CROSSING * width));
            }
            Ok(())
        })
    }

    /// All lanes of the map.
    fn network(&self) -> Network<'_> {
        let driven = self.strips.iter().enumerate().filter(|(_, strip)| strip.is_driven());
        Network { records: &self.records, graph: &self.graph, strips: driven.collect() }
    }

    fn junction_of(&self, strip: &Strip) -> Option<&str> {
        self.records.roads[strip.road].junction.as_deref()
    }

    /// A lane by its numbers in the map.
    fn road_lane(&self, Strip { road, id, .. }: &Strip) -> RoadLane {
        RoadLane { road: self.records.roads[*road].id.clone(), lane: if self.records.mirrored { -id } else { *id } }
    }

    /// The strips of a lane.
    fn strips_of(
        &self,
        refused: &Refusals,
        end: &str,
        RoadLane { road, lane }: &RoadLane,
    ) -> Result<Vec<usize>, Error> {
        let Some(&index) = self.records.by_id.get(road) else {
            let expected = "the map has no such road; `offtrack import MAP --junctions` lists the ways through it";
            return Err(refused.error(&format!("{end}.road"), format!("{road:?}"), expected));
        };
        let all = || self.strips.iter().enumerate().filter(|(_, strip)| strip.road == index && strip.is_driven());
        let id = if self.records.mirrored { lane.wrapping_neg() } else { *lane };
        let found: Vec<usize> = all().filter(|(_, strip)| strip.id == id).map(|(index, _)| index).collect();
        if found.is_empty() {
            let mut known: Vec<i32> = all().map(|(index, _)| self.road_lane(&self.strips[index]).lane).collect();
            known.sort_unstable();
            known.dedup();
            let expected = format!("road {} has the lanes {known:?} to drive on", shown(road));
            return Err(refused.error(&format!("{end}.lane"), lane.to_string(), expected));
        }
        Ok(found)
    }

    /// The lanes along a way.
    fn way(&self, refused: &Refusals, network: &Network, way: &Way) -> Result<Vec<usize>, Error> {
        let crossing = |strips: Vec<usize>| Crossing { inwards: true, at: DVec2::ZERO, strips };
        let entry = crossing(self.strips_of(refused, "from", &way.from)?);
        let exit = ArmLanes { entries: Vec::new(), exits: vec![crossing(self.strips_of(refused, "to", &way.to)?)] };
        let found = network.ways(&entry, &[exit]).into_iter().next();
        let along = found.map(|(_, along)| along).filter(|along| 1 < along.len());
        along.ok_or_else(|| {
            let onward = entry
                .strips
                .iter()
                .flat_map(|&strip| &self.graph.next[strip])
                .filter(|next| !entry.strips.contains(next));
            let mut onward: Vec<String> =
                onward.map(|&next| shown(&self.road_lane(&self.strips[next]).to_string())).collect();
            onward.dedup();
            let onward = if onward.is_empty() { "no lane".to_owned() } else { onward.join(", ") };
            let from = shown(&way.from.to_string());
            let expected = format!("no links of the map lead there; {from} leads on to {onward}");
            refused.error("to", shown(&way.to.to_string()), expected)
        })
    }

    /// The middle of the junctions that ways lead through, and the radius of the circle around them (m).
    fn around(&self, refused: &Refusals, found: &[(&Way, Vec<usize>)]) -> Result<(DVec2, f64), Error> {
        let (first, last) = (|way: &Way| way.from.road.clone(), |way: &Way| way.to.road.clone());
        let road = |strip: usize| &self.records.roads[self.strips[strip].road].id;
        let inner = found.iter().flat_map(|(way, along)| {
            let ends = [first(way), last(way)];
            along.iter().copied().filter(move |&strip| !ends.contains(road(strip)))
        });
        let inner: Vec<usize> = inner.collect();
        let ids: Vec<&str> = inner.iter().filter_map(|&strip| self.junction_of(&self.strips[strip])).collect();
        let belongs = |index: usize, strip: &Strip| {
            inner.contains(&index) || self.junction_of(strip).is_some_and(|id| ids.contains(&id))
        };
        let parts = self.strips.iter().enumerate().filter(|(index, strip)| strip.is_driven() && belongs(*index, strip));
        let mut points: Vec<DVec2> = parts.flat_map(|(_, strip)| &strip.centre).copied().collect();
        if points.is_empty() {
            // Two roads that meet: where the first ends.
            points.extend(found.iter().filter_map(|(_, along)| self.strips[along[0]].path().last().copied()));
        }
        let centre = middle(points.iter());
        let reach = points.iter().map(|p| p.distance(centre)).fold(0.0, f64::max) + BEYOND;
        if LARGEST < reach {
            let expected =
                format!("the junctions that it leads through reach as far from their middle; at most {LARGEST} m");
            return Err(refused.error("radius", format!("{reach:.1} m"), expected));
        }
        Ok((centre, reach.max(SMALLEST)))
    }
}

/// Middle of the smallest upright rectangle around points (m).
fn middle<'a>(points: impl Iterator<Item = &'a DVec2>) -> DVec2 {
    let (low, high) = points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
    (low + high) / 2.0
}

/// Entry arm, lane, exit and exit arm of a way that was continued at both ends.
fn route(along: &[usize], way: &[usize], lanes: &[ArmLanes]) -> Option<(usize, Lane, u32, usize)> {
    let at = |crossing: &Crossing| along.iter().position(|strip| crossing.strips.contains(strip));
    let (first, last) = (
        along.iter().position(|strip| *strip == way[0])?,
        along.iter().position(|strip| *strip == way[way.len() - 1])?,
    );
    let entries = lanes
        .iter()
        .enumerate()
        .flat_map(|(arm, lanes)| lanes.entries.iter().enumerate().map(move |(lane, c)| (arm, lane, c)));
    let (entry, lane, _) = entries
        .filter(|(.., crossing)| at(crossing).is_some_and(|at| at < last))
        .max_by_key(|(.., crossing)| at(crossing))?;
    let exits =
        lanes.iter().enumerate().flat_map(|(arm, lanes)| lanes.exits.iter().map(move |crossing| (arm, crossing)));
    let (exit_arm, _) = exits
        .filter(|(_, crossing)| at(crossing).is_some_and(|at| first < at))
        .min_by_key(|(_, crossing)| at(crossing))?;
    let turns = (1..=lanes.len()).map(|turn| (entry + turn) % lanes.len()).filter(|&arm| !lanes[arm].exits.is_empty());
    let exit = turns.take_while(|&arm| arm != exit_arm).count() + 1;
    Some((entry, if lane == 0 { Lane::Right } else { Lane::Left }, exit as u32, exit_arm))
}
