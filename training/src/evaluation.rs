//! Evaluates a policy: a number of episodes on every route of a split, every one counted.

pub mod certificate; // routes shown to be possible
pub mod page; // a report as an HTML page
pub mod policies; // what chooses the actions: learned, pure pursuit, random
pub mod report; // figures of an evaluation
mod table; // a report as text

use std::sync::Arc;

use glam::Vec2;
use offtrack::angle::wrapped;
use offtrack::geometry::Outline;
use offtrack::layout::{Ended, Rig, Truck};
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{Batch, RouteChoice, Simulator};
use offtrack::swept::{own_lane_suffices, swept_path};
use offtrack::world::World;
use offtrack_drawing::recording::{Recorder, Track};

use crate::device::Device;
use crate::error::Error;
use policies::Policy;
use report::{Episode, Report, RouteReport, Summary};

pub use table::legend;

/// What a policy is evaluated on: a number of episodes on every route of a split, all in one batch, one episode a
/// truck.
#[derive(Debug, Clone, Copy)]
pub struct Evaluation<'a> {
    /// The benchmark.
    pub scenario: &'a Scenario,
    /// The same, baked.
    pub world: &'a Arc<World>,
    /// Which of its routes.
    pub split: Split,
    /// Episodes on each route.
    pub episodes: usize,
    /// Seed of the start poses.
    pub seed: u32,
    /// Whether every state of every episode is kept.
    pub record: bool,
    /// What steps the trucks. A learned policy runs on the processor on either.
    pub device: &'a Device,
}

impl Evaluation<'_> {
    /// The policy's report and, if recorded, the episodes in the order of its routes. `progress` is as in
    /// [`Evaluation::drive`].
    pub fn report(&self, policy: &mut dyn Policy, progress: &mut dyn FnMut(usize, usize)) -> Result<(Report, Vec<Track>), Error> {
        let (finished, tracks) = self.drive(policy, progress)?;
        Ok((self.summarised(policy.name(), &finished), tracks))
    }

    /// The episodes, route by route in the order of the split; if recorded, also every state of each. `progress` is
    /// called with the number of finished episodes and the number of all, after each step that finished one.
    pub fn drive(&self, policy: &mut dyn Policy, progress: &mut dyn FnMut(usize, usize)) -> Result<(Vec<Episode>, Vec<Track>), Error> {
        let Evaluation { scenario, world, split, episodes, seed, record, device } = *self;
        let routes = scenario.split(split);
        if routes.is_empty() {
            let value = split.name().to_owned();
            return Err(Error::Flag { flag: "split", value, expected: format!("the benchmark {} has no such routes", scenario.name) });
        }
        let trucks: Vec<u32> = routes.iter().flat_map(|&route| std::iter::repeat_n(route, episodes)).collect();
        let mut simulator = Simulator::on(device.engine.clone(), world.clone(), trucks.len(), seed, RouteChoice::Fixed(trucks))?;
        let mut running: Vec<Running> = simulator.batch().truck.iter().map(|truck| Running::new(&world.params.rig, truck)).collect();
        let recorded = if record { 0..running.len() } else { 0..0 };
        let mut recorder = Recorder::new(world, simulator.batch(), recorded);
        let mut actions = Vec::new();
        let mut finished: Vec<Option<Episode>> = vec![None; running.len()];
        let mut n_finished = 0;
        while n_finished < finished.len() {
            let n_before = n_finished;
            policy.choose(world, simulator.batch(), &mut actions);
            simulator.step(&actions)?;
            let batch = simulator.batch();
            recorder.follow(world, batch);
            for (env, (running, finished)) in running.iter_mut().zip(&mut finished).enumerate() {
                if finished.is_none() && running.follow(&world.params.rig, batch, env) {
                    *finished = Some(running.finish(Ended::from_code(batch.ended[env]).unwrap_or(Ended::Running)));
                    n_finished += 1;
                }
            }
            if n_before < n_finished {
                progress(n_finished, finished.len());
            }
        }
        // A device that failed in the last step reports it here.
        simulator.wait()?;
        Ok((finished.into_iter().flatten().collect(), recorder.finish()))
    }

    /// The report of these episodes, which stand as [`Evaluation::drive`] gives them; `policy` is its name.
    pub fn summarised(&self, policy: &str, finished: &[Episode]) -> Report {
        let Evaluation { scenario, world, split, episodes, seed, device, .. } = *self;
        let rig = &world.params.rig;
        let kerbs: Vec<Outline> = scenario.places.iter().map(|place| place.roundabout.kerbs(scenario.gutter)).collect();
        let all: Vec<_> = scenario.routes().collect();
        let suffices = |&index: &u32| {
            let (roundabout, route) = all[index as usize];
            own_lane_suffices(rig, &kerbs[roundabout], &swept_path(rig, &route.centre_line, scenario.cruising_speed(), 0.25))
        };
        let routes = scenario.split(split);
        let own_lane: Vec<bool> = routes.iter().map(suffices).collect();
        let chunks = || own_lane.iter().zip(finished.chunks(episodes));
        let of_routes = |suffices: bool| {
            let kept: Vec<&Episode> = chunks().filter(|&(&own, _)| own == suffices).flat_map(|(_, chunk)| chunk).collect();
            Summary::of(kept.into_iter(), scenario.step)
        };
        let route_reports = routes.iter().zip(chunks()).filter_map(|(&route, (&own_lane_suffices, chunk))| {
            let summary = Summary::of(chunk.iter(), scenario.step)?;
            Some(RouteReport { name: world.route_names[route as usize].clone(), own_lane_suffices, summary })
        });
        Report {
            benchmark: scenario.name.clone(),
            split: split.name(),
            policy: policy.to_owned(),
            seed,
            engine: device.name.clone(),
            summary: Summary::of(finished.iter(), scenario.step).expect("a split has a route and a route an episode: both were checked"),
            own_lane_suffices: of_routes(true),
            needs_deviation: of_routes(false),
            certified: None,
            routes: route_reports.collect(),
        }
    }
}

