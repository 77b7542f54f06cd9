//! How each car decides its acceleration, from the state of the step before alone.
//!
//! A car before its line that can still stop there waits for a gap, and yields to what has entered. Cars that have
//! entered follow what is ahead where paths run together, and where paths cross, one of two yields by rules that both
//! compute alike: nothing is agreed on or remembered, and the order in which cars decide changes nothing.

mod entry;

pub(super) use entry::{GONE_BEFORE, LEAST_CROSSING, printed_constants as printed_entry};

use super::clock::Clock;
use super::large::{MOST_OF_LARGE, PACE_OF_LARGE};
use super::model::{ONE, acceleration, braking_of, following, square, still_stops, stopping, time};
use super::network::{Kind, Pair, Stretch, Zone, cell};
use super::rules::{SPEED_PARTS, TIME_PARTS};
use super::units::{BEYOND, falls_below, length, speed};
use super::{Car, Network, Others, Rules};
use crate::layout::shared::constants;

/// Most slots of a row.
pub(super) const MOST_CARS: usize = 64;

constants! {
    /// Nothing farther ahead of a car is looked at (2^-10 m).
    pub(super) const SIGHT: i32 = length(32.0);
    /// The same of a car that may come to meet it (2^-10 m).
    pub(super) const SIGHT_OF_OTHERS: i32 = length(45.0);
    /// What may matter of a car begins so far behind its rear (2^-10 m).
    const BEHIND: i32 = length(0.5);
    /// A zone is left once the rear is so far behind it (2^-10 m).
    pub(super) const LEFT: i32 = length(0.3);
    /// Two cars that have it before them agree on who is first from this distance on (2^-10 m).
    const AGREED: i32 = length(35.0);
    /// Twice the braking above which a car does not stop for another that is about as near (m/s²).
    const GOES_ABOVE: i32 = 7;
    /// Least speed in a time to a zone (2^-14 m a step).
    pub(super) const LEAST_SPEED: i32 = speed(4.0);
    /// Least wished speed (2^-14 m a step).
    const LEAST_WISHED: i32 = speed(0.5);
    /// Steps after which one that has been standing goes by the coin.
    const PATIENT: u32 = 20;
    /// Who looks away looks up once he would brake harder than at 3 m/s² (2^-19 m a step²).
    const LOOKS_UP: i32 = -15_729;
    /// Interaction of a car that must let another out of a crossing: it wishes three times the gap.
    const LETS_OUT: i32 = 9 * ONE;
}

/// All cars of a row as deciding needs them, side by side.
pub(super) struct Crowd<'a> {
    pub network: &'a Network,
    pub rules: &'a Rules,
    pub clock: Clock,
    cars: &'a [Car],
    n: usize,
    slot: [u32; MOST_CARS],
    path: [u16; MOST_CARS],
    /// Its class by the room that it needs.
    class: [u8; MOST_CARS],
    /// Beginning and end of what may matter of it, in cells.
    rear: [u8; MOST_CARS],
    front: [u8; MOST_CARS],
}

/// A vehicle as another one weighs it, in the units of decisions.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    /// Its slot; of two that are alike, the lower one is first.
    pub slot: u32,
    /// Station of its front (2^-10 m).
    pub station: i32,
    /// Its speed (2^-14 m a step).
    pub speed: i32,
    /// Square of its speed (2^-10 m²/s²).
    pub square: i32,
    /// Its length (2^-10 m).
    pub length: i32,
    /// Station of its line (2^-10 m).
    pub line: i32,
    /// Steps for which it has been standing.
    pub standing: u32,
    /// Whether it can still stop before its line.
    pub waits: bool,
    /// Whether its driver lets nobody in.
    pub is_rude: bool,
}

