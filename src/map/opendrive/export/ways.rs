//! The lanes of the arms as roads, and a connecting road for each route between them.
//!
//! Routes of one lane are one line on its arm. The junction reaches as far as lines that are one there are apart.

use glam::DVec2;

use super::{Kind, Link, Width, Written, WrittenLane, lane_id};
use crate::files::reader::{Error, Reader};
use crate::geometry::Curve;
use crate::map::ground::{Ground, Hand, Line};

/// Lines of one lane are at most this far apart: those of maps are fitted within 4 mm (m).
const APART: f64 = 5e-3;
/// How far beyond the ring the junction reaches at most (m).
const FARTHEST: f64 = 40.0;
/// Distance between the points at which lines are compared (m).
const STEP: f64 = 0.25;
/// How far beyond the ring, and beyond where lines are one, the junction reaches at least (m).
const BEYOND: f64 = 2.0;
/// Shortest lane of an arm (m).
const SHORTEST: f64 = 3.0;

/// A lane of an arm: the routes that use it.
struct ArmLane {
    /// Index of the arm.
    arm: usize,
    /// Indices of the routes; the first stands for all.
    routes: Vec<usize>,
    is_entry: bool,
}

/// The roads of arms, then those of routes, numbered from 1 on.
pub(super) fn ways(reader: &Reader, seen: &Ground, hand: Hand) -> Result<Vec<Written>, Error> {
    let arm_lanes = arm_lanes(seen);
    let reach = reach(reader, seen, &arm_lanes)?;
    let lane = |widths: Vec<Width>| vec![WrittenLane { id: lane_id(hand), kind: Kind::Driving, widths }];
    let mut roads = Vec::new();
    for (index, ArmLane { arm, routes, is_entry }) in arm_lanes.iter().enumerate() {
        let Line { line, widths, .. } = &seen.lines[routes[0]];
        let [reaches, leaves] = inside(line, reach);
        let (line, width) = match is_entry {
            true => (line.part(0.0, reaches), widths[0]),
            false => (line.part(leaves, line.length()), widths[2]),
        };
        roads.push(Written {
            id: 1 + index,
            name: format!("{} {}", seen.arms[*arm].name, if *is_entry { "entry" } else { "exit" }),
            is_connecting: false,
            offset: 0.0,
            line,
            lanes: lane(Width::constant(width)),
            predecessor: (!is_entry).then_some(Link::Junction),
            successor: is_entry.then_some(Link::Junction),
        });
    }
    for (index, route) in seen.lines.iter().enumerate() {
        let [reaches, leaves] = inside(&route.line, reach);
        let road_of = |is_entry: bool| {
            let of = |lane: &ArmLane| lane.is_entry == is_entry && lane.routes.contains(&index);
            arm_lanes.iter().position(of).map(|lane| 1 + lane)
        };
        let line = route.line.part(reaches, leaves);
        let ring = seen.ring_stations(&route.line);
        let widths = widths(route.widths, [ring.0 - reaches, ring.1 - reaches], line.length());
        roads.push(Written {
            id: 1 + arm_lanes.len() + index,
            name: format!("{}-{}-{}", seen.arms[route.entry].name, route.lane.name(), route.exit),
            is_connecting: true,
            offset: 0.0,
            lanes: lane(widths),
            line,
            predecessor: road_of(true).map(Link::EndOf),
            successor: road_of(false).map(Link::StartOf),
        });
    }
    Ok(roads)
}

/// The lanes of the arms: routes of one arm that are one line there. A right lane to the first exit may be a line of
/// its own from the arm's end on.
fn arm_lanes(seen: &Ground) -> Vec<ArmLane> {
    let mut lanes: Vec<ArmLane> = Vec::new();
    for (index, route) in seen.lines.iter().enumerate() {
        for (is_entry, arm) in [(true, route.entry), (false, route.exit_arm)] {
            let line = from_arm(seen, index, is_entry);
            let farthest = (line.point_at(0.0).length() - SHORTEST).min(seen.outer_radius + FARTHEST) - BEYOND;
            let is_same = |lane: &&mut ArmLane| {
                let others = || lane.routes.iter().map(|&other| from_arm(seen, other, is_entry));
                (lane.is_entry, lane.arm) == (is_entry, arm) && others().all(|other| parts(&other, &line) <= farthest)
            };
            match lanes.iter_mut().find(is_same) {
                Some(lane) => lane.routes.push(index),
                None => lanes.push(ArmLane { arm, routes: vec![index], is_entry }),
            }
        }
    }
    lanes
}

