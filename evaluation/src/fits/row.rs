//! The answer for a route and a vehicle.

use serde::{Deserialize, Serialize};

use super::way::{Refusal, Way};
use crate::certificate::file::Found;

/// A route and a vehicle: whether it fits, how, and how fast.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// `16m/N-left-3` and the like.
    pub route: String,
    /// Stem of the vehicle's file.
    pub vehicle: String,
    /// Whether the vehicle fits, on its lane's centre line or by the way found.
    pub fits: bool,
    /// With the front axle on the lane's centre line.
    pub lane_centre: Way,
    /// By the way that the search found; none where it found none.
    pub way: Option<Way>,
    /// Highest constant speed on the lane's centre line that tyres and load hold with a margin (km/h).
    pub fastest_kmh: f64,
    /// The search: how far it came, and the actions of the way found.
    pub search: Found,
    /// The clearance that the search kept: that asked for, or 0 where only a way with less was found (m).
    pub searched_clearance: f64,
}

impl Row {
    /// The road's name: the route's without its last part.
    pub fn road(&self) -> &str {
        self.route.rsplit_once('/').map_or(&self.route, |(road, _)| road)
    }

    /// The route's name within its road.
    pub fn movement(&self) -> &str {
        self.route.rsplit('/').next().unwrap_or(&self.route)
    }

    /// The path to be shown: the lane's centre line where the vehicle fits on it or no other way was found, else the
    /// way found.
    pub fn shown(&self) -> &Way {
        match &self.way {
            Some(way) if !self.lane_centre.fits => way,
            _ => &self.lane_centre,
        }
    }

    /// Whether the path to be shown is the way found.
    pub fn shows_way(&self) -> bool {
        !self.lane_centre.fits && self.way.is_some()
    }

    /// The limit of the truck that refuses the path to be shown; none where a kerb does, which the clearance says.
    pub fn limit(&self) -> Option<Refusal> {
        self.shown().refused_by.filter(|refusal| !self.fits && *refusal != Refusal::Kerb)
    }

    /// The verdict in a word or two: `lane centre`, `other way` or `does not fit`.
    pub fn verdict(&self) -> &'static str {
        match (self.lane_centre.fits, self.fits) {
            (true, _) => "lane centre",
            (false, true) => "other way",
            (false, false) => "does not fit",
        }
    }
}
