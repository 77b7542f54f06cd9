//! Faults between the parts of a roundabout: arcs that do not fit, kerbs that cross, lanes that meet a kerb or each
//! other.

use std::fmt::{Display, Formatter};

use glam::DVec2;

use super::alignment::{Fault, Way};
use super::lane::Lanes;
use super::ring::Ring;
use super::roundabout_keys::Arm;
use crate::files::reader::{Error, Reader, differing, shown};
use crate::geometry::{Curve, Outline};
use crate::map::route::Lane;

/// Half the width of a truck and 5 cm: a lane whose centre line is nearer to a kerb cannot be driven (m).
const NEAREST: f64 = 1.3;
/// Width of a truck: two lanes whose centre lines are nearer to each other cannot both be driven (m).
const LANES_APART: f64 = 2.5;

/// A rounding arc that does not fit between its neighbours.
pub(super) fn too_large(reader: &Reader, key: &str, radius: f64, largest: f64) -> Error {
    // Rounded down to centimetres, so that the radius in the message does fit.
    let largest = (largest * 100.0).floor() / 100.0;
    reader.invalid(
        key,
        format_args!("{} m", shown(radius)),
        format!("does not fit between its neighbours: at most {} m", shown(largest)),
    )
}

/// An alignment that gives no curve. `corner` is the key of the arc between this arm and the next, if there is one.
pub(super) fn fault(
    reader: &Reader,
    arms: &[Arm],
    arm: usize,
    corner: Option<&str>,
    part: &str,
    way: Way,
    fault: Fault,
) -> Error {
    let next = (arm + 1) % arms.len();
    let alignment = |arm: usize, way: Way| {
        let carriageway = arms[arm].way(way);
        match part {
            "left" => carriageway.lane(Lane::Left),
            "right" => carriageway.lane(Lane::Right),
            _ => &carriageway.kerb,
        }
    };
    let point = |arm: usize, way: Way, point: usize, largest: f64| {
        let key = format!("arm[{arm}].{}.{part}.points[{point}].radius", way.name());
        too_large(reader, &key, alignment(arm, way).bends[point + 1].radius, largest)
    };
    let corner_key = format!("arm[{arm}].{}", corner.unwrap_or("corner"));
    let corner_radius = if part == "kerb" { arms[arm].kerb_corner } else { arms[arm].lane_corner }.unwrap_or_default();
    match fault {
        Fault::Point(index, largest) => point(arm, way, index, largest),
        Fault::NextPoint(index, largest) => point(next, Way::Exit, index, largest),
        Fault::Corner(largest) => too_large(reader, &corner_key, corner_radius, largest),
        Fault::Apart => reader.invalid(
            corner_key,
            format_args!("{} m", shown(corner_radius)),
            format!("the last straights of {} and {} do not meet ahead of both", arms[arm].name, arms[next].name),
        ),
        Fault::Ring => reader.invalid(
            format!("arm[{arm}].{}.{part}.ring_radius", way.name()),
            format_args!("{} m", shown(alignment(arm, way).ring_radius)),
            "no such arc leads the last straight into the ring after the last point: aim nearer to the centre or change the radius",
        ),
    }
}

/// An exit's only lane that routes from left lanes cannot reach from their ring lane, of radius `circle` (m).
pub(super) fn no_merge(reader: &Reader, arms: &[Arm], arm: usize, circle: f64) -> Error {
    reader.invalid(
        format!("arm[{arm}].exit.right.ring_radius"),
        format_args!("{} m", shown(arms[arm].exit.lane(Lane::Right).ring_radius)),
        format!(
            "left lanes lead here by the ring lane of {} m, and no such arc joins it to the last straight of an exit of one lane: aim \
             nearer to the centre, change the radius, or give the exit two lanes",
            shown(circle)
        ),
    )
}

/// Two arms that overlap: `length` of ring is left between their kerbs, a negative length (m).
pub(super) fn no_room(reader: &Reader, arms: &[Arm], arm: usize, length: f64) -> Error {
    let next = &arms[(arm + 1) % arms.len()];
    reader.invalid(
        format!("arm[{arm}].entry.kerb"),
        format_args!("{} m of ring left before {}", differing(length, 0.0), next.name),
        format!(
            "arms {} and {} overlap: move them apart, or join their kerbs with corner.kerb_radius",
            arms[arm].name, next.name
        ),
    )
}

