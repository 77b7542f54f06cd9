//! Bakes a road's tables: its lines in samples, and every pair of them in zones.

use super::Error;
use super::meetings::{FINE, Part, Points, parts};
use super::network::{
    CELL, Kind, MOST_PATHS, MOST_SOURCES, MOST_ZONES, Network, Pair, Path, Sample, Source, UNIT, Zone,
};
use super::paths::{Course, courses};
use super::units::length;
use crate::map::Road;
use crate::map::ground::Ground;

/// Lines nearer than this cannot both be occupied, not even by vans, whose ends swing out in bends (m).
const HARD: f64 = 2.8;
/// Ring traffic within this distance of the path of an entering car is yielded to, although it does not touch it (m).
const SOFT: f64 = 6.5;
/// Length behind the line on which that is looked for (m).
const SOFT_REACH: f64 = 10.0;
/// The same for a vehicle that may need the lanes beside its own (m).
const WIDE: f64 = 7.5;
/// The length for such a vehicle: a bypass outside the ring comes near it only after 20 m (m).
const WIDE_REACH: f64 = 22.0;
/// Paths that cross at less than this angle are followed through the crossing (rad).
pub(super) const SHALLOW: f64 = 0.8;
/// Paths that meet at less than this angle become one (rad).
const PARALLEL: f64 = 0.2;
/// Points at the same place from which on two paths have become one.
const JOINED: usize = 7;
/// Largest angle to ring traffic beside an entry; the carriageway beside it runs the other way (rad).
const SAME_WAY: f64 = 1.2;
/// Distance of a waiting car's front from the first zone (m).
pub(super) const BEFORE_ZONE: f64 = 0.3;
/// Zones that begin up to here behind the line are those of the entry (m).
pub(super) const ENTRY: f64 = 12.0;
/// Length of the zone on a path of ring traffic that only passes beside (m).
const SOFT_LENGTH: f64 = 2.0;
/// Longest path: a pair has its ends in 8 bits of 2 m (m).
const LONGEST: f64 = 508.0;

/// Where paths a and b meet, in metres.
#[derive(Clone)]
pub(super) struct Meeting {
    pub a: [f64; 2],
    pub b: [f64; 2],
    delta: f64,
    kind: Kind,
    /// Whether the paths become one rather than cross.
    joins: bool,
    /// Whether b is a lane of the same arm that runs the other way.
    pub is_oncoming: bool,
}

impl Network {
    /// The tables of a road, as it is driven.
    ///
    /// # Errors
    ///
    /// [`Error::TooLarge`], of a road that is larger or has more arms than the tables hold.
    pub fn bake(road: &Road) -> Result<Network, Error> {
        let ground = road.ground();
        let courses = courses(ground);
        check(road, &courses)?;
        let fine: Vec<Points> = courses.iter().map(|course| Points::of(&course.line)).collect();
        let mut meetings = met(&fine, ground.outer_radius);
        // Nobody waits for those who come the other way beside a lane of an arm.
        meetings.iter_mut().for_each(|of_pair| of_pair.retain(|meeting| !meeting.is_oncoming));
        let (lines, clears) = lines(&courses, &meetings);
        add_beside(&courses, &fine, &lines, &mut meetings);
        let sources = sources(&courses);
        if MOST_SOURCES < sources.len() {
            return Err(too_large(road, "entry lanes", sources.len(), MOST_SOURCES));
        }
        let n_zones = meetings.iter().map(Vec::len).sum();
        if MOST_ZONES < n_zones {
            return Err(too_large(road, "zones", n_zones, MOST_ZONES));
        }
        Ok(tables(ground, &courses, &meetings, sources, &lines, &clears))
    }
}

pub(super) fn too_large(road: &Road, of: &'static str, value: usize, most: usize) -> Error {
    Error::TooLarge { road: road.name.clone(), of, value, most }
}

