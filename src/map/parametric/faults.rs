//! Faults of a roundabout as errors: arcs that do not fit, arms that overlap, lanes that lead nowhere.

use super::alignment::{Fault, Way};
use super::roundabout_keys::Arm;
use crate::files::reader::{Error, Reader, differing, shown};
use crate::map::route::Lane;

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

/// What of a carriageway is aligned.
#[derive(Clone, Copy)]
pub(super) enum Part {
    Kerb,
    Lane(Lane),
}

impl Part {
    fn name(self) -> &'static str {
        match self {
            Part::Kerb => "kerb",
            Part::Lane(lane) => lane.name(),
        }
    }
}

/// An alignment: a part of an arm's entry or exit.
#[derive(Clone, Copy)]
pub(super) struct Aligned {
    pub(super) arm: usize,
    pub(super) way: Way,
    pub(super) part: Part,
}

/// An alignment that gives no curve.
pub(super) fn fault(reader: &Reader, arms: &[Arm], Aligned { arm, way, part }: Aligned, fault: Fault) -> Error {
    let next = (arm + 1) % arms.len();
    let alignment = |arm: usize, way: Way| match part {
        Part::Kerb => &arms[arm].way(way).kerb,
        Part::Lane(lane) => arms[arm].way(way).lane(lane),
    };
    let name = part.name();
    let point = |arm: usize, way: Way, point: usize, largest: f64| {
        let key = format!("arm[{arm}].{}.{name}.points[{point}].radius", way.name());
        too_large(reader, &key, alignment(arm, way).bends[point + 1].radius, largest)
    };
    let (corner, corner_radius) = match part {
        Part::Kerb => ("kerb_radius", arms[arm].kerb_corner),
        Part::Lane(_) => ("lane_radius", arms[arm].lane_corner),
    };
    let (corner_key, corner_radius) = (format!("arm[{arm}].corner.{corner}"), corner_radius.unwrap_or_default());
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
            format!("arm[{arm}].{}.{name}.ring_radius", way.name()),
            format_args!("{} m", shown(alignment(arm, way).ring_radius)),
            "no such arc leads the last straight into the ring after the last point: aim nearer to the centre or \
             change the radius",
        ),
    }
}

/// An exit's only lane that routes from left lanes cannot reach from their ring lane, of radius `circle` (m).
pub(super) fn no_merge(reader: &Reader, arms: &[Arm], arm: usize, circle: f64) -> Error {
    reader.invalid(
        format!("arm[{arm}].exit.right.ring_radius"),
        format_args!("{} m", shown(arms[arm].exit.lane(Lane::Right).ring_radius)),
        format!(
            "left lanes lead here by the ring lane of {} m, and no such arc joins it to the last straight of an exit \
             of one lane: aim nearer to the centre, change the radius, or give the exit two lanes",
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
        "must lie between 0 and a whole turn: change ring_radius, or give corner.lane_radius if it is the right \
         lane's first exit",
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
