//! Closed outlines of a drawing: their pieces joined, and which of them are kerbs.

use glam::DVec2;

use super::site::GAP;
use super::{Entity, aprons};
use crate::files::reader::{Error, Reader};
use crate::geometry::{Curve, Outline, Piece};
use crate::map::apron::crosses;
use crate::map::kerbs::misplaced;

/// Lines that cross do so farther than this from their ends (m).
const FROM_ENDS: f64 = 0.01;

/// The closed outlines with their places: those drawn as such, and chains of open pieces whose ends meet.
pub(super) fn outlines(
    reader: &Reader,
    drawn: Vec<Entity>,
    layer: &str,
    notes: &mut Vec<String>,
) -> Result<Vec<(String, Curve)>, Error> {
    let meets = |a: DVec2, b: DVec2| a.distance(b) <= GAP;
    let ends = |curve: &Curve| (curve.point_at(0.0), curve.point_at(curve.length()));
    let (mut loops, mut open) = (Vec::new(), Vec::new());
    let n = drawn.len();
    let drawn: Vec<Entity> = drawn.into_iter().filter(|one| GAP < one.curve.length()).collect();
    if drawn.len() < n {
        notes.push(format!("{} lines on layer {layer} that are shorter than {GAP} m are left out", n - drawn.len()));
    }
    for one in drawn {
        let (start, end) = ends(&one.curve);
        if one.is_closed || meets(start, end) { loops.push((one.place, one.curve)) } else { open.push(one) }
    }
    let n_open = open.len();
    while let Some(Entity { mut curve, place, .. }) = open.pop() {
        loop {
            let (start, end) = ends(&curve);
            if meets(start, end) {
                break;
            }
            let next = open.iter().position(|other| {
                let (from, to) = ends(&other.curve);
                meets(end, from) || meets(end, to)
            });
            let Some(next) = next else {
                let expected = format!(
                    "the outline is open at ({:.3}, {:.3}) m: those on layer {layer} must be closed within {GAP} m",
                    end.x, end.y
                );
                return Err(reader.invalid(place, "open", expected));
            };
            let other = open.swap_remove(next).curve;
            let other = if meets(end, ends(&other).0) { other } else { other.reversed() };
            curve.pieces.extend(other.pieces);
        }
        loops.push((place, curve));
    }
    if 0 < n_open {
        notes.push(format!("{n_open} open lines on layer {layer} are joined to closed outlines"));
    }
    let mut kept: Vec<(String, Curve)> = Vec::new();
    for (place, curve) in loops {
        if let Some(at) = crosses_itself(&curve) {
            let found = format!("crosses itself at ({:.3}, {:.3}) m", at.x, at.y);
            return Err(reader.invalid(place, found, "one side of an outline is solid: it must not cross itself"));
        }
        if kept.iter().any(|(_, other)| aprons::coincides(other, &curve)) {
            notes.push(format!("{place}: an outline on layer {layer} that is there already is left out"));
        } else {
            kept.push((place, curve));
        }
    }
    Ok(kept)
}

/// The kerbs among closed outlines: the outer one, which the ways lie in, and islands in it. What is drawn inside an
/// island, such as the back of its kerb, is left out.
pub(super) fn kerbs(
    reader: &Reader,
    drawn: Vec<(String, Curve)>,
    ways: &[Entity],
    notes: &mut Vec<String>,
) -> Result<Vec<Curve>, Error> {
    let areas: Vec<Outline> = drawn.iter().map(|(_, curve)| Outline::new(vec![curve.clone()])).collect();
    let refused = |index: usize, found: &str, expected: String| reader.invalid(&drawn[index].0, found, expected);
    for (index, (_, curve)) in drawn.iter().enumerate() {
        if let Some((other, _)) = drawn[..index].iter().find(|(_, other)| crosses(curve, other)) {
            return Err(refused(index, "crosses another outline", format!("must not cross that of {other}")));
        }
    }
    // The middle of a way is in the ring, between the island and the outer kerb.
    let middles: Vec<DVec2> = ways.iter().map(|way| way.curve.point_at(0.5 * way.curve.length())).collect();
    let size = |&index: &usize| drawn[index].1.signed_area().abs();
    let lies_around = |index: &usize| {
        let n = middles.iter().filter(|&&middle| areas[*index].contains(middle)).count();
        middles.len() < 2 * n
    };
    let around = (0..drawn.len()).filter(lies_around);
    let Some(outer) = around.clone().min_by(|a, b| size(a).total_cmp(&size(b))) else {
        let expected =
            "no outline lies around most ways: the road's outer kerb is needed, closed at the ends of the arms";
        return Err(reader.invalid("kerbs", format!("{} outlines", drawn.len()), expected));
    };
    if let Some(frame) = around.clone().find(|&index| index != outer) {
        let expected = format!("lies around the outer kerb, {}: it belongs on another layer", drawn[outer].0);
        return Err(refused(frame, "around the road", expected));
    }
    let start = |index: usize| drawn[index].1.point_at(0.0);
    let mut kept = Vec::new();
    for index in 0..drawn.len() {
        let wrong = if index == outer { None } else { misplaced(&areas, index, start(index), outer) };
        match wrong {
            None => kept.push(index),
            Some(other) if other == outer => {
                let expected =
                    format!("must lie in the outer kerb, {}; else it belongs on another layer", drawn[outer].0);
                return Err(refused(index, "outside", expected));
            }
            Some(_) => notes.push(format!("{}: an outline inside an island is left out", drawn[index].0)),
        }
    }
    Ok(kept.into_iter().map(|index| drawn[index].1.clone()).collect())
}

/// Where two lines of an outline cross, if any do (m).
fn crosses_itself(curve: &Curve) -> Option<DVec2> {
    // An arc's circle lies around it.
    let around = |piece: &Piece| match *piece {
        Piece::Segment { from, to } => (from.min(to), from.max(to)),
        Piece::Arc { centre, radius, .. } => (centre - radius, centre + radius),
    };
    let boxes: Vec<(DVec2, DVec2)> = curve.pieces.iter().map(around).collect();
    let is_near = |a: usize, b: usize| boxes[a].0.cmple(boxes[b].1).all() && boxes[b].0.cmple(boxes[a].1).all();
    let is_within = |piece: &Piece, p: DVec2| {
        [0.0, piece.length()].into_iter().all(|end| FROM_ENDS < piece.point_at(end).distance(p))
    };
    let crossing = |(a, b): (usize, usize)| {
        let (one, other) = (&curve.pieces[a], &curve.pieces[b]);
        one.meetings(other).into_iter().find(|&p| is_within(one, p) && is_within(other, p))
    };
    // From west to east: those that reach as far as the next one begins.
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|&a, &b| boxes[a].0.x.total_cmp(&boxes[b].0.x));
    let of_one = |(place, &a): (usize, &usize)| {
        let beside = order[place + 1..].iter().take_while(|&&b| boxes[b].0.x <= boxes[a].1.x);
        beside.filter(|&&b| is_near(a, b)).find_map(|&b| crossing((a, b)))
    };
    order.iter().enumerate().find_map(of_one)
}
