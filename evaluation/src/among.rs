//! How a truck drives among other vehicles: how long it stands, how near it comes to them, and what it costs them.

pub(crate) mod encroachment; // times between both at the places where their paths meet
pub(crate) mod lanes; // lanes that it takes beside its own

use offtrack::layout::{Ended, Rig, Truck};
use offtrack::traffic::car::Outline;
use offtrack::traffic::{Car, Contact, Network, Row, outlines};
use serde::Serialize;

use super::episode::Episode;
use super::rank::nearest_rank;
pub use lanes::LaneClasses;
use lanes::LanesBeside;

/// Slower than this a truck stands (m/s).
const STANDS: f32 = 0.3;
/// Braking that is hard (m/s²), and the speed of a vehicle from which on it counts (m/s).
const HARD: f32 = 4.0;
const DRIVES: f32 = 1.0;
/// Distance of a vehicle's middle from a unit's centre line that is beside it (m), and the cosine of the angle between
/// both up to which they drive the same way.
const BESIDE: f32 = 5.0;
const SAME_WAY: f32 = 0.5;
/// Time between two looks ahead, and their number (s).
const LOOK: f64 = 0.1;
const N_LOOKS: usize = 50;
/// A shorter time to collision is too short (s). nuPlan's planning metrics state it, and how it is found: both go on at
/// constant speed and heading for up to 5 s.
const TOO_SHORT: f64 = 0.95;
/// Longer post-encroachment times are no conflict (s): D. Gettman and others, "Surrogate Safety Assessment Model",
/// FHWA-HRT-08-051, 2008.
const NO_CONFLICT: f64 = 5.0;
/// Time for which a vehicle that has entered may stand for a truck (s).
const BLOCKED: f64 = 10.0;

/// Of one episode, from step to step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Among {
    /// How many other vehicles come to the road (veh/h).
    pub demand: f64,
    /// Time for which the truck stood (s).
    pub standing: f64,
    /// Longest time for which a vehicle that had entered stood for the truck (s).
    pub blocked: f64,
    /// Time for which vehicles braked hard for the truck, each counted (s).
    pub braking: f64,
    /// Time for which vehicles that had entered drove beside the truck, each counted (s).
    pub beside: f64,
    /// Least time to a collision with a vehicle ahead, at most 5 s (s).
    pub time_to_collision: f64,
    /// Least post-encroachment time with a vehicle of another arm, at most 5 s (s).
    pub post_encroachment_time: f64,
    /// Parts of its way on which it took a lane beside its own, by entry, ring, exit; none where there is no such lane.
    pub lanes_taken: Option<[bool; 3]>,
    /// The contact that ended it, if one did.
    pub met: Option<Met>,
}

/// A contact with another vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// The truck's unit: the tractor, or else the trailer.
    pub by_tractor: bool,
    /// The vehicle was beyond its line.
    pub has_entered: bool,
}

impl Among {
    /// At an episode's start.
    pub(super) fn new(demand: f64) -> Among {
        let longest = LOOK * N_LOOKS as f64;
        Among {
            demand,
            standing: 0.0,
            blocked: 0.0,
            braking: 0.0,
            beside: 0.0,
            time_to_collision: longest,
            post_encroachment_time: NO_CONFLICT,
            lanes_taken: None,
            met: None,
        }
    }

