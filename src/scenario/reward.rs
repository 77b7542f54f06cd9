//! The weights of a benchmark's reward: their ranges, and other values for some of them.

use serde::{Deserialize, Serialize};

use super::Scenario;
use crate::files::reader::{Error, Reader};
use crate::layout::Params;

/// Other values for some keys of a benchmark's `[reward]`; what is none stays as the benchmark has it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RewardChanges {
    /// Reward for each waypoint passed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub waypoint: Option<f64>,
    /// Weight of the lane-distance term in the reward of each step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lane_distance: Option<f64>,
    /// Distance to the lane centre at which that term is 1 \[m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lane_distance_limit: Option<f64>,
    /// Weight of the clearance term in the reward of each step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clearance: Option<f64>,
    /// Clearance to a kerb below which that term counts \[m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clearance_limit: Option<f64>,
    /// Reward for a failure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<f64>,
}

impl RewardChanges {
    /// Whether nothing changes.
    pub fn is_empty(&self) -> bool {
        *self == RewardChanges::default()
    }

    /// # Errors
    ///
    /// The first value out of the range that a benchmark file may give, with its key in `table`.
    pub fn check(&self, reader: &Reader, table: &str) -> Result<(), Error> {
        let weight = -1e6..=1e6;
        let keys = [
            ("waypoint", self.waypoint, weight.clone(), ""),
            ("lane_distance", self.lane_distance, weight.clone(), ""),
            ("lane_distance_limit", self.lane_distance_limit, 0.1..=50.0, "m"),
            ("clearance", self.clearance, weight.clone(), ""),
            ("clearance_limit", self.clearance_limit, 0.01..=10.0, "m"),
            ("failure", self.failure, weight, ""),
        ];
        keys.into_iter().try_for_each(|(key, value, range, unit)| {
            value.map_or(Ok(()), |value| reader.within(&format!("{table}.{key}"), value, range, unit).map(drop))
        })
    }

    /// Changes the reward of a scenario.
    pub fn apply(&self, scenario: &mut Scenario) {
        let keys = [
            (self.waypoint, &mut scenario.waypoint_weight),
            (self.lane_distance, &mut scenario.lane_distance_weight),
            (self.lane_distance_limit, &mut scenario.lane_distance_limit),
            (self.clearance, &mut scenario.clearance_weight),
            (self.clearance_limit, &mut scenario.clearance_limit),
            (self.failure, &mut scenario.failure_weight),
        ];
        for (value, weight) in keys {
            *weight = value.unwrap_or(*weight);
        }
    }

    /// Changes the reward of a world.
    pub fn apply_to_params(&self, params: &mut Params) {
        let keys = [
            (self.waypoint, &mut params.waypoint_weight),
            (self.lane_distance, &mut params.lane_distance_weight),
            (self.lane_distance_limit, &mut params.lane_distance_limit),
            (self.clearance, &mut params.clearance_weight),
            (self.clearance_limit, &mut params.clearance_limit),
            (self.failure, &mut params.failure_weight),
        ];
        for (value, weight) in keys {
            *weight = value.map_or(*weight, |value| value as f32);
        }
    }
}
