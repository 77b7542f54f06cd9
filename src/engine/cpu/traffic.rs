//! Other vehicles: each decides from where all were after the last step, all move, some leave and some come.

use glam::Vec2;

use crate::engine::Row;
use crate::layout::angle::direction;
use crate::layout::random::{self, Draw};
use crate::layout::shared::constants;
use crate::layout::{Body, Rig, Stream, Truck};
use crate::traffic::car::Outline;
use crate::traffic::{self, Car, Clock, Nobody, Setting};
use crate::world::{Level, Traffic, TrafficRoad, World};

constants! {
    /// Room to other vehicles before and behind each unit that a truck begins with (m).
    const ROOM_ALONG: f32 = 7.0;
    /// Room beside each unit (m).
    const ROOM_BESIDE: f32 = 1.0;
}

/// Moves the vehicles around the row's truck, if the world has any.
pub fn traffic(world: &World, row: &mut Row) {
    let (Some(shared), Some(words)) = (&world.traffic, &mut row.cars) else { return };
    let around = traffic::Row::of_mut(words);
    let TrafficRoad { network, levels } = road_of(world, shared, row.truck.route);
    let Level { demand, .. } = &levels[around.level as usize];
    let Stream { seed, env } = row.stream;
    let clock = Clock { seed, env, episode: row.truck.episode, step: row.truck.steps };
    let setting = Setting { network, rules: &shared.rules, demand };
    traffic::step(setting, clock, &mut around.cars, &mut around.backlog, &Nobody, &mut |_, _| ());
}

fn road_of<'a>(world: &World, shared: &'a Traffic, route: u32) -> &'a TrafficRoad {
    &shared.roads[world.routes[route as usize].roundabout as usize]
}

/// Puts the vehicles of a snapshot around a truck that begins an episode, but for those that are too near to it.
pub fn surrounded(world: &World, shared: &Traffic, stream: Stream, truck: &Truck) -> traffic::Row {
    let Stream { seed, env } = stream;
    let road = road_of(world, shared, truck.route);
    let [level, snapshot, ..] = random::words(seed, env, truck.episode, Draw::Traffic as u32);
    let level = random::index_below(level, road.levels.len() as u32);
    let Level { snapshots, .. } = &road.levels[level as usize];
    let mut row = snapshots[random::index_below(snapshot, snapshots.len() as u32) as usize];
    row.level = level;
    let grown = |unit: Outline| Outline {
        half_length: unit.half_length + ROOM_ALONG,
        half_width: unit.half_width + ROOM_BESIDE,
        ..unit
    };
    let units = units(world.rig(truck), truck).map(grown);
    for car in row.cars.iter_mut().filter(|car| car.is_there()) {
        let outline = car.outline(&road.network);
        if units.iter().any(|unit| unit.overlaps(&outline)) {
            *car = Car::NONE;
        }
    }
    row
}

/// The ground that tractor and trailer cover.
pub fn units(rig: &Rig, truck: &Truck) -> [Outline; 2] {
    let outline = |body: &Body, position: Vec2, heading: f32| {
        let along = direction(heading);
        Outline {
            middle: position + 0.5 * (body.front + body.rear) * along,
            along,
            half_length: 0.5 * (body.front - body.rear),
            half_width: body.half_width,
        }
    };
    [
        outline(&rig.tractor_body, truck.position, truck.heading),
        outline(&rig.trailer_body, truck.trailer_position(rig), truck.trailer_heading),
    ]
}
