//! The outline of a roundabout: a kerb from each arm to the next, arms closed at their ends, central and splitter
//! islands.

use std::f64::consts::TAU;

use glam::DVec2;

use super::alignment::{Way, around, ring_arc};
use super::check;
use super::ring::Ring;
use super::roundabout_keys::Arm;
use crate::files::reader::{Error, Reader};
use crate::geometry::{Curve, Outline, Piece, rounded, wrapped};
use crate::map::ground::Kerb;

/// The kerbs in the order of the loops that [`kerbs`] makes.
pub(super) fn order(arms: &[Arm]) -> impl Iterator<Item = Kerb> {
    let splitters =
        arms.iter().enumerate().filter(|(_, arm)| !arm.splitter.is_empty()).map(|(index, _)| Kerb::Splitter(index));
    [Kerb::Outer, Kerb::Island].into_iter().chain(splitters)
}

/// The kerb faces as an outline, and the kerbs from each arm to the next. Fails if they cross each other.
pub(super) fn kerbs(reader: &Reader, ring: &Ring, arms: &[Arm]) -> Result<(Outline, Vec<Curve>), Error> {
    let corners: Vec<Curve> = (0..arms.len()).map(|arm| corner(reader, ring, arms, arm)).collect::<Result<_, _>>()?;
    check::corners_apart(reader, arms, &corners)?;
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
            check::too_large(
                reader,
                &format!("arm[{index}].splitter[{}].radius", misfit.bend),
                arm.splitter[misfit.bend].radius,
                misfit.largest,
            )
        })?;
        let island = island.turned(arm.bearing);
        check::splitter(reader, ring, index, &island, &loops)?;
        loops.push(island);
    }
    Ok((Outline::new(loops), corners))
}

/// The kerb from the end of an arm inwards, along the ring or across the corner, and out to the end of the next arm.
pub(super) fn corner(reader: &Reader, ring: &Ring, arms: &[Arm], index: usize) -> Result<Curve, Error> {
    let next_index = (index + 1) % arms.len();
    let (arm, next) = (&arms[index], &arms[next_index]);
    let (entry, exit) = (&arm.entry.kerb, &next.exit.kerb);
    if let Some(radius) = arm.kerb_corner {
        let fault = |fault| check::fault(reader, arms, index, Some("corner.kerb_radius"), "kerb", Way::Entry, fault);
        return around((entry, arm.bearing), (exit, next.bearing), radius).map_err(fault);
    }
    let circle = ring.outer();
    let (inward, arrival) =
        entry.lead(circle).map_err(|fault| check::fault(reader, arms, index, None, "kerb", Way::Entry, fault))?;
    let (outward, leaving) =
        exit.lead(circle).map_err(|fault| check::fault(reader, arms, next_index, None, "kerb", Way::Exit, fault))?;
    let between = (next.bearing - arm.bearing).rem_euclid(TAU);
    let sweep = between - leaving - arrival;
    if !(0.0..=TAU).contains(&sweep) {
        return Err(check::no_room(reader, arms, index, sweep * circle));
    }
    let mut curve = Way::Entry.placed(&inward, arm.bearing);
    if 1e-9 < sweep {
        curve.pieces.push(ring_arc(circle, wrapped(arm.bearing + arrival), sweep));
    }
    curve.pieces.extend(Way::Exit.placed(&outward, next.bearing).reversed().pieces);
    Ok(curve)
}
