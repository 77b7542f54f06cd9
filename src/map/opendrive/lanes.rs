//! Lanes as strips: both edges and the centre line, sampled as finely as their shape requires.
//!
//! The lanes of a section share their stations and neighbours share an edge point by point, so no sliver lies between
//! them. Every record begins at a sample of its own.

use glam::DVec2;

use super::read::{KERB_WIDTH, RAISED};
use super::records::{Kind, Lane, Records, RoadRecord, Section, active};
use super::sections::SHORTEST;

/// Most halvings of the stretch between two records.
const MOST_HALVINGS: u32 = 9;
/// Longest distance between two samples (m).
const LONGEST_STEP: f64 = 20.0;
/// Most points that are sampled on one map.
const MOST_POINTS: usize = 10_000_000;
/// Longest that all lanes of a map are together (m).
const MOST_LENGTH: f64 = 2e6;
/// A lane that is nowhere wider than this only looks like one (m).
const NARROWEST: f64 = 1.5;
/// Farthest that a lane lies from its reference line (m).
const FARTHEST: f64 = 1000.0;
/// A strip that folds over at more samples than this has no shape that could be paved.
const MOST_FOLDS: usize = 200;

/// A lane of a section, in the direction of the reference line.
#[derive(Debug, Clone)]
pub(super) struct Strip {
    /// Index of its road.
    pub(super) road: usize,
    /// Index of its section in the road.
    pub(super) section: usize,
    /// The lane's number.
    pub(super) id: i32,
    /// Whether the lane is travelled against the reference line.
    pub(super) backward: bool,
    /// What the lane is for; a raised flat lane is a kerb or solid.
    pub(super) kind: Kind,
    pub(super) left: Vec<DVec2>,
    pub(super) right: Vec<DVec2>,
    pub(super) centre: Vec<DVec2>,
}

impl Strip {
    /// The centre line in the direction of travel (m).
    pub(super) fn path(&self) -> Vec<DVec2> {
        let mut path = self.centre.clone();
        if self.backward {
            path.reverse();
        }
        path
    }

    /// Length of its centre line (m).
    pub(super) fn length(&self) -> f64 {
        self.centre.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
    }

    /// Whether vehicles drive on it: a lane as wide as one somewhere.
    pub(super) fn is_driven(&self) -> bool {
        self.kind == Kind::Lane
            && self.left.iter().zip(&self.right).any(|(left, right)| NARROWEST < left.distance(*right))
    }

    /// Corners of the smallest upright rectangle around it (m).
    pub(super) fn bounds(&self) -> (DVec2, DVec2) {
        let points = self.left.iter().chain(&self.right);
        points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)))
    }

    /// Contours that cover the strip, each counter-clockwise: one, or where the strip folds over, two a sample; none if
    /// it does so all along.
    pub(super) fn contours(&self) -> Vec<Vec<DVec2>> {
        let quads = || (1..self.left.len()).map(|i| [self.right[i - 1], self.right[i], self.left[i], self.left[i - 1]]);
        let turn = |a: DVec2, b: DVec2, c: DVec2| (b - a).perp_dot(c - a);
        let folds = |[a, b, c, d]: &[DVec2; 4]| turn(*a, *b, *c).min(turn(*a, *c, *d)).min(turn(*a, *b, *d)) < -1e-12;
        if !quads().any(|quad| folds(&quad)) {
            let contour: Vec<DVec2> = self.right.iter().chain(self.left.iter().rev()).copied().collect();
            return vec![contour];
        }
        if MOST_FOLDS < quads().filter(folds).count() {
            return Vec::new();
        }
        let triangles = quads().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        triangles.map(|[a, b, c]| if turn(a, b, c) < 0.0 { vec![a, c, b] } else { vec![a, b, c] }).collect()
    }
}

/// Lanes whose samples would not fit into memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TooDetailed;

