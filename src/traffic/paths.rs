//! The lines that cars drive, from 50 m before the ring to 40 m after it, and how fast they are driven.
//!
//! Every route of a road is a line, whether a benchmark drives it or not.

use glam::Vec2;

use super::network::{SPACING, Sample};
use super::units::speed;
use crate::geometry::{Curve, wrapped};
use crate::map::ground::{Ground, Line};

/// Length of arm before the ring that cars drive on (m).
const APPROACH: f64 = 50.0;
/// The same after the ring (m).
const DEPARTURE: f64 = 40.0;
/// Speed on the straight (m/s).
const FREE: f64 = 10.0;
/// Largest lateral acceleration; binds below a radius of 12 m, where the equations by radius leave their data (m/s²).
const LATERAL: f64 = 3.0;
/// Braking before a bend (m/s²).
const BRAKING: f64 = 1.8;
/// Radius up to which the equations by radius hold (m).
const WIDEST: f64 = 120.0;
/// Length over which curvature is measured (m).
const SPAN: f64 = 4.0;

/// A route's centre line as cars drive it.
pub(super) struct Course {
    pub line: Curve,
    /// Index of the entry arm.
    pub entry: usize,
    /// The lane it keeps, counted from the kerb.
    pub lane: usize,
    /// Exit number, counted from the entry.
    pub exit: u32,
    /// Index of the exit arm.
    pub exit_arm: usize,
}

/// Of every path the station at which a route with so long an approach begins; negative before the path's beginning
/// (m).
pub fn begins(ground: &Ground, approach: f64) -> Vec<f64> {
    let of = |line: &Line| ground.ring_stations(&line.line).0 - approach - first(ground, line);
    ground.lines.iter().map(of).collect()
}

/// Where the path of a line begins on it: at the same place as those of its entry lane (m).
fn first(ground: &Ground, line: &Line) -> f64 {
    let of_lane = ground.lines.iter().filter(|other| (other.entry, other.lane) == (line.entry, line.lane));
    of_lane.map(|line| ground.ring_stations(&line.line).0 - APPROACH).fold(f64::INFINITY, f64::min).max(0.0)
}

/// All lines of a road, in the order of its routes. Those of one entry lane begin at the same place: where cars come
/// from there is room for all of them or for none.
pub(super) fn courses(ground: &Ground) -> Vec<Course> {
    let course = |line: &Line| {
        let leaves = ground.ring_stations(&line.line).1;
        Course {
            line: line.line.part(first(ground, line), leaves + DEPARTURE),
            entry: line.entry,
            lane: line.lane.index(),
            exit: line.exit,
            exit_arm: line.exit_arm,
        }
    };
    ground.lines.iter().map(course).collect()
}

/// Speed at which cars drive a bend of this curvature, positive to the left (m/s, 1/m).
///
/// Equations 9.3 and 9.4 of NCHRP Research Report 1043, "Guide for Roundabouts" (2023), in metres and km/h: 8.760
/// R^0.3861 where the road falls to the inside of the bend, as on entries and exits, and 8.617 R^0.3673 where it falls
/// to the outside, as in the ring, for R up to 120 m. In traffic on the right only the ring bends to the left.
pub fn speed_limit(curvature: f64) -> f64 {
    let radius = 1.0 / curvature.abs().max(1e-9);
    if WIDEST < radius {
        return FREE;
    }
    let kmh = if 0.0 < curvature { 8.617 * radius.powf(0.3673) } else { 8.760 * radius.powf(0.3861) };
    FREE.min(kmh / 3.6).min((LATERAL * radius).sqrt())
}

impl Course {
    /// Positions, directions and speed limits every [`SPACING`], and one sample beyond the end.
    pub(super) fn samples(&self) -> Vec<Sample> {
        let (length, spacing) = (self.line.length(), f64::from(SPACING));
        let n = (length / spacing).ceil() as usize + 2;
        let heading = |s: f64| self.line.heading_at(s.clamp(0.0, length));
        let limit = |index: usize| {
            let s = index as f64 * spacing;
            speed_limit(wrapped(heading(s + 0.5 * SPAN) - heading(s - 0.5 * SPAN)) / SPAN)
        };
        let mut limits: Vec<f64> = (0..n).map(limit).collect();
        for index in (0..n - 1).rev() {
            let reachable = (limits[index + 1].powi(2) + 2.0 * BRAKING * spacing).sqrt();
            limits[index] = limits[index].min(reachable);
        }
        let sample = |(index, limit): (usize, f64)| {
            let s = index as f64 * spacing;
            let direction = glam::DVec2::from_angle(heading(s));
            // Beyond its end the line goes straight on.
            let position = self.line.point_at(s.min(length)) + (s - length).max(0.0) * direction;
            Sample { position: vec2(position), direction: vec2(direction), limit: speed(limit as f32) }
        };
        limits.into_iter().enumerate().map(sample).collect()
    }
}

fn vec2(p: glam::DVec2) -> Vec2 {
    p.as_vec2()
}
