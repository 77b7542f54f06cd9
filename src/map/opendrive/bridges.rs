//! Roads that pass above others, which a level map paves as if they met.

use std::collections::BTreeMap;

use glam::DVec2;

use super::lanes::Strip;
use super::records::{Records, RoadRecord};
use super::whole::LEVEL;
use super::xml::shown;
use crate::geometry::area::encloses;

/// Lanes that overlap with a rise of more than this between them are a bridge and what passes below it (m).
const CLEARANCE: f64 = 2.5;

/// A lane with the heights of its centre line.
struct Raised {
    /// Index of its road.
    road: usize,
    contours: Vec<Vec<[f64; 2]>>,
    low: DVec2,
    high: DVec2,
    /// Points of the centre line, each with its height (m).
    points: Vec<(DVec2, f64)>,
}

impl Raised {
    fn new(road: &RoadRecord, strip: &Strip) -> Raised {
        let (start, end, length) =
            (road.sections[strip.section].start, road.section_end(strip.section), strip.length());
        let mut points: Vec<(DVec2, f64)> = Vec::new();
        let mut passed = 0.0;
        for pair in strip.centre.windows(2) {
            let step = pair[0].distance(pair[1]);
            let parts = step.ceil().max(1.0) as usize;
            points.extend((0..parts).map(|part| {
                let along = part as f64 / parts as f64;
                let s = start + (end - start) * (passed + along * step) / length.max(f64::MIN_POSITIVE);
                (pair[0].lerp(pair[1], along), road.height(s))
            }));
            passed += step;
        }
        let contours = strip.contours().into_iter().map(|contour| contour.into_iter().map(DVec2::into).collect());
        let (low, high) = strip.bounds();
        Raised { road: strip.road, contours: contours.collect(), low, high, points }
    }

    /// How far it lies above another lane where its centre line is over or under that one, at most either way (m).
    fn rise_over(&self, other: &Raised) -> f64 {
        if self.road == other.road || !(self.low.cmple(other.high).all() && other.low.cmple(self.high).all()) {
            return 0.0;
        }
        let over = self.points.iter().filter(|(p, _)| other.contours.iter().any(|contour| encloses(contour, *p)));
        let rise = |&(p, height): &(DVec2, f64)| {
            let near = |point: &&(DVec2, f64)| point.0.distance_squared(p);
            let nearest = other.points.iter().min_by(|a, b| near(a).total_cmp(&near(b)));
            nearest.map_or(0.0, |(_, below)| height - below)
        };
        over.map(rise).filter(|rise| rise.is_finite()).max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
    }
}

/// What passes above something else, of some lanes: for each such road the most that it does.
pub(super) fn bridges<'a>(records: &Records, strips: impl Iterator<Item = &'a Strip>) -> Vec<String> {
    let roads = &records.roads;
    // A map without heights has no bridges.
    if roads.iter().all(|road| road.level.elevation.is_empty()) {
        return Vec::new();
    }
    let lanes: Vec<Raised> = strips.map(|strip| Raised::new(&roads[strip.road], strip)).collect();
    let mut above: BTreeMap<&str, (f64, &str)> = BTreeMap::new();
    for one in &lanes {
        for other in &lanes {
            let rise = one.rise_over(other);
            let (upper, lower) = if 0.0 < rise { (one, other) } else { (other, one) };
            let [upper, lower] = [upper, lower].map(|lane| roads[lane.road].id.as_str());
            let most = above.entry(upper).or_insert((CLEARANCE, lower));
            // Of roads that are equally far below, the first by name.
            if most.0 < rise.abs() || (most.0 == rise.abs() && lower < most.1) {
                *most = (rise.abs(), lower);
            }
        }
    }
    let high = above.into_iter().filter(|(_, (rise, _))| CLEARANCE < *rise);
    high.map(|(upper, (rise, lower))| {
        let (upper, lower) = (shown(upper), shown(lower));
        format!("road {upper} passes {rise:.1} m above road {lower}; {LEVEL}, and both are paved")
    })
    .collect()
}
