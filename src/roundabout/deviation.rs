//! How far a roundabout's parameters are from a measured one: road edges and lane centre lines, in both directions.
//!
//! Measured road edges are the lanes' edges, so they are compared with the outline of [`Gutter::Solid`]. Points farther than [`WITHIN`]
//! from the centre do not count, nor do points whose nearest counterpart is the loose end of a measured line: there nothing was measured.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::{Gutter, Roundabout};
use crate::geometry::{Curve, Piece};
use crate::route::Lane;

/// How far from the ring's centre deviations count [m].
pub const WITHIN: f64 = 45.0;

/// Spacing of the points at which lines are compared [m].
const STEP: f64 = 0.5;

/// A line as measured: points joined by straights.
pub type Line = Vec<[f64; 2]>;

/// A measured roundabout, its ring's centre at the origin [m].
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// Where the numbers come from and what was left out.
    pub note: String,
    /// The edge around the central island: in places the kerb's face, in places the lane's edge.
    pub island: Vec<Line>,
    /// Stretches of the road's outer edge that follow the ring.
    pub ring: Vec<Line>,
    /// The road's outer edge, from arm to arm.
    pub kerbs: Vec<Line>,
    /// The edges of splitter islands where they face the arm's lanes.
    pub splitters: Vec<Line>,
    /// Ways through, unbroken stretches only.
    pub routes: Vec<MeasuredRoute>,
}

/// A way through a measured roundabout.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredRoute {
    /// Name of the entry arm.
    pub entry: String,
    /// The lane kept.
    pub lane: Lane,
    /// Exit number, counter-clockwise from 1.
    pub exit: u32,
    /// Its unbroken stretches.
    pub stretches: Vec<Line>,
}

/// How far a set of points is from what they should lie on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Spread {
    /// The largest distance [m].
    pub worst: f64,
    /// The mean distance [m].
    pub mean: f64,
    /// How many points were compared.
    pub points: usize,
}

/// One row of the comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Deviation {
    /// `island`, `ring`, `kerbs`, `splitters`, or a route as `E-left-2`.
    pub what: String,
    /// Measured points to the parameters' curves.
    pub from_measured: Spread,
    /// Points of the parameters' curves to the measured lines; no points where only stretches were measured.
    pub from_model: Spread,
}

/// A measured route that the roundabout does not have.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the roundabout has no route {0}")]
pub struct UnknownRoute(pub String);

/// Compares a roundabout with its measured counterpart, row by row.
pub fn deviations(roundabout: &Roundabout, measured: &Measured) -> Result<Vec<Deviation>, UnknownRoute> {
    let solid = roundabout.kerbs(Gutter::Solid);
    let (boundary, holes): (Vec<Curve>, Vec<Curve>) = solid.loops.into_iter().partition(|curve| 0.0 < curve.signed_area());
    let splitters: Vec<Curve> = holes.into_iter().filter(|curve| curve.distance(DVec2::ZERO) > roundabout.outer_radius() - 1.0).collect();
    let face = roundabout.ring.island_radius;
    let island = |p: DVec2| (face - p.length()).max(p.length() - face - roundabout.ring.gutter).max(0.0);
    let mut rows = vec![
        Deviation {
            what: "island".into(),
            from_measured: spread(points(&measured.island).into_iter().map(island)),
            from_model: Spread::default(),
        },
        Deviation { what: "ring".into(), from_measured: to_curves(&measured.ring, &boundary), from_model: Spread::default() },
        Deviation {
            what: "kerbs".into(),
            from_measured: to_curves(&measured.kerbs, &boundary),
            from_model: to_lines(&boundary, &measured.kerbs),
        },
        Deviation {
            what: "splitters".into(),
            from_measured: to_curves(&measured.splitters, &splitters),
            from_model: to_lines(&splitters, &measured.splitters),
        },
    ];
    for route in &measured.routes {
        let what = format!("{}-{}-{}", route.entry, route.lane.name(), route.exit);
        let entry = roundabout.arms().position(|arm| arm == route.entry);
        let known = super::lane::exits(roundabout.arms.len()).any(|way| way == (route.lane, route.exit));
        let (Some(entry), true) = (entry, known) else { return Err(UnknownRoute(what)) };
        let line = [roundabout.lanes.route(entry, route.lane, route.exit)];
        // Beside a broken line the nearest measured point may belong to another part of the way.
        let outside = |end: Option<&[f64; 2]>| end.is_some_and(|end| roundabout.outer_radius() < DVec2::from(*end).length());
        let whole = matches!(&route.stretches[..], [stretch] if outside(stretch.first()) && outside(stretch.last()));
        let from_model = if whole { to_lines(&line, &route.stretches) } else { Spread::default() };
        rows.push(Deviation { what, from_measured: to_curves(&route.stretches, &line), from_model });
    }
    Ok(rows)
}

/// Points every [`STEP`] along measured lines, near enough to the centre to count.
fn points(lines: &[Line]) -> Vec<DVec2> {
    lines.iter().flat_map(|line| sampled(&curve(line))).collect()
}

fn curve(line: &Line) -> Curve {
    Curve { pieces: line.windows(2).map(|ends| Piece::Segment { from: ends[0].into(), to: ends[1].into() }).collect() }
}

fn sampled(curve: &Curve) -> Vec<DVec2> {
    let steps = (curve.length() / STEP).ceil().max(1.0);
    let points = (0..=steps as usize).map(|step| curve.point_at(curve.length() * step as f64 / steps));
    points.filter(|p| p.length() <= WITHIN).collect()
}

fn to_curves(lines: &[Line], curves: &[Curve]) -> Spread {
    let nearest = |p: DVec2| curves.iter().map(|curve| curve.distance(p)).fold(f64::INFINITY, f64::min);
    spread(points(lines).into_iter().map(nearest))
}

fn to_lines(curves: &[Curve], lines: &[Line]) -> Spread {
    let lines: Vec<Curve> = lines.iter().map(curve).collect();
    let loose: Vec<DVec2> =
        lines.iter().filter(|line| !closed(line)).flat_map(|line| [line.point_at(0.0), line.point_at(f64::INFINITY)]).collect();
    let distance = |p: DVec2| {
        let nearest = lines.iter().map(|line| line.distance(p)).fold(f64::INFINITY, f64::min);
        let end = loose.iter().map(|end| end.distance(p)).fold(f64::INFINITY, f64::min);
        (nearest < end - 1e-9).then_some(nearest)
    };
    spread(curves.iter().flat_map(sampled).filter_map(distance))
}

fn closed(line: &Curve) -> bool {
    line.point_at(0.0).distance(line.point_at(f64::INFINITY)) < 1e-9
}

fn spread(distances: impl Iterator<Item = f64>) -> Spread {
    let (worst, sum, points) = distances.fold((0.0_f64, 0.0, 0), |(worst, sum, points), d| (worst.max(d), sum + d, points + 1));
    Spread { worst, mean: if points == 0 { 0.0 } else { sum / points as f64 }, points }
}
