//! Left-hand traffic: a file describes the road as it lies in the world, and its mirror image in the x axis is driven.
//!
//! In such a file everything goes around clockwise. Bearings and offsets change their signs, and the lane next to the
//! kerb is `left` instead of `right`.

use super::roundabout_keys::{Written, WrittenAlignment, WrittenArm, WrittenPoint, WrittenWay};
use crate::files::reader::Error;
use crate::map::ground::Hand;

/// Words at the end of a message about a position.
const MIRRORED: &str = "hand = \"left\": positions in this message are those of the mirror image in the x axis";

impl Written {
    pub(super) fn is_left_hand(&self) -> bool {
        self.hand == Hand::Left
    }

    /// The mirror image, with right-hand traffic.
    pub(super) fn mirrored(mut self) -> Written {
        self.hand = Hand::Right;
        let gutters = [&mut self.ring.island_gutter, &mut self.ring.mouth_gutter];
        gutters.into_iter().flatten().flatten().for_each(|point| point.bearing_deg = -point.bearing_deg);
        self.arm.iter_mut().for_each(WrittenArm::mirror);
        self
    }
}

impl WrittenArm {
    fn mirror(&mut self) {
        self.bearing_deg = -self.bearing_deg;
        self.splitter.iter_mut().for_each(WrittenPoint::mirror);
        for WrittenWay { kerb, left, right, .. } in [&mut self.entry, &mut self.exit] {
            std::mem::swap(left, right);
            [Some(kerb), left.as_mut(), right.as_mut()].into_iter().flatten().for_each(WrittenAlignment::mirror);
        }
    }
}

impl WrittenAlignment {
    fn mirror(&mut self) {
        self.points.iter_mut().for_each(WrittenPoint::mirror);
    }
}

impl WrittenPoint {
    fn mirror(&mut self) {
        self.offset = -self.offset;
    }
}

/// An error of the mirror image by the keys of the file: lanes have their names there, and the message says that
/// positions are mirrored.
pub(super) fn as_written(error: Error) -> Error {
    let Error::Invalid { file, key, value, expected } = error else { return error };
    let [key, value, expected] = [key, value, expected].map(|text| lanes_swapped(&text));
    Error::Invalid { file, key, value, expected: format!("{expected} ({MIRRORED})") }
}

/// A key or a message in which each lane has the name of the other side: a direction, as in "left of", stays.
fn lanes_swapped(message: &str) -> String {
    let pairs = [
        ("entry.left", "entry.right"),
        ("exit.left", "exit.right"),
        ("left lane", "right lane"),
        ("`left`", "`right`"),
        ("counter-clockwise", "clockwise"),
    ];
    pairs.iter().fold(message.to_owned(), |message, (left, right)| {
        let parts: Vec<String> = message.split(left).map(|part| part.replace(right, left)).collect();
        parts.join(right)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_of_a_message_change_their_names_and_directions_stay() {
        let message = "4 m left of entry.left, right of exit.right: left lanes, the right lane's, to the left";
        let swapped = "4 m left of entry.right, right of exit.left: right lanes, the left lane's, to the left";
        assert_eq!(lanes_swapped(message), swapped);
        assert_eq!(lanes_swapped(swapped), message);
        let message = "one lane, which is `right`: leave `left` out; arms follow each other counter-clockwise";
        let swapped = "one lane, which is `left`: leave `right` out; arms follow each other clockwise";
        assert_eq!((lanes_swapped(message).as_str(), lanes_swapped(swapped).as_str()), (swapped, message));
    }
}
