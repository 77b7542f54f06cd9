//! One attempt at a road: everything drawn, as a roundabout file would have it.

use std::f64::consts::PI;

use glam::DVec2;

use super::Reason;
use super::arm::{Arm, Ring};
use super::distribution_keys::Keys;
use super::draws::{Draws, Place, Quantity as Q};
use super::line::{Line, millimetres};
use crate::files::reader::Exactly;
use crate::map::ground::Hand;
use crate::map::parametric::written::{BEHIND_APRON, Written, WrittenArm, WrittenCorner, WrittenRing};

/// The names of arms: the nearest of eight directions, from east counter-clockwise.
const COMPASS: [&str; 8] = ["E", "NE", "N", "NW", "W", "SW", "S", "SE"];

/// The roundabout of an attempt, or why there is none. It is not checked as a file is.
pub(super) fn drawn(keys: &Keys, draws: &Draws) -> Result<Written, Reason> {
    let (written_ring, ring) = ring(keys, draws);
    let bearings = bearings(keys, draws, &ring)?;
    let arms: Vec<Arm> =
        (0..bearings.len()).map(|arm| Arm::drawn(keys, draws, &ring, arm)).collect::<Result<_, _>>()?;
    let share = keys.corners.shares[draws.index(Place::Ring, Q::CornerShare, &keys.corners.weights)];
    let written = arms.iter().enumerate().map(|(index, arm)| {
        let next = (index + 1) % arms.len();
        let mut corner = WrittenCorner::default();
        let gap = (bearings[next] - bearings[index]).rem_euclid(360.0).to_radians();
        let (kerb, next_kerb) = (&arm.entry.kerb, &arms[next].exit.kerb);
        let ring_left = gap - kerb.arrival(ring.outer).unwrap_or(0.0) - next_kerb.arrival(ring.outer).unwrap_or(0.0);
        // Arms with no ring between their kerbs can only be joined outside it.
        if draws.happens(Place::Arm(index), Q::HasCorner, share) || ring_left < 0.0 {
            corner.kerb_radius = corner_radius(keys, draws, &ring, index, kerb, next_kerb, gap);
        }
        WrittenArm {
            name: COMPASS[(bearings[index] / 45.0).round() as usize % 8].to_owned(),
            bearing_deg: bearings[index],
            length: arm.length,
            lane_width: (ring.lane_width != ring.ring_lane_width).then_some(ring.lane_width),
            entry: arm.entry.written(1.0, &ring),
            exit: arm.exit.written(-1.0, &ring),
            corner,
            splitter: arm.splitter(keys, draws, &ring, index),
            splitter_gutter: None,
            kerb_gutter: None,
        }
    });
    Ok(Written { hand: Hand::Right, ring: written_ring, arm: written.collect() })
}

/// The ring as a file has it, and what the arms need of it.
fn ring(keys: &Keys, draws: &Draws) -> (WrittenRing, Ring) {
    let place = Place::Ring;
    let gutter = millimetres(draws.within(place, Q::Gutter, *keys.ring.gutter));
    let lanes = 1 + draws.index(place, Q::RingLanes, &*keys.ring.lanes);
    let (island, narrowest) = match keys.single.as_ref().filter(|_| lanes == 1) {
        Some(single) => (draws.log_within(place, Q::IslandRadius, *single.island_radius), keys.ring.lane_width[0]),
        None => island(keys, draws),
    };
    let (island, lane_width) =
        (millimetres(island), millimetres(draws.within(place, Q::LaneWidth, [narrowest, keys.ring.lane_width[1]])));
    let ring_lane_width = match keys.single.as_ref().filter(|_| lanes == 1) {
        Some(single) => {
            let needed = single.outer_radius - island - 2.0 * gutter;
            millimetres(draws.within(place, Q::RingLaneWidth, *single.lane_width).max(needed).min(single.lane_width[1]))
        }
        None => lane_width,
    };
    let outer = island + 2.0 * gutter + lanes as f64 * ring_lane_width;
    let written = WrittenRing {
        island_radius: island,
        gutter,
        lane_width: ring_lane_width,
        lanes: (lanes != 2).then_some(lanes),
        apron: keys.ring.apron.map(|Exactly([least, most])| {
            let room = island - BEHIND_APRON;
            millimetres(draws.within(place, Q::Apron, [least.min(room), most.min(room)]))
        }),
        island_gutter: None,
        mouth_gutter: None,
    };
    (written, Ring { outer, lanes, ring_lane_width, lane_width, gutter })
}

