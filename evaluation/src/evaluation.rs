//! Evaluates a policy: a number of episodes on every route of a split, every one counted.

use std::path::Path;
use std::sync::Arc;

use crate::recording::{Recorder, Track};
use offtrack::layout::{Rig, Start, Stream};
use offtrack::map::route::Route;
use offtrack::physics::drawn_start;
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{RouteChoice, Simulator};
use offtrack::vehicle::swept::{own_lane_suffices, steer_angle_max, swept_path};
use offtrack::world::World;

use rayon::prelude::*;

use crate::classes;
use crate::device::Device;
use crate::episodes::Episodes;
use crate::error::Error;
use crate::figures::Figures;
use crate::groups::{Evaluated, Groups};
use crate::policies::Controller;
use crate::possible::Possible;
use crate::report::{Episode, Report, RouteReport, Summary};
use crate::seen::Seen;
use crate::sequences::Sequences;
use crate::shown::shown;

/// Episodes on each of so many routes where nobody says how many: 30, and fewer on more than 100 routes, about 3,000 in
/// all.
pub fn usual_episodes(n_routes: usize) -> usize {
    (3000 / n_routes.max(1)).clamp(1, 30)
}

/// What a policy is evaluated on: a number of episodes on every route of a split, all in one batch, one episode a
/// truck.
#[derive(Debug, Clone, Copy)]
pub struct Evaluation<'a> {
    /// The benchmark.
    pub scenario: &'a Scenario,
    /// The benchmark, baked.
    pub world: &'a Arc<World>,
    /// The split whose routes are driven.
    pub split: Split,
    /// Episodes on each route.
    pub episodes: usize,
    /// Seed of the start poses.
    pub seed: u32,
    /// Whether every state of the episodes that a page shows is kept.
    pub record: bool,
    /// What steps the trucks.
    pub device: &'a Device,
}

/// The episodes of an evaluation.
#[derive(Debug)]
pub struct Driven {
    /// The figures of each, route by route in the order of the split.
    pub episodes: Vec<Episode>,
    /// If recorded, every state of those that a page shows; `env` is an index into `episodes`.
    pub tracks: Vec<Track>,
    /// The actions of each, with which it can be driven again.
    pub sequences: Sequences,
}

