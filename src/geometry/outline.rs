//! The edge of what can be driven on: closed curves, with exact distance, side, rays and overlap.
//!
//! A point is drivable if a ray from it crosses the loops an odd number of times, that is, inside the outer boundary
//! and outside the islands. Loops have the drivable side on their left.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec2;

use super::offset::grown;
use super::{Curve, Piece};

/// Closed loops that separate the drivable surface from the solid area.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// The loops, each with the drivable side on its left.
    pub loops: Vec<Curve>,
    pieces: Vec<Placed>,
    rises: Vec<Rise>,
}

/// A piece with precomputed values for its distance.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Placed {
    piece: Piece,
    start: DVec2,
    end: DVec2,
    /// Direction from an arc's centre to its middle.
    middle: DVec2,
    /// Cosine of half an arc's sweep, at most -1 for a whole circle.
    half: f64,
}

impl Placed {
    fn new(piece: Piece) -> Placed {
        let (middle, half) = match piece {
            Piece::Segment { .. } => (DVec2::ZERO, 0.0),
            Piece::Arc { from, sweep, .. } => {
                let half = sweep.abs() / 2.0;
                (DVec2::from_angle(from + sweep / 2.0), if PI <= half { -2.0 } else { half.cos() })
            }
        };
        Placed { piece, start: piece.start(), end: piece.end(), middle, half }
    }

    fn distance(&self, p: DVec2) -> f64 {
        match self.piece {
            Piece::Segment { .. } => self.piece.distance(p),
            Piece::Arc { centre, radius, .. } => {
                let out = p - centre;
                let length = out.length();
                if length * self.half <= out.dot(self.middle) {
                    (length - radius).abs()
                } else {
                    p.distance_squared(self.start).min(p.distance_squared(self.end)).sqrt()
                }
            }
        }
    }
}

/// A stretch of the outline along which y only rises or only falls. Neighbours have bit-identical ends, so that a
/// horizontal ray through a vertex is counted once.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rise {
    from: DVec2,
    to: DVec2,
    /// Centre, radius and side (+1 east, -1 west) of an arc.
    arc: Option<(DVec2, f64, f64)>,
}

impl Rise {
    /// Whether the ray from `p` to the east crosses this stretch.
    fn crossed(&self, p: DVec2) -> bool {
        if (self.from.y <= p.y) == (self.to.y <= p.y) {
            return false;
        }
        let x = match self.arc {
            Some((centre, radius, side)) => {
                centre.x + side * (radius * radius - (p.y - centre.y).powi(2)).max(0.0).sqrt()
            }
            None => self.from.x + (p.y - self.from.y) / (self.to.y - self.from.y) * (self.to.x - self.from.x),
        };
        p.x < x
    }
}

impl Outline {
    /// The outline that `loops` make, whichever way each is travelled; every loop must be closed.
    pub fn new(loops: Vec<Curve>) -> Outline {
        let rises: Vec<Vec<Rise>> = loops.iter().map(rises_of).collect();
        let turned = |(index, curve): (usize, &Curve)| {
            let inside = |other: &usize| *other != index && odd(&rises[*other], curve.point_at(0.0));
            let hole = (0..loops.len()).filter(inside).count() % 2 == 1;
            if (curve.signed_area() < 0.0) == hole { curve.clone() } else { curve.reversed() }
        };
        let loops: Vec<Curve> = loops.iter().enumerate().map(turned).collect();
        let pieces = loops.iter().flat_map(|curve| &curve.pieces).map(|&piece| Placed::new(piece)).collect();
        Outline { loops, pieces, rises: rises.concat() }
    }

    /// Unsigned distance from `p` to the outline (m).
    pub fn distance(&self, p: DVec2) -> f64 {
        nearest(&self.pieces, p)
    }

    /// Whether `p` lies on the drivable surface.
    pub fn contains(&self, p: DVec2) -> bool {
        odd(&self.rises, p)
    }

    /// Distance from `p` to the outline, positive on the drivable surface, negative in the solid area (m).
    pub fn signed_distance(&self, p: DVec2) -> f64 {
        if self.contains(p) { self.distance(p) } else { -self.distance(p) }
    }

    /// Distance along the ray from `origin` in `direction` (of length 1) to the outline; `range` where nothing is met
    /// before, 0 from inside a solid (m).
    pub fn ray(&self, origin: DVec2, direction: DVec2, range: f64) -> f64 {
        if !self.contains(origin) {
            return 0.0;
        }
        let hits = self.pieces.iter().flat_map(|placed| placed.piece.on_line(origin, direction)).flatten();
        hits.filter(|&hit| 0.0 <= hit).fold(range, f64::min)
    }

