//! What is paved between the carriageways of an arm, as a lane for neither of them: beside the entry lane that is
//! nearest to an exit lane, up to that one.

use glam::DVec2;

use super::{Kind, Width, Written, WrittenLane, lane_id};
use crate::geometry::Curve;
use crate::map::ground::{Ground, Hand, Line};

/// Distance between two widths (m), and the widest middle (m).
const STEP: f64 = 1.0;
const WIDEST: f64 = 60.0;

/// The middles of the arms, numbered from `first` on.
pub(super) fn middles(seen: &Ground, hand: Hand, first: usize) -> Vec<Written> {
    let mut roads: Vec<Written> = Vec::new();
    for (index, arm) in seen.arms.iter().enumerate() {
        let Some((entry, exit)) = nearest(seen, index) else { continue };
        let line = entry.line.part(0.0, seen.ring_stations(&entry.line).0);
        let (from, to) = (entry.widths[0] / 2.0, exit.widths[2] / 2.0);
        // The other carriageway is on the left of who keeps to the right.
        let side = f64::from(-lane_id(hand));
        let width = |s: f64| (across(&line, s, side, &exit.line) - from - to).max(0.0);
        let samples: Vec<(f64, f64)> = stations(&line).map(|s| (s, width(s))).collect();
        if samples.iter().all(|(_, width)| *width == 0.0) {
            continue;
        }
        roads.push(Written {
            id: first + roads.len(),
            name: format!("{} middle", arm.name),
            is_connecting: false,
            offset: side * from,
            lanes: vec![WrittenLane { id: -lane_id(hand), kind: Kind::Middle, widths: Width::through(&samples) }],
            line,
            predecessor: None,
            successor: None,
        });
    }
    roads
}

/// The entry and the exit of an arm that are nearest to each other at its end.
fn nearest(seen: &Ground, arm: usize) -> Option<(&Line, &Line)> {
    let entries = seen.lines.iter().filter(|line| line.entry == arm);
    let exits = || seen.lines.iter().filter(|line| line.exit_arm == arm);
    let pairs = entries.flat_map(|entry| exits().map(move |exit| (entry, exit)));
    let apart = |(entry, exit): &(&Line, &Line)| entry.line.point_at(0.0).distance(exit.line.point_at(f64::INFINITY));
    pairs.min_by(|one, other| apart(one).total_cmp(&apart(other)))
}

fn stations(line: &Curve) -> impl Iterator<Item = f64> + use<> {
    let (n, length) = ((line.length() / STEP).ceil().max(1.0), line.length());
    (0..=n as usize).map(move |i| length * i as f64 / n)
}

/// Distance from a point of a line straight across to another line, to the left or the right; 0 if it is not met (m).
fn across(line: &Curve, s: f64, side: f64, other: &Curve) -> f64 {
    let p = line.point_at(s);
    let out = side * DVec2::from_angle(line.heading_at(s)).perp();
    let hits = other.pieces.iter().flat_map(|piece| piece.on_line(p, out)).flatten();
    let nearest = hits.filter(|&hit| 0.0 < hit).fold(f64::INFINITY, f64::min);
    if nearest < WIDEST { nearest } else { 0.0 }
}