impl Evaluation<'_> {
    /// The policy's report and, if recorded, the episodes that a page shows. `progress` is as in [`Evaluation::drive`].
    pub fn report(
        &self,
        policy: &mut dyn Controller,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<(Report, Vec<Track>), Error> {
        let driven = self.drive(policy, progress)?;
        Ok((self.summarised(policy.name(), &driven.episodes, None), driven.tracks))
    }

    /// Drives every episode. `progress` is called with the number of finished episodes and the number of all, after
    /// each step that finished one.
    ///
    /// No states are held while the policy drives, only its actions. The episodes to be shown are chosen once it is
    /// known which failed, and recorded as they are driven again.
    pub fn drive(&self, policy: &mut dyn Controller, progress: &mut dyn FnMut(usize, usize)) -> Result<Driven, Error> {
        let begun = self.begin()?;
        let n_episodes = begun.simulator().n_envs();
        let routes = self.scenario.split(self.split);
        let mut figures = Figures::begin(self.scenario, self.world, routes, self.episodes, begun.simulator())?;
        let mut sequences = Sequences::new(self.world, n_episodes);
        let mut n_finished = 0;
        begun.drive(|simulator| {
            policy.step(simulator)?;
            let seen = Seen::of(simulator)?;
            sequences.add(&seen, figures.finished());
            let n_ended = figures.add(&seen);
            n_finished += n_ended;
            if 0 < n_ended {
                progress(n_finished, n_episodes);
            }
            Ok::<(), Error>(())
        })?;
        let episodes = figures.finish();
        let tracks = if self.record { self.repeated(&sequences, &shown(&episodes))? } else { Vec::new() };
        Ok(Driven { episodes, tracks, sequences })
    }

    /// One truck an episode, at its start.
    fn begin(&self) -> Result<Episodes, Error> {
        let Evaluation { scenario, world, split, episodes, seed, device, .. } = *self;
        let routes = scenario.split(split);
        if routes.is_empty() {
            let value = split.name().to_owned();
            return Err(Error::Setting {
                name: "split",
                value,
                expected: format!("the benchmark {} has no such routes", scenario.name),
            });
        }
        if 1 < world.group() {
            let message =
                format!("traffic.group: {}; an evaluation drives trucks alone: leave the key out", world.group());
            return Err(Error::contents(Path::new(&scenario.name), message));
        }
        Ok(Episodes::begin(device.engine.clone(), world.clone(), routes, episodes, seed)?)
    }

    /// Records the episodes at these indices as they are driven again: the same actions from the same start give the
    /// same states, to the last bit; tracks are as they lie in the world. `env` of a track is the episode's index.
    pub fn repeated(&self, sequences: &Sequences, indices: &[usize]) -> Result<Vec<Track>, Error> {
        if indices.is_empty() {
            return Ok(Vec::new());
        }
        let (routes, starts): (Vec<u32>, Vec<Start>) = indices.iter().map(|&index| self.start(index)).unzip();
        let engine = self.device.engine.clone();
        let mut simulator =
            Simulator::on(engine, self.world.clone(), indices.len(), self.seed, RouteChoice::Fixed(routes))?;
        // Vehicles around a truck, and what disturbs it, are drawn by its place among all.
        let stream = |&index: &usize| Stream { seed: self.seed, env: index as u32 };
        simulator.set_streams(&indices.iter().map(stream).collect::<Vec<Stream>>())?;
        simulator.reset_from(&starts)?;
        let mut recorder = Recorder::new(self.world, simulator.batch(), 0..indices.len());
        for step in 0.. {
            if !recorder.is_running() {
                break;
            }
            simulator.step_any(&sequences.at(step, indices))?;
            recorder.follow(self.world, simulator.batch());
        }
        simulator.wait()?;
        let routes = self.routes();
        let seen =
            |(track, &env): (Track, &usize)| Track { env, ..track.seen(&routes[env / self.episodes].1.roundabout) };
        Ok(recorder.finish().into_iter().zip(indices).map(seen).collect())
    }

    /// The report of these episodes, which stand as [`Evaluation::drive`] gives them. `policy` is its name, and
    /// `searched` is what [`Evaluation::possible`] found, `None` without a search.
    pub fn summarised(&self, policy: &str, finished: &[Episode], searched: Option<(Possible, Vec<bool>)>) -> Report {
        let Evaluation { scenario, split, episodes, seed, device, .. } = *self;
        let routes = self.routes();
        let own_lane = self.own_lane_suffices(&routes);
        let chunks = || own_lane.iter().zip(finished.chunks(episodes));
        let of_routes = |suffices: bool| {
            let kept: Vec<&Episode> =
                chunks().filter(|&(&own, _)| own == suffices).flat_map(|(_, chunk)| chunk).collect();
            Summary::of(kept.into_iter(), scenario.step)
        };
        let route_reports =
            routes.iter().zip(chunks()).filter_map(|(&(_, place, route), (&own_lane_suffices, chunk))| {
                let summary = Summary::of(chunk.iter(), scenario.step)?;
                Some(RouteReport {
                    name: route.name.clone(),
                    own_lane_suffices,
                    island_radius: place.roundabout.has_ring().then(|| place.roundabout.island_radius()),
                    summary,
                })
            });
        let (possible, is_possible) = searched.unzip();
        let is_possible = is_possible.as_deref();
        Report {
            benchmark: scenario.name.clone(),
            split: split.name(),
            policy: policy.to_owned(),
            seed,
            engine: device.name.clone(),
            summary: Summary::of(finished.iter(), scenario.step)
                .expect("a split has a route and a route an episode: both were checked"),
            own_lane_suffices: of_routes(true),
            needs_deviation: of_routes(false),
            certified: None,
            possible,
            avoidable: None,
            failures: self.failures(finished, is_possible),
            classes: classes::classes(scenario, self.world, finished, is_possible),
            groups: Groups::of(&routes, finished, scenario.step),
            routes: route_reports.collect(),
        }
    }

    /// The routes of the split, in its order.
    pub(crate) fn routes(&self) -> Vec<Evaluated<'_>> {
        routes_of(self.scenario, self.scenario.split(self.split))
    }

    /// The route of an episode as an index of the world, and its start.
    pub(crate) fn start(&self, episode: usize) -> (u32, Start) {
        (
            self.scenario.split(self.split)[episode / self.episodes],
            drawn_start(&self.world.params, self.seed, episode as u32, 0),
        )
    }

    /// Whether the own lane suffices on each route: for the truck that needs most room, and within the lock of the one
    /// that steers least. Each thread holds the kerbs of one roundabout.
    fn own_lane_suffices(&self, routes: &[Evaluated]) -> Vec<bool> {
        const SPACING: f64 = 0.25;
        let Evaluation { scenario, world, .. } = *self;
        let (rig, stiffest, speed) = (widest(&world.rigs), stiffest(&world.rigs), scenario.cruising_speed());
        let of_one_place: Vec<_> = routes.chunk_by(|(a, ..), (b, ..)| a == b).collect();
        let suffices = |routes: &&[Evaluated]| {
            let kerbs = routes[0].1.roundabout.unit_kerbs_beyond_ends(scenario.gutter);
            let of_route = |route: &Route| {
                let path = |rig: &Rig| swept_path(rig, &route.centre_line, speed, SPACING);
                let steered = || steer_angle_max(stiffest, &route.centre_line, &path(stiffest), speed, SPACING);
                own_lane_suffices(rig, kerbs.both(), &path(rig)) && steered() <= stiffest.steer_max.into()
            };
            routes.iter().map(|(_, _, route)| of_route(route)).collect::<Vec<bool>>()
        };
        of_one_place.par_iter().flat_map_iter(suffices).collect()
    }
}

/// The routes of these indices, in their order.
pub(crate) fn routes_of<'a>(scenario: &'a Scenario, routes: &[u32]) -> Vec<Evaluated<'a>> {
    let all: Vec<Evaluated> = scenario.routes().map(|(index, route)| (index, &scenario.places[index], route)).collect();
    routes.iter().map(|&route| all[route as usize]).collect()
}

/// The truck whose trailer's axle cuts a circle of the front axle most: their squared radii differ by the sum of the
/// squared wheelbases less the square of the fifth wheel's distance from the drive axle.
fn widest(rigs: &[Rig]) -> &Rig {
    let cut = |rig: &Rig| rig.wheelbase.powi(2) - rig.fifth_wheel.powi(2) + rig.trailer_wheelbase.powi(2);
    rigs.iter().max_by(|a, b| cut(a).total_cmp(&cut(b))).expect("a world has a truck")
}

/// The truck with the widest circle at its lock.
fn stiffest(rigs: &[Rig]) -> &Rig {
    let radius = |rig: &Rig| rig.wheelbase / rig.steer_max.sin();
    rigs.iter().max_by(|a, b| radius(a).total_cmp(&radius(b))).expect("a world has a truck")
}
