//! A distribution file: its keys, which are also how a checked distribution is kept, and the check of every value.

use std::ops::RangeInclusive;

use serde::Deserialize;

use crate::files::reader::{Error, Exactly, Reader, shown};

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

impl Keys {
    /// An error for the first value out of its range.
    pub(super) fn check(&self, reader: &Reader) -> Result<(), Error> {
        let Keys {
            ring,
            single,
            arms,
            axis,
            median,
            widening,
            s_bend,
            straight,
            flared,
            bend,
            kerb,
            lanes,
            corners,
            splitters,
            rules,
        } = self;
        let ranges: [(&str, Range, RangeInclusive<f64>, &str); 17] = [
            ("ring.island_radius", ring.island_radius, 1.5..=200.0, "m"),
            ("ring.lane_width", ring.lane_width, 2.5..=12.0, "m"),
            ("ring.gutter", ring.gutter, 0.0..=3.0, "m"),
            ("arms.length", arms.length, 15.0..=500.0, "m"),
            ("median.half_width", median.half_width, 0.0..=10.0, "m"),
            ("widening.width", widening.width, 0.01..=10.0, "m"),
            ("widening.length", widening.length, 1.0..=100.0, "m"),
            ("s_bend.shift", s_bend.shift, 0.01..=20.0, "m"),
            ("s_bend.length", s_bend.length, 5.0..=100.0, "m"),
            ("straight.kerb_arc", straight.kerb_arc, 0.2..=200.0, "m"),
            ("flared.aim", flared.aim, 0.1..=1.0, "of the outer radius"),
            ("flared.kerb_arc", flared.kerb_arc, 0.2..=200.0, "m"),
            ("bend.before_ring", bend.before_ring, 1.0..=100.0, "m"),
            ("bend.radius", bend.radius, 5.0..=1000.0, "m"),
            ("lanes.ring_radius", lanes.ring_radius, 0.5..=5.0, "times"),
            ("corners.kerb_radius", corners.kerb_radius, 0.2..=200.0, "m"),
            ("splitters.corner_radius", splitters.corner_radius, 0.1..=2.0, "m"),
        ];
        ranges.into_iter().try_for_each(|(key, values, limits, unit)| range(reader, key, values, limits, unit))?;
        if let Some(apron) = ring.apron {
            range(reader, "ring.apron", apron, 0.0..=50.0, "m")?;
        }
        weights(reader, "ring.lanes", &*ring.lanes)?;
        match single {
            Some(single) => {
                range(reader, "single.island_radius", single.island_radius, 1.5..=200.0, "m")?;
                range(reader, "single.lane_width", single.lane_width, 2.5..=12.0, "m")?;
                reader.within("single.outer_radius", single.outer_radius, 5.0..=200.0, "m")?;
            }
            None if 0.0 < ring.lanes[0] => {
                return Err(reader.invalid(
                    "single",
                    "missing",
                    "rings of one lane, which ring.lanes has, need this table",
                ));
            }
            None => {}
        }
        let values: [(&str, f64, RangeInclusive<f64>, &str); 30] = [
            ("ring.small_radius", ring.small_radius, 1.5..=200.0, "m"),
            ("ring.small_weight", ring.small_weight, 0.1..=100.0, "times"),
            ("ring.narrow_radius", ring.narrow_radius, 1.5..=200.0, "m"),
            ("ring.narrow_lane_width", ring.narrow_lane_width, 2.5..=12.0, "m"),
            ("arms.five_from", arms.five_from, 5.0..=500.0, "m"),
            ("arms.gap_variation", arms.gap_variation, 0.0..=0.9, ""),
            // Names by eight directions of the compass need arms that are farther apart than those.
            ("arms.least_gap_deg", arms.least_gap_deg, 46.0..=72.0, "deg"),
            ("axis.share", axis.share, 0.0..=1.0, ""),
            ("axis.deviation", axis.deviation, 0.0..=0.5, "of the outer radius"),
            ("median.share", median.share, 0.0..=1.0, ""),
            ("widening.share", widening.share, 0.0..=1.0, ""),
            ("s_bend.share", s_bend.share, 0.0..=1.0, ""),
            ("s_bend.end", s_bend.end, 10.0..=400.0, "m"),
            ("straight.share", straight.share, 0.0..=1.0, ""),
            ("straight.angle_deg", straight.angle_deg, -30.0..=30.0, "deg"),
            ("straight.angle_deviation_deg", straight.angle_deviation_deg, 0.0..=15.0, "deg"),
            ("kerb.deviation", kerb.deviation, 0.0..=3.0, "m"),
            ("lanes.single_share", lanes.single_share, 0.0..=1.0, ""),
            ("lanes.share", lanes.share, 0.0..=1.0, ""),
            ("lanes.deviation", lanes.deviation, 0.0..=3.0, "m"),
            ("splitters.share", splitters.share, 0.0..=1.0, ""),
            ("splitters.least_width", splitters.least_width, 0.5..=20.0, "m"),
            ("rules.lane_clearance", rules.lane_clearance, 1.3..=3.0, "m"),
            ("rules.start_clearance", rules.start_clearance, 0.0..=2.0, "m"),
            ("rules.approach", rules.approach, 5.0..=400.0, "m"),
            ("rules.departure", rules.departure, 5.0..=400.0, "m"),
            ("rules.start_offset", rules.start_offset, 0.0..=1.0, "m"),
            ("rules.start_heading_deg", rules.start_heading_deg, 0.0..=20.0, "deg"),
            ("rules.truck_ahead", rules.truck_ahead, 0.5..=20.0, "m"),
            ("rules.truck_behind", rules.truck_behind, 0.5..=40.0, "m"),
        ];
        for (key, value, limits, unit) in values {
            reader.within(key, value, limits, unit)?;
        }
        reader.within("rules.truck_width", rules.truck_width, 1.0..=4.0, "m")?;
        weights(reader, "arms.shares", &*arms.shares)?;
        reader.length("corners.shares", corners.shares.len(), 1..=16, "values")?;
        for (index, &share) in corners.shares.iter().enumerate() {
            reader.within(&format!("corners.shares[{index}]"), share, 0.0..=1.0, "")?;
        }
        let n_shares = corners.shares.len();
        if corners.weights.len() != n_shares {
            let expected = format!("corners.shares has {n_shares}, and each has one weight");
            return Err(reader.invalid("corners.weights", corners.weights.len(), expected));
        }
        weights(reader, "corners.weights", &corners.weights)?;
        let needed = rules.approach.max(rules.departure) + rules.truck_behind.max(rules.truck_ahead);
        if arms.length[0] < needed.max(s_bend.end) {
            let expected = format!(
                "must be at least {} m: the way that rules.* need beside the ring",
                shown(needed.max(s_bend.end))
            );
            return Err(reader.invalid("arms.length", format_args!("{} m", shown(arms.length[0])), expected));
        }
        Ok(())
    }
}

/// A range within `limits`, in order.
fn range(
    reader: &Reader,
    key: &str,
    Exactly([low, high]): Range,
    limits: RangeInclusive<f64>,
    unit: &str,
) -> Result<(), Error> {
    reader.within(key, low, limits.clone(), unit)?;
    reader.within(key, high, limits, unit)?;
    if low <= high {
        return Ok(());
    }
    let value = format!("[{}, {}] {unit}", shown(low), shown(high));
    Err(reader.invalid(key, value.trim_end(), "the least value comes first"))
}

/// Weights of 0..1 of which one is not 0.
fn weights(reader: &Reader, key: &str, weights: &[f64]) -> Result<(), Error> {
    for (index, &weight) in weights.iter().enumerate() {
        reader.within(&format!("{key}[{index}]"), weight, 0.0..=1.0, "")?;
    }
    if weights.iter().all(|&weight| weight == 0.0) {
        return Err(reader.invalid(key, "all 0", "one of them must be above 0"));
    }
    Ok(())
}
