//! The centre lines of a roundabout's lanes, and the routes that they form.

use std::f64::consts::TAU;

use glam::DVec2;

use super::alignment::{Way, around, ring_arc};
use super::check;
use super::kerb::corner;
use super::roundabout_keys::{Arm, Ring};
use crate::geometry::{Curve, Piece, wrapped};
use crate::reader::{Error, Reader};
use crate::route::Lane;

/// One end of a route: from an arm's end to the ring, in the world.
#[derive(Debug, Clone)]
struct Lead {
    /// In the direction of travel: inwards for an entry, outwards for an exit.
    curve: Curve,
    /// Direction from the centre to where the curve meets the ring lane, relative to the arm's bearing, in (-pi, pi]
    /// \[rad].
    angle: f64,
}

/// Every lane of every arm, and the right lanes to the first exit that pass outside the ring.
#[derive(Debug, Clone)]
pub(super) struct Lanes {
    radii: [f64; 2],
    bearings: Vec<f64>,
    /// By arm and lane.
    entries: Vec<[Lead; 2]>,
    exits: Vec<[Lead; 2]>,
    /// By entry arm.
    around: Vec<Option<Curve>>,
}

/// Radius of a ring lane's centre line \[m].
pub(super) fn radius(ring: &Ring, lane: Lane) -> f64 {
    let inner = ring.island_radius + ring.gutter + ring.lane_width / 2.0;
    match lane {
        Lane::Left => inner,
        Lane::Right => inner + ring.lane_width,
    }
}

/// The exits that each entry lane leads to on a roundabout of `n_arms`; the last is a U-turn.
pub(super) fn exits(n_arms: usize) -> impl Iterator<Item = (Lane, u32)> {
    let n_arms = n_arms as u32;
    let left = n_arms.saturating_sub(2).max(1)..=n_arms;
    left.map(|exit| (Lane::Left, exit)).chain((1..=n_arms.min(2)).map(|exit| (Lane::Right, exit)))
}

/// The stations at which a line first reaches and last leaves the circle of radius `outer` around the ring's centre; if
/// it passes outside, the station nearest to the centre, twice \[m].
pub(super) fn ring_stations(line: &Curve, outer: f64) -> (f64, f64) {
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
            let arm = &arms[index];
            let fault = |fault| check::fault(reader, arms, index, None, lane.name(), way, fault);
            let (curve, arrival) = arm.way(way).lanes[lane as usize].lead(radius(ring, lane)).map_err(fault)?;
            let curve = way.placed(&curve, arm.bearing);
            Ok(match way {
                Way::Entry => Lead { curve, angle: arrival },
                Way::Exit => Lead { curve: curve.reversed(), angle: -arrival },
            })
        };
        let leads = |way: Way| -> Result<Vec<[Lead; 2]>, Error> {
            (0..arms.len()).map(|index| Ok([lead(index, way, Lane::Left)?, lead(index, way, Lane::Right)?])).collect()
        };
        let around = (0..arms.len()).map(|index| first_exit(reader, ring, arms, index)).collect::<Result<_, Error>>()?;
        let radii = Lane::BOTH.map(|lane| radius(ring, lane));
        let bearings = arms.iter().map(|arm| arm.bearing).collect();
        let lanes = Lanes { radii, bearings, entries: leads(Way::Entry)?, exits: leads(Way::Exit)?, around };
        for entry in 0..arms.len() {
            for (lane, exit) in exits(arms.len()) {
                let sweep = lanes.sweep(entry, lane, exit);
                if !lanes.outside(entry, lane, exit) && !(0.0..=TAU).contains(&sweep) {
                    return Err(check::backwards(reader, arms, entry, lane, exit, sweep * lanes.radii[lane as usize]));
                }
            }
        }
        Ok(lanes)
    }

    /// Every lane of every arm, in and out, in the direction of travel.
    pub(super) fn curves(&self) -> impl Iterator<Item = &Curve> {
        self.entries.iter().chain(&self.exits).flatten().map(|lead| &lead.curve)
    }

    /// The lane of an arm in the direction of travel.
    pub(super) fn curve(&self, arm: usize, way: Way, lane: Lane) -> &Curve {
        let leads = if way == Way::Entry { &self.entries } else { &self.exits };
        &leads[arm][lane as usize].curve
    }

    /// The right lane from an arm to the next outside the ring, if there is one.
    pub(super) fn first_exit(&self, arm: usize) -> Option<&Curve> {
        self.around[arm].as_ref()
    }

    /// The whole route from the end of the entry arm to the end of the exit arm.
    pub(super) fn route(&self, entry: usize, lane: Lane, exit: u32) -> Curve {
        if let (true, Some(curve)) = (self.outside(entry, lane, exit), &self.around[entry]) {
            return curve.clone();
        }
        let exit_arm = (entry + exit as usize) % self.bearings.len();
        let (inward, outward) = (&self.entries[entry][lane as usize], &self.exits[exit_arm][lane as usize]);
        let mut line = inward.curve.clone();
        let sweep = self.sweep(entry, lane, exit);
        if 1e-9 < sweep {
            line.pieces.push(ring_arc(self.radii[lane as usize], wrapped(self.bearings[entry] + inward.angle), sweep));
        }
        line.pieces.extend(&outward.curve.pieces);
        line
    }

    /// Whether a route passes outside the ring.
    fn outside(&self, entry: usize, lane: Lane, exit: u32) -> bool {
        lane == Lane::Right && exit == 1 && self.around[entry].is_some()
    }

    /// The angle along which a route follows the ring; negative if it would have to leave before it arrives \[rad].
    fn sweep(&self, entry: usize, lane: Lane, exit: u32) -> f64 {
        let exit_arm = (entry + exit as usize) % self.bearings.len();
        let between = if exit_arm == entry { TAU } else { (self.bearings[exit_arm] - self.bearings[entry]).rem_euclid(TAU) };
        between + self.exits[exit_arm][lane as usize].angle - self.entries[entry][lane as usize].angle
    }
}

/// The right lane from an arm to the next where it passes outside the ring: beside the kerb between them, or with an
/// arc of its own.
fn first_exit(reader: &Reader, ring: &Ring, arms: &[Arm], index: usize) -> Result<Option<Curve>, Error> {
    let (arm, next) = (&arms[index], &arms[(index + 1) % arms.len()]);
    if let Some(radius) = arm.lane_corner {
        let (entry, exit) = (&arm.entry.lanes[Lane::Right as usize], &next.exit.lanes[Lane::Right as usize]);
        let fault = |fault| check::fault(reader, arms, index, Some("corner.lane_radius"), Lane::Right.name(), Way::Entry, fault);
        return around((entry, arm.bearing), (exit, next.bearing), radius).map(Some).map_err(fault);
    }
    if arm.kerb_corner.is_none() {
        return Ok(None);
    }
    let kerb = corner(reader, ring, arms, index)?;
    let smooth =
        kerb.pieces.windows(2).all(|joint| wrapped(joint[1].heading_at(0.0) - joint[0].heading_at(joint[0].length())).abs() < 1e-6);
    let pieces: Option<Vec<Piece>> = kerb.pieces.iter().map(|piece| piece.beside(ring.gutter + ring.lane_width / 2.0)).collect();
    match pieces.filter(|_| smooth) {
        Some(pieces) => Ok(Some(Curve { pieces })),
        None => Err(check::no_way_beside(reader, arms, index)),
    }
}