    /// Whether the rectangle with these corners, in order around it, touches the solid area.
    pub fn intersects_rectangle(&self, corners: &[DVec2; 4]) -> bool {
        let edges: [Piece; 4] = std::array::from_fn(|i| Piece::Segment { from: corners[i], to: corners[(i + 1) % 4] });
        // A loop that meets no edge lies completely inside the rectangle or completely outside it.
        let within = |p: DVec2| {
            let sides = edges.map(|edge| (edge.end() - edge.start()).perp_dot(p - edge.start()));
            sides.iter().all(|&side| 0.0 <= side) || sides.iter().all(|&side| side <= 0.0)
        };
        !self.contains(corners[0])
            || self.pieces.iter().any(|placed| edges.iter().any(|edge| !edge.meetings(&placed.piece).is_empty()))
            || self.loops.iter().any(|curve| within(curve.point_at(0.0)))
    }

    /// The corners (west south, east north) of the smallest upright rectangle around the outline (m).
    pub fn bounds(&self) -> (DVec2, DVec2) {
        let ends = self.rises.iter().flat_map(|rise| {
            let bulge = rise.arc.and_then(|(centre, radius, side)| {
                // The stretch passes its circle's easternmost or westernmost point when it passes the centre's height.
                ((rise.from.y <= centre.y) != (rise.to.y <= centre.y)).then(|| centre + DVec2::new(side * radius, 0.0))
            });
            [Some(rise.from), Some(rise.to), bulge].into_iter().flatten()
        });
        ends.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
    }

    /// The part of the outline that suffices for signed distances of points within `radius` of `centre`: far fewer
    /// pieces than the whole.
    pub fn near(&self, centre: DVec2, radius: f64) -> Nearby {
        culled(&self.pieces, &self.rises, centre, radius)
    }

    /// The outline with the solid area grown by `distance`: every point of the new outline is `distance` from the old
    /// one (m).
    pub fn offset(&self, distance: f64) -> Outline {
        Outline::new(grown(self, distance))
    }
}

/// A part of an [`Outline`] that gives exact signed distances in one neighbourhood.
#[derive(Debug, Clone)]
pub struct Nearby {
    pieces: Vec<Placed>,
    side: Side,
}

#[derive(Debug, Clone)]
enum Side {
    /// No outline within the radius: all points are on one side.
    Same(bool),
    /// The stretches that a ray to the east from any of the points may cross.
    Mixed(Vec<Rise>),
}

/// The pieces and stretches that suffice within `radius` of `centre`.
fn culled(pieces: &[Placed], rises: &[Rise], centre: DVec2, radius: f64) -> Nearby {
    let distances: Vec<f64> = pieces.iter().map(|placed| placed.distance(centre)).collect();
    let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
    // A point within `radius` is at most `least + radius` from the outline and sees each piece at most `radius` nearer
    // than the centre.
    let reach = least + 2.0 * radius + 1e-9;
    let pieces =
        pieces.iter().zip(&distances).filter(|&(_, &distance)| distance <= reach).map(|(placed, _)| *placed).collect();
    let side = if radius < least {
        Side::Same(odd(rises, centre))
    } else {
        let level = |rise: &&Rise| {
            rise.from.y.min(rise.to.y) <= centre.y + radius && centre.y - radius <= rise.from.y.max(rise.to.y)
        };
        Side::Mixed(rises.iter().filter(level).copied().collect())
    };
    Nearby { pieces, side }
}

impl Nearby {
    /// The part of this part that suffices for points within `radius` of `centre`, which lie within this part's own
    /// radius.
    pub fn near(&self, centre: DVec2, radius: f64) -> Nearby {
        let rises: &[Rise] = if let Side::Mixed(rises) = &self.side { rises } else { &[] };
        let mut nearby = culled(&self.pieces, rises, centre, radius);
        if let Side::Same(drivable) = self.side {
            nearby.side = Side::Same(drivable);
        }
        nearby
    }

