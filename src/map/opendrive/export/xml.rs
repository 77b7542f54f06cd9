//! Elements of OpenDRIVE as text.

use std::fmt::Write;

use glam::DVec2;

use super::{Kind, Link, Width, Written, WrittenLane, lane_id};
use crate::geometry::{Piece, wrapped};
use crate::map::ground::Hand;
use crate::map::{Gutter, Road};

/// Height of a kerb above the road (m).
const KERB_HEIGHT: f64 = 0.12;
/// The junction's number.
const JUNCTION: u32 = 1;

/// The map's beginning, up to its roads.
pub(super) fn header(seen: &Road) -> String {
    let (low, high) = seen.kerbs(Gutter::Drivable).bounds();
    let origin = seen.ground().origin;
    let (low, high) = (origin + low, origin + high);
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<OpenDRIVE>\n  <header revMajor=\"1\" revMinor=\"6\" name=\"{}\" \
         version=\"1\" north=\"{:.3}\" south=\"{:.3}\" east=\"{:.3}\" west=\"{:.3}\" vendor=\"offtrack\"/>\n",
        escaped(&seen.name),
        high.y,
        low.y,
        high.x,
        low.x
    )
}

/// Adds a road.
pub(super) fn written(text: &mut String, road: &Written, hand: Hand, origin: DVec2) {
    let pieces: Vec<(f64, Piece)> = stationed(road);
    let length = pieces.last().map_or(0.0, |(start, piece)| start + rounded(piece.length()));
    let junction = if road.is_connecting { JUNCTION.to_string() } else { "-1".into() };
    let rule = if hand == Hand::Left { "LHT" } else { "RHT" };
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "  <road name=\"{}\" length=\"{length:.9}\" id=\"{}\" junction=\"{junction}\" rule=\"{rule}\">",
        escaped(&road.name),
        road.id
    );
    let ends = [("predecessor", road.predecessor), ("successor", road.successor)];
    if ends.iter().any(|(_, link)| link.is_some()) {
        let _ = writeln!(text, "    <link>");
        for (end, link) in ends.iter().filter_map(|(end, link)| Some((end, link.as_ref()?))) {
            let _ = match link {
                Link::Junction => {
                    writeln!(text, "      <{end} elementType=\"junction\" elementId=\"{JUNCTION}\"/>")
                }
                Link::EndOf(id) | Link::StartOf(id) => {
                    let contact = if matches!(link, Link::EndOf(_)) { "end" } else { "start" };
                    writeln!(text, "      <{end} elementType=\"road\" elementId=\"{id}\" contactPoint=\"{contact}\"/>")
                }
            };
        }
        let _ = writeln!(text, "    </link>");
    }
    let _ = writeln!(text, "    <planView>");
    for (start, piece) in &pieces {
        let (p, heading) = (origin + piece.start(), piece.heading_at(0.0));
        let shape = match piece {
            Piece::Segment { .. } => "<line/>".into(),
            Piece::Arc { radius, sweep, .. } => format!("<arc curvature=\"{:.12}\"/>", sweep.signum() / radius),
        };
        let _ = writeln!(
            text,
            "      <geometry s=\"{start:.9}\" x=\"{:.9}\" y=\"{:.9}\" hdg=\"{heading:.12}\" length=\"{:.9}\">{shape}\
             </geometry>",
            p.x,
            p.y,
            piece.length()
        );
    }
    let _ = writeln!(text, "    </planView>\n    <lanes>");
    offsets(text, road);
    let _ = writeln!(text, "      <laneSection s=\"0\">");
    let sides = [("left", 1), ("center", 0), ("right", -1)];
    for (side, sign) in sides {
        let lanes: Vec<&WrittenLane> = road.lanes.iter().filter(|lane| lane.id.signum() == sign).collect();
        if sign == 0 {
            let _ = writeln!(text, "        <center><lane id=\"0\" type=\"none\" level=\"false\"/></center>");
        } else if !lanes.is_empty() {
            let _ = writeln!(text, "        <{side}>");
            lanes.iter().for_each(|lane| written_lane(text, lane, road));
            let _ = writeln!(text, "        </{side}>");
        }
    }
    let _ = writeln!(text, "      </laneSection>\n    </lanes>\n  </road>");
}

