//! A truck as cars see it: the ground that both units cover now, in 1 s and in 2 s if it goes on as it does, and its
//! place on its path.

use glam::Vec2;

use crate::layout::angle::{direction, sin_cos};
use crate::layout::shared::constants;
use crate::layout::{Body, Rig, Truck};
use crate::traffic::car::Outline;
use crate::traffic::model::{FASTEST, square, still_stops, way_of_a_second};
use crate::traffic::units::{length, speed};
use crate::traffic::{Network, Sample};

constants! {
    /// A truck swings out before its line: it has entered so far before the line of cars (2^-10 m).
    const SWINGS_OUT: i32 = length(2.5);
    /// Steps to each of the two times at which it is foreseen.
    const STEPS_AHEAD: usize = 2;
    /// How long they are (s).
    const STEP_AHEAD: f32 = 0.5;
}

/// A truck as cars see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Index of its path.
    pub path: usize,
    /// Station of its front on it, negative before its beginning (2^-10 m).
    pub station: i32,
    /// Its speed (2^-14 m a step).
    pub speed: i32,
    /// Its length, stretched (2^-10 m).
    pub length: i32,
    /// Whether it can still stop before its line. What it would sweep behind it does not count before.
    pub waits: bool,
    /// The tractor's velocity (m/s).
    pub velocity: Vec2,
    /// The ground that tractor and trailer cover.
    pub now: [Outline; 2],
    /// The same in 1 s and then in 2 s; where it is now while it waits.
    pub later: [Outline; 4],
    /// A circle around all of them: its middle, and its radius (m).
    pub(super) middle: Vec2,
    pub(super) radius: f32,
}

impl View {
    /// A truck with the front of its tractor at a station of a path (m).
    pub fn new(network: &Network, rig: &Rig, truck: &Truck, path: usize, station: f32) -> View {
        let station = length(station);
        let speed = speed(truck.speed).clamp(0, FASTEST);
        let waits = still_stops(station, square(speed), network.paths[path].line - SWINGS_OUT);
        let now = outlines(rig, truck);
        let later = if waits { [now[0], now[1], now[0], now[1]] } else { foreseen(rig, truck) };
        let middle = 0.25 * (now[0].middle + now[1].middle + later[2].middle + later[3].middle);
        let reach = |unit: &Outline| unit.middle.distance(middle) + unit.half_length + unit.half_width;
        View {
            path,
            station,
            speed,
            length: stretched(rig),
            waits,
            velocity: truck.speed * direction(truck.heading),
            now,
            later,
            middle,
            radius: now.iter().chain(&later).map(reach).fold(0.0, f32::max),
        }
    }

    /// Its speed along a sample of a car's path (2^-14 m a step).
    pub(super) fn speed_along(&self, sample: &Sample) -> i32 {
        speed(self.velocity.dot(sample.direction)).clamp(0, FASTEST)
    }

    /// Its way in two seconds (2^-10 m).
    pub(super) fn way_of_two_seconds(&self) -> i32 {
        2 * way_of_a_second(self.speed)
    }
}

/// Length of a tractor and its trailer, stretched (2^-10 m).
pub fn stretched(rig: &Rig) -> i32 {
    length(rig.tractor_body.front - rig.fifth_wheel + rig.trailer_wheelbase - rig.trailer_body.rear)
}

/// The ground that tractor and trailer cover.
pub fn outlines(rig: &Rig, truck: &Truck) -> [Outline; 2] {
    [
        outline(&rig.tractor_body, truck.position, truck.heading),
        outline(&rig.trailer_body, truck.trailer_position(rig), truck.trailer_heading),
    ]
}

pub(super) fn outline(body: &Body, position: Vec2, heading: f32) -> Outline {
    let along = direction(heading);
    Outline {
        middle: position + 0.5 * (body.front + body.rear) * along,
        along,
        half_length: 0.5 * (body.front - body.rear),
        half_width: body.half_width,
    }
}

/// Both units in 1 s and in 2 s at constant speed and steer angle: the tractor on a circle, the trailer behind it.
fn foreseen(rig: &Rig, truck: &Truck) -> [Outline; 4] {
    let (speed, yaw_rate) = (truck.speed, yaw_rate(rig, truck));
    let mut ahead = *truck;
    let mut outlines_later = [outlines(rig, truck); 2];
    for later in &mut outlines_later {
        for _ in 0..STEPS_AHEAD {
            let (sin, cos) = sin_cos(ahead.heading - ahead.trailer_heading);
            let trailer_yaw_rate = (speed * sin + rig.fifth_wheel * yaw_rate * cos) / rig.trailer_wheelbase;
            ahead.position += STEP_AHEAD * speed * direction(ahead.heading + 0.5 * STEP_AHEAD * yaw_rate);
            ahead.heading += STEP_AHEAD * yaw_rate;
            ahead.trailer_heading += STEP_AHEAD * trailer_yaw_rate;
        }
        *later = outlines(rig, &ahead);
    }
    let [[a, b], [c, d]] = outlines_later;
    [a, b, c, d]
}

/// Yaw rate of a tractor without slip (rad/s).
pub(super) fn yaw_rate(rig: &Rig, truck: &Truck) -> f32 {
    let (sin, cos) = sin_cos(truck.steering);
    truck.speed * sin / (cos * rig.wheelbase)
}