    /// Adds the last step, of `step` seconds, after which truck and vehicles are these.
    pub(super) fn follow(&mut self, rig: &Rig, truck: &Truck, network: &Network, row: &Row, step: f64) {
        let units = outlines(rig, truck);
        let met = Contact::from_code(row.met);
        self.standing += if truck.speed < STANDS { step } else { 0.0 };
        for (slot, car) in row.cars.iter().enumerate().filter(|(_, car)| car.is_there()) {
            let outlines = car.outlines(network);
            let (has_entered, hindered) = (has_entered(network, car), row.hindered >> slot & 1 == 1);
            if met.is_some_and(|contact| contact.slot == slot) {
                self.met = Some(Met { by_tractor: outlines.clone().any(|its| units[0].overlaps(&its)), has_entered });
            }
            if hindered && has_entered {
                self.blocked = self.blocked.max(f64::from(car.standing()) * step);
            }
            self.braking += if hindered && car.acceleration() < -HARD && DRIVES < car.speed() { step } else { 0.0 };
            let is_any_beside = outlines.clone().any(|its| units.iter().any(|unit| is_beside(unit, &its)));
            let is_beside = has_entered && row.entered != 0 && is_any_beside;
            self.beside += if is_beside { step } else { 0.0 };
            let is_ahead = |its: &Outline| 0.0 < (its.middle - truck.position).dot(units[0].along);
            for outline in outlines.filter(|its| STANDS < truck.speed && is_ahead(its)) {
                self.look_ahead(&units, truck.speed, &outline, car.speed());
            }
        }
    }

    /// Adds a post-encroachment time (s).
    pub(super) fn encroach(&mut self, time: f64) {
        self.post_encroachment_time = self.post_encroachment_time.min(time);
    }

    /// Adds the lanes that both units of the truck take now beside its own.
    pub(super) fn take(&mut self, rig: &Rig, truck: &Truck, lanes: &LanesBeside) {
        if !lanes.is_empty() {
            let taken = self.lanes_taken.get_or_insert_default();
            let now = lanes.taken(&outlines(rig, truck));
            taken.iter_mut().zip(now).for_each(|(taken, now)| *taken |= now);
        }
    }

    /// Foresees both units and a vehicle at constant speeds.
    fn look_ahead(&mut self, units: &[Outline; 2], speed: f32, outline: &Outline, its_speed: f32) {
        let moved = |outline: &Outline, way: f32| Outline { middle: outline.middle + way * outline.along, ..*outline };
        let reach = |outline: &Outline| outline.half_length + outline.half_width;
        for unit in units {
            let own_speed = speed * unit.along.dot(units[0].along);
            let nearest = unit.middle.distance(outline.middle) - reach(unit) - reach(outline);
            let touches = |&look: &usize| {
                let time = (LOOK * look as f64) as f32;
                nearest < (own_speed + its_speed) * time
                    && moved(unit, own_speed * time).overlaps(&moved(outline, its_speed * time))
            };
            let earlier = (0..N_LOOKS).take_while(|&look| LOOK * (look as f64) < self.time_to_collision);
            if let Some(look) = { earlier }.find(touches) {
                self.time_to_collision = LOOK * look as f64;
            }
        }
    }
}

/// Whether a vehicle is beyond its line.
fn has_entered(network: &Network, car: &Car) -> bool {
    network.paths[car.path()].line() < car.station()
}

/// Whether a vehicle drives beside a unit, the same way.
fn is_beside(unit: &Outline, outline: &Outline) -> bool {
    let from = outline.middle - unit.middle;
    from.dot(unit.along).abs() < unit.half_length + 0.5 * outline.half_length
        && from.perp_dot(unit.along).abs() < BESIDE
        && SAME_WAY < outline.along.dot(unit.along)
}

/// The figures of several episodes among other vehicles.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AmongSummary {
    /// Mean time for which a truck stood (s).
    pub standing_mean: f64,
    /// That of 19 episodes in 20 at most (s).
    pub standing_p95: f64,
    /// Fraction of the episodes in which a vehicle that had entered stood for the truck for more than 10 s.
    pub blocked: f64,
    /// Mean time of an episode for which vehicles braked harder than 4 m/s² for the truck (s).
    pub braking_mean: f64,
    /// Mean time of an episode for which vehicles drove beside the truck behind its line (s).
    pub beside_mean: f64,
    /// Fraction of the episodes with a time to collision of less than 0.95 s, nuPlan's bound.
    pub too_near: f64,
    /// The time to collision that one episode in 20 falls below (s).
    pub time_to_collision_p5: f64,
    /// The post-encroachment time that one episode in 20 falls below, at most 5 s (s).
    pub post_encroachment_time_p5: f64,
    /// The same of every other episode (s).
    pub post_encroachment_time_p50: f64,
    /// Of the episodes that arrived on routes with lanes beside their own, which lanes they took; none of none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lane_classes: Option<LaneClasses>,
}

