//! Distances between a roundabout's curves and measured lines: road edges and lane centre lines, in both directions.
//!
//! Measured road edges are the lanes' edges, so they are compared with the outline of [`Gutter::Solid`]; measured kerb
//! faces with that of [`Gutter::Drivable`]. Two kinds of points are left out: those farther than [`WITHIN`] from the
//! centre, and those whose nearest counterpart is the loose end of a measured line, beyond which nothing was measured.

use glam::DVec2;
use offtrack::files::reader::{shortened, shown};
use offtrack::geometry::{Curve, Piece};
use offtrack::map::route::Lane;
use offtrack::map::{Gutter, Road};
use serde::{Deserialize, Serialize};

/// Distance from the ring's centre within which points are compared (m).
pub const WITHIN: f64 = 45.0;

/// Maximum magnitude of a measured coordinate (m).
pub const FARTHEST: f64 = 1000.0;

/// Maximum length of all measured lines together (m).
pub const LONGEST: f64 = 20_000.0;

/// Spacing of the points at which lines are compared (m).
const STEP: f64 = 0.5;

/// Distances within which the points of a [`Spread`] are counted (m).
pub const NEAR: [f64; 3] = [0.05, 0.1, 0.3];

/// A measured line: points joined by straights (m).
pub type Line = Vec<[f64; 2]>;

/// A measured roundabout, its ring's centre at the origin (m).
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// Source of the data, and what was left out.
    pub note: String,
    /// The edge around the central island: the kerb's face in some stretches, the lane's edge in others.
    pub island: Vec<Line>,
    /// Stretches of the road's outer edge that follow the ring.
    pub ring: Vec<Line>,
    /// The road's outer edge, from arm to arm.
    pub kerbs: Vec<Line>,
    /// The edges of splitter islands where they face the arm's lanes.
    pub splitters: Vec<Line>,
    /// Routes, unbroken stretches only.
    pub routes: Vec<MeasuredRoute>,
    /// All kerb faces, where they were measured too.
    #[serde(default)]
    pub faces: Vec<Line>,
    /// With them all edges of the lanes, the gutters painted across the arms' mouths included.
    #[serde(default)]
    pub edges: Vec<Line>,
}

/// A route through a measured roundabout.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredRoute {
    /// Name of the entry arm.
    pub entry: String,
    /// The lane it keeps.
    pub lane: Lane,
    /// Exit number, counter-clockwise from 1.
    pub exit: u32,
    /// The route's unbroken stretches.
    pub stretches: Vec<Line>,
}

/// Distances of a set of points from the curves they should lie on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Spread {
    /// The largest distance (m).
    pub worst: f64,
    /// The mean distance (m).
    pub mean: f64,
    /// Number of points that were compared.
    pub points: usize,
    /// Number of those that lie within each distance of [`NEAR`].
    pub near: [usize; 3],
}

/// One row of the comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Deviation {
    /// `island`, `ring`, `kerbs`, `splitters`; `faces`, `edges`, all of them where they were measured; or a route as
    /// `E-left-2`.
    pub what: String,
    /// Measured points to the parameters' curves.
    pub from_measured: Spread,
    /// Points of the parameters' curves to the measured lines; no points where only stretches were measured.
    pub from_model: Spread,
}

impl Deviation {
    /// The fractions of all points, both ways, that lie within each distance of [`NEAR`]; 1 without points.
    pub fn near(&self) -> [f64; 3] {
        let points = self.from_measured.points + self.from_model.points;
        std::array::from_fn(|i| match points {
            0 => 1.0,
            points => (self.from_measured.near[i] + self.from_model.near[i]) as f64 / points as f64,
        })
    }
}

/// Measured lines that cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A measured route that the roundabout does not have.
    #[error("{key}: {route}; the roundabout has no such route")]
    UnknownRoute {
        /// The route's key, `routes[3]`.
        key: String,
        /// Entry arm, lane and exit.
        route: String,
    },
    /// A coordinate far from any roundabout.
    #[error("{key}: {value} m; must lie in -{FARTHEST}..{FARTHEST} m")]
    TooFar {
        /// The coordinate's key: line, point, and 0 for x or 1 for y, `kerbs[2][17][0]`.
        key: String,
        /// The coordinate (m).
        value: String,
    },
    /// More line than any roundabout has.
    #[error("{key}: {length} m of lines up to here; must be at most {LONGEST} m in all")]
    TooLong {
        /// The key of the line that exceeds the limit.
        key: String,
        /// Length of all lines up to this one (m).
        length: String,
    },
}

