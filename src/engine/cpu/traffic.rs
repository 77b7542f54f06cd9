//! Other vehicles: each decides from where all were after the last step, all move, some leave and some come.

use crate::engine::cpu::follow::{followed, reference_point};
use crate::engine::{Mate, Row};
use crate::layout::random::{self, Draw};
use crate::layout::shared::constants;
use crate::layout::{MOST_IN_GROUP, Progress, Stream, Truck};
use crate::traffic::car::Outline;
use crate::traffic::{
    self, Car, Clock, Contact, ENTERED_BEFORE, Entry, Event, Met, Setting, Trucks, View, outlines, touched, touched_by,
};
use crate::world::{Level, Traffic, TrafficRoad, TrafficRoute, World};

constants! {
    /// What a vehicle may brake with for a truck that is in nobody's way (m/s²).
    const GENTLE: f32 = 2.0;
    /// Room to other vehicles before and behind each unit that a truck begins with (m).
    const ROOM_ALONG: f32 = 7.0;
    /// Room beside each unit (m).
    const ROOM_BESIDE: f32 = 1.0;
    /// Twice the braking with which a truck that begins can stop behind a vehicle (m/s²).
    const STOPS_BEHIND_WITH: f32 = 3.0;
}

/// Moves the vehicles around the row's truck, if the world has any.
pub fn traffic(world: &World, row: &mut Row) {
    let (Some(shared), Some(words)) = (&world.traffic, &mut row.cars) else { return };
    let around = traffic::Row::of_mut(words);
    let TrafficRoad { network, levels } = shared.road(world, row.truck.route);
    let own = view(world, shared, row.truck, row.progress);
    if !own.waits && around.entered == 0 {
        let steps = row.truck.steps;
        around.entered = if steps == 0 { ENTERED_BEFORE } else { steps + 1 };
    }
    let setting = Setting { network, rules: &shared.rules, demand: &levels[around.level as usize].demand };
    // The trucks of a group in their order, so that each finds the same of the vehicles.
    let there = row.mates.iter().filter(|mate| mate.is_there());
    let place = there.clone().position(|mate| mate.env == row.env).unwrap_or_default();
    let mut of_group = [const { None }; MOST_IN_GROUP];
    for (mate, seen) in there.zip(&mut of_group) {
        let is_own = mate.env == row.env;
        *seen = Some(if is_own { own } else { view(world, shared, &mate.truck, &mate.progress) });
    }
    let of_one = [Some(own)];
    let views = if row.mates.is_empty() { &of_one[..] } else { &of_group };
    let trucks = Trucks::new(network, views, place, around.hindered);
    let stream = stream_of_vehicles(row.stream, row.mates);
    let Stream { seed, env } = stream;
    let clock = Clock { seed, env, episode: row.truck.episode, step: row.truck.steps };
    let mut came = 0u32;
    let mut tell = |event, _: &[Car]| {
        if let Event::Entered(_, slot) = event {
            came |= 1 << slot;
        }
    };
    traffic::step(setting, clock, &mut around.cars, &mut around.backlog, &trucks, &mut tell);
    if came != 0 {
        let drivers = Drivers::drawn(shared, stream, row.truck.episode);
        let slots = (0..around.cars.len()).filter(|slot| came & 1 << slot != 0);
        slots.for_each(|slot| drivers.sit_in(&mut around.cars[slot], row.truck.steps + 1, slot));
    }
    // A slot's next car has yet to be hindered.
    let there = (0..around.cars.len()).filter(|&slot| around.cars[slot].is_there());
    around.hindered = trucks.hindered() & !came & there.fold(0, |bits, slot| bits | 1 << slot);
}

/// What the vehicles around a truck are drawn from: the stream of the first truck of its group.
fn stream_of_vehicles(own: Stream, mates: &[Mate]) -> Stream {
    mates.first().map_or(own, |mate| mate.stream)
}

/// A truck as the vehicles around it see it, if the world has any.
pub fn seen_by_vehicles(world: &World, truck: &Truck, progress: &Progress) -> Option<View> {
    world.traffic.as_ref().map(|shared| view(world, shared, truck, progress))
}

fn view(world: &World, shared: &Traffic, truck: &Truck, progress: &Progress) -> View {
    let network = &shared.road(world, truck.route).network;
    let path = shared.routes[truck.route as usize].path as usize;
    View::new(network, world.rig(truck), truck, path, front_station(world, shared, truck, progress.waypoint))
}

/// Station of a truck's front on its path, by the next waypoint of its route; negative before the path's beginning (m).
pub(super) fn front_station(world: &World, shared: &Traffic, truck: &Truck, next: u32) -> f32 {
    let begins = shared.routes[truck.route as usize].begins;
    let rig = world.rig(truck);
    let waypoints = world.route_waypoints(truck.route);
    let point = reference_point(rig.wheelbase, truck);
    // Whether this step's waypoints have been counted or not: passed ones stay so.
    let next = followed(waypoints, point, next, world.params.stray_distance).waypoint as usize;
    let last = next.clamp(1, waypoints.len() - 1) - 1;
    let behind_last = (point - waypoints[last].position).dot(waypoints[last].direction);
    let ahead = rig.tractor_body.front - 0.5 * rig.wheelbase;
    begins + last as f32 * shared.spacing + behind_last + ahead
}

