//! Writes what is observed of other vehicles: 42 values, see [`VEHICLE_VALUES`](crate::layout::VEHICLE_VALUES).
//!
//! What comes to the own entry, and what is ahead, follow from the zones in which the truck's path meets those of the
//! others, so that one number says what a driver would look for along several lanes. Every value is a least one or one
//! in the order of distances, so the slots in which vehicles stand change none of them.

use glam::Vec2;

use super::traffic::front_station;
use crate::engine::{Mate, Row};
use crate::layout::angle::direction;
use crate::layout::shared::constants;
use crate::layout::{MOST_IN_GROUP, N_AROUND, N_CARS, N_NEAREST, first_of_vehicles};
use crate::traffic::car::Outline;
use crate::traffic::units::{length, metres};
use crate::traffic::{self, Car, Kind, Network, Stretch, Zone, may_be_within, outlines, stretched};
use crate::world::{Traffic, World};

constants! {
    /// Time that is observed as 1 (s).
    const TIME_SCALE: f32 = 10.0;
    /// Distance along a path that is observed as 1 (m).
    const GAP_SCALE: f32 = 50.0;
    /// Speed of a vehicle that is observed as 1 (m/s).
    const VEHICLE_SPEED_SCALE: f32 = 15.0;
    /// Distance to a unit that is observed as 1 (m).
    const ROOM_SCALE: f32 = 20.0;
    /// Distance from a unit within which vehicles are observed one by one, and which is observed as 1 (m).
    const NEAR_SCALE: f32 = 60.0;
    /// Zones that begin so far behind the line are those of the entry (m).
    const ENTRY_REACH: f32 = 12.0;
    /// Those that begin so far behind it are on the nearest lane (m).
    const NEAREST_LANE: f32 = 3.0;
    /// Least speed in a time to a zone (m/s).
    const LEAST_COMING_SPEED: f32 = 4.0;
    /// Twice the braking with which a vehicle still stops before its line (m/s^2).
    const STILL_STOPS_WITH: f32 = 8.0;
    /// Index of the times until vehicles are at the entry.
    const ARRIVAL_AT: usize = first_of_vehicles("entry_arrival");
    /// Index of their distances.
    const DISTANCE_AT: usize = first_of_vehicles("entry_distance");
    /// Index of the times until they have left it.
    const GONE_AT: usize = first_of_vehicles("entry_gone");
    /// Index of the distance from the line.
    const LINE_AT: usize = first_of_vehicles("line_distance");
    /// Index of whether the front is beyond it.
    const HAS_ENTERED_AT: usize = first_of_vehicles("has_entered");
    /// Index of the gap.
    const GAP_AT: usize = first_of_vehicles("gap");
    /// Index of the speed beyond the gap.
    const GAP_SPEED_AT: usize = first_of_vehicles("gap_speed");
    /// Index of the room of both units.
    const ROOM_AT: usize = first_of_vehicles("tractor_room");
    /// Index of whether there are nearest vehicles.
    const NEAREST_AT: usize = first_of_vehicles("vehicle");
}

/// Added to a bound, so that what it leaves out is left out by real numbers too (m).
const SURELY: f32 = 0.01;

/// What the row's truck observes of other vehicles; none where the world's trucks do not.
pub fn around(world: &World, row: &Row) -> Option<[f32; N_AROUND]> {
    let shared = world.traffic.as_ref().filter(|shared| shared.is_observed)?;
    let cars = &traffic::Row::of(row.cars.as_ref()?).cars;
    let (truck, rig) = (&row.truck, world.rig(row.truck));
    let network = &shared.road(world, truck.route).network;
    let observing = Observing {
        network,
        path: shared.routes[truck.route as usize].path as usize,
        // As vehicles see it.
        front: metres(length(front_station(world, shared, truck, row.progress.waypoint))),
        length: metres(stretched(rig)),
        units: outlines(rig, truck),
        origin: truck.position,
        along: direction(truck.heading),
    };
    let others = row.mates.iter().filter(|mate| mate.is_there() && mate.env != row.env);
    let others = others.map(|mate| Other::truck(world, shared, mate));
    let mut seen = [const { None }; N_OTHERS];
    let places = observing.cars(cars).chain(others).zip(&mut seen);
    let n = places.map(|(other, place)| *place = Some(other)).count();
    Some(observing.of(&seen[..n]))
}