/// A route that would have to leave the ring before it arrives there.
pub(super) fn backwards(reader: &Reader, arms: &[Arm], entry: usize, lane: Lane, exit: u32, length: f64) -> Error {
    let to = &arms[(entry + exit as usize) % arms.len()].name;
    reader.invalid(
        format!("arm[{entry}].entry.{}", lane.name()),
        format_args!("{} m of ring on the way to {to}", differing(length, 0.0)),
        "must lie between 0 and a whole turn: change ring_radius, or give corner.lane_radius if it is the right lane's first exit",
    )
}

/// A kerb between two arms that turns too sharply for a lane beside it.
pub(super) fn no_way_beside(reader: &Reader, arms: &[Arm], arm: usize) -> Error {
    let next = &arms[(arm + 1) % arms.len()];
    let expected = format!(
        "the kerb from {} to {} turns too sharply for a lane beside it: give the lane's radius",
        arms[arm].name, next.name
    );
    reader.invalid(format!("arm[{arm}].corner.lane_radius"), "missing", expected)
}

/// A kerb between two arms with lanes of different widths: no lane lies beside it all along.
pub(super) fn widths_differ(reader: &Reader, arms: &[Arm], arm: usize) -> Error {
    let next = &arms[(arm + 1) % arms.len()];
    let expected = format!(
        "lanes are {} m wide on {} and {} m on {}: give the radius of the lane between them",
        shown(arms[arm].lane_width),
        arms[arm].name,
        shown(next.lane_width),
        next.name
    );
    reader.invalid(format!("arm[{arm}].corner.lane_radius"), "missing", expected)
}

/// No corner's kerb crosses itself or another corner's.
pub(super) fn corners_apart(reader: &Reader, arms: &[Arm], corners: &[Curve]) -> Result<(), Error> {
    let n = corners.len();
    for first in 0..n {
        for second in first..n {
            if cross(&corners[first], (first != second).then_some(&corners[second])) {
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
        let end = crate::geometry::Piece::Segment { from: right, to: left };
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

/// Whether two curves cross or, without a second, whether the first crosses itself other than at its joints.
fn cross(curve: &Curve, other: Option<&Curve>) -> bool {
    let joint = |index: usize, p: DVec2| p.distance(curve.pieces[index].end()) < 1e-6;
    (0..curve.pieces.len()).any(|index| {
        let piece = &curve.pieces[index];
        match other {
            Some(other) => other.pieces.iter().any(|there| !piece.meetings(there).is_empty()),
            None => {
                let after = curve.pieces.iter().enumerate().skip(index + 1);
                after.into_iter().any(|(next, there)| {
                    piece.meetings(there).into_iter().any(|p| index + 1 != next || !joint(index, p))
                })
            }
        }
    })
}

/// A splitter island lies outside the ring and does not meet the earlier loops.
pub(super) fn splitter(reader: &Reader, ring: &Ring, arm: usize, island: &Curve, loops: &[Curve]) -> Result<(), Error> {
    let key = format!("arm[{arm}].splitter");
    let refused = |value: String, expected: &str| Err(reader.invalid(&key, value, expected));
    if cross(island, None) {
        return refused("crosses itself".into(), "corners must go around the island once");
    }
    let (nearest, edge) = (island.distance(DVec2::ZERO), ring.outer() - ring.gutter);
    if nearest < edge {
        let value = format!("{} m from the ring's centre", differing(nearest, edge));
        return refused(value, &format!("must stay out of the ring: {} m", shown(edge)));
    }
    if loops.iter().any(|other| cross(island, Some(other)))
        || !Outline::new(loops.to_vec()).contains(island.point_at(0.0))
    {
        return refused("meets a kerb".into(), "must lie on the road, away from the kerbs and other islands");
    }
    Ok(())
}

/// Every lane keeps half a truck's width from every kerb, splitters included.
pub(super) fn lanes_clear_of_kerbs(reader: &Reader, kerbs: &Outline, arms: &[Arm], lanes: &Lanes) -> Result<(), Error> {
    for index in 0..arms.len() {
        for way in [Way::Entry, Way::Exit] {
            for (lane, curve) in lanes.of(index, way).rev() {
                clear(reader, kerbs, curve, &format!("arm[{index}].{}.{}", way.name(), lane.name()))?;
            }
        }
        if let Some(curve) = lanes.merge(index) {
            clear(reader, kerbs, curve, &format!("arm[{index}].exit.right"))?;
        }
        if let Some(curve) = lanes.first_exit(index) {
            clear(reader, kerbs, curve, &format!("arm[{index}].corner.lane_radius"))?;
        }
    }
    Ok(())
}

/// The lanes of an arm lie beside each other from the arm's end to the ring; those that enter lie left of those that
/// leave, seen from the ring.
///
/// At the arm's end, where all lanes are parallel, their order is checked. Beyond, no two may come nearer than
/// [`LANES_APART`], so none crosses another.
pub(super) fn lanes_beside_each_other(reader: &Reader, arms: &[Arm], lanes: &Lanes) -> Result<(), Error> {
    for (index, arm) in arms.iter().enumerate() {
        let named = |way: Way| move |(lane, curve)| Beside { way, lane, curve };
        let entries = lanes.of(index, Way::Entry).map(named(Way::Entry));
        let mut from_left: Vec<Beside> =
            entries.chain(lanes.of(index, Way::Exit).rev().map(named(Way::Exit))).collect();
        let left = DVec2::from_angle(arm.bearing).perp();
        let offset =
            |lane: &Beside| lane.curve.point_at(if lane.way == Way::Entry { 0.0 } else { f64::INFINITY }).dot(left);
        for pair in from_left.windows(2) {
            if offset(&pair[0]) - offset(&pair[1]) < LANES_APART {
                return Err(reader.invalid(
                    format!("arm[{index}].{}", pair[0]),
                    format_args!("{:.2} m left of the bearing at the arm's end", offset(&pair[0])),
                    format!(
                        "must lie at least {LANES_APART} m left of {}, which is at {:.2} m: move the kerbs apart, or give the lanes' points",
                        pair[1],
                        offset(&pair[1])
                    ),
                ));
            }
        }
        let n_lanes = from_left.len();
        from_left.extend(lanes.merge(index).map(|curve| Beside { way: Way::Exit, lane: Lane::Right, curve }));
        for (first, one) in from_left.iter().enumerate() {
            // The way of left routes into an exit's only lane joins that lane.
            let until = if one.way == Way::Entry { from_left.len() } else { n_lanes };
            for other in &from_left[(first + 1).min(until)..until] {
                let distance = |p: DVec2| other.curve.distance(p);
                if let Some(p) = nearer(one.curve, 0.0, f64::INFINITY, LANES_APART, distance) {
                    return Err(reader.invalid(
                        format!("arm[{index}].{one}"),
                        format_args!(
                            "{} m from {other} at ({:.1}, {:.1})",
                            differing(distance(p), LANES_APART),
                            p.x,
                            p.y
                        ),
                        format!("the centre lines of an arm's lanes must keep {LANES_APART} m from each other"),
                    ));
                }
            }
        }
    }
    Ok(())
}

/// A lane of an arm; shown as its key, `entry.left`.
struct Beside<'a> {
    way: Way,
    lane: Lane,
    curve: &'a Curve,
}

impl Display for Beside<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}", self.way.name(), self.lane.name())
    }
}

