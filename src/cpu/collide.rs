//! Measures the clearances: from each unit's rectangle to the nearest solid edge.
//!
//! A rectangle is a capsule, all points within half its width of a stretch of its centre line, and four corners. Points of the stretch are
//! sampled for the capsule, so that a solid that lies wholly under the unit is found too, and the corners themselves. As the distance
//! changes by no more than a metre a metre, two samples bound it between them; only where the bound leaves a doubt is the middle sampled.

use glam::Vec2;
use multiversion::multiversion;

use crate::cpu::Row;
use crate::field::Field;
use crate::layout::{Body, Clearance, Rig, Truck};
use crate::world::World;

/// Samples taken at once.
const LANES: usize = 8;
/// Points of a tractor's centre line sampled first; with its corners they fill one bundle.
const N_TRACTOR: usize = LANES - 4;
/// Points of a trailer's centre line sampled first; with its corners they fill two.
const N_TRAILER: usize = 2 * LANES - 4;
/// Doubt that is left [m].
const DOUBT: f32 = 0.01;
/// Part of a clearance that may be left in doubt: what is far off need not be known to the centimetre.
const SHARE: f32 = 0.5;
/// Room for spans in doubt: at first 11 and 8 of a trailer, then at most 8 more for each of the 8 halvings from 2.5 m to 1 cm.
const N_SPANS: usize = 96;

/// Fills the row's clearance from where its truck is.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub fn collide(world: &World, row: &mut Row) {
    *row.clearance = clearance(world.route_field(row.truck.route), &world.params.rig, row.truck);
}

/// Clearance of both units: at least the field's least distance on their rectangles, and at most twice that plus 1 cm.
#[inline(always)]
pub fn clearance(field: &Field, rig: &Rig, truck: &Truck) -> Clearance {
    let (tractor, trailer) = (Vec2::from_angle(truck.heading), Vec2::from_angle(truck.trailer_heading));
    Clearance {
        tractor: body_clearance::<N_TRACTOR, LANES>(field, &rig.tractor_body, truck.position, tractor),
        trailer: body_clearance::<N_TRAILER, { 2 * LANES }>(field, &rig.trailer_body, truck.trailer_position(rig), trailer),
    }
}

/// A stretch of a unit, in its frame, that may hide a solid between its ends.
#[derive(Debug, Clone, Copy, Default)]
struct Span {
    from: Vec2,
    to: Vec2,
    /// Distance to the kerb at both ends, or what it is at least [m].
    at_from: f32,
    at_to: f32,
    /// What is subtracted from distances: the radius of the capsule, or nothing on the outline itself [m].
    radius: f32,
}

impl Span {
    /// The clearance on the span is no less than this [m].
    #[inline(always)]
    fn bound(&self) -> f32 {
        0.5 * (self.at_from + self.at_to - self.from.distance(self.to)) - self.radius
    }
}

/// Clearance of one rectangle whose frame stands at `place`, turned by `heading`; `N` points of its centre line and its corners are the
/// `ALL` samples taken first.
#[inline(always)]
fn body_clearance<const N: usize, const ALL: usize>(field: &Field, body: &Body, place: Vec2, heading: Vec2) -> f32 {
    let radius = body.half_width;
    // The capsule's ends; a unit wider than long has a point for a stretch.
    let middle = 0.5 * (body.front + body.rear);
    let (first, last) = ((body.rear + radius).min(middle), (body.front - radius).max(middle));
    let spacing = (last - first) / (N - 1) as f32;
    let mut points = [Vec2::ZERO; ALL];
    for (n, point) in points.iter_mut().enumerate().take(N) {
        *point = Vec2::new(first + n as f32 * spacing, 0.0);
    }
    for (n, corner) in points[N..].iter_mut().enumerate() {
        *corner = Vec2::new(if n < 2 { body.rear } else { body.front }, if n % 2 == 0 { radius } else { -radius });
    }
    let distances = sampled(field, place, heading, &points);

    let mut least = f32::INFINITY;
    for (n, distance) in distances.into_iter().enumerate() {
        least = least.min(if n < N { distance - radius } else { distance });
    }
    let mut spans = Spans { spans: [Span::default(); N_SPANS], n: 0 };
    let allowed = allowed(least);
    for n in 1..N {
        let (from, to) = (points[n - 1], points[n]);
        spans.push_below(allowed, Span { from, to, at_from: distances[n - 1], at_to: distances[n], radius });
    }
    for n in N..ALL {
        // From a corner along the unit's end to its middle, and along its side to where the capsule takes over: both touch the capsule's end.
        let end = if points[n].x < middle { 0 } else { N - 1 };
        let at_capsule = distances[end] - radius;
        for to in [Vec2::new(points[n].x, 0.0), Vec2::new(points[end].x, points[n].y)] {
            spans.push_below(allowed, Span { from: points[n], to, at_from: distances[n], at_to: at_capsule, radius: 0.0 });
        }
    }
    spans.settled(field, place, heading, least)
}

/// Spans below this bound need a closer look when the least clearance found is `least` [m].
#[inline(always)]
fn allowed(least: f32) -> f32 {
    least - (SHARE * least).max(DOUBT)
}

/// Signed distance at points of a unit's frame [m].
#[inline(always)]
fn sampled<const N: usize>(field: &Field, place: Vec2, heading: Vec2, points: &[Vec2; N]) -> [f32; N] {
    let (mut x, mut y) = ([0.0; N], [0.0; N]);
    for n in 0..N {
        x[n] = place.x + points[n].x * heading.x - points[n].y * heading.y;
        y[n] = place.y + points[n].x * heading.y + points[n].y * heading.x;
    }
    field.sample(&field.cells, &x, &y).distance
}

/// The spans still in doubt, last in first out.
struct Spans {
    spans: [Span; N_SPANS],
    n: usize,
}

impl Spans {
    /// Keeps `span` if it may hold less than `allowed`.
    #[inline(always)]
    fn push_below(&mut self, allowed: f32, span: Span) {
        if span.bound() < allowed && self.n < N_SPANS {
            self.spans[self.n] = span;
            self.n += 1;
        }
    }

    /// Halves spans until none can hold much less than the least clearance found; a touch needs no closer look.
    fn settled(mut self, field: &Field, place: Vec2, heading: Vec2, mut least: f32) -> f32 {
        while 0 < self.n && 0.0 < least {
            let taken = self.n.min(LANES);
            self.n -= taken;
            let mut doubtful = [Span::default(); LANES];
            doubtful[..taken].copy_from_slice(&self.spans[self.n..][..taken]);
            let middles = doubtful.map(|span| 0.5 * (span.from + span.to));
            let distances = sampled(field, place, heading, &middles);
            for n in 0..taken {
                least = least.min(distances[n] - doubtful[n].radius);
            }
            for n in 0..taken {
                let span = doubtful[n];
                self.push_below(allowed(least), Span { to: middles[n], at_to: distances[n], ..span });
                self.push_below(allowed(least), Span { from: middles[n], at_from: distances[n], ..span });
            }
        }
        least
    }
}
