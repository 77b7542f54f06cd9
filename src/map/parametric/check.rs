//! Lanes that meet a kerb or each other.

use std::fmt::{Display, Formatter};

use glam::DVec2;

use super::alignment::Way;
use super::lane::Lanes;
use super::roundabout_keys::Arm;
use crate::files::reader::{Error, Reader, differing};
use crate::geometry::{Curve, Outline};
use crate::map::route::Lane;

/// Half the width of a truck and 5 cm: a lane whose centre line is nearer to a kerb cannot be driven (m).
const NEAREST: f64 = 1.3;
/// Width of a truck: two lanes whose centre lines are nearer to each other cannot both be driven (m).
const LANES_APART: f64 = 2.5;

/// Every lane keeps half a truck's width from every kerb, splitters included.
pub(super) fn lanes_clear_of_kerbs(
    reader: &Reader,
    kerbs: &Outline,
    arms: &[Arm],
    lanes: &Lanes,
    slack: f64,
) -> Result<(), Error> {
    let clear = |curve: &Curve, key: &str| clear(reader, kerbs, curve, key, slack);
    for index in 0..arms.len() {
        for way in [Way::Entry, Way::Exit] {
            for (lane, curve) in lanes.of(index, way).rev() {
                clear(curve, &format!("arm[{index}].{}.{}", way.name(), lane.name()))?;
            }
        }
        if let Some(curve) = lanes.merge(index) {
            clear(curve, &format!("arm[{index}].exit.right"))?;
        }
        if let Some(curve) = lanes.first_exit(index) {
            clear(curve, &format!("arm[{index}].corner.lane_radius"))?;
        }
    }
    Ok(())
}

/// The lanes of an arm lie beside each other from the arm's end to the ring; those that enter lie left of those that
/// leave, seen from the ring.
///
/// At the arm's end, where all lanes are parallel, their order is checked. Beyond, no two may come nearer than
/// [`LANES_APART`], so none crosses another.
pub(super) fn lanes_beside_each_other(reader: &Reader, arms: &[Arm], lanes: &Lanes, slack: f64) -> Result<(), Error> {
    for (index, arm) in arms.iter().enumerate() {
        let named = |way: Way| move |(lane, curve)| Beside { way, lane, curve };
        let entries = lanes.of(index, Way::Entry).map(named(Way::Entry));
        let mut from_left: Vec<Beside> =
            entries.chain(lanes.of(index, Way::Exit).rev().map(named(Way::Exit))).collect();
        let left = DVec2::from_angle(arm.bearing).perp();
        let offset =
            |lane: &Beside| lane.curve.point_at(if lane.way == Way::Entry { 0.0 } else { f64::INFINITY }).dot(left);
        for pair in from_left.windows(2) {
            if offset(&pair[0]) - offset(&pair[1]) < LANES_APART - slack {
                return Err(reader.invalid(
                    format!("arm[{index}].{}", pair[0]),
                    format_args!("{:.2} m left of the bearing at the arm's end", offset(&pair[0])),
                    format!(
                        "must lie at least {LANES_APART} m left of {}, which is at {:.2} m: move the kerbs apart, or \
                         give the lanes' points",
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
                if let Some(p) = nearer(one.curve, 0.0, f64::INFINITY, LANES_APART - slack, distance) {
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

fn clear(reader: &Reader, kerbs: &Outline, curve: &Curve, key: &str, slack: f64) -> Result<(), Error> {
    // An arm's end is a solid edge that every lane meets.
    let (from, to) = (2.0 * NEAREST, curve.length() - 2.0 * NEAREST);
    match nearer(curve, from, to, NEAREST - slack, |p| kerbs.signed_distance(p)) {
        None => Ok(()),
        Some(p) => Err(reader.invalid(
            key,
            format_args!("{} m from a kerb at ({:.1}, {:.1})", differing(kerbs.signed_distance(p), NEAREST), p.x, p.y),
            format!("a lane's centre line must keep {NEAREST} m from every kerb and splitter island"),
        )),
    }
}
