//! The axes of a chart: from values to positions on the page, and their numbered ticks.

use std::fmt::Write;

use glam::DVec2;
use svg::node::element::{Group, Path};

use crate::lettering::{Align, Lettering};
use crate::view::{colour, number};

/// Margin beside the outermost points of a logarithmic axis, as a factor.
const ROOM: f64 = 1.35;
/// Least ratio of the ends of a logarithmic axis.
const REACH: f64 = 12.0;
/// Steps of a linear axis, about.
const STEPS: f64 = 5.0;

/// How values lie along an axis.
#[derive(Debug, Clone, Copy)]
enum Scale {
    Logarithmic,
    /// A linear scale with this step from tick to tick.
    Linear(f64),
}

/// An axis on the page.
pub(crate) struct Axis {
    scale: Scale,
    low: f64,
    high: f64,
    /// Positions of the ends (px).
    pub(crate) from: f64,
    pub(crate) to: f64,
}

impl Axis {
    /// A logarithmic axis that shows all of the given values.
    pub(crate) fn logarithmic(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Axis {
        let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = if low <= high { (low / ROOM, high * ROOM) } else { (1.0, REACH) };
        let widen = (REACH * low / high).max(1.0).sqrt();
        Axis { scale: Scale::Logarithmic, low: low / widen, high: high * widen, from, to }
    }

    /// A linear axis from `low` to `high`; of length 1 around a single value.
    pub(crate) fn linear(low: f64, high: f64, from: f64, to: f64) -> Axis {
        let (low, high) = if low < high { (low, high) } else { (low - 0.5, low + 0.5) };
        Axis { scale: Scale::Linear(step(low, high)), low, high, from, to }
    }

    /// A linear axis from `low` to `high`, both moved outwards to the next ticks.
    pub(crate) fn linear_to_ticks(low: f64, high: f64, from: f64, to: f64) -> Axis {
        let axis = Axis::linear(low, high, from, to);
        let step = step(axis.low, axis.high);
        Axis { low: (axis.low / step).floor() * step, high: (axis.high / step).ceil() * step, ..axis }
    }

    pub(crate) fn at(&self, value: f64) -> f64 {
        let part = match self.scale {
            Scale::Logarithmic => (value / self.low).ln() / (self.high / self.low).ln(),
            Scale::Linear(_) => (value - self.low) / (self.high - self.low),
        };
        self.from + part * (self.to - self.from)
    }

    /// Ticks, and whether each has a number: at 1, 2, ... 9 times each power of ten, on a linear axis at equal steps.
    fn ticks(&self) -> Vec<(f64, bool)> {
        if let Scale::Linear(step) = self.scale {
            // Ends that are ticks are not exact multiples of the step.
            let ticks = (self.low / step - 1e-6).ceil() as i64..=(self.high / step + 1e-6).floor() as i64;
            return ticks.map(|tick| (step * tick as f64, true)).collect();
        }
        let decades = (self.high / self.low).log10();
        let first = self.low.log10().floor() as i32;
        let all = (first..first + 40)
            .flat_map(|power| (1..10).map(move |digit| (f64::from(digit) * 10f64.powi(power), digit)));
        let shown = all.filter(|(value, _)| self.low <= *value && *value <= self.high);
        shown.map(|(value, digit)| (value, digit == 1 || decades < 2.5 && (digit == 2 || digit == 5))).collect()
    }
}

/// The step of the ticks between two values: 1, 2 or 5 times a power of ten.
fn step(low: f64, high: f64) -> f64 {
    let rough = (high - low) / STEPS;
    let power = 10f64.powf(rough.log10().floor());
    [1.0, 2.0, 5.0]
        .map(|digit| digit * power)
        .into_iter()
        .find(|step| rough <= *step * (1.0 + 1e-9))
        .unwrap_or(10.0 * power)
}

/// The plot's frame, a faint line at each numbered tick, and the numbers.
pub(crate) fn axes(lettering: &Lettering, x: &Axis, y: &Axis) -> Group {
    let (mut grid, mut marks) = (String::new(), String::new());
    let mut group = Group::new();
    for (value, numbered) in x.ticks() {
        let at = number(x.at(value));
        let _ = write!(marks, "M{at} {}v{}", y.from, if numbered { -7 } else { -4 });
        if numbered {
            let _ = write!(grid, "M{at} {}V{}", y.from, y.to);
            group = group.add(lettering.text(
                &written(value),
                DVec2::new(at, y.from + 20.0),
                14.0,
                Align::Middle,
                colour::INK,
            ));
        }
    }
    for (value, numbered) in y.ticks() {
        let at = number(y.at(value));
        let _ = write!(marks, "M{} {at}h{}", x.from, if numbered { 7 } else { 4 });
        if numbered {
            let _ = write!(grid, "M{} {at}H{}", x.from, x.to);
            group = group.add(lettering.text(
                &written(value),
                DVec2::new(x.from - 8.0, at + 5.0),
                14.0,
                Align::Right,
                colour::INK,
            ));
        }
    }
    let line = |data: String, colour: &str, width: f64| {
        Path::new().set("d", data).set("fill", "none").set("stroke", colour).set("stroke-width", width)
    };
    let frame = format!("M{} {}H{}V{}H{}Z", x.from, y.to, x.to, y.from, x.from);
    Group::new()
        .add(line(grid, "#e1e1e1", 1.0))
        .add(line(marks, colour::INK, 1.0))
        .add(line(frame, colour::INK, 1.2))
        .add(group)
}

/// A tick's number with a prefix for thousands.
fn written(value: f64) -> String {
    let (unit, prefix) = match value {
        1e9.. => (1e9, " G"),
        1e6.. => (1e6, " M"),
        1e3.. => (1e3, " k"),
        _ => (1.0, ""),
    };
    // Powers of ten below one are not exact.
    let written = format!("{}{prefix}", (value / unit * 1e6).round() / 1e6);
    written.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_axis_shows_its_values_and_is_numbered() {
        for values in [vec![32.0], vec![900.0, 1_100.0], vec![256.0, 1_048_576.0], vec![0.03, 2e8], vec![]] {
            let axis = Axis::logarithmic(values.iter().copied(), 0.0, 100.0);
            assert!(values.iter().all(|&value| (0.0..=100.0).contains(&axis.at(value))), "{values:?}");
            let ticks = axis.ticks();
            assert!(2 <= ticks.iter().filter(|(_, numbered)| *numbered).count(), "{values:?}");
            assert!(ticks.iter().all(|&(value, _)| (0.0..=100.0).contains(&axis.at(value))), "{values:?}");
        }
    }

    #[test]
    fn a_factor_has_the_same_length_everywhere_and_numbers_have_prefixes() {
        let axis = Axis::logarithmic([1.0, 1e6].into_iter(), 500.0, 0.0);
        let length = |from: f64| axis.at(10.0 * from) - axis.at(from);
        assert!((length(1.0) - length(3e4)).abs() < 1e-9 && length(1.0) < 0.0);
        assert_eq!(
            [0.1, 5.0, 200.0, 1e3, 2e5, 1e6, 5e9].map(written),
            ["0.1", "5", "200", "1 k", "200 k", "1 M", "5 G"]
        );
    }

    #[test]
    fn a_linear_axis_is_numbered_within_its_ends_or_reaches_from_tick_to_tick() {
        for (low, high) in [(-40.0, 98.3), (0.0, 1.0), (19.2, 30.0), (7.0, 7.0), (0.0, 0.03), (19.0, 119.0)] {
            let axis = Axis::linear_to_ticks(low, high, 200.0, 20.0);
            let ticks = axis.ticks();
            assert!((3..=12).contains(&ticks.len()), "{low} {high}: {ticks:?}");
            let [first, last] = [ticks[0].0, ticks[ticks.len() - 1].0].map(|value| axis.at(value));
            assert!((first - 200.0).abs() < 1e-6 && (last - 20.0).abs() < 1e-6, "{low} {high}: {first} {last}");
            assert!((20.0..=200.0).contains(&axis.at(low)) && (20.0..=200.0).contains(&axis.at(high)));
        }
        let axis = Axis::linear(-60.0, 98.3, 0.0, 1.0);
        assert_eq!([axis.at(-60.0), axis.at(98.3)], [0.0, 1.0]);
        assert_eq!(
            axis.ticks().iter().map(|&(value, _)| written(value)).collect::<Vec<_>>(),
            ["\u{2212}50", "0", "50"]
        );
    }
}
