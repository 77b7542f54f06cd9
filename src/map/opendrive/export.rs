//! A road as an OpenDRIVE map: one junction with a connecting road for each route, a road for each lane of an arm, and
//! kerbs as roads of their own, in the frame of the map that the road is from.
//!
//! Reference lines are the lines and arcs that the road is made of, so nothing is approximated but the widths of
//! gutters that vary. A lane lies around its reference line, by a lane offset of half its width.

mod back; // what was written, read back
mod kerbs; // kerb faces, with the gutters beside them
mod middles; // what lies between the carriageways of an arm
mod ring; // the ring's lanes
mod ways; // lanes of arms, and connecting roads
mod xml; // numbers and elements

use std::path::Path;

use crate::files::reader::{Error, Reader};
use crate::geometry::Curve;
use crate::map::Road;
use crate::map::ground::Hand;
use xml::{header, written};

/// A road of the map.
struct Written {
    id: usize,
    name: String,
    /// The connecting road's junction is the only one.
    is_connecting: bool,
    /// Reference line around the origin of the road that is written.
    line: Curve,
    /// How far the lanes are moved to the left of the reference line; a driving lane's own offset puts it around it
    /// (m).
    offset: f64,
    lanes: Vec<WrittenLane>,
    predecessor: Option<Link>,
    successor: Option<Link>,
}

/// What a road leads to, or comes from.
#[derive(Clone, Copy)]
enum Link {
    Junction,
    /// The end of the road of this number, which leads into the junction.
    EndOf(usize),
    /// The beginning of the road of this number, which leads out of it.
    StartOf(usize),
}

/// A lane of a road, all along it.
struct WrittenLane {
    /// Positive left of the reference line.
    id: i32,
    kind: Kind,
    widths: Vec<Width>,
}

/// What a lane is for.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// Trucks drive on it: its centre is the reference line.
    Driving,
    /// A lane of the ring, beside the reference line.
    Ring,
    /// What is paved between two carriageways.
    Middle,
    /// A gutter.
    Shoulder,
    /// A kerb's stone.
    Curb,
    /// An apron.
    Apron,
}

/// A width that holds from `start` on: `a + b x + c x² + d x³`.
struct Width {
    start: f64,
    factors: [f64; 4],
}

impl Width {
    fn constant(width: f64) -> Vec<Width> {
        vec![Width { start: 0.0, factors: [width, 0.0, 0.0, 0.0] }]
    }

    /// Straight widths through samples of station and width, each as long as it leaves no sample by more than a
    /// millimetre.
    fn through(samples: &[(f64, f64)]) -> Vec<Width> {
        let mut widths = Vec::new();
        let mut from = 0;
        while from + 1 < samples.len() {
            let (start, width) = samples[from];
            let slope = |to: usize| (samples[to].1 - width) / (samples[to].0 - start);
            let holds = |to: &usize| {
                let off = |&(s, sampled): &(f64, f64)| (width + slope(*to) * (s - start) - sampled).abs();
                samples[from..*to].iter().all(|sample| off(sample) < 1e-3)
            };
            let to = (from + 1..samples.len()).take_while(holds).last().unwrap_or(from + 1);
            widths.push(Width { start, factors: [width, slope(to), 0.0, 0.0] });
            from = to;
        }
        widths
    }
}

/// A road as the text of an OpenDRIVE 1.6 map, which was read back.
///
/// # Errors
///
/// Arms that end where the junction does, and a road that is not read back with its routes and with its kerbs within
/// 10 cm: where more is paved than the routes' lanes and the gutters beside the kerbs.
pub fn exported(road: &Road) -> Result<String, Error> {
    let seen = road.seen();
    let reader = Reader::of(Path::new(&road.name));
    let hand = if road.is_mirrored() { Hand::Left } else { Hand::Right };
    let ways = ways::ways(&reader, seen.ground(), hand)?;
    let ring = ring::ring(seen.ground(), hand, 1 + ways.len());
    let middles = middles::middles(seen.ground(), hand, 1 + ways.len() + ring.len());
    let kerbs = kerbs::kerbs(seen.ground(), 1 + ways.len() + ring.len() + middles.len());
    let mut text = header(&seen);
    for one in ways.iter().chain(&ring).chain(&middles).chain(&kerbs) {
        written(&mut text, one, hand, seen.ground().origin);
    }
    xml::junction(&mut text, &road.name, hand, &ways);
    text += "</OpenDRIVE>\n";
    back::check(&reader, road, &text)?;
    Ok(text)
}

/// The number of the lane of a road that is driven along its reference line.
fn lane_id(hand: Hand) -> i32 {
    match hand {
        Hand::Right => -1,
        Hand::Left => 1,
    }
}