impl Measured {
    /// Every line with its key, `kerbs[2]`.
    fn lines(&self) -> impl Iterator<Item = (String, &Line)> {
        let parts =
            [("island", &self.island), ("ring", &self.ring), ("kerbs", &self.kerbs), ("splitters", &self.splitters)];
        let parts = parts.into_iter().chain([("faces", &self.faces), ("edges", &self.edges)]);
        let parts = parts.map(|(key, lines)| (key.to_owned(), lines));
        let routes = self
            .routes
            .iter()
            .enumerate()
            .map(|(index, route)| (format!("routes[{index}].stretches"), &route.stretches));
        let lines = parts.chain(routes);
        lines.flat_map(|(key, lines)| {
            lines.iter().enumerate().map(move |(index, line)| (format!("{key}[{index}]"), line))
        })
    }

    /// Bounds the work of a comparison, which grows with the lines' length.
    fn check(&self) -> Result<(), Error> {
        let mut length = 0.0;
        for (key, line) in self.lines() {
            for (point, coordinates) in line.iter().enumerate() {
                let far = coordinates.iter().position(|value| !(-FARTHEST..=FARTHEST).contains(value));
                if let Some(axis) = far {
                    return Err(Error::TooFar {
                        key: format!("{key}[{point}][{axis}]"),
                        value: shown(coordinates[axis]),
                    });
                }
            }
            length += curve(line).length();
            if LONGEST < length {
                return Err(Error::TooLong { key, length: format!("{length:.0}") });
            }
        }
        Ok(())
    }
}

/// Compares a roundabout with its measured counterpart, row by row.
///
/// # Errors
///
/// Measured lines that are too long or too far away, and a route that the roundabout does not have.
pub fn deviations(roundabout: &Road, measured: &Measured) -> Result<Vec<Deviation>, Error> {
    measured.check()?;
    let mut rows = edges(roundabout, measured);
    for (index, route) in measured.routes.iter().enumerate() {
        let what = format!("{}-{}-{}", route.entry, route.lane.name(), route.exit);
        let unknown = || Error::UnknownRoute { key: format!("routes[{index}]"), route: shortened(&what, 100) };
        let line = [roundabout.line(&route.entry, route.lane, route.exit).ok_or_else(unknown)?];
        // Beside a broken line the nearest measured point may belong to another part of the route.
        let outside =
            |end: Option<&[f64; 2]>| end.is_some_and(|end| roundabout.outer_radius() < DVec2::from(*end).length());
        let whole = matches!(&route.stretches[..], [stretch] if outside(stretch.first()) && outside(stretch.last()));
        let from_model = if whole { to_lines(&line, &route.stretches) } else { Spread::default() };
        rows.push(Deviation { what, from_measured: to_curves(&route.stretches, &line), from_model });
    }
    Ok(rows)
}

/// The rows of the road's edges: island, ring, kerbs and splitter islands.
fn edges(roundabout: &Road, measured: &Measured) -> Vec<Deviation> {
    let solid = roundabout.kerbs(Gutter::Solid);
    let (boundary, holes): (Vec<Curve>, Vec<Curve>) =
        solid.loops.into_iter().partition(|curve| 0.0 < curve.signed_area());
    let splitters: Vec<Curve> =
        holes.into_iter().filter(|curve| curve.distance(DVec2::ZERO) > roundabout.outer_radius() - 1.0).collect();
    let face = roundabout.island_radius();
    let island = |p: DVec2| (face - p.length()).max(p.length() - face - roundabout.gutter()).max(0.0);
    let row = |what: &str, from_measured, from_model| Deviation { what: what.into(), from_measured, from_model };
    let mut rows = vec![
        row("island", spread(points(&measured.island).into_iter().map(island)), Spread::default()),
        row("ring", to_curves(&measured.ring, &boundary), Spread::default()),
        row("kerbs", to_curves(&measured.kerbs, &boundary), to_lines(&boundary, &measured.kerbs)),
        row("splitters", to_curves(&measured.splitters, &splitters), to_lines(&splitters, &measured.splitters)),
    ];
    for (what, lines, gutter) in
        [("faces", &measured.faces, Gutter::Drivable), ("edges", &measured.edges, Gutter::Solid)]
    {
        if !lines.is_empty() {
            let all = roundabout.kerbs(gutter).loops;
            rows.push(row(what, to_curves(lines, &all), to_lines(&all, lines)));
        }
    }
    rows
}

