//! Which lane leads into which: a directed graph of strips, from the links of the file where they fit and from place
//! and heading where they do not.

use std::collections::HashMap;

use glam::DVec2;

use super::cells::Cells;
use super::lanes::Strip;
use super::links::{Contact, contacts};
use super::records::{Concerns, Kind, Records, Warning};
use super::sections::SHORTEST;

/// A joint that jumps further is not believed (m).
const JUMP: f64 = 0.5;
/// How far a lane is looked for that begins where one ends (m).
const SEARCH: f64 = 1.5;
/// A joint that turns more is not believed (rad).
const TURN: f64 = 0.6;

/// Most lanes of no length that a link is followed across.
const MOST_PASSED: usize = 100;

/// The lanes that follow each lane, by index of its strip; empty for strips that are no lanes.
#[derive(Debug, Clone)]
pub(super) struct Graph {
    pub(super) next: Vec<Vec<usize>>,
    pub(super) previous: Vec<Vec<usize>>,
    /// Joints that were replaced or dropped, and why.
    pub(super) warnings: Vec<Warning>,
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
        if path.iter().all(|p| p.distance(first) < SHORTEST) {
            return None;
        }
        let ahead = path.iter().find(|p| 0.01 < p.distance(first)).unwrap_or(&last);
        let behind = path.iter().rev().find(|p| 0.01 < p.distance(last)).unwrap_or(&first);
        let (from, to) = ((*ahead - first).try_normalize()?, (last - *behind).try_normalize()?);
        Some([End { at: first, ahead: from }, End { at: last, ahead: to }])
    }

    /// Distance to the beginning of another lane, and the angle between them (m), (rad).
    fn to(&self, next: &End) -> (f64, f64) {
        (self.at.distance(next.at), self.ahead.angle_to(next.ahead).abs())
    }

    fn leads_into(&self, next: &End) -> bool {
        let (jump, turn) = self.to(next);
        jump <= JUMP && turn <= TURN
    }
}

/// The lanes of a map by road, section and number, to follow its links.
struct Places<'a> {
    records: &'a Records,
    strips: &'a [Strip],
    ends: Vec<Option<[End; 2]>>,
    index: HashMap<(usize, usize, i32), usize>,
}

impl<'a> Places<'a> {
    fn new(records: &'a Records, strips: &'a [Strip]) -> Places<'a> {
        let ends =
            strips.iter().map(|strip| if strip.kind == Kind::Lane { End::both(&strip.path()) } else { None }).collect();
        let index =
            strips.iter().enumerate().map(|(index, strip)| ((strip.road, strip.section, strip.id), index)).collect();
        Places { records, strips, ends, index }
    }

    /// The lanes that the file says follow one, or precede it; those of no length are passed over.
    fn linked(&self, strip: usize, follow: bool) -> Vec<usize> {
        let (mut found, mut seen, mut open) = (Vec::new(), vec![strip], vec![strip]);
        while let Some(strip) = open.pop() {
            for Contact { road, section, lane } in contacts(self.records, &self.strips[strip], follow) {
                let Some(&next) = lane.and_then(|lane| self.index.get(&(road, section, lane))) else { continue };
                if self.ends[next].is_some() || self.strips[next].kind != Kind::Lane {
                    found.push(next);
                } else if !seen.contains(&next) && seen.len() < MOST_PASSED {
                    seen.push(next);
                    open.push(next);
                }
            }
        }
        found
    }

    /// Sections that the file says a lane leads to, or comes from, without naming a lane of theirs that there is.
    fn unnamed(&self, strip: usize, follow: bool) -> impl Iterator<Item = Contact> {
        let names = |contact: &Contact| {
            contact.lane.is_some_and(|lane| self.index.contains_key(&(contact.road, contact.section, lane)))
        };
        contacts(self.records, &self.strips[strip], follow).into_iter().filter(move |contact| !names(contact))
    }

    /// The id of a lane's road.
    fn road(&self, index: usize) -> &str {
        &self.records.roads[self.strips[index].road].id
    }

    /// What a lane is called.
    fn name(&self, index: usize) -> String {
        self.records.lane_name(&self.strips[index])
    }
}

