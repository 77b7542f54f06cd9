//! Which lane leads into which: a directed graph of strips, from the links of the file where they fit and from place
//! and heading where they do not.

use std::collections::HashMap;

use glam::DVec2;

use super::lanes::Strip;
use super::records::{Kind, Link, Records};

/// A joint that jumps further is not believed \[m].
const JUMP: f64 = 0.5;
/// How far a lane is looked for that begins where one ends \[m].
const SEARCH: f64 = 1.5;
/// A joint that turns more is not believed \[rad].
const TURN: f64 = 0.6;

/// The lanes that follow each lane, by index of its strip; empty for strips that are no lanes.
#[derive(Debug, Clone)]
pub(super) struct Graph {
    pub(super) next: Vec<Vec<usize>>,
    pub(super) previous: Vec<Vec<usize>>,
    /// Joints that were replaced or dropped, and why.
    pub(super) warnings: Vec<String>,
}

/// Where a lane begins or ends, and in which direction it is travelled there.
#[derive(Debug, Clone, Copy)]
struct End {
    at: DVec2,
    ahead: DVec2,
}

impl End {
    /// The beginning and the end of a path; `None` if it has no length.
    fn both(path: &[DVec2]) -> Option<[End; 2]> {
        // Directions over at least a centimetre, if the path is as long.
        let (&first, &last) = (path.first()?, path.last()?);
        let ahead = path.iter().find(|p| 0.01 < p.distance(first)).unwrap_or(&last);
        let behind = path.iter().rev().find(|p| 0.01 < p.distance(last)).unwrap_or(&first);
        let (from, to) = ((*ahead - first).try_normalize()?, (last - *behind).try_normalize()?);
        Some([End { at: first, ahead: from }, End { at: last, ahead: to }])
    }

    /// Distance to the beginning of another lane, and the angle between them \[m], \[rad].
    fn to(&self, next: &End) -> (f64, f64) {
        (self.at.distance(next.at), self.ahead.angle_to(next.ahead).abs())
    }

    fn leads_into(&self, next: &End) -> bool {
        let (jump, turn) = self.to(next);
        jump <= JUMP && turn <= TURN
    }
}

impl Graph {
    /// The graph of a map's strips.
    pub(super) fn new(records: &Records, strips: &[Strip]) -> Graph {
        let ends: Vec<Option<[End; 2]>> =
            strips.iter().map(|strip| if strip.kind == Kind::Lane { End::both(&strip.path()) } else { None }).collect();
        let place: HashMap<(usize, usize, i32), usize> =
            strips.iter().enumerate().map(|(index, strip)| ((strip.road, strip.section, strip.id), index)).collect();
        let starts = Starts::new(&ends);
        let mut graph = Graph { next: vec![Vec::new(); strips.len()], previous: vec![Vec::new(); strips.len()], warnings: Vec::new() };
        for (index, strip) in strips.iter().enumerate() {
            let Some([_, end]) = ends[index] else { continue };
            let mut linked: Vec<usize> = linked(records, strip, true).into_iter().filter_map(|key| place.get(&key).copied()).collect();
            linked.sort_unstable();
            linked.dedup();
            let (fits, wrong): (Vec<usize>, Vec<usize>) = linked
                .into_iter()
                .filter(|&next| ends[next].is_some())
                .partition(|&next| ends[next].is_some_and(|[start, _]| end.leads_into(&start)));
            graph.next[index] = fits;
            if wrong.is_empty() {
                continue;
            }
            let name = |index: usize| format!("road {} lane {}", records.roads[strips[index].road].id, strips[index].id);
            let jump = wrong.iter().filter_map(|&next| Some(end.to(&ends[next]?[0]).0)).fold(0.0, f64::max);
            let instead = match starts.nearest(&end, &ends).filter(|&next| next != index) {
                Some(next) if graph.next[index].contains(&next) => "it is left out".into(),
                Some(next) => {
                    graph.next[index].push(next);
                    if wrong.contains(&next) {
                        "no lane begins nearer, so it stays".into()
                    } else {
                        format!("{}, which begins nearer, is taken instead", name(next))
                    }
                }
                None => "no lane begins near, so it is left out".to_owned(),
            };
            graph.warnings.push(format!("{}: its link to {} jumps by {jump:.2} m or turns; {instead}", name(index), name(wrong[0])));
        }
        // Many files say of a junction's lane where it comes from, but not of the lane before it where it leads.
        for (index, strip) in strips.iter().enumerate() {
            let Some([start, _]) = ends[index] else { continue };
            for before in linked(records, strip, false).into_iter().filter_map(|key| place.get(&key).copied()) {
                let fits = before != index && ends[before].is_some_and(|[_, end]| end.leads_into(&start));
                if fits && !graph.next[before].contains(&index) {
                    graph.next[before].push(index);
                }
            }
        }
        for index in 0..strips.len() {
            for next in graph.next[index].clone() {
                graph.previous[next].push(index);
            }
        }
        graph
    }
}