/// The first of the points every 25 cm along a curve, from station `from` to `to`, at which `distance` is below
/// `limit`. `distance` is to something that does not move, so it changes by at most a metre a metre: stations that
/// cannot be nearer than `limit` are left out (m).
fn nearer(curve: &Curve, from: f64, to: f64, limit: f64, distance: impl Fn(DVec2) -> f64) -> Option<DVec2> {
    const STEP: f64 = 0.25;
    let last = (curve.length() / STEP) as usize;
    let mut step = (from.max(0.0) / STEP).floor() as usize;
    while step <= last && step as f64 * STEP < to {
        let p = curve.point_at(step as f64 * STEP);
        if step as f64 * STEP < from {
            step += 1;
            continue;
        }
        let distance = distance(p);
        if distance < limit {
            return Some(p);
        }
        // A micrometre for rounding.
        step += (((distance - limit - 1e-6) / STEP).floor().max(0.0) as usize).max(1);
    }
    None
}

fn clear(reader: &Reader, kerbs: &Outline, curve: &Curve, key: &str) -> Result<(), Error> {
    // An arm's end is a solid edge that every lane meets.
    let (from, to) = (2.0 * NEAREST, curve.length() - 2.0 * NEAREST);
    match nearer(curve, from, to, NEAREST, |p| kerbs.signed_distance(p)) {
        None => Ok(()),
        Some(p) => Err(reader.invalid(
            key,
            format_args!("{} m from a kerb at ({:.1}, {:.1})", differing(kerbs.signed_distance(p), NEAREST), p.x, p.y),
            format!("a lane's centre line must keep {NEAREST} m from every kerb and splitter island"),
        )),
    }
}
