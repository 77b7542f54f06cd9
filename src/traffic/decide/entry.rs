//! What a car does before its line: it waits for a gap in what has entered, and is let in at times.

use super::{Driver, LEAST_SPEED, Seen};
use crate::layout::shared::constants;
use crate::traffic::bake::ENTRY;
use crate::traffic::large::LAG_OF_LARGE;
use crate::traffic::model::{time, way_of_a_second};
use crate::traffic::network::{Kind, Stretch};
use crate::traffic::rules::TIME_PARTS;
use crate::traffic::units::{falls_below, length, speed, time as ticks};

constants! {
    /// Zones that begin up to here behind the line are those of the entry (2^-10 m).
    const OF_ENTRY: i32 = length(ENTRY as f32);
    /// Least speed in the time to the line (2^-14 m a step).
    const LEAST_APPROACH: i32 = speed(3.0);
    /// Least speed in the time until a crossing is free (2^-14 m a step).
    pub(in crate::traffic) const LEAST_CROSSING: i32 = speed(1.0);
    /// Steps of standing after which a lag would be 0.
    const IMPATIENCE: i32 = 100;
    /// How many are left of them at least.
    const LEAST_PATIENCE: i32 = 30;
    /// Time by which a car that crosses ahead must be gone before this one is there (1/256 step).
    pub(in crate::traffic) const GONE_BEFORE: i32 = ticks(0.5);
    /// A car that follows one slower than this stays off the lanes that it crosses (2^-14 m a step).
    const SLOW: i32 = speed(3.0);
    /// A car is let in within this distance of its line (2^-10 m).
    const LET_IN_WITHIN: i32 = length(4.0);
    /// The same below this speed (2^-14 m a step).
    const LET_IN_BELOW: i32 = speed(4.0);
    /// Twice the braking with which a car lets another in (m/s²).
    const LETS_IN_WITH: i32 = 3;
    /// It does so far before the zone (2^-10 m).
    const LETS_IN_BEFORE: i32 = length(1.5);
}

impl Driver<'_> {
    /// Whether a zone is one of this car's entry.
    pub fn is_of_entry(&self, zone: &Stretch) -> bool {
        let line = self.me.line;
        zone.a_in <= line + OF_ENTRY && (zone.kind == Kind::Soft || line < zone.a_in)
    }

    /// This car can still wait, and the zone is one of its entry.
    pub(super) fn consider_at_line(&mut self, zone: &Stretch, other: &Seen) {
        let me = self.me;
        if other.waits {
            // Both wait, or arrive: only where paths cross must one be first.
            let both_enter = zone.kind == Kind::Cross && other.line < zone.b_in;
            if !both_enter || !self.goes_first(zone, other) {
                return;
            }
        }
        let to_line = self.time_to_line();
        if other.station < zone.b_in {
            let distance = zone.b_in - other.station;
            let is_let_in = zone.kind != Kind::Soft && self.lets_in(other, distance, &me);
            let speed = other.speed.max(LEAST_SPEED);
            let comes = time(distance, speed);
            let gone = comes + time(zone.b_out - zone.b_in + other.length, speed);
            self.stops |= !is_let_in && comes < self.lag(zone.kind) + to_line && to_line < gone;
            return;
        }
        match zone.kind {
            // What passes beside is in nobody's way.
            Kind::Soft | Kind::Wide => {}
            Kind::Cross => {
                let left = (zone.b_out + other.length - other.station).max(0);
                self.stops |= to_line + GONE_BEFORE < time(left, other.speed.max(LEAST_CROSSING));
            }
            Kind::Follow => {
                let rear = zone.beside(other.station - other.length);
                // It foresees how far one that passes moves away.
                let soon = rear - me.station + way_of_a_second((other.speed - me.speed).max(0));
                self.stop_or_follow(me.line - me.station, soon, other.speed);
                self.note_leader(rear, other.speed);
            }
        }
    }

    /// Time to its line, of a car that waits (1/256 step).
    pub fn time_to_line(&self) -> i32 {
        time((self.me.line - self.me.station).max(0), self.me.speed.max(LEAST_APPROACH))
    }

    /// Time that this car leaves between itself and ring traffic that comes (1/256 step).
    pub fn lag(&self, kind: Kind) -> i32 {
        let rules = self.crowd.rules;
        let [_, clear] = self.crowd.network.line_of(self.car());
        let crosses = 0 < clear;
        let lane = self.crowd.network.source_of(self.path).lane.min(1) as usize;
        let lag = if kind == Kind::Soft { rules.soft_lags[lane] } else { rules.lags[usize::from(crosses)] };
        let patience = (IMPATIENCE - self.me.standing as i32).max(LEAST_PATIENCE);
        let lag = lag + if self.car().is_large() { LAG_OF_LARGE } else { 0 };
        lag * (TIME_PARTS - self.temperament) * patience / (TIME_PARTS * IMPATIENCE)
    }

    /// Whether the car `inside` the ring, at this distance before the zone, lets in the one that waits. Both find the
    /// same.
    pub(super) fn lets_in(&self, inside: &Seen, distance: i32, waiting: &Seen) -> bool {
        let is_at_line = waiting.line - waiting.station <= LET_IN_WITHIN && waiting.speed <= LET_IN_BELOW;
        let brakes_gently = inside.square <= LETS_IN_WITH * (distance - LETS_IN_BEFORE);
        let courtesy = self.crowd.rules.courtesy;
        is_at_line
            && brakes_gently
            && !inside.is_rude
            && falls_below(self.crowd.clock.courtesy(inside.slot, waiting.slot), courtesy)
    }

    /// Stops before the line where there is no room behind the lanes that this car crosses.
    pub(super) fn keep_crossed_lanes_clear(&mut self) {
        let (me, (rear, speed)) = (&self.me, self.leader);
        let [_, clear] = self.crowd.network.line_of(self.car());
        let would_block = rear - self.crowd.rules.gap - me.length < clear && me.line < rear;
        self.stops |= me.waits && would_block && speed < SLOW;
    }
}
