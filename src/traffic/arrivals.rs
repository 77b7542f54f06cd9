//! Cars come, wait outside until there is room, and leave at the end of their path.

use super::car::{large, style};
use super::clock::Clock;
use super::decide::MOST_CARS;
use super::model::{FASTEST, square};
use super::units::{BEYOND, FINER_SPEED, falls_below, length};
use super::{Car, Kind, Network, Others, Setting, Stretch, Zone};
use crate::layout::shared::constants;

constants! {
    /// Bits of the backlog for each source.
    const BACKLOG_BITS: usize = 4;
    /// Sources of a word of the backlog.
    const BACKLOG_SOURCES: usize = u32::BITS as usize / BACKLOG_BITS;
    /// So many cars wait outside at most, and further ones stay away.
    const MOST_WAITING: u32 = (1 << BACKLOG_BITS) - 1;
    /// A car enters with at least so much room before it (2^-10 m).
    const ENTRY_ROOM: i32 = length(3.0);
    /// Twice the braking with which it could stop behind the one before it (m/s²).
    const STOPS_WITH: i32 = 3;
    /// Steps of standing beyond the line after which a car is taken away where there may be large vehicles, of which a
    /// few can block a full ring for ever.
    const STUCK: u32 = 1200;
}

/// Cars that wait outside: four bits a source.
pub type Backlog = [u32; 2];

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
    /// The car of a slot has stood in a ring that is blocked for two minutes; it is gone after this.
    Removed(usize),
}

/// Word and lowest bit of a source in the backlog.
fn place(source: usize) -> (usize, usize) {
    (source / BACKLOG_SOURCES, BACKLOG_BITS * (source % BACKLOG_SOURCES))
}

/// The number of cars that wait outside at a source.
pub(super) fn waiting(backlog: &Backlog, source: usize) -> u32 {
    let (word, bit) = place(source);
    (backlog[word] >> bit) & MOST_WAITING
}

/// Has as many cars wait at a source as can.
pub(super) fn fill(backlog: &mut Backlog, source: usize) {
    let (word, bit) = place(source);
    backlog[word] |= MOST_WAITING << bit;
}

/// Cars at the ends of their paths leave, and those that come enter where there is room, in the order of the sources,
/// into the first free slots. `tell` hears of all.
pub fn arrive(
    setting: Setting,
    clock: Clock,
    cars: &mut [Car],
    backlog: &mut Backlog,
    others: &impl Others,
    tell: &mut impl FnMut(Event, &[Car]),
) {
    let Setting { network, demand, .. } = setting;
    let may_block = network.large.is_some();
    for slot in 0..cars.len() {
        let car = cars[slot];
        if !car.is_there() {
            continue;
        }
        if network.paths[car.path()].length <= car.front() {
            tell(Event::Left(slot), cars);
            cars[slot] = Car::NONE;
        } else if may_block && is_stuck(network, &car) {
            tell(Event::Removed(slot), cars);
            cars[slot] = Car::NONE;
        }
    }
    // One draw for all sources: their rates are exact, and at most one car comes in a step.
    let drawn = clock.arrival();
    if let Some(source) = demand.arrivals.iter().position(|&until| falls_below(drawn, until)) {
        let has_room = waiting(backlog, source) < MOST_WAITING;
        let (word, bit) = place(source);
        backlog[word] += u32::from(has_room) << bit;
        tell(if has_room { Event::Came(source) } else { Event::Stayed(source) }, cars);
    }
    if *backlog == [0; 2] {
        return;
    }
    // Where slots are short the last sources would never have one. Benchmarks, whose slots are fewer, keep their order.
    let n = network.sources.len();
    let n_free = || cars.iter().filter(|car| !car.is_there()).count();
    let n_waiting = || (0..n).filter(|&source| 0 < waiting(backlog, source)).count();
    let takes_turns = cars.len() == MOST_CARS && n_free() < n_waiting();
    let first = if takes_turns { clock.step as usize % n } else { 0 };
    for source in (first..n).chain(0..first) {
        if waiting(backlog, source) == 0 {
            continue;
        }
        let Some(slot) = cars.iter().position(|car| !car.is_there()) else { return };
        let Some(car) = entering(setting, clock, cars, source, others) else { continue };
        cars[slot] = car;
        let (word, bit) = place(source);
        backlog[word] -= 1 << bit;
        tell(Event::Entered(source, slot), cars);
    }
}

