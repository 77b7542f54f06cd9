//! How far a road is from level: its grades and its crossfall, which are not simulated, so that they can be warned of.

use roxmltree::Node;

use super::records::{Cubic, Level, RoadRecord, active};
use super::source::Source;
use super::xml::{attribute, child, children};
use crate::files::reader::Error;

/// A grade beyond this is warned of.
pub(super) const GRADE: f64 = 0.03;
/// A step of the elevation beyond this is warned of (m).
const STEP: f64 = 0.05;
/// Records that are nearer to each other than this say nothing of the grade between them (m).
const APART: f64 = 1.0;
/// Largest factor of an elevation.
const LARGEST: f64 = 1e9;

impl Cubic {
    /// Largest absolute value between two stations.
    fn largest(&self, from: f64, to: f64) -> f64 {
        let [_, b, c, d] = self.factors;
        self.largest_at(from, to, roots([b, 2.0 * c, 3.0 * d]), |s| self.at(s))
    }

    /// Largest absolute slope between two stations.
    fn steepest(&self, from: f64, to: f64) -> f64 {
        let [_, b, c, d] = self.factors;
        let slope = |s: f64| b + (s - self.start) * (2.0 * c + 3.0 * d * (s - self.start));
        self.largest_at(from, to, roots([2.0 * c, 6.0 * d, 0.0]), slope)
    }

    /// Largest absolute value of `f` at both stations and at those of `extremes` between them, counted from the start.
    fn largest_at(&self, from: f64, to: f64, extremes: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
        let inside = extremes.into_iter().map(|x| self.start + x).filter(|s| (from..=to).contains(s));
        [from, to].into_iter().chain(inside).map(|s| f(s).abs()).filter(|value| value.is_finite()).fold(0.0, f64::max)
    }
}

/// Where `a + b x + c x²` is 0; not finite where it is nowhere.
fn roots([a, b, c]: [f64; 3]) -> [f64; 2] {
    // Without differences of two numbers that are nearly alike, as they are where c is all but 0.
    let q = -0.5 * (b + (b * b - 4.0 * a * c).sqrt().copysign(b));
    [q / c, a / q]
}

/// Every record with the stretch on which it holds, up to `end`.
fn stretches(records: &[Cubic], end: f64) -> impl Iterator<Item = (&Cubic, f64, f64)> {
    let until = move |i: usize| records.get(i + 1).map_or(end, |next| next.start);
    records.iter().enumerate().map(move |(i, record)| (record, record.start, until(i).max(record.start)))
}

impl Source<'_, '_> {
    /// How far a road is from level, with a warning where it is steep.
    pub(super) fn level(&mut self, node: Node, road: &RoadRecord) -> Result<Level, Error> {
        let elevation = self.profile(children(node, "elevationProfile"), "elevation")?;
        let mut grade =
            stretches(&elevation, road.length).map(|(record, from, to)| record.steepest(from, to)).fold(0.0, f64::max);
        for pair in elevation.windows(2) {
            // Elevations in pieces: heights alone, or one that begins elsewhere than the last one ended.
            let apart = pair[1].start - pair[0].start;
            if APART <= apart {
                grade = grade.max((pair[1].factors[0] - pair[0].factors[0]).abs() / apart);
            }
        }
        let step = |pair: &[Cubic]| ((pair[1].factors[0] - pair[0].at(pair[1].start)).abs(), pair[1].start);
        let largest = elevation.windows(2).map(step).max_by(|one, other| one.0.total_cmp(&other.0));
        if let Some((step, s)) = largest.filter(|(step, _)| STEP < *step) {
            self.warn_of_level(node, &format!("its elevation jumps by up to {step:.2} m, at s {s:.2} m"));
        }
        if GRADE < grade {
            self.warn_of_level(node, &format!("has a grade of {:.1} %", 100.0 * grade));
        }
        Ok(Level { grade, crossfall: self.crossfall(node, road)?, elevation })
    }

