//! Small multiples of histograms, with single values marked in each: where known things lie in a distribution.

use std::fmt::Write;

use glam::DVec2;
use svg::Document;
use svg::node::element::{Group, Path, Rectangle, Title};

use crate::Error;
use crate::chart::LINES;
use crate::lettering::{Align, Lettering};
use crate::view::{colour, number};

/// Size of a plot (px).
const PLOT: DVec2 = DVec2::new(290.0, 130.0);
/// Between plots: room for marks, numbers and axis titles (px).
const GAP: DVec2 = DVec2::new(34.0, 96.0);
/// Upper left corner of the first plot (px).
const CORNER: DVec2 = DVec2::new(28.0, 136.0);
/// Plots in a row.
const COLUMNS: usize = 3;
/// Bins of a histogram.
const BINS: usize = 30;

/// A picture of histograms.
pub struct Histograms {
    /// The first line.
    pub title: String,
    /// The second.
    pub subtitle: String,
    /// Names of the marked things, in the order of each panel's marks.
    pub marked: Vec<String>,
    /// Row by row.
    pub panels: Vec<Panel>,
}

/// A histogram and the values marked in it.
pub struct Panel {
    /// Title of the axis, with its unit.
    pub x: &'static str,
    /// The values that are counted.
    pub values: Vec<f64>,
    /// One for each of [`Histograms::marked`].
    pub marks: Vec<f64>,
}

/// The horizontal axis of a panel.
struct Axis {
    low: f64,
    high: f64,
    /// The first tick, and from one to the next.
    first: f64,
    step: f64,
    n_bins: usize,
}

impl Histograms {
    /// The picture as SVG text.
    ///
    /// # Errors
    ///
    /// [`Error::Typeface`].
    pub fn drawn(&self) -> Result<String, Error> {
        let lettering = Lettering::new()?;
        let rows = self.panels.len().div_ceil(COLUMNS).max(1);
        let cells = DVec2::new(COLUMNS as f64, rows as f64);
        let size = CORNER + cells * (PLOT + GAP) - DVec2::new(0.0, GAP.y - 62.0);
        let mut document = Document::new()
            .set("viewBox", (0.0, 0.0, number(size.x), number(size.y)))
            .set("width", number(size.x))
            .set("height", number(size.y))
            .add(Title::new(self.title.as_str()))
            .add(Rectangle::new().set("width", size.x + 1.0).set("height", size.y + 1.0).set("fill", "white"))
            .add(lettering.text(&self.title, DVec2::new(CORNER.x, 34.0), 23.0, Align::Left, colour::INK))
            .add(lettering.text(&self.subtitle, DVec2::new(CORNER.x, 58.0), 15.0, Align::Left, colour::FAINT));
        let mut at = DVec2::new(CORNER.x, 84.0);
        for (index, name) in self.marked.iter().enumerate() {
            document = document.add(mark(at - DVec2::new(-7.0, 6.0), LINES[index % LINES.len()]));
            document = document.add(lettering.text(name, at + DVec2::new(18.0, 0.0), 15.0, Align::Left, colour::INK));
            at.x += 18.0 + lettering.width(name, 15.0) + 26.0;
        }
        for (index, panel) in self.panels.iter().enumerate() {
            let place = DVec2::new((index % COLUMNS) as f64, (index / COLUMNS) as f64);
            document = document.add(panel.drawn(&lettering, CORNER + place * (PLOT + GAP)));
        }
        Ok(format!("{document}\n"))
    }
}

