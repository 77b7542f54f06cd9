//! Measures the clearances: from each unit's rectangle to the nearest solid edge. An apron is solid to a tractor alone.
//!
//! A rectangle is a capsule, all points within half its width of a stretch of its centre line, and four corners. Points
//! of the stretch are sampled for the capsule, so that a solid that lies wholly under the unit is found too, and the
//! corners themselves. The distance is 1-Lipschitz, so two samples bound it between them; the middle is sampled only
//! where the bound is not tight enough.

use glam::Vec2;
use multiversion::multiversion;

use crate::engine::Row;
use crate::engine::cpu::traffic::meet;
use crate::field::{Field, Purpose};
use crate::layout::angle::direction;
use crate::layout::shared::constants;
use crate::layout::{Body, Clearance, Rig, Truck};
use crate::world::World;

constants! {
    /// Samples taken at once.
    const LANES: usize = 8;
    /// Points of a unit sampled first, at most.
    const N_FIRST: usize = 2 * LANES;
    /// Further than any clearance (m).
    const FAR: f32 = f32::MAX;
    /// Points of a tractor's centre line sampled first: with its corners as many as are sampled at once.
    const N_TRACTOR: usize = LANES - 4;
    /// Points of a trailer's centre line sampled first: with its corners twice as many.
    const N_TRAILER: usize = N_FIRST - 4;
    /// Error of a clearance that is always tolerated (m).
    const TOLERANCE: f32 = 0.01;
    /// Error that is tolerated as a fraction of the clearance: far from a kerb a centimetre does not matter.
    const FRACTION: f32 = 0.5;
    /// Most undecided spans: at first 11 and 8 of a trailer, then at most 8 more for each of the 8 halvings from 2.5 m
    /// to 1 cm.
    const N_SPANS: usize = 96;
}

/// Fills the row's clearance, and which vehicle the truck touches.
pub fn collide(world: &World, row: &mut Row) {
    *row.clearance = clearance_of(world, row.truck);
    meet(world, row);
}

/// The clearances of a truck.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(crate) fn clearance_of(world: &World, truck: &Truck) -> Clearance {
    clearance(world.unit_fields(truck.route), world.rig(truck), truck)
}

/// Clearance of both units, each by the field of what it keeps to: at least the field's least distance on its
/// rectangle, and at most twice that plus 1 cm.
#[inline(always)]
pub fn clearance([tractor_field, trailer_field]: [&Field; 2], rig: &Rig, truck: &Truck) -> Clearance {
    let (tractor, trailer) = (direction(truck.heading), direction(truck.trailer_heading));
    Clearance {
        tractor: body_clearance::<N_TRACTOR, LANES>(tractor_field, &rig.tractor_body, truck.position, tractor),
        trailer: body_clearance::<N_TRAILER, N_FIRST>(
            trailer_field,
            &rig.trailer_body,
            truck.trailer_position(rig),
            trailer,
        ),
    }
}

/// A stretch of a unit, in its frame.
#[derive(Debug, Clone, Copy)]
struct Line {
    begin: Vec2,
    end: Vec2,
    /// What is subtracted from distances: the radius of the capsule, or nothing on the outline itself (m).
    radius: f32,
}

/// A part of a line that may cross a solid between its ends.
#[derive(Debug, Clone, Copy, Default)]
struct Span {
    line: u32,
    /// Which part: 1 is all of the line, 2 and 3 are its halves, 4 to 7 its quarters.
    part: u32,
    /// Lower bounds of the distance to the kerb at both ends (m).
    at_begin: f32,
    at_end: f32,
}

/// The capsule's ends on the centre line, rear and front; a unit wider than long has a point between them.
#[inline(always)]
fn stretch(body: &Body) -> Vec2 {
    let middle = 0.5 * (body.front + body.rear);
    Vec2::new((body.rear + body.half_width).min(middle), (body.front - body.half_width).max(middle))
}

/// One of a body's points sampled first: `n_points` on the centre line from the rear on, then the corners.
#[inline(always)]
fn point(body: &Body, n_points: usize, index: usize) -> Vec2 {
    if index < n_points {
        let ends = stretch(body);
        return Vec2::new(ends.x + index as f32 * ((ends.y - ends.x) / (n_points - 1) as f32), 0.0);
    }
    let corner = index - n_points;
    Vec2::new(
        if corner < 2 { body.rear } else { body.front },
        if corner.is_multiple_of(2) { body.half_width } else { -body.half_width },
    )
}

/// One of a body's lines: the pieces of its centre line, then two from each corner. These run along the unit's end to
/// its middle, and along its side to where the capsule takes over: both touch the capsule's end.
#[inline(always)]
fn line(body: &Body, n_points: usize, index: usize) -> Line {
    if index < n_points - 1 {
        return Line {
            begin: point(body, n_points, index),
            end: point(body, n_points, index + 1),
            radius: body.half_width,
        };
    }
    let corner_line = index - (n_points - 1);
    let begin = point(body, n_points, n_points + corner_line / 2);
    let capsule = point(body, n_points, capsule_end(n_points, corner_line / 2));
    let end = if corner_line.is_multiple_of(2) { Vec2::new(begin.x, 0.0) } else { Vec2::new(capsule.x, begin.y) };
    Line { begin, end, radius: 0.0 }
}