impl AmongSummary {
    /// Of those episodes that have other vehicles; `None` of none.
    pub(super) fn of<'a>(episodes: impl Iterator<Item = &'a Episode>) -> Option<AmongSummary> {
        let of = |episode: &Episode| Some((episode.among?, episode.ended == Ended::Arrived));
        let (all, arrived): (Vec<Among>, Vec<bool>) = episodes.filter_map(of).unzip();
        let passages = all.iter().zip(arrived).filter_map(|(among, arrived)| among.lanes_taken.filter(|_| arrived));
        let passages: Vec<[bool; 3]> = passages.collect();
        let mean = |value: fn(&Among) -> f64| all.iter().map(value).sum::<f64>() / all.len() as f64;
        (!all.is_empty()).then(|| AmongSummary {
            standing_mean: mean(|among| among.standing),
            standing_p95: quantile(&all, |among| among.standing, 0.95),
            blocked: mean(|among| f64::from(u8::from(BLOCKED < among.blocked))),
            braking_mean: mean(|among| among.braking),
            beside_mean: mean(|among| among.beside),
            too_near: mean(|among| f64::from(u8::from(among.time_to_collision < TOO_SHORT))),
            time_to_collision_p5: quantile(&all, |among| among.time_to_collision, 0.05),
            post_encroachment_time_p5: quantile(&all, |among| among.post_encroachment_time, 0.05),
            post_encroachment_time_p50: quantile(&all, |among| among.post_encroachment_time, 0.5),
            lane_classes: LaneClasses::of(&passages),
        })
    }

    /// A line of the table under [`HEADING_OF_LANES`].
    pub(super) fn line_of_lanes(&self, name: &str) -> String {
        let [p5, p50] = [self.post_encroachment_time_p5, self.post_encroachment_time_p50];
        let classes = self.lane_classes.map(|LaneClasses { i, ii, iii }| [i, ii, iii]);
        let percent = |index: usize| classes.map_or("-".to_owned(), |classes| format!("{:.1}", 100.0 * classes[index]));
        format!("{name:<12} {p5:>7.1} {p50:>5.1} {:>9} {:>8} {:>7}", percent(0), percent(1), percent(2))
    }

    /// A line of the table under [`HEADING`].
    pub(super) fn line(&self, name: &str) -> String {
        format!(
            "{name:<12} {:>7.1} {:>5.1} {:>9.2} {:>8.1} {:>7.1} {:>6.1} {:>9.1}",
            self.standing_mean,
            self.standing_p95,
            self.braking_mean,
            self.beside_mean,
            self.time_to_collision_p5,
            100.0 * self.too_near,
            100.0 * self.blocked,
        )
    }
}

/// What [`AmongSummary::line`] gives, and what it means.
pub(super) const HEADING: &str = "vehicles     stood s   p95 braking s beside s  TTC p5  short % blocked %";
pub(super) const NOTE: &str = "stood: a truck, per episode; braking: vehicles, harder than 4 m/s2 for it; beside: \
                               vehicles beyond their line; TTC: least time to collision of an episode, short below \
                               0.95 s; blocked: a vehicle beyond its line stood more than 10 s for it.";

/// What [`AmongSummary::line_of_lanes`] gives, and what it means.
pub(super) const HEADING_OF_LANES: &str = "vehicles      PET p5   p50 class I %     II %   III %";
pub(super) const NOTE_OF_LANES: &str = "PET: least time of an episode between truck and vehicle where their paths \
                                        meet, at most 5 s; class I: took a lane beside its own on entry or exit, \
                                        II: in the ring alone, III: nowhere, of those that arrived.";

/// The value that a fraction of all lies at or below.
fn quantile(all: &[Among], value: fn(&Among) -> f64, fraction: f64) -> f64 {
    nearest_rank(&mut all.iter().map(value).collect::<Vec<f64>>(), fraction).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests;
