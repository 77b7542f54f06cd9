//! A ring of a map as a [`Ground`]: surface, arms and routes around its centre, as arcs and segments.

use glam::DVec2;

use super::bridges::bridges;
use super::bypass::Around;
use super::crossings::{ArmLanes, Crossing, arms, circle, crossings, joined};
use super::lanes::Strip;
use super::level::GRADE;
use super::lines::{CROSSING, Lines, shown};
use super::paths::Network;
use super::records::Level;
use super::surroundings::{self, Part, REACH, clipped, outline};
use super::whole::{LEVEL, TILTED};
use super::{FINEST, Map, Ring};
use crate::files::reader::{Error, Reader};
use crate::geometry::area::{Area, counter_clockwise, densified, encloses_origin, points, signed_area};
use crate::geometry::{Curve, Outline, fitted_circle};
use crate::map::apron;
use crate::map::arm_names::named;
use crate::map::ground::{Edges, Ground};
use crate::map::kerbs::{kerb_of, outer_radius, ring_radius};
use crate::map::route::Lane;

/// A way through the ring comes as near to its outer kerb as this, inside or outside (m).
const BESIDE_RING: f64 = 6.0;
/// Ring lanes whose centre lines are nearer to each other than this are one (m).
const ONE_LANE: f64 = 1.2;
/// How far an island may reach, in its radii: rings are not quite round.
const OVAL: f64 = 1.4;
/// Radius of what stays solid of an island that an apron covers (m).
const CORE: f64 = 0.5;
/// Most arms of a place.
const MOST_ARMS: usize = 8;

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
    /// The ring's centre in the map's own coordinates (m).
    pub centre: DVec2,
    /// What is odd about it.
    pub warnings: Vec<String>,
}

/// Errors about a place of a map, `ring at (1.0, 2.0): key: value; expected`.
pub(super) struct Refusals<'a> {
    pub(super) reader: Reader<'a>,
    pub(super) place: String,
}

impl Refusals<'_> {
    pub(super) fn error(&self, key: &str, value: impl Into<String>, expected: impl Into<String>) -> Error {
        self.reader.invalid(format!("{}: {key}", self.place), value.into(), expected)
    }
}

/// The surface around a ring's island, which gives the centre.
struct Island {
    origin: DVec2,
    radius: f64,
    faces: Outline,
    edges: Outline,
    /// The inner edge of its apron.
    apron: Option<Curve>,
    /// Whether the map has an apron that does not lead all around the island, or on which something stands.
    has_open_apron: bool,
}

/// A ring of a map's records.
pub(super) fn ground(map: &Map, ring: &Ring, options: &Options) -> Result<Imported, Error> {
    let outside = map.outside(ring.centre);
    let refused =
        Refusals { reader: Reader::of(&map.file), place: format!("ring at ({:.1}, {:.1})", outside.x, outside.y) };
    let extent = ring.radius + REACH;
    let expected = "its edge is lost among narrow voids; another ring would do";
    let Island { origin, radius, faces, edges, apron, has_open_apron } =
        island(map, ring, extent).ok_or_else(|| refused.error("island", "none", expected))?;
    let outer_radius = outer_radius(&faces, radius);

    let fine = surroundings::lanes(map, origin, extent, FINEST);
    let network = Network {
        records: &map.records,
        graph: &map.graph,
        strips: fine.iter().map(|(index, strip)| (*index, strip)).collect(),
    };
    let around = Around { network: &network, outer_radius, reach: outer_radius + BESIDE_RING, extent };
    let (circle, lanes, bypasses) = ring_arms(map, origin, radius, &around);
    let site = Site { map, refused: &refused, network: &network, origin, extent, circle, faces, edges };
    let mut imported = site.imported(&lanes, options, |routes| {
        add_routes(routes, &lanes, radius, outer_radius);
        Ok(())
    })?;
    imported.warnings.splice(..0, bypasses.iter().map(|bypass| format!("{}: {bypass}", refused.place)));
    let lines: Vec<Vec<DVec2>> = imported.ground.lines.iter().map(|line| line.line.polyline(0.01)).collect();
    let in_ring: Vec<&Vec<DVec2>> = lines.iter().filter(|line| !passes_outside(line, outer_radius)).collect();
    let in_ring = if in_ring.is_empty() { lines.iter().collect() } else { in_ring };
    let mut lane_radii: Vec<f64> = in_ring.into_iter().map(|line| ring_radius(line, radius, outer_radius)).collect();
    lane_radii.sort_by(f64::total_cmp);
    lane_radii.dedup_by(|after, before| *after - *before < ONE_LANE);
    let drawn = apron.into_iter().map(|apron| ("apron".to_owned(), apron)).collect();
    let checked = apron::checked(&refused.reader, &imported.ground.faces, drawn);
    if has_open_apron || checked.is_err() {
        imported.warnings.push(format!(
            "{}: its apron does not lead all around the island free of obstacles; it is solid",
            refused.place
        ));
    }
    let aprons = checked.unwrap_or_default();
    imported.ground = Ground { island_radius: radius, outer_radius, lane_radii, aprons, ..imported.ground };
    Ok(imported)
}

