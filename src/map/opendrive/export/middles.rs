//! What is paved between the carriageways of an arm, between lanes of one and beside its kerb, as a lane for none:
//! beside the entry lane that is nearest to an exit lane, up to that one, and from each lane to the next or the kerb.

use glam::DVec2;

use super::{Kind, Width, Written, WrittenLane, lane_id};
use crate::geometry::Curve;
use crate::map::ground::{Ground, Hand, Line};

/// Distance between two widths (m), and the widest middle (m).
const STEP: f64 = 1.0;
const WIDEST: f64 = 60.0;
/// What is narrower is no gap (m).
const LEAST: f64 = 0.01;

/// The middles of the arms and what lies between lanes of one carriageway, numbered from `first` on.
pub(super) fn middles(seen: &Ground, hand: Hand, first: usize) -> Vec<Written> {
    let mut roads: Vec<Written> = Vec::new();
    for (index, arm) in seen.arms.iter().enumerate() {
        let middle = nearest(seen, index).map_or_else(Vec::new, |(entry, exit)| {
            let line = entry.line.part(0.0, seen.ring_stations(&entry.line).0);
            let way_in = Strip { line, width: entry.widths[0] };
            // A U-turn comes in on the entry's own line.
            let came_in = if exit.entry == index { seen.ring_stations(&exit.line).0 } else { 0.0 };
            let way_out = Strip { line: exit.line.part(came_in, exit.line.length()), width: exit.widths[2] };
            // The other carriageway is on the left of who keeps to the right.
            let side = f64::from(-lane_id(hand));
            [(&way_in, &way_out), (&way_out, &way_in)]
                .into_iter()
                .filter_map(|(own, other)| own.beside(seen, other, side))
                .collect()
        });
        let of_entry = lanes(seen.lines.iter().filter(|line| line.entry == index), |line| Strip {
            line: line.line.part(0.0, seen.ring_stations(&line.line).0),
            width: line.widths[0],
        });
        // They lead to the ring, as those of the entry do, so that the kerb is on their other side.
        let of_exit = lanes(seen.lines.iter().filter(|line| line.exit_arm == index), |line| Strip {
            line: line.line.part(seen.ring_stations(&line.line).1, line.line.length()).reversed(),
            width: line.widths[2],
        });
        let outwards = f64::from(lane_id(hand));
        let sides = [(&of_entry, "entry", outwards), (&of_exit, "exit", -outwards)];
        let beside = sides.into_iter().flat_map(|(lanes, name, outwards)| {
            let outermost = if outwards < 0.0 { lanes.first() } else { lanes.last() };
            let to_kerb = outermost.and_then(|lane| lane.up_to_gutter(seen, outwards));
            between(lanes).into_iter().chain(to_kerb).map(move |gap| (name, gap))
        });
        for (name, gap) in middle.into_iter().map(|gap| ("middle", gap)).chain(beside) {
            roads.push(gap.written(first + roads.len(), format!("{} {name}", arm.name)));
        }
    }
    roads
}

/// A lane of an arm.
struct Strip {
    line: Curve,
    width: f64,
}

/// What lies between two lanes: beside the edge of one, on its left or its right, these widths by station.
struct Gap {
    line: Curve,
    offset: f64,
    samples: Vec<(f64, f64)>,
}

impl Strip {
    /// What lies between this lane and the nearest of other lines of a width on its left, where `side` is 1, or on its
    /// right, where it is -1; none where they touch everywhere.
    fn up_to(&self, others: &[&Curve], other_width: f64, side: f64) -> Option<Gap> {
        let (from, to) = (self.width / 2.0, other_width / 2.0);
        self.gap(side, |s| across(&self.line, s, side, others) - from - to)
    }

    /// What lies between this lane and the gutter of the nearest kerb on one of its sides; none where they touch
    /// everywhere.
    fn up_to_gutter(&self, seen: &Ground, side: f64) -> Option<Gap> {
        self.gap(side, |s| self.to_gutter(seen, s, side))
    }

