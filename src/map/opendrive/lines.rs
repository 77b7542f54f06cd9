//! Routes as lines: a way along lanes becomes a centre line of arcs and segments with its widths.

use glam::DVec2;

use super::paths::{Network, Way, within};
use super::surroundings::FITTED;
use crate::geometry::{Curve, Outline, fitted_line};
use crate::map::ground::{Arm, Line};
use crate::map::kerbs::closest;
use crate::map::route::Lane;

/// Joints that jump further are warned of (m).
const JUMP: f64 = 0.1;
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
