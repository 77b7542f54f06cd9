//! A map that was written, read back: whether its routes and kerbs are those of the road.

use glam::DVec2;

use super::super::surroundings::REACH;
use crate::files::reader::{Error, Reader};
use crate::geometry::Curve;
use crate::map::Road;
use crate::map::opendrive::{Hand, Map, Options};

/// What kerbs may be off (m); those of parameters are within 4 cm at their sharpest corners.
const OFF: f64 = 0.1;
/// Distance between points that are compared (m).
const STEP: f64 = 0.25;
/// Where the world that is read ends, kerbs are not compared (m).
const MARGIN: f64 = 10.0;

/// What would do for a road from a map.
const KEEP: &str = "keep the map that the road is from";

/// An error if the text is not read as the road.
pub(super) fn check(reader: &Reader, road: &Road, text: &str) -> Result<(), Error> {
    let map = Map::parse(std::path::Path::new(&road.name), text, Hand::Map)?;
    let (own, options) = (road.ground(), Options::default());
    let found = if road.has_ring() {
        map.nearest(own.origin).and_then(|ring| map.ground(&ring, &options))
    } else {
        let ways: Vec<_> = map.junctions().into_iter().flat_map(|junction| junction.ways).collect();
        map.through(&ways, &options)
    };
    let unread = |error: Error| reader.invalid("map", "not read back", format!("{KEEP}: {error}"));
    let found = found.map_err(unread)?.ground;
    for (key, has, others) in
        [("arms", own.arms.len(), found.arms.len()), ("routes", own.lines.len(), found.lines.len())]
    {
        if has != others {
            let expected = format!("as a map it has {others}; a road whose arms are farther apart would do");
            return Err(reader.invalid(key, has, expected));
        }
    }
    let within = if road.has_ring() { own.island_radius } else { own.outer_radius.min(found.outer_radius) };
    let reach = within + REACH - MARGIN;
    let (frame, other) = (own.frame(), found.frame());
    let points = |curve: &Curve| -> Vec<DVec2> {
        (0..(curve.length() / STEP) as usize).map(|i| curve.point_at(i as f64 * STEP)).collect()
    };
    let there = own.faces.loops.iter().flat_map(points).filter(|p| p.length() < reach);
    let there = there.map(|p| (found.faces.distance(other.to_driven(frame.to_map(p))), p));
    let back = found.faces.loops.iter().flat_map(points).map(|p| frame.to_driven(other.to_map(p)));
    let back = back.filter(|p| p.length() < reach).map(|p| (own.faces.distance(p), p));
    let (off, at) = there.chain(back).fold((0.0, DVec2::ZERO), |most, one| if most.0 < one.0 { one } else { most });
    let inner = own.aprons.iter().flat_map(points);
    let mut lost = inner.map(|p| (distance(&found.aprons, other.to_driven(frame.to_map(p))), p));
    if let Some((off, at)) = lost.find(|(off, _)| OFF < *off) {
        let (at, found) = (frame.to_map(at), if off.is_finite() { format!("{off:.2} m off") } else { "lost".into() });
        let expected = "an apron all around the central island would do, as wide as to the nearest point of its edge";
        return Err(reader.invalid("aprons", format!("{found} at ({:.1}, {:.1}) as a map", at.x, at.y), expected));
    }
    if off <= OFF {
        return Ok(());
    }
    let at = frame.to_map(at);
    let expected = format!(
        "the map's lanes, middles and gutters do not cover what is paved there, or cover more; {KEEP}, or import a \
         drawing with a wider --lane-width"
    );
    Err(reader.invalid("kerbs", format!("{off:.2} m off at ({:.1}, {:.1}) as a map", at.x, at.y), expected))
}

/// Distance of a point from the nearest of some curves; infinite without one (m).
fn distance(curves: &[Curve], p: DVec2) -> f64 {
    curves.iter().map(|curve| curve.distance(p)).fold(f64::INFINITY, f64::min)
}
