//! Areas bounded by polygons, and what is done with them: union, difference, growing, closing of gaps.
//!
//! An outer contour is counter-clockwise, a hole clockwise: the area lies on the left of each.

use std::f64::consts::PI;

use glam::DVec2;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::scale::FixedScaleFloatOverlay;
use i_overlay::float::single::SingleFloatOverlay;
use i_overlay::i_shape::source::float::resource::ShapeResource;
use i_overlay::mesh::float::outline::offset::OutlineOffset;
use i_overlay::mesh::float::style::{LineJoin, OutlineStyle};

use crate::geometry::Piece;

/// Points of a metre on the grid that polygons are computed on: 0.06 mm apart. On a finer grid edges that all but
/// coincide cross each other without end (1/m).
const GRID: f64 = 16384.0;

/// Loops and spikes smaller than this are none (m, m²).
const LOOP: f64 = 1e-3;
/// Parts of a metre that points are rounded to where they are written (1/m).
pub const ROUNDED: f64 = 1e4;
/// Most times that a contour is mended.
const MOST_TIMES: usize = 4;

/// Contours of one connected part: its outer one, then its holes.
type Part = Vec<Vec<[f64; 2]>>;

/// An area of any number of parts.
#[derive(Debug, Clone, Default)]
pub(crate) struct Area {
    pub(crate) parts: Vec<Part>,
}

/// The points of a contour.
pub(crate) fn points(contour: &[[f64; 2]]) -> Vec<DVec2> {
    contour.iter().map(|&p| DVec2::from(p)).collect()
}

/// Number of corners with which a regular polygon in a circle of this radius lies within `off` of it (both m).
pub(crate) fn corners_of_circle(radius: f64, off: f64) -> usize {
    (PI / (1.0 - off / radius).acos()).ceil() as usize
}

/// A closed contour with points at most `step` apart (m).
pub(crate) fn densified(contour: &[DVec2], step: f64) -> Vec<DVec2> {
    let n = contour.len();
    let mut dense = Vec::new();
    for (i, &from) in contour.iter().enumerate() {
        let to = contour[(i + 1) % n];
        let parts = (from.distance(to) / step).ceil().clamp(1.0, 1e5);
        dense.extend((0..parts as usize).map(|part| from.lerp(to, part as f64 / parts)));
    }
    dense
}

/// A contour that does not cross itself, turned around if it is clockwise.
pub fn counter_clockwise(mut contour: Vec<DVec2>) -> Vec<DVec2> {
    let n = contour.len();
    if (0..n).map(|i| contour[i].perp_dot(contour[(i + 1) % n])).sum::<f64>() < 0.0 {
        contour.reverse();
    }
    contour
}

/// The area enclosed by a contour, positive counter-clockwise (m²).
pub(crate) fn signed_area(contour: &[[f64; 2]]) -> f64 {
    let n = contour.len();
    (0..n).map(|i| DVec2::from(contour[i]).perp_dot(contour[(i + 1) % n].into())).sum::<f64>() / 2.0
}

/// The contour of a curve that crosses itself in loops too small to see, without them; any other one as it is. So it is
/// where its points are rounded, too.
pub(crate) fn uncrossed(contour: Vec<DVec2>) -> Vec<DVec2> {
    let rounded = |contour: Vec<DVec2>| -> Vec<DVec2> {
        let mut points: Vec<DVec2> = contour.into_iter().map(|p| (p * ROUNDED).round() / ROUNDED).collect();
        points.dedup();
        points
    };
    let mut kept = rounded(contour.clone());
    if !crosses_itself(&kept) {
        return contour;
    }
    // What rounding crosses again is less each time.
    for _ in 0..MOST_TIMES {
        kept = rounded(without_loops(kept));
        if !crosses_itself(&kept) {
            break;
        }
    }
    kept
}

