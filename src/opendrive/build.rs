//! A ring of a map as a [`Ground`]: surface, arms and routes around its centre, as arcs and segments.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use glam::DVec2;

use super::area::{points, signed_area};
use super::crossings::{ArmLanes, Crossing, arms, circle, crossings};
use super::lanes::{Strip, sampled};
use super::paths::{Network, within};
use super::records::Kind;
use super::rings::{densified, fitted_circle};
use super::surface::Surface;
use super::{Map, Ring};
use crate::geometry::{Curve, Outline, Piece, fitted_line, fitted_outline};
use crate::ground::{Arm, Edges, Ground, Kerb, Line};
use crate::reader::{Error, Reader};
use crate::route::Lane;

/// Chords of edges leave their curves by at most this much before arcs are fitted \[m].
const FINE: f64 = 1e-3;
/// The same for centre lines, whose headings matter too \[m].
const FINEST: f64 = 1e-4;
/// What arcs and segments may add to that \[m].
const FITTED: f64 = 4e-3;
/// How far from the island the world reaches \[m].
const REACH: f64 = 85.0;
/// Islands smaller than this are left out \[m²].
const SMALLEST: f64 = 0.02;
/// Joints that jump further are warned of \[m].
const JUMP: f64 = 0.1;
/// A centre line that is nearer to a kerb than half a truck's width is warned of \[m].
const NEAREST: f64 = 1.3;
/// A way through the ring comes as near to its outer kerb as this, inside or outside \[m].
const BESIDE_RING: f64 = 6.0;
/// Ring lanes whose centre lines are nearer to each other than this are one \[m].
const ONE_LANE: f64 = 1.2;

/// How a ring is imported.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Names of the arms, counter-clockwise from east in the map; without them they are named by compass.
    pub arms: Vec<String>,
}

/// A ring that was imported.
#[derive(Debug, Clone)]
pub struct Imported {
    /// What is driven on; its origin is the ring's centre.
    pub ground: Ground,
    /// The ring's centre in the map's own coordinates \[m].
    pub centre: DVec2,
    /// What is odd about it.
    pub warnings: Vec<String>,
}

