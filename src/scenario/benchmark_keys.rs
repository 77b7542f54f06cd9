//! A benchmark file as written: keys, types and defaults. Its values are not checked yet.

use std::path::PathBuf;

use serde::Deserialize;

use crate::opendrive::{Hand, RoadLane};
use crate::roundabout::Gutter;

/// The file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Written {
    pub(super) vehicle: PathBuf,
    pub(super) load: String,
    pub(super) gutter: Gutter,
    #[serde(default)]
    pub(super) steer_max_deg: Option<f64>,
    #[serde(default)]
    pub(super) time: WrittenTime,
    #[serde(default)]
    pub(super) field: WrittenField,
    pub(super) actions: WrittenActions,
    pub(super) sensors: WrittenSensors,
    #[serde(default)]
    pub(super) start: WrittenStart,
    #[serde(default)]
    pub(super) ending: WrittenEnding,
    pub(super) reward: WrittenReward,
    #[serde(default)]
    pub(super) routes: WrittenRoutes,
    #[serde(default)]
    pub(super) roundabout: Vec<WrittenRoundabout>,
    pub(super) procedural: Option<WrittenProcedural>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WrittenTime {
    pub(super) step: f64,
    pub(super) substeps: usize,
}

impl Default for WrittenTime {
    fn default() -> Self {
        WrittenTime { step: 0.1, substeps: 2 }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WrittenField {
    pub(super) cell: f64,
}

impl Default for WrittenField {
    fn default() -> Self {
        WrittenField { cell: super::FIELD_CELL }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenActions {
    pub(super) steer_levels: Vec<f64>,
    pub(super) speeds_kmh: Vec<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenSensors {
    pub(super) range: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WrittenStart {
    pub(super) offset: f64,
    pub(super) heading_deg: f64,
}

impl Default for WrittenStart {
    fn default() -> Self {
        WrittenStart { offset: 0.3, heading_deg: 2.0 }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WrittenEnding {
    pub(super) stray_distance: f64,
    pub(super) jackknife_deg: f64,
    pub(super) rollover_ratio: f64,
    pub(super) time_limit: f64,
}

impl Default for WrittenEnding {
    fn default() -> Self {
        WrittenEnding { stray_distance: 10.0, jackknife_deg: 90.0, rollover_ratio: 1.0, time_limit: 3.0 }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenReward {
    pub(super) waypoint: f64,
    pub(super) lane_distance: f64,
    pub(super) lane_distance_limit: f64,
    #[serde(default)]
    pub(super) clearance: f64,
    #[serde(default = "half_a_metre")]
    pub(super) clearance_limit: f64,
    pub(super) failure: f64,
}

fn half_a_metre() -> f64 {
    0.5
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WrittenRoutes {
    pub(super) approach: f64,
    pub(super) departure: f64,
    pub(super) spacing: f64,
}

impl Default for WrittenRoutes {
    fn default() -> Self {
        WrittenRoutes { approach: super::APPROACH, departure: super::DEPARTURE, spacing: super::WAYPOINT_SPACING }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenRoundabout {
    pub(super) file: PathBuf,
    /// For a map: a point near the ring, its hand of traffic, and names.
    pub(super) ring: Option<[f64; 2]>,
    #[serde(default)]
    pub(super) hand: Hand,
    pub(super) name: Option<String>,
    #[serde(default)]
    pub(super) arms: Vec<String>,
    /// For a map: ways through a junction in place of a ring.
    #[serde(default)]
    pub(super) way: Vec<WrittenWay>,
    #[serde(default)]
    pub(super) train: WrittenChoice,
    #[serde(default)]
    pub(super) validation: WrittenChoice,
    #[serde(default)]
    pub(super) test: WrittenChoice,
}

/// Random roads: all routes of a range of indices for each split, from the first to before the second.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenProcedural {
    pub(super) distribution: PathBuf,
    pub(super) seed: u32,
    pub(super) count: usize,
    pub(super) train: Option<[u32; 2]>,
    pub(super) validation: Option<[u32; 2]>,
    pub(super) test: Option<[u32; 2]>,
}

/// `"all"`, or routes by their name within the roundabout.
#[derive(Deserialize)]
#[serde(untagged)]
pub(super) enum WrittenChoice {
    Word(String),
    Names(Vec<String>),
}

impl Default for WrittenChoice {
    fn default() -> Self {
        WrittenChoice::Names(Vec::new())
    }
}

/// A way through a junction of a map.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenWay {
    pub(super) from: WrittenLane,
    pub(super) to: WrittenLane,
}

/// A lane of a road of a map.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenLane {
    pub(super) road: WrittenId,
    pub(super) lane: i32,
}

/// A road's id, a text in OpenDRIVE and mostly a number.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum WrittenId {
    Number(u64),
    Text(String),
}

impl From<&WrittenLane> for RoadLane {
    fn from(written: &WrittenLane) -> RoadLane {
        let road = match &written.road {
            WrittenId::Number(number) => number.to_string(),
            WrittenId::Text(text) => text.clone(),
        };
        RoadLane { road, lane: written.lane }
    }
}
