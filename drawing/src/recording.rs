//! An episode kept to look at: where a truck was and what it did, step by step, apart from any picture of it.
//!
//! Frame 0 is the start, before any action; every later frame is what one action led to, up to and with the step that ended the episode.
//! Numbers are rounded once, when they are taken (lengths to 1 mm, angles to 0.1 mrad), so that a file holds exactly what memory does.

use offtrack::angle::wrapped;
use offtrack::cpu::collide;
use offtrack::layout::{Body, Clearance, Ended, N_RAYS, N_TRAILER_RAYS, Ray};
use offtrack::roundabout::{Gutter, Roundabout};
use offtrack::route::Route;
use offtrack::simulator::Batch;
use offtrack::world::World;
use serde::{Deserialize, Serialize};

use crate::polygons::{self, Polygon};

/// Parts of a metre, a metre a second, a unit of reward or load transfer ratio that are kept.
const MILLI: f64 = 1e3;
/// Parts of a radian that are kept: at the end of a trailer they are a millimetre.
const ANGLE: f64 = 1e4;

/// One truck after one step. Plain values: a copy costs less than 250 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Middle of the drive axle, x east, y north [m].
    pub position: [f32; 2],
    /// Of the tractor, counter-clockwise from east, in (-pi, pi] [rad].
    pub heading: f32,
    /// Middle of the trailer's axle group [m].
    pub trailer_position: [f32; 2],
    /// Of the trailer [rad].
    pub trailer_heading: f32,
    /// Tractor's heading minus the trailer's, in (-pi, pi] [rad].
    pub articulation: f32,
    /// Of the front axle, left positive [rad].
    pub steering: f32,
    /// Of the drive axle [m/s].
    pub speed: f32,
    /// Index into the action table of what led here; none at the start.
    pub action: Option<u32>,
    /// From the reference point to the lane centre [m].
    pub lane_distance: f32,
    /// From the tractor's outline to the nearest kerb, negative where they overlap [m].
    pub tractor_clearance: f32,
    /// From the trailer's outline to the nearest kerb [m].
    pub trailer_clearance: f32,
    /// Of the tractor, the largest of the step in magnitude, signed.
    pub tractor_load_transfer_ratio: f32,
    /// Of the trailer, the largest of the step in magnitude, signed.
    pub trailer_load_transfer_ratio: f32,
    /// Of the step; 0 at the start.
    pub reward: f32,
    /// Distance along each ray to the kerb, the trailer's 16 first, left and right alternating, front to rear, then the tractor's 13 from
    /// left to right [m].
    pub ranges: [f32; N_RAYS],
}

impl Frame {
    /// Truck `env` as the last step left it.
    fn after_step(world: &World, batch: &Batch, env: usize) -> Frame {
        Frame {
            action: Some(batch.action[env]),
            reward: to(MILLI, batch.reward[env]),
            ..Frame::new(world, batch, env, batch.clearance[env])
        }
    }

    /// Truck `env` as a reset left it. A reset measures no clearance, so it is measured here.
    fn at_start(world: &World, batch: &Batch, env: usize) -> Frame {
        let truck = &batch.truck[env];
        Frame::new(world, batch, env, collide::clearance(world.route_field(truck.route), &world.params.rig, truck))
    }