/// The next car of a source, if there is room for it.
fn entering(setting: Setting, clock: Clock, cars: &[Car], source: usize, others: &impl Others) -> Option<Car> {
    let Setting { network, rules, demand } = setting;
    let [drawn, own, driver, _] = clock.entering(source);
    let paths = network.paths_of(source);
    let last = paths.end - 1;
    let path = paths.clone().find(|&path| falls_below(drawn, demand.shares[path])).unwrap_or(last);
    let is_of_source = |other: &Car| other.is_there() && paths.contains(&other.path());
    let of_source = || cars.iter().enumerate().filter(|(_, other)| is_of_source(other));
    let before = || of_source().min_by_key(|(_, other)| other.rear());
    let kind = match network.large.as_ref().and_then(|_| before()) {
        Some((slot, other)) => clock.next_kind(source, slot as u32, other.style()),
        None => own,
    };
    let car = Car::entering(path, style([kind, own, driver], demand), 0).replaced_by(large(kind, demand));
    let car = if network.fits(&car) { car } else { car.replaced_by(0) };
    let beside = cars.iter().filter_map(|other| beside(network, &car, other));
    let ahead = of_source().map(|(_, other)| (other.rear(), other.pace())).chain(beside).chain(others.ahead(&car));
    let (rear, pace) = ahead.fold((BEYOND, 0), |nearest, other| if other.0 < nearest.0 { other } else { nearest });
    let room = rear - car.front();
    if room < ENTRY_ROOM {
        return None;
    }
    let pace = entry_pace(network, &car, (room - rules.gap).max(0), pace);
    Some(Car { speed: pace << FINER_SPEED, ..car })
}

/// Takes away all that stand in a blocked ring, without large vehicles, too: cars and vans block one where more come
/// than it serves. Around a truck these stay, as published benchmarks have them. `tell` hears of each.
pub(super) fn take_away_stuck(network: &Network, cars: &mut [Car], mut tell: impl FnMut(Event)) {
    for (slot, car) in cars.iter_mut().enumerate().filter(|(_, car)| car.is_there() && is_stuck(network, car)) {
        tell(Event::Removed(slot));
        *car = Car::NONE;
    }
}

/// Whether a car stands where a ring is blocked.
fn is_stuck(network: &Network, car: &Car) -> bool {
    STUCK <= car.standing() && network.line_of(car)[0] < car.front()
}

/// Rear and speed of a car on another lane that is in the way of one that enters, where one of them is large.
fn beside(network: &Network, car: &Car, other: &Car) -> Option<(i32, i32)> {
    let large = network.large.as_ref()?;
    let classes = [car.class(), other.class()];
    if !other.is_there() || classes == [0, 0] {
        return None;
    }
    let pair = large.pair(network.paths.len(), classes, [car.path(), other.path()]);
    let zones = large.zones[usize::from(pair.first)..][..usize::from(pair.n)].iter().map(Zone::stretch);
    let is_near = |zone: &Stretch| {
        let is_there = zone.b_in <= other.front() && other.rear() <= zone.b_out;
        zone.a_in <= car.front() + ENTRY_ROOM && is_there
    };
    let rear = zones.filter(is_near).map(|zone| match zone.kind {
        Kind::Follow => zone.beside(other.rear()),
        _ => zone.a_in,
    });
    rear.min().map(|rear| (rear, other.pace()))
}

/// Speed of a car that enters behind another one with this room to stop: that it can, and is 0.8 s behind (2^-14 m a
/// step, 2^-10 m).
fn entry_pace(network: &Network, car: &Car, room: i32, pace: i32) -> i32 {
    let stops = (square(pace) + STOPS_WITH * room).min(square(FASTEST)) as u32;
    // The root is in 2^-10 m/s, of which 8/5 units of a pace.
    let stops = (stops << 10).isqrt() as i32 * 8 / 5;
    // 2^-10 m in 8 steps are 2 units of a pace.
    network.limit(car.path(), car.station).min(stops).min(2 * room)
}