/// A ring of a map's records.
pub(super) fn ground(map: &Map, ring: &Ring, options: &Options) -> Result<Imported, Error> {
    let reader = Reader::of(&map.file);
    let outside = map.outside(ring.centre);
    let place = format!("ring at ({:.1}, {:.1})", outside.x, outside.y);
    let refused = |key: &str, value: String, expected: &str| reader.invalid(format!("{place}: {key}"), value, expected);
    let mut warnings = Vec::new();

    // The surface around a first centre, whose island then gives the centre itself.
    let extent = ring.radius + REACH;
    let near = nearby(map, ring.centre, extent + 10.0, FINE);
    let islands: Vec<Vec<DVec2>> =
        map.records.roads.iter().flat_map(|road| &road.islands).map(|island| moved(&island.corners, ring.centre)).collect();
    let strips: Vec<Strip> = near.iter().map(|(_, strip)| strip.clone()).collect();
    let surface = Surface::new(&strips, &islands);
    let no_island = || refused("island", "none".into(), "its edge is lost among narrow voids; another ring would do");
    let faces = around_origin(&surface.faces.parts, extent).ok_or_else(no_island)?;
    let edges = around_origin(&surface.edges.parts, extent).ok_or_else(no_island)?;
    let island = faces.iter().skip(1).find(|hole| encloses_origin(hole)).ok_or_else(no_island)?;
    let (centre, island_radius, _) = fitted_circle(&densified(&points(island), 0.1)).ok_or_else(no_island)?;
    let origin = ring.centre + centre;
    let loops = |contours: &[Vec<[f64; 2]>]| -> Vec<Curve> {
        let kept = contours.iter().filter(|contour| SMALLEST < signed_area(contour).abs());
        kept.map(|contour| fitted_outline(&moved(&points(contour), centre), FITTED)).filter(|curve| !curve.pieces.is_empty()).collect()
    };
    let (faces, edges) = (Outline::new(loops(&faces)), Outline::new(loops(&edges)));

    // Lanes in and out.
    let coarse = nearby(map, origin, extent + 10.0, super::COARSE);
    let (indices, around): (Vec<usize>, Vec<Strip>) = coarse.into_iter().unzip();
    let circle = circle(&map.records, &around, island_radius);
    let mut crossings = crossings(&around, &indices, &map.graph, circle);
    let fine = nearby(map, origin, extent + 10.0, FINEST);
    let network = Network {
        graph: &map.graph,
        strips: fine.iter().filter(|(_, strip)| strip.kind == Kind::Lane).map(|(i, strip)| (*i, strip)).collect(),
    };
    let outer_radius = outer_radius(&faces, island_radius);
    drop_passing_lanes(&mut crossings, &network, outer_radius + BESIDE_RING);
    let lanes = arms(&crossings, circle);
    let n_arms = lanes.len();
    if lanes.iter().all(|arm| arm.entries.is_empty()) || lanes.iter().all(|arm| arm.exits.is_empty()) {
        let found = format!("{n_arms} arms on a circle of {circle:.1} m");
        return Err(refused("arms", found, "a lane must lead in and another out, by the links of the map"));
    }
    if 8 < n_arms {
        return Err(refused("arms", format!("{n_arms} on a circle of {circle:.1} m"), "at most 8 arms are driven"));
    }
    let arms = named(&lanes, options, map.is_mirrored()).map_err(|expected| refused("arms", format!("{:?}", options.arms), &expected))?;

    // Routes.
    let mut lines = Vec::new();
    for (entry, arm) in lanes.iter().enumerate() {
        if 2 < arm.entries.len() {
            warnings.push(format!(
                "{place}: arm {} has {} entry lanes; the two next to the kerb are driven",
                arms[entry].name,
                arm.entries.len()
            ));
        }
        let kept = arm.entries.len().min(2);
        for lane in [Lane::Left, Lane::Right].into_iter().filter(|lane| lane.index() < kept) {
            let mut ways = network.ways(&arm.entries[lane.index()], &lanes);
            ways.retain(|(_, way)| network.nearest_to_centre(way) < outer_radius + BESIDE_RING);
            let mut exit = 0;
            for turn in 1..=n_arms {
                let exit_arm = (entry + turn) % n_arms;
                if lanes[exit_arm].exits.is_empty() {
                    continue;
                }
                exit += 1;
                // The lane that keeps its place from the kerb, or the one nearest to it.
                let kept = lane.index().min(lanes[exit_arm].exits.len() - 1);
                let candidates = ways.iter().filter(|((arm, _), _)| *arm == exit_arm);
                let Some((_, way)) = candidates.min_by_key(|((_, to), _)| (to.abs_diff(kept), *to)) else { continue };
                let (line, jump) = network.line(&network.continued(way, extent));
                let line = within(&line, extent - 0.5);
                if line.len() < 2 {
                    continue;
                }
                if JUMP < jump {
                    let route = format!("{}-{}-{exit}", arms[entry].name, lane.seen(map.is_mirrored()).name());
                    warnings.push(format!("{place}: {route}: its lanes jump by up to {jump:.2} m; the joints were spread"));
                }
                let width = |way: &[usize], at: DVec2| width(&network, way, at);
                let middle = ring_radius(&line, island_radius, outer_radius);
                let (from, to) = (line[0], line[line.len() - 1]);
                let around = line.iter().copied().min_by(|one, other| one.length().total_cmp(&other.length())).unwrap_or(from);
                let widths =
                    [width(way, circle * from.normalize_or_zero()), width(way, around), width(way, circle * to.normalize_or_zero())];
                let half = widths[1] / 2.0;
                let crossing = ((middle - island_radius).max(half), (outer_radius - middle).max(half));
                lines.push(Line { entry, lane, exit, exit_arm, line: fitted_line(&line, FITTED), crossing, widths });
            }
        }
    }
    if lines.is_empty() {
        return Err(refused("routes", format!("none between {n_arms} arms"), "the map's links must lead from a lane in to a lane out"));
    }
    for line in &lines {
        if let Some((distance, p)) = closest(&line.line, &faces).filter(|(distance, _)| *distance < NEAREST) {
            let route = format!("{}-{}-{}", arms[line.entry].name, line.lane.name(), line.exit);
            warnings.push(format!(
                "{place}: {route}: its centre line is {distance:.2} m from a kerb at ({:.1}, {:.1}) from the centre",
                p.x, p.y
            ));
        }
    }
    let mut lane_radii: Vec<f64> = lines.iter().map(|line| ring_radius(&line.line.polyline(0.01), island_radius, outer_radius)).collect();
    lane_radii.sort_by(f64::total_cmp);
    lane_radii.dedup_by(|after, before| *after - *before < ONE_LANE);
    let kerbs = faces.loops.iter().map(|curve| kerb(curve, &arms)).collect();
    let lanes = shown(&lines);
    let ground = Ground {
        mirrored: map.is_mirrored(),
        island_radius,
        outer_radius,
        lane_radii,
        arms,
        faces,
        kerbs,
        edges: Edges::Own(edges),
        lanes,
        lines,
    };
    Ok(Imported { ground, centre: map.outside(origin), warnings })
}

