//! The lines of ways: which way they lead, those that are drawn in parts, and those that end too near to the ring.

use glam::DVec2;

use super::Entity;
use super::site::GAP;
use crate::map::ground::{Arm, Line};

/// Distance from the ring that the ends of ways need: a truck begins and ends on them (m).
const ROOM: f64 = 23.0;

/// Reverses arcs that lead against what they meet.
pub(super) fn lead_arcs(drawn: &mut [Entity]) {
    let ends = |one: &Entity| [one.curve.point_at(0.0), one.curve.point_at(one.curve.length())];
    let mut is_settled: Vec<bool> = drawn.iter().map(|one| !one.is_arc).collect();
    loop {
        let met = |arc: usize| {
            let [begins, stops] = ends(&drawn[arc]);
            // Whether something whose direction is known has its beginning (0) or its end (1) there.
            let meets = |p: DVec2, end: usize| {
                let settled = drawn.iter().zip(&is_settled).filter(|(_, is_settled)| **is_settled);
                settled.map(|(one, _)| ends(one)[end]).any(|other| other.distance(p) <= GAP)
            };
            let follows = meets(begins, 1) || meets(stops, 0);
            let opposes = meets(stops, 1) || meets(begins, 0);
            (follows || opposes).then_some((arc, !follows))
        };
        let Some((arc, is_reversed)) = (0..drawn.len()).filter(|&arc| !is_settled[arc]).find_map(met) else { break };
        if is_reversed {
            drawn[arc].curve = drawn[arc].curve.reversed();
        }
        is_settled[arc] = true;
    }
}

/// Ways, of which those that are drawn in parts are one each: an end at which one other begins, and nothing else meets.
pub(super) fn whole(mut drawn: Vec<Entity>, layer: &str, notes: &mut Vec<String>) -> Vec<Entity> {
    let start = |one: &Entity| one.curve.point_at(0.0);
    let end = |one: &Entity| one.curve.point_at(one.curve.length());
    let n = drawn.len();
    loop {
        let follows = |from: usize, to: usize| from != to && end(&drawn[from]).distance(start(&drawn[to])) <= GAP;
        let all = || 0..drawn.len();
        let only = |from: usize, to: usize| {
            let ends = all().filter(|&other| follows(other, to)).count();
            let starts = all().filter(|&other| follows(from, other)).count();
            (ends, starts) == (1, 1) && !follows(to, from)
        };
        let joint = all().flat_map(|from| all().map(move |to| (from, to)));
        let Some((from, to)) = joint.into_iter().find(|&(from, to)| follows(from, to) && only(from, to)) else { break };
        let pieces = drawn[to].curve.pieces.clone();
        drawn[from].curve.pieces.extend(pieces);
        drawn.remove(to);
    }
    if drawn.len() < n {
        notes.push(format!("{n} lines on layer {layer} are joined to {} ways", drawn.len()));
    }
    drawn
}

/// A note for each arm on which a way begins or ends too near to the ring, whose outermost kerb has this radius (m).
pub(super) fn too_short(lines: &[Line], arms: &[Arm], outer: f64) -> Vec<String> {
    let note = |(index, arm): (usize, &Arm)| {
        let begin = lines.iter().filter(|line| line.entry == index).map(|line| line.line.point_at(0.0));
        let end = lines.iter().filter(|line| line.exit_arm == index).map(|line| line.line.point_at(line.line.length()));
        let room = begin.chain(end).map(|end| end.length() - outer).fold(f64::INFINITY, f64::min);
        let what = "from the ring; trucks need";
        (room < ROOM).then(|| format!("arm {}: its lines end {room:.0} m {what} {ROOM:.0} m or more", arm.name))
    };
    arms.iter().enumerate().filter_map(note).collect()
}
