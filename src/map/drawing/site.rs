//! What is drawn as a road: outlines from chains of lines, arms from the ends of the ways, the ring's centre.

use std::f64::consts::TAU;
use std::path::Path;

use glam::DVec2;

use super::{Drawing, Entity, Layers, aprons, closed, ways};
use crate::files::reader::{Error, Reader};
use crate::geometry::area::densified;
use crate::geometry::{Curve, Outline, Piece, fitted_circle, fitted_line, wrapped};
use crate::map::apron;
use crate::map::arm_names::{from_east, named};
use crate::map::chosen::FARTHEST;
use crate::map::ground::{Arm, Edges, Ground, Kerb, Line};
use crate::map::kerbs::{closest, kerb_of, outer_radius, ring_radius};
use crate::map::route::Lane;

/// Ends of lines nearer than this are joined (m).
pub(super) const GAP: f64 = 0.02;
/// Turn between two pieces of a way that is taken for smooth (rad).
const SMOOTH: f64 = 5e-3;
/// Tolerance of a smooth line through a way with corners (m).
const FITTED: f64 = 0.004;
/// Ends of ways nearer than this are of one lane (m), and in directions nearer than this of one arm (rad).
const ONE_LANE: f64 = 1.0;
const ONE_ARM: f64 = 0.35;
/// Most lines of kerbs, each of which is compared with every other, and most ways.
const MOST_KERBS: usize = 5000;
const MOST_WAYS: usize = 128;
/// Most lines of aprons, each of which is compared with every kerb.
const MOST_APRONS: usize = 200;
/// A way comes nearer to the ring than both of its ends by so much at least (m).
const NEARER: f64 = 1.0;
/// A way that is drawn backwards leads around the island by so much at least, the other way round than others (rad).
const BACKWARDS: f64 = 0.3;
/// Farthest that an island may be from a circle, as a fraction of its radius.
const ROUND: f64 = 0.3;

/// A road from a drawing.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// What is driven on.
    pub ground: Ground,
    /// What was left out, joined or fitted, in words.
    pub notes: Vec<String>,
}

/// The road of a drawing.
pub(super) fn drawn(file: &Path, drawing: Drawing, layers: &Layers) -> Result<Drawn, Error> {
    let reader = Reader::of(file);
    let Drawing { kerbs, mut lanes, aprons, centre: marked, mut notes } = drawing;
    reader.count(&format!("lines on layer {}", layers.kerbs), kerbs.len(), 1..=MOST_KERBS)?;
    reader.count(&format!("lines on layer {}", layers.lanes), lanes.len(), 1..=MOST_WAYS)?;
    reader.count(&format!("lines on layer {}", layers.aprons), aprons.len(), 0..=MOST_APRONS)?;
    ways::lead_arcs(&mut lanes);
    let lanes = ways::whole(lanes, &layers.lanes, &mut notes);
    let loops = closed::outlines(&reader, kerbs, &layers.kerbs, &mut notes)?;
    let loops = closed::kerbs(&reader, loops, &lanes, &mut notes)?;
    let aprons = closed::outlines(&reader, aprons, &layers.aprons, &mut notes)?;
    let (loops, aprons) = aprons::placed(loops, aprons.into_iter().map(|(_, apron)| apron).collect());
    let (centre, radius) = island(&reader, &loops, layers, layers.ring.or(marked))?;
    if let Some(p) = layers.ring.filter(|p| FARTHEST < p.distance(centre) - radius) {
        let (x, y) = (centre.x, centre.y);
        let expected = format!("must be within {FARTHEST} m of the island; the nearest is at ({x:.1}, {y:.1}) m");
        return Err(reader.invalid("ring", format_args!("({}, {})", p.x, p.y), expected));
    }
    let place = |curve: &Curve| moved(curve, -centre);
    let loops: Vec<Curve> = loops.iter().map(place).collect();
    let ways: Vec<Curve> = lanes.iter().map(|lane| place(&smooth(lane, &mut notes))).collect();
    let turned: f64 = ways.iter().map(turn_about_centre).sum();
    let mirrored = turned < 0.0;
    let seen = |curve: &Curve| if mirrored { curve.mirrored() } else { curve.clone() };
    let faces = Outline::new(loops.iter().map(seen).collect());
    let aprons = aprons.iter().map(|apron| (format!("layer {}", layers.aprons), seen(&place(apron))));
    let aprons = apron::checked(&reader, &faces, aprons.collect())?;
    let ways: Vec<Curve> = ways.iter().map(seen).collect();
    if mirrored {
        notes.push("the ways lead clockwise around the island: left-hand traffic".into());
    }
    let outer = outer_radius(&faces, radius);
    for (way, drawn) in ways.iter().zip(&lanes) {
        if turn_about_centre(way) < -BACKWARDS {
            let expected = "leads the other way round the island than others do: reverse it";
            return Err(reader.invalid(&drawn.place, "backwards", expected));
        }
        check_way(&reader, way, drawn, outer)?;
        if let Some((distance, at)) = closest(way, &faces) {
            let at = centre + if mirrored { DVec2::new(at.x, -at.y) } else { at };
            let (place, x, y) = (&drawn.place, at.x, at.y);
            notes.push(format!("{place}: the way is {distance:.2} m from a kerb at ({x:.1}, {y:.1}) m"));
        }
    }
    let arms = arms(&reader, &ways, layers, mirrored)?;
    let mut lines = lines(&reader, &lanes, &ways, &arms, (radius, outer), layers.lane_width)?;
    for (index, arm) in arms.iter().enumerate() {
        let missing = if lines.iter().all(|line| line.entry != index) {
            "begins"
        } else if lines.iter().all(|line| line.exit_arm != index) {
            "ends"
        } else {
            continue;
        };
        notes.push(format!("no way {missing} on arm {}: ends more than 20 deg apart are of two arms", arm.name));
    }
    notes.extend(ways::too_short(&lines, &arms, outer));
    lines.sort_by_key(|line| (line.entry, line.lane == Lane::Right, line.exit));
    let mut lane_radii: Vec<f64> =
        lines.iter().map(|line| ring_radius(&line.line.polyline(0.01), radius, outer)).collect();
    lane_radii.sort_by(f64::total_cmp);
    lane_radii.dedup_by(|after, before| *after - *before < ONE_LANE);
    let kerbs: Vec<Kerb> = faces.loops.iter().map(|curve| kerb_of(curve, &arms)).collect();
    let ground = Ground {
        mirrored,
        origin: centre,
        island_radius: radius,
        outer_radius: outer,
        lane_radii,
        arms,
        edges: Edges::Own(faces.clone()),
        aprons,
        faces,
        kerbs,
        lanes: ways,
        lines,
    };
    Ok(Drawn { ground, notes })
}

