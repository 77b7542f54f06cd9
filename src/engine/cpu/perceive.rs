//! What a policy is told of a truck where that differs from what is: its pose late and off, its sensors noisy, its
//! route misplaced.
//!
//! Collisions, progress and reward go by what is. Every number is a function of (seed, env, episode, step).

use glam::Vec2;

use crate::engine::Row;
use crate::engine::cpu::follow::{followed, reference_point};
use crate::layout::angle::wrapped;
use crate::layout::random::{Draw, index_below, normal, signed_unit, words};
use crate::layout::shared::constants;
use crate::layout::{Disturbances, N_RAYS, Pose, Progress, Stream, Truck};
use crate::world::World;

constants! {
    /// Index of the noise of the position among an episode's and step's, east and then north: those below are the
    /// rays'.
    const POSITION_NOISE: u32 = 32;
    /// Index of the noise of the tractor's heading, and behind it of the trailer's.
    const HEADING_NOISE: u32 = 34;
}

/// Keeps the pose that the truck has `steps` steps after the start of its episode, and says which one is observed.
pub(super) fn perceive(world: &World, row: &mut Row, steps: u32) {
    let now = pose_of(row.truck, row.progress);
    let before = if steps == 0 { [now; 3] } else { [row.poses[1], row.poses[2], row.poses[3]] };
    let disturbances = &world.disturbances;
    let delay = observation_delay(disturbances, row.stream, row.truck.episode);
    let late = [now, before[0], before[1], before[2]][delay as usize];
    let seen = misplaced(disturbances, row.stream, row.truck.episode, steps, &late);
    *row.poses = [seen, now, before[0], before[1]];
}

/// The pose of a truck.
pub(crate) fn pose_of(truck: &Truck, progress: &Progress) -> Pose {
    let Truck { position, heading, trailer_heading, speed, .. } = *truck;
    Pose { position, heading, trailer_heading, speed, waypoint: progress.waypoint }
}

/// Age of what is observed in an episode (steps).
fn observation_delay(disturbances: &Disturbances, stream: Stream, episode: u32) -> u32 {
    let [word, ..] = words(stream.seed, stream.env, episode, Draw::Delays as u32);
    disturbances.observation_delay + index_below(word, disturbances.n_observation_delays)
}

/// By how many steps actions come late in an episode.
pub(super) fn action_delay(disturbances: &Disturbances, stream: Stream, episode: u32) -> u32 {
    let [_, word, ..] = words(stream.seed, stream.env, episode, Draw::Delays as u32);
    disturbances.action_delay + index_below(word, disturbances.n_action_delays)
}

/// A pose with the errors that it has in an episode, and in a step of it.
fn misplaced(disturbances: &Disturbances, stream: Stream, episode: u32, steps: u32, pose: &Pose) -> Pose {
    let [_, _, x, y] = words(stream.seed, stream.env, episode, Draw::Delays as u32).map(signed_unit);
    let [turn, ..] = words(stream.seed, stream.env, episode, Draw::Offsets as u32).map(signed_unit);
    let key = noise_key(stream, episode);
    let noise = |index: u32| noise(key, steps, index);
    let offset = disturbances.position_offset * Vec2::new(x, y);
    let shake = disturbances.position_noise * Vec2::new(noise(POSITION_NOISE), noise(POSITION_NOISE + 1));
    let turn = disturbances.heading_offset * turn;
    Pose {
        position: pose.position + offset + shake,
        heading: wrapped(pose.heading + turn + disturbances.heading_noise * noise(HEADING_NOISE)),
        trailer_heading: wrapped(pose.trailer_heading + turn + disturbances.heading_noise * noise(HEADING_NOISE + 1)),
        ..*pose
    }
}

/// The truck at the pose that is observed.
pub(super) fn seen_truck(truck: &Truck, pose: &Pose) -> Truck {
    let Pose { position, heading, trailer_heading, speed, .. } = *pose;
    Truck { position, heading, trailer_heading, speed, ..*truck }
}

/// The row's truck and its progress as they are observed: on a route that lies where the policy takes it to lie.
pub(super) fn seen(world: &World, row: &Row) -> (Truck, Progress) {
    let Stream { seed, env } = row.stream;
    let [_, x, y, _] = words(seed, env, row.truck.episode, Draw::Offsets as u32).map(signed_unit);
    let pose = &row.poses[0];
    let truck = seen_truck(row.truck, pose);
    let truck = Truck { position: truck.position - world.disturbances.map_offset * Vec2::new(x, y), ..truck };
    let point = reference_point(world.rig(&truck).wheelbase, &truck);
    // An error may put it before the waypoint that it has passed last.
    let next = pose.waypoint.max(2) - 1;
    (truck, followed(world.route_waypoints(truck.route), point, next, world.params.stray_distance))
}

/// Makes ranges what sensors read `steps` steps after the start of an episode (m).
pub(super) fn disturb(
    disturbances: &Disturbances,
    stream: Stream,
    episode: u32,
    steps: u32,
    reach: f32,
    ranges: &mut [f32; N_RAYS],
) {
    let key = noise_key(stream, episode);
    for (ray, range) in (0..).zip(ranges) {
        *range = reading(disturbances, key, steps, reach, ray, *range);
    }
}

/// A ray's range as its sensor reads it `steps` steps after the start of an episode (m).
fn reading(disturbances: &Disturbances, key: [u32; 4], steps: u32, reach: f32, ray: u32, range: f32) -> f32 {
    let noisy = range + disturbances.range_noise * noise(key, steps, ray);
    let [word, ..] = words(key[2], key[3], steps, ray);
    let is_dropped = signed_unit(word) < 2.0 * disturbances.dropped_rays - 1.0;
    if is_dropped { reach } else { noisy.max(0.0).min(reach) }
}

/// The key of an episode's noise.
fn noise_key(stream: Stream, episode: u32) -> [u32; 4] {
    words(stream.seed, stream.env, episode, Draw::Noise as u32)
}

/// A number of an episode's and step's noise.
fn noise(key: [u32; 4], steps: u32, index: u32) -> f32 {
    normal(words(key[0], key[1], steps, index))
}
