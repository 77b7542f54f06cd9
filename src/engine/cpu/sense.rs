//! Measures the ranges: from each sensor along its ray to the kerb.
//!
//! Over-relaxed sphere tracing of the field (B. Keinert et al., "Enhanced Sphere Tracing", 2014): a step is as long as
//! the field's slope along the ray allows, and is taken back unless the free circles at both of its ends overlap. Rays
//! of a truck are traced side by side; a lane whose ray has ended takes the next one that waits. What a lane's
//! neighbours are does not change its ray.

use multiversion::multiversion;

use crate::engine::Row;
use crate::engine::cpu::perceive;
use crate::field::{Field, Purpose, Samples};
use crate::layout::angle::direction;
use crate::layout::shared::constants;
use crate::layout::{N_RAYS, N_TRAILER_RAYS, Ray, Rig, Truck};
use crate::world::World;

/// Rays that are traced side by side while others wait.
const LANES: usize = 16;
/// Rays that are traced side by side at last.
const FEW: usize = 8;
/// Lanes that must have ended before waiting rays take their places.
const REFILL: usize = 4;
/// Index of a lane without a ray.
const NO_RAY: usize = N_RAYS;
/// The order in which rays are traced: those that take the most samples on average first, so that the last ones end
/// soon. It changes no range.
const ORDER: [usize; N_RAYS] =
    [23, 24, 19, 22, 20, 21, 18, 25, 17, 16, 26, 14, 0, 12, 2, 4, 8, 10, 6, 27, 28, 1, 3, 5, 7, 9, 11, 13, 15];
constants! {
    /// The circles at both ends of a step may lie this far apart (m): a kerb thinner than this along the ray can hide
    /// between them.
    const RAY_GAP: f32 = 0.05;
    /// A step this short is never taken back (m).
    const RAY_SHORT: f32 = 0.25;
    /// Closer to a kerb than this, it is taken for straight (m).
    const RAY_CLOSE: f32 = 0.15;
    /// Distance to a kerb at which a ray has met the kerb (m).
    const RAY_MET: f32 = 0.004;
    /// Head-on, a ray has met the kerb from this far off: a straight kerb's position is known to a few millimetres then
    /// (m).
    const RAY_MET_HEAD_ON: f32 = 0.02;
    /// Slope of a ray 5 deg from grazing; flatter ones are not followed to the last centimetre.
    const RAY_GRAZING: f32 = 0.087;
    /// Fraction of the longest step that is tried, so that the circles overlap where the field is slightly off.
    const CAUTION: f32 = 0.98;
    /// Most samples of a ray. A ray along a kerb at the longest range takes fewer.
    const SAMPLES_MAX: u32 = 128;
}

/// Fills the row's ranges after a step.
pub fn sense(world: &World, row: &mut Row) {
    sense_at(world, row, row.truck.steps + 1);
}

/// Fills the row's ranges as its sensors read them `steps` steps after the start of the episode.
pub(super) fn sense_at(world: &World, row: &mut Row, steps: u32) {
    let params = &world.params;
    if world.disturbances.of_observation == 0 {
        *row.ranges = ranges_of(world, row.truck);
        return;
    }
    let truck = perceive::seen_truck(row.truck, &row.poses[0]);
    *row.ranges = ranges_of(world, &truck);
    perceive::disturb(&world.disturbances, row.stream, truck.episode, steps, params.sensor_range, row.ranges);
}

/// The ranges of a truck (m).
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
pub(crate) fn ranges_of(world: &World, truck: &Truck) -> [f32; N_RAYS] {
    let rig = world.rig(truck);
    ranges(world.route_field(truck.route), rig, world.rays_of(rig), truck, world.params.sensor_range)
}