/// The largest part of a contour's inside, turned as the contour is.
fn without_loops(contour: Vec<DVec2>) -> Vec<DVec2> {
    let turned = counter_clockwise(contour.clone());
    let is_clockwise = turned != contour;
    let tidy = Area::union(std::iter::once(turned)).tidied(LOOP, LOOP);
    let outer = tidy.parts.iter().filter_map(|part| part.first());
    let Some(largest) = outer.max_by(|one, other| signed_area(one).total_cmp(&signed_area(other))) else {
        return contour;
    };
    let mut kept = points(largest);
    if is_clockwise {
        kept.reverse();
    }
    kept
}

/// Whether two edges of a closed contour cross that are no neighbours, or all but touch.
fn crosses_itself(contour: &[DVec2]) -> bool {
    let n = contour.len();
    let edge = |i: usize| [contour[i], contour[(i + 1) % n]];
    let bounds = |[a, b]: [DVec2; 2]| (a.min(b) - LOOP, a.max(b) + LOOP);
    let near = |one: [DVec2; 2], other: [DVec2; 2]| {
        let ((low, high), (other_low, other_high)) = (bounds(one), bounds(other));
        low.cmple(other_high).all() && other_low.cmple(high).all()
    };
    let side = |[a, b]: [DVec2; 2], p: DVec2| (b - a).perp_dot(p - a);
    let crosses = |one: [DVec2; 2], other: [DVec2; 2]| {
        side(one, other[0]) * side(one, other[1]) <= 0.0 && side(other, one[0]) * side(other, one[1]) <= 0.0
    };
    // From west to east, an edge is compared with those that begin before it ends.
    let mut order: Vec<usize> = (0..n).collect();
    let west = |&i: &usize| edge(i)[0].x.min(edge(i)[1].x);
    order.sort_by(|one, other| west(one).total_cmp(&west(other)));
    (0..n).any(|at| {
        let one = order[at];
        let east = bounds(edge(one)).1.x;
        order[at + 1..].iter().take_while(|other| west(other) <= east).any(|&other| {
            let are_neighbours = (one + 1) % n == other || (other + 1) % n == one;
            !are_neighbours && near(edge(one), edge(other)) && crosses(edge(one), edge(other))
        })
    })
}

/// Whether the origin lies within a contour.
pub(crate) fn encloses_origin(contour: &[[f64; 2]]) -> bool {
    encloses(contour, DVec2::ZERO)
}

/// Whether a point lies within a contour.
pub(crate) fn encloses(contour: &[[f64; 2]], p: DVec2) -> bool {
    let n = contour.len();
    let crosses = |i: &usize| {
        let (from, to) = (DVec2::from(contour[*i]) - p, DVec2::from(contour[(*i + 1) % n]) - p);
        (from.y <= 0.0) != (to.y <= 0.0) && 0.0 < from.x + (to.x - from.x) * -from.y / (to.y - from.y)
    };
    (0..n).filter(crosses).count() % 2 == 1
}

impl Area {
    /// The union of counter-clockwise contours.
    pub(crate) fn union(contours: impl Iterator<Item = Vec<DVec2>>) -> Area {
        let contours: Vec<Vec<[f64; 2]>> =
            contours.map(|contour| contour.into_iter().map(DVec2::into).collect()).collect();
        Area { parts: overlaid(&contours, &Vec::new(), OverlayRule::Subject) }
    }

    fn with(&self, other: &Area, rule: OverlayRule) -> Area {
        Area { parts: overlaid(&self.parts, &other.parts, rule) }
    }

    pub(crate) fn plus(&self, other: &Area) -> Area {
        self.with(other, OverlayRule::Union)
    }

    pub(crate) fn minus(&self, other: &Area) -> Area {
        self.with(other, OverlayRule::Difference)
    }

    pub(crate) fn common(&self, other: &Area) -> Area {
        self.with(other, OverlayRule::Intersect)
    }

    /// The area grown by `distance` on every side, or shrunk by it if negative (m).
    pub(crate) fn grown(&self, distance: f64) -> Area {
        if self.parts.is_empty() {
            return Area::default();
        }
        let style = OutlineStyle::new(distance).line_join(LineJoin::Round(0.1));
        Area { parts: self.parts.outline_fixed_scale(&style, GRID).unwrap_or_else(|_| self.parts.outline(&style)) }
    }

