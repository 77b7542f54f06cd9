//! Draws one arm: its axis, its two carriageways with their kerbs and lanes, and its splitter island.

use glam::DVec2;

use super::Reason;
use super::distribution_keys::Keys;
use super::draws::{Draws, Place, Quantity as Q};
use super::line::{Line, millimetres};
use crate::geometry::Bend;
use crate::map::parametric::written::{WrittenPoint, WrittenWay};

/// Straight between two bends at least (m).
const BETWEEN: f64 = 1.0;
/// Part of the straight between the two bends of an S-bend by which they lengthen it at either end.
const S_TANGENT: f64 = 0.3;

/// Turn below which a splitter island has no corner (rad).
const LEAST_TURN: f64 = 0.04;

/// What all arms of a road have in common: lengths (m), and the ring's number of lanes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ring {
    pub(super) outer: f64,
    pub(super) lanes: usize,
    pub(super) ring_lane_width: f64,
    /// Width of the carriageways' lanes.
    pub(super) lane_width: f64,
    pub(super) gutter: f64,
}

/// One arm, in its own frame.
#[derive(Debug, Clone)]
pub(super) struct Arm {
    pub(super) length: f64,
    pub(super) entry: Carriageway,
    pub(super) exit: Carriageway,
}

/// One carriageway.
#[derive(Debug, Clone)]
pub(super) struct Carriageway {
    pub(super) kerb: Line,
    /// Number of lanes.
    n_lanes: usize,
    /// The carriageway's lanes from the kerb where they do not lie beside it; else none.
    lanes: Vec<Line>,
}

/// What both carriageways follow.
struct Course {
    /// Where the arm's axis lies beside the ring's centre, positive on the entry's side (m).
    beside: f64,
    /// Half the width between the carriageways (m).
    median: f64,
    /// The S-bend's two bends, in the arm's frame; the second begins the straight beside the ring.
    s_bend: Option<[DVec2; 2]>,
    /// Beyond the ring, nearer to it than any S-bend (m).
    room: f64,
}

impl Arm {
    pub(super) fn drawn(keys: &Keys, draws: &Draws, ring: &Ring, arm: usize) -> Result<Arm, Reason> {
        let place = Place::Arm(arm);
        let length = millimetres(ring.outer + draws.within(place, Q::Length, *keys.arms.length));
        let course = course(keys, draws, ring, arm);
        let way = |place: Place, side: f64| carriageway(keys, draws, ring, &course, arm, place, side, length);
        Ok(Arm { length, entry: way(Place::Entry(arm), 1.0)?, exit: way(Place::Exit(arm), -1.0)? })
    }

    /// The corners of a splitter island where the carriageways leave room for one.
    pub(super) fn splitter(&self, keys: &Keys, draws: &Draws, ring: &Ring, arm: usize) -> Vec<WrittenPoint> {
        const STEP: f64 = 0.25;
        let place = Place::Arm(arm);
        if !draws.happens(place, Q::HasSplitter, keys.splitters.share) {
            return Vec::new();
        }
        // Beyond the lanes and a gutter on either side.
        let inner = |way: &Carriageway| way.kerb.beside(2.0 * ring.gutter + way.n_lanes as f64 * ring.lane_width);
        let (Some(entry), Some(exit)) = (inner(&self.entry), inner(&self.exit)) else { return Vec::new() };
        let width = |x: f64| entry.y(x) + exit.y(x);
        let nose = ring.outer + 0.1;
        let steps = (0..).map(|step| nose + f64::from(step) * STEP);
        let wide = steps.take_while(|&x| x < ring.outer + keys.s_bend.end && keys.splitters.least_width <= width(x));
        let Some(tip) = wide.last().filter(|tip| nose + 2.0 <= *tip) else { return Vec::new() };
        let side = |line: &Line| -> Vec<DVec2> {
            let inner =
                line.bends.iter().map(|bend| bend.at).filter(|at| nose + BETWEEN < at.x && at.x < tip - BETWEEN);
            let mut points: Vec<DVec2> = inner.chain([nose, tip].map(|x| DVec2::new(x, line.y(x)))).collect();
            points.sort_by(|a, b| a.x.total_cmp(&b.x));
            points
        };
        let (left, right) = (side(&entry), side(&exit));
        let around: Vec<DVec2> =
            left.into_iter().chain(right.into_iter().rev().map(|at| DVec2::new(at.x, -at.y))).collect();
        let n = around.len();
        let turn = |index: usize| {
            let [before, here, after] = [index + n - 1, index, index + 1].map(|index| around[index % n]);
            (here - before).angle_to(after - here).abs()
        };
        // Corners that hardly turn would be arcs of millimetres.
        let corners = (0..n).filter(|&index| LEAST_TURN < turn(index)).map(|index| around[index]);
        let radius = millimetres(draws.within(place, Q::SplitterRadius, *keys.splitters.corner_radius));
        let corner =
            |at: DVec2| WrittenPoint { along: millimetres(at.x), offset: millimetres(at.y), radius: Some(radius) };
        corners.map(corner).collect()
    }
}