/// A place of a map, a ring or a junction, whose routes are still to be found.
pub(super) struct Site<'a> {
    pub(super) map: &'a Map,
    pub(super) refused: &'a Refusals<'a>,
    pub(super) network: &'a Network<'a>,
    /// What is the origin of the rest, in the map's records (m).
    pub(super) origin: DVec2,
    /// How far the world reaches (m).
    pub(super) extent: f64,
    /// Radius of the circle where arms begin (m).
    pub(super) circle: f64,
    pub(super) faces: Outline,
    pub(super) edges: Outline,
}

impl Site<'_> {
    /// The place with these arms and the routes that `add` finds; without an island and lanes around it.
    pub(super) fn imported(
        self,
        lanes: &[ArmLanes],
        options: &Options,
        add: impl FnOnce(&mut Lines) -> Result<(), Error>,
    ) -> Result<Imported, Error> {
        let Site { map, refused, network, origin, extent, circle, faces, edges } = self;
        check_arms(map, refused, lanes, circle)?;
        let mirrored = map.is_mirrored();
        let bearings: Vec<f64> = lanes.iter().map(ArmLanes::bearing).collect();
        let arms = named(&bearings, &options.arms, mirrored)
            .map_err(|expected| refused.error("arms", format!("{:?}", options.arms), expected))?;
        let mut routes = Lines {
            network,
            mirrored,
            arms: &arms,
            place: &refused.place,
            extent,
            circle,
            lines: Vec::new(),
            warnings: Vec::new(),
        };
        add(&mut routes)?;
        if routes.lines.is_empty() {
            let found = format!("none between {} arms", lanes.len());
            let expected = format!("the map's links must lead from a lane in to a lane out{}", unknown_lanes(map));
            return Err(refused.error("routes", found, expected));
        }
        routes.check(&faces);
        routes.warnings.extend(map.header_offset().map(|[x, y, z, turn]| {
            let place = &refused.place;
            format!(
                "{place}: the header's offset ({x}, {y}, {z}) m, {turn} rad is not applied: coordinates are the file's"
            )
        }));
        let uneven = tilt(map, network).into_iter().chain(bridges(&map.records, network.strips.values().copied()));
        routes.warnings.extend(uneven.map(|what| format!("{}: {what}", refused.place)));
        for warnings in [&map.records.warnings, &map.graph.warnings] {
            routes.warnings.extend(map.records.around(warnings, network).map(str::to_owned));
        }
        let Lines { mut lines, warnings, .. } = routes;
        lines.sort_by_key(|line| (line.entry, line.lane == Lane::Right, line.exit));
        let kerbs = faces.loops.iter().map(|curve| kerb_of(curve, &arms)).collect();
        let (lanes, edges) = (shown(&lines), Edges::Own(edges));
        let (island_radius, lane_radii) = (0.0, Vec::new());
        let centre = map.outside(origin);
        let ground = Ground {
            mirrored,
            origin: centre,
            island_radius,
            outer_radius: circle,
            lane_radii,
            arms,
            faces,
            kerbs,
            edges,
            aprons: Vec::new(),
            lanes,
            lines,
        };
        Ok(Imported { ground, centre, warnings })
    }
}

