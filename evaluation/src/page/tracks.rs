//! Recorded episodes in few bytes: whole numbers of a unit, column by column, the difference to the previous frame as a
//! zigzag varint (seven bits a byte, lowest first, the eighth bit set if more follow; 0, -1, 1, -2 are 0, 1, 2, 3).
//!
//! The first difference of each episode is to 0. `data.js` decodes them, from gzip in base64.

use std::io::Write;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use offtrack::layout::N_RAYS;

use crate::recording::{Frame, Track};

/// Resolution of lengths (m).
pub(super) const LENGTH: f64 = 0.01;
/// Resolution of angles (rad).
pub(super) const ANGLE: f64 = 1e-4;
/// Resolution of speeds (m/s) and of load transfer ratios.
const HUNDREDTH: f64 = 0.01;
/// Resolution of ranges: this many parts of a sensor's reach.
const RANGE_PARTS: f64 = 255.0;

/// One value of every frame.
pub(super) struct Column {
    /// The column's name in the page's scripts.
    pub(super) name: String,
    /// The unit of the column's whole numbers.
    pub(super) unit: f64,
    value: Box<dyn Fn(&Frame) -> f32>,
}

/// The values kept of a frame. The trailer's position follows from the tractor's and both headings.
pub(super) fn columns(sensor_range: f32) -> Vec<Column> {
    let column = |name: &str, unit: f64, value: fn(&Frame) -> f32| Column {
        name: name.to_owned(),
        unit,
        value: Box::new(value),
    };
    let mut columns = vec![
        column("x", LENGTH, |frame| frame.position[0]),
        column("y", LENGTH, |frame| frame.position[1]),
        column("heading", ANGLE, |frame| frame.heading),
        column("trailer_heading", ANGLE, |frame| frame.trailer_heading),
        column("steering", ANGLE, |frame| frame.steering),
        column("speed", HUNDREDTH, |frame| frame.speed),
        column("lane_distance", LENGTH, |frame| frame.lane_distance),
        column("tractor_clearance", LENGTH, |frame| frame.tractor_clearance),
        column("trailer_clearance", LENGTH, |frame| frame.trailer_clearance),
        column("tractor_load_transfer", HUNDREDTH, |frame| frame.tractor_load_transfer_ratio),
        column("trailer_load_transfer", HUNDREDTH, |frame| frame.trailer_load_transfer_ratio),
    ];
    let range = |ray: usize| Column {
        name: format!("range_{ray}"),
        unit: f64::from(sensor_range) / RANGE_PARTS,
        value: Box::new(move |frame: &Frame| frame.ranges[ray]),
    };
    columns.extend((0..N_RAYS).map(range));
    columns
}

/// Bytes as gzip in base64.
pub(crate) fn packed(bytes: &[u8]) -> std::io::Result<String> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes)?;
    Ok(BASE64_STANDARD.encode(encoder.finish()?))
}

/// All tracks.
pub(super) fn differences(tracks: &[Track], columns: &[Column]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for column in columns {
        for track in tracks {
            let mut before = 0;
            for frame in &track.frames {
                let value = (f64::from((column.value)(frame)) / column.unit).round() as i32;
                push(&mut bytes, value.wrapping_sub(before));
                before = value;
            }
        }
    }
    bytes
}

/// Appends a zigzag varint.
pub(super) fn push(bytes: &mut Vec<u8>, value: i32) {
    let mut word = ((value << 1) ^ (value >> 31)) as u32;
    while 0x80 <= word {
        bytes.push(word as u8 | 0x80);
        word >>= 7;
    }
    bytes.push(word as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_are_encoded_as_in_protocol_buffers() {
        // The table of Protocol Buffers' documentation of its encoding, and its varint of 150 (75 as zigzag).
        for (value, expected) in [
            (0, &[0][..]),
            (-1, &[1]),
            (1, &[2]),
            (-2, &[3]),
            (75, &[0x96, 0x01]),
            (i32::MIN, &[255, 255, 255, 255, 15]),
        ] {
            let mut bytes = Vec::new();
            push(&mut bytes, value);
            assert_eq!(bytes, expected, "{value}");
        }
    }
}
