//! One truck's episode while it runs: its figures so far, from one step to the next.
//!
//! The paths of both axles are needed for the off-tracking alone. Of them only the part between the trailer and the
//! front axle is held, so that an episode takes as much memory at its end as at its beginning.

use std::collections::VecDeque;

use glam::Vec2;
use offtrack::layout::angle::wrapped;
use offtrack::layout::{Ended, Rig, Truck};
use offtrack::traffic::{Network, Row, View};

use super::among::Among;
use super::among::encroachment::Encroachments;
use super::among::lanes::LanesBeside;
use super::driving::Driving;
use super::episode::{Episode, Terms};
use super::part::LaneWidths;
use super::seen::Seen;

/// What is of other vehicles on a truck's road.
pub(super) struct Around<'a> {
    /// Their paths.
    pub(super) network: &'a Network,
    /// The truck as they see it.
    pub(super) view: View,
    /// Lanes beside that of its route.
    pub(super) lanes: &'a LanesBeside,
}

/// An episode under way.
pub(super) struct Running {
    lane_distance_sum: f64,
    /// Steps after which the tractor's middle was outside of the route's own lane.
    outside: u32,
    /// The episode's figures so far; the means and the off-tracking follow at its end.
    episode: Episode,
    off_tracking: OffTracking,
    encroachments: Encroachments,
    /// Duration of a step (s).
    step: f64,
}

impl Running {
    /// At its start; `driving` is what is kept for its class, where classes are reported, `among` where there are
    /// other vehicles.
    pub(super) fn new(rig: &Rig, truck: &Truck, driving: Option<Driving>, among: Option<Among>, step: f64) -> Running {
        let front = front_axle(rig, truck);
        let ahead = Vec2::from_angle(truck.heading);
        Running {
            lane_distance_sum: 0.0,
            outside: 0,
            step,
            episode: Episode {
                ended: Ended::Running,
                steps: 0,
                reward: 0.0,
                terms: Terms::default(),
                lane_distance_mean: 0.0,
                lane_distance_max: 0.0,
                outside_lane: 0.0,
                tractor_clearance_min: f64::INFINITY,
                trailer_clearance_min: f64::INFINITY,
                load_transfer_ratio_peak: 0.0,
                articulation_peak: 0.0,
                off_tracking_peak: 0.0,
                on_apron: None,
                driving,
                among,
                last: *truck,
            },
            // The path's first point lies far behind the start, so that the trailer's axle is beside it from the first
            // step on.
            off_tracking: OffTracking::new(front - 2.0 * (rig.wheelbase + rig.trailer_wheelbase) * ahead, front),
            encroachments: Encroachments::new(),
        }
    }

    /// Adds the last step; true if it ended the episode. `lane` is that of the truck's route, `around` what is of other
    /// vehicles there, `apron` how far the trailer is on an apron (m), if there is one.
    pub(super) fn follow(
        &mut self,
        rig: &Rig,
        lane: &LaneWidths,
        around: Option<&Around>,
        apron: Option<f32>,
        seen: &Seen,
        env: usize,
    ) -> bool {
        let (truck, progress, clearance) = (&seen.truck[env], &seen.progress[env], &seen.clearance[env]);
        let raise = |peak: &mut f64, value: f32| *peak = peak.max(f64::from(value));
        let lower = |least: &mut f64, value: f32| *least = least.min(f64::from(value));
        self.episode.steps += 1;
        self.episode.reward += f64::from(seen.reward[env]);
        self.episode.terms.add(&seen.terms[env]);
        self.lane_distance_sum += f64::from(progress.lane_distance);
        self.outside += u32::from(lane.half_width(progress.waypoint) < progress.lane_distance);
        raise(&mut self.episode.lane_distance_max, progress.lane_distance);
        lower(&mut self.episode.tractor_clearance_min, clearance.tractor);
        lower(&mut self.episode.trailer_clearance_min, clearance.trailer);
        raise(&mut self.episode.load_transfer_ratio_peak, truck.load_transfer_ratio());
        raise(&mut self.episode.articulation_peak, wrapped(truck.heading - truck.trailer_heading).abs());
        if let Some(depth) = apron {
            self.episode.on_apron = Some(self.episode.on_apron.unwrap_or(0.0).max(f64::from(depth)));
        }
        if let Some(driving) = &mut self.episode.driving {
            driving.follow(truck, &seen.control[env], self.step);
        }
        let cars = seen.cars.as_ref().and_then(|cars| cars.get(env));
        if let (Some(among), Some(Around { network, view, lanes }), Some(cars)) =
            (&mut self.episode.among, around, cars)
        {
            let row = Row::of(cars);
            among.follow(rig, truck, network, row, self.step);
            among.take(rig, truck, lanes);
            if let Some(steps) = self.encroachments.follow(network, view, row) {
                among.encroach(steps as f64 * self.step);
            }
        }
        self.episode.last = *truck;
        self.off_tracking.push(front_axle(rig, truck), truck.trailer_position(rig));
        seen.ended[env] != Ended::Running as u32
    }

    /// The episode's figures, once it has ended by `ended`.
    pub(super) fn finish(&mut self, ended: Ended) -> Episode {
        let steps = f64::from(self.episode.steps.max(1));
        Episode {
            ended,
            lane_distance_mean: self.lane_distance_sum / steps,
            outside_lane: f64::from(self.outside) / steps,
            off_tracking_peak: self.off_tracking.finish(),
            ..self.episode.clone()
        }
    }
}