/// Distance along each ray to the kerb: `reach` where none is met before, 0 from inside one (m).
///
/// Within 2 cm of the exact distance, except for rays that come within 2 cm of a kerb at less than 5 deg to it.
#[inline(always)]
pub fn ranges(field: &Field, rig: &Rig, rays: &[Ray; N_RAYS], truck: &Truck, reach: f32) -> [f32; N_RAYS] {
    let placed = Placed::new(rig, rays, truck);
    let mut found = [0.0; N_RAYS];
    let mut bundle = Bundle::<LANES>::empty();
    let mut waiting = 0;
    bundle.refill(&placed, &mut waiting, &mut found);
    loop {
        let going = bundle.advance(field, reach);
        if waiting < N_RAYS {
            if going + REFILL <= LANES {
                bundle.refill(&placed, &mut waiting, &mut found);
            }
        } else if going <= FEW {
            break;
        }
    }
    bundle.note(&mut found);
    let mut last: Bundle<FEW> = bundle.survivors();
    while 0 < last.advance(field, reach) {}
    last.note(&mut found);
    found
}

/// The rays of a truck where they begin.
struct Placed {
    /// Where each ray begins (m).
    origin_x: [f32; N_RAYS],
    origin_y: [f32; N_RAYS],
    /// Unit vector of each ray.
    direction_x: [f32; N_RAYS],
    direction_y: [f32; N_RAYS],
}

impl Placed {
    #[inline(always)]
    fn new(rig: &Rig, rays: &[Ray; N_RAYS], truck: &Truck) -> Placed {
        let tractor = (truck.position, direction(truck.heading));
        let trailer = (truck.trailer_position(rig), direction(truck.trailer_heading));
        let mut placed = Placed {
            origin_x: [0.0; N_RAYS],
            origin_y: [0.0; N_RAYS],
            direction_x: [0.0; N_RAYS],
            direction_y: [0.0; N_RAYS],
        };
        for (n, ray) in rays.iter().enumerate() {
            let (position, heading) = if n < N_TRAILER_RAYS { trailer } else { tractor };
            let (origin, direction) = (position + heading.rotate(ray.origin), heading.rotate(ray.direction));
            (placed.origin_x[n], placed.origin_y[n]) = (origin.x, origin.y);
            (placed.direction_x[n], placed.direction_y[n]) = (direction.x, direction.y);
        }
        placed
    }
}

/// Rays that are traced side by side.
#[derive(Clone, Copy)]
struct Bundle<const N: usize> {
    /// Where each ray begins (m).
    origin_x: [f32; N],
    origin_y: [f32; N],
    /// Unit vector of each ray.
    direction_x: [f32; N],
    direction_y: [f32; N],
    /// Distance along each ray of the next sample, or where the ray ended (m).
    along: [f32; N],
    /// Distance along each ray of the start of the last accepted step (m).
    base: [f32; N],
    /// Radius of the free circle there (m).
    free: [f32; N],
    /// Samples that may still be taken on each ray; 0 once the ray has ended.
    left: [u32; N],
    /// Index of each ray among the ranges.
    ray: [usize; N],
}

impl<const N: usize> Bundle<N> {
    /// No rays.
    #[inline(always)]
    fn empty() -> Bundle<N> {
        Bundle {
            origin_x: [0.0; N],
            origin_y: [0.0; N],
            direction_x: [0.0; N],
            direction_y: [0.0; N],
            along: [0.0; N],
            base: [0.0; N],
            free: [0.0; N],
            left: [0; N],
            ray: [NO_RAY; N],
        }
    }

    /// Notes the rays that have ended, and gives their lanes to the next ones that wait.
    #[inline(always)]
    fn refill(&mut self, placed: &Placed, waiting: &mut usize, found: &mut [f32; N_RAYS]) {
        for n in 0..N {
            if self.left[n] == 0 && *waiting < N_RAYS {
                self.note_lane(n, found);
                let ray = ORDER[*waiting];
                *waiting += 1;
                (self.origin_x[n], self.origin_y[n]) = (placed.origin_x[ray], placed.origin_y[ray]);
                (self.direction_x[n], self.direction_y[n]) = (placed.direction_x[ray], placed.direction_y[ray]);
                (self.along[n], self.base[n], self.free[n]) = (0.0, 0.0, 0.0);
                (self.left[n], self.ray[n]) = (SAMPLES_MAX, ray);
            }
        }
    }

