//! The clearances of each truck, by a thread of its own as `collide.wgsl` computes them.

use glam::Vec2;
use offtrack::field::Field;
use offtrack::layout::angle::direction;
use offtrack::layout::{Body, WORKGROUP};
use offtrack::simulator::Batch;
use offtrack::world::World;
use serde_json::{Value, json};

use crate::TOLERANCE;
use crate::field::{Lookup, Path, Trace, constant};
use crate::subgroups::{Counts, in_step as all_in_step};

/// What a thread does for one unit of its truck.
#[derive(Debug, Clone, Default)]
pub struct Unit {
    /// Samples of the points and corners.
    pub first: Trace,
    /// Samples of each round of halvings.
    pub rounds: Vec<Trace>,
    /// Most undecided spans at a time.
    pub deepest: usize,
}

/// What the threads do for each truck's tractor and trailer; an error if a clearance is not the batch's.
pub fn traces(world: &World, batch: &Batch) -> Result<Vec<[Unit; 2]>, String> {
    let halving = Halving::new()?;
    let mut worst: f32 = 0.0;
    let trucks = batch.truck.iter().zip(&batch.clearance);
    let units = trucks.map(|(truck, clearance)| {
        let (rig, field) = (world.rig(truck), world.route_field(truck.route));
        let (mut tractor, mut trailer) = (Unit::default(), Unit::default());
        let heading = direction(truck.heading);
        let found = [
            halving.clearance(field, &rig.tractor_body, halving.n_tractor, truck.position, heading, &mut tractor),
            halving.clearance(
                field,
                &rig.trailer_body,
                halving.n_trailer,
                truck.trailer_position(rig),
                direction(truck.trailer_heading),
                &mut trailer,
            ),
        ];
        // Clearances are those of the step that was made, before a truck began another episode.
        if 0 < truck.steps {
            worst = worst.max((found[0] - clearance.tractor).abs()).max((found[1] - clearance.trailer).abs());
        }
        [tractor, trailer]
    });
    let units: Vec<[Unit; 2]> = units.collect();
    eprintln!("clearances differ from the engine's by at most {worst} m");
    if worst <= TOLERANCE { Ok(units) } else { Err(format!("a clearance is {worst} m off the engine's")) }
}

/// What subgroups of `width` trucks' threads do a truck: first samples, and rounds until the last thread has none.
pub fn in_step(units: &[[Unit; 2]], width: usize) -> Value {
    let (mut first, mut rounds, mut n_rounds) = (Counts::default(), Counts::default(), 0);
    for subgroup in units.chunks(width) {
        for unit in 0..2 {
            let threads: Vec<Trace> = subgroup.iter().map(|truck| truck[unit].first.clone()).collect();
            first += all_in_step(&threads, width);
            let most = subgroup.iter().map(|truck| truck[unit].rounds.len()).max().unwrap_or(0);
            n_rounds += most;
            for round in 0..most {
                let of_thread = |truck: &[Unit; 2]| truck[unit].rounds.get(round).cloned();
                rounds += all_in_step(&subgroup.iter().filter_map(of_thread).collect::<Vec<Trace>>(), width);
            }
        }
    }
    json!({
        "first_samples": first.a_truck(units.len()),
        "halvings": rounds.a_truck(units.len()),
        "rounds": n_rounds as f64 / units.len() as f64,
    })
}

/// What workgroups do a truck whose threads halve the spans of their trucks' units together, tractors' and trailers' in
/// one list: passes over as many units as there are teams of LANES threads, and rounds until the last of a pass has no
/// spans.
pub fn by_teams(units: &[[Unit; 2]]) -> Result<Value, String> {
    let n_teams = WORKGROUP as usize / constant("LANES")? as usize;
    let (mut n_passes, mut n_rounds) = (0, 0);
    for trucks in units.chunks(WORKGROUP as usize) {
        let rounds = trucks.iter().flatten().map(|unit| unit.rounds.len());
        let undecided: Vec<usize> = rounds.filter(|&rounds| 0 < rounds).collect();
        for pass in undecided.chunks(n_teams) {
            n_passes += 1;
            n_rounds += pass.iter().max().unwrap_or(&0);
        }
    }
    let a_truck = |count: usize| count as f64 / units.len() as f64;
    Ok(json!({ "passes": a_truck(n_passes), "rounds": a_truck(n_rounds) }))
}

/// A stretch of a unit, in its frame, and what is subtracted from distances on it (m).
#[derive(Clone, Copy)]
struct Line {
    begin: Vec2,
    end: Vec2,
    radius: f32,
}

/// A part of a line that may cross a solid between its ends.
#[derive(Clone, Copy)]
struct Span {
    line: usize,
    part: u32,
    at_begin: f32,
    at_end: f32,
}

struct Halving {
    lookup: Lookup,
    n_tractor: usize,
    n_trailer: usize,
    n_spans: usize,
    lanes: usize,
    tolerance: f32,
    fraction: f32,
}

