//! Breaks a map in many ways and imports what is left: every attempt must end in a result or an error, in time.
//!
//! `cargo run --release --example mutate_map -- MAP.xodr COUNT [SEED]`. Bytes are changed, dropped and doubled; numbers
//! are replaced by extreme ones. Prints how many attempts ended how, and the longest time.

use std::path::Path;
use std::time::Instant;

use offtrack::opendrive::{Hand, Map, Options};

/// Numbers that break things.
const EXTREMES: [&str; 12] = ["0", "-1", "1e308", "-1e308", "nan", "inf", "1e-300", "99999", "-99999", "", "x", "0.5"];

/// The next number of a xorshift generator.
fn next(state: &mut u64) -> usize {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    (*state >> 16) as usize
}

/// The text with a few faults.
fn broken(text: &str, state: &mut u64) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..1 + next(state) % 4 {
        let at = next(state) % bytes.len();
        match next(state) % 5 {
            0 => bytes[at] = b' ' + (next(state) % 95) as u8,
            1 => drop(bytes.drain(at..(at + 1 + next(state) % 40).min(bytes.len()))),
            2 => {
                let copy = bytes[at..(at + 1 + next(state) % 400).min(bytes.len())].to_vec();
                bytes.splice(at..at, copy);
            }
            _ => {
                // The value of the attribute that follows.
                let quote = |from: usize| bytes[from..].iter().position(|&byte| byte == b'"').map(|i| from + i);
                let Some((begin, end)) = quote(at).and_then(|begin| Some((begin + 1, quote(begin + 1)?))) else { continue };
                bytes.splice(begin..end, EXTREMES[next(state) % EXTREMES.len()].bytes());
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, count, rest @ ..] = arguments.as_slice() else { return Err("MAP.xodr COUNT [SEED]".into()) };
    let text = std::fs::read_to_string(file)?;
    let mut state = rest.first().map_or(Ok(1), |seed| seed.parse::<u64>())?.max(1);
    let (mut refused, mut ringless, mut undrivable, mut imported, mut longest) = (0, 0, 0, 0, 0.0f64);
    for _ in 0..count.parse::<usize>()? {
        let text = broken(&text, &mut state);
        let begun = Instant::now();
        match Map::parse(Path::new(file), &text, Hand::Map) {
            Err(_) => refused += 1,
            Ok(map) => match map.rings().first() {
                None => ringless += 1,
                Some(ring) if map.ground(ring, &Options::default()).is_err() => undrivable += 1,
                Some(_) => imported += 1,
            },
        }
        longest = longest.max(begun.elapsed().as_secs_f64());
    }
    println!("{refused} refused, {ringless} without a ring, {undrivable} not drivable, {imported} imported; longest {longest:.2} s");
    Ok(())
}