impl<'a> Crowd<'a> {
    /// The cars of a row; at most [`MOST_CARS`] slots are looked at.
    pub(super) fn new(network: &'a Network, rules: &'a Rules, clock: Clock, cars: &'a [Car]) -> Crowd<'a> {
        let (slot, path, class) = ([0; MOST_CARS], [0; MOST_CARS], [0; MOST_CARS]);
        let (rear, front) = ([0; MOST_CARS], [0; MOST_CARS]);
        let mut crowd = Crowd { network, rules, clock, cars, n: 0, slot, path, class, rear, front };
        for (index, car) in cars.iter().take(MOST_CARS).enumerate().filter(|(_, car)| car.is_there()) {
            let k = crowd.n;
            crowd.slot[k] = index as u32;
            crowd.path[k] = car.path() as u16;
            crowd.class[k] = car.class() as u8;
            crowd.rear[k] = cell(car.rear() - BEHIND);
            crowd.front[k] = cell(car.front() + SIGHT_OF_OTHERS);
            crowd.n += 1;
        }
        crowd
    }

    /// The car in a slot, as it is weighed.
    #[inline]
    fn seen(&self, slot: usize) -> Seen {
        let car = &self.cars[slot];
        let [line, _] = self.network.line_of(car);
        let (station, speed, square) = (car.front(), car.pace(), square(car.pace()));
        Seen {
            slot: slot as u32,
            station,
            speed,
            square,
            length: car.extent(),
            line,
            standing: car.standing(),
            waits: still_stops(station, square, line),
            is_rude: car.is_rude(),
        }
    }

    /// The acceleration that the car in a slot decides (2^-19 m a step²).
    pub(super) fn decided(&self, slot: usize, others: &impl Others) -> i32 {
        let mut driver = Driver::new(self, slot);
        let n_paths = self.network.paths.len();
        let (path, class) = (driver.path, self.cars[slot].class());
        let pairs = &self.network.pairs[path * n_paths..][..n_paths];
        let of_cars = |k: usize| &pairs[usize::from(self.path[k])];
        let ends = [cell(driver.me.station - driver.me.length - BEHIND), cell(driver.me.station + SIGHT)];
        match &self.network.large {
            None => self.weigh(&mut driver, ends, of_cars, |_| &self.network.zones),
            Some(large) => {
                let of_large = |k: usize| {
                    let classes = [class, usize::from(self.class[k])];
                    (classes != [0, 0]).then(|| large.pair(n_paths, classes, [path, usize::from(self.path[k])]))
                };
                let pair = |k: usize| of_large(k).unwrap_or_else(|| of_cars(k));
                let zones = |k: usize| if of_large(k).is_some() { &large.zones } else { &self.network.zones };
                self.weigh(&mut driver, ends, pair, zones);
            }
        }
        others.hinder(&mut driver);
        driver.decided()
    }

    /// Has a driver, who looks at these cells of its path, take all other cars into account, by their pairs of paths
    /// and the zones of these.
    fn weigh<'t>(
        &self,
        driver: &mut Driver,
        [behind, ahead]: [u8; 2],
        pair: impl Fn(usize) -> &'t Pair,
        zones: impl Fn(usize) -> &'t Vec<Zone>,
    ) {
        let slot = driver.me.slot;
        // Most cars are near no zone that this one is near: they are sorted out without a branch.
        let (mut near, mut n_near) = ([0u8; MOST_CARS], 0);
        for k in 0..self.n {
            let pair = pair(k);
            let is_near = (0 < pair.n)
                & (pair.a[0] <= ahead)
                & (behind <= pair.a[1])
                & (pair.b[0] <= self.front[k])
                & (self.rear[k] <= pair.b[1])
                & (self.slot[k] != slot);
            near[n_near] = k as u8;
            n_near += usize::from(is_near);
        }
        for &k in &near[..n_near] {
            let k = usize::from(k);
            let pair = pair(k);
            let other = self.seen(self.slot[k] as usize);
            let zones = &zones(k)[usize::from(pair.first)..][..usize::from(pair.n)];
            zones.iter().for_each(|zone| driver.consider(&zone.stretch(), &other));
        }
    }
}