    /// The area with fewer points: what is left out lies within `tolerance` of the new edges (m).
    pub(crate) fn simplified(&self, tolerance: f64) -> Area {
        let contour = |contour: &Vec<[f64; 2]>| simplified(contour, tolerance);
        let part = |part: &Part| part.iter().map(contour).filter(|contour| 2 < contour.len()).collect();
        Area { parts: self.parts.iter().map(part).filter(|part: &Part| !part.is_empty()).collect() }
    }

    /// The area by contours that do not cross themselves, without spikes narrower than `tolerance`, and without
    /// contours of less than a size (m, m²).
    pub(crate) fn tidied(&self, tolerance: f64, smallest: f64) -> Area {
        let spikeless = |area: &Area| {
            let part = |part: &Part| part.iter().map(|contour| without_spikes(contour, tolerance)).collect();
            Area { parts: area.parts.iter().map(part).collect() }
        };
        let mut area = spikeless(&spikeless(self).plus(&Area::default()));
        for part in &mut area.parts {
            part.retain(|contour| smallest <= signed_area(contour).abs());
        }
        area.parts.retain(|part| !part.is_empty());
        area
    }

    /// The area with every gap closed that is narrower than `width`, a tenth of it uncertain (m).
    pub(crate) fn closed(&self, width: f64) -> Area {
        // Fewer points make this several times as fast; what they add at most is shrunk away again.
        let tolerance = width / 10.0;
        self.plus(&self.simplified(tolerance).grown(width / 2.0).grown(-width / 2.0 - tolerance))
    }

    /// The area without what is connected to it, or hangs on it, by slits narrower than `width`; edges are replaced by
    /// longer ones within `tolerance` on the way, which is faster (m).
    ///
    /// What is grown back covers what was shrunk with a quarter of the width to spare; corners of 90 deg keep 0.04 of
    /// it.
    pub(crate) fn without_slits(&self, width: f64, tolerance: f64) -> Area {
        self.common(&self.grown(-width / 2.0).simplified(tolerance).grown(0.75 * width))
    }

    /// The areas that the parts enclose without being a part of them, each with the contour reversed.
    pub(crate) fn holes(&self) -> impl Iterator<Item = Area> + '_ {
        let holes = self.parts.iter().flat_map(|part| part.iter().skip(1));
        holes.map(|hole| Area { parts: vec![vec![hole.iter().rev().copied().collect()]] })
    }

    /// The area's size (m²).
    pub(crate) fn size(&self) -> f64 {
        self.parts.iter().flatten().map(|contour| signed_area(contour)).sum()
    }

    /// Corners of the smallest upright rectangle around it (m).
    pub(crate) fn bounds(&self) -> (DVec2, DVec2) {
        let points = self.parts.iter().flatten().flatten().map(|&p| DVec2::from(p));
        points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
    }
}

/// Most points that one edge of a simplified contour replaces.
const MOST_REPLACED: usize = 100;

/// A contour with edges as long as they may be while the points that they replace lie within `tolerance` of them.
fn simplified(contour: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    let n = contour.len();
    let at = |i: usize| DVec2::from(contour[i % n]);
    let mut kept = Vec::new();
    let mut from = 0;
    while from < n {
        kept.push(contour[from]);
        let fits = |to: &usize| {
            let edge = Piece::Segment { from: at(from), to: at(*to) };
            (from + 1..*to).all(|i| edge.distance(at(i)) < tolerance)
        };
        let farthest = (from + 2..=(from + MOST_REPLACED).min(n)).take_while(fits).last();
        from = farthest.unwrap_or(from + 1);
    }
    kept
}

/// A contour without the points at which it turns back while the next edge lies within `tolerance` of the last one, or
/// the last one of the next (m).
pub(crate) fn without_spikes(contour: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    let mut kept = contour.to_vec();
    let (mut at, mut n_passed) = (0, 0);
    while 3 < kept.len() && n_passed < kept.len() {
        let n = kept.len();
        let [before, tip, after] = [at + n - 1, at, at + 1].map(|i| DVec2::from(kept[i % n]));
        let near = |edge: [DVec2; 2], p: DVec2| Piece::Segment { from: edge[0], to: edge[1] }.distance(p) < tolerance;
        let turns_back = (tip - before).dot(after - tip) < 0.0;
        if turns_back && (near([before, tip], after) || near([tip, after], before)) {
            kept.remove(at);
            (at, n_passed) = (at.saturating_sub(1), 0);
        } else {
            (at, n_passed) = ((at + 1) % n, n_passed + 1);
        }
    }
    kept
}