    /// The largest rise across a road.
    fn crossfall(&mut self, node: Node, road: &RoadRecord) -> Result<f64, Error> {
        let superelevation = self.profile(children(node, "lateralProfile"), "superelevation")?;
        let angle = stretches(&superelevation, road.length)
            .map(|(record, from, to)| record.largest(from, to))
            .fold(0.0, f64::max);
        let Some(profile) = child(node, "lateralProfile") else { return Ok(0.0) };
        // Of OpenDRIVE 1.4 and 1.5, for either side or both.
        let mut fall: f64 = 0.0;
        for side in ["left", "right", "both"] {
            let of_side = children(profile, "crossfall").filter(|record| {
                let given = attribute(*record, "side");
                if given.is_empty() { side == "both" } else { given == side }
            });
            let records = self.cubics(of_side, "s")?;
            fall = stretches(&records, road.length)
                .map(|(record, from, to)| record.largest(from, to))
                .fold(fall, f64::max);
        }
        if child(profile, "crossSectionSurface").is_some() {
            self.warn_of_level(node, "its crossSectionSurface is not read");
        }
        // Shapes of one station follow each other across the road.
        let mut shapes: Vec<(f64, Cubic)> = Vec::new();
        for shape in children(profile, "shape") {
            let t = self.number(shape, "t", None, LARGEST)?;
            shapes.push((
                self.length(shape, "s")?,
                Cubic { start: t, factors: self.factors(shape, ["a", "b", "c", "d"])? },
            ));
        }
        shapes.sort_by(|(s, one), (t, other)| s.total_cmp(t).then(one.start.total_cmp(&other.start)));
        let mut steepest: f64 = 0.0;
        for station in shapes.chunk_by(|(one, _), (other, _)| one == other) {
            let across: Vec<Cubic> = station.iter().map(|(_, shape)| *shape).collect();
            let [right, left] = reach(road, station[0].0);
            for (shape, from, to) in stretches(&across, left) {
                let (from, to) = (from.clamp(right, left), to.clamp(right, left));
                steepest = steepest.max(if from < to { shape.steepest(from, to) } else { 0.0 });
            }
        }
        Ok(angle.min(1.5).tan() + fall.min(1.5).tan() + steepest)
    }

    /// Cubics of an element's children in the order of their beginnings.
    fn profile<'a, 'i: 'a>(
        &mut self,
        of: impl Iterator<Item = Node<'a, 'i>>,
        name: &'static str,
    ) -> Result<Vec<Cubic>, Error> {
        self.cubics(of.flat_map(|profile| children(profile, name)), "s")
    }
}

/// How far a road's lanes reach to its right and to its left at a station, left positive (m).
fn reach(road: &RoadRecord, s: f64) -> [f64; 2] {
    let Some(section) = active(&road.sections, s, |section| section.start) else { return [0.0; 2] };
    let offset = road.offset_at(s);
    let local = s - section.start;
    let width = |side: i32| -> f64 {
        let lanes = section.lanes.iter().filter(|lane| lane.id.signum() == side);
        let at = lanes.map(|lane| {
            let value = active(&lane.widths, local, |width| width.start).map_or(0.0, |width| width.at(local).abs());
            (value, lane.bordered)
        });
        at.fold(0.0, |sum, (value, bordered)| if bordered { value.max(sum) } else { sum + value })
    };
    let (right, left) = (offset - width(-1), offset + width(1));
    if right.is_finite() && left.is_finite() { [right.min(left), left.max(right)] } else { [0.0; 2] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// v = 0.006 s² - 0.00005 s³ is steepest at s = 40 m, where it rises by 0.24 a metre.
    #[test]
    fn a_cubic_is_steepest_where_its_slope_turns_round() {
        let hill = Cubic { start: 0.0, factors: [0.0, 0.0, 0.006, -0.000_05] };
        assert!((hill.steepest(0.0, 70.0) - 0.24).abs() < 1e-12);
        assert!((hill.steepest(0.0, 10.0) - 0.105).abs() < 1e-12);
        // The hill's top lies at s = 80 m, 12.8 m high.
        assert!((hill.largest(0.0, 100.0) - 12.8).abs() < 1e-12);
        // As good as a parabola: 0.25 high at s = 50 m.
        for least in [1e-24, -1e-24, 1e-12, 0.0] {
            let bow = Cubic { start: 0.0, factors: [0.0, 0.01, -0.000_1, least] };
            assert!((bow.largest(0.0, 100.0) - 0.25).abs() < 1e-6);
        }
        assert_eq!(Cubic { start: 3.0, factors: [-0.15, 0.0, 0.0, 0.0] }.largest(3.0, 9.0), 0.15);
    }
}
