//! A path that a truck drives on a route, and its figures: clearance, swept width, steering, lateral acceleration.

use glam::DVec2;
use offtrack::layout::Rig;
use offtrack::map::route::Route;
use offtrack::map::{Road, UnitKerbs};
use offtrack::vehicle::swept::{Pose, Section, UnitClearance, beside, front_path, off_tracking, sections};
use serde::{Deserialize, Serialize};

use crate::polygons::to;

/// Distance between the points of a lane's centre line across which it is measured how far a truck leaves the lane (m).
const SPACING: f64 = 0.25;
/// Parts of a unit that figures are rounded to.
const ROUNDED: f64 = 1e4;

/// A path on the road as it lies in the world, the ring's centre at the origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// The poses from the route's beginning to its end.
    pub poses: Vec<Pose>,
    /// The truck.
    pub rig: Rig,
}

/// What a path asks of the truck that drives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asks {
    /// Lowest radius of the front axle's path; infinite for a straight one (m).
    pub lowest_radius: f64,
    /// Largest steer angle (rad).
    pub steering: f64,
    /// Fastest change of the steer angle (rad/s).
    pub steer_rate: f64,
    /// Highest lateral acceleration of the drive axle (m/s^2).
    pub lateral_acceleration: f64,
    /// Highest load transfer ratio of either unit.
    pub load_transfer_ratio: f64,
}

/// Where a unit comes nearest to a kerb, in the frame of the map that the road is from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Nearest {
    /// Distance from the kerb, negative beyond it (m).
    pub clearance: f64,
    /// Where that is, x east (m).
    pub x: f64,
    /// Where that is, y north (m).
    pub y: f64,
}

/// What refuses a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Refusal {
    /// A kerb that is nearer than is asked for.
    Kerb,
    /// The limit of the steer angle.
    Lock,
    /// The tyres' grip.
    Tyres,
    /// The load: the inner wheels lift.
    Rollover,
}

impl Refusal {
    /// Its name in JSON: `kerb`, `lock`, `tyres`, `rollover`.
    pub fn name(self) -> &'static str {
        match self {
            Refusal::Kerb => "kerb",
            Refusal::Lock => "lock",
            Refusal::Tyres => "tyres",
            Refusal::Rollover => "rollover",
        }
    }
}

/// The figures of a path.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Way {
    /// Whether both units keep the clearance asked for and the truck can steer and hold the path.
    pub fits: bool,
    /// What refuses the path first; none where it fits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused_by: Option<Refusal>,
    /// Where the tractor comes nearest to a kerb.
    pub tractor: Nearest,
    /// Where the trailer comes nearest to a kerb.
    pub trailer: Nearest,
    /// Largest width of what both units sweep, across the path of the front axle (m).
    pub swept_width: f64,
    /// Where that is on the path of the front axle, in the map's frame (m).
    pub swept_width_at: [f64; 2],
    /// Largest distance of the trailer's axles from the path of the front axle (m).
    pub off_tracking: f64,
    /// By how much the truck leaves its lane to the left (m).
    pub leaves_lane_left: f64,
    /// By how much the truck leaves its lane to the right (m).
    pub leaves_lane_right: f64,
    /// Lowest radius of the front axle's path; none on a straight one (m).
    pub lowest_radius: Option<f64>,
    /// Largest steer angle (deg).
    pub steer_angle_deg: f64,
    /// Fastest change of the steer angle (deg/s).
    pub steer_rate_deg: f64,
    /// Highest lateral acceleration of the drive axle (m/s^2).
    pub lateral_acceleration: f64,
    /// Highest load transfer ratio of either unit: 1 when the inner wheels lift.
    pub load_transfer_ratio: f64,
    /// The trailer's least distance from an apron's outer edge, negative where it uses the apron; none without aprons
    /// (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub apron_clearance: Option<f64>,
}

