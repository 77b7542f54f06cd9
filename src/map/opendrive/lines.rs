//! Routes as lines: a way along lanes becomes a centre line of arcs and segments with its widths.

use glam::DVec2;

use super::paths::{Network, Way, within};
use super::surroundings::FITTED;
use crate::geometry::{Curve, Outline, fitted_line};
use crate::map::ground::{Arm, Line};
use crate::map::route::Lane;

/// Joints that jump further are warned of (m).
const JUMP: f64 = 0.1;
/// A centre line that is nearer to a kerb than half a truck's width is warned of (m).
const NEAREST: f64 = 1.3;
/// Distance between the points of a line that are compared with kerbs first (m).
const STEP: f64 = 0.98;
/// Parts of it, where a kerb may be nearer between two of them.
const FINER: u32 = 20;

/// Reach of crossing lines to either side of a lane that is in no ring, in widths of the lane: over its neighbours too.
pub(super) const CROSSING: f64 = 1.5;

/// Makes the routes of one place of a map.
pub(super) struct Lines<'a> {
    pub(super) network: &'a Network<'a>,
    pub(super) arms: &'a [Arm],
    /// What the place is called in messages.
    pub(super) place: &'a str,
    /// Whether the map has left-hand traffic, so that lanes change their names.
    pub(super) mirrored: bool,
    /// How far from the origin lines reach (m).
    pub(super) extent: f64,
    /// Radius of the circle where arms begin (m).
    pub(super) circle: f64,
    /// The routes so far.
    pub(super) lines: Vec<Line>,
    /// What is odd about them.
    pub(super) warnings: Vec<String>,
}

impl Lines<'_> {
    /// Adds the route along a way, unless nothing of it lies in the world; `crossing` gives the reach of its crossing
    /// lines from the line and the width of its lane.
    pub(super) fn add(
        &mut self,
        (entry, lane, exit, exit_arm): (usize, Lane, u32, usize),
        way: &Way,
        crossing: impl Fn(&[DVec2], f64) -> (f64, f64),
    ) {
        let whole = self.network.continued(&way.1, self.extent);
        let ends = [false, true].map(|at_end| self.network.ends_early(&whole, self.extent - 0.5, at_end));
        let (line, jump) = self.network.line(&whole);
        let line = within(&line, self.extent - 0.5);
        if line.len() < 2 {
            return;
        }
        if JUMP < jump {
            let route = self.name(entry, lane, exit);
            self.warnings
                .push(format!("{}: {route}: its lanes jump by up to {jump:.2} m; the joints were spread", self.place));
        }
        let (from, to) = (line[0], line[line.len() - 1]);
        let middle = line.iter().copied().min_by(|one, other| one.length().total_cmp(&other.length())).unwrap_or(from);
        let at_arm = |end: DVec2| self.circle * end.normalize_or_zero();
        let widths = [at_arm(from), middle, at_arm(to)].map(|p| width(self.network, &way.1, p));
        let crossing = crossing(&line, widths[1]);
        for (arm, what, end, reason) in [(entry, "begins", from, &ends[0]), (exit_arm, "ends", to, &ends[1])] {
            let Some(reason) = reason else { continue };
            let (place, name) = (self.place, &self.arms[arm].name);
            let warning = format!("{place}: arm {name}: a lane {what} {:.1} m from the centre: {reason}", end.length());
            if !self.warnings.contains(&warning) {
                self.warnings.push(warning);
            }
        }
        self.lines.push(Line { entry, lane, exit, exit_arm, line: fitted_line(&line, FITTED), crossing, widths, ends });
    }

    /// Warns of routes too near to a kerb.
    pub(super) fn check(&mut self, faces: &Outline) {
        for line in &self.lines {
            if let Some((distance, p)) = closest(&line.line, faces) {
                let (place, route) = (self.place, self.name(line.entry, line.lane, line.exit));
                let y = if self.mirrored { -p.y } else { p.y };
                let at = format!("({:.1}, {y:.1}) from the centre", p.x);
                self.warnings.push(format!("{place}: {route}: its centre line is {distance:.2} m from a kerb at {at}"));
            }
        }
    }

    /// What a route is called, without the roundabout.
    pub(super) fn name(&self, entry: usize, lane: Lane, exit: u32) -> String {
        format!("{}-{}-{exit}", self.arms[entry].name, lane.seen(self.mirrored).name())
    }
}

