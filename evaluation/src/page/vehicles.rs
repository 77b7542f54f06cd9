//! The other vehicles of recorded episodes, behind the columns of the trucks: of each episode every [`EVERY`]th frame
//! and the last, slot by slot, in the same whole numbers. `data.js` decodes those of an episode when it is opened.

use serde::Serialize;

use super::tracks::{ANGLE, LENGTH, push};
use crate::recording::{Track, Vehicle};

/// Frames from one that is kept to the next: what lies between is interpolated.
const EVERY: usize = 5;
/// Bits of a look: whether brake lights are lit, whether the driver is rude; above them width and length in decimetres.
const BRAKES: i32 = 1;
const RUDE: i32 = 2;
const WIDTH: u32 = 2;
const LENGTH_IN: u32 = 8;

/// Where they lie in the data, and how they are read.
#[derive(Serialize)]
pub(super) struct Vehicles {
    /// Frames from one that is kept to the next.
    every: usize,
    /// Slots of a frame.
    n_slots: usize,
    /// Name and unit of the four values of each slot.
    values: [(&'static str, f64); 4],
    /// Bytes of each episode.
    bytes: Vec<usize>,
}

/// The bytes of all episodes one after the other, and what the page reads them by; none where there are no vehicles.
pub(super) fn packed(tracks: &[Track]) -> Option<(Vehicles, Vec<u8>)> {
    let slots = tracks.iter().flat_map(|track| track.vehicles.iter().flatten()).map(|vehicle| vehicle.slot + 1);
    let n_slots = slots.max()?;
    let mut all = Vec::new();
    let bytes = tracks.iter().map(|track| write(track, n_slots, &mut all)).collect();
    let values = [("x", LENGTH), ("y", LENGTH), ("heading", ANGLE), ("look", 1.0)];
    Some((Vehicles { every: EVERY, n_slots, values, bytes }, all))
}

/// Appends those of an episode, and gives the number of bytes.
fn write(track: &Track, n_slots: usize, bytes: &mut Vec<u8>) -> usize {
    let before = bytes.len();
    let last = track.frames.len() - 1;
    let kept: Vec<usize> = (0..last).step_by(EVERY).chain([last]).collect();
    for slot in 0..n_slots {
        let of = |frame: usize| track.vehicles.get(frame)?.iter().find(|vehicle| vehicle.slot == slot);
        for value in 0..4 {
            let mut known = 0;
            for &frame in &kept {
                // Where there is none the place stays and the look is 0.
                let absent = if value == 3 { 0 } else { known };
                let whole = of(frame).map_or(absent, |vehicle| values(vehicle)[value]);
                push(bytes, whole.wrapping_sub(known));
                known = whole;
            }
        }
    }
    bytes.len() - before
}

/// Place, heading and look in whole numbers of their units.
fn values(vehicle: &Vehicle) -> [i32; 4] {
    let whole = |value: f32, unit: f64| (f64::from(value) / unit).round() as i32;
    let flag = |is_set: bool, bit: i32| if is_set { bit } else { 0 };
    let size = whole(vehicle.length, 0.1) << LENGTH_IN | whole(vehicle.width, 0.1) << WIDTH;
    let look = size | flag(vehicle.brakes(), BRAKES) | flag(vehicle.is_rude, RUDE);
    let [x, y] = vehicle.position;
    [whole(x, LENGTH), whole(y, LENGTH), whole(vehicle.heading, ANGLE), look]
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use offtrack::files::cache::Loading;
    use offtrack::scenario::{Scenario, Split};
    use offtrack::simulator::{RouteChoice, Simulator};
    use offtrack::world::World;

    use super::*;
    use crate::recording::Recorder;

    /// The whole numbers of some bytes, as `data.js` reads them.
    fn decoded(bytes: &[u8], n: usize) -> Vec<i32> {
        let (mut values, mut at, mut value) = (Vec::new(), 0, 0i32);
        while at < bytes.len() {
            if values.len() % n == 0 {
                value = 0;
            }
            let (mut word, mut shift) = (0u32, 0);
            loop {
                word |= u32::from(bytes[at] & 0x7f) << shift;
                shift += 7;
                at += 1;
                if bytes[at - 1] & 0x80 == 0 {
                    break;
                }
            }
            value = value.wrapping_add((word >> 1) as i32 ^ -((word & 1) as i32));
            values.push(value);
        }
        values
    }

    #[test]
    fn vehicles_are_kept_every_half_second_where_they_were_and_only_where_there_are_some() {
        let text = Scenario::text_of("attard2023").unwrap() + "\n[traffic]\ndemand = [1500]\nvans = 0.3\nrude = 0.3\n";
        let mut scenario = Scenario::parse("among", &text, None, &Loading::PLAIN).unwrap();
        scenario.retain(|_, route| route.name.starts_with("20m/N"));
        let world = Arc::new(World::bake(&scenario).unwrap());
        let routes = scenario.split(Split::Test)[..2].to_vec();
        let mut simulator = Simulator::new(world.clone(), 2, 3, RouteChoice::Fixed(routes)).unwrap();
        let mut recorder = Recorder::new(&world, simulator.batch(), 0..2);
        while recorder.is_running() {
            simulator.step(&[4, 6]).unwrap();
            recorder.follow(&world, simulator.batch());
        }
        let mut tracks = recorder.finish();
        let (vehicles, bytes) = packed(&tracks).unwrap();
        assert_eq!(vehicles.bytes.iter().sum::<usize>(), bytes.len());
        let mut from = 0;
        let (mut n_there, mut n_vans, mut n_rude) = (0, 0, 0);
        for (track, n_bytes) in tracks.iter().zip(&vehicles.bytes) {
            assert_eq!(track.vehicles.len(), track.frames.len());
            let n = (track.frames.len() - 1).div_ceil(EVERY) + 1;
            let values = decoded(&bytes[from..][..*n_bytes], n);
            from += n_bytes;
            assert_eq!(values.len(), 4 * n * vehicles.n_slots);
            for kept in 0..n {
                let frame = (kept * EVERY).min(track.frames.len() - 1);
                for slot in 0..vehicles.n_slots {
                    let [x, y, heading, look] = [0, 1, 2, 3].map(|value| values[(4 * slot + value) * n + kept]);
                    let Some(there) = track.vehicles[frame].iter().find(|vehicle| vehicle.slot == slot) else {
                        assert_eq!(look, 0);
                        continue;
                    };
                    assert!((f64::from(x) * LENGTH - f64::from(there.position[0])).abs() < 0.006);
                    assert!((f64::from(y) * LENGTH - f64::from(there.position[1])).abs() < 0.006);
                    assert!((f64::from(heading) * ANGLE - f64::from(there.heading)).abs() < 1e-4);
                    assert_eq!((look & BRAKES != 0, look & RUDE != 0), (there.brakes(), there.is_rude));
                    assert!(((look >> LENGTH_IN) as f32 / 10.0 - there.length).abs() < 0.06);
                    n_there += 1;
                    n_vans += usize::from(there.is_van());
                    n_rude += usize::from(there.is_rude);
                }
            }
        }
        assert!(100 < n_there && 0 < n_vans && n_vans < n_there, "{n_there} {n_vans} {n_rude}");
        tracks.iter_mut().for_each(|track| track.vehicles.clear());
        assert!(packed(&tracks).is_none());
    }
}