    /// The point of a segment within the radius given to [`Outline::near`] that is nearest to the outline, and its
    /// distance, exact where they do not cross (m).
    pub fn nearest_of(&self, from: DVec2, to: DVec2) -> (DVec2, f64) {
        let along = to - from;
        let length_squared = along.length_squared().max(f64::MIN_POSITIVE);
        let beside = |p: DVec2| from + ((p - from).dot(along) / length_squared).clamp(0.0, 1.0) * along;
        let of_piece = |placed: &Placed| {
            let opposite = match placed.piece {
                Piece::Segment { .. } => placed.start,
                Piece::Arc { centre, .. } => centre,
            };
            let feet = [from, to, beside(placed.start), beside(placed.end), beside(opposite)];
            feet.map(|p| (p, placed.distance(p)))
        };
        self.pieces.iter().flat_map(of_piece).fold((from, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a })
    }

    /// Where a segment within the radius given to [`Outline::near`] crosses or touches the outline, from its beginning.
    pub fn crossings(&self, from: DVec2, to: DVec2) -> Vec<DVec2> {
        let segment = Piece::Segment { from, to };
        let mut found: Vec<DVec2> = self.pieces.iter().flat_map(|placed| segment.meetings(&placed.piece)).collect();
        found.sort_by(|a, b| a.distance_squared(from).total_cmp(&b.distance_squared(from)));
        found
    }

    /// The piece that is nearest to `p`.
    pub fn nearest_piece(&self, p: DVec2) -> usize {
        let all = self.pieces.iter().enumerate().map(|(index, placed)| (placed.distance(p), index));
        all.fold((f64::INFINITY, 0), |best, other| if other.0 < best.0 { other } else { best }).1
    }

    /// Distance from `p` to a piece (m).
    pub fn piece_distance(&self, piece: usize, p: DVec2) -> f64 {
        self.pieces[piece].distance(p)
    }

    /// Signed distance from `p` to a piece extended beyond its ends, to a straight line or a whole circle: positive on
    /// the drivable side, with the gradient there (m).
    pub fn extended(&self, piece: usize, p: DVec2) -> (f64, DVec2) {
        match self.pieces[piece].piece {
            Piece::Segment { from, to } => {
                let left = (to - from).normalize_or_zero().perp();
                (left.dot(p - from), left)
            }
            Piece::Arc { centre, radius, sweep, .. } => {
                let inwards = sweep.signum();
                let out = p - centre;
                (inwards * (radius - out.length()), -inwards * out.normalize_or_zero())
            }
        }
    }

    /// Signed distance from `p` to the whole outline, exact for points within the radius given to [`Outline::near`]
    /// (m).
    pub fn signed_distance(&self, p: DVec2) -> f64 {
        let drivable = match &self.side {
            Side::Same(drivable) => *drivable,
            Side::Mixed(rises) => odd(rises, p),
        };
        if drivable { nearest(&self.pieces, p) } else { -nearest(&self.pieces, p) }
    }
}

fn nearest(pieces: &[Placed], p: DVec2) -> f64 {
    pieces.iter().map(|placed| placed.distance(p)).fold(f64::INFINITY, f64::min)
}

fn odd(rises: &[Rise], p: DVec2) -> bool {
    rises.iter().filter(|rise| rise.crossed(p)).count() % 2 == 1
}

fn rises_of(curve: &Curve) -> Vec<Rise> {
    let mut rises: Vec<Rise> = Vec::new();
    for piece in &curve.pieces {
        match *piece {
            Piece::Segment { from, to } => rises.push(Rise { from, to, arc: None }),
            Piece::Arc { centre, radius, from, sweep } => {
                // Arcs are cut at their northernmost and southernmost points.
                let (low, high) = (from.min(from + sweep), from.max(from + sweep));
                let first = ((low - FRAC_PI_2) / PI).floor() as i64 + 1;
                let mut cuts: Vec<f64> = (first..first + 4)
                    .map(|turn| FRAC_PI_2 + turn as f64 * PI)
                    .filter(|&cut| low < cut && cut < high)
                    .collect();
                cuts.insert(0, low);
                cuts.push(high);
                if sweep < 0.0 {
                    cuts.reverse();
                }
                let point = |angle: f64| centre + radius * DVec2::from_angle(angle);
                rises.extend(cuts.windows(2).map(|cut| Rise {
                    from: point(cut[0]),
                    to: point(cut[1]),
                    arc: Some((centre, radius, ((cut[0] + cut[1]) / 2.0).cos().signum())),
                }));
            }
        }
    }
    for index in 0..rises.len() {
        rises[index].from = rises[(index + rises.len() - 1) % rises.len()].to;
    }
    rises
}