/// Adds the lane offsets that put a driving lane around the reference line.
fn offsets(text: &mut String, road: &Written) {
    if road.offset != 0.0 {
        let _ = writeln!(text, "      <laneOffset s=\"0\" a=\"{:.9}\" b=\"0\" c=\"0\" d=\"0\"/>", road.offset);
    }
    for lane in road.lanes.iter().filter(|lane| lane.kind == Kind::Driving) {
        let side = -0.5 * f64::from(lane.id.signum());
        for Width { start, factors } in &lane.widths {
            let [a, b, c, d] = factors.map(|factor| side * factor);
            let _ = writeln!(
                text,
                "      <laneOffset s=\"{start:.9}\" a=\"{a:.9}\" b=\"{b:.9}\" c=\"{c:.9}\" d=\"{d:.12}\"/>"
            );
        }
    }
}

fn written_lane(text: &mut String, lane: &WrittenLane, road: &Written) {
    let id = lane.id;
    let kind = match lane.kind {
        Kind::Driving | Kind::Ring => "driving",
        Kind::Middle => "bidirectional",
        Kind::Shoulder => "shoulder",
        Kind::Curb => "curb",
        Kind::Apron => "border",
    };
    let _ = writeln!(text, "          <lane id=\"{id}\" type=\"{kind}\" level=\"false\">");
    let links = [("predecessor", road.predecessor), ("successor", road.successor)];
    let links: String = links
        .into_iter()
        .filter(|(_, link)| matches!(link, Some(Link::EndOf(_) | Link::StartOf(_))))
        .map(|(end, _)| format!("<{end} id=\"{id}\"/>"))
        .collect();
    if !links.is_empty() {
        let _ = writeln!(text, "            <link>{links}</link>");
    }
    for Width { start, factors: [a, b, c, d] } in &lane.widths {
        let _ = writeln!(
            text,
            "            <width sOffset=\"{start:.9}\" a=\"{a:.9}\" b=\"{b:.9}\" c=\"{c:.9}\" d=\"{d:.12}\"/>"
        );
    }
    if lane.kind == Kind::Apron {
        let _ = writeln!(text, "            <access sOffset=\"0\" rule=\"allow\" restriction=\"truck\"/>");
    }
    if lane.kind == Kind::Curb {
        let _ = writeln!(text, "            <height sOffset=\"0\" inner=\"{KERB_HEIGHT}\" outer=\"{KERB_HEIGHT}\"/>");
    }
    let _ = writeln!(text, "          </lane>");
}

/// Adds the junction with a connection for each connecting road.
pub(super) fn junction(text: &mut String, name: &str, hand: Hand, ways: &[Written]) {
    let lane = lane_id(hand);
    let _ = writeln!(text, "  <junction id=\"{JUNCTION}\" name=\"{}\" type=\"default\">", escaped(name));
    let from = |way: &Written| match way.predecessor {
        Some(Link::EndOf(from)) if way.is_connecting => Some((way.id, from)),
        _ => None,
    };
    for (index, (id, from)) in ways.iter().filter_map(from).enumerate() {
        let _ = writeln!(
            text,
            "    <connection id=\"{index}\" incomingRoad=\"{from}\" connectingRoad=\"{id}\" contactPoint=\"start\">\
             <laneLink from=\"{lane}\" to=\"{lane}\"/></connection>"
        );
    }
    let _ = writeln!(text, "  </junction>");
}

/// The pieces of a reference line with the stations where they begin: sums of lengths as they are written (m).
fn stationed(road: &Written) -> Vec<(f64, Piece)> {
    let mut start = 0.0;
    let mut stationed = Vec::new();
    for piece in road.line.pieces.iter().filter(|piece| 0.0 < rounded(piece.length())) {
        stationed.push((start, *piece));
        start += rounded(piece.length());
    }
    stationed
}

/// A length as it is written (m): coarser, joints would be steps in whose direction a line seems to turn.
fn rounded(length: f64) -> f64 {
    (length * 1e9).round() / 1e9
}

/// A name as an attribute's text.
fn escaped(name: &str) -> String {
    let mut text = String::new();
    for c in name.chars().filter(|c| !c.is_control()) {
        match c {
            '&' => text += "&amp;",
            '<' => text += "&lt;",
            '>' => text += "&gt;",
            '"' => text += "&quot;",
            c => text.push(c),
        }
    }
    text
}

/// Whether the heading has a step between two pieces.
pub(super) fn is_kink(before: &Piece, after: &Piece) -> bool {
    /// Turn that is none (rad).
    const SMOOTH: f64 = 0.02;
    SMOOTH < wrapped(after.heading_at(0.0) - before.heading_at(before.length())).abs()
}
