//! What cars do about the ground that a truck covers, or will: they follow what is in their corridor, slow for what
//! will be there, and brake for what they would touch.

use glam::Vec2;
use multiversion::multiversion;

use super::contact::LONGER_THAN_CAR;
use super::view::View;
use crate::layout::shared::constants;
use crate::traffic::car::Outline;
use crate::traffic::decide::Driver;
use crate::traffic::model::ONE;
use crate::traffic::network::SPACING;
use crate::traffic::units::length;
use crate::traffic::{Car, Network, Sample};

constants! {
    /// Samples of a path that are a car's corridor, from the one behind its front on.
    const CORRIDOR_SAMPLES: usize = 16;
    /// Room beside a car to what is in its corridor now (m).
    const CORRIDOR_ROOM: f32 = 0.7;
    /// The same beside its front itself (m).
    const ROOM_AT_FRONT: f32 = 0.4;
    /// The same to what will be in its corridor (m).
    const ROOM_LATER: f32 = 0.5;
    /// What is at a sample may begin half a spacing before it (m).
    const BEFORE_SAMPLE: f32 = 0.5 * SPACING;
    /// A car that can wait does so for what begins so far behind its line (2^-10 m).
    const BEHIND_LINE: i32 = length(2.0);
    /// Interaction of the hardest braking, 8 m/s².
    const BRAKES_HARDEST: i32 = 5 * ONE;
    /// That of 3 m/s² at low speed, with which a car slows at most for what will be.
    const BRAKES_GENTLY: i32 = ONE + 3 * ONE / 2;
    /// A unit this near to a car's front may be touched soon (m).
    const NEAR_UNIT: f32 = 8.0;
    /// Steps in which a car foresees its own way.
    const CAR_STEPS_AHEAD: i32 = 4;
    /// It does so 0.3 m farther (2^-20 m).
    const MORE_AHEAD: i32 = 314_573;
    /// Room that it keeps then (m).
    const LEAST_ROOM: f32 = 0.15;
}

/// Length of a corridor, and of the first part of a path that must be free where a car enters (m).
const REACH: f32 = CORRIDOR_SAMPLES as f32 * SPACING;

/// Points side by side, so that all are measured at once.
struct Points {
    x: [f32; CORRIDOR_SAMPLES],
    y: [f32; CORRIDOR_SAMPLES],
    /// Half the width that the car needs there (m).
    half_widths: [f32; CORRIDOR_SAMPLES],
}

impl Points {
    /// Points of the samples of a car's path from one on; of those that there are not, points that are near nothing.
    /// Those of a large vehicle are in the middle of what it sweeps.
    fn of(network: &Network, car: &Car, first: usize, samples: &[Sample]) -> Points {
        let (nowhere, half_widths) = ([1e9; CORRIDOR_SAMPLES], [car.half_width(); CORRIDOR_SAMPLES]);
        let mut points = Points { x: nowhere, y: nowhere, half_widths };
        for (index, sample) in samples.iter().take(CORRIDOR_SAMPLES).enumerate() {
            let mut position = sample.position;
            if let Some(kind) = car.large() {
                let (left, half_width) = network.band(car.path(), first + index, kind);
                position += left * sample.direction.perp();
                points.half_widths[index] = half_width;
            }
            (points.x[index], points.y[index]) = position.into();
        }
        points
    }

    /// The first of `n` points that something is nearer to than there is room, by its squared distance from each (m²);
    /// beside the car there is room of at most `most` (m).
    fn first_within(
        &self,
        squared: &[f32; CORRIDOR_SAMPLES],
        n: usize,
        most: f32,
        room: impl Fn(usize) -> f32,
    ) -> Option<usize> {
        // Most corridors are free, which is told without a branch.
        let mut is_any = false;
        for (squared, half_width) in squared.iter().zip(&self.half_widths) {
            let room = half_width + most;
            is_any |= *squared < room * room;
        }
        if !is_any {
            return None;
        }
        (0..n).find(|&index| squared[index] < room(index) * room(index))
    }
}

/// Squared distance of each point to the nearest of some rectangles, 0 inside them (m²), but for those that the
/// corridor, which begins at a point, cannot reach.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn to_nearest(points: &Points, outlines: &[Outline], begins: Vec2) -> [f32; CORRIDOR_SAMPLES] {
    let mut nearest = [f32::MAX; CORRIDOR_SAMPLES];
    for unit in outlines.iter().filter(|unit| is_in_reach(unit, begins)) {
        let Outline { middle, along, half_length, half_width } = unit;
        for (nearest, (x, y)) in nearest.iter_mut().zip(points.x.iter().zip(&points.y)) {
            let (x, y) = (x - middle.x, y - middle.y);
            let ahead = ((x * along.x + y * along.y).abs() - half_length).max(0.0);
            let aside = ((y * along.x - x * along.y).abs() - half_width).max(0.0);
            *nearest = nearest.min(ahead * ahead + aside * aside);
        }
    }
    nearest
}

/// Whether the corridor that begins at a point may reach a rectangle.
#[inline(always)]
fn is_in_reach(outline: &Outline, begins: Vec2) -> bool {
    let reach = REACH + outline.half_length + outline.half_width;
    outline.middle.distance_squared(begins) <= reach * reach
}