/// Drops lanes that no way through the ring begins or ends on: those of roads that pass by.
fn drop_passing_lanes(crossings: &mut Vec<Crossing>, network: &Network, reach: f64) {
    let alone = |crossing: &Crossing| match crossing.inwards {
        true => ArmLanes { entries: vec![crossing.clone()], exits: Vec::new() },
        false => ArmLanes { entries: Vec::new(), exits: vec![crossing.clone()] },
    };
    let lanes: Vec<ArmLanes> = crossings.iter().map(alone).collect();
    let mut used = vec![false; lanes.len()];
    for (entry, crossing) in crossings.iter().enumerate().filter(|(_, crossing)| crossing.inwards) {
        for ((exit, _), way) in network.ways(crossing, &lanes) {
            if network.nearest_to_centre(&way) < reach {
                (used[entry], used[exit]) = (true, true);
            }
        }
    }
    let mut used = used.into_iter();
    crossings.retain(|_| used.next().unwrap_or(false));
}

fn moved(points: &[DVec2], centre: DVec2) -> Vec<DVec2> {
    points.iter().map(|&p| p - centre).collect()
}

/// The strips of the map within `reach` of a point, sampled anew around it, with their indices.
fn nearby(map: &Map, centre: DVec2, reach: f64, tolerance: f64) -> Vec<(usize, Strip)> {
    let near = |strip: &Strip| {
        let (low, high) = strip.bounds();
        centre.clamp(low, high).distance(centre) < reach
    };
    let mut found = Vec::new();
    let mut sections: HashMap<(usize, usize), Vec<Strip>> = HashMap::new();
    for (index, strip) in map.strips.iter().enumerate().filter(|(_, strip)| near(strip)) {
        let section = sections
            .entry((strip.road, strip.section))
            .or_insert_with(|| sampled(&map.records.roads[strip.road], strip.road, strip.section, tolerance));
        let Some(fine) = section.iter().find(|other| other.id == strip.id) else { continue };
        let (left, right, of) = (moved(&fine.left, centre), moved(&fine.right, centre), moved(&fine.centre, centre));
        found.push((index, Strip { left, right, centre: of, ..fine.clone() }));
    }
    found
}

fn encloses_origin(contour: &[[f64; 2]]) -> bool {
    let n = contour.len();
    let crosses = |i: &usize| {
        let (from, to) = (DVec2::from(contour[*i]), DVec2::from(contour[(*i + 1) % n]));
        (from.y <= 0.0) != (to.y <= 0.0) && 0.0 < from.x + (to.x - from.x) * -from.y / (to.y - from.y)
    };
    (0..n).filter(crosses).count() % 2 == 1
}

/// The part of a surface around the origin, clipped to a circle: its contours, the outer one first.
fn around_origin(parts: &[Vec<Vec<[f64; 2]>>], extent: f64) -> Option<Vec<Vec<[f64; 2]>>> {
    use super::area::Area;
    let corners = (TAU / (2.0 * (1.0 - FINE / extent).acos())).ceil() as usize;
    let disc = Area::union(std::iter::once((0..corners).map(|i| extent * DVec2::from_angle(i as f64 * TAU / corners as f64)).collect()));
    let clipped = Area { parts: parts.to_vec() }.common(&disc);
    let around = |part: &Vec<Vec<[f64; 2]>>| encloses_origin(&part[0]) && part.iter().skip(1).any(|hole| encloses_origin(hole));
    // Of several around the origin, the one whose hole is smallest lies next to the island.
    clipped.parts.into_iter().find(around)
}

/// Radius of the ring's outer kerb: the island's and what is free beyond it between the arms.
fn outer_radius(faces: &Outline, island_radius: f64) -> f64 {
    let mut free: Vec<f64> = (0..180)
        .map(|i| {
            let out = DVec2::from_angle(f64::from(i) * TAU / 180.0);
            faces.ray(out * (island_radius + 0.5), out, 50.0)
        })
        .filter(|&free| 2.0 < free)
        .collect();
    free.sort_by(f64::total_cmp);
    // A quarter of the angles at least lies between the mouths.
    let between = free.get(free.len() / 8).copied().unwrap_or(4.0);
    island_radius + 0.5 + between
}

