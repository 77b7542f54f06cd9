//! Kerbs as roads without lanes to drive on: the face is the reference line, a gutter lies on its left, the kerb's
//! stone on its right, behind an apron where there is one.
//!
//! A face is cut where it forms a corner, since reference lines have none. Where an arm ends nothing is solid: there a
//! narrow shoulder closes the surface.

use glam::DVec2;

use super::xml::is_kink;
use super::{Kind, Width, Written, WrittenLane};
use crate::geometry::{Curve, Outline, Piece};
use crate::map::apron;
use crate::map::ground::{Edges, Ground, Kerb};

/// Width of a kerb's stone (m): the tip of the sharpest splitter island, with a radius of 0.1 m, has room for it.
const STONE: f64 = 0.1;
/// Width of the shoulder that closes the end of an arm (m).
const END: f64 = 0.3;
/// How near the end of a route is to the end of its arm (m).
const AT_END: f64 = 0.6;
/// Distance between two widths of a gutter that varies (m), and the widest gutter.
const STEP: f64 = 0.5;
const WIDEST: f64 = 5.0;
/// A gutter narrower than this is none (m).
const NONE: f64 = 1e-3;

/// The kerbs of a road, numbered from `first` on.
pub(super) fn kerbs(seen: &Ground, first: usize) -> Vec<Written> {
    let mut roads: Vec<Written> = Vec::new();
    for (curve, kerb) in seen.faces.loops.iter().zip(&seen.kerbs) {
        for line in runs(curve) {
            let is_end = *kerb == Kerb::Outer && ends_arm(seen, &line);
            let name = match kerb {
                _ if is_end => "end of an arm".to_owned(),
                Kerb::Outer => "outer kerb".to_owned(),
                Kerb::Island => "central island".to_owned(),
                Kerb::Splitter(arm) => format!("splitter island {}", seen.arms[*arm].name),
            };
            let lanes = if is_end {
                vec![WrittenLane { id: 1, kind: Kind::Shoulder, widths: Width::constant(END) }]
            } else {
                let gutter = gutter(&seen.edges, &line);
                let gutter = gutter.map(|widths| WrittenLane { id: 1, kind: Kind::Shoulder, widths });
                let apron = seen.aprons.iter().find(|apron| apron::is_within(apron, curve));
                let apron = apron.map(|apron| Width::through(&sampled(&line, |p| apron.distance(p))));
                let apron = apron.map(|widths| WrittenLane { id: -1, kind: Kind::Apron, widths });
                let id = if apron.is_some() { -2 } else { -1 };
                let stone = WrittenLane { id, kind: Kind::Curb, widths: Width::constant(STONE) };
                gutter.into_iter().chain(apron).chain([stone]).collect()
            };
            let id = first + roads.len();
            roads.push(Written {
                id,
                name,
                is_connecting: false,
                offset: 0.0,
                line,
                lanes,
                predecessor: None,
                successor: None,
            });
        }
    }
    roads
}

/// A face cut at its corners; one without a corner is cut in two, since no road ends where it begins.
fn runs(curve: &Curve) -> Vec<Curve> {
    let n = curve.pieces.len();
    let corner = (0..n).find(|&index| is_kink(&curve.pieces[(index + n - 1) % n], &curve.pieces[index]));
    let Some(corner) = corner else {
        let (middle, length) = (curve.length() / 2.0, curve.length());
        return vec![curve.part(0.0, middle), curve.part(middle, length)];
    };
    let mut runs: Vec<Curve> = Vec::new();
    let mut before: Option<&Piece> = None;
    for piece in (0..n).map(|index| &curve.pieces[(corner + index) % n]) {
        match runs.last_mut() {
            Some(run) if before.is_some_and(|before| !is_kink(before, piece)) => run.pieces.push(*piece),
            _ => runs.push(Curve { pieces: vec![*piece] }),
        }
        before = Some(piece);
    }
    runs
}

/// Whether a part of the outer kerb is the end of an arm: a route begins or ends there.
fn ends_arm(seen: &Ground, part: &Curve) -> bool {
    let ends = |curve: &Curve| [curve.point_at(0.0), curve.point_at(curve.length())];
    seen.lines.iter().flat_map(|line| ends(&line.line)).any(|end| part.distance(end) < AT_END)
}

/// The widths of the gutter beside a part of a face; `None` where there is none.
fn gutter(edges: &Edges, line: &Curve) -> Option<Vec<Width>> {
    match edges {
        Edges::Beside(width) => (NONE < *width).then(|| Width::constant(*width)),
        Edges::Own(edges) => {
            let samples = sampled(line, |p| beside(edges, p));
            samples.iter().any(|(_, width)| NONE < *width).then(|| Width::through(&samples))
        }
    }
}

/// Stations along a line, and a width at each (m).
fn sampled(line: &Curve, width: impl Fn(DVec2) -> f64) -> Vec<(f64, f64)> {
    let n = (line.length() / STEP).ceil().max(1.0);
    let station = |i: usize| line.length() * i as f64 / n;
    (0..=n as usize).map(|i| (station(i), width(line.point_at(station(i))))).collect()
}

/// Distance of a point of a face from the edge beside it (m).
fn beside(edges: &Outline, p: DVec2) -> f64 {
    edges.distance(p).min(WIDEST)
}
