//! Exact intersections of segments and arcs.

use glam::DVec2;

use super::Piece;

/// Circles at most this far apart touch (m).
const TOUCHING: f64 = 1e-6;

impl Piece {
    /// The common points of two pieces, including points of contact; stretches that coincide are not listed.
    pub(crate) fn meetings(&self, other: &Piece) -> Vec<DVec2> {
        match (*self, *other) {
            (Piece::Segment { from, to }, _) => {
                let along = to - from;
                let on = |fraction: &f64| (0.0..=1.0).contains(fraction);
                other
                    .on_line(from, along)
                    .into_iter()
                    .flatten()
                    .filter(on)
                    .map(|fraction| from + fraction * along)
                    .collect()
            }
            (Piece::Arc { .. }, Piece::Segment { .. }) => other.meetings(self),
            (Piece::Arc { centre, radius, .. }, Piece::Arc { centre: other_centre, radius: other_radius, .. }) => {
                let between = other_centre - centre;
                let distance = between.length();
                if distance == 0.0 {
                    return Vec::new();
                }
                let ahead = (distance * distance + radius * radius - other_radius * other_radius) / (2.0 * distance);
                let square = radius * radius - ahead * ahead;
                // Tangent circles meet in one point, although rounding may separate them.
                let apart = (distance - (radius + other_radius)).max((radius - other_radius).abs() - distance);
                if square < -1e-9 * radius * radius || TOUCHING < apart {
                    return Vec::new();
                }
                let direction = between / distance;
                let side = direction.perp() * square.max(0.0).sqrt();
                let points = [centre + direction * ahead + side, centre + direction * ahead - side];
                points.into_iter().filter(|&p| self.faces(p - centre) && other.faces(p - other_centre)).collect()
            }
        }
    }

    /// The multiples of `along` at which the line from `origin` crosses the piece.
    pub(crate) fn on_line(&self, origin: DVec2, along: DVec2) -> [Option<f64>; 2] {
        match *self {
            Piece::Segment { from, to } => {
                let across = to - from;
                let turn = along.perp_dot(across);
                let fraction = (from - origin).perp_dot(along) / turn;
                let hit = turn != 0.0 && (0.0..=1.0).contains(&fraction);
                [hit.then(|| (from - origin).perp_dot(across) / turn), None]
            }
            Piece::Arc { centre, radius, .. } => {
                let out = origin - centre;
                let (a, b, c) = (along.length_squared(), out.dot(along), out.length_squared() - radius * radius);
                let square = b * b - a * c;
                if square < 0.0 || a == 0.0 {
                    return [None, None];
                }
                let on = |fraction: &f64| self.faces(out + *fraction * along);
                [Some((-b - square.sqrt()) / a).filter(on), Some((-b + square.sqrt()) / a).filter(on)]
            }
        }
    }
}