/// Roads, sections and lanes that the file says follow a lane in its direction of travel, or precede it.
fn linked(records: &Records, strip: &Strip, follow: bool) -> Vec<(usize, usize, i32)> {
    let road = &records.roads[strip.road];
    let Some(lane) = road.sections[strip.section].lanes.iter().find(|lane| lane.id == strip.id) else { return Vec::new() };
    let forward = (strip.id < 0) == follow;
    let to = if forward { lane.successor } else { lane.predecessor };
    if forward && strip.section + 1 < road.sections.len() {
        return to.map(|id| (strip.road, strip.section + 1, id)).into_iter().collect();
    }
    if !forward && 0 < strip.section {
        return to.map(|id| (strip.road, strip.section - 1, id)).into_iter().collect();
    }
    let section = |road: usize, at_start: bool| if at_start { 0 } else { records.roads[road].sections.len().saturating_sub(1) };
    match if forward { &road.successor } else { &road.predecessor } {
        None => Vec::new(),
        Some(Link::Road(id, at_start)) => {
            let next = records.by_id.get(id).copied();
            next.zip(to).map(|(next, id)| (next, section(next, *at_start), id)).into_iter().collect()
        }
        Some(Link::Junction(id)) => {
            let all = records.junctions.get(id).into_iter().flatten().filter(|connection| connection.incoming == road.id);
            let mut found = Vec::new();
            for connection in all {
                let Some(&next) = records.by_id.get(&connection.connecting) else { continue };
                for (_, to) in connection.lanes.iter().filter(|(from, _)| *from == strip.id) {
                    found.push((next, section(next, connection.at_start), *to));
                }
            }
            found
        }
    }
}

/// The beginnings of lanes in square cells, to find those near a point.
struct Starts {
    cells: HashMap<(i64, i64), Vec<usize>>,
}

impl Starts {
    fn cell(p: DVec2) -> (i64, i64) {
        ((p.x / SEARCH).floor() as i64, (p.y / SEARCH).floor() as i64)
    }

    fn new(ends: &[Option<[End; 2]>]) -> Starts {
        let mut cells: HashMap<(i64, i64), Vec<usize>> = HashMap::new();
        for (index, end) in ends.iter().enumerate() {
            if let Some([start, _]) = end {
                cells.entry(Starts::cell(start.at)).or_default().push(index);
            }
        }
        Starts { cells }
    }

    /// The lane that begins nearest in place and heading to where another ends.
    fn nearest(&self, end: &End, ends: &[Option<[End; 2]>]) -> Option<usize> {
        let (column, row) = Starts::cell(end.at);
        let around = (-1..=1).flat_map(|x| (-1..=1).map(move |y| (column.wrapping_add(x), row.wrapping_add(y))));
        let near = around.filter_map(|cell| self.cells.get(&cell)).flatten();
        let fits = near.filter_map(|&index| {
            let start = ends[index]?[0];
            let (jump, turn) = end.to(&start);
            (jump <= SEARCH && turn <= TURN).then_some((jump + turn, index))
        });
        fits.min_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1))).map(|(_, index)| index)
    }
}