/// One truck's episode while it runs.
struct Running {
    lane_distance_sum: f64,
    /// Its figures so far; the mean and the off-tracking follow at its end.
    episode: Episode,
    /// Path of the front axle. Its first point lies far behind the start, so that the trailer's axle is beside it from
    /// the first step on.
    front_path: Vec<Vec2>,
    trailer_path: Vec<Vec2>,
}

impl Running {
    fn new(rig: &Rig, truck: &Truck) -> Running {
        let front = front_axle(rig, truck);
        let ahead = Vec2::from_angle(truck.heading);
        Running {
            lane_distance_sum: 0.0,
            episode: Episode {
                ended: Ended::Running,
                steps: 0,
                reward: 0.0,
                lane_distance_mean: 0.0,
                lane_distance_max: 0.0,
                tractor_clearance_min: f64::INFINITY,
                trailer_clearance_min: f64::INFINITY,
                load_transfer_ratio_peak: 0.0,
                articulation_peak: 0.0,
                off_tracking_peak: 0.0,
            },
            front_path: vec![front - 2.0 * (rig.wheelbase + rig.trailer_wheelbase) * ahead, front],
            trailer_path: Vec::new(),
        }
    }

    /// Adds the last step; true if it ended the episode.
    fn follow(&mut self, rig: &Rig, batch: &Batch, env: usize) -> bool {
        let (truck, progress, clearance) = (&batch.truck[env], &batch.progress[env], &batch.clearance[env]);
        let raise = |peak: &mut f64, value: f32| *peak = peak.max(f64::from(value));
        let lower = |least: &mut f64, value: f32| *least = least.min(f64::from(value));
        self.episode.steps += 1;
        self.episode.reward += f64::from(batch.reward[env]);
        self.lane_distance_sum += f64::from(progress.lane_distance);
        raise(&mut self.episode.lane_distance_max, progress.lane_distance);
        lower(&mut self.episode.tractor_clearance_min, clearance.tractor);
        lower(&mut self.episode.trailer_clearance_min, clearance.trailer);
        raise(&mut self.episode.load_transfer_ratio_peak, truck.tractor_load_transfer_ratio.abs());
        raise(&mut self.episode.load_transfer_ratio_peak, truck.trailer_load_transfer_ratio.abs());
        raise(&mut self.episode.articulation_peak, wrapped(truck.heading - truck.trailer_heading).abs());
        self.front_path.push(front_axle(rig, truck));
        self.trailer_path.push(truck.trailer_position(rig));
        batch.ended[env] != Ended::Running as u32
    }

    fn finish(&self, ended: Ended) -> Episode {
        Episode {
            ended,
            lane_distance_mean: self.lane_distance_sum / f64::from(self.episode.steps.max(1)),
            off_tracking_peak: off_tracking(&self.front_path, &self.trailer_path),
            ..self.episode.clone()
        }
    }
}

/// Middle of the front axle \[m].
fn front_axle(rig: &Rig, truck: &Truck) -> Vec2 {
    truck.position + rig.wheelbase * Vec2::from_angle(truck.heading)
}

/// Largest distance of a point of `trailer` from the path `front` \[m]. The trailer follows the path in order, so the
/// search for the nearest segment only moves forwards.
fn off_tracking(front: &[Vec2], trailer: &[Vec2]) -> f64 {
    let distance = |point: Vec2, index: usize| f64::from(offtrack::cpu::follow::distance_to_segment(point, front[index], front[index + 1]));
    let mut index = 0;
    let mut most = 0.0f64;
    for &point in trailer {
        while index + 2 < front.len() && distance(point, index + 1) <= distance(point, index) {
            index += 1;
        }
        most = most.max(distance(point, index));
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trailer_on_a_smaller_circle_is_off_by_the_difference_of_the_radii() {
        let circle = |radius: f32, lag: f32| (0..200).map(move |i| radius * Vec2::from_angle(0.02 * i as f32 - lag)).collect::<Vec<_>>();
        let (front, trailer) = (circle(20.0, 0.0), circle(18.0, 0.5));
        // The chords of the path lie up to 1 mm inside its circle. The first points lie behind the path's beginning.
        assert!((off_tracking(&front, &trailer[30..]) - 2.0).abs() < 2e-3);
    }
}
