//! Cars come, wait outside until there is room, and leave at the end of their path.

use super::car::style;
use super::clock::{Clock, unit};
use super::rules::Rules;
use super::{Car, Demand, Network};

/// Bits of the backlog for each source: so many cars wait outside at most, and further ones stay away.
const BACKLOG_BITS: u32 = 4;
const MOST_WAITING: u64 = (1 << BACKLOG_BITS) - 1;
/// A car enters with at least so much room before it (m).
const ROOM: f32 = 3.0;
/// Twice the braking with which it could stop behind the one before it (m/s²).
const STOPS_WITH: f32 = 3.0;
/// Its time headway at least (s).
const HEADWAY: f32 = 0.8;

/// What happened outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// A car came to a source; it waits there until there is room.
    Came(usize),
    /// A car came to a source with a full backlog, and stays away.
    Stayed(usize),
    /// The car that waits longest at a source entered into a slot.
    Entered(usize, usize),
    /// The car of a slot has driven its path to the end; it is gone after this.
    Left(usize),
}

/// The number of cars that wait outside at a source.
pub(super) fn waiting(backlog: u64, source: usize) -> u64 {
    (backlog >> (BACKLOG_BITS * source as u32)) & MOST_WAITING
}

fn one(source: usize) -> u64 {
    1 << (BACKLOG_BITS * source as u32)
}

/// Sources with a full backlog have it whatever enters.
pub(super) fn filled(backlog: u64, source: usize) -> u64 {
    backlog | (MOST_WAITING * one(source))
}

/// Takes out cars at the ends of their paths, and lets in those that come. Slots are filled in their order.
pub(super) fn exchange(
    network: &Network,
    rules: &Rules,
    demand: &Demand,
    clock: Clock,
    cars: &mut [Car],
    backlog: &mut u64,
    tell: &mut impl FnMut(Event, &[Car]),
) {
    for slot in 0..cars.len() {
        let car = cars[slot];
        if car.is_there() && network.paths[car.path()].length <= car.station {
            tell(Event::Left(slot), cars);
            cars[slot] = Car::NONE;
        }
    }
    // One draw for all sources: their rates are exact, and at most one car comes in a step.
    let drawn = unit(clock.arrival());
    if let Some(source) = demand.arrivals.iter().position(|&until| drawn < until) {
        let has_room = waiting(*backlog, source) < MOST_WAITING;
        *backlog += if has_room { one(source) } else { 0 };
        tell(if has_room { Event::Came(source) } else { Event::Stayed(source) }, cars);
    }
    for source in 0..network.sources.len() {
        if waiting(*backlog, source) == 0 {
            continue;
        }
        let Some(slot) = cars.iter().position(|car| !car.is_there()) else { return };
        let Some(car) = entering(network, rules, demand, clock, cars, source) else { continue };
        cars[slot] = car;
        *backlog -= one(source);
        tell(Event::Entered(source, slot), cars);
    }
}

/// The next car of a source, if there is room for it.
fn entering(
    network: &Network,
    rules: &Rules,
    demand: &Demand,
    clock: Clock,
    cars: &[Car],
    source: usize,
) -> Option<Car> {
    let [drawn, kind, driver, _] = clock.entering(source);
    let paths = network.paths_of(source);
    let last = paths.end - 1;
    let path = paths.clone().find(|&path| unit(drawn) < demand.shares[path]).unwrap_or(last);
    let car = Car::entering(path, style([kind, driver], &demand.mix), 0.0);
    let ahead = cars.iter().filter(|other| other.is_there() && paths.contains(&other.path()));
    let (room, speed) = ahead
        .map(|other| (other.station - other.length() - car.station, other.speed))
        .fold((f32::INFINITY, 0.0), |nearest, other| if other.0 < nearest.0 { other } else { nearest });
    if room < ROOM {
        return None;
    }
    let room = room - rules.gap;
    let limit = network.limit(path, car.station);
    Some(Car { speed: limit.min((speed * speed + STOPS_WITH * room).sqrt()).min(room / HEADWAY), ..car })
}