/// A car that decides.
#[derive(Clone, Copy)]
pub struct Driver<'a> {
    crowd: &'a Crowd<'a>,
    /// The car as others weigh it.
    pub me: Seen,
    path: usize,
    temperament: i32,
    /// Its time headway (1/256 step).
    headway: i32,
    /// The largest interaction.
    interaction: i32,
    /// Whether it stops before its line.
    stops: bool,
    /// The nearest car that it follows: station of its rear, and its speed (2^-10 m, 2^-14 m a step).
    leader: (i32, i32),
}

impl<'a> Driver<'a> {
    fn new(crowd: &'a Crowd, slot: usize) -> Driver<'a> {
        let car = &crowd.cars[slot];
        let (me, path, temperament) = (crowd.seen(slot), car.path(), car.temperament());
        let headway = crowd.rules.headway * (TIME_PARTS - temperament) / TIME_PARTS;
        Driver { crowd, me, path, temperament, headway, interaction: 0, stops: false, leader: (BEYOND, 0) }
    }

    /// Takes another car in a zone of both paths into account.
    fn consider(&mut self, zone: &Stretch, other: &Seen) {
        let me = self.me;
        let out_of_sight = SIGHT < zone.a_in - me.station || SIGHT_OF_OTHERS < zone.b_in - other.station;
        let left = zone.a_out + LEFT < me.station - me.length || zone.b_out + LEFT < other.station - other.length;
        if out_of_sight || left {
            return;
        }
        let inside = [zone.a_in <= me.station, zone.b_in <= other.station];
        if me.waits && !inside[0] && self.is_of_entry(zone) {
            self.consider_at_line(zone, other);
            return;
        }
        match (inside, zone.kind) {
            (_, Kind::Soft | Kind::Wide) => {}
            ([true, true], Kind::Follow) => self.follow_inside(zone, other),
            ([true, true], Kind::Cross) => {
                // Who has less to go is first.
                let [mine, its] = [zone.a_out - me.station, zone.b_out - other.station];
                if its < mine || (its == mine && other.slot < me.slot) {
                    self.heed(LETS_OUT);
                }
            }
            ([true, false], _) => {}
            ([false, true], Kind::Follow) => {
                let gap = zone.beside(other.station - other.length) - me.station;
                self.stop_or_follow(zone.a_in - me.station, gap, other.speed);
            }
            ([false, true], Kind::Cross) => self.stop_before(zone.a_in - me.station),
            ([false, false], _) => self.consider_before_both(zone, other),
        }
    }

    /// Both are where paths run together: who is ahead leads.
    fn follow_inside(&mut self, zone: &Stretch, other: &Seen) {
        if zone.is_ahead(self.me.station, other.station, other.slot < self.me.slot) {
            let rear = zone.beside(other.station - other.length);
            self.follow(rear - self.me.station, other.speed);
            self.note_leader(rear, other.speed);
        }
    }

    /// Both have the zone before them, and it is not that of this car's entry.
    fn consider_before_both(&mut self, zone: &Stretch, other: &Seen) {
        let me = self.me;
        let [mine, its] = [zone.a_in - me.station, zone.b_in - other.station];
        let enters_there = other.waits && other.line < zone.b_in;
        if !me.waits && enters_there && self.lets_in(&me, mine, other) {
            self.stop_before(mine);
            return;
        }
        // What waits before its line, or before that of both, hinders nobody yet.
        if (!me.waits && other.waits) || (me.waits && enters_there) || AGREED < mine.max(its) {
            return;
        }
        if self.goes_first(zone, other) {
            let length = if zone.kind == Kind::Cross { zone.b_out - zone.b_in } else { 0 };
            self.stop_or_follow(mine, mine - its - other.length - length, other.speed);
        }
    }

    /// Whether the other goes first through a zone that both have before them. Both find the same: what cannot stop any
    /// more is first, then who is there sooner; of two that have been standing, a coin decides.
    fn goes_first(&self, zone: &Stretch, other: &Seen) -> bool {
        let me = &self.me;
        let other_is_lower = other.slot < me.slot;
        if PATIENT < me.standing && PATIENT < other.standing {
            return self.crowd.clock.lower_goes_first(me.slot, other.slot) == other_is_lower;
        }
        let [mine, its] = [rank(zone.a_in - me.station, me), rank(zone.b_in - other.station, other)];
        its < mine || (its == mine && other_is_lower)
    }

    /// The car that decides.
    pub fn car(&self) -> &Car {
        &self.crowd.cars[self.me.slot as usize]
    }

    /// The road's tables.
    pub fn network(&self) -> &'a Network {
        self.crowd.network
    }

