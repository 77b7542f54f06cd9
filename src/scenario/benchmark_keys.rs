//! A benchmark file as written: keys, types and defaults. Its values are not checked yet.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;
use serde::de::value::SeqAccessDeserializer;
use serde::de::{Deserializer, SeqAccess, Visitor};

use super::{ActionKind, Clock, Reward};
use crate::files::reader::Exactly;
use crate::layout::ObservedExtras;
use crate::map::Gutter;
use crate::map::opendrive::{Hand, RoadLane};
use crate::traffic::Drivers;
use crate::vehicle::WrittenModel;

/// The file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Written {
    pub(super) vehicle: WrittenVehicles,
    pub(super) load: Option<String>,
    pub(super) draw: Option<WrittenDraw>,
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
    pub(super) observation: WrittenObservation,
    #[serde(default)]
    pub(super) disturbances: WrittenDisturbances,
    pub(super) traffic: Option<WrittenTraffic>,
    #[serde(default)]
    pub(super) start: WrittenStart,
    #[serde(default)]
    pub(super) ending: WrittenEnding,
    pub(super) reward: Reward,
    #[serde(default)]
    pub(super) routes: WrittenRoutes,
    #[serde(default)]
    pub(super) roundabout: Vec<WrittenRoundabout>,
    pub(super) procedural: Option<WrittenProcedural>,
}

/// `vehicle = "FILE"`, or tables `[[vehicle]]`.
pub(super) enum WrittenVehicles {
    One(PathBuf),
    Many(Vec<WrittenMember>),
}

impl<'de> Deserialize<'de> for WrittenVehicles {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // An untagged enum would not say what is wrong with a table.
        struct OneOrMany;
        impl<'de> Visitor<'de> for OneOrMany {
            type Value = WrittenVehicles;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a path, or tables [[vehicle]]")
            }

            fn visit_str<E>(self, path: &str) -> Result<WrittenVehicles, E> {
                Ok(WrittenVehicles::One(path.into()))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, tables: A) -> Result<WrittenVehicles, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(tables)).map(WrittenVehicles::Many)
            }
        }
        deserializer.deserialize_any(OneOrMany)
    }
}

/// One kind of vehicle.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenMember {
    pub(super) file: PathBuf,
    pub(super) loads: BTreeMap<String, f64>,
    #[serde(default = "one")]
    pub(super) share: f64,
    pub(super) model: Option<WrittenModel>,
    #[serde(default = "yes")]
    pub(super) drawn: bool,
}

fn one() -> f64 {
    1.0
}

fn yes() -> bool {
    true
}

/// What is drawn for each vehicle.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WrittenDraw {
    pub(super) n_vehicles: Option<usize>,
    pub(super) trailer_wheelbase: Option<Exactly<f64, 2>>,
    pub(super) tractor_wheelbase: Option<Exactly<f64, 2>>,
    pub(super) fifth_wheel: Option<Exactly<f64, 2>>,
    pub(super) centre_of_gravity: Option<Exactly<f64, 2>>,
    pub(super) roll_gain: Option<Exactly<f64, 2>>,
    pub(super) roll_frequency: Option<Exactly<f64, 2>>,
    pub(super) roll_damping: Option<Exactly<f64, 2>>,
    pub(super) slip: Option<Exactly<f64, 2>>,
    pub(super) friction: Option<Exactly<f64, 2>>,
    pub(super) steer_rate: Option<Exactly<f64, 2>>,
    pub(super) acceleration_max: Option<Exactly<f64, 2>>,
    pub(super) steer_delay: Option<Exactly<f64, 2>>,
    pub(super) drive_lag: Option<Exactly<f64, 2>>,
    pub(super) brake_lag: Option<Exactly<f64, 2>>,
    pub(super) yaw_lag: Option<Exactly<f64, 2>>,
    pub(super) slip_growth: Option<Exactly<f64, 2>>,
    pub(super) understeer_deg: Option<Exactly<f64, 2>>,
}

/// What the world does to a policy.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WrittenDisturbances {
    pub(super) range_noise: f64,
    pub(super) dropped_rays: f64,
    pub(super) position_offset: f64,
    pub(super) heading_offset_deg: f64,
    pub(super) position_noise: f64,
    pub(super) heading_noise_deg: f64,
    pub(super) map_offset: f64,
    pub(super) observation_delay: Exactly<i64, 2>,
    pub(super) action_delay: Exactly<i64, 2>,
}

/// Other vehicles on the roads.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenTraffic {
    pub(super) demand: Vec<f64>,
    #[serde(default)]
    pub(super) drivers: Drivers,
    #[serde(default)]
    pub(super) vans: f64,
    #[serde(default)]
    pub(super) buses: f64,
    #[serde(default)]
    pub(super) rigid_trucks: f64,
    #[serde(default)]
    pub(super) tractor_trailers: f64,
    #[serde(default)]
    pub(super) rude: Option<WrittenRange>,
    pub(super) courtesy: Option<f64>,
    #[serde(default = "waiting")]
    pub(super) waiting: f64,
    #[serde(default)]
    pub(super) hindrance: f64,
    #[serde(default = "alone")]
    pub(super) group: usize,
}

fn alone() -> usize {
    1
}

fn waiting() -> f64 {
    90.0
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
    #[serde(default)]
    pub(super) kind: ActionKind,
    pub(super) steer_levels: Option<Vec<f64>>,
    pub(super) speeds_kmh: Vec<f64>,
    pub(super) speed_changes_kmh: Option<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenSensors {
    pub(super) range: f64,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WrittenObservation {
    pub(super) extras: ObservedExtras,
    pub(super) vehicles: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WrittenStart {
    pub(super) offset: f64,
    pub(super) heading_deg: f64,
    pub(super) speed_kmh: Option<WrittenRange>,
    pub(super) along: f64,
}

/// A number, or `[least, greatest]`.
#[derive(Deserialize)]
#[serde(untagged, expecting = "must be a number or [least, greatest]")]
pub(super) enum WrittenRange {
    One(f64),
    Range([f64; 2]),
}

impl WrittenRange {
    /// Least and greatest.
    pub(super) fn ends(&self) -> [f64; 2] {
        match *self {
            WrittenRange::One(value) => [value; 2],
            WrittenRange::Range(range) => range,
        }
    }
}

impl Default for WrittenStart {
    fn default() -> Self {
        WrittenStart { offset: 0.3, heading_deg: 2.0, speed_kmh: None, along: 0.0 }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WrittenEnding {
    pub(super) stray_distance: f64,
    pub(super) jackknife_deg: f64,
    pub(super) rollover_ratio: f64,
    pub(super) time_limit: f64,
    pub(super) clock: Clock,
}

impl Default for WrittenEnding {
    fn default() -> Self {
        WrittenEnding {
            stray_distance: 10.0,
            jackknife_deg: 90.0,
            rollover_ratio: 1.0,
            time_limit: 3.0,
            clock: Clock::default(),
        }
    }
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
    pub(super) ring: Option<Exactly<f64, 2>>,
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
    pub(super) train: Option<Exactly<u32, 2>>,
    pub(super) validation: Option<Exactly<u32, 2>>,
    pub(super) test: Option<Exactly<u32, 2>>,
}

/// `"all"`, or routes by their name within the roundabout.
#[derive(Deserialize)]
#[serde(untagged, expecting = "must be \"all\" or a list of routes by their names")]
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
#[serde(untagged, expecting = "must be a road's id, a number or a text")]
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
