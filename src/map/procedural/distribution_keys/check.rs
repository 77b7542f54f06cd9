//! The check of every value of a distribution file, a table at a time.

use std::ops::RangeInclusive;

use super::{
    Arms, Axis, Corners, Flared, Kerb, Keys, Lanes, LastBend, Median, Range, Ring, Rules, SBend, Single, Splitters,
    Straight, Widening,
};
use crate::files::reader::{Error, Exactly, Reader, shown};

impl Keys {
    /// An error for the first value out of its range.
    pub(in crate::map::procedural) fn check(&self, reader: &Reader) -> Result<(), Error> {
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
        ring.check(reader)?;
        if let Some(single) = single {
            single.check(reader)?;
        } else if 0.0 < ring.lanes[0] {
            return Err(reader.invalid(
                "single",
                "missing",
                "rings of one lane, which ring.lanes has, need this table",
            ));
        }
        arms.check(reader)?;
        axis.check(reader)?;
        median.check(reader)?;
        widening.check(reader)?;
        s_bend.check(reader)?;
        straight.check(reader)?;
        flared.check(reader)?;
        bend.check(reader)?;
        kerb.check(reader)?;
        lanes.check(reader)?;
        corners.check(reader)?;
        splitters.check(reader)?;
        rules.check(reader)?;
        let needed = rules.length_of_arms().max(s_bend.end);
        if arms.length[0] < needed {
            let expected = format!("must be at least {} m: the way that rules.* need beside the ring", shown(needed));
            return Err(reader.invalid("arms.length", format_args!("{} m", shown(arms.length[0])), expected));
        }
        Ok(())
    }
}

impl Ring {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        weights(reader, "ring.lanes", &*self.lanes)?;
        range(reader, "ring.island_radius", self.island_radius, 1.5..=200.0, "m")?;
        reader.within("ring.small_radius", self.small_radius, 1.5..=200.0, "m")?;
        reader.within("ring.small_weight", self.small_weight, 0.1..=100.0, "times")?;
        range(reader, "ring.lane_width", self.lane_width, 2.5..=12.0, "m")?;
        reader.within("ring.narrow_radius", self.narrow_radius, 1.5..=200.0, "m")?;
        reader.within("ring.narrow_lane_width", self.narrow_lane_width, 2.5..=12.0, "m")?;
        range(reader, "ring.gutter", self.gutter, 0.0..=3.0, "m")?;
        self.apron.map_or(Ok(()), |apron| range(reader, "ring.apron", apron, 0.0..=50.0, "m"))
    }
}

impl Single {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        range(reader, "single.island_radius", self.island_radius, 1.5..=200.0, "m")?;
        range(reader, "single.lane_width", self.lane_width, 2.5..=12.0, "m")?;
        reader.within("single.outer_radius", self.outer_radius, 5.0..=200.0, "m")?;
        Ok(())
    }
}

impl Arms {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        weights(reader, "arms.shares", &*self.shares)?;
        reader.within("arms.five_from", self.five_from, 5.0..=500.0, "m")?;
        reader.within("arms.gap_variation", self.gap_variation, 0.0..=0.9, "")?;
        // Names by eight directions of the compass need arms that are farther apart than those.
        reader.within("arms.least_gap_deg", self.least_gap_deg, 46.0..=72.0, "deg")?;
        range(reader, "arms.length", self.length, 15.0..=500.0, "m")
    }
}

impl Axis {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        reader.within("axis.share", self.share, 0.0..=1.0, "")?;
        reader.within("axis.deviation", self.deviation, 0.0..=0.5, "of the outer radius")?;
        Ok(())
    }
}

impl Median {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        reader.within("median.share", self.share, 0.0..=1.0, "")?;
        range(reader, "median.half_width", self.half_width, 0.0..=10.0, "m")
    }
}

impl Widening {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        reader.within("widening.share", self.share, 0.0..=1.0, "")?;
        range(reader, "widening.width", self.width, 0.01..=10.0, "m")?;
        range(reader, "widening.length", self.length, 1.0..=100.0, "m")
    }
}