impl Halving {
    fn new() -> Result<Halving, String> {
        let whole = |name| constant(name).map(|value| value as usize);
        Ok(Halving {
            lookup: Lookup::new()?,
            n_tractor: whole("N_TRACTOR")?,
            n_trailer: whole("N_TRAILER")?,
            n_spans: whole("N_SPANS")?,
            lanes: whole("LANES")?,
            tolerance: constant("TOLERANCE")?,
            fraction: constant("FRACTION")?,
        })
    }

    fn clearance(&self, field: &Field, body: &Body, n: usize, at: Vec2, heading: Vec2, unit: &mut Unit) -> f32 {
        let sampled = |point: Vec2, trace: &mut Vec<Path>| {
            let p = Vec2::new(
                at.x + point.x * heading.x - point.y * heading.y,
                at.y + point.x * heading.y + point.y * heading.x,
            );
            self.lookup.sample(field, true, p, trace).distance
        };
        let distances: Vec<f32> = (0..n + 4).map(|index| sampled(point_of(body, n, index), &mut unit.first)).collect();
        let to_body = |(index, distance): (usize, &f32)| if index < n { distance - body.half_width } else { *distance };
        let mut least = distances.iter().enumerate().map(to_body).fold(f32::MAX, f32::min);
        let mut spans: Vec<Span> = Vec::new();
        for index in 0..n + 7 {
            let [at_begin, at_end] = if index < n - 1 {
                [distances[index], distances[index + 1]]
            } else {
                let corner = (index - (n - 1)) / 2;
                [distances[n + corner], distances[capsule_end(n, corner)] - body.half_width]
            };
            self.push(&mut spans, least, &line_of(body, n, index), Span { line: index, part: 1, at_begin, at_end });
        }
        unit.deepest = spans.len();
        while !spans.is_empty() && 0.0 < least {
            let undecided = spans.split_off(spans.len().saturating_sub(self.lanes));
            let mut trace = Trace::new();
            let lines: Vec<Line> = undecided.iter().map(|span| line_of(body, n, span.line)).collect();
            let middles: Vec<f32> = lines
                .iter()
                .zip(&undecided)
                .map(|(line, span)| sampled(line.begin + fraction_of(span.part) * (line.end - line.begin), &mut trace))
                .collect();
            for (line, middle) in lines.iter().zip(&middles) {
                least = least.min(middle - line.radius);
            }
            for ((line, whole), &middle) in lines.iter().zip(&undecided).zip(&middles) {
                self.push(&mut spans, least, line, Span { part: 2 * whole.part, at_end: middle, ..*whole });
                self.push(&mut spans, least, line, Span { part: 2 * whole.part + 1, at_begin: middle, ..*whole });
            }
            unit.rounds.push(trace);
            unit.deepest = unit.deepest.max(spans.len());
        }
        least
    }

    /// Keeps a span on which the clearance may be much less than the least found.
    fn push(&self, spans: &mut Vec<Span>, least: f32, line: &Line, span: Span) {
        let length = width(span.part) * line.begin.distance(line.end);
        let bound = 0.5 * (span.at_begin + span.at_end - length) - line.radius;
        if bound < least - (self.fraction * least).max(self.tolerance) && spans.len() < self.n_spans {
            spans.push(span);
        }
    }
}

fn width(part: u32) -> f32 {
    1.0 / (1 << part.ilog2()) as f32
}

/// The middle of a part, as a fraction of its line.
fn fraction_of(part: u32) -> f32 {
    (part as f32 + 0.5) * width(part) - 1.0
}

fn capsule_end(n: usize, corner: usize) -> usize {
    if corner < 2 { 0 } else { n - 1 }
}

fn point_of(body: &Body, n: usize, index: usize) -> Vec2 {
    if index < n {
        let middle = 0.5 * (body.front + body.rear);
        let (rear, front) = ((body.rear + body.half_width).min(middle), (body.front - body.half_width).max(middle));
        return Vec2::new(rear + index as f32 * ((front - rear) / (n - 1) as f32), 0.0);
    }
    let corner = index - n;
    let side = if corner.is_multiple_of(2) { body.half_width } else { -body.half_width };
    Vec2::new(if corner < 2 { body.rear } else { body.front }, side)
}

fn line_of(body: &Body, n: usize, index: usize) -> Line {
    if index < n - 1 {
        return Line { begin: point_of(body, n, index), end: point_of(body, n, index + 1), radius: body.half_width };
    }
    let corner_line = index - (n - 1);
    let begin = point_of(body, n, n + corner_line / 2);
    let capsule = point_of(body, n, capsule_end(n, corner_line / 2));
    let end = if corner_line.is_multiple_of(2) { Vec2::new(begin.x, 0.0) } else { Vec2::new(capsule.x, begin.y) };
    Line { begin, end, radius: 0.0 }
}