/// Another vehicle: a car, or a truck of the same group.
struct Other {
    path: usize,
    /// Station of its front (m).
    station: f32,
    /// Its speed (m/s).
    speed: f32,
    /// Its length (m).
    length: f32,
    /// The ground that it covers; most cars are one unit. None of a car that is too far away to be observed one by one.
    units: [Option<Outline>; 2],
    /// The car, if it is no truck of the group.
    car: Option<Car>,
}

impl Other {
    fn truck(world: &World, shared: &Traffic, mate: &Mate) -> Other {
        let rig = world.rig(&mate.truck);
        Other {
            path: shared.routes[mate.truck.route as usize].path as usize,
            station: metres(length(front_station(world, shared, &mate.truck, mate.progress.waypoint))),
            speed: mate.truck.speed,
            length: metres(stretched(rig)),
            units: outlines(rig, &mate.truck).map(Some),
            car: None,
        }
    }

    fn units(&self) -> impl Iterator<Item = &Outline> {
        self.units.iter().flatten()
    }

    /// Unit vector along it, along the tractor of a truck.
    fn along(&self, network: &Network) -> Vec2 {
        let of_car = || self.car.and_then(|car| car.outlines(network).next());
        self.units().next().copied().or_else(of_car).map_or(Vec2::ZERO, |unit| unit.along)
    }
}

/// Most vehicles around a truck, and most units of them: other trucks have two.
const N_OTHERS: usize = N_CARS + MOST_IN_GROUP - 1;
const N_UNITS: usize = 2 * N_OTHERS;

/// The vehicles around a truck.
type Others = [Option<Other>];

/// A zone of the truck's path with that of a car, in metres.
struct Meeting {
    /// Where it begins and ends on the truck's path.
    own: [f32; 2],
    /// Where it begins and ends on the car's.
    its: [f32; 2],
    /// Station on the car's path less that on the truck's.
    delta: f32,
    kind: Kind,
}

impl Meeting {
    fn of(zone: &Zone) -> Meeting {
        let Stretch { a_in, a_out, b_in, b_out, delta, kind, .. } = zone.stretch();
        Meeting { own: [a_in, a_out].map(metres), its: [b_in, b_out].map(metres), delta: metres(delta), kind }
    }

    /// Whether vehicles pass beside each other there.
    fn is_beside(&self) -> bool {
        matches!(self.kind, Kind::Soft | Kind::Wide)
    }
}

/// A unit of another vehicle near the truck.
#[derive(Clone, Copy)]
struct Near<'a> {
    /// Distance from the nearer of the truck's units (m).
    distance: f32,
    /// Of two that are as near the one of the lower number is first.
    number: usize,
    unit: &'a Outline,
    /// Speed of the vehicle (m/s).
    speed: f32,
}

impl Near<'_> {
    fn is_before(&self, other: &Near) -> bool {
        self.distance.total_cmp(&other.distance).then(self.number.cmp(&other.number)).is_lt()
    }
}

/// A vehicle that comes to the entry.
#[derive(Clone, Copy)]
struct Coming {
    /// Time until it is there (s).
    arrival: f32,
    /// Distance that it has to go (m).
    distance: f32,
    /// Time until it has left (s).
    gone: f32,
}

impl Coming {
    /// The one of two that is there first; of two that are there together, the one that takes longer to leave.
    fn first(self, other: Coming) -> Coming {
        let order = self.arrival.total_cmp(&other.arrival).then(other.gone.total_cmp(&self.gone));
        if order.then(self.distance.total_cmp(&other.distance)).is_le() { self } else { other }
    }
}

/// A truck that looks around: where it is on its path, and on the ground.
struct Observing<'a> {
    network: &'a Network,
    path: usize,
    /// Station of its front (m).
    front: f32,
    /// Length of both units (m).
    length: f32,
    /// The ground that tractor and trailer cover.
    units: [Outline; 2],
    /// Middle of the drive axle (m).
    origin: Vec2,
    /// Unit vector along the tractor.
    along: Vec2,
}