    fn new(world: &World, batch: &Batch, env: usize, clearance: Clearance) -> Frame {
        let truck = &batch.truck[env];
        Frame {
            position: truck.position.to_array().map(|value| to(MILLI, value)),
            heading: to(ANGLE, truck.heading),
            trailer_position: truck.trailer_position(&world.params.rig).to_array().map(|value| to(MILLI, value)),
            trailer_heading: to(ANGLE, truck.trailer_heading),
            articulation: to(ANGLE, wrapped(truck.heading - truck.trailer_heading)),
            steering: to(ANGLE, truck.steering),
            speed: to(MILLI, truck.speed),
            action: None,
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

/// One truck's episode.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// The truck's place in its batch.
    pub env: usize,
    /// Why the episode ended; running while it has not.
    pub ended: Ended,
    /// The start, then one frame a step.
    pub frames: Vec<Frame>,
}

/// Takes frames of some trucks of a batch while it is stepped. Made for [`offtrack::simulator::RouteChoice::Fixed`], where a truck is held
/// where its episode ended: of each truck the first episode is kept.
#[derive(Debug)]
pub struct Recorder {
    tracks: Vec<Track>,
}

impl Recorder {
    /// Begins with the batch as it was reset.
    pub fn new(world: &World, batch: &Batch, envs: impl IntoIterator<Item = usize>) -> Recorder {
        let track = |env| Track { env, ended: Ended::Running, frames: vec![Frame::at_start(world, batch, env)] };
        Recorder { tracks: envs.into_iter().map(track).collect() }
    }

    /// Takes the step just made. Trucks whose episode has ended are left alone.
    pub fn follow(&mut self, world: &World, batch: &Batch) {
        for track in self.tracks.iter_mut().filter(|track| track.ended == Ended::Running) {
            track.frames.push(Frame::after_step(world, batch, track.env));
            track.ended = Ended::from_code(batch.ended[track.env]).unwrap_or(Ended::Running);
        }
    }

    /// Whether an episode is still under way.
    pub fn is_running(&self) -> bool {
        self.tracks.iter().any(|track| track.ended == Ended::Running)
    }

    /// What was recorded, in the order asked for.
    pub fn finish(self) -> Vec<Track> {
        self.tracks
    }
}

/// A rectangle in its unit's frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rectangle {
    /// Front end, ahead of the frame's origin [m].
    pub front: f32,
    /// Rear end, ahead of the frame's origin (negative when behind) [m].
    pub rear: f32,
    /// Half of the width [m].
    pub half_width: f32,
}

impl From<Rectangle> for Body {
    fn from(Rectangle { front, rear, half_width }: Rectangle) -> Body {
        Body { front, rear, half_width }
    }
}

/// What it takes to draw the truck of a frame. The tractor's frame stands at `position`, the trailer's at `trailer_position`, x forward,
/// y left.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// Front axle ahead of the drive axle [m].
    pub wheelbase: f32,
    /// Fifth wheel ahead of the drive axle [m].
    pub fifth_wheel: f32,
    /// Kingpin ahead of the trailer's axle group [m].
    pub trailer_wheelbase: f32,
    /// The tractor's outline.
    pub tractor_body: Rectangle,
    /// The trailer's outline.
    pub trailer_body: Rectangle,
    /// The trailer's sensors in the order of `ranges`: mount and unit vector, x, y, dx, dy.
    pub trailer_rays: Vec<[f32; 4]>,
    /// The tractor's.
    pub tractor_rays: Vec<[f32; 4]>,
    /// Reach of a sensor [m].
    pub sensor_range: f32,
}

impl Measures {
    /// Of the vehicle of a world.
    pub fn of(world: &World) -> Measures {
        let rig = &world.params.rig;
        let body =
            |body: &Body| Rectangle { front: to(MILLI, body.front), rear: to(MILLI, body.rear), half_width: to(MILLI, body.half_width) };
        let ray = |ray: &Ray| [to(MILLI, ray.origin.x), to(MILLI, ray.origin.y), to(1e6, ray.direction.x), to(1e6, ray.direction.y)];
        let (trailer, tractor) = world.rays.split_at(N_TRAILER_RAYS);
        Measures {
            wheelbase: to(MILLI, rig.wheelbase),
            fifth_wheel: to(MILLI, rig.fifth_wheel),
            trailer_wheelbase: to(MILLI, rig.trailer_wheelbase),
            tractor_body: body(&rig.tractor_body),
            trailer_body: body(&rig.trailer_body),
            trailer_rays: trailer.iter().map(ray).collect(),
            tractor_rays: tractor.iter().map(ray).collect(),
            sensor_range: world.params.sensor_range,
        }
    }
}

/// A roundabout as lines of points [m].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Map {
    /// The edges of what can be driven on: the outer boundary counter-clockwise, then each island clockwise, no first point repeated. A
    /// point is drivable when an odd number of them contain it.
    pub drivable: Vec<Polygon>,
    /// The lanes' centre lines.
    pub lanes: Vec<Polygon>,
}

impl Map {
    /// Of a roundabout whose gutters are road or not. Points are within 1 cm of the curves.
    pub fn of(roundabout: &Roundabout, gutter: Gutter) -> Map {
        Map { drivable: polygons::drivable(&roundabout.kerbs(gutter)), lanes: roundabout.lanes().iter().map(polygons::line).collect() }
    }
}

/// A route's centre line as points within 1 cm of it [m].
pub fn centre_line(route: &Route) -> Polygon {
    polygons::line(&route.centre_line)
}

/// One episode with all that it takes to draw it, as `record` writes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recording {
    /// The benchmark's name.
    pub benchmark: String,
    /// The route's name.
    pub route: String,
    /// Who drove.
    pub policy: String,
    /// What the start pose was drawn from.
    pub seed: u32,
    /// Which of the route's episodes in an examination with that seed, from 0.
    pub episode: usize,
    /// How many episodes a route that examination has: the start pose depends on it.
    pub episodes: usize,
    /// Time between two frames [s].
    pub step: f64,
    /// Why the episode ended, as reports name it.
    pub ended: String,
    /// The truck.
    pub vehicle: Measures,
    /// The action table: steer angle [rad] and speed asked for [m/s].
    pub actions: Vec<[f32; 2]>,
    /// The roundabout.
    pub map: Map,
    /// The route's centre line [m].
    pub centre_line: Polygon,
    /// The start, then one frame a step.
    pub frames: Vec<Frame>,
}