/// Width of the lane along a way at the point nearest to `p` (m).
fn width(network: &Network, way: &[usize], p: DVec2) -> f64 {
    let strips = way.iter().filter_map(|strip| network.strips.get(strip));
    let samples = strips.flat_map(|strip| strip.left.iter().zip(&strip.right).zip(&strip.centre));
    let nearest = samples.min_by(|(_, one), (_, other)| one.distance(p).total_cmp(&other.distance(p)));
    nearest.map_or(3.5, |((left, right), _)| left.distance(*right))
}

/// Where a line comes too near to a kerb, away from its ends, and how near it is there (m).
pub(in crate::map) fn closest(line: &Curve, faces: &Outline) -> Option<(f64, DVec2)> {
    let span = line.length() - 4.0 * NEAREST;
    if span < 0.0 {
        // A short line is all ends.
        return None;
    }
    let n = (span / STEP).ceil() as usize;
    let step = span / n.max(1) as f64;
    let near = |along: f64| (faces.signed_distance(line.point_at(2.0 * NEAREST + along)), along);
    let coarse: Vec<(f64, f64)> = (0..=n).map(|i| near(i as f64 * step)).collect();
    let nearer = |one: (f64, f64), other: (f64, f64)| if other.0 < one.0 { other } else { one };
    let mut least = coarse.iter().copied().fold((f64::INFINITY, 0.0), nearer);
    for pair in coarse.windows(2) {
        // A distance changes by no more than what is driven: elsewhere between two points there is nothing nearer.
        if 0.5 * (pair[0].0 + pair[1].0 - step) < least.0 {
            least =
                (1..FINER).map(|part| near(pair[0].1 + step * f64::from(part) / f64::from(FINER))).fold(least, nearer);
        }
    }
    Some((least.0, line.point_at(2.0 * NEAREST + least.1))).filter(|(distance, _)| *distance < NEAREST)
}

/// The centre lines of routes, each lane once.
pub(super) fn shown(lines: &[Line]) -> Vec<Curve> {
    const SPACING: f64 = 0.5;
    const SAME: f64 = 0.3;
    let mut shown: Vec<Curve> = Vec::new();
    for Line { line, .. } in lines {
        let n = (line.length() / SPACING) as usize;
        let known: Vec<bool> = (0..=n)
            .map(|i| shown.iter().any(|other| other.distance(line.point_at(i as f64 * SPACING)) < SAME))
            .collect();
        let mut from = 0;
        while from <= n {
            let to = (from..=n).find(|&i| known[i] != known[from]).unwrap_or(n + 1);
            if !known[from] && 2 < to - from {
                let end = if to <= n { to as f64 * SPACING } else { line.length() };
                shown.push(line.part(from as f64 * SPACING, end));
            }
            from = to;
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Piece;

    #[test]
    fn a_kerb_is_found_wherever_it_is_along_a_line_of_any_length() {
        let rectangle = |from: DVec2, to: DVec2| {
            let corners = [from, DVec2::new(to.x, from.y), to, DVec2::new(from.x, to.y)];
            let side = |i: usize| Piece::Segment { from: corners[i], to: corners[(i + 1) % 4] };
            Curve { pieces: (0..4).map(side).collect() }
        };
        let short = Curve { pieces: vec![Piece::Segment { from: DVec2::ZERO, to: DVec2::new(4.0, 0.0) }] };
        let narrow = Outline::new(vec![rectangle(DVec2::new(-9.0, -1.0), DVec2::new(9.0, 1.0))]);
        assert_eq!(closest(&short, &narrow), None);
        for length in [20.0, 200.0, 1_000.0] {
            let line = Curve { pieces: vec![Piece::Segment { from: DVec2::ZERO, to: DVec2::new(length, 0.0) }] };
            let road = rectangle(DVec2::new(-9.0, -9.0), DVec2::new(length + 9.0, 9.0));
            assert_eq!(closest(&line, &Outline::new(vec![road.clone()])), None);
            for at in [3.0, 0.5 * length, length - 3.0] {
                // A post on the line, wherever the points lie, is as near as its middle.
                let post = rectangle(DVec2::new(at - 0.2, -0.2), DVec2::new(at + 0.2, 0.2));
                let (distance, place) = closest(&line, &Outline::new(vec![road.clone(), post])).unwrap();
                assert!((distance + 0.2).abs() < 0.03 && (place.x - at).abs() < 0.05, "{at}: {distance} {place}");
            }
        }
    }
}