    /// Takes one sample on every ray; returns how many are still going.
    #[inline(always)]
    fn advance(&mut self, field: &Field, reach: f32) -> usize {
        let (mut x, mut y) = ([0.0; N], [0.0; N]);
        for n in 0..N {
            x[n] = self.origin_x[n] + self.along[n] * self.direction_x[n];
            y[n] = self.origin_y[n] + self.along[n] * self.direction_y[n];
        }
        let Samples { distance, east, north } = field.sample(Purpose::March, &x, &y);
        let mut going = 0;
        for n in 0..N {
            let (along, distance) = (self.along[n], distance[n]);
            let radius = distance.abs();
            let closing = -(self.direction_x[n] * east[n] + self.direction_y[n] * north[n]);

            let bridged = larger(self.free[n] + radius + RAY_GAP, RAY_SHORT);
            // Deep in a solid the slope may be that of its far side.
            let accepted = (along - self.base[n] <= bridged) & (-RAY_CLOSE < distance);
            let near = radius <= larger(RAY_MET_HEAD_ON * closing * closing, RAY_MET);
            let met = accepted & near & ((0.0 < closing) | (distance < 0.0));
            let beyond = accepted & (reach <= along + distance);
            let inside = (along <= 0.0) & (distance <= 0.0);

            // Distance to a straight kerb; and between two circles that touch each other and the same straight kerb.
            let to_kerb = larger(smaller(distance / larger(closing, RAY_GRAZING), RAY_SHORT), -RAY_SHORT);
            let to_circle = 2.0 * CAUTION * distance / (1.0 + larger(closing, 0.0));
            let step = if met | (distance < RAY_CLOSE) { to_kerb } else { to_circle };
            let next = if accepted { along + step } else { self.base[n] + self.free[n] };
            let next = if beyond { reach } else { larger(smaller(next, reach), 0.0) };
            let next = if inside { 0.0 } else { next };

            self.base[n] = if accepted { along } else { self.base[n] };
            self.free[n] = if accepted { radius } else { self.free[n] };
            self.along[n] = if 0 < self.left[n] { next } else { along };
            self.left[n] = if met | beyond | inside { 0 } else { self.left[n].saturating_sub(1) };
            going += u32::from(0 < self.left[n]);
        }
        going as usize
    }

    /// Notes every ray's distance.
    #[inline(always)]
    fn note(&self, found: &mut [f32; N_RAYS]) {
        (0..N).for_each(|n| self.note_lane(n, found));
    }

    #[inline(always)]
    fn note_lane(&self, n: usize, found: &mut [f32; N_RAYS]) {
        if let Some(found) = found.get_mut(self.ray[n]) {
            *found = self.along[n];
        }
    }

    /// The rays still going, at most `M`, in a bundle that has room for them.
    #[inline(always)]
    fn survivors<const M: usize>(&mut self) -> Bundle<M> {
        let mut going = 0;
        for n in 0..N {
            // Every ray moves up and is overwritten if it has ended: a branch would be mispredicted.
            self.origin_x[going] = self.origin_x[n];
            self.origin_y[going] = self.origin_y[n];
            self.direction_x[going] = self.direction_x[n];
            self.direction_y[going] = self.direction_y[n];
            self.along[going] = self.along[n];
            self.base[going] = self.base[n];
            self.free[going] = self.free[n];
            self.left[going] = self.left[n];
            self.ray[going] = self.ray[n];
            going += usize::from(0 < self.left[n]);
        }
        let mut kept = Bundle::empty();
        kept.origin_x.copy_from_slice(&self.origin_x[..M]);
        kept.origin_y.copy_from_slice(&self.origin_y[..M]);
        kept.direction_x.copy_from_slice(&self.direction_x[..M]);
        kept.direction_y.copy_from_slice(&self.direction_y[..M]);
        kept.along.copy_from_slice(&self.along[..M]);
        kept.base.copy_from_slice(&self.base[..M]);
        kept.free.copy_from_slice(&self.free[..M]);
        for m in 0..M {
            kept.left[m] = if m < going { self.left[m] } else { 0 };
            kept.ray[m] = if m < going { self.ray[m] } else { NO_RAY };
        }
        kept
    }
}

/// The larger of two numbers in one instruction; `b` where `a` is NaN.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if b < a { a } else { b }
}

/// The smaller of two numbers in one instruction; `b` where `a` is NaN.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