/// `value` in whole parts of a unit. A zero has no sign.
fn to(parts: f64, value: f32) -> f32 {
    ((f64::from(value) * parts).round() / parts) as f32 + 0.0
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use offtrack::scenario::{Scenario, Split};
    use offtrack::simulator::{RouteChoice, Simulator};

    use super::*;

    fn scenario() -> Scenario {
        Scenario::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/attard2023.toml")).unwrap()
    }

    /// Trucks on the first two routes of the examination that steer hard left until each has met a kerb: recorded, and their states
    /// copied from the batch after every step.
    fn driven(scenario: &Scenario) -> (Arc<World>, Vec<Track>, Vec<Batch>) {
        let world = Arc::new(World::bake(scenario).unwrap());
        let routes = scenario.split(Split::Test)[..2].to_vec();
        let mut simulator = Simulator::new(world.clone(), 2, 3, RouteChoice::Fixed(routes)).unwrap();
        let mut recorder = Recorder::new(&world, simulator.batch(), [1, 0]);
        let mut states = vec![simulator.batch().clone()];
        while recorder.is_running() {
            simulator.step(&[8, 6]).unwrap();
            recorder.follow(&world, simulator.batch());
            states.push(simulator.batch().clone());
        }
        (world, recorder.finish(), states)
    }

    #[test]
    fn frames_are_the_simulators_states_from_the_start_to_the_step_that_ends_the_episode() {
        let (world, tracks, states) = driven(&scenario());
        assert_eq!(tracks.iter().map(|track| track.env).collect::<Vec<_>>(), [1, 0]);
        assert_ne!(tracks[0].frames.len(), tracks[1].frames.len(), "one truck is held while the other still drives");
        for Track { env, ended, frames } in tracks {
            let last = &states[frames.len() - 1];
            assert_eq!((ended as u32, frames.len()), (last.ended[env], last.truck[env].steps as usize + 1));
            assert!(ended.failed(), "{ended:?}");
            for (n, (frame, batch)) in frames.iter().zip(&states).enumerate() {
                let truck = &batch.truck[env];
                // Half of a rounding step, and as much again for f32 at 60 m.
                let same = |parts: f64, a: f32, b: f32| assert!(f64::from((a - b).abs()) <= 0.51 / parts + 4e-6, "frame {n}: {a} {b}");
                same(MILLI, frame.position[0], truck.position.x);
                same(MILLI, frame.position[1], truck.position.y);
                same(MILLI, frame.trailer_position[0], truck.trailer_position(&world.params.rig).x);
                same(ANGLE, frame.trailer_heading, truck.trailer_heading);
                same(ANGLE, frame.articulation, wrapped(truck.heading - truck.trailer_heading));
                same(ANGLE, frame.steering, truck.steering);
                same(MILLI, frame.lane_distance, batch.progress[env].lane_distance);
                same(MILLI, frame.ranges[28], batch.ranges[env][28]);
                same(MILLI, frame.trailer_load_transfer_ratio, truck.trailer_load_transfer_ratio);
                if n == 0 {
                    assert_eq!((frame.action, frame.reward), (None, 0.0));
                } else {
                    assert_eq!(frame.action, Some([8, 6][env]));
                    same(MILLI, frame.reward, batch.reward[env]);
                    same(MILLI, frame.tractor_clearance, batch.clearance[env].tractor);
                }
            }
            // At the start nothing has measured the clearance yet; a truck in its lane is clear of the kerbs.
            assert!(0.3 < frames[0].tractor_clearance && 0.3 < frames[0].trailer_clearance);
        }
    }

    #[test]
    fn a_recording_read_back_is_the_recording() {
        let scenario = scenario();
        let (world, mut tracks, _) = driven(&scenario);
        let (place, route) = scenario.routes().nth(scenario.split(Split::Test)[1] as usize).unwrap();
        let recording = Recording {
            benchmark: scenario.name.clone(),
            route: route.name.clone(),
            policy: "pursuit".to_owned(),
            seed: 3,
            episode: 0,
            episodes: 1,
            step: scenario.step,
            ended: tracks[0].ended.name().to_owned(),
            vehicle: Measures::of(&world),
            actions: world.actions.iter().map(|action| [action.steering, action.speed]).collect(),
            map: Map::of(&scenario.places[place].roundabout, scenario.gutter),
            centre_line: centre_line(route),
            frames: tracks.remove(0).frames,
        };
        let text = serde_json::to_string(&recording).unwrap();
        assert_eq!(serde_json::from_str::<Recording>(&text).unwrap(), recording);
    }
}