/// Points every [`STEP`] along measured lines that lie [`WITHIN`] the centre.
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
    let loose: Vec<DVec2> = lines
        .iter()
        .filter(|line| !closed(line))
        .flat_map(|line| [line.point_at(0.0), line.point_at(f64::INFINITY)])
        .collect();
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
    let (mut spread, mut sum) = (Spread::default(), 0.0);
    for distance in distances {
        spread.worst = spread.worst.max(distance);
        spread.points += 1;
        sum += distance;
        for (near, limit) in spread.near.iter_mut().zip(NEAR) {
            *near += usize::from(distance <= limit);
        }
    }
    Spread { mean: if spread.points == 0 { 0.0 } else { sum / spread.points as f64 }, ..spread }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured() -> Measured {
        let circle = |radius: f64| {
            (0..=60).map(|step| (radius * DVec2::from_angle(f64::from(step) * 0.104_72)).to_array()).collect()
        };
        Measured {
            note: String::new(),
            island: vec![circle(8.0)],
            ring: vec![],
            kerbs: vec![circle(16.0)],
            splitters: vec![],
            routes: vec![],
            faces: vec![],
            edges: vec![],
        }
    }

    fn refusal(measured: &Measured) -> String {
        deviations(&Road::named("16m").unwrap(), measured).unwrap_err().to_string()
    }

    #[test]
    fn a_coordinate_far_away_is_refused_with_its_key_and_value() {
        for (value, shown) in
            [(1e9, "1e9"), (-1e7, "-1e7"), (1000.5, "1000.5"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")]
        {
            let mut measured = measured();
            measured.kerbs[0][17][1] = value;
            assert_eq!(refusal(&measured), format!("kerbs[0][17][1]: {shown} m; must lie in -1000..1000 m"));
        }
    }

    #[test]
    fn more_line_than_a_roundabout_has_is_refused() {
        let mut measured = measured();
        let there_and_back = vec![[-1000.0, 0.0], [1000.0, 0.0]];
        measured.splitters = vec![there_and_back; 11];
        assert!(refusal(&measured).starts_with("splitters[9]: 20"), "{}", refusal(&measured));
        measured.splitters.truncate(9);
        deviations(&Road::named("16m").unwrap(), &measured).unwrap();
    }

    #[test]
    fn a_route_that_the_roundabout_does_not_have_is_named() {
        let mut measured = measured();
        measured.routes.push(MeasuredRoute { entry: "E".into(), lane: Lane::Right, exit: 3, stretches: vec![] });
        assert_eq!(refusal(&measured), "routes[0]: E-right-3; the roundabout has no such route");
    }

    #[test]
    fn nested_arrays_up_to_the_size_limit_are_refused_without_overflowing_the_stack() {
        let depth = crate::FILE_LIMIT as usize / 2 - 8;
        let arrays = format!("{{\"island\":{}{}}}", "[".repeat(depth), "]".repeat(depth));
        for text in [arrays.as_str(), &arrays[..depth], &"{\"cases\":".repeat(depth / 9)] {
            assert!(text.len() as u64 <= crate::FILE_LIMIT);
            assert!(serde_json::from_str::<Measured>(text).is_err());
            assert!(serde_json::from_str::<crate::trace::Case>(text).is_err());
            assert!(serde_json::from_str::<serde_json::Value>(text).is_err());
        }
    }

    #[test]
    fn empty_lines_and_lines_of_one_point_are_compared_as_nothing() {
        let mut measured = measured();
        measured.ring = vec![vec![], vec![[1.0, 2.0]]];
        let rows = deviations(&Road::named("16m").unwrap(), &measured).unwrap();
        assert!(rows[1].from_measured.worst.is_finite());
    }
}
