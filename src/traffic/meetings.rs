//! Where two lines are near each other: the connected parts of the set of station pairs whose points are.
//!
//! Lanes that diverge, merge or are shared, an entry across the outer lane, an exit from the inner one, a bypass and a
//! U-turn are all found this way.

use std::collections::BTreeMap;
use std::ops::Range;

use glam::DVec2;

use crate::geometry::{Curve, wrapped};

/// Distance between the points of a line that are compared (m).
pub(super) const FINE: f64 = 0.5;
/// Points nearer than this are the same place of two lines that run together (m).
const SAME: f64 = 0.3;
/// Cosine of the angle above which lines run against each other, as the two carriageways of an arm do.
const OPPOSITE: f64 = -0.75;

/// Points of a line every [`FINE`], and its headings there.
pub(super) struct Points {
    points: Vec<DVec2>,
    headings: Vec<f64>,
    along: Vec<DVec2>,
}

impl Points {
    pub(super) fn of(line: &Curve) -> Points {
        let n = (line.length() / FINE) as usize + 1;
        let stations = || (0..n).map(|index| index as f64 * FINE);
        let headings: Vec<f64> = stations().map(|s| line.heading_at(s)).collect();
        let along = headings.iter().copied().map(DVec2::from_angle).collect();
        Points { points: stations().map(|s| line.point_at(s)).collect(), headings, along }
    }

    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// One of its points (m).
    pub(super) fn point(&self, index: usize) -> DVec2 {
        self.points[index]
    }

    /// Unit vector along the line there.
    pub(super) fn along(&self, index: usize) -> DVec2 {
        self.along[index]
    }

    /// Angle between the directions of two lines, each at one of its points (rad).
    pub(super) fn angle(&self, index: usize, other: &Points, other_index: usize) -> f64 {
        wrapped(self.headings[index] - other.headings[other_index]).abs()
    }

    /// Whether the other line runs the other way there.
    pub(super) fn is_opposite(&self, index: usize, other: &Points, other_index: usize) -> bool {
        self.along(index).dot(other.along(other_index)) < OPPOSITE
    }

    /// Stretches of the other line within `within` of a point of this one, `most` at most.
    fn intervals(&self, row: usize, other: &Points, most: f64, within: impl Fn(usize, usize) -> f64) -> Vec<Interval> {
        let mut found: Vec<Interval> = Vec::new();
        let mut index = 0;
        while index < other.points.len() {
            let distance = self.points[row].distance(other.points[index]);
            if most <= distance {
                // No nearer point can come sooner.
                index += (((distance - most) / FINE) as usize).max(1);
                continue;
            }
            if within(row, index) <= distance {
                index += 1;
                continue;
            }
            match found.last_mut() {
                Some(last) if last.high + 1 == index => {
                    last.high = index;
                    if distance < last.distance {
                        (last.distance, last.nearest) = (distance, index);
                    }
                }
                _ => found.push(Interval { row, low: index, high: index, distance, nearest: index }),
            }
            index += 1;
        }
        found
    }
}

/// Points of one line that are near a point of another: from the first to the last, and the nearest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Interval {
    /// The point of the other.
    pub row: usize,
    /// First of the points.
    pub low: usize,
    /// Last of them.
    pub high: usize,
    /// Distance of the nearest (m).
    pub distance: f64,
    /// The nearest.
    pub nearest: usize,
}

/// A connected part of the set of near pairs, by indices of points.
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// First and last point of a.
    pub a: [usize; 2],
    /// First and last point of b.
    pub b: [usize; 2],
    /// The nearest pair of points.
    pub nearest: [usize; 2],
    /// Their distance (m).
    distance: f64,
    /// Sum of the differences of the indices on b and on a over the points where the lines are the same place.
    shifts: f64,
    /// Number of these points.
    pub n_same: usize,
}

impl Part {
    fn new(interval: &Interval) -> Part {
        let Interval { row, low, high, distance, nearest } = *interval;
        let same = distance < SAME;
        Part {
            a: [row, row],
            b: [low, high],
            nearest: [row, nearest],
            distance,
            shifts: if same { nearest as f64 - row as f64 } else { 0.0 },
            n_same: usize::from(same),
        }
    }

    fn add(&mut self, other: &Part) {
        self.a = [self.a[0].min(other.a[0]), self.a[1].max(other.a[1])];
        self.b = [self.b[0].min(other.b[0]), self.b[1].max(other.b[1])];
        if other.distance < self.distance {
            (self.distance, self.nearest) = (other.distance, other.nearest);
        }
        self.shifts += other.shifts;
        self.n_same += other.n_same;
    }

    /// Station on b less that on a: of the points at the same place, or of the nearest ones (m).
    pub(super) fn delta(&self) -> f64 {
        let [a, b] = self.nearest.map(|index| index as f64);
        FINE * if 0 < self.n_same { self.shifts / self.n_same as f64 } else { b - a }
    }

    /// The same part with the lines exchanged.
    pub(super) fn transposed(&self) -> Part {
        let [a, b] = self.nearest;
        Part { a: self.b, b: self.a, nearest: [b, a], shifts: -self.shifts, ..*self }
    }
}

/// The connected parts of the pairs of points that are nearer than `within`, for the points `rows` of a, in the order
/// in which they begin on a.
pub(super) fn parts(a: &Points, b: &Points, within: f64, rows: Range<usize>) -> Vec<Part> {
    let whole = |intervals: Vec<Interval>| {
        let parts = intervals.iter().map(Part::new);
        parts.reduce(|mut whole, part| {
            whole.add(&part);
            whole
        })
    };
    components(a, b, within, |_, _| within, rows).into_iter().filter_map(whole).collect()
}

/// The connected parts of the pairs of points of which the distance is below what is asked of a point of a and a point
/// of b, `most` at most: of each its intervals, by the point of a.
pub(super) fn components(
    a: &Points,
    b: &Points,
    most: f64,
    within: impl Fn(usize, usize) -> f64,
    rows: Range<usize>,
) -> Vec<Vec<Interval>> {
    let mut intervals: Vec<Interval> = Vec::new();
    // An interval leads to an earlier one of its part, the first to itself.
    let mut leads: Vec<usize> = Vec::new();
    let first = |leads: &[usize], mut index: usize| {
        while leads[index] != index {
            index = leads[index];
        }
        index
    };
    let mut above = 0..0;
    for row in rows.start..rows.end.min(a.len()) {
        let begin = intervals.len();
        for interval in a.intervals(row, b, most, &within) {
            let index = leads.len();
            leads.push(index);
            for other in above.clone() {
                let upper: &Interval = &intervals[other];
                if interval.low <= upper.high + 1 && upper.low <= interval.high + 1 {
                    let [one, two] = [first(&leads, index), first(&leads, other)];
                    leads[one.max(two)] = one.min(two);
                }
            }
            intervals.push(interval);
        }
        above = begin..intervals.len();
    }
    let mut found: BTreeMap<usize, Vec<Interval>> = BTreeMap::new();
    for (index, interval) in intervals.iter().enumerate() {
        found.entry(first(&leads, index)).or_default().push(*interval);
    }
    found.into_values().collect()
}
