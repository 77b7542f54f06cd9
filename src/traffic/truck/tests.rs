//! What cars do about a truck, rule by rule, in situations that are made by hand.

mod contact;
mod corridor;
mod line;
mod view;

use bytemuck::Zeroable;
use glam::Vec2;

use super::{Trucks, View};
use crate::layout::{Body, Rig, Truck};
use crate::map::Road;
use crate::traffic::car::Outline;
use crate::traffic::clock::Clock;
use crate::traffic::step::{advance, decide};
use crate::traffic::units::speed;
use crate::traffic::{Car, Demand, Mix, Network, Nobody, Others, Rules, Setting};

const CLOCK: Clock = Clock { seed: 1, env: 0, episode: 0, step: 0 };

fn baked(name: &str) -> Network {
    Network::bake(&Road::named(name).unwrap()).unwrap()
}

/// The DAF XF of attard2023: what of it has to do with where it is.
fn rig() -> Rig {
    Rig {
        wheelbase: 3.543,
        fifth_wheel: 0.408,
        trailer_wheelbase: 7.756,
        tractor_body: Body { front: 4.906, rear: -0.958, half_width: 1.25 },
        trailer_body: Body { front: 9.846, rear: -3.864, half_width: 1.25 },
        ..Rig::zeroed()
    }
}

/// A truck on the centre line of a path, its front at a station (m), at a speed (m/s).
fn truck_at(network: &Network, path: usize, front: f32, speed: f32) -> Truck {
    let rig = rig();
    let axle = front - rig.tractor_body.front;
    let (position, along) = network.pose(path, axle);
    let behind = network.position(path, (axle - rig.trailer_wheelbase).max(0.0));
    let trailer = (position + rig.fifth_wheel * along - behind).normalize_or(along);
    Truck { position, heading: along.to_angle(), trailer_heading: trailer.to_angle(), speed, ..Truck::default() }
}

fn view_at(network: &Network, path: usize, front: f32, speed: f32) -> View {
    View::new(network, &rig(), &truck_at(network, path, front, speed), path, front)
}

/// A car with its front at a station (m), at a speed (m/s), driven by a rude driver or not.
fn car_at(path: usize, station: f32, v: f32, is_rude: bool) -> Car {
    let car = Car { station: (station * 1_048_576.0) as i32, ..Car::entering(path, 7, speed(v)) };
    car.driven(is_rude)
}

/// What the cars decide among these others (m/s²).
fn decided(network: &Network, cars: &[Car], others: &impl Others) -> Vec<f32> {
    let demand = Demand::new(network, &vec![0.0; network.paths.len()], Mix::default()).unwrap();
    let setting = Setting { network, rules: &Rules::FITTED, demand: &demand };
    // Every second slot decides in a step.
    let mut cars = cars.to_vec();
    for step in 0..2 {
        let mut all = cars.clone();
        decide(setting, Clock { step, ..CLOCK }, &mut all, others);
        for (slot, car) in all.iter().enumerate().filter(|&(slot, _)| (slot + step as usize).is_multiple_of(2)) {
            cars[slot].acceleration = car.acceleration;
        }
    }
    cars.iter().map(Car::acceleration).collect()
}

/// What a single car decides beside a truck, and alone (m/s²).
fn beside(network: &Network, view: View, car: Car) -> [f32; 2] {
    let views = [Some(view)];
    let trucks = Trucks::new(network, &views, 0, 0);
    [decided(network, &[car], &trucks)[0], decided(network, &[car], &Nobody)[0]]
}

/// Whether a car touches the truck's ground.
fn touches(network: &Network, view: &View, car: &Car) -> bool {
    car.outlines(network).any(|its| view.now.iter().any(|unit| unit.overlaps(&its)))
}

/// Drives a car for some steps beside a truck that stands; whether it never touched it, and the car then.
fn driven(network: &Network, view: View, mut car: Car, steps: u32) -> (bool, Car) {
    let demand = Demand::new(network, &vec![0.0; network.paths.len()], Mix::default()).unwrap();
    let setting = Setting { network, rules: &Rules::FITTED, demand: &demand };
    let views = [Some(view)];
    let trucks = Trucks::new(network, &views, 0, 0);
    let mut kept_clear = true;
    for step in 0..steps {
        let mut cars = [car];
        decide(setting, Clock { step, ..CLOCK }, &mut cars, &trucks);
        advance(&mut cars);
        [car] = cars;
        kept_clear &= !touches(network, &view, &car);
    }
    (kept_clear, car)
}

/// A truck moved aside, to the left of its heading (m).
fn aside(view: View, left: f32) -> View {
    let moved = |outline: Outline| {
        let by: Vec2 = left * outline.along.perp();
        Outline { middle: outline.middle + by, ..outline }
    };
    View { now: view.now.map(moved), later: view.later.map(moved), ..view }
}
