//! The arms of a ring: where lanes cross a circle around it, grouped into roads.
//!
//! The circle lies outside the ring's own junctions, where lanes that overlap have come together.

use glam::DVec2;

use super::graph::Graph;
use super::lanes::Strip;
use super::records::Records;
use super::rings::NEAR;
use crate::map::arm_names::from_east;

/// Crossings of lanes in the same direction that are nearer than this are one lane (m).
const ONE_LANE: f64 = 1.2;
/// Lanes of one road in the same direction are at most this far from each other on the circle (m).
pub(super) const BESIDE: f64 = 7.0;
/// A lane that leaves and the next that enters are one road if they are at most this far from each other, beside a
/// splitter island, or at most at this angle seen from the centre (m), (rad).
const ONE_ROAD: (f64, f64) = (21.0, 0.55);
/// How far beyond its junctions a ring's circle lies (m).
const BEYOND: f64 = 0.5;
/// How far from the island a ring's junctions are followed at most (m).
const FARTHEST: f64 = 60.0;
/// How far from the island the circle lies where the ring is in no junction (m).
const ALONE: f64 = 20.0;

/// A lane that crosses the circle; several strips where lanes of a junction overlap.
#[derive(Debug, Clone)]
pub(super) struct Crossing {
    /// Whether the lane leads into the ring.
    pub(super) inwards: bool,
    /// Where the lane crosses the circle (m).
    pub(super) at: DVec2,
    pub(super) strips: Vec<usize>,
}

/// The lanes of an arm: those that enter and those that leave, each counted from the kerb.
#[derive(Debug, Clone, Default)]
pub(super) struct ArmLanes {
    pub(super) entries: Vec<Crossing>,
    pub(super) exits: Vec<Crossing>,
}

impl ArmLanes {
    /// Direction from the ring's centre to the middle of the arm's lanes (rad).
    pub(super) fn bearing(&self) -> f64 {
        self.entries.iter().chain(&self.exits).map(|crossing| crossing.at).sum::<DVec2>().to_angle()
    }
}

/// Radius of a circle around the origin outside the junctions of a ring of this radius (m).
pub(super) fn circle(records: &Records, strips: &[Strip], radius: f64) -> f64 {
    let in_ring = |strip: &&Strip| {
        let path = strip.path();
        let along = path.windows(2).filter(|pair| {
            let middle = (pair[0] + pair[1]) / 2.0;
            let turning = middle.normalize_or_zero().perp_dot((pair[1] - pair[0]).normalize_or_zero());
            (middle.length() - radius) < NEAR && 0.8 < turning
        });
        let length = |pair: &[DVec2]| pair[0].distance(pair[1]);
        let whole: f64 = path.windows(2).map(length).sum();
        strip.is_driven() && whole < 2.0 * along.map(length).sum::<f64>()
    };
    let junction = |strip: &Strip| records.roads[strip.road].junction.as_deref();
    let junctions: Vec<&str> = strips.iter().filter(in_ring).filter_map(junction).collect();
    let parts =
        strips.iter().filter(|strip| strip.is_driven() && junction(strip).is_some_and(|id| junctions.contains(&id)));
    let reach = parts
        .flat_map(|strip| &strip.centre)
        .map(|p| p.length())
        .filter(|&reach| reach < radius + FARTHEST)
        .fold(0.0, f64::max);
    if reach == 0.0 { radius + ALONE } else { reach.max(radius + NEAR) + BEYOND }
}

/// Where lanes cross the circle, counter-clockwise.
pub(super) fn crossings(strips: &[Strip], indices: &[usize], graph: &Graph, circle: f64) -> Vec<Crossing> {
    let mut crossings: Vec<Crossing> = Vec::new();
    for (strip, &index) in strips.iter().zip(indices) {
        if !strip.is_driven() || (graph.next[index].is_empty() && graph.previous[index].is_empty()) {
            continue;
        }
        for pair in strip.path().windows(2) {
            let (from, to) = (pair[0].length(), pair[1].length());
            if (circle <= from) == (circle <= to) {
                continue;
            }
            let at = pair[0].lerp(pair[1], (circle - from) / (to - from));
            let inwards = to < from;
            let same = |other: &&mut Crossing| other.inwards == inwards && other.at.distance(at) < ONE_LANE;
            match crossings.iter_mut().find(same) {
                Some(crossing) => crossing.strips.push(index),
                None => crossings.push(Crossing { inwards, at, strips: vec![index] }),
            }
        }
    }
    crossings.sort_by(|one, other| one.at.to_angle().total_cmp(&other.at.to_angle()));
    crossings
}

/// The arms that crossings form, counter-clockwise from east.
pub(super) fn arms(crossings: &[Crossing], circle: f64) -> Vec<ArmLanes> {
    let n = crossings.len();
    // On the right of the road its lanes leave, on the left they enter: an arm ends where a lane that leaves follows
    // one that enters, or far from the next.
    let ends = |i: usize| {
        let (one, next) = (&crossings[i], &crossings[(i + 1) % n]);
        let apart = if one.inwards == next.inwards { BESIDE } else { ONE_ROAD.0.max(ONE_ROAD.1 * circle) };
        (one.inwards && !next.inwards) || apart < one.at.distance(next.at)
    };
    let Some(last) = (0..n).find(|&i| ends(i)) else { return Vec::new() };
    let mut arms: Vec<ArmLanes> = vec![ArmLanes::default()];
    for i in (last + 1..n).chain(0..=last) {
        if let Some(arm) = arms.last_mut() {
            let lanes = if crossings[i].inwards { &mut arm.entries } else { &mut arm.exits };
            lanes.push(crossings[i].clone());
        }
        if ends(i) && i != last {
            arms.push(ArmLanes::default());
        }
    }
    // Counter-clockwise, exits come from the kerb and entries towards it.
    arms.iter_mut().for_each(|arm| arm.entries.reverse());
    // An arm that leads east comes first, also if it points a little south.
    let around = |arm: &ArmLanes| from_east(arm.bearing());
    arms.sort_by(|one, other| around(one).total_cmp(&around(other)));
    arms
}

/// Arms of which one only leaves and the next only enters are one road that parts farther out, if it leaves the ring
/// and reaches it beside a splitter island: `gate` is where a lane crosses the circle of this radius next to the ring.
pub(super) fn joined(mut arms: Vec<ArmLanes>, gate: impl Fn(&Crossing) -> Option<DVec2>, radius: f64) -> Vec<ArmLanes> {
    let mut i = 0;
    while i < arms.len() && 1 < arms.len() {
        let next = (i + 1) % arms.len();
        let one_road = match (
            arms[i].entries.as_slice(),
            arms[i].exits.last(),
            arms[next].entries.last(),
            arms[next].exits.as_slice(),
        ) {
            ([], Some(leaves), Some(enters), []) => gate(leaves).zip(gate(enters)).is_some_and(|(out, into)| {
                out.distance(into) < ONE_ROAD.0.max(ONE_ROAD.1 * radius) && 0.0 < out.perp_dot(into)
            }),
            _ => false,
        };
        if one_road {
            arms[i].entries = std::mem::take(&mut arms[next].entries);
            arms.remove(next);
        } else {
            i += 1;
        }
    }
    arms
}
