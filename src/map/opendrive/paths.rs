//! Ways through a ring: from a lane that enters to every exit, along the lane graph.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap, HashSet};

use glam::DVec2;

use super::crossings::{ArmLanes, Crossing};
use super::graph::Graph;
use super::lanes::Strip;
use super::links::reason;
use super::records::Records;

/// A way through the ring: arm and lane from the kerb by which it leaves, and the strips along it.
pub(super) type Way = ((usize, usize), Vec<usize>);

/// Lanes that an approach or a departure is made of at most.
const MOST_LANES: usize = 500;
/// A joint of two lanes is spread over this length on either side (m).
const SPREAD: f64 = 5.0;

/// A lane that the search has reached.
#[derive(PartialEq)]
struct Reached {
    length: f64,
    strip: usize,
}

impl Eq for Reached {}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        other.length.total_cmp(&self.length).then(other.strip.cmp(&self.strip))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The lanes around a ring, by index of the map's strip, with the ring's centre as origin.
pub(super) struct Network<'a> {
    pub(super) records: &'a Records,
    pub(super) graph: &'a Graph,
    pub(super) strips: HashMap<usize, &'a Strip>,
}

impl Network<'_> {
    /// The centre line of a lane in its direction of travel (m).
    pub(super) fn path(&self, strip: usize) -> Vec<DVec2> {
        self.strips.get(&strip).map_or(Vec::new(), |strip| strip.path())
    }

    /// What a lane is called in messages.
    pub(super) fn name(&self, strip: usize) -> String {
        self.strips.get(&strip).map(|strip| self.records.lane_name(strip)).unwrap_or_default()
    }

    /// Why the lanes of a way begin or end within the world; `None` if they reach its edge.
    pub(super) fn ends_early(&self, way: &[usize], extent: f64, at_end: bool) -> Option<String> {
        let strip = if at_end { way.last() } else { way.first() }?;
        let path = self.path(*strip);
        let end = if at_end { path.last() } else { path.first() }?;
        (end.length() < extent).then_some(())?;
        let beyond = if at_end { &self.graph.next[*strip] } else { &self.graph.previous[*strip] };
        if beyond.iter().any(|strip| way.contains(strip)) {
            return Some(format!("{} closes a ring there", self.name(*strip)));
        }
        self.strips.get(strip).map(|strip| reason(self.records, strip, at_end))
    }

    fn length(&self, strip: usize) -> f64 {
        self.strips.get(&strip).map_or(0.0, |strip| strip.length())
    }

    /// The shortest ways from a lane that enters to every lane that leaves.
    pub(super) fn ways(&self, entry: &Crossing, arms: &[ArmLanes]) -> Vec<Way> {
        let mut exits: HashMap<usize, (usize, usize)> = HashMap::new();
        for (arm, lanes) in arms.iter().enumerate() {
            for (lane, crossing) in lanes.exits.iter().enumerate() {
                exits.extend(crossing.strips.iter().map(|&strip| (strip, (arm, lane))));
            }
        }
        let mut from: HashMap<usize, Option<usize>> = HashMap::new();
        let mut best: HashMap<usize, f64> = HashMap::new();
        let mut queue = BinaryHeap::new();
        for &strip in &entry.strips {
            best.insert(strip, 0.0);
            from.insert(strip, None);
            queue.push(Reached { length: 0.0, strip });
        }
        let (mut done, mut left): (HashSet<usize>, HashSet<(usize, usize)>) = Default::default();
        let mut ways = Vec::new();
        while let Some(Reached { length, strip }) = queue.pop() {
            if !done.insert(strip) {
                continue;
            }
            if let Some(&exit) = exits.get(&strip) {
                if left.insert(exit) {
                    let mut way = vec![strip];
                    while let Some(Some(before)) = from.get(&way[way.len() - 1]) {
                        way.push(*before);
                    }
                    way.reverse();
                    ways.push((exit, way));
                }
                continue;
            }
            for &next in self.graph.next[strip].iter().filter(|next| self.strips.contains_key(next)) {
                let length = length + self.length(next);
                if best.get(&next).is_none_or(|&known| length < known) {
                    best.insert(next, length);
                    from.insert(next, Some(strip));
                    queue.push(Reached { length, strip: next });
                }
            }
        }
        ways
    }

    /// The least distance of a way from the ring's centre (m).
    pub(super) fn nearest_to_centre(&self, way: &[usize]) -> f64 {
        let strips = way.iter().filter_map(|strip| self.strips.get(strip));
        strips.flat_map(|strip| &strip.centre).map(|p| p.length()).fold(f64::INFINITY, f64::min)
    }

    /// Where lanes from or to a crossing pass the circle of a radius around the centre, the nearest such place along
    /// them.
    pub(super) fn gate(&self, crossing: &Crossing, radius: f64) -> Option<DVec2> {
        let mut seen: HashSet<usize> = crossing.strips.iter().copied().collect();
        let mut queue: std::collections::VecDeque<usize> = crossing.strips.iter().copied().collect();
        while let Some(strip) = queue.pop_front() {
            let mut path = self.path(strip);
            if !crossing.inwards {
                path.reverse();
            }
            if let Some(pair) = path.windows(2).find(|pair| radius <= pair[0].length() && pair[1].length() < radius) {
                let (far, near) = (pair[0].length(), pair[1].length());
                return Some(pair[0].lerp(pair[1], (far - radius) / (far - near)));
            }
            let onward = if crossing.inwards { &self.graph.next[strip] } else { &self.graph.previous[strip] };
            queue.extend(onward.iter().copied().filter(|next| self.strips.contains_key(next) && seen.insert(*next)));
        }
        None
    }

    /// How much a lane turns from its beginning to its end (rad).
    fn turn(&self, strip: usize) -> f64 {
        let path = self.path(strip);
        match path.as_slice() {
            [a, b, .., c, d] => (*b - *a).angle_to(*d - *c).abs(),
            _ => 0.0,
        }
    }

    /// The way continued at both ends, straight on where lanes part, until it is `extent` from the centre (m).
    pub(super) fn continued(&self, way: &[usize], extent: f64) -> Vec<usize> {
        let mut all = std::collections::VecDeque::from(way.to_vec());
        let straightest = |of: &[usize], all: &std::collections::VecDeque<usize>| {
            let free = of.iter().copied().filter(|next| self.strips.contains_key(next) && !all.contains(next));
            free.min_by(|&one, &other| self.turn(one).total_cmp(&self.turn(other)).then(one.cmp(&other)))
        };
        while all.len() < way.len() + MOST_LANES {
            let Some(&first) = all.front() else { break };
            let outside = self.path(first).first().is_none_or(|p| extent < p.length());
            let Some(before) = straightest(&self.graph.previous[first], &all).filter(|_| !outside) else { break };
            all.push_front(before);
        }
        while all.len() < way.len() + 2 * MOST_LANES {
            let Some(&last) = all.back() else { break };
            let outside = self.path(last).last().is_none_or(|p| extent < p.length());
            let Some(next) = straightest(&self.graph.next[last], &all).filter(|_| !outside) else { break };
            all.push_back(next);
        }
        all.into()
    }

    /// The centre line along lanes, their joints spread so that it has no step, and the largest step (m).
    pub(super) fn line(&self, way: &[usize]) -> (Vec<DVec2>, f64) {
        let mut points: Vec<DVec2> = Vec::new();
        let mut stations: Vec<f64> = Vec::new();
        let mut joints: Vec<(usize, DVec2)> = Vec::new();
        for &strip in way {
            let path = dense(&self.path(strip));
            if let (Some(&last), Some(&first)) = (points.last(), path.first()) {
                joints.push((points.len(), first - last));
            }
            for (i, &p) in path.iter().enumerate() {
                let before = stations.last().copied().unwrap_or(0.0);
                stations.push(if i == 0 { before } else { before + p.distance(path[i - 1]) });
                points.push(p);
            }
        }
        let largest = joints.iter().map(|(_, step)| step.length()).fold(0.0, f64::max);
        let mut moved = points.clone();
        for (first, step) in joints {
            let at = stations[first];
            let spread = SPREAD.min(20.0 * step.length() + 0.5);
            for i in 0..points.len() {
                let away = (stations[i] - at).abs() / spread;
                if away < 1.0 {
                    // Level at both ends, so that the heading keeps its value there.
                    let weight = 1.0 - away * away * (3.0 - 2.0 * away);
                    moved[i] += step * weight * if i < first { 0.5 } else { -0.5 };
                }
            }
        }
        (moved, largest)
    }
}