/// The line of a route from its arm's end inwards.
fn from_arm(seen: &Ground, route: usize, is_entry: bool) -> Curve {
    let line = &seen.lines[route].line;
    if is_entry { line.clone() } else { line.reversed() }
}

/// Distance from the origin at which one line from an arm's end parts from another (m).
fn parts(one: &Curve, other: &Curve) -> f64 {
    let mut points = (0..=(one.length() / STEP) as usize).map(|i| one.point_at(i as f64 * STEP));
    points.find(|&p| APART < other.distance(p)).map_or(0.0, DVec2::length)
}

/// Radius around the origin beyond which the routes of each lane are one (m).
fn reach(reader: &Reader, seen: &Ground, lanes: &[ArmLane]) -> Result<f64, Error> {
    let mut reach = seen.outer_radius;
    for ArmLane { routes, is_entry, .. } in lanes {
        let line = |route: &usize| from_arm(seen, *route, *is_entry);
        reach = routes[1..].iter().map(|route| parts(&line(route), &line(&routes[0]))).fold(reach, f64::max);
    }
    reach += BEYOND;
    let end = |lane: &ArmLane| from_arm(seen, lane.routes[0], lane.is_entry).point_at(0.0).length();
    match lanes.iter().find(|lane| end(lane) < reach + SHORTEST) {
        None => Ok(reach),
        Some(lane) => Err(reader.invalid(
            format!("arm {}", seen.arms[lane.arm].name),
            format!("{:.1} m from the centre to its end", end(lane)),
            format!("must be at least {:.1} m, {SHORTEST} m beyond the junction: prolong the arm", reach + SHORTEST),
        )),
    }
}

/// Stations at which a line that begins and ends outside enters and leaves the circle of a radius; of one that hardly
/// comes there, or not at all, stations around the nearest (m).
fn inside(line: &Curve, radius: f64) -> [f64; 2] {
    let n = (line.length() / STEP).ceil().max(1.0);
    let station = |i: usize| line.length() * i as f64 / n;
    let is_inside = |s: f64| line.point_at(s).length() < radius;
    let within: Vec<usize> = (0..=n as usize).filter(|&i| is_inside(station(i))).collect();
    let (Some(&first), Some(&last)) = (within.first(), within.last()) else {
        return around(line, line.station(DVec2::ZERO));
    };
    let between = |mut outside: f64, mut inner: f64| {
        for _ in 0..50 {
            let middle = (outside + inner) / 2.0;
            *if is_inside(middle) { &mut inner } else { &mut outside } = middle;
        }
        outside
    };
    let reaches = between(station(first.saturating_sub(1)), station(first));
    let leaves = between(station((last + 1).min(n as usize)), station(last));
    if leaves - reaches < 2.0 * BEYOND { around(line, 0.5 * (reaches + leaves)) } else { [reaches, leaves] }
}

/// Stations around one, with lanes of arms before and behind them (m).
fn around(line: &Curve, station: f64) -> [f64; 2] {
    let least = SHORTEST + BEYOND;
    let middle = station.clamp(least, (line.length() - least).max(least));
    [middle - BEYOND, (middle + BEYOND).min(line.length())]
}

/// The widths of a lane of this length whose width is that of its entry arm at its beginning, that of the ring between
/// two stations, and that of its exit arm at its end.
fn widths([entry, between, exit]: [f64; 3], [reaches, leaves]: [f64; 2], length: f64) -> Vec<Width> {
    let change = |start: f64, over: f64, from: f64, to: f64| {
        let (c, d) = (3.0 * (to - from) / over.powi(2), -2.0 * (to - from) / over.powi(3));
        Width { start, factors: [from, 0.0, c, d] }
    };
    if entry == between && between == exit {
        return Width::constant(entry);
    }
    let (reaches, leaves) = (reaches.clamp(STEP, length - STEP), leaves.clamp(STEP, length - STEP));
    let mut widths = vec![change(0.0, reaches, entry, between)];
    if reaches < leaves {
        widths.push(Width { start: reaches, factors: [between, 0.0, 0.0, 0.0] });
    }
    widths.push(change(leaves, length - leaves, between, exit));
    widths
}
