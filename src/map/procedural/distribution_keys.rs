//! A distribution file: its keys, which are also how a checked distribution is kept.

mod check;

use serde::Deserialize;

use crate::files::reader::Exactly;

/// Least and greatest value that is drawn.
pub(super) type Range = Exactly<f64, 2>;

/// The file. After [`Keys::check`] every value lies in its range; angles stay in degrees, as roundabout files have
/// them.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Keys {
    pub(super) ring: Ring,
    /// Rings of one lane; needed where `ring.lanes` has any.
    #[serde(default)]
    pub(super) single: Option<Single>,
    pub(super) arms: Arms,
    pub(super) axis: Axis,
    pub(super) median: Median,
    pub(super) widening: Widening,
    pub(super) s_bend: SBend,
    pub(super) straight: Straight,
    pub(super) flared: Flared,
    pub(super) bend: LastBend,
    pub(super) kerb: Kerb,
    pub(super) lanes: Lanes,
    pub(super) corners: Corners,
    pub(super) splitters: Splitters,
    pub(super) rules: Rules,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ring {
    /// Weights of rings of one, two and three lanes.
    #[serde(default = "two_lanes")]
    pub(super) lanes: Exactly<f64, 3>,
    /// Log-uniform (m).
    pub(super) island_radius: Range,
    /// Islands below this radius are `small_weight` times as frequent as log-uniform draws would have them (m).
    pub(super) small_radius: f64,
    pub(super) small_weight: f64,
    pub(super) lane_width: Range,
    /// Islands below this radius have lanes of at least `narrow_lane_width` (m).
    pub(super) narrow_radius: f64,
    pub(super) narrow_lane_width: f64,
    pub(super) gutter: Range,
    /// Width of the island's apron, at most as wide as the island has room for (m).
    #[serde(default)]
    pub(super) apron: Option<Range>,
}

fn two_lanes() -> Exactly<f64, 3> {
    Exactly([0.0, 1.0, 0.0])
}

/// A ring of one lane: its own island and lane, so wide that a truck gets around.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Single {
    /// Log-uniform (m).
    pub(super) island_radius: Range,
    /// Of the ring's lane; it is widened up to the greatest where the outer radius would be less than `outer_radius`.
    pub(super) lane_width: Range,
    pub(super) outer_radius: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Arms {
    /// Of three, four and five arms.
    pub(super) shares: Exactly<f64, 3>,
    /// Outer radius of the ring below which there are no five arms (m).
    pub(super) five_from: f64,
    pub(super) gap_variation: f64,
    pub(super) least_gap_deg: f64,
    /// Beyond the ring (m).
    pub(super) length: Range,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Axis {
    pub(super) share: f64,
    /// Deviation as a fraction of the ring's outer radius.
    pub(super) deviation: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Median {
    pub(super) share: f64,
    pub(super) half_width: Range,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Widening {
    pub(super) share: f64,
    pub(super) width: Range,
    pub(super) length: Range,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SBend {
    pub(super) share: f64,
    pub(super) shift: Range,
    pub(super) length: Range,
    /// Beyond the ring; farther out the arm is straight (m).
    pub(super) end: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Straight {
    pub(super) share: f64,
    pub(super) angle_deg: f64,
    pub(super) angle_deviation_deg: f64,
    /// Log-uniform (m).
    pub(super) kerb_arc: Range,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Flared {
    /// Aim as a fraction of the ring's outer radius.
    pub(super) aim: Range,
    /// Log-uniform (m).
    pub(super) kerb_arc: Range,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LastBend {
    pub(super) before_ring: Range,
    pub(super) radius: Range,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Kerb {
    pub(super) deviation: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Lanes {
    /// Of carriageways with one lane, on rings of two or three.
    #[serde(default)]
    pub(super) single_share: f64,
    pub(super) share: f64,
    pub(super) deviation: f64,
    /// Log-uniform, as a multiple of that of a lane beside the kerb.
    pub(super) ring_radius: Range,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Corners {
    pub(super) shares: Vec<f64>,
    pub(super) weights: Vec<f64>,
    /// Log-uniform (m).
    pub(super) kerb_radius: Range,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Splitters {
    pub(super) share: f64,
    pub(super) least_width: f64,
    pub(super) corner_radius: Range,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Rules {
    pub(super) lane_clearance: f64,
    pub(super) start_clearance: f64,
    pub(super) approach: f64,
    pub(super) departure: f64,
    pub(super) start_offset: f64,
    pub(super) start_heading_deg: f64,
    /// Reach of the truck ahead of and behind the point that follows the lane (m).
    pub(super) truck_ahead: f64,
    pub(super) truck_behind: f64,
    pub(super) truck_width: f64,
}
