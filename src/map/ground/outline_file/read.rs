//! An outline file, read and checked.

use std::path::Path;

use glam::DVec2;
use serde::Deserialize;

use crate::files::reader::{Error, Exactly, Reader};
use crate::geometry::{Curve, Outline, Piece, arc_of_height};
use crate::map::apron::{self, crosses};
use crate::map::ground::{Arm, Edges, Ground, Hand, Kerb, Line};
use crate::map::kerbs::misplaced;
use crate::map::route::Lane;

/// Largest coordinate (m).
const FARTHEST: f64 = 2000.0;
/// Largest coordinate of the road's centre in its map (m).
const FARTHEST_ORIGIN: f64 = 1e8;
/// Most points of a path.
const MOST_POINTS: usize = 20_000;
/// Most loops of an outline.
const MOST_LOOPS: usize = 200;
/// Most routes: two lanes from each of eight arms to each of eight.
const MOST_ROUTES: usize = 128;

/// The file as written. Nothing here is trusted yet.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    #[serde(default)]
    hand: Hand,
    #[serde(default)]
    origin: Exactly<f64, 2>,
    island_radius: f64,
    outer_radius: f64,
    lane_radii: Vec<f64>,
    arm: Vec<WrittenArm>,
    face: Vec<WrittenLoop>,
    edge: Vec<WrittenLoop>,
    route: Vec<WrittenRoute>,
    #[serde(default)]
    lane: Vec<WrittenPath>,
    #[serde(default)]
    apron: Vec<WrittenPath>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenArm {
    name: String,
    bearing_deg: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenLoop {
    /// `outer`, `island`, or the arm whose splitter island it is.
    of: String,
    path: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenRoute {
    entry: String,
    lane: Lane,
    exit: u32,
    to: String,
    crossing: Exactly<f64, 2>,
    widths: Exactly<f64, 3>,
    path: Vec<Vec<f64>>,
}

/// A line of its own: a lane, or the closed inner edge of an apron.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenPath {
    path: Vec<Vec<f64>>,
}

impl Ground {
    /// The ring that an outline file describes.
    ///
    /// # Errors
    ///
    /// The file and, for a value that makes no sense, its key, the value and what would do.
    pub(crate) fn parse(file: &Path, text: &str) -> Result<Ground, Error> {
        let (reader, written) = Reader::parse::<Written>(file, text)?;
        let coordinate = |axis: usize, value| {
            reader.within(&format!("origin[{axis}]"), value, -FARTHEST_ORIGIN..=FARTHEST_ORIGIN, "m")
        };
        let origin = DVec2::new(coordinate(0, written.origin[0])?, coordinate(1, written.origin[1])?);
        let island_radius = reader.within("island_radius", written.island_radius, 0.0..=500.0, "m")?;
        let is_ring = 0.0 < island_radius;
        let outer_radius = reader.within("outer_radius", written.outer_radius, island_radius.max(0.5)..=600.0, "m")?;
        reader.length("lane_radii", written.lane_radii.len(), usize::from(is_ring)..=16, "values")?;
        for (i, &radius) in written.lane_radii.iter().enumerate() {
            reader.within(&format!("lane_radii[{i}]"), radius, 0.5..=600.0, "m")?;
        }
        let arms = arms(&reader, written.arm)?;
        let (faces, kerbs) = loops(&reader, "face", written.face, &arms, is_ring)?;
        let (edges, _) = loops(&reader, "edge", written.edge, &arms, is_ring)?;
        let lines = lines(&reader, written.route, &arms)?;
        let lanes = paths(&reader, "lane", &written.lane, 1000, false)?.into_iter().map(|(_, lane)| lane).collect();
        let aprons = paths(&reader, "apron", &written.apron, MOST_LOOPS, true)?;
        let aprons = apron::checked(&reader, &faces, aprons)?;
        Ok(Ground {
            mirrored: written.hand == Hand::Left,
            origin,
            island_radius,
            outer_radius,
            lane_radii: written.lane_radii,
            arms,
            faces,
            kerbs,
            edges: Edges::Own(edges),
            aprons,
            lanes,
            lines,
        })
    }
}

fn arms(reader: &Reader, written: Vec<WrittenArm>) -> Result<Vec<Arm>, Error> {
    reader.length("arm", written.len(), 1..=8, "tables")?;
    let mut arms: Vec<Arm> = Vec::new();
    for (i, WrittenArm { name, bearing_deg }) in written.into_iter().enumerate() {
        if !Arm::may_be_named(&name) || arms.iter().any(|arm| arm.name == name) {
            let expected = format!("must differ from those of other arms, and be {}", Arm::NAMES);
            return Err(reader.invalid(format!("arm[{i}].name"), format!("{name:?}"), expected));
        }
        let bearing = reader.within(&format!("arm[{i}].bearing_deg"), bearing_deg, -360.0..=360.0, "deg")?.to_radians();
        arms.push(Arm { name, bearing });
    }
    Ok(arms)
}

/// The lines of the routes, by entry, lane and exit.
fn lines(reader: &Reader, written: Vec<WrittenRoute>, arms: &[Arm]) -> Result<Vec<Line>, Error> {
    reader.length("route", written.len(), 1..=MOST_ROUTES, "tables")?;
    let mut lines: Vec<Line> = Vec::new();
    for (i, route) in written.into_iter().enumerate() {
        let key = |name: &str| format!("route[{i}].{name}");
        let entry = arm(reader, &key("entry"), &route.entry, arms)?;
        let exit_arm = arm(reader, &key("to"), &route.to, arms)?;
        let (lane, exit) = (route.lane, route.exit);
        reader.count(&key("exit"), exit as usize, 1..=arms.len())?;
        if lines.iter().any(|line| (line.entry, line.lane, line.exit) == (entry, lane, exit)) {
            return Err(reader.invalid(key("exit"), exit, "an earlier route has this entry, lane and exit"));
        }
        let Exactly([left, right]) = route.crossing;
        let crossing = (
            reader.within(&key("crossing[0]"), left, 0.5..=50.0, "m")?,
            reader.within(&key("crossing[1]"), right, 0.5..=50.0, "m")?,
        );
        let Exactly(widths) = route.widths;
        for width in widths {
            reader.within(&key("widths"), width, 1.0..=20.0, "m")?;
        }
        let line = curve(reader, &key("path"), &route.path, false)?;
        lines.push(Line { entry, lane, exit, exit_arm, line, crossing, widths, ends: [None, None] });
    }
    lines.sort_by_key(|line| (line.entry, line.lane == Lane::Right, line.exit));
    Ok(lines)
}

/// The curves of tables that have a path alone, at most `most`, with the keys of their paths.
fn paths(
    reader: &Reader,
    table: &str,
    written: &[WrittenPath],
    most: usize,
    closed: bool,
) -> Result<Vec<(String, Curve)>, Error> {
    reader.length(table, written.len(), 0..=most, "tables")?;
    let keyed = written.iter().enumerate().map(|(i, written)| {
        let key = format!("{table}[{i}].path");
        curve(reader, &key, &written.path, closed).map(|curve| (key, curve))
    });
    keyed.collect()
}

/// The curve along a path.
fn curve(reader: &Reader, key: &str, path: &[Vec<f64>], closed: bool) -> Result<Curve, Error> {
    reader.length(key, path.len(), 2..=MOST_POINTS, "points")?;
    let point = |i: usize| -> Result<DVec2, Error> {
        if !(2..=3).contains(&path[i].len()) {
            return Err(reader.invalid(
                format!("{key}[{i}]"),
                format!("{:?}", path[i]),
                "must be [x, y] or [x, y, bulge]",
            ));
        }
        let of = |axis: usize| reader.within(&format!("{key}[{i}][{axis}]"), path[i][axis], -FARTHEST..=FARTHEST, "m");
        Ok(DVec2::new(of(0)?, of(1)?))
    };
    let mut pieces = Vec::new();
    let mut from = point(if closed { path.len() - 1 } else { 0 })?;
    for (i, written) in path.iter().enumerate().skip(usize::from(!closed)) {
        let to = point(i)?;
        let bulge =
            written.get(2).map_or(Ok(0.0), |&bulge| reader.within(&format!("{key}[{i}][2]"), bulge, -1.0..=1.0, ""))?;
        // Points that rounding has made one are one.
        if 1e-6 < from.distance(to) {
            let piece = arc_of_height(from, to, bulge * from.distance(to) / 2.0);
            pieces.push(piece.unwrap_or(Piece::Segment { from, to }));
            from = to;
        }
    }
    if pieces.is_empty() {
        return Err(reader.invalid(key, "no length", "points must differ"));
    }
    Ok(Curve { pieces })
}

fn arm(reader: &Reader, key: &str, name: &str, arms: &[Arm]) -> Result<usize, Error> {
    arms.iter().position(|arm| arm.name == name).ok_or_else(|| {
        let known: Vec<&str> = arms.iter().map(|arm| arm.name.as_str()).collect();
        reader.invalid(key, format!("{name:?}"), format!("must be one of {}", known.join(", ")))
    })
}

/// The loops of an outline, the outer one first in the world: they neither cross nor lie outside it.
fn loops(
    reader: &Reader,
    table: &str,
    written: Vec<WrittenLoop>,
    arms: &[Arm],
    is_ring: bool,
) -> Result<(Outline, Vec<Kerb>), Error> {
    reader.length(table, written.len(), 1 + usize::from(is_ring)..=MOST_LOOPS, "tables")?;
    let (mut curves, mut kerbs): (Vec<Curve>, Vec<Kerb>) = (Vec::new(), Vec::new());
    for (i, WrittenLoop { of, path }) in written.into_iter().enumerate() {
        let loop_ = curve(reader, &format!("{table}[{i}].path"), &path, true)?;
        let kerb = match of.as_str() {
            "outer" => Kerb::Outer,
            "island" => Kerb::Island,
            name => Kerb::Splitter(arm(reader, &format!("{table}[{i}].of"), name, arms)?),
        };
        if let Some(other) = curves.iter().position(|other| crosses(other, &loop_)) {
            return Err(reader.invalid(
                format!("{table}[{i}].path"),
                "crosses",
                format!("must not cross {table}[{other}]"),
            ));
        }
        curves.push(loop_);
        kerbs.push(kerb);
    }
    let outer = kerbs.iter().filter(|&&kerb| kerb == Kerb::Outer).count();
    if outer != 1 || is_ring && !kerbs.contains(&Kerb::Island) {
        return Err(reader.invalid(
            format!("{table}[0].of"),
            format!("{outer} outer loops"),
            "one loop is outer, and one or more the island",
        ));
    }
    let outer = kerbs.iter().position(|&kerb| kerb == Kerb::Outer).unwrap_or(0);
    let areas: Vec<Outline> = curves.iter().map(|curve| Outline::new(vec![curve.clone()])).collect();
    for (i, curve) in curves.iter().enumerate().filter(|&(i, _)| i != outer) {
        if let Some(j) = misplaced(&areas, i, curve.point_at(0.0), outer) {
            let (found, expected) = if j == outer {
                ("outside", format!("must lie inside the outer loop, {table}[{j}]"))
            } else {
                ("inside another", format!("must not lie inside {table}[{j}]"))
            };
            return Err(reader.invalid(format!("{table}[{i}].path"), found, expected));
        }
    }
    let is_island = |(i, area): (usize, &Outline)| kerbs[i] == Kerb::Island && area.contains(DVec2::ZERO);
    if is_ring && !areas.iter().enumerate().any(is_island) {
        let i = kerbs.iter().position(|&kerb| kerb == Kerb::Island).unwrap_or(0);
        let expected = "an island must lie around the ring's centre, (0, 0)";
        return Err(reader.invalid(format!("{table}[{i}].path"), "beside the centre", expected));
    }
    Ok((Outline::new(curves), kerbs))
}
