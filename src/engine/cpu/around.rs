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
use crate::traffic::{self, Car, Kind, Network, Stretch, outlines, stretched};
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

/// What the row's truck observes of other vehicles; none where the world's trucks do not.
pub fn around(world: &World, row: &Row) -> Option<[f32; N_AROUND]> {
    let shared = world.traffic.as_ref().filter(|shared| shared.is_observed)?;
    let cars = &traffic::Row::of(row.cars.as_ref()?).cars;
    let (truck, rig) = (&row.truck, world.rig(row.truck));
    let network = &shared.road(world, truck.route).network;
    let cars = cars.iter().filter(|car| car.is_there()).map(|car| Other::car(network, car));
    let others = row.mates.iter().filter(|mate| mate.is_there() && mate.env != row.env);
    let others = others.map(|mate| Other::truck(world, shared, mate));
    let mut seen = [const { None }; N_OTHERS];
    cars.chain(others).zip(&mut seen).for_each(|(other, place)| *place = Some(other));
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
    Some(observing.of(&seen))
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
    /// The ground that it covers; most cars are one unit.
    units: [Option<Outline>; 2],
    /// Whether it is no truck of the group.
    is_car: bool,
}

impl Other {
    fn car(network: &Network, car: &Car) -> Other {
        let mut units = car.outlines(network);
        Other {
            path: car.path(),
            station: car.station(),
            speed: car.speed(),
            length: car.length(),
            units: [units.next(), units.next()],
            is_car: true,
        }
    }

    fn truck(world: &World, shared: &Traffic, mate: &Mate) -> Other {
        let rig = world.rig(&mate.truck);
        Other {
            path: shared.routes[mate.truck.route as usize].path as usize,
            station: metres(length(front_station(world, shared, &mate.truck, mate.progress.waypoint))),
            speed: mate.truck.speed,
            length: metres(stretched(rig)),
            units: outlines(rig, &mate.truck).map(Some),
            is_car: false,
        }
    }

    fn units(&self) -> impl Iterator<Item = &Outline> {
        self.units.iter().flatten()
    }

    /// Unit vector along it, along the tractor of a truck.
    fn along(&self) -> Vec2 {
        self.units().next().map_or(Vec2::ZERO, |unit| unit.along)
    }
}

/// Most vehicles around a truck, and most units of them: other trucks have two.
const N_OTHERS: usize = N_CARS + MOST_IN_GROUP - 1;
const N_UNITS: usize = 2 * N_OTHERS;

