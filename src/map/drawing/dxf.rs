//! The polylines, lines and arcs of a DXF file on the layers that are asked for, in metres.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::f64::consts::TAU;
use std::path::Path;

use glam::DVec2;

use super::pairs::{Pair, pairs};
use super::unit::{Unit, reach};
use super::{Drawing, Entity, Layers, is_same_layer};
use crate::files::reader::{Error, Reader};
use crate::geometry::{Curve, Piece, arc_of_height};

/// Points nearer than this are one (m).
const SAME: f64 = 1e-6;
/// Most entities of a drawing.
const MOST_ENTITIES: usize = 1_000_000;

impl Drawing {
    pub(super) fn parse(file: &Path, text: &str, layers: &Layers) -> Result<Drawing, Error> {
        let pairs = pairs(file, text)?;
        let (unit, note) = unit(file, &pairs, layers)?;
        check_whole(file, &pairs)?;
        let entities = section(&pairs, "ENTITIES");
        let (blocks, unseen_layers) = (drawn_blocks(&pairs, layers), unseen_layers(&pairs));
        let reader = Reader::of(file);
        reader.count("entities", entities.len(), 0..=MOST_ENTITIES)?;
        let mut drawing = Drawing::default();
        let mut left_out = LeftOut::default();
        let mut index = 0;
        while index < entities.len() {
            let entity = entities[index];
            index += 1;
            let mut vertices: &[&[Pair]] = &[];
            if entity[0].value == "POLYLINE" {
                let n = entities[index..].iter().take_while(|other| other[0].value == "VERTEX").count();
                vertices = &entities[index..index + n];
                index += n;
            }
            if text_of(entity, 67) == Some("1") {
                left_out.on_paper += 1;
                continue;
            }
            let layer = text_of(entity, 8).unwrap_or_default();
            let is_unseen = text_of(entity, 60) == Some("1") || unseen_layers.contains(&folded(layer));
            let is_insert = entity[0].value == "INSERT" && !is_unseen;
            let drawn_name = |name: &&str| is_insert && blocks.contains(&folded(name));
            if let Some(name) = text_of(entity, 2).filter(drawn_name) {
                let found = format!("INSERT of {name}");
                let place = format!("line {}", entity[0].line);
                return Err(reader.invalid(place, found, "kerbs, lanes or aprons lie in this block: explode it"));
            }
            let is = |name: &str| is_same_layer(layer, name);
            let target = if is(&layers.kerbs) {
                &mut drawing.kerbs
            } else if is(&layers.lanes) {
                &mut drawing.lanes
            } else if is(&layers.aprons) {
                &mut drawing.aprons
            } else {
                left_out.elsewhere(layer, entity[0].value);
                continue;
            };
            match entity[0].value {
                "SEQEND" => {}
                _ if is_unseen => left_out.unseen += 1,
                kind => match curve(file, entity, vertices, unit.metres())? {
                    Some(drawn) => target.push(drawn),
                    None => left_out.without_outline.push(kind),
                },
            }
        }
        for (layer, kind) in [(&layers.kerbs, &drawing.kerbs), (&layers.lanes, &drawing.lanes)] {
            if kind.is_empty() {
                let expected = format!("the drawing has {}", left_out.has(&drawing, layers));
                return Err(reader.invalid(format!("layer {layer}"), "empty", expected));
            }
        }
        reach(&reader, &drawing.kerbs)?;
        drawing.notes = note.into_iter().chain(left_out.notes()).collect();
        Ok(drawing)
    }
}

/// What of a drawing is not taken.
#[derive(Default)]
struct LeftOut<'a> {
    /// How many entities lie on each layer that is not asked for.
    others: BTreeMap<&'a str, usize>,
    /// Kinds of the entities that have no outline, on the layers that are asked for.
    without_outline: Vec<&'a str>,
    on_paper: usize,
    /// Invisible, or on a layer that is off or frozen.
    unseen: usize,
}