/// Every lane of a map, sampled so that no chord leaves its curve by more than `tolerance` (m).
pub(super) fn strips(records: &Records, tolerance: f64) -> Result<Vec<Strip>, TooDetailed> {
    let mut left = MOST_POINTS;
    let mut length = 0.0;
    let mut strips = Vec::new();
    for (index, road) in records.roads.iter().enumerate() {
        for section in 0..road.sections.len() {
            let sampled = sampled(road, index, section, tolerance);
            let points: usize = sampled.iter().map(|strip| 3 * strip.centre.len()).sum();
            left = left.checked_sub(points).ok_or(TooDetailed)?;
            // Where the reference line jumps, lanes are longer than their section.
            let stations = road.section_end(section) - road.sections[section].start;
            length += sampled.iter().map(|strip| stations.max(strip.length())).sum::<f64>();
            if MOST_LENGTH < length {
                return Err(TooDetailed);
            }
            strips.extend(sampled);
        }
    }
    Ok(strips)
}

/// The lanes of one section, from left to right.
pub(super) fn sampled(road: &RoadRecord, index: usize, section: usize, tolerance: f64) -> Vec<Strip> {
    let of = &road.sections[section];
    if of.lanes.is_empty() {
        return Vec::new();
    }
    let (begin, end) = (of.start.min(road.length), road.section_end(section).min(road.length));
    let mut breaks = vec![begin, end.max(begin)];
    breaks.extend(road.plan.iter().map(|geometry| geometry.start));
    breaks.extend(road.offsets.iter().map(|offset| offset.start));
    for lane in &of.lanes {
        breaks.extend(lane.widths.iter().map(|width| of.start + width.start));
        breaks.extend(lane.heights.iter().map(|height| of.start + height.start));
    }
    breaks.retain(|&s| (begin..=end).contains(&s));
    breaks.sort_by(f64::total_cmp);
    breaks.dedup_by(|after, before| *after - *before < SHORTEST);
    if let Some(last) = breaks.last_mut() {
        // The section's end stays, whichever break is dropped beside it.
        *last = end.max(begin);
    }
    if breaks.len() < 2 {
        breaks = vec![begin, end.max(begin)];
    }
    let mut samples: Vec<Sample> = Vec::new();
    for pair in breaks.windows(2) {
        // The stretch's end is approached from within: another record begins there.
        let (from, to) =
            (Sample::new(road, of, pair[0]), Sample::new(road, of, pair[1] - 1e-9 * (pair[1] - pair[0]).min(1.0)));
        if samples.last().is_none_or(|last| 1e-7 < last.apart(&from)) {
            samples.push(from.clone());
        }
        let pieces = ((pair[1] - pair[0]) / LONGEST_STEP).ceil().max(1.0) as usize;
        let mut before = from;
        for piece in 1..=pieces {
            let s = before.s + (to.s - before.s) / (pieces + 1 - piece) as f64;
            let after = if piece == pieces { to.clone() } else { Sample::new(road, of, s) };
            halved(road, of, &before, &after, tolerance, 0, &mut samples);
            before = after;
        }
    }
    let kinds = (0..of.lanes.len()).map(|index| kind(road, of, index, &breaks));
    let strip = |(index_of_lane, (lane, kind)): (usize, (&Lane, Kind))| {
        let edge = |inner: bool| {
            samples.iter().map(move |sample| sample.edges[index_of_lane][usize::from(!inner)]).collect::<Vec<_>>()
        };
        let (inner, outer) = (edge(true), edge(false));
        let centre = inner.iter().zip(&outer).map(|(&one, &other)| (one + other) / 2.0).collect();
        let (left, right) = if 0 < lane.id { (outer, inner) } else { (inner, outer) };
        let backward = (0 < lane.id) != lane.reversed;
        Strip { road: index, section, id: lane.id, backward, kind, left, right, centre }
    };
    of.lanes.iter().zip(kinds).enumerate().map(strip).collect()
}

/// What a lane of a section is for, once its height and width are known.
fn kind(road: &RoadRecord, section: &Section, index: usize, breaks: &[f64]) -> Kind {
    let lane = &section.lanes[index];
    let raised = lane.heights.iter().any(|height| RAISED < height.height);
    match lane.kind {
        Kind::Lane | Kind::Kerb | Kind::Apron => lane.kind,
        _ if !raised => lane.kind,
        _ => {
            let width = |s: f64| {
                if lane.bordered {
                    let [inner, outer] = Sample::new(road, section, s).edges[index];
                    return inner.distance(outer);
                }
                active(&lane.widths, s - section.start, |width| width.start)
                    .map_or(0.0, |width| width.at(s - section.start))
            };
            let narrow = breaks.windows(2).all(|pair| width((pair[0] + pair[1]) / 2.0) <= KERB_WIDTH + 1e-6);
            if narrow { Kind::Kerb } else { Kind::Solid }
        }
    }
}

