//! Where the frame that a road is driven in lies in the map that the road is from.
//!
//! The driven frame has the road's centre as its origin, and traffic keeps to the right there: a road with left-hand
//! traffic is driven as its mirror image in the x axis.

use glam::DVec2;

/// The frame of a road in its map: x east, y north, angles counter-clockwise in both. The default is a road without a
/// map.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Frame {
    /// The road's centre in the map's frame (m).
    pub origin: DVec2,
    /// Whether the road is driven as its mirror image in the x axis.
    pub mirrored: bool,
}

impl Frame {
    /// A point of the map in the driven frame (m).
    #[inline]
    pub fn from_map(&self, p: DVec2) -> DVec2 {
        self.turned(p - self.origin)
    }

    /// A point of the driven frame in the map's (m).
    #[inline]
    pub fn to_map(&self, p: DVec2) -> DVec2 {
        self.origin + self.turned(p)
    }

    /// An angle of one frame in the other: a heading, a steer angle, a roll (rad).
    #[inline]
    pub fn angle(&self, angle: f64) -> f64 {
        if self.mirrored { -angle } else { angle }
    }

    fn turned(&self, p: DVec2) -> DVec2 {
        if self.mirrored { DVec2::new(p.x, -p.y) } else { p }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_goes_from_the_map_to_the_driven_frame_and_back_within_a_nanometre() {
        for mirrored in [false, true] {
            let frame = Frame { origin: DVec2::new(694.346_21, 1_744.856_43), mirrored };
            for (p, heading) in [(DVec2::new(640.5, 1_790.25), 3.1), (DVec2::new(-12.0, 7.0), -0.2)] {
                assert!(frame.to_map(frame.from_map(p)).distance(p) < 1e-9);
                assert_eq!(frame.angle(frame.angle(heading)), heading);
            }
            // Left of the centre in the map is to the right in its mirror image.
            let north = frame.from_map(frame.origin + DVec2::new(0.0, 2.0));
            assert!(north.distance(DVec2::new(0.0, if mirrored { -2.0 } else { 2.0 })) < 1e-9);
        }
    }
}