fn reaches(outlines: &[Outline], begins: Vec2) -> bool {
    outlines.iter().any(|outline| is_in_reach(outline, begins))
}

/// Takes the ground that a truck covers into account.
pub(super) fn mind(view: &View, driver: &mut Driver) {
    let car = *driver.car();
    let network = driver.network();
    let (first, at_front) = (first(network, &car), front(network, &car));
    if is_far(view, at_front) {
        return;
    }
    if !reaches(&view.now, at_front) && (view.waits || !reaches(&view.later, at_front)) {
        // Then no unit is near its front either.
        return;
    }
    let samples = corridor(network, &car, first);
    let points = Points::of(network, &car, first, samples);
    let station = |index: usize| (first + index) as f32 * SPACING;
    let beside = |index: usize| if station(index) < car.station() { ROOM_AT_FRONT } else { CORRIDOR_ROOM };
    let room = |index: usize| points.half_widths[index] + beside(index);
    let now = to_nearest(&points, &view.now, at_front);
    let leader = points.first_within(&now, samples.len(), CORRIDOR_ROOM, room);
    if let Some(index) = leader {
        let rear = length(station(index) - BEFORE_SAMPLE);
        let speed = view.speed_along(&samples[index]);
        let (me, gap) = (driver.me, rear - driver.me.station);
        if me.waits && me.line + BEHIND_LINE < rear {
            driver.stop_or_follow(me.line - me.station, gap, speed);
        } else {
            driver.follow(gap, speed);
        }
        driver.note_leader(rear, speed);
    }
    if !view.waits && !car.is_rude() {
        let later = to_nearest(&points, &view.later, at_front);
        let room = |index: usize| points.half_widths[index] + ROOM_LATER;
        let before = leader.unwrap_or(samples.len());
        if let Some(index) = points.first_within(&later, before, ROOM_LATER, room) {
            slow(view, driver, length(station(index) - BEFORE_SAMPLE));
        }
    }
    if touches_soon(view, network, &car, at_front) {
        driver.heed(BRAKES_HARDEST);
    }
}

/// Slows for a truck that will be at a station of the car's path, or waits (2^-10 m).
fn slow(view: &View, driver: &mut Driver, rear: i32) {
    let me = driver.me;
    if me.waits && me.line < rear {
        driver.wait_at_line();
    } else {
        driver.heed(driver.behind(rear - me.station, view.speed / 2).min(BRAKES_GENTLY));
    }
}

/// Whether a car is about to touch a truck, with its front near a point.
fn touches_soon(view: &View, network: &Network, car: &Car, front: Vec2) -> bool {
    let near = NEAR_UNIT + if car.is_large() { LONGER_THAN_CAR } else { 0.0 };
    if !view.now.iter().any(|unit| unit.distance_squared(front) < near * near) {
        return false;
    }
    // A station's unit is half of a speed's way in a step.
    let soon = Car { station: car.station + 2 * CAR_STEPS_AHEAD * car.speed + MORE_AHEAD, ..*car };
    let grown = |unit: &Outline| Outline {
        half_length: unit.half_length + LEAST_ROOM,
        half_width: unit.half_width + LEAST_ROOM,
        ..*unit
    };
    let now = view.now.each_ref().map(grown);
    soon.outlines(network).any(|its| now.iter().any(|unit| its.overlaps(unit)))
}

/// Where a truck stands nearest on the first part of a car's path: station of its rear, and its speed there (2^-10 m,
/// 2^-14 m a step).
pub(super) fn ahead(view: &View, network: &Network, car: &Car) -> Option<(i32, i32)> {
    if is_far(view, front(network, car)) {
        return None;
    }
    let samples = corridor(network, car, 0);
    let points = Points::of(network, car, 0, samples);
    let now = to_nearest(&points, &view.now, samples[0].position);
    let room = |index: usize| points.half_widths[index] + CORRIDOR_ROOM;
    let index = points.first_within(&now, samples.len(), CORRIDOR_ROOM, room)?;
    let speed = view.speed_along(&samples[index]);
    Some((length(index as f32 * SPACING - BEFORE_SAMPLE), speed))
}

/// Whether nothing of a truck's ground is in the corridor of a car with its front near a point.
fn is_far(view: &View, front: Vec2) -> bool {
    let reach = view.radius + REACH;
    reach * reach < front.distance_squared(view.middle)
}

/// The sample of its path behind a car's front, counted from the path's first.
fn first(network: &Network, car: &Car) -> usize {
    // Conversions saturate; a car has left its path before the last sample.
    ((car.station() / SPACING) as usize).min(network.paths[car.path()].n as usize - 1)
}

/// Where that is (m).
pub(super) fn front(network: &Network, car: &Car) -> Vec2 {
    network.samples[network.paths[car.path()].first as usize + first(network, car)].position
}

/// The samples of a car's path from one on.
fn corridor<'a>(network: &'a Network, car: &Car, first: usize) -> &'a [Sample] {
    let path = &network.paths[car.path()];
    &network.samples[path.first as usize + first..][..(path.n as usize - first).min(CORRIDOR_SAMPLES)]
}