/// The surface around a first centre, whose island then gives the centre itself.
fn island(map: &Map, ring: &Ring, extent: f64) -> Option<Island> {
    let surface = surroundings::surface(map, ring.centre, extent);
    let around = |part: &Part| encloses_origin(&part[0]) && part.iter().skip(1).any(|hole| encloses_origin(hole));
    let faces = clipped(&surface.faces, extent).into_iter().find(around)?;
    let edges = clipped(&surface.edges, extent).into_iter().find(around)?;
    let island = faces.iter().skip(1).find(|hole| encloses_origin(hole))?;
    let (centre, radius, _) = fitted_circle(&densified(&points(island), 0.1))?;
    // Where it leads all around, what is within it is a hole; one that covers the island has none, or a seam.
    let aprons = clipped(&surface.aprons, OVAL * radius);
    let around_it: Vec<&Part> = aprons.iter().filter(|part| encloses_origin(&part[0])).collect();
    let core = |hole: &[[f64; 2]]| Area::union([counter_clockwise(points(hole))].into_iter()).grown(-CORE);
    let solid: Vec<_> =
        around_it.iter().flat_map(|part| &part[1..]).filter(|hole| !core(hole).parts.is_empty()).collect();
    // Of several, one within the other, the outermost: what lies between them is solid. Beside it nothing may be.
    let outermost = solid.iter().max_by(|a, b| signed_area(a).abs().total_cmp(&signed_area(b).abs()));
    let hole = outermost.filter(|_| solid.iter().all(|hole| encloses_origin(hole)));
    let covers = !around_it.is_empty() && solid.is_empty();
    let inner = || outline(&vec![(*hole?).clone()], centre).loops.pop();
    let apron = if covers { Some(Curve::circle(DVec2::ZERO, CORE)) } else { inner() };
    Some(Island {
        has_open_apron: !aprons.is_empty() && apron.is_none(),
        apron,
        origin: ring.centre + centre,
        radius,
        faces: outline(&faces, centre),
        edges: outline(&edges, centre),
    })
}

/// Radius of the circle around a ring where its arms begin, the lanes of the arms, and what became of
/// bypasses and of lanes that pass it by.
fn ring_arms(map: &Map, origin: DVec2, radius: f64, around_ring: &Around) -> (f64, Vec<ArmLanes>, Vec<String>) {
    let &Around { network, reach, .. } = around_ring;
    let coarse = surroundings::nearby(map, origin, radius + REACH, super::COARSE);
    let (indices, around): (Vec<usize>, Vec<Strip>) = coarse.into_iter().unzip();
    let circle = circle(&map.records, &around, radius);
    let mut crossings = crossings(&around, &indices, &map.graph, circle);
    let passing = drop_passing_lanes(&mut crossings, network, reach);
    let gate = |crossing: &Crossing| network.gate(crossing, reach);
    let (arms, bypasses) = around_ring.merged(joined(arms(&crossings, circle), gate, reach));
    (circle, arms, bypasses.into_iter().chain(passing).collect())
}

/// An error if the arms of a place are none, or too many.
fn check_arms(map: &Map, refused: &Refusals, lanes: &[ArmLanes], circle: f64) -> Result<(), Error> {
    let found = format!("{} on a circle of {circle:.1} m", lanes.len());
    if lanes.iter().all(|arm| arm.entries.is_empty()) || lanes.iter().all(|arm| arm.exits.is_empty()) {
        let expected = format!("a lane must lead in and another out, by the links of the map{}", unknown_lanes(map));
        return Err(refused.error("arms", found, expected));
    }
    if MOST_ARMS < lanes.len() {
        return Err(refused.error("arms", found, format!("at most {MOST_ARMS} arms are driven")));
    }
    Ok(())
}

/// What an error adds where the map has lanes of unknown types, on which nothing is driven.
fn unknown_lanes(map: &Map) -> String {
    map.records.unknown_lanes().map(|unknown| format!("; it has {unknown}")).unwrap_or_default()
}

/// The steepest that the lanes around a place are, where that is worth a warning.
fn tilt(map: &Map, network: &Network) -> Option<String> {
    let largest = |of: fn(&Level) -> f64, least: f64, what: &str| {
        let roads =
            network.strips.values().map(|strip| &map.records.roads[strip.road]).filter(|road| least < of(&road.level));
        let steepest =
            roads.max_by(|one, other| of(&one.level).total_cmp(&of(&other.level)).then(other.id.cmp(&one.id)))?;
        Some(format!("{what} of up to {:.1} % (road {})", 100.0 * of(&steepest.level), super::xml::shown(&steepest.id)))
    };
    let parts = [largest(|level| level.grade, GRADE, "grades"), largest(|level| level.crossfall, TILTED, "crossfall")];
    let list = parts.into_iter().flatten().collect::<Vec<_>>().join(" and ");
    (!list.is_empty()).then(|| format!("{list}; {LEVEL}"))
}

