//! Finds roundabouts: holes in the paved surface around which traffic circulates one way.
//!
//! City blocks are holes with traffic around them too, but theirs circulates the wrong way, or they are no circle.

use std::f64::consts::TAU;

use glam::DVec2;

use super::cells::Cells;
use super::graph::Graph;
use super::lanes::Strip;
use super::records::{Kind, Records};
use super::surface::{GAP, SLIVER, of, solid_islands};
use crate::geometry::area::{Area, densified, points};
use crate::geometry::fitted_circle;

/// Smallest and largest radius of an island, which is a little less than that of the circle that it is a polygon of
/// (m).
const RADII: [f64; 2] = [1.49, 200.0];
/// Lanes within this distance of the island may be the ring's (m).
pub(super) const NEAR: f64 = 7.5;
/// Part of the angles around the island at which the nearest lane must circulate.
const COVERED: f64 = 0.85;
/// Largest distance of the island's edge from a circle, as a part of its radius.
const RESIDUAL: f64 = 0.3;
/// Angles that are looked at.
const BINS: usize = 72;

/// A roundabout in a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// Centre of the island in the map's own coordinates (m).
    pub centre: DVec2,
    /// Radius of the circle that fits the island's edge best (m).
    pub radius: f64,
    /// Largest distance of the island's edge from that circle (m).
    pub residual: f64,
    /// Part of the angles at which the lane nearest to the island circulates around it.
    pub covered: f64,
}

/// A hole in the paved surface that is no roundabout, and why not.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    /// The hole's middle in the map's own coordinates (m).
    pub centre: DVec2,
    /// Radius of the circle that fits its edge best (m).
    pub radius: f64,
    /// What speaks against it.
    pub reason: String,
}

/// The roundabouts of a map, largest first, and the holes that were looked at and refused.
pub(super) fn rings(records: &Records, strips: &[Strip], graph: &Graph) -> (Vec<Ring>, Vec<Refused>) {
    let drivable = of(strips.iter(), Kind::Lane).plus(&of(strips.iter(), Kind::Flat));
    let solid = of(strips.iter(), Kind::Kerb).plus(&solid_islands(records.islands().cloned()));
    let (mut rings, refused) = rings_in(&drivable.closed(GAP).minus(&solid), strips, graph);
    // Lanes that do not quite meet leave the island open, until what is between them is paved.
    let (others, _) = rings_in(&drivable.closed(SLIVER).minus(&solid), strips, graph);
    let is_new = |one: &Ring| rings.iter().all(|ring| ring.radius + one.radius < ring.centre.distance(one.centre));
    let others: Vec<Ring> = others.into_iter().filter(is_new).collect();
    let is_ring = |one: &Refused| others.iter().any(|ring| ring.centre.distance(one.centre) < ring.radius);
    let refused = refused.into_iter().filter(|one| !is_ring(one)).collect();
    rings.extend(others);
    rings.sort_by(|one, other| other.radius.total_cmp(&one.radius));
    (rings, refused)
}

