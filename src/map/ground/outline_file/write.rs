//! A ring's outline file, written.

use std::fmt::Write;
use std::path::Path;

use glam::DVec2;

use crate::files::reader::Error;
use crate::geometry::area::signed_area;
use crate::geometry::{Curve, Piece};
use crate::map::ground::{Arm, Edges, Ground, Kerb, Line};

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
    pub fn checked_text(&self, file: &Path, comment: &[String]) -> Result<String, Error> {
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
