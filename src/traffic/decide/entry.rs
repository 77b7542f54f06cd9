//! What a car does before its line: it waits for a gap in what has entered, and is let in at times.

use super::{Driver, LEAST_SPEED, Other, can_wait, stopping};
use crate::traffic::STEP;
use crate::traffic::bake::ENTRY;
use crate::traffic::clock::falls_below;
use crate::traffic::network::{Kind, Stretch};
use crate::traffic::rules::HEADWAY_SPREAD;

/// Least speed in the time to the line (m/s).
const LEAST_APPROACH: f32 = 3.0;
/// Standing time after which a lag would be 0 (s), and the least part of it that is left.
const IMPATIENCE: f32 = 10.0;
const LEAST_PATIENCE: f32 = 0.3;
/// Time by which a car that crosses ahead must be gone before this one is there (s).
const GONE_BEFORE: f32 = 0.5;
/// How far a car foresees that one which passes moves away (s).
const ANTICIPATION: f32 = 1.0;
/// A car that follows one slower than this stays off the lanes that it crosses (m/s).
const SLOW: f32 = 3.0;
/// A car is let in within this distance of its line (m), below this speed (m/s).
const LET_IN_WITHIN: f32 = 4.0;
const LET_IN_BELOW: f32 = 4.0;
/// Twice the braking with which a car lets another in (m/s²), so far before the zone (m).
const LETS_IN_WITH: f32 = 3.0;
const LETS_IN_BEFORE: f32 = 1.5;

impl Driver<'_> {
    /// Whether a zone is one of this car's entry.
    pub(super) fn is_of_entry(&self, zone: &Stretch) -> bool {
        let line = self.me.line;
        zone.a_in <= line + ENTRY as f32 && (zone.kind == Kind::Soft || line < zone.a_in)
    }

    /// This car can still wait, and the zone is one of its entry.
    pub(super) fn consider_at_line(&mut self, zone: &Stretch, other: &Other) {
        let me = self.me;
        if other.waits {
            // Both wait, or arrive: only where paths cross must one be first.
            let both_enter = zone.kind == Kind::Cross && other.line < zone.b_in;
            if !both_enter || !self.goes_first(zone, other) {
                return;
            }
        }
        let to_line = (me.line - me.station) / me.speed.max(LEAST_APPROACH);
        if other.station < zone.b_in {
            let distance = zone.b_in - other.station;
            let is_let_in = zone.kind != Kind::Soft && self.lets_in(other, distance, &me);
            let speed = other.speed.max(LEAST_SPEED);
            let comes = distance / speed;
            let gone = comes + (zone.b_out - zone.b_in + other.length) / speed;
            self.stops |= !is_let_in && comes < self.lag(zone) + to_line && to_line < gone;
            return;
        }
        match zone.kind {
            // What passes beside is in nobody's way.
            Kind::Soft | Kind::Wide => {}
            Kind::Cross => {
                let gone = (zone.b_out + other.length - other.station) / other.speed.max(1.0);
                self.stops |= to_line + GONE_BEFORE < gone;
            }
            Kind::Follow => {
                let rear = other.station - zone.delta - other.length;
                let soon = rear - me.station + ANTICIPATION * (other.speed - me.speed).max(0.0);
                let behind = self.behind(soon, other.speed);
                self.ratio = self.ratio.max(behind.min(stopping(me.line - me.station, me.speed)));
                self.note_leader(rear, other.speed);
            }
        }
    }

    /// Time that this car leaves between itself and ring traffic that comes (s).
    fn lag(&self, zone: &Stretch) -> f32 {
        let rules = self.crowd.rules;
        let crosses = 0.0 < self.crowd.network.paths[self.path].clear;
        let lane = self.crowd.network.source_of(self.path).lane.min(1) as usize;
        let lag = if zone.kind == Kind::Soft { rules.soft_lags[lane] } else { rules.lags[usize::from(crosses)] };
        let patience = (1.0 - self.me.standing as f32 * (STEP / IMPATIENCE)).max(LEAST_PATIENCE);
        lag * (1.0 - HEADWAY_SPREAD * self.temperament) * patience
    }

    /// Whether the car `inside` the ring, at this distance before the zone, lets in the one that waits. Both find the
    /// same.
    pub(super) fn lets_in(&self, inside: &Other, distance: f32, waiting: &Other) -> bool {
        let is_at_line = waiting.line - waiting.station <= LET_IN_WITHIN && waiting.speed <= LET_IN_BELOW;
        let brakes_gently = inside.speed * inside.speed <= LETS_IN_WITH * (distance - LETS_IN_BEFORE);
        let courtesy = self.crowd.rules.courtesy;
        is_at_line
            && brakes_gently
            && !inside.is_rude
            && falls_below(self.crowd.clock.courtesy(inside.slot, waiting.slot), courtesy)
    }

    /// Stops before the line where there is no room behind the lanes that this car crosses.
    pub(super) fn keep_crossed_lanes_clear(&mut self) {
        let (me, (rear, speed)) = (&self.me, self.leader);
        let path = &self.crowd.network.paths[self.path];
        let would_block = rear - self.crowd.rules.gap - me.length < path.clear && me.line < rear;
        self.stops |= can_wait(me.station, me.speed, me.line) && would_block && speed < SLOW;
    }
}
