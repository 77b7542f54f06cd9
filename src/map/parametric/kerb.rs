//! The outline of a roundabout: a kerb from each arm to the next, arms closed at their ends, central and splitter
//! islands.

use std::f64::consts::TAU;

use glam::DVec2;

use super::alignment::{Fault, Way, around, ring_arc};
use super::faults::{self, Aligned, Part};
use super::ring::Ring;
use super::roundabout_keys::Arm;
use crate::files::reader::{Error, Reader, differing, shown};
use crate::geometry::{Curve, Outline, Piece, rounded, wrapped};
use crate::map::apron::crosses;
use crate::map::ground::Kerb;

/// The kerbs in the order of the loops that [`kerbs`] makes.
pub(super) fn order(arms: &[Arm]) -> impl Iterator<Item = Kerb> {
    let splitters =
        arms.iter().enumerate().filter(|(_, arm)| !arm.splitter.is_empty()).map(|(index, _)| Kerb::Splitter(index));
    [Kerb::Outer, Kerb::Island].into_iter().chain(splitters)
}

/// The kerb faces as an outline, and the kerbs from each arm to the next. Fails if they cross each other; without slack
/// (m) also where rounding finds that the last piece of a splitter island meets the first, whose joint it is: random
/// roads have been drawn so.
pub(super) fn kerbs(reader: &Reader, ring: &Ring, arms: &[Arm], slack: f64) -> Result<(Outline, Vec<Curve>), Error> {
    let corners: Vec<Curve> = (0..arms.len()).map(|arm| corner(reader, ring, arms, arm)).collect::<Result<_, _>>()?;
    corners_apart(reader, arms, &corners)?;
    let mut boundary = Curve::default();
    for (index, corner) in corners.iter().enumerate() {
        let next = &corners[(index + 1) % corners.len()];
        boundary.pieces.extend(&corner.pieces);
        // The arm's end, a solid edge from its exit kerb to its entry kerb.
        boundary.pieces.push(Piece::Segment { from: corner.point_at(f64::INFINITY), to: next.point_at(0.0) });
    }
    let mut loops = vec![boundary, Curve::circle(DVec2::ZERO, ring.island_radius)];
    for (index, arm) in arms.iter().enumerate().filter(|(_, arm)| !arm.splitter.is_empty()) {
        let island = rounded(&arm.splitter, true).map_err(|misfit| {
            faults::too_large(
                reader,
                &format!("arm[{index}].splitter[{}].radius", misfit.bend),
                arm.splitter[misfit.bend].radius,
                misfit.largest,
            )
        })?;
        let island = island.turned(arm.bearing);
        splitter_apart(reader, ring, (index, &island), &loops, slack)?;
        loops.push(island);
    }
    Ok((Outline::new(loops), corners))
}

/// The kerb from the end of an arm inwards, along the ring or across the corner, and out to the end of the next arm.
pub(super) fn corner(reader: &Reader, ring: &Ring, arms: &[Arm], index: usize) -> Result<Curve, Error> {
    let next_index = (index + 1) % arms.len();
    let (arm, next) = (&arms[index], &arms[next_index]);
    let (entry, exit) = (&arm.entry.kerb, &next.exit.kerb);
    let of = |arm: usize, way: Way| Aligned { arm, way, part: Part::Kerb };
    let failed = |of: Aligned| move |fault: Fault| faults::fault(reader, arms, of, fault);
    if let Some(radius) = arm.kerb_corner {
        let joined = around((entry, arm.bearing), (exit, next.bearing), radius);
        return joined.map_err(failed(of(index, Way::Entry)));
    }
    let circle = ring.outer();
    let (inward, arrival) = entry.lead(circle).map_err(failed(of(index, Way::Entry)))?;
    let (outward, leaving) = exit.lead(circle).map_err(failed(of(next_index, Way::Exit)))?;
    let between = (next.bearing - arm.bearing).rem_euclid(TAU);
    let sweep = between - leaving - arrival;
    if sweep < 0.0 {
        return Err(faults::no_room(reader, arms, index, sweep * circle));
    }
    if TAU < sweep {
        // The straight passes the ring by, and its arc comes to it from behind.
        let (arm, way) = if arrival <= leaving { (index, Way::Entry) } else { (next_index, Way::Exit) };
        return Err(failed(of(arm, way))(Fault::Ring));
    }
    let mut curve = Way::Entry.placed(&inward, arm.bearing);
    if 1e-9 < sweep {
        curve.pieces.push(ring_arc(circle, wrapped(arm.bearing + arrival), sweep));
    }
    curve.pieces.extend(Way::Exit.placed(&outward, next.bearing).reversed().pieces);
    Ok(curve)
}

