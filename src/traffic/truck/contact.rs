//! Which car a truck touches, and whose fault it is.

use glam::Vec2;

use super::corridor::front;
use super::view::{outlines, yaw_rate};
use crate::layout::angle::{direction, sin_cos};
use crate::layout::shared::constants;
use crate::layout::{N_CARS, Rig, Truck};
use crate::traffic::car::Outline;
use crate::traffic::units::{length, speed};
use crate::traffic::{Car, Network};

constants! {
    /// Time before a contact at which it is asked where the truck was (s).
    const BEFORE_CONTACT: f32 = 1.0;
    /// A truck has entered lately if it did so within so many steps.
    const LATELY: u32 = 30;
    /// The step, plus 1, in which a truck entered that begins an episode beyond its line: not lately, in words that
    /// wrap.
    pub const ENTERED_BEFORE: u32 = 1u32.wrapping_sub(LATELY);
    /// A car has entered lately if it is not farther behind its line than it drives in this time, or than it comes in
    /// it from standing (2^-10 m).
    const FROM_STANDING: i32 = length(9.0);
    /// No part of a car is farther from the sample behind its front, and no corner of a unit from the end of its axis
    /// (m).
    const NEAR_CAR: f32 = 12.0;
    /// So much farther those of a large vehicle may be (m).
    pub(super) const LONGER_THAN_CAR: f32 = 12.0;
    /// Below this speed a car stands, and hits nobody (2^-14 m a step).
    const HITS_NOBODY: i32 = speed(0.05);

    /// Added to a contact's code where the truck is at fault: more than there are slots and trucks of a group.
    const TRUCKS_FAULT: u32 = 64;
}

/// A contact of a truck with a car, or with another truck of its group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Contact {
    /// The car's slot; behind those of cars the other truck's index in the group.
    pub slot: usize,
    /// Whether the truck is at fault, or the other.
    pub is_trucks_fault: bool,
}

impl Contact {
    /// Of several contacts the first in this order counts.
    pub fn order(&self) -> (bool, usize) {
        (!self.is_trucks_fault, self.slot)
    }

    /// The contact in a word: its slot plus 1, and 64 more where the truck is at fault.
    pub fn code(self) -> u32 {
        self.slot as u32 + 1 + if self.is_trucks_fault { TRUCKS_FAULT } else { 0 }
    }

    /// The contact of a word; none of 0.
    pub fn from_code(code: u32) -> Option<Contact> {
        let slot = (code % TRUCKS_FAULT).checked_sub(1)?;
        Some(Contact { slot: slot as usize, is_trucks_fault: TRUCKS_FAULT <= code })
    }
}

/// Where a truck has entered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry {
    /// Index of the arm.
    pub arm: u32,
    /// Steps since; none if it has not entered yet.
    pub steps: Option<u32>,
}

/// A truck that may be in a contact.
#[derive(Debug, Clone, Copy)]
pub struct Met<'a> {
    /// Its vehicle.
    pub rig: &'a Rig,
    /// Where it is.
    pub truck: &'a Truck,
    /// Where it has entered.
    pub entry: Entry,
}

/// The car that a truck touches, if there is one; of several the one of the lowest slot among those for which the truck
/// is at fault, or else among all.
pub fn touched(network: &Network, own: &Met, cars: &[Car]) -> Option<Contact> {
    let Met { rig, truck, entry } = own;
    let now = outlines(rig, truck);
    let is_near = may_be_within(network, &now, 0.0);
    let near = cars.iter().enumerate().filter(|(_, car)| car.is_there() && is_near(car));
    let contacts = near.filter_map(|(slot, car)| {
        let touches =
            |units: &[Outline; 2]| car.outlines(network).any(|its| units.iter().any(|unit| unit.overlaps(&its)));
        touches(&now).then(|| {
            let was_there = || touches(&outlines_before(rig, truck));
            Contact { slot, is_trucks_fault: !is_cars_fault(network, was_there, *entry, car) }
        })
    });
    contacts.min_by_key(Contact::order)
}

