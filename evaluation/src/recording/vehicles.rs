//! The other vehicles of a recording.

use glam::Vec2;
use offtrack::layout::{MOST_IN_GROUP, N_CAR_WORDS, N_CARS, Truck};
use offtrack::traffic::car::Outline;
use offtrack::traffic::{Row, outlines};
use offtrack::world::World;
use serde::{Deserialize, Serialize};

use super::{ANGLE, MILLI, to};

/// Deceleration from which on the brake lights are lit (m/s²).
pub const BRAKES: f32 = -0.6;
/// From this length on it is a van (m).
const VAN: f32 = 6.0;
/// From this width on it is a bus or a truck, or one of its units (m).
const LARGE: f32 = 2.3;
/// Behind the slots of cars and of the units of trucks stand the trailers of cars' slots.
const TRAILERS: usize = N_CARS + 2 * MOST_IN_GROUP;

/// Another vehicle after one step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Vehicle {
    /// Its slot: one that stays is in the same slot. A trailer has one of its own.
    pub slot: usize,
    /// Its middle (m).
    pub position: [f32; 2],
    /// Heading, counter-clockwise from east, in (-pi, pi] (rad).
    pub heading: f32,
    /// Length (m).
    pub length: f32,
    /// Width (m).
    pub width: f32,
    /// Speed (m/s).
    pub speed: f32,
    /// Acceleration (m/s²).
    pub acceleration: f32,
    /// Whether its driver is rude.
    pub is_rude: bool,
}

impl Vehicle {
    /// Those around a truck of a batch with these rows of its columns `truck` and `cars`, as the road is driven; none
    /// in a world without.
    pub fn around(world: &World, trucks: &[Truck], cars: &[[u32; N_CAR_WORDS]], env: usize) -> Vec<Vehicle> {
        let (Some(shared), Some(words)) = (&world.traffic, cars.get(env)) else { return Vec::new() };
        let network = &shared.road(world, trucks[env].route).network;
        let there = Row::of(words).cars.iter().enumerate().filter(|(_, car)| car.is_there());
        let vehicles = |(slot, car): (usize, &offtrack::traffic::Car)| {
            let (state, is_rude) = ([car.speed(), car.acceleration()], car.is_rude());
            let units = car.outlines(network).zip([slot, TRAILERS + slot]);
            units.map(move |(outline, slot)| Vehicle { is_rude, ..Vehicle::of(slot, outline, state) })
        };
        // Behind the slots of cars stand the other trucks of a group, two units each.
        let first = env - env % world.group();
        let mates = (first..first + world.group()).filter(|&mate| mate != env && trucks[mate].held == 0);
        let units = mates.flat_map(|mate| {
            let truck = &trucks[mate];
            let slot = N_CARS + 2 * (mate - first);
            let of = move |(unit, outline)| Vehicle::of(slot + unit, outline, [truck.speed, truck.acceleration]);
            outlines(world.rig(truck), truck).into_iter().enumerate().map(of)
        });
        there.flat_map(vehicles).chain(units).collect()
    }

    /// What covers this ground, at a speed and an acceleration (m/s, m/s²).
    fn of(slot: usize, outline: Outline, [speed, acceleration]: [f32; 2]) -> Vehicle {
        let Outline { middle, along, half_length, half_width } = outline;
        Vehicle {
            slot,
            position: middle.to_array().map(|value| to(MILLI, value)),
            heading: to(ANGLE, along.to_angle()),
            length: to(MILLI, 2.0 * half_length),
            width: to(MILLI, 2.0 * half_width),
            speed: to(MILLI, speed),
            acceleration: to(MILLI, acceleration),
            is_rude: false,
        }
    }

    /// Whether its brake lights are lit.
    pub fn brakes(&self) -> bool {
        self.acceleration < BRAKES
    }

    /// Whether it is a van.
    pub fn is_van(&self) -> bool {
        VAN < self.length && !self.is_large()
    }

    /// Whether it is a bus or a truck, or a unit of one.
    pub fn is_large(&self) -> bool {
        LARGE < self.width
    }

    /// The vehicle in the mirror image of its world.
    #[must_use]
    pub fn mirrored(&self) -> Vehicle {
        let [x, y] = self.position;
        Vehicle { position: [x, 0.0 - y], heading: 0.0 - self.heading, ..*self }
    }

    /// Its corners: front left, front right, rear right, rear left (m).
    pub fn corners(&self) -> [[f32; 2]; 4] {
        self.at([[0.5, 0.5], [0.5, -0.5], [-0.5, -0.5], [-0.5, 0.5]])
    }

    /// Points of it by parts of its length ahead of the middle and of its width to the left (m).
    pub fn at<const N: usize>(&self, parts: [[f32; 2]; N]) -> [[f32; 2]; N] {
        let along = Vec2::from_angle(self.heading);
        parts.map(|[ahead, left]| {
            let point = Vec2::from(self.position) + ahead * self.length * along + left * self.width * along.perp();
            point.to_array()
        })
    }
}
