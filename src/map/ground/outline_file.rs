//! A ring as an outline file, `NAME.outline.toml`: loops of arcs and segments, centre lines and arms, without the map.
//!
//! A path is a list of points. `[x, y]` ends a straight, `[x, y, bulge]` an arc; bulge is the tangent of a quarter of
//! the angle that the arc turns by, left positive. Coordinates are rounded to 0.01 mm.

use std::fmt::Write;

use glam::DVec2;
use serde::Deserialize;

use super::{Arm, Edges, Ground, Hand, Kerb, Line};
use crate::files::reader::{Error, Exactly, Reader};
use crate::geometry::area::signed_area;
use crate::geometry::{Curve, Outline, Piece, arc_of_height};
use crate::map::apron::{self, crosses};
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
    lane: Vec<WrittenLane>,
    #[serde(default)]
    apron: Vec<WrittenLane>,
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
struct WrittenLane {
    path: Vec<Vec<f64>>,
}

impl Ground {
    /// The text of an outline file; `comment` are lines that say where the ring is from.
    pub fn text(&self, comment: &[String]) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        for line in comment {
            let _ = writeln!(text, "# {line}");
        }
        if self.mirrored {
            let _ = writeln!(text, "\nhand = \"left\"");
        }
        if self.origin != DVec2::ZERO {
            let _ = writeln!(text, "\norigin = [{}, {}]", number(self.origin.x, 5), number(self.origin.y, 5));
        }
        let list = |values: &[f64]| values.iter().map(|value| number(*value, 4)).collect::<Vec<_>>().join(", ");
        let (island, outer) = (number(self.island_radius, 5), number(self.outer_radius, 5));
        let _ = writeln!(
            text,
            "\nisland_radius = {island}\nouter_radius = {outer}\nlane_radii = [{}]",
            list(&self.lane_radii)
        );
        for Arm { name, bearing } in &self.arms {
            let degrees = (bearing.to_degrees() * 1e3).round() / 1e3 % 360.0;
            let _ = writeln!(text, "\n[[arm]]\nname = {name:?}\nbearing_deg = {}", number(degrees, 3));
        }
        let edges = self.edge_loops();
        let edge_kerbs = self.edge_kerbs(&edges);
        for (table, loops, kerbs) in [("face", &self.faces.loops, &self.kerbs), ("edge", &edges, &edge_kerbs)] {
            for (curve, kerb) in loops.iter().zip(kerbs) {
                let of = match kerb {
                    Kerb::Outer => "outer",
                    Kerb::Island => "island",
                    Kerb::Splitter(arm) => &self.arms[*arm].name,
                };
                let _ = writeln!(text, "\n[[{table}]]\nof = {of:?}\npath = [{}\n]", path(curve, true));
            }
        }
        for Line { entry, lane, exit, exit_arm, line, crossing, widths, .. } in &self.lines {
            let (entry, to, lane) = (&self.arms[*entry].name, &self.arms[*exit_arm].name, lane.name());
            let (crossing, widths) = (list(&[crossing.0, crossing.1]), list(widths));
            let _ = writeln!(text, "\n[[route]]\nentry = {entry:?}\nlane = {lane:?}\nexit = {exit}\nto = {to:?}");
            let _ = writeln!(text, "crossing = [{crossing}]\nwidths = [{widths}]\npath = [{}\n]", path(line, false));
        }
        let lanes = self.lanes.iter().map(|lane| ("lane", path(lane, false)));
        for (table, path) in lanes.chain(self.aprons.iter().map(|apron| ("apron", path(apron, true)))) {
            let _ = writeln!(text, "\n[[{table}]]\npath = [{path}\n]");
        }
        text
    }

    /// The text of an outline file that was read back; `file` names it in errors.
    ///
    /// # Errors
    ///
    /// What the reader of outline files refuses, such as a lane of half a metre.
    pub fn checked_text(&self, file: &std::path::Path, comment: &[String]) -> Result<String, Error> {
        let text = self.text(comment);
        Ground::parse(file, &text).map(|_| text)
    }

    fn edge_loops(&self) -> Vec<Curve> {
        match &self.edges {
            Edges::Beside(gutter) => self.faces.offset(*gutter).loops,
            Edges::Own(edges) => edges.loops.clone(),
        }
    }

    /// What each loop of the edges belongs to: one that is solid inside, to the island or the splitter island whose
    /// face is nearest. Lane edges may enclose what the faces do not, such as a shoulder among lanes.
    fn edge_kerbs(&self, edges: &[Curve]) -> Vec<Kerb> {
        let outer = (0..edges.len()).max_by(|&one, &other| enclosed(&edges[one]).total_cmp(&enclosed(&edges[other])));
        let of = |(index, edge): (usize, &Curve)| {
            if Some(index) == outer {
                return Kerb::Outer;
            }
            let p = edge.point_at(0.0);
            let all = self.kerbs.iter().zip(&self.faces.loops).filter(|(kerb, _)| **kerb != Kerb::Outer);
            let nearest = all.min_by(|(_, one), (_, other)| one.distance(p).total_cmp(&other.distance(p)));
            nearest.map_or(Kerb::Splitter(0), |(&kerb, _)| kerb)
        };
        edges.iter().enumerate().map(of).collect()
    }

    /// The ring that an outline file describes.
    ///
    /// # Errors
    ///
    /// The file and, for a value that makes no sense, its key, the value and what would do.
    pub(crate) fn parse(file: &std::path::Path, text: &str) -> Result<Ground, Error> {
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
        reader.length("arm", written.arm.len(), 1..=8, "tables")?;
        let mut arms: Vec<Arm> = Vec::new();
        for (i, WrittenArm { name, bearing_deg }) in written.arm.into_iter().enumerate() {
            if !Arm::may_be_named(&name) || arms.iter().any(|arm| arm.name == name) {
                let expected = format!("must differ from those of other arms, and be {}", Arm::NAMES);
                return Err(reader.invalid(format!("arm[{i}].name"), format!("{name:?}"), expected));
            }
            let bearing =
                reader.within(&format!("arm[{i}].bearing_deg"), bearing_deg, -360.0..=360.0, "deg")?.to_radians();
            arms.push(Arm { name, bearing });
        }
        let (faces, kerbs) = loops(&reader, "face", written.face, &arms, is_ring)?;
        let (edges, _) = loops(&reader, "edge", written.edge, &arms, is_ring)?;
        reader.length("route", written.route.len(), 1..=MOST_ROUTES, "tables")?;
        let mut lines: Vec<Line> = Vec::new();
        for (i, route) in written.route.into_iter().enumerate() {
            let key = |name: &str| format!("route[{i}].{name}");
            let (entry, exit_arm) =
                (arm(&reader, &key("entry"), &route.entry, &arms)?, arm(&reader, &key("to"), &route.to, &arms)?);
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
            for width in route.widths.0 {
                reader.within(&key("widths"), width, 1.0..=20.0, "m")?;
            }
            let line = curve(&reader, &key("path"), &route.path, false)?;
            lines.push(Line {
                entry,
                lane,
                exit,
                exit_arm,
                line,
                crossing,
                widths: route.widths.0,
                ends: [None, None],
            });
        }
        lines.sort_by_key(|line| (line.entry, line.lane == Lane::Right, line.exit));
        reader.length("lane", written.lane.len(), 0..=1000, "tables")?;
        let lanes = written
            .lane
            .iter()
            .enumerate()
            .map(|(i, lane)| curve(&reader, &format!("lane[{i}].path"), &lane.path, false));
        let lanes = lanes.collect::<Result<_, _>>()?;
        reader.length("apron", written.apron.len(), 0..=MOST_LOOPS, "tables")?;
        let aprons = written.apron.iter().enumerate().map(|(i, apron)| {
            let key = format!("apron[{i}].path");
            curve(&reader, &key, &apron.path, true).map(|apron| (key, apron))
        });
        let aprons = apron::checked(&reader, &faces, aprons.collect::<Result<_, _>>()?)?;
        let edges = Edges::Own(edges);
        let mirrored = written.hand == Hand::Left;
        Ok(Ground {
            mirrored,
            origin,
            island_radius,
            outer_radius,
            lane_radii: written.lane_radii,
            arms,
            faces,
            kerbs,
            edges,
            aprons,
            lanes,
            lines,
        })
    }
}

