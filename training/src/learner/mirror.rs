//! The same drive seen in a mirror: left and right change places.
//!
//! A truck and its sensors are the same on both sides, so the mirror image of a transition is as true as the transition itself, only that
//! it was made in left-hand traffic. Who learns from both has seen every bend to either side.

use offtrack::layout::{Action, N_TRACTOR_RAYS, N_TRAILER_RAYS, N_VALUES, Ray};
use offtrack::world::World;
use rand::Rng;

use crate::error::Error;
use crate::learner::replay_buffer::Sample;

/// Values of an observation that have a sign, left positive: angles to waypoints, headings, articulation.
const SIGNED: std::ops::Range<usize> = 6..22;
/// Where the distance sensors begin in an observation.
const RANGES: usize = 30;
/// How far apart two sensors' mounts or two steer angles may lie and still be each other's image [m, rad]: f32 rounds at 1e-6 of a few metres.
const SAME: f32 = 1e-4;

/// What an observation and an action become in the mirror.
#[derive(Debug, Clone, PartialEq)]
pub struct Mirror {
    /// Place of the value that comes to stand here, and its factor, `[values]`.
    values: [(usize, f32); N_VALUES],
    /// The action in place of each, `[actions]`.
    actions: Vec<u32>,
}

impl Mirror {
    /// The mirror of a world. Its action table and its sensors must be their own images.
    pub fn of(world: &World) -> Result<Mirror, Error> {
        let refused = |expected: String| Error::Flag { flag: "learning.mirror", value: "true".to_owned(), expected };
        let mut values = std::array::from_fn(|index| (index, if SIGNED.contains(&index) { -1.0 } else { 1.0 }));
        for (index, ray) in world.rays.iter().enumerate() {
            // A trailer's sensor is the image of one of the trailer's.
            let unit = if index < N_TRAILER_RAYS { 0..N_TRAILER_RAYS } else { N_TRAILER_RAYS..N_TRAILER_RAYS + N_TRACTOR_RAYS };
            let image = unit.into_iter().find(|&other| are_images(ray, &world.rays[other]));
            let image = image.ok_or_else(|| {
                refused(format!("the vehicle's distance sensor {index} has no image on the other side: leave learning.mirror out"))
            })?;
            values[RANGES + index].0 = RANGES + image;
        }
        let image = |action: &Action| {
            let same = |other: &Action| (action.steering + other.steering).abs() <= SAME && (action.speed - other.speed).abs() <= SAME;
            world.actions.iter().position(same).map(|index| index as u32).ok_or_else(|| {
                let degrees = action.steering.to_degrees();
                refused(format!("steering {degrees:.1} deg is in the action table and its opposite is not: leave learning.mirror out"))
            })
        };
        Ok(Mirror { values, actions: world.actions.iter().map(image).collect::<Result<_, _>>()? })
    }

    /// Place of the value that comes to stand in each place, and its factor, `[values]`; and the action in place of each, `[actions]`.
    #[cfg(feature = "gpu")]
    pub fn images(&self) -> ([(usize, f32); N_VALUES], Vec<u32>) {
        (self.values, self.actions.clone())
    }

    /// What the driver would see in the mirror.
    pub fn observation(&self, seen: &[f32; N_VALUES]) -> [f32; N_VALUES] {
        self.values.map(|(place, factor)| factor * seen[place])
    }

    /// Puts each transition's mirror image in its place with a chance of one half.
    pub fn turn_half(&self, sample: &mut Sample<N_VALUES>, rng: &mut impl Rng) {
        let rows = sample.observation.iter_mut().zip(&mut sample.next_observation).zip(&mut sample.action);
        for ((observation, next_observation), action) in rows {
            if rng.random() {
                *observation = self.observation(observation);
                *next_observation = self.observation(next_observation);
                *action = self.actions[*action as usize];
            }
        }
    }
}

/// Whether two sensors of a unit are each other's image at its middle line.
fn are_images(one: &Ray, other: &Ray) -> bool {
    let mirror = glam::Vec2::new(1.0, -1.0);
    one.origin.abs_diff_eq(mirror * other.origin, SAME) && one.direction.abs_diff_eq(mirror * other.direction, SAME)
}

#[cfg(test)]
mod tests;