/// What a rule makes of two sets of contours.
fn overlaid<R: ShapeResource<[f64; 2]>>(subject: &R, clip: &R, rule: OverlayRule) -> Vec<Part> {
    // The grid reaches 65 km from the middle; a map that is larger has a coarser one.
    let fixed = subject.overlay_with_fixed_scale(clip, rule, FillRule::NonZero, GRID);
    fixed.unwrap_or_else(|_| subject.overlay(clip, rule, FillRule::NonZero))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f64, y: f64, side: f64) -> Vec<DVec2> {
        [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)].map(|(u, v)| DVec2::new(x + u, y + v)).to_vec()
    }

    #[test]
    fn squares_around_a_square_leave_a_hole_of_its_size() {
        let around = (0..9).filter(|&i| i != 4).map(|i| square(f64::from(i % 3), f64::from(i / 3), 1.0));
        let area = Area::union(around);
        assert_eq!((area.parts.len(), area.parts[0].len()), (1, 2));
        assert!((area.size() - 8.0).abs() < 1e-9);
        let hole = area.holes().next().unwrap();
        assert!((hole.size() - 1.0).abs() < 1e-9);
        assert!((area.plus(&hole).size() - 9.0).abs() < 1e-9 && area.common(&hole).size().abs() < 1e-9);
    }

    #[test]
    fn a_simplified_circle_has_fewer_points_and_nearly_its_size() {
        let circle: Vec<DVec2> =
            (0..1000).map(|i| 10.0 * DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 1000.0)).collect();
        let whole = Area::union(std::iter::once(circle));
        let simple = whole.simplified(0.003);
        assert!(simple.parts[0][0].len() < 200 && (simple.size() - whole.size()).abs() < 0.003 * 63.0);
        // Corners stay.
        assert_eq!(Area::union(std::iter::once(square(0.0, 0.0, 1.0))).simplified(0.1).parts[0][0].len(), 4);
    }

    #[test]
    fn a_contour_that_crosses_itself_is_tidied_into_those_that_do_not_and_slivers_go() {
        // A square whose lower side goes back and forth, and dips below itself.
        let outer =
            vec![[0.0, 0.0], [0.6, 0.0], [0.4, 0.0], [0.5, 0.004], [0.45, -0.004], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let sliver = vec![[3.0, 0.0], [4.0, 0.0], [4.0, 1e-3]];
        let area = Area { parts: vec![vec![outer], vec![sliver]] }.tidied(0.005, 1e-3);
        assert_eq!((area.parts.len(), area.parts[0].len()), (1, 1));
        assert!((area.size() - 1.0).abs() < 2e-3, "{}", area.size());
        let contour = points(&area.parts[0][0]);
        let n = contour.len();
        let edge = |i: usize| Piece::Segment { from: contour[i], to: contour[(i + 1) % n] };
        let apart = |i: usize, j: usize| 1 < j - i && (i, j) != (0, n - 1);
        let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).filter(|&(i, j)| apart(i, j));
        assert!(pairs.into_iter().all(|(i, j)| edge(i).meetings(&edge(j)).is_empty()), "{contour:?}");
    }

    #[test]
    fn a_gap_is_closed_if_it_is_narrow_and_left_if_it_is_wide() {
        let apart =
            |gap: f64| Area::union([square(0.0, 0.0, 1.0), square(1.0 + gap, 0.0, 1.0)].into_iter()).closed(0.02);
        assert_eq!(apart(0.015).parts.len(), 1);
        assert_eq!(apart(0.025).parts.len(), 2);
        assert!((apart(0.025).size() - 2.0).abs() < 1e-6);
    }
}