/// The centre and the radius of the central island.
fn island(reader: &Reader, loops: &[Curve], layers: &Layers, near: Option<DVec2>) -> Result<(DVec2, f64), Error> {
    let outer = (0..loops.len()).max_by(|&a, &b| loops[a].signed_area().abs().total_cmp(&loops[b].signed_area().abs()));
    let circle = |curve: &Curve| fitted_circle(&densified(&curve.polyline(1e-5), 0.25));
    let islands = loops.iter().enumerate().filter(|(index, _)| Some(*index) != outer);
    let round = islands.filter_map(|(_, curve)| circle(curve)).filter(|(_, radius, off)| *off < ROUND * radius);
    let nearest = |one: &(DVec2, f64, f64)| near.map_or(-one.1, |ring| ring.distance(one.0));
    let found = round.min_by(|one, other| nearest(one).total_cmp(&nearest(other)));
    let found = found.map(|(centre, radius, _)| (centre, radius));
    found.ok_or_else(|| {
        let (n, layer) = (loops.len(), &layers.kerbs);
        let expected =
            format!("among the {n} outlines on layer {layer} an island within {ROUND} of a circle is needed");
        reader.invalid("ring", "none", expected)
    })
}

/// A way without corners.
fn smooth(lane: &Entity, notes: &mut Vec<String>) -> Curve {
    let corner = |pair: &[Piece]| wrapped(pair[1].heading_at(0.0) - pair[0].heading_at(pair[0].length())).abs();
    let sharpest = lane.curve.pieces.windows(2).map(corner).fold(0.0, f64::max);
    if sharpest <= SMOOTH {
        return lane.curve.clone();
    }
    notes.push(format!(
        "{}: the way has corners of up to {:.1} deg; a smooth line within {FITTED} m takes its place",
        lane.place,
        sharpest.to_degrees()
    ));
    fitted_line(&lane.curve.polyline(0.001), FITTED)
}

fn moved(curve: &Curve, by: DVec2) -> Curve {
    let piece = |piece: &Piece| match *piece {
        Piece::Segment { from, to } => Piece::Segment { from: from + by, to: to + by },
        Piece::Arc { centre, radius, from, sweep } => Piece::Arc { centre: centre + by, radius, from, sweep },
    };
    Curve { pieces: curve.pieces.iter().map(piece).collect() }
}

/// An error for a way that does not lead from an arm through the ring, whose outermost kerb has this radius (m), to an
/// arm.
fn check_way(reader: &Reader, way: &Curve, drawn: &Entity, outer: f64) -> Result<(), Error> {
    let ends = [way.point_at(0.0), way.point_at(way.length())];
    let found = if drawn.is_closed || ends[0].distance(ends[1]) <= GAP {
        "closed".to_owned()
    } else if let Some(end) = ends.iter().find(|end| end.length() <= outer) {
        format!("ends {:.1} m from the ring's centre", end.length())
    } else if way.polyline(0.05).iter().all(|p| ends[0].length().min(ends[1].length()) - NEARER < p.length()) {
        "beside the ring".to_owned()
    } else {
        return Ok(());
    };
    let expected = format!(
        "each way is one line from an arm through the ring to an arm, from and to more than {outer:.1} m from the \
         ring's centre"
    );
    Err(reader.invalid(drawn.place.clone(), found, expected))
}

