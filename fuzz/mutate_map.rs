//! Breaks a map in many ways and imports what is left: every attempt must end in a result or an error, in time.
//!
//! `cargo run --release --example mutate_map -- MAP.xodr COUNT [SEED]`. Bytes are changed, dropped and doubled; numbers
//! are replaced by extreme ones. Prints how many attempts ended how, and the longest time.

use std::path::Path;
use std::time::Instant;

use offtrack::map::opendrive::{Hand, Imported, Map, Options};
use offtrack::map::{Gutter, Road};

/// Numbers that break things.
const EXTREMES: [&str; 12] = ["0", "-1", "1e308", "-1e308", "nan", "inf", "1e-300", "99999", "-99999", "", "x", "0.5"];

/// The next number of a xorshift generator.
fn next(state: &mut u64) -> usize {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    (*state >> 16) as usize
}

/// The text with a few faults: in its bytes, or every second time in its values alone.
fn broken(text: &str, state: &mut u64) -> String {
    let mut bytes = text.as_bytes().to_vec();
    let in_values = next(state).is_multiple_of(2);
    for _ in 0..1 + next(state) % 4 {
        let at = next(state) % bytes.len();
        match if in_values { 3 } else { next(state) % 4 } {
            0 => bytes[at] = b' ' + (next(state) % 95) as u8,
            1 => drop(bytes.drain(at..(at + 1 + next(state) % 40).min(bytes.len()))),
            2 => {
                let copy = bytes[at..(at + 1 + next(state) % 400).min(bytes.len())].to_vec();
                bytes.splice(at..at, copy);
            }
            _ => {
                let Some(value) = value_after(&bytes, at) else { continue };
                let changed = changed(&String::from_utf8_lossy(&bytes[value.clone()]), &bytes, state);
                bytes.splice(value, changed.bytes());
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Where the value of the attribute after a place stands.
fn value_after(bytes: &[u8], at: usize) -> Option<std::ops::Range<usize>> {
    let from = at + bytes[at..].windows(2).position(|pair| pair == b"=\"")? + 2;
    let length = bytes[from..].iter().position(|&byte| byte == b'"')?;
    Some(from..from + length)
}

/// A changed value of an attribute: extreme, near the old one, or that of another attribute.
fn changed(value: &str, bytes: &[u8], state: &mut u64) -> String {
    let near = |value: f64, state: &mut u64| match next(state) % 5 {
        0 => -value,
        1 => value * 1.5,
        2 => value / 100.0,
        3 => value + 1.0,
        _ => value + 1e-3,
    };
    match (next(state) % 3, value.parse::<f64>()) {
        (0, _) => EXTREMES[next(state) % EXTREMES.len()].to_owned(),
        (1, Ok(number)) if value.contains('.') => near(number, state).to_string(),
        (1, Ok(number)) => near(number, state).round().to_string(),
        _ => {
            let other = value_after(bytes, next(state) % bytes.len());
            other.map_or(String::new(), |other| String::from_utf8_lossy(&bytes[other]).into_owned())
        }
    }
}

/// Panics unless what was imported can be driven on.
fn check(imported: Imported) {
    let roundabout = Road::on("broken".to_owned(), imported.ground);
    let faces = roundabout.kerbs(Gutter::Drivable);
    let _ = roundabout.kerbs(Gutter::Solid);
    assert!(roundabout.island_radius().is_finite() && roundabout.outer_radius().is_finite());
    // An arm that is too short is a usual error.
    for route in roundabout.routes(20.0, 20.0, 2.0).into_iter().flatten() {
        assert!(route.waypoints.iter().all(|waypoint| waypoint.position.is_finite() && waypoint.heading.is_finite()));
        assert!(route.waypoints.iter().all(|waypoint| faces.signed_distance(waypoint.position).is_finite()));
    }
}

/// How attempts ended.
#[derive(Default, Debug)]
struct Counts {
    refused: usize,
    without_ring: usize,
    not_drivable: usize,
    imported: usize,
}

fn attempt(file: &Path, text: &str, counts: &mut Counts) {
    let Ok(map) = Map::parse(file, text, Hand::Map) else {
        counts.refused += 1;
        return;
    };
    match map.rings().first().map(|ring| map.ground(ring, &Options::default())) {
        None => counts.without_ring += 1,
        Some(Err(_)) => counts.not_drivable += 1,
        Some(Ok(imported)) => {
            check(imported);
            counts.imported += 1;
        }
    }
}

/// Seconds that this thread has computed where the system tells, else seconds that have passed.
fn seconds(start: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |nanoseconds| nanoseconds / 1e9)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, count, rest @ ..] = arguments.as_slice() else { return Err("MAP.xodr COUNT [SEED]".into()) };
    let text = std::fs::read_to_string(file)?;
    let mut state = rest.first().map_or(Ok(1), |seed| seed.parse::<u64>())?.max(1);
    let (mut counts, mut longest) = (Counts::default(), 0.0f64);
    let (count, start) = (count.parse::<usize>()?, Instant::now());
    for i in 1..=count {
        let text = broken(&text, &mut state);
        let begun = seconds(start);
        let attempt = std::panic::AssertUnwindSafe(|| attempt(Path::new(file), &text, &mut counts));
        if std::panic::catch_unwind(attempt).is_err() {
            let kept = std::env::temp_dir().join("broken.xodr");
            std::fs::write(&kept, &text)?;
            return Err(format!("attempt {i} panicked; its map is {}", kept.display()).into());
        }
        let took = seconds(start) - begun;
        if longest.max(1.0) < took {
            let kept = std::env::temp_dir().join("slow.xodr");
            std::fs::write(&kept, &text)?;
            println!("attempt {i} took {took:.1} s; its map is {}", kept.display());
        }
        longest = longest.max(took);
        if i.is_multiple_of(10_000) || i == count {
            println!("{i}: {counts:?}; longest {longest:.2} s");
        }
    }
    Ok(())
}
