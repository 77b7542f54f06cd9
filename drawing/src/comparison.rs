//! Episodes on one route beside each other: their swept paths, and below them speed and load transfer along the route.
//!
//! For one bend taken with several loads: the charts show where each truck slows down and how near it comes to a
//! rollover.

use std::fmt::Write;

use glam::DVec2;
use svg::Document;
use svg::node::element::{ClipPath, Definitions, Group, Path, Rectangle, Title};

use crate::Error;
use crate::chart::{Axis, Kind, LINES, Line, axes};
use crate::episode::Scene;
use crate::figure::scale_bar;
use crate::legend::{self, Entry, Swatch};
use crate::lettering::{Align, Lettering};
use crate::stations::stations;
use crate::view::{Layout, View, WIDTH, colour, number};
use offtrack_evaluation::recording::{Frame, Recording};

/// Margins of the page (px).
const LEFT: f64 = 64.0;
const RIGHT: f64 = 16.0;
/// Distance from the page's upper edge to the first map (px).
const TOP: f64 = 106.0;
/// Maps side by side at most, and the gap between two (px).
const COLUMNS: usize = 2;
const GAP: f64 = 16.0;
/// From a map's lower edge to the upper edge of the one below it: that one's caption (px).
const CAPTION: f64 = 40.0;
/// Margin around the paths on a map (m).
const MARGIN: f64 = 5.0;
/// Height of a chart's plot, and of its numbers and its caption (px).
const PLOT: f64 = 150.0;
const NUMBERS: f64 = 64.0;

/// Episodes on one route.
pub struct Comparison<'a> {
    /// One for each load, at least one; all on the same route.
    pub scenes: Vec<Scene<'a>>,
    /// Distances along the route at which its ring begins and ends (m).
    pub ring: [f64; 2],
}

/// A quantity over the distance along the route.
struct Quantity {
    title: &'static str,
    value: fn(&Frame) -> f64,
    /// Values that the axis shows at least.
    least: Option<[f64; 2]>,
}

const QUANTITIES: [Quantity; 2] = [
    Quantity { title: "Speed [km/h]", value: |frame| 3.6 * f64::from(frame.speed), least: None },
    Quantity {
        title: "Load transfer ratio: a wheel lifts at 1",
        value: |frame| frame.load_transfer_ratio().into(),
        least: Some([0.0, 1.0]),
    },
];

