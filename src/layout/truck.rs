//! What follows from a truck's own state.

use glam::Vec2;

use super::{Rig, Truck};
use crate::layout::angle::direction;

impl Truck {
    /// Middle of the trailer's axle group (m).
    #[inline]
    pub fn trailer_position(&self, rig: &Rig) -> Vec2 {
        self.position + rig.fifth_wheel * direction(self.heading)
            - rig.trailer_wheelbase * direction(self.trailer_heading)
    }

    /// The larger load transfer ratio of both units, without its sign.
    #[inline]
    pub fn load_transfer_ratio(&self) -> f32 {
        self.tractor_load_transfer_ratio.abs().max(self.trailer_load_transfer_ratio.abs())
    }
}