fn course(keys: &Keys, draws: &Draws, ring: &Ring, arm: usize) -> Course {
    let place = Place::Arm(arm);
    let beside = match draws.happens(place, Q::IsBeside, keys.axis.share) {
        true => draws.normal(place, Q::Beside) * keys.axis.deviation * ring.outer,
        false => 0.0,
    };
    let median = match draws.happens(place, Q::HasMedian, keys.median.share) {
        true => draws.within(place, Q::Median, *keys.median.half_width),
        false => 0.0,
    };
    let mut room = keys.s_bend.end - BETWEEN;
    let mut s_bend = None;
    if draws.happens(place, Q::HasSBend, keys.s_bend.share) {
        let shift = draws.within(place, Q::Shift, *keys.s_bend.shift);
        let side = if draws.happens(place, Q::ShiftSide, 0.5) { -1.0 } else { 1.0 };
        // The S-bend takes its length and its bends' tangents, and leaves room for the last bend.
        let longest = (keys.s_bend.end - keys.bend.before_ring[0] - 6.0) / (1.0 + 2.0 * S_TANGENT);
        let [least, most] = *keys.s_bend.length;
        if least < longest {
            let length = draws.within(place, Q::SBendLength, [least, most.min(longest)]);
            let outer = ring.outer + keys.s_bend.end - S_TANGENT * length - 2.0;
            let far = DVec2::new(outer, beside + side * shift);
            s_bend = Some([far, DVec2::new(outer - length, beside)]);
            room = outer - length - S_TANGENT * length - ring.outer - 2.0;
        }
    }
    Course { beside, median, s_bend, room }
}