impl Graph {
    /// The graph of a map's strips.
    pub(super) fn new(records: &Records, strips: &[Strip]) -> Graph {
        let places = Places::new(records, strips);
        let ends = &places.ends;
        let starts = starts(ends);
        let mut graph = Graph {
            next: vec![Vec::new(); strips.len()],
            previous: vec![Vec::new(); strips.len()],
            warnings: Vec::new(),
        };
        for index in 0..strips.len() {
            let Some([_, end]) = ends[index] else { continue };
            let mut linked = places.linked(index, true);
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
            let misfit = misfit(&end, wrong.iter().filter_map(|&next| Some(ends[next]?[0])));
            let near = nearest(&starts, &end, ends).filter(|&next| next != index);
            let instead = match near {
                Some(next) if graph.next[index].contains(&next) => "it is left out".into(),
                Some(next) => {
                    graph.next[index].push(next);
                    if wrong.contains(&next) {
                        "no lane begins nearer, so it stays".into()
                    } else {
                        format!("{}, which begins nearer, is taken instead", places.name(next))
                    }
                }
                None => "no lane begins near, so it is left out".to_owned(),
            };
            let text = format!("{}: its link to {} {misfit}; {instead}", places.name(index), places.name(wrong[0]));
            // Where nothing else follows, an arm may be lost.
            let concerns = if near.is_none() { Concerns::Road(places.road(index).to_owned()) } else { Concerns::Map };
            graph.warnings.push(Warning { concerns, text });
        }
        // Many files say of a junction's lane where it comes from, but not of the lane before it where it leads.
        for (index, start) in ends.iter().enumerate() {
            let Some([start, _]) = start else { continue };
            for before in places.linked(index, false) {
                let fits = before != index && ends[before].is_some_and(|[_, end]| end.leads_into(start));
                if fits && !graph.next[before].contains(&index) {
                    graph.next[before].push(index);
                }
            }
        }
        graph.join_unnamed(&places);
        for index in 0..strips.len() {
            for next in graph.next[index].clone() {
                graph.previous[next].push(index);
            }
        }
        graph
    }

    /// Joins lanes by place and heading where their roads or sections are linked and the file names no lane.
    fn join_unnamed(&mut self, places: &Places) {
        let mut reached = vec![false; self.next.len()];
        self.next.iter().flatten().for_each(|&next| reached[next] = true);
        let has_next: Vec<bool> = self.next.iter().map(|next| !next.is_empty()).collect();
        let mut lanes: HashMap<(usize, usize), Vec<usize>> = HashMap::new();
        for (index, strip) in places.strips.iter().enumerate().filter(|(index, _)| places.ends[*index].is_some()) {
            lanes.entry((strip.road, strip.section)).or_default().push(index);
        }
        for (index, follow) in (0..places.strips.len()).flat_map(|index| [(index, true), (index, false)]) {
            let Some([start, end]) = places.ends[index] else { continue };
            if if follow { has_next[index] } else { reached[index] } {
                continue;
            }
            for Contact { road, section, .. } in places.unnamed(index, follow) {
                let fits = lanes.get(&(road, section)).into_iter().flatten().filter_map(|&other| {
                    let [other_start, other_end] = places.ends[other]?;
                    let (from, to) = if follow { (end, other_start) } else { (other_end, start) };
                    let free = other != index && !if follow { reached[other] } else { has_next[other] };
                    (free && from.leads_into(&to)).then_some((from.to(&to).0, other))
                });
                let Some((_, other)) = fits.min_by(|one, next| one.0.total_cmp(&next.0)) else { continue };
                let (from, to) = if follow { (index, other) } else { (other, index) };
                if !self.next[from].contains(&to) {
                    self.next[from].push(to);
                    self.warnings.push(Warning::of_map(format!(
                        "{}: has no link to a lane, and is joined to {}, which begins there",
                        places.name(from),
                        places.name(to)
                    )));
                }
            }
        }
    }
}

/// Why links to lanes that begin there are not believed.
fn misfit(end: &End, starts: impl Iterator<Item = End>) -> String {
    let (jump, turn) = starts
        .map(|start| end.to(&start))
        .fold((0.0f64, 0.0f64), |(jump, turn), other| (jump.max(other.0), turn.max(other.1)));
    match (JUMP < jump, TURN < turn) {
        (true, true) => format!("jumps by {jump:.2} m and turns by {:.0} deg", turn.to_degrees()),
        (false, true) => format!("turns by {:.0} deg", turn.to_degrees()),
        _ => format!("jumps by {jump:.2} m"),
    }
}

/// The beginnings of lanes in cells of [`SEARCH`].
fn starts(ends: &[Option<[End; 2]>]) -> Cells<usize> {
    let mut starts = Cells::new(SEARCH);
    for (index, end) in ends.iter().enumerate() {
        if let Some([start, _]) = end {
            starts.insert(start.at, index);
        }
    }
    starts
}

/// The lane that begins nearest in place and heading to where another ends.
fn nearest(starts: &Cells<usize>, end: &End, ends: &[Option<[End; 2]>]) -> Option<usize> {
    let fits = starts.around(end.at).filter_map(|&index| {
        let start = ends[index]?[0];
        let (jump, turn) = end.to(&start);
        (jump <= SEARCH && turn <= TURN).then_some((jump + turn, index))
    });
    fits.min_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1))).map(|(_, index)| index)
}