/// Radius at which a line follows the ring: the middle of its distances from the centre \[m].
fn ring_radius(line: &[DVec2], island_radius: f64, outer_radius: f64) -> f64 {
    let mut radii: Vec<f64> = Vec::new();
    for pair in line.windows(2) {
        let middle = (pair[0] + pair[1]) / 2.0;
        let turning = middle.normalize_or_zero().perp_dot((pair[1] - pair[0]).normalize_or_zero());
        if middle.length() < outer_radius && 0.9 < turning {
            radii.push(middle.length());
        }
    }
    radii.sort_by(f64::total_cmp);
    radii.get(radii.len() / 2).copied().unwrap_or((island_radius + outer_radius) / 2.0)
}

/// Width of the lane along a way at the point nearest to `p` \[m].
fn width(network: &Network, way: &[usize], p: DVec2) -> f64 {
    let strips = way.iter().filter_map(|strip| network.strips.get(strip));
    let samples = strips.flat_map(|strip| strip.left.iter().zip(&strip.right).zip(&strip.centre));
    let nearest = samples.min_by(|(_, one), (_, other)| one.distance(p).total_cmp(&other.distance(p)));
    nearest.map_or(3.5, |((left, right), _)| left.distance(*right))
}

/// The least distance of a line from the kerbs, away from its ends, and where \[m].
fn closest(line: &Curve, faces: &Outline) -> Option<(f64, DVec2)> {
    let n = (line.length() - 2.0 * NEAREST) as usize;
    let at = |i: usize| line.point_at(2.0 * NEAREST + i as f64 * 0.98);
    (0..n).map(|i| (faces.signed_distance(at(i)), at(i))).min_by(|one, other| one.0.total_cmp(&other.0))
}

/// What a loop of the kerb faces belongs to.
fn kerb(curve: &Curve, arms: &[Arm]) -> Kerb {
    let contour: Vec<[f64; 2]> = curve.polyline(0.01).into_iter().map(DVec2::into).collect();
    if 0.0 < signed_area(&contour) {
        return Kerb::Outer;
    }
    if encloses_origin(&contour) {
        return Kerb::Island;
    }
    let bearing = curve.pieces.iter().map(Piece::start).sum::<DVec2>().to_angle();
    let apart = |arm: &Arm| (bearing - arm.bearing + PI).rem_euclid(TAU) - PI;
    let nearest = (0..arms.len()).min_by(|&one, &other| apart(&arms[one]).abs().total_cmp(&apart(&arms[other]).abs()));
    Kerb::Splitter(nearest.unwrap_or(0))
}

/// The arms with their names.
fn named(lanes: &[ArmLanes], options: &Options, mirrored: bool) -> Result<Vec<Arm>, String> {
    let bearings: Vec<f64> = lanes.iter().map(|arm| arm.bearing().rem_euclid(TAU)).collect();
    let mut names = options.arms.clone();
    if names.is_empty() {
        for bearing in &bearings {
            let bearing = if mirrored { -bearing } else { *bearing };
            let point = (bearing / TAU * 8.0).round().rem_euclid(8.0) as usize % 8;
            let name = ["E", "NE", "N", "NW", "W", "SW", "S", "SE"][point];
            let same = names.iter().filter(|other| other.trim_end_matches(|c: char| c.is_ascii_digit()) == name).count();
            names.push(if same == 0 { name.to_owned() } else { format!("{name}{}", same + 1) });
        }
    }
    if names.len() != lanes.len() {
        return Err(format!(
            "the ring has {} arms, at {} deg",
            lanes.len(),
            bearings.iter().map(|b| format!("{:.0}", b.to_degrees())).collect::<Vec<_>>().join(", ")
        ));
    }
    for (i, name) in names.iter().enumerate() {
        if name.is_empty() || 20 < name.len() || !name.chars().all(|c| c.is_ascii_alphanumeric()) || names[..i].contains(name) {
            return Err("names must differ and be 1 to 20 letters and digits, because they are part of route names".into());
        }
    }
    Ok(names.into_iter().zip(bearings).map(|(name, bearing)| Arm { name, bearing }).collect())
}

/// The centre lines of routes, each lane once.
fn shown(lines: &[Line]) -> Vec<Curve> {
    const STEP: f64 = 0.5;
    const SAME: f64 = 0.3;
    let mut shown: Vec<Curve> = Vec::new();
    for Line { line, .. } in lines {
        let n = (line.length() / STEP) as usize;
        let known: Vec<bool> = (0..=n).map(|i| shown.iter().any(|other| other.distance(line.point_at(i as f64 * STEP)) < SAME)).collect();
        let mut from = 0;
        while from <= n {
            let to = (from..=n).find(|&i| known[i] != known[from]).unwrap_or(n + 1);
            if !known[from] && 2 < to - from {
                let end = if to <= n { to as f64 * STEP } else { line.length() };
                shown.push(line.part(from as f64 * STEP, end));
            }
            from = to;
        }
    }
    shown
}
