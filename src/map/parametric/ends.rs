//! Kerbs with every arm prolonged: a file's road ends somewhere, the world's goes on.
//!
//! A truck whose front stands where a route begins reaches back beyond it. Whether its lane is wide enough does not
//! depend on where the file ends the arm.

use glam::DVec2;

use crate::geometry::{Curve, Outline, Piece};
use crate::map::ground::{Edges, Line};
use crate::map::{Gutter, Road};

/// By how much an arm is prolonged: more than the longest truck (m).
const BEYOND: f64 = 60.0;
/// Farthest that an arm's end may lie from the end of a lane: a solid gutter is that wide, and maps are cut roughly
/// (m).
const NEAR: f64 = 3.0;

impl Road {
    /// The edge of the drivable surface as [`Road::kerbs`] gives it, but for the ends of the arms: they lie 60 m
    /// farther out. Trucks are stepped between the kerbs of the file; this is to find out which lane they fit.
    pub fn kerbs_beyond_ends(&self, gutter: Gutter) -> Outline {
        let lines = &self.ground.lines;
        match (gutter, &self.ground.edges) {
            (Gutter::Drivable, _) => prolonged(&self.ground.faces, lines),
            (Gutter::Solid, Edges::Beside(gutter)) => prolonged(&self.ground.faces, lines).offset(*gutter),
            (Gutter::Solid, Edges::Own(edges)) => prolonged(edges, lines),
        }
    }
}

/// The outline with a strip of road beyond each straight edge that ends one of the lines.
fn prolonged(outline: &Outline, lines: &[Line]) -> Outline {
    let ends: Vec<(DVec2, DVec2)> = lines
        .iter()
        .flat_map(|Line { line, .. }| {
            let length = line.length();
            let outwards = [-DVec2::from_angle(line.heading_at(0.0)), DVec2::from_angle(line.heading_at(length))];
            [line.point_at(0.0), line.point_at(length)].into_iter().zip(outwards)
        })
        .collect();
    let closes_arm = |from: DVec2, to: DVec2| {
        let along = (to - from).normalize_or_zero();
        ends.iter().any(|&(at, outwards)| {
            let station = (at - from).dot(along);
            let faces = along.dot(outwards).abs() < 0.2 && along.perp_dot(outwards) < 0.0;
            faces && 0.0 <= station && station <= from.distance(to) && (at - from).perp_dot(along).abs() < NEAR
        })
    };
    let moved = |piece: &Piece| match *piece {
        Piece::Segment { from, to } if closes_arm(from, to) => {
            // The road lies on the left of its edge.
            let out = BEYOND * -(to - from).normalize_or_zero().perp();
            let (far_from, far_to) = (from + out, to + out);
            let segment = |from, to| Piece::Segment { from, to };
            vec![segment(from, far_from), segment(far_from, far_to), segment(far_to, to)]
        }
        piece => vec![piece],
    };
    let loops = outline.loops.iter().map(|curve| Curve { pieces: curve.pieces.iter().flat_map(moved).collect() });
    Outline::new(loops.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::shipped::Kind;

    #[test]
    fn every_arm_goes_on_beyond_its_end_and_its_kerbs_stay_where_they_are() {
        let mut seen = 0;
        for name in Kind::Roundabout.names() {
            let roundabout = Road::named(name).unwrap();
            for gutter in [Gutter::Drivable, Gutter::Solid] {
                let (kerbs, open) = (roundabout.kerbs(gutter), roundabout.kerbs_beyond_ends(gutter));
                for Line { line, .. } in &roundabout.ground.lines {
                    let (at, ahead) = (line.point_at(f64::INFINITY), DVec2::from_angle(line.heading_at(line.length())));
                    assert!(kerbs.distance(at) < 0.6, "{name}");
                    // No end within 20 m: a kerb beside the lane is nearest.
                    assert!(open.contains(at + 40.0 * ahead) && !open.contains(at + 61.0 * ahead), "{name} {gutter:?}");
                    let inside = line.length() - 40.0;
                    for s in [0.25 * inside, 0.5 * inside, inside] {
                        let p = line.point_at(s);
                        assert!(
                            (open.signed_distance(p) - kerbs.signed_distance(p)).abs() < 1e-9,
                            "{name} {gutter:?} {s}"
                        );
                    }
                    seen += 1;
                }
            }
        }
        assert!(300 < seen, "{seen}");
    }
}
