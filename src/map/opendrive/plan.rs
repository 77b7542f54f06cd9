//! The reference line of a road from its XML, piece by piece, and whether the pieces hang together.

use glam::DVec2;
use roxmltree::Node;

use super::records::{Geometry, Shape};
use super::source::Source;
use super::xml::{attribute, children, shown};
use crate::files::reader::Error;

/// Largest coordinate (m).
const FARTHEST: f64 = 1e8;
/// A curvature beyond this is warned of: editors write such pieces of a centimetre or so (1/m).
const SHARPEST: f64 = 10.0;
/// Largest number that is read as a curvature (1/m).
const LARGEST_CURVATURE: f64 = 1e9;
/// Most that one piece of a reference line turns (rad).
const MOST_TURN: f64 = 30.0;
/// A reference line whose pieces leave a gap beyond this is warned of (m).
const GAP: f64 = 0.01;
/// A gap beyond this is refused, and a curve whose points lie this much farther from its beginning than it is long
/// (m).
const WIDEST_GAP: f64 = 100.0;

impl Source<'_, '_> {
    /// The pieces of a road's reference line in their order.
    pub(super) fn plan(&mut self, plan: Node) -> Result<Vec<Geometry>, Error> {
        let mut pieces = Vec::new();
        for node in children(plan, "geometry") {
            pieces.push((self.geometry(node)?, node));
        }
        if pieces.is_empty() {
            return Err(self.invalid(plan, "geometry", "missing", "every road needs at least one"));
        }
        pieces.sort_by(|(one, _), (other, _)| one.start.total_cmp(&other.start));
        for pair in pieces.windows(2) {
            let [(before, _), (after, node)] = pair else { continue };
            let gap = before.end().distance(after.origin);
            if WIDEST_GAP < gap {
                let expected = format!("must begin where the piece before it ends, at most {WIDEST_GAP} m away");
                return Err(self.invalid(*node, "x and y", &format!("{gap:.1} m away"), expected));
            }
            if GAP < gap {
                self.warn(plan, &format!("its reference line jumps by {gap:.3} m at s {:.2} m", after.start));
            }
            let over = before.start + before.length - after.start;
            if GAP < over.abs() {
                let says = format!("a piece begins at s {:.2} m and has {:.2} m", before.start, before.length);
                self.warn(plan, &format!("{says}, the next begins at s {:.2} m", after.start));
            }
        }
        Ok(pieces.into_iter().map(|(piece, _)| piece).collect())
    }

    fn geometry(&mut self, node: Node) -> Result<Geometry, Error> {
        let length = self.length(node, "length")?;
        // What any element may have beside its own.
        let extra = ["userData", "dataQuality", "include"];
        let form = node.children().find(|child| child.is_element() && !extra.contains(&child.tag_name().name()));
        let mut sharpest: f64 = 0.0;
        let mut curvature = |form: Node, key: &str| -> Result<f64, Error> {
            let curvature = self.number(form, key, None, LARGEST_CURVATURE)?;
            if MOST_TURN < curvature.abs() * length {
                return Err(self.invalid(
                    form,
                    key,
                    attribute(form, key),
                    format!("turns more than {MOST_TURN} rad on its length"),
                ));
            }
            sharpest = sharpest.max(curvature.abs());
            Ok(curvature)
        };
        let shape = match form.map(|form| (form.tag_name().name(), form)) {
            Some(("line", _)) => Shape::Line,
            Some(("arc", form)) => Shape::Arc(curvature(form, "curvature")?),
            Some(("spiral", form)) => Shape::Spiral(curvature(form, "curvStart")?, curvature(form, "curvEnd")?),
            Some(("poly3", form)) => Shape::Poly3(self.factors(form, ["a", "b", "c", "d"])?),
            Some(("paramPoly3", form)) => {
                let range = attribute(form, "pRange");
                if !["", "normalized", "arcLength"].contains(&range) {
                    let expected = "must be \"arcLength\" or \"normalized\"";
                    return Err(self.invalid(form, "pRange", &format!("{range:?}"), expected));
                }
                Shape::ParamPoly3 {
                    u: self.factors(form, ["aU", "bU", "cU", "dU"])?,
                    v: self.factors(form, ["aV", "bV", "cV", "dV"])?,
                    normalised: range != "arcLength",
                }
            }
            other => {
                let found = other.map_or("missing".to_owned(), |(name, _)| format!("<{}>", shown(name)));
                return Err(self.invalid(node, "form", &found, "must be line, arc, spiral, poly3 or paramPoly3"));
            }
        };
        if SHARPEST < sharpest {
            self.warn(
                node,
                &format!("has a radius of {:.4} m on a length of {length:.4} m; it is read as it is", 1.0 / sharpest),
            );
        }
        let origin = DVec2::new(self.number(node, "x", None, FARTHEST)?, self.number(node, "y", None, FARTHEST)?);
        let heading = self.number(node, "hdg", None, 1e6)?;
        let geometry = Geometry { start: self.length(node, "s")?, origin, heading, length, shape };
        let far = |part: i32| geometry.pose(length * f64::from(part) / 4.0).0.distance(origin);
        let most = 2.0 * length + WIDEST_GAP;
        if let Some(far) = (0..=4).map(far).find(|far| !(0.0..=most).contains(far)) {
            let expected = format!("leads too far for a length of {length:.3} m: its factors or its length are wrong");
            return Err(self.invalid(node, "curve", &format!("{far:e} m from its beginning"), expected));
        }
        Ok(geometry)
    }
}