/// The edges of a section's lanes at one station.
#[derive(Debug, Clone)]
struct Sample {
    s: f64,
    /// Inner and outer edge of each lane.
    edges: Vec<[DVec2; 2]>,
}

impl Sample {
    fn new(road: &RoadRecord, section: &Section, s: f64) -> Sample {
        let (p, heading) = road.pose(s);
        let across = DVec2::from_angle(heading).perp();
        let offset = road.offset_at(s);
        let offset = if offset.is_finite() { offset.clamp(-FARTHEST, FARTHEST) } else { 0.0 };
        let local = s - section.start;
        let mut edges = vec![[p; 2]; section.lanes.len()];
        // Lanes stand from left to right, and widths add up from the centre outwards.
        let first_right = section.lanes.partition_point(|lane| 0 < lane.id);
        let sides: [(Vec<usize>, f64); 2] =
            [((0..first_right).rev().collect(), 1.0), ((first_right..section.lanes.len()).collect(), -1.0)];
        for (lanes, side) in sides {
            let mut inner = offset;
            for index in lanes {
                let lane = &section.lanes[index];
                let value = active(&lane.widths, local, |width| width.start).map_or(0.0, |width| width.at(local));
                let value = if value.is_finite() { value.clamp(-FARTHEST, FARTHEST) } else { 0.0 };
                let outer = if lane.bordered {
                    side * (side * inner).max(value.abs() + side * offset)
                } else {
                    inner + side * value.max(0.0)
                };
                edges[index] = [p + inner * across, p + outer * across];
                inner = outer;
            }
        }
        Sample { s, edges }
    }

    /// Largest distance between the edges of two samples (m).
    fn apart(&self, other: &Sample) -> f64 {
        self.edges
            .iter()
            .flatten()
            .zip(other.edges.iter().flatten())
            .map(|(one, other)| one.distance(*other))
            .fold(0.0, f64::max)
    }

    /// Largest distance of this sample's edges from the chords between those of two others (m).
    fn off_chord(&self, before: &Sample, after: &Sample) -> f64 {
        let all = self.edges.iter().flatten().zip(before.edges.iter().flatten().zip(after.edges.iter().flatten()));
        all.map(|(&p, (&from, &to))| crate::geometry::Piece::Segment { from, to }.distance(p)).fold(0.0, f64::max)
    }
}