/// Adds the routes through a ring: from each of an arm's two entry lanes next to the kerb to every exit.
fn add_routes(routes: &mut Lines, lanes: &[ArmLanes], island_radius: f64, outer_radius: f64) {
    let n_arms = lanes.len();
    for (entry, arm) in lanes.iter().enumerate() {
        let n = arm.entries.len();
        if 2 < n {
            let (place, name) = (routes.place, &routes.arms[entry].name);
            routes
                .warnings
                .push(format!("{place}: arm {name} has {n} entry lanes; the two next to the kerb are driven"));
        }
        for lane in [Lane::Left, Lane::Right].into_iter().filter(|lane| lane.index() < n.min(2)) {
            let mut ways = routes.network.ways(&arm.entries[lane.index()], lanes);
            ways.retain(|(_, way)| routes.network.nearest_to_centre(way) < outer_radius + BESIDE_RING);
            let mut exit = 0;
            for exit_arm in (1..=n_arms).map(|turn| (entry + turn) % n_arms).filter(|&arm| !lanes[arm].exits.is_empty())
            {
                exit += 1;
                // The lane that keeps its place from the kerb, or the one nearest to it.
                let kept = lane.index().min(lanes[exit_arm].exits.len() - 1);
                let candidates = ways.iter().filter(|((arm, _), _)| *arm == exit_arm);
                let Some(way) = candidates.min_by_key(|((_, to), _)| (to.abs_diff(kept), *to)) else { continue };
                routes.add((entry, lane, exit, exit_arm), way, |line, width| {
                    if passes_outside(line, outer_radius) {
                        return (CROSSING * width, CROSSING * width);
                    }
                    let middle = ring_radius(line, island_radius, outer_radius);
                    ((middle - island_radius).max(width / 2.0), (outer_radius - middle).max(width / 2.0))
                });
            }
        }
        for exit_arm in (0..n_arms).filter(|&exit| 0 < n && !lanes[exit].exits.is_empty()) {
            if !routes.lines.iter().any(|line| (line.entry, line.exit_arm) == (entry, exit_arm)) {
                let [from, to] = [entry, exit_arm].map(|arm| &routes.arms[arm].name);
                routes.warnings.push(format!("{}: no lanes lead from arm {from} to arm {to}", routes.place));
            }
        }
    }
}

/// Whether a line does not enter the ring.
fn passes_outside(line: &[DVec2], outer_radius: f64) -> bool {
    line.iter().all(|p| outer_radius < p.length())
}

/// Drops lanes that no way through the ring begins or ends on: those of roads that pass by. Told is of those that lie
/// on a road of the ring's.
fn drop_passing_lanes(crossings: &mut Vec<Crossing>, network: &Network, reach: f64) -> Vec<String> {
    let alone = |crossing: &Crossing| match crossing.inwards {
        true => ArmLanes { entries: vec![crossing.clone()], exits: Vec::new() },
        false => ArmLanes { entries: Vec::new(), exits: vec![crossing.clone()] },
    };
    let lanes: Vec<ArmLanes> = crossings.iter().map(alone).collect();
    // Of the ways that begin or end on each, how near one comes to the centre; infinitely far without any (m).
    let mut nearest = vec![f64::INFINITY; lanes.len()];
    for (entry, crossing) in crossings.iter().enumerate().filter(|(_, crossing)| crossing.inwards) {
        for ((exit, _), way) in network.ways(crossing, &lanes) {
            let near = network.nearest_to_centre(&way);
            for end in [entry, exit] {
                nearest[end] = near.min(nearest[end]);
            }
        }
    }
    let roads = |crossing: &Crossing| -> Vec<usize> {
        crossing.strips.iter().filter_map(|strip| Some(network.strips.get(strip)?.road)).collect()
    };
    let (kept, dropped): (Vec<_>, Vec<_>) =
        std::mem::take(crossings).into_iter().zip(nearest).partition(|(_, nearest)| *nearest < reach);
    *crossings = kept.into_iter().map(|(crossing, _)| crossing).collect();
    let of_ring: Vec<usize> = crossings.iter().flat_map(roads).collect();
    let dropped = dropped.iter().filter(|(crossing, _)| roads(crossing).iter().any(|road| of_ring.contains(road)));
    let told = |(crossing, nearest): &(Crossing, f64)| {
        let names: Vec<String> = crossing.strips.iter().map(|&strip| network.name(strip)).collect();
        let why = match (nearest.is_finite(), crossing.inwards) {
            (true, _) => "passes the ring by too far from it",
            (false, true) => "leads on to no lane that leads out, by the map's links; lanes are not changed",
            (false, false) => "comes from no lane that leads in, by the map's links; lanes are not changed",
        };
        format!("{}: {why}, and it is left out", names.join(", "))
    };
    dropped.map(told).collect()
}
