//! Mirror augmentation: transitions mirrored left to right.
//!
//! A truck and its sensors are symmetric, so the mirror image of a transition is a valid transition of left-hand
//! traffic. A learner that samples both has seen every bend in both directions.

use offtrack::layout::{Action, N_RAYS, N_TRACTOR_RAYS, N_TRAILER_RAYS, OBSERVATION, Ray, VEHICLE_VALUES, Values};
use offtrack::world::World;
use rand::Rng;

use crate::error::Error;
use crate::replay_buffer::Sample;

/// Index of the first distance sensor in an observation.
fn first_ray() -> usize {
    OBSERVATION
        .iter()
        .filter(|values| values.name.ends_with("_range"))
        .map(|values| values.first)
        .min()
        .unwrap_or_default()
}

/// Tolerance of two sensors' mounts or two steer angles that are mirror images (m, rad): f32 rounds at 1e-6 of a few
/// metres.
const SAME: f32 = 1e-4;

/// The mirror image of observations and actions.
#[derive(Debug, Clone, PartialEq)]
pub struct Mirror {
    /// Index of the value that each value is mirrored from, and its factor, `[values]`.
    values: Vec<(usize, f32)>,
    /// Index of each action's mirror image, `[actions]`.
    actions: Vec<u32>,
}

impl Mirror {
    /// The mirror of a world. Its action table and its sensors must be symmetric.
    pub fn of(world: &World) -> Result<Mirror, Error> {
        let refused = |expected: String| Error::setting("learning.mirror_augmentation", "true", expected);
        let factors =
            |groups: &'static [Values]| groups.iter().flat_map(|values| std::iter::repeat_n(values.mirror, values.n));
        let layout = world.observation_layout();
        let extras = layout.extras().iter().map(|extra| extra.mirror);
        let around = factors(if layout.has_vehicles { &VEHICLE_VALUES } else { &[] });
        let mut values: Vec<(usize, f32)> = factors(&OBSERVATION).chain(extras).chain(around).enumerate().collect();
        if world.rigs.iter().any(|rig| rig.crossfall != 0.0) {
            return Err(refused(
                "the vehicle's road falls to one side (model.crossfall): leave learning.mirror_augmentation out"
                    .to_owned(),
            ));
        }
        let first_ray = first_ray();
        for index in 0..N_RAYS {
            // The image of a trailer's sensor is one of the trailer's.
            let unit = if index < N_TRAILER_RAYS {
                0..N_TRAILER_RAYS
            } else {
                N_TRAILER_RAYS..N_TRAILER_RAYS + N_TRACTOR_RAYS
            };
            // One that is an image on every chassis.
            let on_all = |other: usize| world.rays.iter().all(|rays| are_images(&rays[index], &rays[other]));
            let image = unit.into_iter().find(|&other| on_all(other));
            let image = image.ok_or_else(|| {
                refused(format!(
                    "the vehicle's distance sensor {index} has no mirror image: leave learning.mirror_augmentation out"
                ))
            })?;
            values[first_ray + index].0 = first_ray + image;
        }
        let image = |action: &Action| {
            let same = |other: &Action| {
                (action.steering + other.steering).abs() <= SAME && (action.speed - other.speed).abs() <= SAME
            };
            world.actions.iter().position(same).map(|index| index as u32).ok_or_else(|| {
                let degrees = action.steering.to_degrees();
                refused(format!(
                    "steering {degrees:.1} deg is in the action table and its opposite is not: leave \
                    learning.mirror_augmentation out"
                ))
            })
        };
        Ok(Mirror { values, actions: world.actions.iter().map(image).collect::<Result<_, _>>()? })
    }

    /// Index of the value that each value is mirrored from, and its factor, `[values]`; and each action's mirror image,
    /// `[actions]`.
    pub fn images(&self) -> (Vec<(usize, f32)>, Vec<u32>) {
        (self.values.clone(), self.actions.clone())
    }

    /// The mirror image of an observation with the extras behind it.
    pub fn observation<const N: usize>(&self, seen: &[f32; N]) -> [f32; N] {
        std::array::from_fn(|value| {
            let (index, factor) = self.values[value];
            factor * seen[index]
        })
    }

    /// Mirrors each transition with probability 0.5.
    pub fn mirror_half<const N: usize>(&self, sample: &mut Sample<N>, rng: &mut impl Rng) {
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

/// Whether two sensors of a unit are mirror images about its centre line.
fn are_images(one: &Ray, other: &Ray) -> bool {
    let mirror = glam::Vec2::new(1.0, -1.0);
    one.origin.abs_diff_eq(mirror * other.origin, SAME) && one.direction.abs_diff_eq(mirror * other.direction, SAME)
}

#[cfg(test)]
mod tests;