/// Adds the samples after `before` up to `after`.
fn halved(
    road: &RoadRecord,
    section: &Section,
    before: &Sample,
    after: &Sample,
    tolerance: f64,
    depth: u32,
    samples: &mut Vec<Sample>,
) {
    let at = |fraction: f64| Sample::new(road, section, before.s + fraction * (after.s - before.s));
    let middle = at(0.5);
    // A curve that turns both ways may cross the chord's middle.
    let bends = |sample: &Sample| tolerance < sample.off_chord(before, after);
    if depth < MOST_HALVINGS
        && (bends(&middle) || (depth < 2 && [0.25, 0.75].into_iter().any(|fraction| bends(&at(fraction)))))
    {
        halved(road, section, before, &middle, tolerance, depth + 1, samples);
        halved(road, section, &middle, after, tolerance, depth + 1, samples);
    } else {
        samples.push(after.clone());
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::map::opendrive::Hand;
    use crate::map::opendrive::read::records;

    fn map(plan: &str, lanes: &str, length: f64) -> Records {
        let text = format!(
            r#"<OpenDRIVE><road id="1" length="{length}" junction="-1">
            <planView>{plan}</planView><lanes>{lanes}</lanes></road></OpenDRIVE>"#
        );
        records(Path::new("test.xodr"), &text, Hand::Map).unwrap()
    }

    const LANES: &str = r#"<laneOffset s="0" a="0.5" b="0" c="0" d="0"/><laneSection s="0">
        <left><lane id="1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane></left>
        <right><lane id="-1" type="driving"><width sOffset="0" a="4" b="0" c="0" d="0"/></lane>
        <lane id="-2" type="shoulder"><width sOffset="0" a="0.6" b="0" c="0" d="0"/>
        <height sOffset="0" inner="0.15" outer="0.15"/></lane>
        </right></laneSection>"#;

    #[test]
    fn lanes_of_a_circular_road_are_circles_to_a_millimetre() {
        let plan =
            r#"<geometry s="0" x="20" y="0" hdg="1.5707963267948966" length="60"><arc curvature="0.05"/></geometry>"#;
        let strips = strips(&map(plan, LANES, 60.0), 1e-3).unwrap();
        // The centre of the road's circle is the origin, and left is inwards.
        for (strip, (id, inner, outer)) in strips.iter().zip([(1, 16.5, 19.5), (-1, 19.5, 23.5), (-2, 23.5, 24.1)]) {
            assert_eq!(strip.id, id);
            let middle = (inner + outer) / 2.0;
            for (edge, radius) in [(&strip.left, inner), (&strip.right, outer), (&strip.centre, middle)] {
                assert!(edge.iter().all(|p| (p.length() - radius).abs() < 1e-9), "{id}");
                let chords = edge.windows(2).map(|pair| radius - ((pair[0] + pair[1]) / 2.0).length());
                assert!(chords.fold(0.0, f64::max) < 1.1e-3);
            }
        }
        assert_eq!(strips.iter().map(|strip| strip.kind).collect::<Vec<_>>(), [Kind::Lane, Kind::Lane, Kind::Kerb]);
    }

    #[test]
    fn a_lane_that_widens_by_a_cubic_has_its_edge_on_it_and_a_sample_at_every_record() {
        let plan = r#"<geometry s="0" x="0" y="0" hdg="0" length="30"><line/></geometry>
            <geometry s="30" x="30" y="0" hdg="0" length="20"><line/></geometry>"#;
        let lanes = r#"<laneSection s="0"><right><lane id="-1" type="driving">
            <width sOffset="0" a="3" b="0" c="0.01" d="-0.0003"/><width sOffset="17" a="3.5" b="0" c="0" d="0"/>
            </lane></right></laneSection>"#;
        let strips = strips(&map(plan, lanes, 50.0), 1e-3).unwrap();
        let right = &strips[0].right;
        for p in right.iter().filter(|p| p.x < 16.9) {
            assert!((p.y + 3.0 + 0.01 * p.x * p.x - 0.0003 * p.x.powi(3)).abs() < 1e-9);
        }
        for s in [0.0, 17.0, 30.0, 50.0] {
            assert!(right.iter().any(|p| (p.x - s).abs() < 1e-6), "{s}");
        }
        // The width jumps at 17 m, so the edge has a sample on either side of the jump.
        let before = 3.0 + 0.01 * 289.0 - 0.0003 * 4913.0;
        assert!(right.iter().any(|p| (p.x - 17.0).abs() < 1e-6 && (p.y + before).abs() < 1e-6));
        assert!(right.iter().any(|p| (p.x - 17.0).abs() < 1e-6 && (p.y + 3.5).abs() < 1e-6));
    }

    #[test]
    fn a_left_hand_road_is_the_mirror_image_of_the_same_road_with_right_hand_traffic() {
        let plan = |hand: &str, curvature: f64| {
            let text = format!(
                r#"<OpenDRIVE><road id="1" length="40" junction="-1" rule="{hand}"><planView>
                <geometry s="0" x="1" y="2" hdg="0.3" length="40"><arc curvature="{curvature}"/></geometry></planView>
                <lanes>{LANES}</lanes></road></OpenDRIVE>"#
            );
            strips(&records(Path::new("test.xodr"), &text, Hand::Map).unwrap(), 1e-3).unwrap()
        };
        let (right, left) = (plan("RHT", 0.02), plan("LHT", 0.02));
        for strip in &right {
            let twin = left.iter().find(|other| other.id == -strip.id).unwrap();
            let mirrored =
                strip.centre.iter().zip(&twin.centre).all(|(p, q)| p.distance(DVec2::new(q.x, -q.y)) < 1e-12);
            assert!(mirrored && strip.centre.len() == twin.centre.len());
        }
    }
}
