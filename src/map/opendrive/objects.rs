//! Traffic islands that a map gives as objects: solid outlines beside the lanes.

use std::f64::consts::TAU;

use glam::DVec2;
use roxmltree::Node;

use super::records::{Island, RoadRecord};
use super::source::Source;
use super::xml::{attribute, child, children};
use crate::files::reader::Error;
use crate::geometry::area::corners_of_circle;

/// Largest size of an object (m).
const LARGEST: f64 = 1000.0;
/// Most corners of an outline.
const MOST_CORNERS: usize = 1000;

/// The islands among the objects of a road. Other objects are warned of.
pub(super) fn islands(source: &mut Source, node: Node, road: &RoadRecord) -> Result<Vec<Island>, Error> {
    let (mut islands, mut others) = (Vec::new(), 0);
    for object in children(node, "objects").flat_map(|objects| children(objects, "object")) {
        if !["trafficIsland", "raisedMedian"].contains(&attribute(object, "type")) {
            others += 1;
            continue;
        }
        let s = source.number(object, "s", None, 1e5)?;
        let (p, heading) = road.pose(s.clamp(0.0, road.length));
        let across = DVec2::from_angle(heading).perp();
        let place = p + source.number(object, "t", None, LARGEST)? * across;
        let turn = DVec2::from_angle(heading + source.number(object, "hdg", Some(0.0), 1e6)?);
        let of = |key: &str| source.number(object, key, Some(0.0), LARGEST);
        let (length, width, radius) = (of("length")?, of("width")?, of("radius")?);
        let outlines: Vec<Node> = children(object, "outline")
            .chain(children(object, "outlines").flat_map(|outlines| children(outlines, "outline")))
            .collect();
        let mut contours = Vec::new();
        for outline in outlines {
            contours.push(corners_of(source, outline, road, |local| place + turn.rotate(local))?);
        }
        contours.retain(|corners| !corners.is_empty());
        if contours.is_empty() && 0.0 < radius {
            // As many as keep the edges within a millimetre of the circle, where so many may be.
            let n = corners_of_circle(radius.max(1e-2), 1e-3).clamp(32, MOST_CORNERS);
            let corner = |corner| place + radius * DVec2::from_angle(corner as f64 * TAU / n as f64);
            contours.push((0..n).map(corner).collect());
        } else if contours.is_empty() && 0.0 < length && 0.0 < width {
            let half = DVec2::new(length, width) / 2.0;
            let unit = [DVec2::new(-1.0, -1.0), DVec2::new(1.0, -1.0), DVec2::ONE, DVec2::new(-1.0, 1.0)];
            contours.push(unit.map(|corner| place + turn.rotate(corner * half)).to_vec());
        }
        if contours.is_empty() || contours.iter().any(|corners| !(3..=MOST_CORNERS).contains(&corners.len())) {
            source.warn(object, "is an island without an outline of 3 to 1000 corners; it is left out");
        } else {
            islands.extend(contours.into_iter().map(|corners| Island { corners }));
        }
        if child(object, "repeat").is_some() {
            source.warn(object, "is an island that is repeated along the road; it is read once");
        }
    }
    if 0 < others && child(node, "objects").is_some() {
        source.warn(node, &format!("{others} objects are not read"));
    }
    Ok(islands)
}

/// The corners of an outline of an object, where `placed` is a point of the object's own frame.
fn corners_of(
    source: &mut Source,
    outline: Node,
    road: &RoadRecord,
    placed: impl Fn(DVec2) -> DVec2,
) -> Result<Vec<DVec2>, Error> {
    let mut corners = Vec::new();
    for corner in outline.children().filter(Node::is_element) {
        match corner.tag_name().name() {
            "cornerLocal" => {
                let local =
                    DVec2::new(source.number(corner, "u", None, LARGEST)?, source.number(corner, "v", None, LARGEST)?);
                corners.push(placed(local));
            }
            "cornerRoad" => {
                let s = source.number(corner, "s", None, 1e5)?.clamp(0.0, road.length);
                corners.push(road.point(s, source.number(corner, "t", None, LARGEST)?));
            }
            _ => {}
        }
    }
    Ok(corners)
}