impl<'a> LeftOut<'a> {
    /// An entity on a layer that is not asked for; what belongs to the one before it is not counted.
    fn elsewhere(&mut self, layer: &'a str, kind: &str) {
        if !matches!(kind, "VERTEX" | "SEQEND") {
            *self.others.entry(layer).or_default() += 1;
        }
    }

    /// What the drawing has, for who misses a layer.
    fn has(&self, drawing: &Drawing, layers: &Layers) -> String {
        let own = [(&*layers.kerbs, drawing.kerbs.len()), (&*layers.lanes, drawing.lanes.len())];
        let own = own.into_iter().filter(|(_, n)| 0 < *n);
        let others = self.others.iter().map(|(layer, n)| (*layer, *n));
        let known: Vec<String> = own.chain(others).map(|(layer, n)| format!("{layer} ({n})")).collect();
        let has = if known.is_empty() { "nothing".into() } else { known.join(", ") };
        let hidden = if 0 < self.unseen { ", and what is off, frozen or invisible: show it" } else { "" };
        format!("{has}{hidden}")
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let mut note = |n: usize, what: String| {
            if 0 < n {
                notes.push(format!("{n} entities {what}"));
            }
        };
        let unseen = "on these layers that are invisible, or whose layer is off or frozen, are left out";
        note(self.unseen, unseen.to_owned());
        note(self.others.values().sum(), format!("on {} other layers are left out", self.others.len()));
        note(self.on_paper, "in paper space are left out".to_owned());
        let kinds: Vec<&str> = self.without_outline.iter().copied().collect::<BTreeSet<_>>().into_iter().collect();
        let without_outline = format!("on these layers that are no outlines are left out: {}", kinds.join(", "));
        note(self.without_outline.len(), without_outline);
        notes
    }
}

/// The unit that is asked for, else that of the header; and a note where the header says another one.
fn unit(file: &Path, pairs: &[Pair], layers: &Layers) -> Result<(Unit, Option<String>), Error> {
    let stated = pairs.windows(2).find(|pair| pair[0].code == 9 && pair[0].value == "$INSUNITS").map(|pair| pair[1]);
    let of_header = stated.and_then(|pair| Unit::of_code(pair.value));
    let units = Unit::listed(&Unit::NAMED);
    let says_none = stated.is_none_or(|pair| pair.value == "0");
    if let Some(unit) = layers.unit {
        let differs = !says_none && of_header != Some(unit);
        let code = stated.map_or("", |pair| pair.value);
        let name = of_header.map_or_else(|| "another unit".to_owned(), |unit| unit.name().to_owned());
        return Ok((
            unit,
            differs.then(|| format!("$INSUNITS is {code}, {name}; lengths are taken as {}", unit.name())),
        ));
    }
    of_header.map(|unit| (unit, None)).ok_or_else(|| {
        let (key, value) = stated.map_or(("$INSUNITS".to_owned(), "missing"), |pair| (pair.key(), pair.value));
        let expected = if says_none {
            format!("the drawing does not say its unit: give --unit {units}")
        } else {
            format!("$INSUNITS is a unit that is not read: scale the drawing to {units}")
        };
        Reader::of(file).invalid(key, value, expected)
    })
}

/// An error where the file ends within a section: a copy that was cut lacks kerbs.
fn check_whole(file: &Path, pairs: &[Pair]) -> Result<(), Error> {
    let n = |value: &str| pairs.iter().filter(|pair| pair.code == 0 && pair.value == value).count();
    match pairs.last() {
        Some(last) if n("ENDSEC") < n("SECTION") => {
            let expected = "ends within a section, without ENDSEC: is the file whole?";
            Err(Reader::of(file).invalid(format!("line {}", last.line), last.value, expected))
        }
        _ => Ok(()),
    }
}

