//! A recording: the states of one truck through an episode, step by step, independent of any picture of it.
//!
//! Frame 0 is the start, before any action; frame n is the state after step n, up to and including the step that ended
//! the episode. A recording shows the road as it lies in the world: that of a road with left-hand traffic, which is
//! driven as its mirror image, is mirrored back. Numbers are rounded when they are recorded (lengths to 1 mm, angles to
//! 0.1 mrad), so that a file holds the recording exactly.

mod measures;
mod vehicles;

use offtrack::layout::angle::wrapped;
use offtrack::layout::{Clearance, Command, Ended, N_RAYS, N_TRAILER_RAYS};
use offtrack::map::route::Route;
use offtrack::map::{Gutter, Road};
use offtrack::physics;
use offtrack::scenario::Scenario;
use offtrack::simulator::Batch;
use offtrack::world::World;
use serde::{Deserialize, Serialize};

use crate::polygons::{self, Polygon};
pub use measures::{Class, Measures, Rectangle};
pub(crate) use vehicles::BRAKES;
pub use vehicles::Vehicle;

/// Resolution of lengths, speeds, rewards and load transfer ratios: parts of a unit.
const MILLI: f64 = 1e3;
/// Resolution of angles, parts of a radian: about a millimetre at the end of a trailer.
const ANGLE: f64 = 1e4;

/// One truck after one step, less than 250 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Middle of the drive axle, x east, y north (m).
    pub position: [f32; 2],
    /// Heading of the tractor, counter-clockwise from east, in (-pi, pi] (rad).
    pub heading: f32,
    /// Middle of the trailer's axle group (m).
    pub trailer_position: [f32; 2],
    /// Heading of the trailer (rad).
    pub trailer_heading: f32,
    /// Tractor's heading minus the trailer's, in (-pi, pi] (rad).
    pub articulation: f32,
    /// Steer angle of the front axle, left positive (rad).
    pub steering: f32,
    /// Speed of the drive axle (m/s).
    pub speed: f32,
    /// Index of the last action in the action table; `None` at the start, and where actions are continuous.
    pub action: Option<u32>,
    /// The last command, steer angle over the lock and speed, where actions are continuous; `None` at the start.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub command: Option<[f32; 2]>,
    /// Distance from the reference point to the lane centre (m).
    pub lane_distance: f32,
    /// Distance from the tractor's outline to the nearest kerb, negative where they overlap (m).
    pub tractor_clearance: f32,
    /// Distance from the trailer's outline to the nearest kerb (m).
    pub trailer_clearance: f32,
    /// Load transfer ratio of the tractor, the largest of the step in magnitude, signed.
    pub tractor_load_transfer_ratio: f32,
    /// Load transfer ratio of the trailer, the largest of the step in magnitude, signed.
    pub trailer_load_transfer_ratio: f32,
    /// Reward of the step; 0 at the start.
    pub reward: f32,
    /// Distance along each ray to the kerb, the trailer's 16 first, left and right alternating, front to rear, then the
    /// tractor's 13 from left to right (m).
    pub ranges: [f32; N_RAYS],
}

impl Frame {
    /// Truck `env` after the last step.
    fn after_step(world: &World, batch: &Batch, env: usize) -> Frame {
        let Command { steering, speed } = batch.command[env];
        let is_continuous = world.is_continuous();
        Frame {
            action: (!is_continuous).then_some(batch.action[env]),
            command: is_continuous.then_some([steering, speed]),
            reward: to(MILLI, batch.reward[env]),
            ..Frame::new(world, batch, env, batch.clearance[env])
        }
    }

    /// Truck `env` after a reset. A reset computes no clearance, so it is computed here.
    fn at_start(world: &World, batch: &Batch, env: usize) -> Frame {
        let truck = &batch.truck[env];
        Frame::new(world, batch, env, physics::clearance(world.unit_fields(truck.route), world.rig(truck), truck))
    }