impl Observing<'_> {
    /// The cars of a row, as they are observed.
    fn cars(&self, cars: &[Car]) -> impl Iterator<Item = Other> {
        let is_near = may_be_within(self.network, &self.units, NEAR_SCALE);
        cars.iter().filter(|car| car.is_there()).map(move |car| Other {
            path: car.path(),
            station: car.station(),
            speed: car.speed(),
            length: car.length(),
            units: if is_near(car) { car.units(self.network) } else { [None; 2] },
            car: Some(*car),
        })
    }

    /// What it observes of these vehicles.
    fn of(&self, others: &Others) -> [f32; N_AROUND] {
        let mut seen = [1.0; N_AROUND];
        let line = self.network.paths[self.path].line();
        seen[LINE_AT] = ((line - self.front) / GAP_SCALE).clamp(0.0, 1.0);
        seen[HAS_ENTERED_AT] = f32::from(line < self.front);
        if let Some((gap, other)) = self.write_entry(others, &mut seen) {
            let ahead = self.network.pose(self.path, self.front + gap).1;
            let along = other.along(self.network).dot(ahead);
            seen[GAP_AT] = (gap / GAP_SCALE).min(1.0);
            seen[GAP_SPEED_AT] = (other.speed * along / VEHICLE_SPEED_SCALE).clamp(-1.0, 1.0);
        }
        self.write_near(others, &mut seen);
        seen
    }

    /// Writes the first vehicle that comes to the entry, by lane; returns the distance to what is next on the truck's
    /// path (m), and what it is.
    fn write_entry<'o>(&self, others: &'o Others, seen: &mut [f32; N_AROUND]) -> Option<(f32, &'o Other)> {
        let line = self.network.paths[self.path].line();
        let mut first: [Option<Coming>; 2] = [None; 2];
        let mut next: Option<(f32, &Other)> = None;
        for other in others.iter().flatten() {
            let its_line = self.network.paths[other.path].line();
            let waits = other.station + other.speed * other.speed / STILL_STOPS_WITH <= its_line;
            // Zones beside which only a truck yields stand behind those that others meet in.
            let mut meets_at_entry = false;
            for zone in self.network.zones_of(self.path, other.path) {
                let zone = Meeting::of(zone);
                if zone.own[0] <= line + ENTRY_REACH && (zone.is_beside() || line < zone.own[0]) {
                    let counts = zone.kind != Kind::Wide || !meets_at_entry;
                    meets_at_entry |= zone.kind != Kind::Wide;
                    let hinders = counts && !(waits && its_line < zone.its[0]);
                    if hinders && let Some(coming) = self.coming(&zone, other) {
                        let lane = &mut first[usize::from(zone.is_beside() || line + NEAREST_LANE < zone.own[0])];
                        *lane = Some(lane.map_or(coming, |known| known.first(coming)));
                    }
                }
                if let Some(gap) = self.gap(&zone, other)
                    && next.is_none_or(|(known, _)| gap < known)
                {
                    next = Some((gap, other));
                }
            }
        }
        for (lane, coming) in first.iter().enumerate() {
            let Some(Coming { arrival, distance, gone }) = *coming else { continue };
            seen[ARRIVAL_AT + lane] = (arrival / TIME_SCALE).min(1.0);
            seen[DISTANCE_AT + lane] = (distance / GAP_SCALE).min(1.0);
            seen[GONE_AT + lane] = (gone / TIME_SCALE).min(1.0);
        }
        next
    }

    /// When another vehicle is in a zone of the entry; none if it or the truck has left that.
    fn coming(&self, zone: &Meeting, other: &Other) -> Option<Coming> {
        let Meeting { own, its, kind, .. } = zone;
        let &Other { station, speed, length, .. } = other;
        // A car that runs together with the truck leads it once it is through.
        let end = if *kind == Kind::Follow { its[0] } else { its[1] };
        if own[1] < self.front - self.length || end < station - length {
            return None;
        }
        let speed = speed.max(LEAST_COMING_SPEED);
        let distance = (its[0] - station).max(0.0);
        Some(Coming { arrival: distance / speed, distance, gone: (end + length - station) / speed })
    }

    /// Distance to another vehicle that is in a zone ahead (m).
    fn gap(&self, zone: &Meeting, other: &Other) -> Option<f32> {
        let &Meeting { own, its, delta, kind } = zone;
        let (station, rear) = (other.station, other.station - other.length);
        if its[1] <= rear || station <= its[0] {
            return None;
        }
        let gap = match kind {
            Kind::Follow if self.front < station - delta => (rear - delta).max(own[0]) - self.front,
            Kind::Cross if self.front < own[1] => own[0] - self.front,
            _ => return None,
        };
        Some(gap.max(0.0))
    }

    /// Writes the room of either unit, and the units nearest to them.
    fn write_near(&self, others: &Others, seen: &mut [f32; N_AROUND]) {
        let mut rooms = [ROOM_SCALE; 2];
        let mut nearest: [Option<Near>; N_NEAREST] = [None; N_NEAREST];
        for (index, other) in others.iter().flatten().enumerate() {
            for (unit, outline) in other.units().enumerate() {
                let squared = self.units.each_ref().map(|own| own.distance_squared(outline.middle));
                for ((own, room), squared) in self.units.iter().zip(&mut rooms).zip(squared) {
                    let least = squared.sqrt() - (outline.half_length + outline.half_width) - SURELY;
                    if least < *room {
                        *room = room.min(room_between(own, outline));
                    }
                }
                let distance = squared.into_iter().fold(f32::INFINITY, f32::min).sqrt();
                if distance < NEAR_SCALE {
                    // Trailers of cars stand behind all other units.
                    let behind = if other.car.is_some() && unit == 1 { N_UNITS } else { 0 };
                    let near = Near { distance, number: 2 * index + unit + behind, unit: outline, speed: other.speed };
                    let is_behind = |known: &Option<Near>| known.is_none_or(|known| near.is_before(&known));
                    if let Some(place) = nearest.iter().position(is_behind) {
                        nearest[place..].rotate_right(1);
                        nearest[place] = Some(near);
                    }
                }
            }
        }
        for (value, room) in seen[ROOM_AT..].iter_mut().zip(rooms) {
            *value = room / ROOM_SCALE;
        }
        self.write_nearest(&nearest, &mut seen[NEAREST_AT..]);
    }

    /// Writes the vehicles nearest to either unit.
    fn write_nearest(&self, nearest: &[Option<Near>; N_NEAREST], seen: &mut [f32]) {
        seen.fill(0.0);
        for (rank, &Near { unit, speed, .. }) in nearest.iter().flatten().enumerate() {
            let to = (unit.middle - self.origin) / NEAR_SCALE;
            let velocity = speed / VEHICLE_SPEED_SCALE * unit.along;
            let in_frame = |vector: Vec2| [vector.dot(self.along), self.along.perp_dot(vector)];
            let ([ahead, left], [speed_ahead, speed_left]) = (in_frame(to), in_frame(velocity));
            for (group, value) in [1.0, ahead, left, speed_ahead, speed_left].into_iter().enumerate() {
                seen[group * N_NEAREST + rank] = value.clamp(-1.0, 1.0);
            }
        }
    }
}

/// Distance between two rectangles: that of the corners of each from the other (m).
fn room_between(one: &Outline, other: &Outline) -> f32 {
    if one.overlaps(other) {
        return 0.0;
    }
    let corners = |outline: &Outline| {
        let (along, across) = (outline.half_length * outline.along, outline.half_width * outline.along.perp());
        [along + across, along - across, -along + across, -along - across].map(|corner| outline.middle + corner)
    };
    let from = |corners: [Vec2; 4], outline: &Outline| corners.map(|corner| outline.distance_squared(corner));
    [from(corners(one), other), from(corners(other), one)].into_iter().flatten().fold(f32::INFINITY, f32::min).sqrt()
}

#[cfg(test)]
mod tests;