impl SBend {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        reader.within("s_bend.share", self.share, 0.0..=1.0, "")?;
        range(reader, "s_bend.shift", self.shift, 0.01..=20.0, "m")?;
        range(reader, "s_bend.length", self.length, 5.0..=100.0, "m")?;
        reader.within("s_bend.end", self.end, 10.0..=400.0, "m")?;
        Ok(())
    }
}

impl Straight {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        reader.within("straight.share", self.share, 0.0..=1.0, "")?;
        reader.within("straight.angle_deg", self.angle_deg, -30.0..=30.0, "deg")?;
        reader.within("straight.angle_deviation_deg", self.angle_deviation_deg, 0.0..=15.0, "deg")?;
        range(reader, "straight.kerb_arc", self.kerb_arc, 0.2..=200.0, "m")
    }
}

impl Flared {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        range(reader, "flared.aim", self.aim, 0.1..=1.0, "of the outer radius")?;
        range(reader, "flared.kerb_arc", self.kerb_arc, 0.2..=200.0, "m")
    }
}

impl LastBend {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        range(reader, "bend.before_ring", self.before_ring, 1.0..=100.0, "m")?;
        range(reader, "bend.radius", self.radius, 5.0..=1000.0, "m")
    }
}

impl Kerb {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        reader.within("kerb.deviation", self.deviation, 0.0..=3.0, "m")?;
        Ok(())
    }
}

impl Lanes {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        reader.within("lanes.single_share", self.single_share, 0.0..=1.0, "")?;
        reader.within("lanes.share", self.share, 0.0..=1.0, "")?;
        reader.within("lanes.deviation", self.deviation, 0.0..=3.0, "m")?;
        range(reader, "lanes.ring_radius", self.ring_radius, 0.5..=5.0, "times")
    }
}

impl Corners {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        let n_shares = self.shares.len();
        reader.length("corners.shares", n_shares, 1..=16, "values")?;
        for (index, &share) in self.shares.iter().enumerate() {
            reader.within(&format!("corners.shares[{index}]"), share, 0.0..=1.0, "")?;
        }
        if self.weights.len() != n_shares {
            let expected = format!("corners.shares has {n_shares}, and each has one weight");
            return Err(reader.invalid("corners.weights", self.weights.len(), expected));
        }
        weights(reader, "corners.weights", &self.weights)?;
        range(reader, "corners.kerb_radius", self.kerb_radius, 0.2..=200.0, "m")
    }
}

impl Splitters {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        reader.within("splitters.share", self.share, 0.0..=1.0, "")?;
        reader.within("splitters.least_width", self.least_width, 0.5..=20.0, "m")?;
        range(reader, "splitters.corner_radius", self.corner_radius, 0.1..=2.0, "m")
    }
}

impl Rules {
    fn check(&self, reader: &Reader) -> Result<(), Error> {
        reader.within("rules.lane_clearance", self.lane_clearance, 1.3..=3.0, "m")?;
        reader.within("rules.start_clearance", self.start_clearance, 0.0..=2.0, "m")?;
        reader.within("rules.approach", self.approach, 5.0..=400.0, "m")?;
        reader.within("rules.departure", self.departure, 5.0..=400.0, "m")?;
        reader.within("rules.start_offset", self.start_offset, 0.0..=1.0, "m")?;
        reader.within("rules.start_heading_deg", self.start_heading_deg, 0.0..=20.0, "deg")?;
        reader.within("rules.truck_ahead", self.truck_ahead, 0.5..=20.0, "m")?;
        reader.within("rules.truck_behind", self.truck_behind, 0.5..=40.0, "m")?;
        reader.within("rules.truck_width", self.truck_width, 1.0..=4.0, "m")?;
        Ok(())
    }

    /// What a route drives along an arm, and the truck's reach beyond (m).
    fn length_of_arms(&self) -> f64 {
        self.approach.max(self.departure) + self.truck_behind.max(self.truck_ahead)
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