/// The vehicles around a truck.
type Others = [Option<Other>; N_OTHERS];

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
    /// What it observes of these vehicles.
    fn of(&self, others: &Others) -> [f32; N_AROUND] {
        let mut seen = [1.0; N_AROUND];
        self.write_entry(others, &mut seen);
        let line = self.network.paths[self.path].line();
        seen[LINE_AT] = ((line - self.front) / GAP_SCALE).clamp(0.0, 1.0);
        seen[HAS_ENTERED_AT] = f32::from(line < self.front);
        if let Some((gap, other)) = self.gap(others) {
            let ahead = self.network.pose(self.path, self.front + gap).1;
            let along = other.along().dot(ahead);
            seen[GAP_AT] = (gap / GAP_SCALE).min(1.0);
            seen[GAP_SPEED_AT] = (other.speed * along / VEHICLE_SPEED_SCALE).clamp(-1.0, 1.0);
        }
        for (unit, room) in self.units.iter().zip(&mut seen[ROOM_AT..]) {
            let rooms = others.iter().flatten().flat_map(Other::units).map(|outline| room_between(unit, outline));
            *room = rooms.fold(ROOM_SCALE, f32::min) / ROOM_SCALE;
        }
        self.write_nearest(others, &mut seen[NEAREST_AT..]);
        seen
    }

    /// The zones of the truck's path with that of another vehicle.
    fn zones(&self, other: &Other) -> impl Iterator<Item = Meeting> {
        self.network.zones_of(self.path, other.path).iter().map(|zone| {
            let Stretch { a_in, a_out, b_in, b_out, delta, kind, .. } = zone.stretch();
            Meeting { own: [a_in, a_out].map(metres), its: [b_in, b_out].map(metres), delta: metres(delta), kind }
        })
    }

    /// Writes the first vehicle that comes to the entry, by lane.
    fn write_entry(&self, others: &Others, seen: &mut [f32; N_AROUND]) {
        let line = self.network.paths[self.path].line();
        let mut first: [Option<Coming>; 2] = [None; 2];
        for other in others.iter().flatten() {
            let &Other { station, speed, length, .. } = other;
            let its_line = self.network.paths[other.path].line();
            let waits = station + speed * speed / STILL_STOPS_WITH <= its_line;
            let is_beside = |kind: Kind| matches!(kind, Kind::Soft | Kind::Wide);
            let is_of_entry =
                |zone: &Meeting| zone.own[0] <= line + ENTRY_REACH && (is_beside(zone.kind) || line < zone.own[0]);
            let touches = self.zones(other).any(|zone| is_of_entry(&zone) && zone.kind != Kind::Wide);
            for Meeting { own, its, kind, .. } in self.zones(other).filter(is_of_entry) {
                // A car that runs together with the truck leads it once it is through.
                let end = if kind == Kind::Follow { its[0] } else { its[1] };
                let has_left = own[1] < self.front - self.length || end < station - length;
                if has_left || (waits && its_line < its[0]) || (touches && kind == Kind::Wide) {
                    continue;
                }
                let speed = speed.max(LEAST_COMING_SPEED);
                let distance = (its[0] - station).max(0.0);
                let gone = (end + length - station) / speed;
                let coming = Coming { arrival: distance / speed, distance, gone };
                let lane = &mut first[usize::from(is_beside(kind) || line + NEAREST_LANE < own[0])];
                *lane = Some(lane.map_or(coming, |known| known.first(coming)));
            }
        }
        for (lane, coming) in first.iter().enumerate() {
            let Some(Coming { arrival, distance, gone }) = *coming else { continue };
            seen[ARRIVAL_AT + lane] = (arrival / TIME_SCALE).min(1.0);
            seen[DISTANCE_AT + lane] = (distance / GAP_SCALE).min(1.0);
            seen[GONE_AT + lane] = (gone / TIME_SCALE).min(1.0);
        }
    }

    /// Distance to what is next on the truck's path (m), and what it is.
    fn gap<'o>(&self, others: &'o Others) -> Option<(f32, &'o Other)> {
        let mut least: Option<(f32, &Other)> = None;
        for other in others.iter().flatten() {
            let (station, rear) = (other.station, other.station - other.length);
            for Meeting { own, its, delta, kind } in self.zones(other) {
                if its[1] <= rear || station <= its[0] {
                    continue;
                }
                let gap = match kind {
                    Kind::Follow if self.front < station - delta => (rear - delta).max(own[0]) - self.front,
                    Kind::Cross if self.front < own[1] => own[0] - self.front,
                    _ => continue,
                };
                let gap = gap.max(0.0);
                if least.is_none_or(|(known, _)| gap < known) {
                    least = Some((gap, other));
                }
            }
        }
        least
    }

    /// Writes the vehicles nearest to either unit.
    fn write_nearest(&self, others: &Others, seen: &mut [f32]) {
        let distance = |outline: &Outline| {
            self.units.iter().map(|unit| unit.distance_squared(outline.middle)).fold(f32::INFINITY, f32::min).sqrt()
        };
        // Trailers of cars stand behind all other units.
        let number = |index: usize, unit: usize, other: &Other| {
            2 * index + unit + if other.is_car && unit == 1 { N_UNITS } else { 0 }
        };
        let of_other = |(index, other)| {
            let numbered = Other::units(other).enumerate();
            numbered.map(move |(unit, outline)| (number(index, unit, other), outline, other.speed))
        };
        let units = others.iter().flatten().enumerate().flat_map(of_other);
        let mut near = [None; N_UNITS];
        for ((number, unit, speed), place) in units.zip(&mut near) {
            *place = Some((distance(unit), number, unit, speed)).filter(|&(distance, ..)| distance < NEAR_SCALE);
        }
        // Of two that are as near the one in the lower slot is first.
        near.sort_unstable_by(|a, b| match (a, b) {
            (Some(a), Some(b)) => a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)),
            _ => a.is_none().cmp(&b.is_none()),
        });
        seen.fill(0.0);
        for (rank, &(_, _, outline, speed)) in near.iter().flatten().take(N_NEAREST).enumerate() {
            let to = (outline.middle - self.origin) / NEAR_SCALE;
            let velocity = speed / VEHICLE_SPEED_SCALE * outline.along;
            let in_frame = |vector: Vec2| [vector.dot(self.along), self.along.perp_dot(vector)];
            let ([ahead, left], [speed_ahead, speed_left]) = (in_frame(to), in_frame(velocity));
            for (group, value) in [1.0, ahead, left, speed_ahead, speed_left].into_iter().enumerate() {
                seen[group * N_NEAREST + rank] = value.clamp(-1.0, 1.0);
            }
        }
    }
}

/// Distance between two rectangles, at most [`ROOM_SCALE`]: that of the corners of each from the other (m).
fn room_between(one: &Outline, other: &Outline) -> f32 {
    let reach = |outline: &Outline| outline.half_length + outline.half_width;
    if ROOM_SCALE + reach(one) + reach(other) < one.middle.distance(other.middle) {
        return ROOM_SCALE;
    }
    if one.overlaps(other) {
        return 0.0;
    }
    let corners = |outline: &Outline| {
        let (along, across) = (outline.half_length * outline.along, outline.half_width * outline.along.perp());
        [along + across, along - across, -along + across, -along - across].map(|corner| outline.middle + corner)
    };
    let from = |corners: [Vec2; 4], outline: &Outline| corners.map(|corner| outline.distance_squared(corner).sqrt());
    [from(corners(one), other), from(corners(other), one)].into_iter().flatten().fold(ROOM_SCALE, f32::min)
}

#[cfg(test)]
mod tests;