    fn new(world: &World, batch: &Batch, env: usize, clearance: Clearance) -> Frame {
        let truck = &batch.truck[env];
        Frame {
            position: truck.position.to_array().map(|value| to(MILLI, value)),
            heading: to(ANGLE, truck.heading),
            trailer_position: truck.trailer_position(world.rig(truck)).to_array().map(|value| to(MILLI, value)),
            trailer_heading: to(ANGLE, truck.trailer_heading),
            articulation: to(ANGLE, wrapped(truck.heading - truck.trailer_heading)),
            steering: to(ANGLE, truck.steering),
            speed: to(MILLI, truck.speed),
            action: None,
            command: None,
            lane_distance: to(MILLI, batch.progress[env].lane_distance),
            tractor_clearance: to(MILLI, clearance.tractor),
            trailer_clearance: to(MILLI, clearance.trailer),
            tractor_load_transfer_ratio: to(MILLI, truck.tractor_load_transfer_ratio),
            trailer_load_transfer_ratio: to(MILLI, truck.trailer_load_transfer_ratio),
            reward: 0.0,
            ranges: batch.ranges[env].map(|range| to(MILLI, range)),
        }
    }
}

impl Frame {
    /// The larger load transfer ratio of both units, without its sign.
    pub fn load_transfer_ratio(&self) -> f32 {
        self.tractor_load_transfer_ratio.abs().max(self.trailer_load_transfer_ratio.abs())
    }

    /// The frame in the mirror image of its world: left is right. Pairs of rays stay in their order.
    #[must_use]
    pub fn mirrored(&self) -> Frame {
        let across = |[x, y]: [f32; 2]| [x, 0.0 - y];
        let negated = |value: f32| 0.0 - value;
        let mut ranges = self.ranges;
        let (trailer, tractor) = ranges.split_at_mut(N_TRAILER_RAYS);
        trailer.chunks_exact_mut(2).for_each(|pair| pair.swap(0, 1));
        tractor.reverse();
        Frame {
            position: across(self.position),
            heading: negated(self.heading),
            trailer_position: across(self.trailer_position),
            trailer_heading: negated(self.trailer_heading),
            articulation: negated(self.articulation),
            steering: negated(self.steering),
            command: self.command.map(|[steering, speed]| [negated(steering), speed]),
            tractor_load_transfer_ratio: negated(self.tractor_load_transfer_ratio),
            trailer_load_transfer_ratio: negated(self.trailer_load_transfer_ratio),
            ranges,
            ..*self
        }
    }
}

/// One truck's episode.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// The truck's index in its batch.
    pub env: usize,
    /// The truck's vehicle in this episode: a row of the world's `rigs`.
    pub vehicle: u32,
    /// Why the episode ended; `Running` before its end.
    pub ended: Ended,
    /// The start, then one frame a step.
    pub frames: Vec<Frame>,
    /// The other vehicles of each frame; empty where there are none.
    pub vehicles: Vec<Vec<Vehicle>>,
}

impl Track {
    /// The episode as it lies in the world: mirrored back where the road is driven as its mirror image.
    #[must_use]
    pub fn seen(mut self, roundabout: &Road) -> Track {
        if roundabout.is_mirrored() {
            self.frames.iter_mut().for_each(|frame| *frame = frame.mirrored());
            self.vehicles.iter_mut().flatten().for_each(|vehicle| *vehicle = vehicle.mirrored());
        }
        self
    }
}

/// Records some trucks of a batch while it is stepped, in the world that is driven; [`Track::seen`] mirrors back. Made
/// for [`offtrack::simulator::RouteChoice::Fixed`], where a truck is held after its episode: the first episode of each
/// truck is kept.
#[derive(Debug)]
pub struct Recorder {
    tracks: Vec<Track>,
}

impl Recorder {
    /// Records the start; the batch has just been reset.
    pub fn new(world: &World, batch: &Batch, envs: impl IntoIterator<Item = usize>) -> Recorder {
        let track = |env: usize| {
            let (vehicle, start) = (batch.truck[env].vehicle, Frame::at_start(world, batch, env));
            let vehicles =
                world.traffic.iter().map(|_| Vehicle::around(world, &batch.truck, &batch.cars, env)).collect();
            Track { env, vehicle, ended: Ended::Running, frames: vec![start], vehicles }
        };
        Recorder { tracks: envs.into_iter().map(track).collect() }
    }

    /// Records the last step of the trucks whose episode has not ended.
    pub fn follow(&mut self, world: &World, batch: &Batch) {
        for track in self.tracks.iter_mut().filter(|track| track.ended == Ended::Running) {
            track.frames.push(Frame::after_step(world, batch, track.env));
            track
                .vehicles
                .extend(world.traffic.iter().map(|_| Vehicle::around(world, &batch.truck, &batch.cars, track.env)));
            track.ended = Ended::of_column(batch.ended[track.env]);
        }
    }