/// How far a way turns about the centre, counter-clockwise positive (rad).
fn turn_about_centre(way: &Curve) -> f64 {
    way.polyline(0.05).windows(2).map(|pair| wrapped(pair[1].to_angle() - pair[0].to_angle())).sum()
}

/// The arms that the ends of the ways form, counter-clockwise as the road is driven.
fn arms(reader: &Reader, ways: &[Curve], layers: &Layers, mirrored: bool) -> Result<Vec<Arm>, Error> {
    let ends = ways.iter().flat_map(|way| [way.point_at(0.0), way.point_at(way.length())]);
    let mut bearings: Vec<f64> = ends.map(|end| end.to_angle().rem_euclid(TAU)).collect();
    bearings.sort_by(f64::total_cmp);
    let n = bearings.len();
    let gap = |index: usize| (bearings[(index + 1) % n] - bearings[index]).rem_euclid(TAU);
    let cuts: Vec<usize> = (0..n).filter(|&index| ONE_ARM < gap(index)).collect();
    if cuts.is_empty() {
        return Err(reader.invalid(
            format!("layer {}", layers.lanes),
            "no arms",
            "the ways must begin and end on arms",
        ));
    }
    let mut middles: Vec<f64> = cuts
        .iter()
        .enumerate()
        .map(|(index, &cut)| {
            let first = (cut + 1) % n;
            let last = cuts[(index + 1) % cuts.len()];
            let span = (bearings[last] - bearings[first]).rem_euclid(TAU);
            (bearings[first] + 0.5 * span).rem_euclid(TAU)
        })
        .collect();
    middles.sort_by(|one, other| from_east(*one).total_cmp(&from_east(*other)));
    named(&middles, &layers.arms, mirrored)
        .map_err(|expected| reader.invalid("arms", format!("{:?}", layers.arms), expected))
}

/// The routes along the ways.
fn lines(
    reader: &Reader,
    drawn: &[Entity],
    ways: &[Curve],
    arms: &[Arm],
    (island, outer): (f64, f64),
    width: f64,
) -> Result<Vec<Line>, Error> {
    let arm_of = |end: DVec2| {
        let apart = |arm: &Arm| wrapped(end.to_angle() - arm.bearing).abs();
        (0..arms.len()).min_by(|&a, &b| apart(&arms[a]).total_cmp(&apart(&arms[b]))).unwrap_or(0)
    };
    let start = |way: &Curve| way.point_at(0.0);
    let mut lines: Vec<Line> = Vec::new();
    for (way, drawn) in ways.iter().zip(drawn) {
        let refused = |found: String, expected: &str| reader.invalid(drawn.place.clone(), found, expected);
        let (entry, exit_arm) = (arm_of(start(way)), arm_of(way.point_at(way.length())));
        let inwards = -DVec2::from_angle(arms[entry].bearing);
        // Places of the lanes of this arm across the direction of travel, the rightmost first.
        let aside = |way: &Curve| inwards.perp().dot(start(way));
        let mut lanes: Vec<f64> = ways.iter().filter(|other| arm_of(start(other)) == entry).map(aside).collect();
        lanes.sort_by(f64::total_cmp);
        lanes.dedup_by(|after, before| *after - *before < ONE_LANE);
        let own = lanes.iter().filter(|&&lane| lane < aside(way) - ONE_LANE).count();
        let lane = match own {
            0 => Lane::Right,
            1 => Lane::Left,
            _ => return Err(refused(format!("{} entry lanes", lanes.len()), "at most two lanes of an arm are driven")),
        };
        let leaves = |arm: usize| ways.iter().any(|other| arm_of(other.point_at(other.length())) == arm);
        let turns = (exit_arm + arms.len() - entry - 1) % arms.len() + 1;
        let exit = (1..=turns).filter(|turn| leaves((entry + turn) % arms.len())).count() as u32;
        if lines.iter().any(|line| (line.entry, line.lane, line.exit) == (entry, lane, exit)) {
            let found = format!("a second way from {} to {}", arms[entry].name, arms[exit_arm].name);
            return Err(refused(found, "draw one line for each way"));
        }
        let widths = drawn.widths.unwrap_or([width; 3]);
        let middle = ring_radius(&way.polyline(0.01), island, outer);
        let crossing = ((middle - island).max(widths[1] / 2.0), (outer - middle).max(widths[1] / 2.0));
        lines.push(Line { entry, lane, exit, exit_arm, line: way.clone(), crossing, widths, ends: [None, None] });
    }
    Ok(lines)
}
