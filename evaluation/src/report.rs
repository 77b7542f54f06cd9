//! The result of an evaluation: every episode counted, for each route and in all. It is serialised as JSON; `table`
//! prints it.

use serde::Serialize;

use super::avoidable::Avoidable;
use super::classes::ClassReport;
pub use super::episode::{Episode, Summary, wilson};
use super::failures::Cause;
use super::groups::Groups;
use super::possible::Possible;

/// Routes from which on a table and a page show groups of routes, and the worst routes instead of every one.
pub const MANY_ROUTES: usize = 100;

/// One route's episodes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RouteReport {
    /// `20m/N-left-3` and the like.
    pub name: String,
    /// A truck whose front axle follows the centre line touches no kerb, and its lock allows that. Steer rate, tyres
    /// and rollover are not asked: they depend on the speed, which is the policy's.
    pub own_lane_suffices: bool,
    /// Radius of the roundabout's island (m); `None` on a crossing.
    pub island_radius: Option<f64>,
    /// Figures of its episodes.
    #[serde(flatten)]
    pub summary: Summary,
}

/// The whole evaluation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The benchmark's name.
    pub benchmark: String,
    /// `train`, `validation` or `test`.
    pub split: &'static str,
    /// Name of the policy.
    pub policy: String,
    /// Seed of the start poses.
    pub seed: u32,
    /// Where the simulator ran.
    pub engine: String,
    /// Figures of all episodes.
    #[serde(flatten)]
    pub summary: Summary,
    /// Episodes on the routes whose own lane suffices.
    pub own_lane_suffices: Option<Summary>,
    /// Episodes on the routes that need deviation.
    pub needs_deviation: Option<Summary>,
    /// Episodes on the certified routes; `None` without a certificate or without a certified route.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certified: Option<Summary>,
    /// Episodes whose own start is shown to be possible; `None` where nobody asked for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub possible: Option<Possible>,
    /// Contacts with other vehicles that could have been avoided; `None` where nobody asked for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub avoidable: Option<Avoidable>,
    /// Why episodes did not arrive, the commonest cause first.
    pub failures: Vec<Cause>,
    /// How trucks drove, by vehicle and load; empty where the benchmark has one vehicle and one speed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub classes: Vec<ClassReport>,
    /// Sums by island radius, lane, exit and roundabout.
    pub groups: Groups,
    /// Each route.
    pub routes: Vec<RouteReport>,
}

impl Report {
    /// Whether there are so many routes that people read their groups first.
    pub fn has_many_routes(&self) -> bool {
        MANY_ROUTES <= self.routes.len()
    }

    /// Routes with an episode that failed, those with the least success first.
    pub fn failing_routes(&self) -> Vec<&RouteReport> {
        let mut failing: Vec<&RouteReport> =
            self.routes.iter().filter(|route| route.summary.arrived < route.summary.episodes).collect();
        failing.sort_by(|a, b| a.summary.success.total_cmp(&b.summary.success));
        failing
    }
}
