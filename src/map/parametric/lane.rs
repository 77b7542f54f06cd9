//! The centre lines of a roundabout's lanes, and the routes that they form.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry as Slot;
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use glam::DVec2;

use super::alignment::{Way, around, ring_arc};
use super::faults::{self, Aligned, Part};
use super::kerb::corner;
use super::ring::Ring;
use super::roundabout_keys::Arm;
use crate::files::reader::{Error, Reader};
use crate::geometry::{Curve, Piece, wrapped};
use crate::map::route::Lane;

/// One end of a route: from an arm's end to the ring, in the world.
#[derive(Debug, Clone, PartialEq)]
struct Lead {
    /// Curve in the direction of travel: inwards for an entry, outwards for an exit.
    curve: Curve,
    /// Direction from the centre to where the curve meets the ring lane, relative to the arm's bearing, in (-pi, pi]
    /// (rad).
    angle: f64,
}

/// A route from the end of its entry arm to the end of its exit arm.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RouteLine {
    /// Index of the entry arm.
    pub(super) entry: usize,
    pub(super) lane: Lane,
    /// Exit number, counted counter-clockwise from the entry.
    pub(super) exit: u32,
    pub(super) line: Curve,
}

/// Every lane of every arm, and the routes that they form.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Lanes {
    /// Leads by arm, then from the kerb.
    entries: Vec<Vec<Lead>>,
    exits: Vec<Vec<Lead>>,
    /// By arm of an exit with one lane that routes from left lanes take: that lane, led to their lane of the ring.
    merges: BTreeMap<usize, Lead>,
    /// By entry arm: the right lane to the first exit, where it passes outside the ring.
    around: Vec<Option<Curve>>,
    /// Routes by entry arm, lane and exit.
    routes: Vec<RouteLine>,
}

/// The exits that the lanes of an entry lead to on a roundabout of `n_arms`; the last is a U-turn.
pub(super) fn exits(n_arms: usize, entry_lanes: usize) -> Vec<(Lane, u32)> {
    let n_arms = n_arms as u32;
    let of = |lane: Lane, exits: RangeInclusive<u32>| exits.map(move |exit| (lane, exit));
    match entry_lanes {
        1 => of(Lane::Right, 1..=n_arms).collect(),
        _ => {
            of(Lane::Left, n_arms.saturating_sub(2).max(1)..=n_arms).chain(of(Lane::Right, 1..=n_arms.min(2))).collect()
        }
    }
}

/// The stations at which a line first reaches and last leaves the circle of radius `outer` around the ring's centre; if
/// it passes outside, the station nearest to the centre, twice (m).
pub(in crate::map) fn ring_stations(line: &Curve, outer: f64) -> (f64, f64) {
    let circle = Curve::circle(DVec2::ZERO, outer);
    let mut begin = 0.0;
    let mut stations = Vec::new();
    for piece in &line.pieces {
        stations.extend(piece.meetings(&circle.pieces[0]).into_iter().map(|p| begin + piece.station(p)));
        begin += piece.length();
    }
    let nearest = line.station(DVec2::ZERO);
    let first = stations.iter().copied().reduce(f64::min).unwrap_or(nearest);
    (first, stations.iter().copied().reduce(f64::max).unwrap_or(nearest))
}