/// The entities of a section, each from its code 0 on.
fn section<'a, 'b>(pairs: &'b [Pair<'a>], name: &str) -> Vec<&'b [Pair<'a>]> {
    let begin = pairs
        .windows(2)
        .position(|pair| (pair[0].code, pair[0].value) == (0, "SECTION") && (pair[1].code, pair[1].value) == (2, name));
    let Some(begin) = begin else { return Vec::new() };
    let section = &pairs[begin + 2..];
    let end = section.iter().position(|pair| pair.code == 0 && pair.value == "ENDSEC").unwrap_or(section.len());
    let section = &section[..end];
    let starts: Vec<usize> = (0..end).filter(|&index| section[index].code == 0).collect();
    let ends = starts.iter().skip(1).copied().chain([end]);
    starts.iter().zip(ends).map(|(&start, end)| &section[start..end]).collect()
}

/// Names of the layers that are switched off or frozen, all [`folded`].
fn unseen_layers(pairs: &[Pair]) -> HashSet<String> {
    let whole = |entity: &[Pair], code: i32| text_of(entity, code).and_then(|text| text.parse::<i32>().ok());
    let is_unseen = |entity: &[Pair]| {
        // The colour of a layer that is off is negative; bit 1 of its flags freezes it.
        whole(entity, 62).is_some_and(|colour| colour < 0) || whole(entity, 70).is_some_and(|flags| flags & 1 == 1)
    };
    let layers = section(pairs, "TABLES").into_iter().filter(|entity| entity[0].value == "LAYER" && is_unseen(entity));
    layers.filter_map(|entity| text_of(entity, 2)).map(folded).collect()
}

/// A name in a drawing, which is the same in capitals.
pub(super) fn folded(name: &str) -> String {
    name.to_lowercase()
}

/// Names of the blocks in which something is drawn on one of the layers, or in a block that is inserted there, all
/// [`folded`].
fn drawn_blocks(pairs: &[Pair], layers: &Layers) -> HashSet<String> {
    let mut drawn: HashSet<String> = HashSet::new();
    let mut inserted: Vec<(String, String)> = Vec::new();
    let mut block = String::new();
    let name_of = |entity: &[Pair]| folded(text_of(entity, 2).unwrap_or_default());
    for entity in section(pairs, "BLOCKS") {
        let layer = text_of(entity, 8).unwrap_or_default();
        let is_drawn = [&layers.kerbs, &layers.lanes, &layers.aprons].iter().any(|one| is_same_layer(layer, one));
        match entity[0].value {
            "BLOCK" => block = name_of(entity),
            // What stands on layer 0 of a block takes the layer of the insertion.
            "INSERT" if is_drawn => drop(drawn.insert(block.clone())),
            "INSERT" => inserted.push((block.clone(), name_of(entity))),
            "LINE" | "ARC" | "CIRCLE" | "LWPOLYLINE" | "POLYLINE" | "SPLINE" | "ELLIPSE" if is_drawn => {
                drawn.insert(block.clone());
            }
            _ => {}
        }
    }
    loop {
        let n = drawn.len();
        let around = inserted.iter().filter(|(_, inner)| drawn.contains(inner));
        let outer: Vec<String> = around.map(|(outer, _)| outer.clone()).collect();
        drawn.extend(outer);
        if drawn.len() == n {
            return drawn;
        }
    }
}

fn text_of<'a>(entity: &[Pair<'a>], code: i32) -> Option<&'a str> {
    entity.iter().find(|pair| pair.code == code).map(|pair| pair.value)
}