/// The polyline with a point every half metre, where a joint may have to be spread.
fn dense(path: &[DVec2]) -> Vec<DVec2> {
    let mut dense: Vec<DVec2> = path.first().copied().into_iter().collect();
    for pair in path.windows(2) {
        let parts = (pair[0].distance(pair[1]) / 0.5).ceil().clamp(1.0, 1e4);
        dense.extend((1..=parts as usize).map(|part| pair[0].lerp(pair[1], part as f64 / parts)));
    }
    dense
}

/// The stretch of a line around its point nearest to the origin that lies within `extent` of the origin (m).
pub(super) fn within(line: &[DVec2], extent: f64) -> Vec<DVec2> {
    if line.is_empty() {
        return Vec::new();
    }
    let nearest = (0..line.len()).fold(0, |best, i| if line[i].length() < line[best].length() { i } else { best });
    let (mut first, mut last) = (nearest, nearest);
    while 0 < first && line[first - 1].length() < extent {
        first -= 1;
    }
    while last + 1 < line.len() && line[last + 1].length() < extent {
        last += 1;
    }
    let cut = |inside: DVec2, outside: DVec2| {
        let (near, far) = (inside.length(), outside.length());
        inside.lerp(outside, ((extent - near) / (far - near)).clamp(0.0, 1.0))
    };
    let mut within = Vec::new();
    if 0 < first {
        within.push(cut(line[first], line[first - 1]));
    }
    within.extend(&line[first..=last]);
    if last + 1 < line.len() {
        within.push(cut(line[last], line[last + 1]));
    }
    within
}
