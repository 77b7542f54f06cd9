//! What the world does to a policy: noise, errors and delays of what it observes, and of what it asks for.
//!
//! Nothing of it changes how a truck moves, when it touches a kerb and what the reward is.

use super::check::{Invalid, invalid, within};
use crate::layout;

/// Longest delay of observations and of actions (steps): so many poses and actions are kept.
pub const LONGEST_DELAY: u32 = 3;

/// What the world does to a policy. By default it does nothing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Disturbances {
    /// Standard deviation of a distance sensor, each step (m).
    pub range_noise: f64,
    /// Fraction of the rays that find nothing, each step.
    pub dropped_rays: f64,
    /// Largest error of the position in either direction, constant in an episode (m).
    pub position_offset: f64,
    /// Largest error of the headings, constant in an episode (rad).
    pub heading_offset: f64,
    /// Standard deviation of the position in either direction, each step (m).
    pub position_noise: f64,
    /// Standard deviation of each unit's heading, each step (rad).
    pub heading_noise: f64,
    /// Largest error of the route's place in either direction, constant in an episode (m).
    pub map_offset: f64,
    /// Least and greatest age of what is observed (steps).
    pub observation_delay: [u32; 2],
    /// Least and greatest number of steps by which an action comes late.
    pub action_delay: [u32; 2],
}

impl Disturbances {
    /// Whether what is observed differs from what is.
    pub fn of_observation(&self) -> bool {
        *self != Disturbances { action_delay: self.action_delay, ..Disturbances::default() }
    }

    /// Whether actions come late.
    pub fn of_action(&self) -> bool {
        self.action_delay != [0, 0]
    }

    /// An error if a value would make no sense.
    pub(super) fn check(&self) -> Result<(), Invalid> {
        for (key, value) in [
            ("range_noise", self.range_noise),
            ("position_offset", self.position_offset),
            ("heading_offset", self.heading_offset),
            ("position_noise", self.position_noise),
            ("heading_noise", self.heading_noise),
            ("map_offset", self.map_offset),
        ] {
            within(&format!("disturbances.{key}"), value, [0.0, 100.0])?;
        }
        within("disturbances.dropped_rays", self.dropped_rays, [0.0, 1.0])?;
        for (key, [least, greatest]) in
            [("observation_delay", self.observation_delay), ("action_delay", self.action_delay)]
        {
            if greatest < least || LONGEST_DELAY < greatest {
                let expected = format!("must be [least, greatest] of 0..{LONGEST_DELAY}");
                return Err(invalid(&format!("disturbances.{key}"), format_args!("[{least}, {greatest}]"), expected));
            }
        }
        Ok(())
    }
}

impl From<&Disturbances> for layout::Disturbances {
    fn from(from: &Disturbances) -> layout::Disturbances {
        let [observation_delay, oldest] = from.observation_delay;
        let [action_delay, latest] = from.action_delay;
        layout::Disturbances {
            range_noise: from.range_noise as f32,
            dropped_rays: from.dropped_rays as f32,
            position_offset: from.position_offset as f32,
            heading_offset: from.heading_offset as f32,
            position_noise: from.position_noise as f32,
            heading_noise: from.heading_noise as f32,
            map_offset: from.map_offset as f32,
            observation_delay,
            n_observation_delays: 1 + oldest - observation_delay,
            action_delay,
            n_action_delays: 1 + latest - action_delay,
            of_observation: from.of_observation().into(),
            of_action: from.of_action().into(),
        }
    }
}