fn check(road: &Road, courses: &[Course]) -> Result<(), Error> {
    if MOST_PATHS < courses.len() {
        return Err(too_large(road, "routes", courses.len(), MOST_PATHS));
    }
    let longest = courses.iter().map(|course| course.line.length()).fold(0.0, f64::max);
    if LONGEST < longest {
        return Err(too_large(road, "m is the length of its longest route", longest.ceil() as usize, LONGEST as usize));
    }
    Ok(())
}

/// The zones of every ordered pair in which both paths cannot be occupied. Those of (b, a) are those of (a, b) with the
/// paths exchanged, so that two cars always agree on who is ahead.
///
/// Outside the outer radius are the arms, whose lanes of both directions may lie nearer to each other than [`HARD`].
pub(super) fn met(fine: &[Points], outer_radius: f64) -> Vec<Vec<Meeting>> {
    let n = fine.len();
    let mut meetings = vec![Vec::new(); n * n];
    for a in 0..n {
        for b in a..n {
            let found = parts(&fine[a], &fine[b], HARD, 0..usize::MAX);
            let of = |part: &Part, [a, b]: [usize; 2]| {
                let [at_a, at_b] = part.nearest;
                let angle = fine[a].angle(at_a, &fine[b], at_b);
                let joins = angle < PARALLEL || JOINED <= part.n_same;
                let kind = if joins || angle < SHALLOW { Kind::Follow } else { Kind::Cross };
                let are_outside =
                    [fine[a].point(at_a), fine[b].point(at_b)].iter().all(|point| outer_radius < point.length());
                let is_oncoming = are_outside && fine[a].is_opposite(at_a, &fine[b], at_b);
                Meeting { a: metres(part.a), b: metres(part.b), delta: part.delta(), kind, joins, is_oncoming }
            };
            if a != b {
                meetings[b * n + a] = found.iter().map(|part| of(&part.transposed(), [b, a])).collect();
            }
            meetings[a * n + b] = found.iter().map(|part| of(part, [a, b])).collect();
        }
    }
    meetings
}

fn metres(indices: [usize; 2]) -> [f64; 2] {
    indices.map(|index| index as f64 * FINE)
}

/// Of every path the station of its line, and where a car that has entered has cleared the lanes that it crosses; 0 if
/// it crosses none (m).
fn lines(courses: &[Course], meetings: &[Vec<Meeting>]) -> (Vec<f64>, Vec<f64>) {
    let n = courses.len();
    let of = |a: usize| {
        let others = (0..n).filter(|&b| courses[b].entry != courses[a].entry);
        let zones: Vec<&Meeting> = others.flat_map(|b| &meetings[a * n + b]).collect();
        let first = zones.iter().map(|zone| zone.a[0]).fold(f64::INFINITY, f64::min);
        let crossed = zones.iter().filter(|zone| !zone.joins && zone.a[0] < first + ENTRY);
        let clear = crossed.map(|zone| zone.a[1]).fold(0.0, f64::max);
        ((first - BEFORE_ZONE).min(courses[a].line.length()), clear)
    };
    (0..n).map(of).unzip()
}

/// Adds the zones in which an entering path a only comes near ring traffic b.
fn add_beside(courses: &[Course], fine: &[Points], lines: &[f64], meetings: &mut [Vec<Meeting>]) {
    let n = courses.len();
    for a in 0..n {
        for b in (0..n).filter(|&b| courses[b].entry != courses[a].entry) {
            let touches = meetings[a * n + b].iter().any(|zone| zone.a[0] < lines[a] + ENTRY);
            let beside = |kind: Kind, within: f64, reach: f64| {
                let rows = (lines[a] / FINE).max(0.0) as usize..((lines[a] + reach) / FINE).max(0.0) as usize;
                let found = parts(&fine[a], &fine[b], within, rows);
                found.into_iter().filter_map(move |part| {
                    let [nearest, at] = metres(part.nearest);
                    let runs_along = fine[a].angle(part.nearest[0], &fine[b], part.nearest[1]) <= SAME_WAY;
                    // What is not behind its own line does not go round yet.
                    let is_in_ring = lines[b] + 1.0 <= at;
                    let (a, b) = match kind {
                        Kind::Soft => ([nearest; 2], [at - SOFT_LENGTH, at]),
                        _ => ([lines[a], nearest], [metres(part.b)[0].max(lines[b]), metres(part.b)[1]]),
                    };
                    let meeting = Meeting { a, b, delta: 0.0, kind, joins: false, is_oncoming: false };
                    (runs_along && is_in_ring).then_some(meeting)
                })
            };
            let soft = (!touches).then(|| beside(Kind::Soft, SOFT, SOFT_REACH));
            let added: Vec<Meeting> = soft.into_iter().flatten().chain(beside(Kind::Wide, WIDE, WIDE_REACH)).collect();
            meetings[a * n + b].extend(added);
        }
    }
}