impl Way {
    /// The figures of `path` on `route` of a road as it lies in the world, with these kerbs. `straights` are the
    /// lengths of the route before and after the ring (m); `refused` says of the clearance what refuses the path.
    pub fn of(
        path: &Path,
        asks: &Asks,
        road: &Road,
        route: &Route,
        kerbs: &UnitKerbs,
        straights: [f64; 2],
        refused: impl FnOnce(f64) -> Option<Refusal>,
    ) -> Way {
        let Path { poses, rig } = path;
        let [tractor, trailer] = path.clearances(kerbs);
        let origin = road.ground().origin;
        let nearest = |unit: &UnitClearance| {
            // A kerb's corner between two points of an outline may touch it.
            let least = if unit.overlaps.is_empty() { unit.least } else { unit.least.min(0.0) };
            let at = origin + unit.at;
            Nearest { clearance: to(ROUNDED, least), x: to(ROUNDED, at.x), y: to(ROUNDED, at.y) }
        };
        let (tractor, trailer) = (nearest(&tractor), nearest(&trailer));
        let front = front_path(rig, poses);
        let own: Vec<usize> = (0..poses.len()).collect();
        let swept = sections(rig, poses, &front, &own);
        let widest = swept.iter().max_by(|a, b| a.width().total_cmp(&b.width()));
        let (swept_width, at) = widest.map_or((0.0, DVec2::ZERO), |section| (section.width(), section.at));
        let [left, right] = leaves(path, road, route, straights);
        let refused_by = refused(tractor.clearance.min(trailer.clearance));
        Way {
            fits: refused_by.is_none(),
            refused_by,
            tractor,
            trailer,
            swept_width: to(ROUNDED, swept_width),
            swept_width_at: (origin + at).to_array().map(|value| to(ROUNDED, value)),
            off_tracking: to(ROUNDED, off_tracking(rig, poses).0),
            leaves_lane_left: to(ROUNDED, left),
            leaves_lane_right: to(ROUNDED, right),
            lowest_radius: asks.lowest_radius.is_finite().then(|| to(ROUNDED, asks.lowest_radius)),
            steer_angle_deg: to(ROUNDED, asks.steering.to_degrees()),
            steer_rate_deg: to(ROUNDED, asks.steer_rate.to_degrees()),
            lateral_acceleration: to(ROUNDED, asks.lateral_acceleration),
            load_transfer_ratio: to(ROUNDED, asks.load_transfer_ratio),
            apron_clearance: path.apron_clearance(kerbs).map(|least| to(ROUNDED, least)),
        }
    }

    /// The least clearance of both units (m).
    pub fn clearance(&self) -> f64 {
        self.tractor.clearance.min(self.trailer.clearance)
    }

    /// By how much the trailer uses an apron, 0 where it does not; none on a road without aprons (m).
    pub fn apron_use(&self) -> Option<f64> {
        self.apron_clearance.map(|clearance| (-clearance).max(0.0))
    }

    /// The unit that comes nearest to a kerb, and where.
    pub fn nearest(&self) -> (&'static str, Nearest) {
        if self.tractor.clearance < self.trailer.clearance {
            ("tractor", self.tractor)
        } else {
            ("trailer", self.trailer)
        }
    }
}

impl Path {
    /// Corners of the tractor's outline and of the trailer's at each pose (m).
    pub fn corners(&self) -> [Vec<[DVec2; 4]>; 2] {
        [
            self.poses.iter().map(|pose| pose.tractor_corners(&self.rig)).collect(),
            self.poses.iter().map(|pose| pose.trailer_corners(&self.rig)).collect(),
        ]
    }

    /// How near the tractor and the trailer come to the kerbs that each keeps to.
    pub fn clearances(&self, kerbs: &UnitKerbs) -> [UnitClearance; 2] {
        let ([tractor, trailer], [of_tractor, of_trailer]) = (self.corners(), kerbs.both());
        [UnitClearance::of(&tractor, of_tractor), UnitClearance::of(&trailer, of_trailer)]
    }

    /// The trailer's least distance from the outer edge of an apron, negative on it; none without aprons (m).
    fn apron_clearance(&self, kerbs: &UnitKerbs) -> Option<f64> {
        let edges = kerbs.apron_edges()?;
        let [_, trailer] = self.corners();
        Some(UnitClearance::of(&trailer, edges).least)
    }
}

/// By how much the truck leaves its lane to the left and to the right (m).
fn leaves(path: &Path, road: &Road, route: &Route, [approach, departure]: [f64; 2]) -> [f64; 2] {
    let line = &route.centre_line;
    let length = line.length();
    let n = (length / SPACING).floor() as usize;
    let points: Vec<DVec2> = (0..=n).map(|index| line.point_at(index as f64 * SPACING)).collect();
    let beside = beside(&path.rig, &path.poses, &points);
    let widths = road.lane_widths(route);
    let half_width = |section: &Section| {
        let station = line.station(section.at);
        let part = if station < approach { 0 } else { 1 + usize::from(length - departure <= station) };
        0.5 * widths[part]
    };
    let beyond = sections(&path.rig, &path.poses, &points, &beside).into_iter().map(|section| {
        let half = half_width(&section);
        [section.left - half, -section.right - half]
    });
    beyond.fold([0.0, 0.0], |[a, b], [left, right]| [f64::max(a, left), f64::max(b, right)])
}
