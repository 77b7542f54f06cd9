//! How each car decides its acceleration, from the state of the step before alone.
//!
//! A car before its line that can still stop there waits for a gap, and yields to what has entered. Cars that have
//! entered follow what is ahead where paths run together, and where paths cross, one of two yields by rules that both
//! compute alike: nothing is agreed on or remembered, and the order in which cars decide changes nothing.

mod entry;

use super::clock::Clock;
use super::network::{CELL, Kind, Stretch};
use super::rules::{ACCELERATION, BRAKING, HARDEST, HEADWAY_SPREAD, PER_SPEEDS, SLOWING, SPEED_SPREAD};
use super::{Car, Network, Rules, STEP};

/// Most slots of a row.
pub(super) const MOST_CARS: usize = 64;
/// Nothing farther ahead of a car is looked at (m).
const SIGHT: f32 = 32.0;
/// The same of a car that may come to meet it (m).
const SIGHT_OF_OTHERS: f32 = 45.0;
/// A zone is left once the rear is so far behind it (m).
const LEFT: f32 = 0.3;
/// Two cars that have it before them agree on who is first from this distance on (m).
const AGREED: f32 = 35.0;
/// Twice the braking at which a car would still stop before its line (m/s²).
const STOPS_WITH: f32 = 8.0;
/// Twice the braking above which a car does not stop for another that is about as near (m/s²).
const GOES_ABOVE: f32 = 7.0;
/// Distance by which a car that cannot stop any more is nearer in the order of who goes first (m).
const BOUND: f32 = 1000.0;
/// Least speed in a time to a zone (m/s).
const LEAST_SPEED: f32 = 4.0;
/// Steps after which one that has been standing goes by the coin.
const PATIENT: u32 = 20;
/// A car that stands is this far before what it stops at (m).
const STANDS_BEFORE: f32 = 0.2;
/// Ratio of the wished gap to the gap for a car that must let another out of a crossing.
const LETS_OUT: f32 = 3.0;

/// All cars of a row as deciding needs them, side by side.
pub(super) struct Crowd<'a> {
    pub network: &'a Network,
    pub rules: &'a Rules,
    pub clock: Clock,
    cars: &'a [Car],
    n: usize,
    slot: [u32; MOST_CARS],
    path: [u16; MOST_CARS],
    /// Beginning and end of what may matter of it, in cells.
    rear: [u8; MOST_CARS],
    front: [u8; MOST_CARS],
}

/// A car that another one decides about.
#[derive(Clone, Copy)]
struct Other {
    slot: u32,
    station: f32,
    speed: f32,
    length: f32,
    line: f32,
    standing: u32,
    /// Whether it can still stop before its line.
    waits: bool,
    is_rude: bool,
}