/// Lanes of arms, each with the paths that begin on it.
fn sources(courses: &[Course]) -> Vec<Source> {
    let mut sources: Vec<Source> = Vec::new();
    for (index, course) in courses.iter().enumerate() {
        let (entry, lane) = (course.entry as u32, course.lane as u32);
        match sources.last_mut() {
            Some(last) if (last.entry, last.lane) == (entry, lane) => last.n += 1,
            _ => sources.push(Source { entry, lane, first: index as u32, n: 1 }),
        }
    }
    sources
}

fn tables(
    ground: &Ground,
    courses: &[Course],
    meetings: &[Vec<Meeting>],
    sources: Vec<Source>,
    lines: &[f64],
    clears: &[f64],
) -> Network {
    let mut samples: Vec<Sample> = Vec::new();
    let mut paths = Vec::new();
    for (source, of) in sources.iter().enumerate() {
        for index in of.first as usize..(of.first + of.n) as usize {
            let (course, own) = (&courses[index], courses[index].samples());
            paths.push(Path {
                first: samples.len() as u32,
                n: own.len() as u32,
                length: length(course.line.length() as f32),
                line: length(lines[index] as f32),
                clear: length(clears[index] as f32),
                source: source as u32,
                exit: course.exit,
                exit_arm: course.exit_arm as u32,
            });
            samples.extend(own);
        }
    }
    let (mut pairs, mut zones) = (Vec::new(), Vec::new());
    for of_pair in meetings {
        // The zones of a pair end with those that cars do not look at.
        let (for_all, for_wide): (Vec<&Meeting>, Vec<&Meeting>) =
            of_pair.iter().partition(|meeting| meeting.kind != Kind::Wide);
        let first = zones.len();
        zones.extend(for_all.iter().chain(&for_wide).map(|meeting| packed(meeting)));
        pairs.push(Pair {
            first: first as u16,
            n: for_all.len() as u8,
            n_all: of_pair.len() as u8,
            a: outwards(of_pair.iter().map(|meeting| meeting.a)),
            b: outwards(of_pair.iter().map(|meeting| meeting.b)),
        });
    }
    Network {
        has_ring: 0.0 < ground.island_radius,
        n_arms: ground.arms.len(),
        paths,
        samples,
        pairs,
        zones,
        sources,
        large: None,
    }
}

fn packed(meeting: &Meeting) -> Zone {
    // Conversions from floats saturate; stations are below LONGEST.
    let station = |s: f64| (s / f64::from(UNIT)).round() as u16;
    Zone {
        a: meeting.a.map(station),
        b: meeting.b.map(station),
        delta: (meeting.delta / f64::from(UNIT)).round() as i16,
        kind: meeting.kind as u16,
    }
}

/// From the first beginning to the last end, in cells.
pub(super) fn outwards(stretches: impl Iterator<Item = [f64; 2]>) -> [u8; 2] {
    let ends = stretches.fold([f64::INFINITY, 0.0f64], |[low, high], [from, to]| [low.min(from), high.max(to)]);
    let [low, high] = ends.map(|s| s / f64::from(CELL));
    [low.floor() as u8, high.ceil() as u8]
}
