//! Each ray of each truck, traced by a thread of its own as `sense.wgsl` does it.

use glam::Vec2;
use offtrack::field::Field;
use offtrack::layout::angle::direction;
use offtrack::layout::{N_RAYS, N_TRAILER_RAYS};
use offtrack::simulator::Batch;
use offtrack::world::World;

use crate::TOLERANCE;
use crate::field::{Lookup, Trace, constant};

/// The samples of each truck's rays, truck by truck; an error if a range is not the batch's.
pub fn traces(world: &World, batch: &Batch) -> Result<Vec<Trace>, String> {
    let march = March::new(world.params.sensor_range)?;
    let mut traces = Vec::with_capacity(batch.truck.len() * N_RAYS);
    let mut worst: f32 = 0.0;
    for (truck, ranges) in batch.truck.iter().zip(batch.ranges.iter()) {
        let (rig, field) = (world.rig(truck), world.route_field(truck.route));
        let tractor = (truck.position, direction(truck.heading));
        let trailer = (truck.trailer_position(rig), direction(truck.trailer_heading));
        for (index, ray) in world.rays[rig.chassis as usize].iter().enumerate() {
            let (position, heading) = if index < N_TRAILER_RAYS { trailer } else { tractor };
            let mut trace = Trace::new();
            let origin = position + heading.rotate(ray.origin);
            let range = march.traced(field, origin, heading.rotate(ray.direction), &mut trace);
            worst = worst.max((range - ranges[index]).abs());
            traces.push(trace);
        }
    }
    eprintln!("ranges differ from the engine's by at most {worst} m");
    if worst <= TOLERANCE { Ok(traces) } else { Err(format!("a range is {worst} m off the engine's")) }
}

/// A march along a ray.
struct March {
    lookup: Lookup,
    reach: f32,
    gap: f32,
    short: f32,
    close: f32,
    met: f32,
    met_head_on: f32,
    grazing: f32,
    caution: f32,
    samples_max: u32,
}

impl March {
    fn new(reach: f32) -> Result<March, String> {
        Ok(March {
            lookup: Lookup::new()?,
            reach,
            gap: constant("RAY_GAP")?,
            short: constant("RAY_SHORT")?,
            close: constant("RAY_CLOSE")?,
            met: constant("RAY_MET")?,
            met_head_on: constant("RAY_MET_HEAD_ON")?,
            grazing: constant("RAY_GRAZING")?,
            caution: constant("CAUTION")?,
            samples_max: constant("SAMPLES_MAX")? as u32,
        })
    }

    fn traced(&self, field: &Field, origin: Vec2, ahead: Vec2, trace: &mut Trace) -> f32 {
        let (mut along, mut base, mut free) = (0.0, 0.0, 0.0_f32);
        for _ in 0..self.samples_max {
            let sample = self.lookup.sample(field, false, origin + along * ahead, trace);
            let distance = sample.distance;
            let radius = distance.abs();
            let closing = -(ahead.x * sample.slope.x + ahead.y * sample.slope.y);

            let bridged = (free + radius + self.gap).max(self.short);
            let accepted = along - base <= bridged && -self.close < distance;
            let near = radius <= (self.met_head_on * closing * closing).max(self.met);
            let met = accepted && near && (0.0 < closing || distance < 0.0);
            let beyond = accepted && self.reach <= along + distance;
            let inside = along <= 0.0 && distance <= 0.0;

            let to_kerb = (distance / closing.max(self.grazing)).min(self.short).max(-self.short);
            let to_circle = 2.0 * self.caution * distance / (1.0 + closing.max(0.0));
            let step = if met || distance < self.close { to_kerb } else { to_circle };
            let next = if accepted { along + step } else { base + free };
            let next = if beyond { self.reach } else { next.min(self.reach).max(0.0) };
            if accepted {
                (base, free) = (along, radius);
            }
            along = if inside { 0.0 } else { next };
            if met || beyond || inside {
                break;
            }
        }
        along
    }
}
