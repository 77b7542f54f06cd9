//! Lists the vehicles that come with the program: dimensions, turning circle, and where they are from.

use std::fmt::Write;

use offtrack::files::shipped::{Kind, Source};
use offtrack::vehicle::Vehicle;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;
use offtrack_evaluation::fits::table::Units;

use crate::terminal;

/// Radius of the outer circle whose inner one is listed, that of Directive 96/53/EC (m).
const OUTER: f64 = 12.5;

/// List the vehicles that come with the program, with their dimensions and sources, each drawn from the side: trailer,
/// tractor, axles.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Print feet in place of metres.
    #[arg(long)]
    feet: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    let units = if args.feet { Units::Feet } else { Units::Metric };
    let mut text = String::new();
    for name in Kind::Vehicle.names() {
        let source = Source::named(Kind::Vehicle, name)?.text()?;
        text += &described(name, &Vehicle::named(name)?, &source, units, terminal::width());
    }
    files::print(&text)
}

/// A vehicle's name, its dimensions, and the words that open its file, in lines of at most `width`.
fn described(name: &str, vehicle: &Vehicle, source: &str, units: Units, width: usize) -> String {
    let Vehicle { tractor, trailer, loads, .. } = vehicle;
    let length = |metres: f64| format!("{} {}", units.length(metres), units.of_length());
    let inner = vehicle.turning_circle_inner_radius(OUTER);
    let circle = inner.map_or("none".to_owned(), length);
    let opening: String = source.lines().map_while(|line| line.strip_prefix('#')).collect();
    let facts = [
        format!("{} long, {} wide", length(vehicle.length()), length(tractor.width.max(trailer.width))),
        format!("tractor: wheelbase {}, front overhang {}", length(tractor.wheelbase), length(tractor.front_overhang)),
        format!("fifth wheel {} ahead of the drive axle", length(tractor.fifth_wheel)),
        format!("trailer: kingpin to axles {}, to rear {}", length(trailer.wheelbase), length(trailer.kingpin_to_rear)),
        format!("lock {:.1} deg, {:.0} deg/s", tractor.steer_max.to_degrees(), tractor.steer_rate.to_degrees()),
        format!("inner circle, the outer one of {}: {circle}", length(OUTER)),
        format!("loads: {}", loads.keys().map(String::as_str).collect::<Vec<_>>().join(", ")),
    ];
    let opening = opening.split("Keys:").next().unwrap_or_default();
    let mut text = format!("{name}\n");
    for words in [facts.join("; ").as_str(), opening] {
        let mut line = String::new();
        for word in words.split_whitespace() {
            if !line.is_empty() && width < 3 + line.chars().count() + word.chars().count() {
                let _ = writeln!(text, "  {line}");
                line.clear();
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line += word;
        }
        let _ = writeln!(text, "  {line}");
    }
    text + &drawn(vehicle, width)
}

/// Columns of a metre, where there is room.
const METRE: f64 = 3.0;

/// The vehicle from the side, its front on the left: trailer, tractor, axles.
fn drawn(vehicle: &Vehicle, width: usize) -> String {
    let Vehicle { tractor, trailer, .. } = vehicle;
    let scale = METRE.min(width.saturating_sub(5) as f64 / vehicle.length());
    let column = |behind: f64| (scale * behind).round().max(0.0) as usize;
    let axles = [tractor.front_overhang, tractor.front_overhang + tractor.wheelbase];
    let kingpin = axles[1] - tractor.fifth_wheel;
    let body = |from: f64, to: f64, side: &str| {
        let (from, to) = (column(from), column(to));
        format!("  {}[{}]\n", " ".repeat(from), side.repeat(to.saturating_sub(from + 1)))
    };
    let mut below = String::new();
    for axle in [axles[0], axles[1], kingpin + trailer.wheelbase] {
        below += &" ".repeat(column(axle).saturating_sub(below.len()));
        below.push('O');
    }
    body(kingpin - trailer.kingpin_to_front, kingpin + trailer.kingpin_to_rear, "-")
        + &body(0.0, axles[1] + tractor.rear_overhang, "=")
        + &format!("  {below}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_vehicle_is_listed_with_length_circle_and_source_in_lines_that_fit() {
        for (name, said) in [
            ("eu_4x2_13m6", ["16.45 m long", "Directive 96/53/EC", "5.41 m"]),
            ("us_wb67", ["22.40 m long", "AASHTO's", "none"]),
        ] {
            let source = Source::named(Kind::Vehicle, name).unwrap().text().unwrap();
            for width in [40, 100] {
                let text = described(name, &Vehicle::named(name).unwrap(), &source, Units::Metric, width);
                assert!(text.lines().all(|line| line.chars().count() <= width), "{text}");
                let joined = text.split_whitespace().collect::<Vec<_>>().join(" ");
                assert!(said.iter().all(|words| joined.contains(words)) && !joined.contains("Keys"), "{joined}");
            }
        }
        let vehicle = Vehicle::named("us_wb67").unwrap();
        assert!(described("us_wb67", &vehicle, "", Units::Feet, 100).contains("73.5 ft long"));
    }

    #[test]
    fn a_vehicle_is_drawn_from_the_side_with_its_lengths_and_axles() {
        let vehicle = Vehicle::named("eu_4x2_13m6").unwrap();
        let text = drawn(&vehicle, 100);
        let lines: Vec<&str> = text.lines().map(|line| &line[2..]).collect();
        let place = |line: usize, of: char| lines[line].find(of).unwrap();
        // Three columns a metre: 16.45 m in all, the trailer of 13.6 m, the tractor of 5.9 m.
        assert_eq!((place(0, '['), place(0, ']'), place(1, '['), place(1, ']')), (9, 49, 0, 18));
        let axles: Vec<usize> = lines[2].match_indices('O').map(|(at, _)| at).collect();
        assert_eq!(axles, [4, 15, 36]);
        for width in [20, 40, 60] {
            assert!(drawn(&vehicle, width).lines().all(|line| line.len() <= width), "{width}");
        }
    }
}
