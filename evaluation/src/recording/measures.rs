//! The vehicle of an episode: its dimensions, and the names of vehicle and load.

use std::fmt;

use offtrack::layout::{Body, N_TRAILER_RAYS, Ray};
use offtrack::map::Road;
use offtrack::world::World;
use serde::{Deserialize, Serialize};

use super::{MILLI, to};

/// A rectangle in its unit's frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rectangle {
    /// Front end, ahead of the frame's origin (m).
    pub front: f32,
    /// Rear end, ahead of the frame's origin (negative when behind) (m).
    pub rear: f32,
    /// Half of the width (m).
    pub half_width: f32,
}

impl From<Rectangle> for Body {
    fn from(Rectangle { front, rear, half_width }: Rectangle) -> Body {
        Body { front, rear, half_width }
    }
}

/// Dimensions of the truck for drawing it. The origin of the tractor is the frame's `position`, that of the trailer
/// `trailer_position`; x forward, y left.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// Front axle ahead of the drive axle (m).
    pub wheelbase: f32,
    /// Fifth wheel ahead of the drive axle (m).
    pub fifth_wheel: f32,
    /// Kingpin ahead of the trailer's axle group (m).
    pub trailer_wheelbase: f32,
    /// The tractor's outline.
    pub tractor_body: Rectangle,
    /// The trailer's outline.
    pub trailer_body: Rectangle,
    /// The trailer's sensors in the order of `ranges`: mount and unit vector, x, y, dx, dy.
    pub trailer_rays: Vec<[f32; 4]>,
    /// The tractor's sensors.
    pub tractor_rays: Vec<[f32; 4]>,
    /// Reach of a sensor (m).
    pub sensor_range: f32,
}

impl Measures {
    /// Measures of a vehicle of a world: row `vehicle` of its `rigs`.
    pub fn of(world: &World, vehicle: u32) -> Measures {
        let rig = &world.rigs[vehicle as usize];
        let body = |body: &Body| Rectangle {
            front: to(MILLI, body.front),
            rear: to(MILLI, body.rear),
            half_width: to(MILLI, body.half_width),
        };
        let ray = |ray: &Ray| {
            [to(MILLI, ray.origin.x), to(MILLI, ray.origin.y), to(1e6, ray.direction.x), to(1e6, ray.direction.y)]
        };
        let (trailer, tractor) = world.rays_of(rig).split_at(N_TRAILER_RAYS);
        Measures {
            wheelbase: to(MILLI, rig.wheelbase),
            fifth_wheel: to(MILLI, rig.fifth_wheel),
            trailer_wheelbase: to(MILLI, rig.trailer_wheelbase),
            tractor_body: body(&rig.tractor_body),
            trailer_body: body(&rig.trailer_body),
            trailer_rays: trailer.iter().map(ray).collect(),
            tractor_rays: tractor.iter().map(ray).collect(),
            sensor_range: world.params.sensor_range,
        }
    }

    /// Measures of the truck that is seen on a roundabout: the mirror image of the one driven, where that is.
    #[must_use]
    pub fn seen(mut self, roundabout: &Road) -> Measures {
        if roundabout.is_mirrored() {
            self.trailer_rays.chunks_exact_mut(2).for_each(|pair| pair.swap(0, 1));
            self.tractor_rays.reverse();
            for [_, y, _, dy] in self.trailer_rays.iter_mut().chain(&mut self.tractor_rays) {
                (*y, *dy) = (0.0 - *y, 0.0 - *dy);
            }
        }
        self
    }
}

/// A vehicle with a load, by their names.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Class {
    /// Stem of the vehicle's file.
    pub vehicle: String,
    /// Name of the load.
    pub load: String,
}

impl Class {
    /// The class of row `vehicle` of a world's `rigs`; `None` where the benchmark has one vehicle, which has no name.
    pub fn of(world: &World, vehicle: u32) -> Option<Class> {
        let class = &world.classes[world.rigs[vehicle as usize].class_index as usize];
        (!class.vehicle.is_empty()).then(|| Class { vehicle: class.vehicle.clone(), load: class.load.clone() })
    }
}

impl fmt::Display for Class {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "{}, {}", self.vehicle, self.load)
    }
}