/// No corner's kerb crosses itself or another corner's.
fn corners_apart(reader: &Reader, arms: &[Arm], corners: &[Curve]) -> Result<(), Error> {
    let n = corners.len();
    for first in 0..n {
        for second in first..n {
            let overlap = match first == second {
                true => crosses_itself(&corners[first], 0.0),
                false => crosses(&corners[first], &corners[second]),
            };
            if overlap {
                // Corner i lies between arms i and i + 1: neighbouring corners have the arm between them in common.
                let (a, b) = if first == second { (first, (first + 1) % n) } else { (first, second) };
                return Err(reader.invalid(
                    format!("arm[{b}]"),
                    format!("{:?}", arms[b].name),
                    format!("arms {} and {} overlap: their kerbs cross", arms[a].name, arms[b].name),
                ));
            }
        }
    }
    // The solid edges that end the arms must not cut into another arm.
    for (index, arm) in arms.iter().enumerate() {
        let (left, right) = (corners[index].point_at(0.0), corners[(index + n - 1) % n].point_at(f64::INFINITY));
        let end = Piece::Segment { from: right, to: left };
        let along = DVec2::from_angle(arm.bearing).perp();
        if (left - right).dot(along) <= 0.0 {
            return Err(reader.invalid(
                format!("arm[{index}].entry.kerb"),
                format!("{:?}", arm.name),
                "the entry's kerb must lie left of the exit's, seen from the ring",
            ));
        }
        let meets = |corner: &Curve| corner.pieces.iter().filter(|piece| !piece.meetings(&end).is_empty()).count();
        if let Some(other) =
            (0..n).find(|&corner| usize::from(corner == index || (corner + 1) % n == index) < meets(&corners[corner]))
        {
            let message = format!("arms {} and {} overlap: shorten one or move them apart", arm.name, arms[other].name);
            return Err(reader.invalid(format!("arm[{index}].length"), format_args!("{} m", arm.length), message));
        }
    }
    Ok(())
}

/// Whether a curve crosses itself other than at its joints, of which a closed one has one between its last piece and
/// its first where there is slack.
fn crosses_itself(curve: &Curve, slack: f64) -> bool {
    let n = curve.pieces.len();
    let joint = |index: usize, next: usize, p: DVec2| {
        let is_at = |end: DVec2| p.distance(end) < 1e-6;
        let closes = 0.0 < slack && index == 0 && next + 1 == n && is_at(curve.pieces[0].start());
        (index + 1 == next && is_at(curve.pieces[index].end())) || (closes && is_at(curve.pieces[next].end()))
    };
    curve.pieces.iter().enumerate().any(|(index, piece)| {
        let mut after = curve.pieces.iter().enumerate().skip(index + 1);
        after.any(|(next, there)| piece.meetings(there).into_iter().any(|p| !joint(index, next, p)))
    })
}

/// A splitter island lies outside the ring and does not meet the earlier loops.
fn splitter_apart(
    reader: &Reader,
    ring: &Ring,
    (arm, island): (usize, &Curve),
    loops: &[Curve],
    slack: f64,
) -> Result<(), Error> {
    let key = format!("arm[{arm}].splitter");
    let refused = |value: String, expected: &str| Err(reader.invalid(&key, value, expected));
    if crosses_itself(island, slack) {
        return refused("crosses itself".into(), "corners must go around the island once");
    }
    let (nearest, edge) = (island.distance(DVec2::ZERO), ring.outer() - ring.gutter);
    if nearest < edge {
        let value = format!("{} m from the ring's centre", differing(nearest, edge));
        return refused(value, &format!("must stay out of the ring: {} m", shown(edge)));
    }
    if loops.iter().any(|other| crosses(island, other)) || !Outline::new(loops.to_vec()).contains(island.point_at(0.0))
    {
        return refused("meets a kerb".into(), "must lie on the road, away from the kerbs and other islands");
    }
    Ok(())
}