impl Comparison<'_> {
    /// The picture as SVG text.
    ///
    /// # Errors
    ///
    /// [`Error::Typeface`].
    pub fn drawn(&self) -> Result<String, Error> {
        let lettering = Lettering::new()?;
        let mut definitions = Definitions::new();
        let mut contents = Group::new();
        let mut bottom = TOP;
        for index in 0..self.scenes.len() {
            let view = self.view(index);
            let clip = format!("map-{index}");
            definitions =
                definitions.add(ClipPath::new().set("id", clip.as_str()).add(Path::new().set("d", view.frame())));
            contents = contents.add(self.panel(&lettering, index, &view).set("clip-path", format!("url(#{clip})")));
            let edge = Path::new()
                .set("d", view.frame())
                .set("fill", "none")
                .set("stroke", colour::INK)
                .set("stroke-width", 1.2);
            contents = contents.add(edge).add(self.caption(&lettering, index, &view));
            bottom = view.point(view.low).y;
        }
        let width = WIDTH - LEFT - RIGHT;
        let entries = self.scenes.first().map(|scene| scene.legend(&self.view(0))).unwrap_or_default();
        let (map_legend, height) = legend::drawn(&lettering, &entries, DVec2::new(LEFT, bottom + 8.0), width);
        bottom += 8.0 + height;
        let stations = self.stations();
        // The start has no load transfer ratio: that is a step's.
        let across = spread(stations.iter().flat_map(|stations| stations.iter().skip(1).copied()));
        let x = Axis::linear(across[0], across[1], LEFT, WIDTH - RIGHT);
        for quantity in &QUANTITIES {
            contents = contents.add(self.chart(&lettering, quantity, &stations, &x, bottom + CAPTION));
            bottom += PLOT + NUMBERS;
        }
        let loads = self.scenes.iter().zip(LINES.iter().cycle());
        let loads: Vec<Entry> =
            loads.map(|(scene, line)| Entry::new(Swatch::Line(line, 2.4, ""), load(scene))).collect();
        let (load_legend, height) = legend::drawn(&lettering, &loads, DVec2::new(LEFT, bottom + 4.0), width);
        let size = DVec2::new(WIDTH, (bottom + 4.0 + height + 12.0).ceil());
        let title = self.title();
        let letters = lettering.fitting(&title, 25.0, width);
        let document = Document::new()
            .set("viewBox", (0.0, 0.0, size.x, size.y))
            .set("width", size.x)
            .set("height", size.y)
            .add(Title::new(title.as_str()))
            .add(definitions)
            .add(Rectangle::new().set("width", size.x).set("height", size.y).set("fill", "white"))
            .add(lettering.text(&title, DVec2::new(LEFT, 34.0), letters, Align::Left, colour::INK))
            .add(lettering.text(&self.subtitle(), DVec2::new(LEFT, 60.0), 16.0, Align::Left, colour::FAINT))
            .add(contents)
            .add(map_legend)
            .add(load_legend);
        Ok(format!("{document}\n"))
    }

    /// Where scene `index` is drawn. All maps show the same part of the road.
    fn view(&self, index: usize) -> View {
        let columns = self.scenes.len().clamp(1, COLUMNS);
        let width = (WIDTH - LEFT - RIGHT - (columns - 1) as f64 * GAP) / columns as f64;
        let at = |corner: DVec2| {
            let points = self.scenes.iter().flat_map(Scene::shown);
            View::laid_out(points, &Layout { corner, width, margin: MARGIN, ratio: 0.85 })
        };
        let first = DVec2::new(LEFT, TOP);
        let view = at(first);
        let height = view.point(view.low).y - TOP;
        at(first + DVec2::new((index % columns) as f64 * (width + GAP), (index / columns) as f64 * (height + CAPTION)))
    }

    fn panel(&self, lettering: &Lettering, index: usize, view: &View) -> Group {
        let map = Group::new().add(self.scenes[index].map(view));
        // A bar on one of the maps: they have the same scale.
        if index == 0 { map.add(scale_bar(view, lettering)) } else { map }
    }

    /// Load, end and time above a map.
    fn caption(&self, lettering: &Lettering, index: usize, view: &View) -> Group {
        let scene = &self.scenes[index];
        let time = (scene.recording.frames.len() - 1) as f64 * scene.recording.step;
        let most = scene.recording.frames.iter().map(Frame::load_transfer_ratio).fold(0.0, f32::max);
        let words = format!("{}: {} after {time:.1} s, load transfer ratio up to {most:.2}", load(scene), scene.end());
        let corner = view.point(DVec2::new(view.low.x, view.high.y));
        let (from, to) = (corner + DVec2::new(0.0, -16.0), corner + DVec2::new(22.0, -16.0));
        let sample = Path::new().set("d", format!("M{} {}H{}", number(from.x), number(from.y + 2.0), number(to.x)));
        let sample = sample.set("stroke", LINES[index % LINES.len()]).set("stroke-width", 2.4);
        let width = view.scale * (view.high.x - view.low.x) - 30.0;
        let letters = lettering.fitting(&words, 16.0, width);
        Group::new().add(sample).add(lettering.text(
            &words,
            to + DVec2::new(8.0, 6.0),
            letters,
            Align::Left,
            colour::INK,
        ))
    }

    /// Distance along the route at each frame of each scene (m).
    fn stations(&self) -> Vec<Vec<f64>> {
        let of = |scene: &Scene| {
            let Recording { frames, centre_line, .. } = scene.recording;
            stations(centre_line, &frames.iter().map(|frame| frame.position).collect::<Vec<_>>())
        };
        self.scenes.iter().map(of).collect()
    }

    /// Points of a quantity over the distance along the route, of each scene, from the first step on.
    fn lines(&self, quantity: &Quantity, stations: &[Vec<f64>]) -> Vec<Vec<DVec2>> {
        let line = |(scene, stations): (&Scene, &Vec<f64>)| {
            let points = stations.iter().zip(&scene.recording.frames).skip(1);
            points.map(|(&station, frame)| DVec2::new(station, (quantity.value)(frame))).collect()
        };
        self.scenes.iter().zip(stations).map(line).collect()
    }

    /// A quantity of every scene, the plot's upper edge at `top`.
    fn chart(&self, lettering: &Lettering, quantity: &Quantity, stations: &[Vec<f64>], x: &Axis, top: f64) -> Group {
        let lines = self.lines(quantity, stations);
        let least = quantity.least.into_iter().flatten();
        let [low, high] = spread(lines.iter().flatten().map(|p| p.y).chain(least));
        let y = Axis::linear_to_ticks(low, high, top + PLOT, top);
        let mut group = Group::new();
        let [from, to] = self.ring.map(|station| x.at(station));
        let band =
            Rectangle::new().set("x", number(from)).set("width", number(to - from)).set("y", top).set("height", PLOT);
        group = group.add(band.set("fill", "#eeeeee"));
        let between = self.scenes.first().map_or("", |scene| scene.roundabout.between_arms());
        group =
            group.add(lettering.text(between, DVec2::new(from + 6.0, top + 17.0), 14.0, Align::Left, colour::FAINT));
        group = group.add(axes(lettering, x, &y));
        for (points, &colour) in lines.into_iter().zip(LINES.iter().cycle()) {
            group = group.add(Line { name: None, colour, kind: Kind::Curve, points }.drawn(x, &y));
        }
        let words = DVec2::new(WIDTH - RIGHT, top - 8.0);
        group = group.add(lettering.text(quantity.title, DVec2::new(LEFT, top - 8.0), 16.0, Align::Left, colour::INK));
        group.add(lettering.text("distance along the route [m]", words, 14.0, Align::Right, colour::FAINT))
    }

    fn title(&self) -> String {
        let mut words = String::new();
        for (index, scene) in self.scenes.iter().enumerate() {
            let before = match index {
                0 => format!("{}, {}: ", scene.recording.route, scene.policy()),
                _ if index + 1 == self.scenes.len() => " and ".to_owned(),
                _ => ", ".to_owned(),
            };
            // Writing to a string cannot fail.
            let _ = write!(words, "{before}{}", load(scene));
        }
        words
    }

    /// Vehicle and start, which are the same of every scene.
    fn subtitle(&self) -> String {
        let Some(scene) = self.scenes.first() else { return String::new() };
        let Recording { class, episode, seed, .. } = scene.recording;
        let vehicle = class.as_ref().map(|class| format!("{}. ", class.vehicle)).unwrap_or_default();
        format!("{vehicle}Start {episode} of seed {seed}.")
    }
}