/// The same of what is paved.
fn rings_in(paved: &Area, strips: &[Strip], graph: &Graph) -> (Vec<Ring>, Vec<Refused>) {
    let holes: Vec<Area> = paved.holes().collect();
    let around: Vec<(DVec2, DVec2)> =
        holes.iter().map(Area::bounds).map(|(low, high)| (low - NEAR, high + NEAR)).collect();
    let traffic = traffic(strips, graph, &around);
    let (mut rings, mut refused) = (Vec::new(), Vec::new());
    for hole in &holes {
        let outline = densified(&points(&hole.parts[0][0]), 0.25);
        let Some((centre, radius, residual)) = fitted_circle(&outline) else { continue };
        // A sliver between two lanes is no island, whatever surrounds it.
        let size = (hole.size() / std::f64::consts::PI).sqrt();
        let (low, high) = hole.bounds();
        if size < 0.6 * RADII[0] {
            continue;
        }
        if RADII[1] < radius || 4.0 * RADII[1] < (high - low).max_element() {
            refused.push(Refused { centre, radius, reason: format!("its radius is above {} m", RADII[1]) });
            continue;
        }
        let (covered, against) = circulating(&traffic, hole, &outline, centre);
        let reason = if against.max(covered) < COVERED {
            format!("lanes circulate at {:.0} % of the angles", 100.0 * covered.max(against))
        } else if covered < COVERED {
            "lanes circulate the wrong way, as they do around a block".into()
        } else if RESIDUAL * radius < residual {
            format!("its edge is up to {residual:.1} m from a circle")
        } else if radius < RADII[0] {
            format!("its radius is below {} m", RADII[0])
        } else {
            rings.push(Ring { centre, radius, residual, covered });
            continue;
        };
        refused.push(Refused { centre, radius, reason });
    }
    rings.sort_by(|one, other| other.radius.total_cmp(&one.radius));
    // A void between a ring's lanes and the edge of its island is a hole around the island's.
    let is_around = |one: &Ring, other: &Ring| {
        let apart = one.centre.distance(other.centre);
        other.radius < one.radius && apart < 0.1 * one.radius && 0.8 * one.radius < other.radius
    };
    let is_void = |one: &Ring| rings.iter().any(|other| is_around(one, other));
    let rings: Vec<Ring> = rings.iter().filter(|one| !is_void(one)).cloned().collect();
    refused.sort_by(|one, other| other.radius.total_cmp(&one.radius));
    (rings, refused)
}

/// Width of the cells that lanes are found by (m).
const CELL: f64 = 10.0;

/// Lanes in rectangles, each given by its corners, as points with directions of travel.
fn traffic(strips: &[Strip], graph: &Graph, around: &[(DVec2, DVec2)]) -> Cells<(DVec2, DVec2)> {
    let near = |low: DVec2, high: DVec2| around.iter().any(|(from, to)| low.cmple(*to).all() && from.cmple(high).all());
    let mut cells = Cells::new(CELL);
    for (index, strip) in strips.iter().enumerate() {
        let (low, high) = strip.bounds();
        if !strip.is_driven() || (graph.next[index].is_empty() && graph.previous[index].is_empty()) || !near(low, high)
        {
            continue;
        }
        for pair in strip.path().windows(2).filter(|pair| near(pair[0].min(pair[1]), pair[0].max(pair[1]))) {
            let Some(ahead) = (pair[1] - pair[0]).try_normalize() else { continue };
            let parts = (pair[0].distance(pair[1]) / 0.5).ceil().clamp(1.0, 1e5);
            for part in 0..parts as usize {
                let p = pair[0].lerp(pair[1], part as f64 / parts);
                cells.insert(p, (p, ahead));
            }
        }
    }
    cells
}

/// Parts of the angles around `centre` at which the lane nearest to a hole circulates counter-clockwise, and clockwise.
fn circulating(traffic: &Cells<(DVec2, DVec2)>, hole: &Area, outline: &[DVec2], centre: DVec2) -> (f64, f64) {
    let (low, high) = hole.bounds();
    let mut nearest: [Option<(f64, f64)>; BINS] = [None; BINS];
    // Distances beyond NEAR do not matter.
    let mut edge = Cells::new(NEAR);
    outline.iter().for_each(|&p| edge.insert(p, p));
    for &(p, ahead) in traffic.within(low - NEAR, high + NEAR) {
        let out = p - centre;
        let turning = out.normalize_or_zero().perp_dot(ahead);
        if turning.abs() < 0.5 {
            continue;
        }
        let bin = ((out.to_angle().rem_euclid(TAU) / TAU * BINS as f64) as usize).min(BINS - 1);
        let distance = edge.around(p).map(|other| other.distance(p)).fold(f64::INFINITY, f64::min);
        if distance <= NEAR && nearest[bin].is_none_or(|(other, _)| distance < other) {
            nearest[bin] = Some((distance, turning));
        }
    }
    let part =
        |way: f64| nearest.iter().flatten().filter(|(_, turning)| 0.0 < way * turning).count() as f64 / BINS as f64;
    (part(1.0), part(-1.0))
}