/// Writes down which vehicle the row's truck touches, if the world has any.
pub fn meet(world: &World, row: &mut Row) {
    let (Some(shared), Some(words)) = (&world.traffic, &mut row.cars) else { return };
    let around = traffic::Row::of_mut(words);
    let network = &shared.road(world, row.truck.route).network;
    let TrafficRoute { path, .. } = shared.routes[row.truck.route as usize];
    let step = row.truck.steps + 1;
    let entry = |entered: u32, path: u32| Entry {
        arm: network.source_of(path as usize).entry,
        steps: (entered != 0).then(|| step.wrapping_sub(entered)),
    };
    let own = Met { rig: world.rig(row.truck), truck: row.truck, entry: entry(around.entered, path) };
    let others = row.mates.iter().enumerate().filter(|(_, mate)| mate.is_there() && mate.env != row.env);
    let with_others = others.filter_map(|(index, mate)| {
        let path = shared.routes[mate.truck.route as usize].path;
        let its = Met { rig: world.rig(&mate.truck), truck: &mate.truck, entry: entry(mate.entered, path) };
        touched_by(&own, &its, index)
    });
    let contact = touched(network, &own, &around.cars).into_iter().chain(with_others).min_by_key(Contact::order);
    around.met = contact.map_or(0, Contact::code);
}

/// Reward for the vehicles that drive and brake for the row's truck, if the world has any.
pub fn hindrance(world: &World, row: &Row) -> Option<f32> {
    let (shared, words) = (world.traffic.as_ref()?, row.cars.as_deref()?);
    let around = traffic::Row::of(words);
    let brakes = |(slot, car): (usize, &Car)| {
        let is_hindered = around.hindered >> slot & 1 == 1;
        // One that stands keeps its deceleration, and does not brake.
        if is_hindered && 0 < car.speed { (-car.acceleration() - GENTLE).max(0.0) } else { 0.0 }
    };
    Some(shared.hindrance * around.cars.iter().enumerate().map(brakes).sum::<f32>())
}

/// Who drives the vehicles of an episode.
struct Drivers {
    /// Fraction of rude ones (2^-16).
    rude: u32,
    key: u32,
}

impl Drivers {
    fn drawn(shared: &Traffic, stream: Stream, episode: u32) -> Drivers {
        let [_, _, rude, key] = drawn(stream, episode);
        let [least, greatest] = shared.rude;
        // Of 16 bits each: the product fits in a word.
        Drivers { rude: least + (((greatest - least) * (rude >> 16)) >> 16), key }
    }

    /// Has a vehicle, that entered a slot after so many steps of the episode, driven by a rude one or not.
    fn sit_in(&self, car: &mut Car, step: u32, slot: usize) {
        let [word, ..] = random::words(self.key, step, slot as u32, Draw::Traffic as u32);
        *car = car.driven(word >> 16 < self.rude);
    }
}

/// What an episode draws of the vehicles: demand, snapshot, fraction of rude drivers, and the key of who is one.
fn drawn(Stream { seed, env }: Stream, episode: u32) -> [u32; 4] {
    random::words(seed, env, episode, Draw::Traffic as u32)
}

/// Puts the vehicles of a snapshot around a truck that begins an episode, if the world has any, but for those that are
/// too near to it or to another one of its group.
pub fn surround(world: &World, row: &mut Row) {
    let (Some(shared), Some(words)) = (&world.traffic, &mut row.cars) else { return };
    let stream = stream_of_vehicles(row.stream, row.mates);
    let mut around = surroundings(shared.road(world, row.truck.route), shared, stream, row.truck.episode);
    if row.mates.is_empty() {
        clear(world, shared, row.truck, row.progress, &mut around);
    }
    row.mates.iter().for_each(|mate| clear(world, shared, &mate.truck, &mate.progress, &mut around));
    *traffic::Row::of_mut(words) = around;
}

/// The vehicles of a snapshot of a road, as an episode draws it.
fn surroundings(road: &TrafficRoad, shared: &Traffic, stream: Stream, episode: u32) -> traffic::Row {
    let [level, snapshot, ..] = drawn(stream, episode);
    let level = random::index_below(level, road.levels.len() as u32);
    let Level { snapshots, .. } = &road.levels[level as usize];
    let mut row = snapshots[random::index_below(snapshot, snapshots.len() as u32) as usize];
    row.level = level;
    let drivers = Drivers::drawn(shared, stream, episode);
    for (slot, car) in row.cars.iter_mut().enumerate().filter(|(_, car)| car.is_there()) {
        drivers.sit_in(car, 0, slot);
    }
    row
}

/// Takes away what is too near to a truck that begins.
fn clear(world: &World, shared: &Traffic, truck: &Truck, progress: &Progress, row: &mut traffic::Row) {
    let road = shared.road(world, truck.route);
    let grown = |unit: Outline| Outline {
        half_length: unit.half_length + ROOM_ALONG,
        half_width: unit.half_width + ROOM_BESIDE,
        ..unit
    };
    let units = outlines(world.rig(truck), truck).map(grown);
    let source = road.network.paths[shared.routes[truck.route as usize].path as usize].source;
    let front = front_station(world, shared, truck, progress.waypoint);
    // A truck could not stop behind it.
    let is_too_near_ahead = |car: &Car| {
        let room = car.station() - car.length() - front;
        let stops = ((truck.speed * truck.speed - car.speed() * car.speed()) / STOPS_BEHIND_WITH).max(0.0);
        road.network.paths[car.path()].source == source && 0.0 <= room && room < ROOM_ALONG + stops
    };
    for car in row.cars.iter_mut().filter(|car| car.is_there()) {
        let is_beside = |car: &Car| car.outlines(&road.network).any(|its| units.iter().any(|unit| unit.overlaps(&its)));
        if is_too_near_ahead(car) || is_beside(car) {
            *car = Car::NONE;
        }
    }
}