/// A number without digits that say nothing.
fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let short = text.trim_end_matches('0');
    let short = if short.ends_with('.') { &text[..=short.len()] } else { short };
    if short == "-0.0" { "0.0".into() } else { short.into() }
}

/// The area that a closed curve encloses, positive if it lies on its left (m²).
fn enclosed(curve: &Curve) -> f64 {
    let contour: Vec<[f64; 2]> = curve.polyline(0.01).into_iter().map(DVec2::into).collect();
    signed_area(&contour)
}

/// A curve's points; a closed one begins where it ends.
fn path(curve: &Curve, closed: bool) -> String {
    let mut text = String::new();
    let point = |p: DVec2| format!("{}, {}", number(p.x, 5), number(p.y, 5));
    if let Some(first) = curve.pieces.first().filter(|_| !closed) {
        let _ = write!(text, "\n    [{}],", point(first.start()));
    }
    for piece in &curve.pieces {
        // A bulge is finite and small up to half a circle: longer arcs are cut.
        let parts = match piece {
            Piece::Arc { sweep, .. } => (sweep.abs() / 2.0).ceil().max(1.0),
            Piece::Segment { .. } => 1.0,
        };
        for part in 1..=parts as usize {
            let end = piece.point_at(piece.length() * part as f64 / parts);
            let _ = match piece {
                Piece::Arc { sweep, .. } => {
                    write!(text, "\n    [{}, {}],", point(end), number((sweep / parts / 4.0).tan(), 8))
                }
                Piece::Segment { .. } => write!(text, "\n    [{}],", point(end)),
            };
        }
    }
    text
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
        let start = curve.point_at(0.0);
        let around = areas.iter().enumerate().find(|&(j, area)| j != i && area.contains(start) != (j == outer));
        if let Some((j, _)) = around {
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