    /// The largest interaction that it minds so far (2^-16).
    pub fn interaction(&self) -> i32 {
        self.interaction
    }

    /// Minds an interaction (2^-16).
    pub fn heed(&mut self, interaction: i32) {
        self.interaction = self.interaction.max(interaction);
    }

    /// The interaction with something that has a speed behind a gap (2^-16, 2^-10 m, 2^-14 m a step).
    pub fn behind(&self, gap: i32, speed: i32) -> i32 {
        following(gap, self.me.speed, speed, self.headway, self.crowd.rules.gap)
    }

    /// Follows something with a speed behind a gap (2^-10 m, 2^-14 m a step).
    pub fn follow(&mut self, gap: i32, speed: i32) {
        self.heed(self.behind(gap, speed));
    }

    /// Stops before something at a distance (2^-10 m).
    pub fn stop_before(&mut self, distance: i32) {
        self.heed(stopping(distance, self.me.square));
    }

    /// Stops at a distance, or follows something with a speed behind a gap, whichever is milder (2^-10 m, 2^-14 m a
    /// step).
    pub fn stop_or_follow(&mut self, distance: i32, gap: i32, speed: i32) {
        self.heed(self.behind(gap, speed).min(stopping(distance, self.me.square)));
    }

    /// Brakes at least so hard (1/256 m/s²).
    pub fn brake(&mut self, deceleration: i32) {
        self.heed(braking_of(deceleration));
    }

    /// Waits at its line, if it still can.
    pub fn wait_at_line(&mut self) {
        self.stops = true;
    }

    /// Keeps off the lanes that it crosses while what it follows leaves it no room behind them: station of its rear,
    /// and its speed (2^-10 m, 2^-14 m a step).
    pub fn note_leader(&mut self, rear: i32, speed: i32) {
        if rear < self.leader.0 {
            self.leader = (rear, speed);
        }
    }

    /// The car's acceleration (2^-19 m a step²).
    fn decided(&mut self) -> i32 {
        self.keep_crossed_lanes_clear();
        if self.me.waits && self.stops {
            self.stop_before(self.me.line - self.me.station);
        }
        let car = self.car();
        // Half a step ahead: a speed's unit is the way of half a step.
        let limit = self.network().limit(self.path, car.station + car.speed);
        let is_large = car.is_large();
        let limit = if is_large { (limit * PACE_OF_LARGE) >> 4 } else { limit };
        let wished = limit.max(LEAST_WISHED) * (SPEED_PARTS + self.temperament) / SPEED_PARTS;
        let most = if is_large { MOST_OF_LARGE } else { i32::MAX };
        let decided = acceleration(self.me.speed, wished, self.interaction).min(most);
        if LOOKS_UP <= decided && self.looks_away() { car.acceleration.min(0) } else { decided }
    }

    /// Whether this driver looks away.
    fn looks_away(&self) -> bool {
        let lapses = self.crowd.rules.lapses;
        0 < lapses && falls_below(self.crowd.clock.lapse(self.me.slot), lapses)
    }
}

/// The order of who goes first through a zone at this distance: the smaller. Of those that cannot stop any more the
/// nearer one, before all others; of these the one that is there sooner.
fn rank(distance: i32, car: &Seen) -> i32 {
    if GOES_ABOVE * distance < car.square { distance - BEYOND } else { time(distance, car.speed.max(LEAST_SPEED)) }
}