/// Radius of the island of a ring of two or three lanes, and the least width of its lanes (m).
fn island(keys: &Keys, draws: &Draws) -> (f64, f64) {
    let ring = &keys.ring;
    let [least, most] = *ring.island_radius;
    // Log-uniform below the small radius, and above.
    let middle = ring.small_radius.clamp(least, most);
    let weights = [ring.small_weight * (middle / least).ln(), (most / middle).ln()];
    let fraction = draws.unit(Place::Ring, Q::IslandRadius) * (weights[0] + weights[1]);
    let island = match fraction < weights[0] {
        true => least * (fraction / ring.small_weight).exp(),
        false => middle * (fraction - weights[0]).exp(),
    };
    let [narrowest, widest] = *ring.lane_width;
    (island, if island < ring.narrow_radius { narrowest.max(ring.narrow_lane_width).min(widest) } else { narrowest })
}

/// Bearings of the arms in hundredths of a degree, counter-clockwise from the first (deg).
fn bearings(keys: &Keys, draws: &Draws, ring: &Ring) -> Result<Vec<f64>, Reason> {
    let mut shares = *keys.arms.shares;
    if ring.outer < keys.arms.five_from && 0.0 < shares[0] + shares[1] {
        shares[2] = 0.0;
    }
    let n_arms = 3 + draws.index(Place::Ring, Q::Arms, &shares);
    let vary = |arm: usize| 1.0 + keys.arms.gap_variation * (2.0 * draws.unit(Place::Arm(arm), Q::Gap) - 1.0);
    let gaps: Vec<f64> = (0..n_arms).map(vary).collect();
    let whole: f64 = gaps.iter().sum();
    let mut bearing = 360.0 * draws.unit(Place::Ring, Q::FirstBearing);
    let mut bearings = Vec::with_capacity(n_arms);
    for gap in &gaps {
        // Rounding may give 360, which is 0.
        bearings.push((bearing * 100.0).round().rem_euclid(36_000.0) / 100.0);
        bearing += 360.0 * gap / whole;
    }
    let between = |arm: usize| (bearings[(arm + 1) % n_arms] - bearings[arm]).rem_euclid(360.0);
    match (0..n_arms).all(|arm| keys.arms.least_gap_deg <= between(arm)) {
        true => Ok(bearings),
        false => Err(Reason::ArmsTooNear),
    }
}

/// The radius of a kerb that leaves the ring aside between an arm's entry and the next arm's exit, `gap` farther
/// counter-clockwise (rad), or `None` where no radius of the range does and fits (m).
fn corner_radius(
    keys: &Keys,
    draws: &Draws,
    ring: &Ring,
    arm: usize,
    entry: &Line,
    exit: &Line,
    gap: f64,
) -> Option<f64> {
    let mirrored = |p: DVec2| DVec2::from_angle(gap).rotate(p * DVec2::new(1.0, -1.0));
    let (from, ahead) = (entry.bends.last()?.at, entry.direction);
    let (after, back) = (mirrored(exit.bends.last()?.at), mirrored(exit.direction));
    let turn = ahead.perp_dot(back);
    let (reach, reach_back) = ((after - from).perp_dot(back) / turn, (after - from).perp_dot(ahead) / turn);
    let corner = from + reach * ahead;
    // The kerb turns right, by less than half a turn.
    let angle = ahead.angle_to(-back);
    if !(reach.is_finite() && 0.0 < reach && 0.0 < reach_back && -0.95 * PI < angle && angle < -0.05) {
        return None;
    }
    let half = -angle / 2.0;
    let fits = 0.98 * (reach - entry.tangent()).min(reach_back - exit.tangent()) / half.tan();
    let outside = (ring.outer - corner.length()) / (1.0 / half.cos() - 1.0);
    let [least, most] = *keys.corners.kerb_radius;
    let (least, most) = (least.max(outside), most.min(fits));
    (least < most).then(|| millimetres(draws.log_within(Place::Arm(arm), Q::CornerRadius, [least, most])))
}
