//! Growth of the solid area: every piece moves to the side, corners are rounded, and parts too near to the original
//! outline are removed.

use glam::DVec2;

use super::{Curve, Outline, Piece, wrapped};

/// Ends nearer than this are the same point (m).
const SAME: f64 = 1e-6;

/// The loops around the solids of `outline` grown by `distance` (m).
pub(super) fn grown(outline: &Outline, distance: f64) -> Vec<Curve> {
    let moved: Vec<Piece> = outline.loops.iter().flat_map(|curve| moved(curve, distance)).collect();
    let kept = moved.iter().enumerate().flat_map(|(index, piece)| {
        let others = moved.iter().enumerate().filter(|&(other, _)| other != index).map(|(_, other)| other);
        let mut cuts: Vec<f64> = others.flat_map(|other| piece.meetings(other)).map(|p| piece.station(p)).collect();
        cuts.extend([0.0, piece.length()]);
        cuts.sort_by(f64::total_cmp);
        let parts: Vec<Piece> =
            cuts.windows(2).filter(|cut| SAME < cut[1] - cut[0]).map(|cut| piece.part(cut[0], cut[1])).collect();
        parts
    });
    let far_enough = |part: &Piece| distance - SAME <= outline.signed_distance(part.point_at(part.length() / 2.0));
    chained(kept.filter(far_enough).collect())
}

/// The pieces of a closed curve moved to its left, with an arc around each corner that opens.
fn moved(curve: &Curve, distance: f64) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for (index, piece) in curve.pieces.iter().enumerate() {
        pieces.extend(piece.beside(distance));
        let next = &curve.pieces[(index + 1) % curve.pieces.len()];
        let heading = piece.heading_at(piece.length());
        let turn = wrapped(next.heading_at(0.0) - heading);
        if turn < -1e-9 {
            pieces.push(Piece::Arc {
                centre: piece.end(),
                radius: distance,
                from: heading + std::f64::consts::FRAC_PI_2,
                sweep: turn,
            });
        }
    }
    pieces
}

/// Closed loops from parts in any order, each followed by the part that begins nearest to its end.
fn chained(mut parts: Vec<Piece>) -> Vec<Curve> {
    let mut loops = Vec::new();
    while let Some(first) = parts.pop() {
        let mut pieces = vec![first];
        let (begin, mut end) = (first.start(), first.end());
        while SAME < end.distance(begin) {
            let gap = |part: &Piece| part.start().distance(end);
            let Some(next) = (0..parts.len()).min_by(|&a, &b| gap(&parts[a]).total_cmp(&gap(&parts[b]))) else { break };
            let part = parts.swap_remove(next);
            // Parts shorter than a micrometre were dropped: their neighbours are joined across the gap.
            end = part.end();
            pieces.push(part);
        }
        loops.push(Curve { pieces: snapped(pieces) });
    }
    loops
}

/// Segments take over the ends of their neighbours, so that no gap of rounding remains beside them.
fn snapped(mut pieces: Vec<Piece>) -> Vec<Piece> {
    let ends: Vec<(DVec2, DVec2)> = pieces.iter().map(|piece| (piece.start(), piece.end())).collect();
    let n = pieces.len();
    for (index, piece) in pieces.iter_mut().enumerate() {
        if let Piece::Segment { from, to } = piece {
            *from = ends[(index + n - 1) % n].1;
            *to = ends[(index + 1) % n].0;
        }
    }
    pieces
}
