//! Kerb and right lane between an arm and the next one, where they do not follow the ring.

use serde::{Deserialize, Serialize};

use crate::files::reader::{Error, Reader};

#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WrittenCorner {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) kerb_radius: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) lane_radius: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) lane: Option<CornerLane>,
}

/// Where the right lane to the first exit lies although the kerb beside it passes outside the ring.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum CornerLane {
    /// On the ring's outermost lane.
    Ring,
}

impl WrittenCorner {
    /// Whether nothing is written.
    pub(super) fn is_empty(&self) -> bool {
        *self == WrittenCorner::default()
    }

    /// Whether the right lane follows the ring although the kerb does not.
    pub(super) fn lane_on_ring(&self, reader: &Reader, key: &str) -> Result<bool, Error> {
        if self.lane.is_some() && (self.kerb_radius.is_none() || self.lane_radius.is_some()) {
            let expected = "is for a corner with kerb_radius and without lane_radius: leave it out, the lane follows \
                            the ring or that radius";
            return Err(reader.invalid(key, "\"ring\"", expected));
        }
        Ok(self.lane.is_some())
    }
}