/// Middle of the front axle (m).
fn front_axle(rig: &Rig, truck: &Truck) -> Vec2 {
    truck.position + rig.wheelbase * Vec2::from_angle(truck.heading)
}

/// Least way ahead of the front axle that is kept as a part of its path (m).
const LEAST_WAY: f32 = 0.01;

/// Largest distance of the trailer's axle from the path of the front axle (m). The trailer follows the path in order,
/// so the search for the nearest segment only moves forwards, and what lies behind it is dropped.
struct OffTracking {
    /// The path, from the segment nearest to the trailer on.
    front: VecDeque<Vec2>,
    /// Positions of the trailer whose nearest segment may lie beyond the path so far.
    waiting: VecDeque<Vec2>,
    most: f64,
}

impl OffTracking {
    fn new(from: Vec2, to: Vec2) -> OffTracking {
        OffTracking { front: VecDeque::from([from, to]), waiting: VecDeque::new(), most: 0.0 }
    }

    /// Adds the positions of both axles after another step (m).
    fn push(&mut self, front: Vec2, trailer: Vec2) {
        // The search would stay at a point where the truck stands or rolls back: both of its segments are equally far.
        let [before, last] = [2, 1].map(|back| self.front[self.front.len() - back]);
        if LEAST_WAY <= (front - last).dot((last - before).normalize_or_zero()) {
            self.front.push_back(front);
        }
        self.waiting.push_back(trailer);
        while let Some(&point) = self.waiting.front() {
            self.advance(point);
            if self.front.len() <= 2 {
                // The next step may bring a nearer segment.
                return;
            }
            self.count(point);
        }
    }

    /// The largest distance of all, once the path is complete.
    fn finish(&mut self) -> f64 {
        while let Some(&point) = self.waiting.front() {
            self.advance(point);
            self.count(point);
        }
        self.most
    }

    /// Drops the segments before the nearest one.
    fn advance(&mut self, point: Vec2) {
        while 2 < self.front.len() && self.distance(point, 1) <= self.distance(point, 0) {
            self.front.pop_front();
        }
    }

    fn count(&mut self, point: Vec2) {
        self.most = self.most.max(self.distance(point, 0));
        self.waiting.pop_front();
    }

    fn distance(&self, point: Vec2, segment: usize) -> f64 {
        f64::from(offtrack::physics::distance_to_segment(point, self.front[segment], self.front[segment + 1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn off_tracking(front: &[Vec2], trailer: &[Vec2]) -> (f64, usize) {
        let mut off_tracking = OffTracking::new(front[0], front[1]);
        let mut held = 0;
        for (&front, &trailer) in front[2..].iter().zip(trailer) {
            off_tracking.push(front, trailer);
            held = held.max(off_tracking.front.len() + off_tracking.waiting.len());
        }
        (off_tracking.finish(), held)
    }

    #[test]
    fn a_trailer_on_a_smaller_circle_is_off_by_the_difference_of_the_radii() {
        let at = |radius: f32, step: usize| radius * Vec2::from_angle(0.02 * step as f32);
        let front: Vec<Vec2> = (0..2000).map(|step| at(20.0, step)).collect();
        // The trailer waits beside the path's beginning until the front axle is 30 steps ahead.
        let trailer: Vec<Vec2> = (0..1998usize).map(|step| at(18.0, 1 + step.saturating_sub(30))).collect();
        let (most, held) = off_tracking(&front, &trailer);
        // The chords of the path lie up to 1 mm inside its circle.
        assert!((most - 2.0).abs() < 2e-3, "{most}");
        assert!((30..40).contains(&held), "{held} points of 2000 steps are held");
    }

    #[test]
    fn a_truck_that_creeps_or_rolls_back_leaves_the_figure_as_it_is() {
        let at = |radius: f32, step: f32| radius * Vec2::from_angle(0.02 * step);
        // At step 100 it stands, creeps ahead by micrometres or rolls back by a millimetre.
        for way in [0.0, 1e-6, -1e-3] {
            let steps = |lag: f32| {
                let moved = (0..400).map(move |step| step as f32 - lag);
                let (before, after) = (moved.clone().take(100), moved.skip(100));
                before.chain((0..20).map(move |n| 99.0 - lag + n as f32 * way / 0.4)).chain(after)
            };
            let front: Vec<Vec2> = steps(0.0).map(|step| at(20.0, step)).collect();
            let trailer: Vec<Vec2> = steps(30.0).map(|step| at(18.0, step.max(1.0))).skip(2).collect();
            let (most, _) = off_tracking(&front, &trailer);
            assert!((most - 2.0).abs() < 2e-3, "{way}: {most}");
        }
    }

    #[test]
    fn a_trailer_ahead_of_its_path_waits_for_it() {
        let line = |from: f32| (0..50).map(move |i| Vec2::new(from + i as f32, 0.0)).collect::<Vec<_>>();
        // For 10 steps the trailer lies 10 m beyond the path; in the end the path has passed it.
        let trailer: Vec<Vec2> = (0..48).map(|i| Vec2::new(11.0 + (i as f32).min(30.0), 0.5)).collect();
        assert_eq!(off_tracking(&line(0.0), &trailer).0, 0.5);
    }
}