/// The curve of an entity on one of the layers; `None` for what has no extent, such as a text.
fn curve(file: &Path, entity: &[Pair], vertices: &[&[Pair]], metres: f64) -> Result<Option<Entity>, Error> {
    let number = |pairs: &[Pair], code: i32| -> Result<Option<f64>, Error> {
        pairs.iter().find(|pair| pair.code == code).map(|pair| pair.number(file)).transpose()
    };
    let length = |code: i32| Ok::<f64, Error>(number(entity, code)?.unwrap_or(0.0) * metres);
    let point = |x: i32, y: i32| Ok::<DVec2, Error>(DVec2::new(length(x)?, length(y)?));
    let (kind, line) = (entity[0].value, entity[0].line);
    let refused = |expected: &str| Reader::of(file).invalid(format!("line {line}"), kind, expected);
    let flags = number(entity, 70)?.unwrap_or(0.0) as u32;
    // An extrusion downwards mirrors what is drawn.
    let upwards = number(entity, 230)?.unwrap_or(1.0);
    if upwards < 0.0 {
        return Err(refused("is drawn from below (extrusion 0, 0, -1): flatten it"));
    }
    if upwards < 0.9999 {
        return Err(refused("is drawn in a tilted plane (extrusion): flatten it"));
    }
    let (curve, is_closed) = match kind {
        "LINE" => {
            let (from, to) = (point(10, 20)?, point(11, 21)?);
            (Curve { pieces: vec![Piece::Segment { from, to }] }, false)
        }
        "ARC" | "CIRCLE" => {
            let (centre, radius) = (point(10, 20)?, length(40)?);
            if radius <= SAME {
                return Err(refused("its radius must be positive"));
            }
            let angle = |code: i32| Ok::<f64, Error>(number(entity, code)?.unwrap_or(0.0).to_radians());
            let (from, to) = if kind == "ARC" { (angle(50)?, angle(51)?) } else { (0.0, 0.0) };
            let sweep = (to - from).rem_euclid(TAU);
            let sweep = if sweep == 0.0 { TAU } else { sweep };
            (Curve { pieces: vec![Piece::Arc { centre, radius, from, sweep }] }, kind == "CIRCLE")
        }
        "LWPOLYLINE" => {
            let mut points: Vec<(DVec2, f64)> = Vec::new();
            for pair in entity {
                match (pair.code, points.last_mut()) {
                    (10, _) => points.push((DVec2::new(pair.number(file)? * metres, 0.0), 0.0)),
                    (20, Some(point)) => point.0.y = pair.number(file)? * metres,
                    (42, Some(point)) => point.1 = pair.number(file)?,
                    _ => {}
                }
            }
            (joined(&points, flags & 1 == 1), flags & 1 == 1)
        }
        "POLYLINE" => {
            if flags & (2 | 4 | 8 | 16 | 64) != 0 {
                return Err(refused(
                    "is a spline, a mesh or drawn in space: make it a plane polyline of lines and arcs",
                ));
            }
            let mut points = Vec::new();
            for vertex in vertices {
                let of = |code: i32| Ok::<f64, Error>(number(vertex, code)?.unwrap_or(0.0));
                points.push((DVec2::new(of(10)?, of(20)?) * metres, of(42)?));
            }
            (joined(&points, flags & 1 == 1), flags & 1 == 1)
        }
        "SPLINE" | "ELLIPSE" => return Err(refused("is neither a line nor an arc: convert it to a polyline")),
        "INSERT" => return Err(refused("is a block: explode it")),
        _ => return Ok(None),
    };
    if curve.pieces.is_empty() {
        return Err(refused("has no length: delete it"));
    }
    Ok(Some(Entity { curve, is_closed, is_arc: kind == "ARC", place: format!("line {line}"), widths: None }))
}

/// The curve through vertices, each with the bulge of the arc to the next: the tangent of a quarter of its angle.
fn joined(points: &[(DVec2, f64)], is_closed: bool) -> Curve {
    let n = points.len();
    let mut pieces = Vec::new();
    for index in 0..if is_closed { n } else { n.saturating_sub(1) } {
        let ((from, bulge), (to, _)) = (points[index], points[(index + 1) % n]);
        if from.distance(to) <= SAME {
            continue;
        }
        if bulge.abs() <= 1.0 {
            let arc = arc_of_height(from, to, bulge * from.distance(to) / 2.0);
            pieces.push(arc.unwrap_or(Piece::Segment { from, to }));
        } else {
            // More than half a circle: its middle is where the bisector leaves it.
            let middle = (from + to) / 2.0 - bulge * (to - from).perp() / 2.0;
            let half = (bulge.atan() / 2.0).tan();
            for (from, to) in [(from, middle), (middle, to)] {
                pieces.extend(arc_of_height(from, to, half * from.distance(to) / 2.0));
            }
        }
    }
    Curve { pieces }
}
