//! The edges of aprons among the kerbs of a drawing.
//!
//! An apron is drawn by its inner edge, by its outer one, or as the strip between both; and either edge may be drawn as
//! the island's kerb. What tractors keep to is the outer edge.

use super::site::GAP;
use crate::geometry::{Curve, Outline};

/// The kerb faces, and the inner edges of the aprons, from the kerbs and the edges of aprons that are drawn.
pub(super) fn placed(mut kerbs: Vec<Curve>, drawn: Vec<Curve>) -> (Vec<Curve>, Vec<Curve>) {
    let mut inner: Vec<Curve> = Vec::new();
    for edge in drawn {
        if kerbs.iter().chain(&inner).any(|other| coincides(&edge, other)) {
            continue;
        }
        match kerbs.iter().position(|kerb| encloses(&edge, kerb)) {
            // The outer edge, within which the island's kerb is drawn.
            Some(island) => inner.push(std::mem::replace(&mut kerbs[island], edge)),
            None => inner.push(edge),
        }
    }
    (kerbs, inner)
}

/// Whether an edge is drawn where another line is.
pub(super) fn coincides(edge: &Curve, other: &Curve) -> bool {
    let near = |(one, other): (&Curve, &Curve)| one.polyline(GAP).into_iter().all(|p| other.distance(p) < GAP);
    [(edge, other), (other, edge)].into_iter().all(near)
}

fn encloses(edge: &Curve, kerb: &Curve) -> bool {
    Outline::new(vec![edge.clone()]).contains(kerb.point_at(0.0))
}