impl Lanes {
    /// All lanes. Fails if a lane does not lead into the ring or a route would have to go backwards.
    pub(super) fn new(reader: &Reader, ring: &Ring, arms: &[Arm]) -> Result<Lanes, Error> {
        let lead = |index: usize, way: Way, lane: Lane| -> Result<Lead, Error> {
            let (arm, carriageway) = (&arms[index], arms[index].way(way));
            let circle = ring.lane_radius(lane.index());
            let fault = |fault| match carriageway.lanes.len() <= lane.index() {
                true => faults::no_merge(reader, arms, index, circle),
                false => faults::fault(reader, arms, Aligned { arm: index, way, part: Part::Lane(lane) }, fault),
            };
            let (curve, arrival) = carriageway.lane(lane).lead(circle).map_err(fault)?;
            let curve = way.placed(&curve, arm.bearing);
            Ok(match way {
                Way::Entry => Lead { curve, angle: arrival },
                Way::Exit => Lead { curve: curve.reversed(), angle: -arrival },
            })
        };
        let leads = |way: Way| -> Result<Vec<Vec<Lead>>, Error> {
            let of = |index: usize| {
                Lane::BOTH
                    .into_iter()
                    .rev()
                    .take(arms[index].way(way).lanes.len())
                    .map(|lane| lead(index, way, lane))
                    .collect()
            };
            (0..arms.len()).map(of).collect()
        };
        let around: Vec<Option<Curve>> =
            (0..arms.len()).map(|index| first_exit(reader, ring, arms, index)).collect::<Result<_, Error>>()?;
        let (entries, exit_leads) = (leads(Way::Entry)?, leads(Way::Exit)?);
        let (mut merges, mut routes) = (BTreeMap::new(), Vec::new());
        for (entry, arm) in arms.iter().enumerate() {
            for (lane, exit) in exits(arms.len(), arm.entry.lanes.len()) {
                if let (Lane::Right, 1, Some(curve)) = (lane, exit, &around[entry]) {
                    routes.push(RouteLine { entry, lane, exit, line: curve.clone() });
                    continue;
                }
                let to = (entry + exit as usize) % arms.len();
                let inward = &entries[entry][lane.index()];
                let outward: &Lead = match (exit_leads[to].get(lane.index()), merges.entry(to)) {
                    (Some(lead), _) => lead,
                    (None, Slot::Occupied(merge)) => merge.into_mut(),
                    (None, Slot::Vacant(none)) => none.insert(lead(to, Way::Exit, lane)?),
                };
                // The angle along which the route follows the ring.
                let between = if to == entry { TAU } else { (arms[to].bearing - arm.bearing).rem_euclid(TAU) };
                let sweep = between + outward.angle - inward.angle;
                let radius = ring.lane_radius(lane.index());
                if !(0.0..=TAU).contains(&sweep) {
                    return Err(faults::backwards(reader, arms, entry, lane, exit, sweep * radius));
                }
                let mut line = inward.curve.clone();
                if 1e-9 < sweep {
                    line.pieces.push(ring_arc(radius, wrapped(arm.bearing + inward.angle), sweep));
                }
                line.pieces.extend(&outward.curve.pieces);
                routes.push(RouteLine { entry, lane, exit, line });
            }
        }
        Ok(Lanes { entries, exits: exit_leads, merges, around, routes })
    }

    /// Every lane of every arm, in and out, in the direction of travel; of two the left one first.
    pub(super) fn curves(&self) -> impl Iterator<Item = &Curve> {
        self.entries.iter().chain(&self.exits).flat_map(|leads| leads.iter().rev()).map(|lead| &lead.curve)
    }

    /// The lanes of a carriageway in the direction of travel, from the kerb.
    pub(super) fn of(
        &self,
        arm: usize,
        way: Way,
    ) -> impl DoubleEndedIterator<Item = (Lane, &Curve)> + ExactSizeIterator {
        let leads = if way == Way::Entry { &self.entries } else { &self.exits };
        Lane::BOTH.into_iter().rev().zip(leads[arm].iter().map(|lead| &lead.curve))
    }

    /// The way of routes from left lanes into an arm's exit of one lane, if there are any.
    pub(super) fn merge(&self, arm: usize) -> Option<&Curve> {
        self.merges.get(&arm).map(|lead| &lead.curve)
    }

    /// The right lane from an arm to the next outside the ring, if there is one.
    pub(super) fn first_exit(&self, arm: usize) -> Option<&Curve> {
        self.around[arm].as_ref()
    }

    /// Every route, ordered by entry arm, lane and exit.
    pub(super) fn routes(&self) -> &[RouteLine] {
        &self.routes
    }
}

/// The right lane from an arm to the next where it passes outside the ring: beside the kerb between them, or with an
/// arc of its own.
fn first_exit(reader: &Reader, ring: &Ring, arms: &[Arm], index: usize) -> Result<Option<Curve>, Error> {
    let (arm, next) = (&arms[index], &arms[(index + 1) % arms.len()]);
    if let Some(radius) = arm.lane_corner {
        let (entry, exit) = (arm.entry.lane(Lane::Right), next.exit.lane(Lane::Right));
        let of = Aligned { arm: index, way: Way::Entry, part: Part::Lane(Lane::Right) };
        let joined = around((entry, arm.bearing), (exit, next.bearing), radius);
        return joined.map(Some).map_err(|fault| faults::fault(reader, arms, of, fault));
    }
    if arm.kerb_corner.is_none() || arm.lane_on_ring {
        return Ok(None);
    }
    if arm.lane_width != next.lane_width {
        return Err(faults::widths_differ(reader, arms, index));
    }
    let kerb = corner(reader, ring, arms, index)?;
    let smooth = kerb
        .pieces
        .windows(2)
        .all(|joint| wrapped(joint[1].heading_at(0.0) - joint[0].heading_at(joint[0].length())).abs() < 1e-6);
    let pieces: Option<Vec<Piece>> =
        kerb.pieces.iter().map(|piece| piece.beside(ring.gutter + arm.lane_width / 2.0)).collect();
    match pieces.filter(|_| smooth) {
        Some(pieces) => Ok(Some(Curve { pieces })),
        None => Err(faults::no_way_beside(reader, arms, index)),
    }
}
