//! The ring around the central island, and where its lanes lie.

use crate::map::route::Lane;

/// The ring around the central island.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ring {
    /// Radius of the island's kerb face (m).
    pub(super) island_radius: f64,
    /// Width of the strip between a kerb's face and the lane beside it (m).
    pub(super) gutter: f64,
    /// Width of each lane (m).
    pub(super) lane_width: f64,
    /// Number of lanes, 1 to 3.
    pub(super) lanes: usize,
    /// Width of the island's apron; 0 where it has none (m).
    pub(super) apron: f64,
}

impl Ring {
    /// Radius of the outer kerb's face (m).
    pub(super) fn outer(&self) -> f64 {
        self.island_radius + (2.0 * self.gutter + self.lanes as f64 * self.lane_width)
    }

    /// Radius of the apron's inner edge, if there is an apron (m).
    pub(super) fn behind_apron(&self) -> Option<f64> {
        (0.0 < self.apron).then_some(self.island_radius - self.apron)
    }

    /// Radius of the centre line of the lane that has `from_kerb` lanes outside it (m).
    pub(super) fn lane_radius(&self, from_kerb: usize) -> f64 {
        let innermost = self.island_radius + self.gutter + self.lane_width / 2.0;
        innermost + (self.lanes - 1 - from_kerb) as f64 * self.lane_width
    }

    /// From the centre line of a lane to the ring's lane edges on its left and on its right (m).
    pub(super) fn crossing(&self, lane: Lane) -> (f64, f64) {
        let half = self.lane_width / 2.0;
        let (left, right) = (self.lanes - 1 - lane.index(), lane.index());
        (half + left as f64 * self.lane_width, half + right as f64 * self.lane_width)
    }
}