/// The point of the centre line that is the capsule's end near a corner.
#[inline(always)]
fn capsule_end(n_points: usize, corner: usize) -> usize {
    if corner < 2 { 0 } else { n_points - 1 }
}

/// Length of a part as a fraction of its line.
#[inline(always)]
fn width(part: u32) -> f32 {
    1.0 / (1 << part.ilog2()) as f32
}

/// Middle of a part of a line, in the unit's frame.
#[inline(always)]
fn middle(line: &Line, part: u32) -> Vec2 {
    let fraction = (part as f32 + 0.5) * width(part) - 1.0;
    line.begin + fraction * (line.end - line.begin)
}

/// Lower bound of the clearance on a span, as the distance is 1-Lipschitz (m).
#[inline(always)]
fn bound(line: &Line, span: &Span) -> f32 {
    0.5 * (span.at_begin + span.at_end - width(span.part) * line.begin.distance(line.end)) - line.radius
}

/// Clearance of one rectangle whose frame has its origin at `position` and the unit vector `heading` as x axis. `N`
/// points of its centre line and its corners are the `ALL` samples taken first.
#[inline(always)]
fn body_clearance<const N: usize, const ALL: usize>(field: &Field, body: &Body, position: Vec2, heading: Vec2) -> f32 {
    let points: [Vec2; ALL] = std::array::from_fn(|index| point(body, N, index));
    let distances = sampled(field, position, heading, &points);
    let mut least = FAR;
    for (n, distance) in distances.into_iter().enumerate() {
        least = least.min(if n < N { distance - body.half_width } else { distance });
    }
    let mut spans = Spans { spans: [Span::default(); N_SPANS], n: 0 };
    for n in 1..N {
        let span = Span { line: n as u32 - 1, part: 1, at_begin: distances[n - 1], at_end: distances[n] };
        spans.push(least, &line(body, N, n - 1), span);
    }
    for corner in 0..ALL - N {
        let at_end = distances[capsule_end(N, corner)] - body.half_width;
        for index in [N - 1 + 2 * corner, N + 2 * corner] {
            let span = Span { line: index as u32, part: 1, at_begin: distances[N + corner], at_end };
            spans.push(least, &line(body, N, index), span);
        }
    }
    spans.settled::<N>(field, body, position, heading, least)
}

/// Signed distance at points of a unit's frame (m).
#[inline(always)]
fn sampled<const N: usize>(field: &Field, position: Vec2, heading: Vec2, points: &[Vec2; N]) -> [f32; N] {
    let (mut x, mut y) = ([0.0; N], [0.0; N]);
    for n in 0..N {
        x[n] = position.x + points[n].x * heading.x - points[n].y * heading.y;
        y[n] = position.y + points[n].x * heading.y + points[n].y * heading.x;
    }
    field.sample(Purpose::Exact, &x, &y).distance
}

/// The undecided spans, last in first out.
struct Spans {
    spans: [Span; N_SPANS],
    n: usize,
}

impl Spans {
    /// Keeps `span` if the clearance on it may be much less than the least found.
    #[inline(always)]
    fn push(&mut self, least: f32, line: &Line, span: Span) {
        if bound(line, &span) < least - (FRACTION * least).max(TOLERANCE) && self.n < N_SPANS {
            self.spans[self.n] = span;
            self.n += 1;
        }
    }

    /// Halves spans until the clearance on none can be much less than the least found. Stops at contact.
    #[inline(always)]
    fn settled<const N: usize>(
        mut self,
        field: &Field,
        body: &Body,
        position: Vec2,
        heading: Vec2,
        mut least: f32,
    ) -> f32 {
        while 0 < self.n && 0.0 < least {
            let taken = self.n.min(LANES);
            self.n -= taken;
            let mut undecided = [Span { part: 1, ..Span::default() }; LANES];
            undecided[..taken].copy_from_slice(&self.spans[self.n..][..taken]);
            let lines = undecided.map(|span| line(body, N, span.line as usize));
            let middles = std::array::from_fn(|n| middle(&lines[n], undecided[n].part));
            let distances: [f32; LANES] = sampled(field, position, heading, &middles);
            for n in 0..taken {
                least = least.min(distances[n] - lines[n].radius);
            }
            for n in 0..taken {
                let Span { line, part, at_begin, at_end } = undecided[n];
                self.push(least, &lines[n], Span { line, part: 2 * part, at_begin, at_end: distances[n] });
                self.push(least, &lines[n], Span { line, part: 2 * part + 1, at_begin: distances[n], at_end });
            }
        }
        least
    }
}