    /// What lies between this lane and another one on one of its sides, up to the gutter of what stands there; none
    /// where they touch everywhere.
    fn beside(&self, seen: &Ground, other: &Strip, side: f64) -> Option<Gap> {
        let to_other = |s: f64| across(&self.line, s, side, &[&other.line]) - self.width / 2.0 - other.width / 2.0;
        self.gap(side, |s| to_other(s).min(self.to_gutter(seen, s, side)))
    }

    /// Width between this lane and the gutter of the nearest kerb on one of its sides, at a station (m).
    fn to_gutter(&self, seen: &Ground, s: f64, side: f64) -> f64 {
        let out = side * DVec2::from_angle(self.line.heading_at(s)).perp();
        let edge = self.line.point_at(s) + self.width / 2.0 * out;
        let (mut width, mut room) = (0.0, f64::INFINITY);
        while LEAST / 10.0 < room && width < WIDEST {
            room = seen.to_gutter(edge + width * out);
            width += room;
        }
        if width < WIDEST { width } else { 0.0 }
    }

    /// What lies beside this lane, of these widths by station (m); none where it is nothing.
    fn gap(&self, side: f64, width: impl Fn(f64) -> f64) -> Option<Gap> {
        let samples: Vec<(f64, f64)> = stations(&self.line).map(|s| (s, width(s).max(0.0))).collect();
        let is_gap = samples.iter().any(|(_, width)| LEAST < *width);
        is_gap.then(|| Gap { line: self.line.clone(), offset: side * self.width / 2.0, samples })
    }
}

impl Gap {
    fn written(self, id: usize, name: String) -> Written {
        let lane = WrittenLane {
            id: if self.offset < 0.0 { -1 } else { 1 },
            kind: Kind::Middle,
            widths: Width::through(&self.samples),
        };
        Written {
            id,
            name,
            is_connecting: false,
            offset: self.offset,
            lanes: vec![lane],
            line: self.line,
            predecessor: None,
            successor: None,
        }
    }
}

/// The lanes of some lines from the end of their arm on, each once, from right to left.
fn lanes<'a>(lines: impl Iterator<Item = &'a Line>, strip: impl Fn(&Line) -> Strip) -> Vec<Strip> {
    let mut found: Vec<Strip> = Vec::new();
    for one in lines.map(strip) {
        let start = one.line.point_at(0.0);
        if found.iter().all(|other| LEAST < other.line.point_at(0.0).distance(start)) {
            found.push(one);
        }
    }
    if let Some(first) = found.first() {
        let (origin, left) = (first.line.point_at(0.0), DVec2::from_angle(first.line.heading_at(0.0)).perp());
        let place = |strip: &Strip| (strip.line.point_at(0.0) - origin).dot(left);
        found.sort_by(|one, other| place(one).total_cmp(&place(other)));
    }
    found
}

/// What lies between neighbours.
fn between(lanes: &[Strip]) -> Vec<Gap> {
    let gap = |pair: &[Strip]| pair[0].up_to(&[&pair[1].line], pair[1].width, 1.0);
    lanes.windows(2).filter_map(gap).collect()
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

/// Distance from a point of a line straight across to the nearest other line, to the left or the right; 0 if none is
/// met (m).
fn across(line: &Curve, s: f64, side: f64, others: &[&Curve]) -> f64 {
    let p = line.point_at(s);
    let out = side * DVec2::from_angle(line.heading_at(s)).perp();
    let pieces = others.iter().flat_map(|other| &other.pieces);
    let hits = pieces.flat_map(|piece| piece.on_line(p, out)).flatten();
    let nearest = hits.filter(|&hit| 0.0 < hit).fold(f64::INFINITY, f64::min);
    if nearest < WIDEST { nearest } else { 0.0 }
}
