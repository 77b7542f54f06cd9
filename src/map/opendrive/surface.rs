//! The drivable surface: up to the kerb faces, and up to the lanes' edges.
//!
//! Kerb strips win over lanes, because connecting lanes sweep over gutter and kerb. Lanes win over flat strips, raised
//! walks and what has no type, because the shoulder of a ring runs across every mouth. What lies between strips is a
//! void: narrow ones and small ones beside a lane are paved, all others are solid.

use glam::DVec2;

use super::cells::Cells;
use super::lanes::Strip;
use super::records::Kind;
use crate::geometry::Piece;
use crate::geometry::area::{Area, counter_clockwise, densified, points};

/// Gaps between strips that are closed first (m).
pub(super) const GAP: f64 = 0.02;
/// Voids narrower than this are paved where they touch a lane (m).
pub(super) const SLIVER: f64 = 0.6;
/// A void that holds a circle of this radius is solid (m).
const INSCRIBED: f64 = 0.5;
/// The same of a void beside a lane in a map that has kerbs around all that is solid (m).
const INSCRIBED_AMONG_KERBS: f64 = 3.0;
/// Fraction of the edge of what is paved along which kerbs lie in such a map, at least. It is 0.4 to 0.7 in maps that
/// are drawn so, and below 0.01 where there is one kerb.
const KERBED: f64 = 0.25;
/// Drivable strips narrower than this are solid (m).
const SLIT: f64 = 0.2;
/// Edges are replaced by longer ones within this where the exact place does not matter (m).
const SIMPLE: f64 = 0.003;
/// Distance between the points of a void's edge that are looked at (m).
const CONTACT: f64 = 0.05;
/// Length of contact with a lane from which a void lies beside it (m).
const BESIDE: f64 = 0.5;

/// What can be driven on.
#[derive(Debug, Clone)]
pub(super) struct Surface {
    /// Up to the kerb faces.
    pub(super) faces: Area,
    /// Up to the edges of the lanes.
    pub(super) edges: Area,
    /// The aprons, which are no part of these.
    pub(super) aprons: Area,
}

/// The union of the strips of one kind.
pub(super) fn of<'a>(strips: impl Iterator<Item = &'a Strip>, kind: Kind) -> Area {
    Area::union(strips.filter(|strip| strip.kind == kind).flat_map(Strip::contours))
}

/// The union of islands that were given as outlines.
pub(super) fn solid_islands(islands: impl Iterator<Item = Vec<DVec2>>) -> Area {
    Area::union(islands.map(counter_clockwise))
}

impl Surface {
    /// The surface of these strips, around islands that were given as outlines.
    pub(super) fn new(strips: &[Strip], islands: impl Iterator<Item = Vec<DVec2>>) -> Surface {
        let kind = |kind: Kind| of(strips.iter(), kind);
        let kerbs = kind(Kind::Kerb).plus(&solid_islands(islands)).closed(GAP);
        let lanes = kind(Kind::Lane).closed(GAP).minus(&kerbs);
        let solid = strips.iter().filter(|strip| matches!(strip.kind, Kind::Solid | Kind::Apron));
        let solid = Area::union(solid.flat_map(Strip::contours)).minus(&lanes);
        let flat = kind(Kind::Flat).minus(&solid);
        let paved = lanes.plus(&flat).closed(GAP).minus(&kerbs).minus(&solid);
        let is_kerbed = KERBED < Edge::new(&kerbs).fraction(&paved);
        let inscribed = if is_kerbed { INSCRIBED_AMONG_KERBS } else { INSCRIBED };
        let voids = paved_voids(&paved, &kerbs.plus(&solid), inscribed);
        let lane_edge = Edge::new(&lanes);
        let beside_lanes = Area { parts: voids.parts.iter().filter(|void| lane_edge.touches(void)).cloned().collect() };
        let bounded = |area: Area| area.closed(GAP).minus(&kerbs).minus(&solid).without_slits(SLIT, SIMPLE);
        // What stands on an apron is solid.
        let aprons = kind(Kind::Apron).closed(GAP).minus(&kerbs);
        Surface { edges: bounded(lanes.plus(&beside_lanes)), faces: bounded(paved.plus(&voids)), aprons }
    }
}

/// The voids between strips that can be driven on.
fn paved_voids(paved: &Area, solid: &Area, inscribed: f64) -> Area {
    let all = paved.plus(solid);
    let slivers = all.closed(SLIVER).minus(&all);
    let edge = Edge::new(paved);
    let small = all
        .holes()
        .flat_map(|hole| hole.simplified(SIMPLE).grown(-inscribed).parts.is_empty().then_some(hole.parts))
        .flatten();
    let small = small.filter(|void| BESIDE < edge.contact(void));
    Area { parts: slivers.parts.into_iter().filter(|void| edge.touches(void)).chain(small).collect() }
}

/// The edge of an area in cells of a metre, to find what touches it.
struct Edge {
    cells: Cells<Piece>,
}

impl Edge {
    fn new(area: &Area) -> Edge {
        let mut cells = Cells::new(1.0);
        for contour in area.parts.iter().flatten() {
            let points = points(contour);
            for (i, &from) in points.iter().enumerate() {
                let to = points[(i + 1) % points.len()];
                let parts = from.distance(to).ceil().clamp(1.0, 1e6);
                for part in 0..parts as usize {
                    let [from, to] = [part, part + 1].map(|part| from.lerp(to, part as f64 / parts));
                    let (low, high) = (cells.cell(from.min(to) - GAP), cells.cell(from.max(to) + GAP));
                    for column in low.0..=high.0.min(low.0 + 2) {
                        for row in low.1..=high.1.min(low.1 + 2) {
                            cells.insert_at((column, row), Piece::Segment { from, to });
                        }
                    }
                }
            }
        }
        Edge { cells }
    }

    /// Length of edge that a part has in common with the area (m).
    fn contact(&self, part: &[Vec<[f64; 2]>]) -> f64 {
        self.in_common(&part[0])[0]
    }

    /// Fraction of the edge of another area that it has in common with this one.
    fn fraction(&self, other: &Area) -> f64 {
        let contours = other.parts.iter().flatten().map(|contour| self.in_common(contour));
        let [common, whole] = contours.fold([0.0, 0.0], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
        if 0.0 < whole { common / whole } else { 0.0 }
    }

    /// Length of a contour that lies on the edge of the area, and its whole length (m).
    fn in_common(&self, contour: &[[f64; 2]]) -> [f64; 2] {
        let near = |p: &DVec2| self.cells.at(self.cells.cell(*p)).any(|piece| piece.distance(*p) < GAP);
        let outline = densified(&points(contour), CONTACT);
        let length = |i: usize| outline[i].distance(outline[(i + 1) % outline.len()]);
        let is_common = |i: usize| near(&outline[i]) && near(&outline[(i + 1) % outline.len()]);
        let sides = || 0..outline.len();
        [sides().filter(|&i| is_common(i)).map(length).sum(), sides().map(length).sum()]
    }

    /// Whether a part has a stretch of edge in common with the area.
    fn touches(&self, part: &[Vec<[f64; 2]>]) -> bool {
        GAP < self.contact(part)
    }
}