impl<'a> Crowd<'a> {
    /// The cars of a row; at most [`MOST_CARS`] slots are looked at.
    pub(super) fn new(network: &'a Network, rules: &'a Rules, clock: Clock, cars: &'a [Car]) -> Crowd<'a> {
        let (slot, path) = ([0; MOST_CARS], [0; MOST_CARS]);
        let (rear, front) = ([0; MOST_CARS], [0; MOST_CARS]);
        let mut crowd = Crowd { network, rules, clock, cars, n: 0, slot, path, rear, front };
        for (index, car) in cars.iter().take(MOST_CARS).enumerate().filter(|(_, car)| car.is_there()) {
            let k = crowd.n;
            crowd.slot[k] = index as u32;
            crowd.path[k] = car.path() as u16;
            // Conversions saturate.
            crowd.rear[k] = ((car.station - car.length() - 0.5) / CELL) as u8;
            crowd.front[k] = ((car.station + SIGHT_OF_OTHERS) / CELL) as u8;
            crowd.n += 1;
        }
        crowd
    }

    /// The car in a slot, as it is weighed.
    fn seen(&self, slot: usize) -> Other {
        let car = &self.cars[slot];
        let line = self.network.paths[car.path()].line;
        Other {
            slot: slot as u32,
            station: car.station,
            speed: car.speed,
            length: car.length(),
            line,
            standing: car.standing(),
            waits: can_wait(car.station, car.speed, line),
            is_rude: car.is_rude(),
        }
    }

    /// The acceleration that the car in a slot decides (m/s²).
    pub(super) fn decided(&self, slot: usize) -> f32 {
        let mut driver = Driver::new(self, slot);
        let ahead = ((driver.me.station + SIGHT) / CELL) as u8;
        let behind = ((driver.me.station - driver.me.length - 0.5) / CELL) as u8;
        let pairs = &self.network.pairs[driver.path * self.network.paths.len()..][..self.network.paths.len()];
        // Most cars are near no zone that this one is near: they are sorted out without a branch.
        let (mut near, mut n_near) = ([0u8; MOST_CARS], 0);
        for k in 0..self.n {
            let pair = &pairs[usize::from(self.path[k])];
            let is_near = (0 < pair.n)
                & (pair.a[0] <= ahead)
                & (behind <= pair.a[1])
                & (pair.b[0] <= self.front[k])
                & (self.rear[k] <= pair.b[1])
                & (self.slot[k] as usize != slot);
            near[n_near] = k as u8;
            n_near += usize::from(is_near);
        }
        for &k in &near[..n_near] {
            let k = usize::from(k);
            let pair = &pairs[usize::from(self.path[k])];
            let other = self.seen(self.slot[k] as usize);
            let zones = &self.network.zones[usize::from(pair.first)..][..usize::from(pair.n)];
            zones.iter().for_each(|zone| driver.consider(&zone.stretch(), &other));
        }
        driver.decided()
    }
}

/// A car that decides.
struct Driver<'a> {
    crowd: &'a Crowd<'a>,
    me: Other,
    path: usize,
    temperament: f32,
    headway: f32,
    /// The largest ratio of a wished gap to the gap that there is.
    ratio: f32,
    /// Whether it stops before its line.
    stops: bool,
    /// The nearest car that it follows: station of its rear, and its speed.
    leader: (f32, f32),
}