/// Whether a part of a car may be within a distance of a truck's units (m).
pub fn may_be_within(network: &Network, [tractor, trailer]: &[Outline; 2], distance: f32) -> impl Fn(&Car) -> bool {
    let middle = 0.5 * (tractor.middle + trailer.middle);
    let reach = 0.5 * tractor.middle.distance(trailer.middle) + tractor.half_length.max(trailer.half_length);
    let reach = reach + distance + NEAR_CAR;
    move |car| {
        let reach = reach + if car.is_large() { LONGER_THAN_CAR } else { 0.0 };
        front(network, car).distance_squared(middle) < reach * reach
    }
}

/// The contact of a truck with another one, which has an index in their group, if they touch. Each is judged as it is
/// with a car in the other's place: both may be at fault, or neither.
pub fn touched_by(own: &Met, other: &Met, index: usize) -> Option<Contact> {
    let [now, its] = [own, other].map(|met| outlines(met.rig, met.truck));
    let touch = |one: &[Outline; 2]| one.iter().any(|unit| its.iter().any(|other| unit.overlaps(other)));
    if !touch(&now) {
        return None;
    }
    let lately = |entry: &Entry| entry.steps.is_some_and(|steps| steps < LATELY);
    let cuts_in = own.entry.steps.is_some() && own.entry.arm != other.entry.arm && lately(&other.entry);
    let was_there = || touch(&outlines_before(own.rig, own.truck));
    let moves = HITS_NOBODY < speed(other.truck.speed);
    let is_its_fault = moves && !lately(&own.entry) && (cuts_in || was_there());
    Some(Contact { slot: N_CARS + index, is_trucks_fault: !is_its_fault })
}

/// Whether the car is at fault of a contact with a truck that was or was not where the car is a second ago.
///
/// Who moved in the last step tells nothing: in 0.1 s both do. A car is at fault if it moves, and either the truck was
/// there a second ago, or the car has entered lately before a truck that drives in the ring. A truck that has entered
/// lately itself is at fault in any case, and so it is otherwise.
fn is_cars_fault(network: &Network, was_there: impl FnOnce() -> bool, entry: Entry, car: &Car) -> bool {
    let has_entered_lately = entry.steps.is_some_and(|steps| steps < LATELY);
    let behind_line = car.front() - network.line_of(car)[0];
    // 2^-14 m a step for some steps.
    let lately = FROM_STANDING.max((LATELY.cast_signed() * car.pace()) >> 4);
    let cuts_in = entry.steps.is_some()
        && network.source_of(car.path()).entry != entry.arm
        && (1..=lately).contains(&behind_line);
    HITS_NOBODY < car.pace() && !has_entered_lately && (cuts_in || was_there())
}

/// The ground that both units covered a second ago, each driven back along its circle.
fn outlines_before(rig: &Rig, truck: &Truck) -> [Outline; 2] {
    let [tractor, trailer] = outlines(rig, truck);
    // At constant acceleration; a truck that stood did not drive backwards.
    let way = BEFORE_CONTACT * (truck.speed - 0.5 * BEFORE_CONTACT * truck.acceleration).max(0.0);
    let (sin, cos) = sin_cos(truck.heading - truck.trailer_heading);
    let turn = if truck.speed == 0.0 { 0.0 } else { way * yaw_rate(rig, truck) / truck.speed };
    let trailer_turn = (way * sin + rig.fifth_wheel * turn * cos) / rig.trailer_wheelbase;
    [
        driven_back(&tractor, truck.position, truck.heading, way, turn),
        driven_back(&trailer, truck.trailer_position(rig), truck.trailer_heading, way * cos, trailer_turn),
    ]
}

/// A unit before it drove this way and turned by this angle, its axle at a position (m, rad).
fn driven_back(unit: &Outline, axle: Vec2, heading: f32, way: f32, turn: f32) -> Outline {
    let along = direction(heading - turn);
    let ahead = (unit.middle - axle).dot(unit.along);
    let middle = axle - way * direction(heading - 0.5 * turn) + ahead * along;
    Outline { middle, along, ..*unit }
}