/// The load's name.
fn load(scene: &Scene) -> String {
    scene.recording.class.as_ref().map(|class| class.load.clone()).unwrap_or_default()
}

/// The least and the greatest of some values.
fn spread(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low <= high { [low, high] } else { [0.0, 1.0] }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use offtrack::scenario::Scenario;
    use offtrack::simulator::{RouteChoice, Simulator};
    use offtrack::world::World;

    use super::*;
    use offtrack_evaluation::recording::{Of, Recorder};

    /// The first truck of `laden2026` with this load, which steers straight on at its highest speed until it ends.
    fn recording(load: &str) -> (Recording, Scenario) {
        let scenario = Scenario::named("laden2026").unwrap().with_classes(|class| class.load == load).unwrap();
        let world = Arc::new(World::bake(&scenario).unwrap());
        let mut simulator = Simulator::new(world.clone(), 1, 3, RouteChoice::Fixed(vec![0])).unwrap();
        let mut recorder = Recorder::new(&world, simulator.batch(), [0]);
        let fastest = world.actions.iter().map(|action| action.speed).fold(0.0, f32::max);
        let straight_on =
            world.actions.iter().position(|action| action.steering == 0.0 && action.speed == fastest).unwrap() as u32;
        while recorder.is_running() {
            simulator.step(&[straight_on]).unwrap();
            recorder.follow(&world, simulator.batch());
        }
        let track = recorder.finish().remove(0);
        let (place, route) = scenario.routes().next().unwrap();
        let roundabout = &scenario.places[place].roundabout;
        let of = Of { scenario: &scenario, world: &world, roundabout, route, policy: "pursuit", seed: 3 };
        let recording = of.recording(0, 1, track);
        (recording, scenario)
    }

    #[test]
    fn the_same_truck_with_two_loads_has_a_map_each_and_a_line_each_over_the_distance_along_the_route() {
        let recorded = ["empty", "laden_high"].map(recording);
        assert_eq!(recorded[0].0.vehicle, recorded[1].0.vehicle, "a load does not change the truck that is drawn");
        let (place, route) = recorded[0].1.routes().next().unwrap();
        let roundabout = &recorded[0].1.places[place].roundabout;
        let scenes = recorded
            .iter()
            .map(|(recording, scenario)| Scene::new(recording, roundabout, scenario.gutter, route).unwrap());
        let comparison = Comparison { scenes: scenes.collect(), ring: [40.0, 60.0] };
        let svg = comparison.drawn().unwrap();
        for words in ["pure pursuit: empty and laden_high", "\"ring\"", "Speed [km/h]", "distance along the route [m]"]
        {
            assert!(svg.contains(words), "{words}");
        }
        assert_eq!(svg.matches("<clipPath").count(), 2);
        for (quantity, unit) in QUANTITIES.iter().zip([30.0, 0.0]) {
            let lines = comparison.lines(quantity, &comparison.stations());
            for (line, (recording, _)) in lines.iter().zip(&recorded) {
                assert_eq!(line.len(), recording.frames.len() - 1);
                // Straight on at 30 km/h on a straight arm: 0.83 m a step, and nearly no load transfer at first.
                assert!((line[0].y - unit).abs() < 0.1 + 0.02 * unit, "{:?}", line[0]);
                assert!(line.windows(2).all(|pair| pair[0].x <= pair[1].x));
                assert!((line[9].x - line[0].x - 7.5).abs() < 0.3, "{line:?}");
            }
        }
    }
}