impl<'a> Driver<'a> {
    fn new(crowd: &'a Crowd, slot: usize) -> Driver<'a> {
        let car = &crowd.cars[slot];
        let (me, path) = (crowd.seen(slot), car.path());
        let temperament = car.temperament();
        let headway = crowd.rules.headway * (1.0 - HEADWAY_SPREAD * temperament);
        Driver { crowd, me, path, temperament, headway, ratio: 0.0, stops: false, leader: (f32::INFINITY, 0.0) }
    }

    /// Takes another car in a zone of both paths into account.
    fn consider(&mut self, zone: &Stretch, other: &Other) {
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
                    self.ratio = self.ratio.max(LETS_OUT);
                }
            }
            ([true, false], _) => {}
            ([false, true], Kind::Follow) => {
                let gap = other.station - zone.delta - other.length - me.station;
                let behind = self.behind(gap, other.speed);
                self.ratio = self.ratio.max(behind.min(stopping(zone.a_in - me.station, me.speed)));
            }
            ([false, true], Kind::Cross) => self.ratio = self.ratio.max(stopping(zone.a_in - me.station, me.speed)),
            ([false, false], _) => self.consider_before_both(zone, other),
        }
    }

    /// Both are where paths run together: who is ahead leads.
    fn follow_inside(&mut self, zone: &Stretch, other: &Other) {
        let ahead = other.station - zone.delta;
        if self.me.station < ahead || (ahead == self.me.station && other.slot < self.me.slot) {
            let rear = ahead - other.length;
            self.ratio = self.ratio.max(self.behind(rear - self.me.station, other.speed));
            self.note_leader(rear, other.speed);
        }
    }

    /// Both have the zone before them, and it is not that of this car's entry.
    fn consider_before_both(&mut self, zone: &Stretch, other: &Other) {
        let me = self.me;
        let [mine, its] = [zone.a_in - me.station, zone.b_in - other.station];
        let enters_there = other.waits && other.line < zone.b_in;
        if !me.waits && enters_there && self.lets_in(&me, mine, other) {
            self.ratio = self.ratio.max(stopping(mine, me.speed));
            return;
        }
        // What waits before its line, or before that of both, hinders nobody yet.
        if (!me.waits && other.waits) || (me.waits && enters_there) || AGREED < mine.max(its) {
            return;
        }
        if self.goes_first(zone, other) {
            let length = if zone.kind == Kind::Cross { zone.b_out - zone.b_in } else { 0.0 };
            let behind = self.behind(mine - its - other.length - length, other.speed);
            self.ratio = self.ratio.max(behind.min(stopping(mine, me.speed)));
        }
    }

    /// Whether the other goes first through a zone that both have before them. Both find the same: what cannot stop any
    /// more is first, then who is there sooner; of two that have been standing, a coin decides.
    fn goes_first(&self, zone: &Stretch, other: &Other) -> bool {
        let me = &self.me;
        let other_is_lower = other.slot < me.slot;
        if PATIENT < me.standing && PATIENT < other.standing {
            return self.crowd.clock.lower_goes_first(me.slot, other.slot) == other_is_lower;
        }
        let [mine, its] = [rank(zone.a_in - me.station, me.speed), rank(zone.b_in - other.station, other.speed)];
        its < mine || (its == mine && other_is_lower)
    }

    /// Ratio of the wished gap to a gap behind something with a speed; the interaction of the intelligent driver model
    /// is its square.
    fn behind(&self, gap: f32, speed: f32) -> f32 {
        let v = self.me.speed;
        let wished = self.crowd.rules.gap + (v * self.headway + v * (v - speed) * PER_SPEEDS).max(0.0);
        wished / gap.max(0.1)
    }

    fn note_leader(&mut self, rear: f32, speed: f32) {
        if rear < self.leader.0 {
            self.leader = (rear, speed);
        }
    }

    /// The acceleration of the intelligent driver model (m/s²).
    fn decided(&mut self) -> f32 {
        self.keep_crossed_lanes_clear();
        let me = &self.me;
        if me.waits && self.stops {
            self.ratio = self.ratio.max(stopping(me.line - me.station, me.speed));
        }
        let ahead = me.station + 0.5 * me.speed * STEP;
        let wished = self.crowd.network.limit(self.path, ahead).max(0.5) * (1.0 + SPEED_SPREAD * self.temperament);
        let part = (me.speed / wished) * (me.speed / wished);
        let free = (1.0 - part * part).max(-SLOWING);
        (ACCELERATION * (free - self.ratio * self.ratio)).clamp(-HARDEST, ACCELERATION)
    }
}

/// Whether a car has not entered yet: it is before its line and can still stop there.
fn can_wait(station: f32, speed: f32, line: f32) -> bool {
    station + speed * speed * (1.0 / STOPS_WITH) <= line
}

/// The order of who goes first through a zone at this distance: the smaller.
fn rank(distance: f32, speed: f32) -> f32 {
    if GOES_ABOVE * distance < speed * speed { distance - BOUND } else { distance / speed.max(LEAST_SPEED) }
}

/// The ratio of gaps that stops a car before a line, never later than kinematics needs.
fn stopping(distance: f32, speed: f32) -> f32 {
    let ratio = (STANDS_BEFORE + speed * speed * PER_SPEEDS) / distance.max(0.05);
    let needed = 0.5 * speed * speed / (distance - 0.5 * STANDS_BEFORE).max(0.03);
    if BRAKING < needed { ratio.max((1.0 + needed / ACCELERATION).sqrt()) } else { ratio }
}