#[expect(clippy::too_many_arguments, reason = "a carriageway has no other home for them")]
fn carriageway(
    keys: &Keys,
    draws: &Draws,
    ring: &Ring,
    course: &Course,
    arm: usize,
    place: Place,
    side: f64,
    length: f64,
) -> Result<Carriageway, Reason> {
    let n_lanes = if ring.lanes == 1 || draws.happens(place, Q::IsSingle, keys.lanes.single_share) { 1 } else { 2 };
    let half_width = n_lanes as f64 * ring.lane_width
        + ring.gutter
        + course.median
        + keys.kerb.deviation * draws.normal(place, Q::KerbOffset);
    let beside = side * course.beside;
    let mut bends = Vec::new();
    let bend = |x: f64, y: f64, radius: f64| Bend { at: DVec2::new(x, y), radius };
    match course.s_bend {
        None => bends.push(bend(length, beside + half_width, 0.0)),
        Some([far, near]) => {
            let tangent = S_TANGENT * far.distance(near);
            let half = ((far.y - near.y) / (far.x - near.x)).atan().abs() / 2.0;
            let radius = (tangent / half.tan()).min(900.0);
            let axis = [
                bend(length, side * far.y, 0.0),
                bend(far.x, side * far.y, radius),
                bend(near.x, side * near.y, radius),
            ];
            let axis = Line { bends: axis.to_vec(), direction: DVec2::NEG_X, ring_radius: half_width + 1.0 };
            bends.extend(axis.beside(-half_width).ok_or(Reason::TooSharp)?.bends);
        }
    }
    let [nearest, farthest] = *keys.bend.before_ring;
    let before_ring = draws.within(place, Q::BeforeRing, [nearest, farthest.min(course.room).max(nearest)]);
    let last = ring.outer + before_ring;
    let mut y = beside + half_width;
    if draws.happens(Place::Arm(arm), Q::IsWidened, keys.widening.share) {
        let [least, most] = *keys.widening.length;
        let most = most.min(course.room - before_ring - BETWEEN);
        if least <= most {
            let length = draws.within(Place::Arm(arm), Q::WideningLength, [least, most]);
            bends.push(bend(last + length, y, draws.within(place, Q::WideningRadius, *keys.bend.radius)));
            y += draws.within(Place::Arm(arm), Q::Widening, *keys.widening.width);
        }
    }
    bends.push(bend(last, y, draws.within(place, Q::BendRadius, *keys.bend.radius)));
    let from = DVec2::new(last, y);
    let (angle, [least, most]) = if draws.happens(place, Q::IsStraight, keys.straight.share) {
        let angle = keys.straight.angle_deg + keys.straight.angle_deviation_deg * draws.normal(place, Q::Angle);
        (angle.to_radians(), *keys.straight.kerb_arc)
    } else {
        // The angle at which the straight passes the ring's centre at the distance drawn.
        let passes = ring.outer * draws.within(place, Q::Aim, *keys.flared.aim);
        ((passes / from.length()).min(1.0).asin() - from.to_angle(), *keys.flared.kerb_arc)
    };
    let direction = DVec2::new(-angle.cos(), angle.sin());
    let mut kerb = Line { bends, direction, ring_radius: least };
    kerb.ring_radius = draws.log_within(place, Q::KerbArc, [least, most.min(kerb.widest_arc(ring.outer)).max(least)]);
    kerb.fit(ring.outer)?;
    let mut lanes = Vec::new();
    if draws.happens(place, Q::HasLanes, keys.lanes.share) {
        for (from_kerb, offset, radius) in
            [(0.0, Q::RightOffset, Q::RightRadius), (1.0, Q::LeftOffset, Q::LeftRadius)].into_iter().take(n_lanes)
        {
            let distance = ring.gutter + (from_kerb + 0.5) * ring.lane_width;
            let distance = distance + keys.lanes.deviation * (2.0 * draws.unit(place, offset) - 1.0);
            let mut lane = kerb.beside(distance).ok_or(Reason::TooSharp)?;
            let [least, most] = keys.lanes.ring_radius.map(|factor| factor * lane.ring_radius);
            let circle = ring.outer - ring.gutter - (from_kerb + 0.5) * ring.ring_lane_width;
            lane.ring_radius = draws.log_within(place, radius, [least, most.min(lane.widest_arc(circle)).max(least)]);
            lane.fit(circle)?;
            lanes.push(lane);
        }
    }
    Ok(Carriageway { kerb, n_lanes, lanes })
}

impl Carriageway {
    /// The carriageway as a file has it. `side` is 1 for an entry, -1 for an exit.
    pub(super) fn written(&self, side: f64, ring: &Ring) -> WrittenWay {
        let lane = |from_kerb: usize| self.lanes.get(from_kerb).map(|lane| lane.written(side));
        let lanes = (self.n_lanes != ring.lanes.min(2)).then_some(self.n_lanes);
        WrittenWay { lanes, kerb: self.kerb.written(side), right: lane(0), left: lane(1) }
    }
}