    /// Whether an episode has not ended yet.
    pub fn is_running(&self) -> bool {
        self.tracks.iter().any(|track| track.ended == Ended::Running)
    }

    /// The episodes, in the order of `envs`.
    pub fn finish(self) -> Vec<Track> {
        self.tracks
    }
}

/// A roundabout as lines of points (m).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Map {
    /// Polygons around the drivable area: the outer boundary counter-clockwise, then each island clockwise, without a
    /// repeated first point. A point is drivable if an odd number of them contain it.
    pub drivable: Vec<Polygon>,
    /// The lanes' centre lines.
    pub lanes: Vec<Polygon>,
}

impl Map {
    /// Of a roundabout as it lies in the world; `gutter` says whether gutters are drivable. Points lie within 1 cm of
    /// the curves.
    pub fn of(roundabout: &Road, gutter: Gutter) -> Map {
        let roundabout = roundabout.seen();
        Map {
            drivable: polygons::drivable(&roundabout.kerbs(gutter)),
            lanes: roundabout.lanes().iter().map(polygons::line).collect(),
        }
    }
}

/// The centre line of a roundabout's route as it lies in the world, as points within 1 cm of it (m).
pub fn centre_line(roundabout: &Road, route: &Route) -> Polygon {
    polygons::line(&roundabout.seen_route(route).centre_line)
}

/// One episode with all data that a picture of it needs; the JSON of the command `record`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recording {
    /// The benchmark's name.
    pub benchmark: String,
    /// The route's name.
    pub route: String,
    /// Name of the policy.
    pub policy: String,
    /// Seed of the start pose.
    pub seed: u32,
    /// Index of the episode among those of its route in an evaluation with that seed.
    pub episode: usize,
    /// Episodes on each route in that evaluation: the start pose depends on it.
    pub episodes: usize,
    /// Time between two frames (s).
    pub step: f64,
    /// Why the episode ended, by its name in reports.
    pub ended: String,
    /// The names of vehicle and load; `None` where the benchmark has one vehicle.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub class: Option<Class>,
    /// The truck.
    pub vehicle: Measures,
    /// The action table: steer angle, left positive (rad), and speed asked for (m/s); where actions are continuous what
    /// commands of -1 and of 1 ask for.
    pub actions: Vec<[f32; 2]>,
    /// The roundabout.
    pub map: Map,
    /// The route's centre line (m).
    pub centre_line: Polygon,
    /// The start, then one frame a step.
    pub frames: Vec<Frame>,
    /// The other vehicles of each frame; absent where there are none.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub vehicles: Vec<Vec<Vehicle>>,
}

/// What an episode that is recorded belongs to.
#[derive(Debug, Clone, Copy)]
pub struct Of<'a, 'b> {
    /// The benchmark.
    pub scenario: &'a Scenario,
    /// The benchmark, baked.
    pub world: &'b World,
    /// The route's roundabout.
    pub roundabout: &'a Road,
    /// The route.
    pub route: &'a Route,
    /// The policy's name.
    pub policy: &'b str,
    /// Seed of the start pose.
    pub seed: u32,
}

impl Of<'_, '_> {
    /// The recording of a track, which is as it lies in the world: episode `episode` of the `episodes` that the
    /// evaluation has on this route.
    pub fn recording(&self, episode: usize, episodes: usize, track: Track) -> Recording {
        let Of { scenario, world, roundabout, route, policy, seed } = *self;
        // In a mirror an index stays and its angle changes its sign; a command changes its own.
        let turns = roundabout.is_mirrored() && !world.is_continuous();
        let steering = |angle: f32| if turns { 0.0 - angle } else { angle };
        Recording {
            benchmark: scenario.name.clone(),
            route: route.name.clone(),
            policy: policy.to_owned(),
            seed,
            episode,
            episodes,
            step: scenario.step,
            ended: track.ended.name().to_owned(),
            class: Class::of(world, track.vehicle),
            vehicle: Measures::of(world, track.vehicle).seen(roundabout),
            actions: world.actions.iter().map(|action| [steering(action.steering), action.speed]).collect(),
            map: Map::of(roundabout, scenario.gutter),
            centre_line: centre_line(roundabout, route),
            frames: track.frames,
            vehicles: track.vehicles,
        }
    }
}

/// `value` rounded to `parts` of a unit. A zero has no sign.
fn to(parts: f64, value: f32) -> f32 {
    ((f64::from(value) * parts).round() / parts) as f32 + 0.0
}

#[cfg(test)]
mod tests;
