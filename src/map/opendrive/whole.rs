//! What is seen of a map only when all of it was read: links that lead nowhere, both ways of direct junctions, roads
//! far from the others.

use std::collections::HashSet;

use glam::DVec2;

use super::paths::Network;
use super::records::{Concerns, Connection, Link, Records, Warning};
use super::xml::shown;
use crate::files::reader::{Error, Reader};

/// Farthest that a road begins from the middle of a map: beyond it polygons are computed on too coarse a grid (m).
const FARTHEST: f64 = 500_000.0;
/// A crossfall beyond this is warned of: what drains a road is less.
pub(super) const TILTED: f64 = 0.03;
/// How warnings of what is not level end.
pub(super) const LEVEL: &str = "the simulated road is level";
/// Most unknown lane types that are named.
const MOST_TYPES: usize = 20;

impl Records {
    /// Checks a map whose roads and junctions were read, and completes it.
    pub(super) fn completed(&mut self, reader: &Reader) -> Result<(), Error> {
        self.check_extent(reader)?;
        self.warn_of_missing();
        self.warn_of_tilt();
        let unknown = self.unknown_lanes().map(|unknown| format!("{unknown}; nothing is driven on there"));
        self.warnings.extend(unknown.map(Warning::of_map));
        self.turn_direct_connections();
        Ok(())
    }

    /// The types of lanes that are not known, each with its number of lanes; `None` if all are.
    pub(super) fn unknown_lanes(&self) -> Option<String> {
        let named = self
            .unknown_types
            .iter()
            .take(MOST_TYPES)
            .map(|(name, lanes)| format!("\"{}\" ({lanes} lanes)", shown(name)));
        let list = named.collect::<Vec<_>>().join(", ");
        let more = if MOST_TYPES < self.unknown_types.len() { ", and more" } else { "" };
        (!self.unknown_types.is_empty()).then(|| format!("lane types that are not known: {list}{more}"))
    }

    /// The outlines of traffic islands that are objects (m).
    pub(super) fn islands(&self) -> impl Iterator<Item = &Vec<DVec2>> {
        self.roads.iter().flat_map(|road| &road.islands).map(|island| &island.corners)
    }

    /// Which of some warnings concern a place with these roads.
    pub(super) fn around<'a>(&self, warnings: &'a [Warning], network: &Network) -> impl Iterator<Item = &'a str> {
        let roads: HashSet<&str> = network.strips.values().map(|strip| self.roads[strip.road].id.as_str()).collect();
        let concerned = move |warning: &&Warning| match &warning.concerns {
            Concerns::Map => false,
            Concerns::Road(id) => roads.contains(id.as_str()),
            Concerns::EveryPlace => true,
        };
        warnings.iter().filter(concerned).map(|warning| warning.text.as_str())
    }

    /// An error if a road begins too far from the others.
    fn check_extent(&self, reader: &Reader) -> Result<(), Error> {
        let middle = |axis: fn(DVec2) -> f64| {
            let mut all: Vec<f64> =
                self.roads.iter().filter_map(|road| road.plan.first()).map(|piece| axis(piece.origin)).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied().unwrap_or(0.0)
        };
        let middle = DVec2::new(middle(|p| p.x), middle(|p| p.y));
        for road in &self.roads {
            if let Some(piece) = road.plan.iter().find(|piece| FARTHEST < piece.origin.distance(middle)) {
                let key = format!("road {}, geometry s {}: x and y", shown(&road.id), piece.start);
                let far = format!("{:.0} km from the middle of the map", piece.origin.distance(middle) / 1000.0);
                let expected = format!("must be at most {:.0} km; move the road or leave it out", FARTHEST / 1000.0);
                return Err(reader.invalid(key, far, expected));
            }
        }
        Ok(())
    }

    /// Warns of links to what the file does not have.
    fn warn_of_missing(&mut self) {
        let known: HashSet<&str> = self.roads.iter().map(|road| road.id.as_str()).collect();
        let mut missing = Vec::new();
        for road in &self.roads {
            for link in [&road.predecessor, &road.successor].into_iter().flatten() {
                match link {
                    Link::RoadRecord(id, _) if !known.contains(id.as_str()) => missing.push((&road.id, "road", id)),
                    Link::Junction(id) if !self.junctions.contains_key(id) => missing.push((&road.id, "junction", id)),
                    _ => {}
                }
            }
        }
        let warnings = missing.into_iter().map(|(road, what, id)| {
            // Roads between may say themselves what they lead to, and a junction only lists them.
            let end = if what == "road" { "; it is a dead end" } else { "" };
            format!("road {}: is linked to {what} {}, which the file does not have{end}", shown(road), shown(id))
        });
        let warnings: Vec<Warning> = warnings.map(Warning::of_map).collect();
        self.warnings.extend(warnings);
    }

    /// Warns of the largest crossfall.
    fn warn_of_tilt(&mut self) {
        let tilted = self.roads.iter().filter(|road| TILTED < road.level.crossfall);
        let Some(most) = tilted.clone().max_by(|one, other| one.level.crossfall.total_cmp(&other.level.crossfall))
        else {
            return;
        };
        let (percent, roads, all) = (100.0 * most.level.crossfall, tilted.count(), self.roads.len());
        let largest = format!("up to {percent:.1} % on road {}", shown(&most.id));
        self.warnings.push(Warning::of_map(format!(
            "{roads} of {all} roads have a crossfall (superelevation, crossfall, shape), {largest}; {LEVEL}"
        )));
    }

    /// A direct junction joins two roads without a road of its own: what it says of one of them holds for the other
    /// too.
    fn turn_direct_connections(&mut self) {
        for (id, connections) in &mut self.junctions {
            let mut turned = Vec::new();
            for connection in connections.iter().filter(|connection| connection.direct) {
                let Some(road) = self.by_id.get(&connection.incoming).map(|&road| &self.roads[road]) else { continue };
                let leads_here = |link: &Option<Link>| matches!(link, Some(Link::Junction(other)) if other == id);
                turned.push(Connection {
                    incoming: connection.connecting.clone(),
                    connecting: connection.incoming.clone(),
                    at_start: leads_here(&road.predecessor) && !leads_here(&road.successor),
                    lanes: connection.lanes.iter().map(|&(from, to)| (to, from)).collect(),
                    direct: true,
                });
            }
            let known: HashSet<Connection> = connections.iter().cloned().collect();
            connections.extend(turned.into_iter().filter(|connection| !known.contains(connection)));
        }
    }
}