impl Panel {
    /// The axis over all values: its ends are steps for measured values, halves beyond them for counts.
    fn axis(&self) -> Axis {
        let all = || self.values.iter().chain(&self.marks).copied().filter(|value| value.is_finite());
        let (low, high) =
            all().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = match (low.is_finite(), low < high) {
            (false, _) => (0.0, 1.0),
            (true, false) => (low.min(0.0), low.max(0.0) + 1.0),
            (true, true) => (low, high),
        };
        let rough = (high - low) / 6.0;
        let power = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0]
            .map(|digit| digit * power)
            .into_iter()
            .find(|step| rough <= *step)
            .unwrap_or(10.0 * power);
        if all().all(|value| value.fract() == 0.0) && high - low < BINS as f64 {
            let step = step.max(1.0);
            return Axis { low: low - 0.5, high: high + 0.5, first: low, step, n_bins: (high - low) as usize + 1 };
        }
        let (low, high) = ((low / step).floor() * step, (high / step).ceil() * step);
        Axis { low, high, first: low, step, n_bins: BINS }
    }

    /// Values in each bin of the axis.
    fn counts(&self, axis: &Axis) -> Vec<usize> {
        let mut counts = vec![0; axis.n_bins];
        for value in self.values.iter().filter(|value| value.is_finite()) {
            let bin = ((value - axis.low) / (axis.high - axis.low) * axis.n_bins as f64) as usize;
            counts[bin.min(axis.n_bins - 1)] += 1;
        }
        counts
    }

    fn drawn(&self, lettering: &Lettering, corner: DVec2) -> Group {
        let axis = self.axis();
        let Axis { low, high, first, step, n_bins } = axis;
        let counts = self.counts(&axis);
        let most = counts.iter().copied().max().unwrap_or(0).max(1) as f64;
        let base = corner.y + PLOT.y;
        let x = |value: f64| corner.x + (value - low) / (high - low) * PLOT.x;
        let mut bars = String::new();
        let width = PLOT.x / n_bins as f64;
        for (bin, &count) in counts.iter().enumerate().filter(|(_, count)| 0 < **count) {
            let height = count as f64 / most * (PLOT.y - 8.0);
            let left = corner.x + bin as f64 * width;
            // Writing to a string cannot fail.
            let _ = write!(
                bars,
                "M{} {base}h{}v-{}h-{}Z",
                number(left),
                number(width - 1.0),
                number(height),
                number(width - 1.0)
            );
        }
        let mut group = Group::new().add(Path::new().set("d", bars).set("fill", "#c3cdd7"));
        let mut ticks = format!("M{} {base}H{}", corner.x, corner.x + PLOT.x);
        for tick in 0..=((high - first) / step + 1e-6).floor() as usize {
            let value = first + tick as f64 * step;
            let _ = write!(ticks, "M{} {base}v5", number(x(value)));
            let words = format!("{}", (value * 1e6).round() / 1e6);
            group =
                group.add(lettering.text(&words, DVec2::new(x(value), base + 20.0), 13.0, Align::Middle, colour::INK));
        }
        group = group
            .add(Path::new().set("d", ticks).set("fill", "none").set("stroke", colour::INK).set("stroke-width", 1.1));
        let middle = DVec2::new(corner.x + PLOT.x / 2.0, base + 42.0);
        group = group.add(lettering.text(self.x, middle, 15.0, Align::Middle, colour::INK));
        // Marks that would cover each other stand above each other.
        let mut placed: Vec<DVec2> = Vec::new();
        for (index, value) in self.marks.iter().enumerate().filter(|(_, value)| value.is_finite()) {
            let mut at = DVec2::new(x(*value), base - 8.0);
            while placed.iter().any(|other| other.distance(at) < 11.0) {
                at.y -= 12.0;
            }
            placed.push(at);
            group = group.add(mark(at, LINES[index % LINES.len()]));
        }
        group
    }
}

/// A diamond (px).
fn mark(at: DVec2, colour: &str) -> Path {
    let data = format!("M{} {}l6.5 6.5l-6.5 6.5l-6.5 -6.5Z", number(at.x), number(at.y - 6.5));
    Path::new().set("d", data).set("fill", colour).set("stroke", "white").set("stroke-width", 1.2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(values: Vec<f64>, marks: Vec<f64>) -> Panel {
        Panel { x: "width [m]", values, marks }
    }

    #[test]
    fn every_value_is_counted_once_and_lies_on_the_axis() {
        for values in [
            vec![1.5],
            vec![],
            vec![0.3, 0.31, 0.9],
            (0..1000).map(f64::from).collect(),
            vec![f64::NAN, 2.5, 3.0],
            vec![3.0, 4.0],
        ] {
            let panel = panel(values.clone(), vec![]);
            let axis = panel.axis();
            assert!(0.0 < axis.step && axis.low < axis.high && (axis.high - axis.low) / axis.step < 12.0, "{values:?}");
            let finite = values.iter().filter(|value| value.is_finite());
            assert!(finite.clone().all(|value| (axis.low..=axis.high).contains(value)), "{values:?}");
            assert_eq!(panel.counts(&axis).iter().sum::<usize>(), finite.count(), "{values:?}");
        }
    }

    #[test]
    fn counts_have_a_bar_each_with_the_number_below_its_middle() {
        let panel = panel(vec![3.0, 3.0, 5.0], vec![4.0]);
        let axis = panel.axis();
        assert_eq!((axis.low, axis.high, axis.first, axis.step), (2.5, 5.5, 3.0, 1.0));
        assert_eq!(panel.counts(&axis), [2, 0, 1]);
    }

    #[test]
    fn each_marked_thing_is_named_and_marked_in_every_panel() {
        let panels = vec![panel(vec![1.0, 2.0], vec![1.5, 1.5]), panel(vec![5.0, 9.0], vec![6.0, f64::NAN])];
        let marked = vec!["a".to_owned(), "b".to_owned()];
        let picture = Histograms { title: "T".into(), subtitle: "S".into(), marked, panels }.drawn().unwrap();
        // Two in the list of names, two in the first panel and one in the second, where the other has no value.
        assert_eq!(picture.matches("l6.5 6.5").count(), 5);
        assert_eq!([LINES[0], LINES[1]].map(|colour| picture.matches(colour).count()), [3, 2]);
    }
}
