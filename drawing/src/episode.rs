//! One recorded episode on the map: a still with what both units swept, and the pages of a film of it.
//!
//! A film's page is drawn over its ground, which is the same for all of them.

use glam::DVec2;
use offtrack::layout::Ended;
use offtrack::roundabout::{Gutter, Roundabout};
use offtrack::route::Route;
use offtrack::scenario::{APPROACH, DEPARTURE, WAYPOINT_SPACING};
use offtrack::swept::corners;
use svg::Document;
use svg::node::element::{Circle, ClipPath, Definitions, Group, Path, Rectangle};

use crate::Failure;
use crate::legend::{self, Entry, Swatch};
use crate::lettering::{Align, Lettering};
use crate::recording::{Frame, Recording};
use crate::road::Ground;
use crate::sheet::{Layout, Straights, View, WIDTH, colour, number};
use crate::sweep::{nearest, swept_area};

/// How much is shown of the way before and after the ring: all of it at a benchmark's usual lengths [m].
const SHOWN: f64 = 45.0;
/// Distance between the trucks of a still, about [m].
const BETWEEN_TRUCKS: f64 = 20.0;
/// Length and gauge of the drawn front wheels [m].
const WHEEL: f64 = 1.0;
const GAUGE: f64 = 2.04;
/// The map of a film's page.
const FILMED: Layout = Layout { corner: DVec2::new(16.0, 96.0), width: WIDTH - 32.0, margin: 5.0, ratio: 1.0 };
/// Letters of a film's legend, in those of a still's: a film is looked at in a smaller size.
const LEGEND_SCALE: f64 = 1.3;
const DASHES: &str = "7 4";

/// An episode with the place that it happened at.
pub struct Scene<'a> {
    recording: &'a Recording,
    roundabout: &'a Roundabout,
    gutter: Gutter,
    route: &'a Route,
    /// All of the roundabout's routes: arms are named by them.
    routes: Vec<Route>,
    lettering: Lettering,
    tractor: Vec<[DVec2; 4]>,
    trailer: Vec<[DVec2; 4]>,
}

impl<'a> Scene<'a> {
    pub fn new(recording: &'a Recording, roundabout: &'a Roundabout, gutter: Gutter, route: &'a Route) -> Result<Scene<'a>, Failure> {
        let vehicle = &recording.vehicle;
        let tractor = |frame: &Frame| corners(&vehicle.tractor_body.into(), point(frame.position), frame.heading.into());
        let trailer = |frame: &Frame| corners(&vehicle.trailer_body.into(), point(frame.trailer_position), frame.trailer_heading.into());
        Ok(Scene {
            recording,
            roundabout,
            gutter,
            route,
            // A roundabout too small for the usual lengths goes without its arms' names.
            routes: roundabout.routes(APPROACH, DEPARTURE, WAYPOINT_SPACING).unwrap_or_default(),
            lettering: Lettering::new()?,
            tractor: recording.frames.iter().map(tractor).collect(),
            trailer: recording.frames.iter().map(trailer).collect(),
        })
    }

    /// The whole episode in one picture, as SVG text.
    pub fn still(&self) -> String {
        let view = View::around(self.shown());
        let ground = self.ground(&view);
        let area = |corners: &[[DVec2; 4]], colour: &str| Path::new().set("d", swept_area(&view, corners)).set("fill", colour);
        let map = Group::new()
            .add(ground.surface())
            .add(area(&self.trailer, colour::SWEPT_BY_TRAILER))
            .add(area(&self.tractor, colour::SWEPT_BY_TRACTOR))
            .add(ground.lanes())
            .add(ground.kerbs())
            .add(self.route_line(&view))
            .add(self.trucks_at_intervals(&view))
            .add(self.axle_paths(&view, self.recording.frames.len() - 1))
            .add(self.ends(&view))
            .add(ground.arm_names());
        let mut entries = vec![
            Entry::new(Swatch::Area(colour::SWEPT_BY_TRACTOR), "swept by the tractor"),
            Entry::new(Swatch::Area(colour::SWEPT_BY_TRAILER), "swept by the trailer alone"),
            Entry::new(Swatch::Line(colour::ROUTE, 2.4, ""), "route"),
        ];
        entries.extend(path_legend());
        entries.extend(ground.surface_legend());
        if self.touched().is_some() {
            entries.push(Entry::new(Swatch::Ring(colour::OVERLAP), "a kerb was touched here"));
        }
        crate::sheet::composed(&view, &self.lettering, &self.title(), &self.summary(), Definitions::new(), map, &entries)
    }

    /// What all pages of the film show, as SVG text.
    pub fn film_ground(&self) -> String {
        let view = self.film_view();
        let ground = self.ground(&view);
        let map =
            Group::new().add(ground.surface()).add(ground.lanes()).add(ground.kerbs()).add(self.route_line(&view)).add(ground.arm_names());
        let mut entries = vec![Entry::new(Swatch::Line(colour::ROUTE, 2.4, ""), "route")];
        entries.extend(path_legend());
        entries.push(Entry::new(Swatch::Line(colour::RAY, 1.2, ""), "distance sensors"));
        let below = view.point(view.low).y + 10.0;
        let width = FILMED.width / LEGEND_SCALE;
        let (legend, height) = legend::drawn(&self.lettering, &entries, DVec2::ZERO, width);
        let legend = legend.set("transform", format!("translate({} {}) scale({LEGEND_SCALE})", FILMED.corner.x, number(below)));
        let edge = Path::new().set("d", view.frame()).set("fill", "none").set("stroke", colour::INK).set("stroke-width", 1.2);
        let size = DVec2::new(WIDTH, (below + height * LEGEND_SCALE + 8.0).ceil());
        let paper = Rectangle::new().set("width", size.x).set("height", size.y).set("fill", "white");
        let Recording { route, episode, seed, .. } = self.recording;
        let title = format!("{route}, {}, start {episode} of seed {seed}", self.driver());
        let title = self.lettering.text(&title, DVec2::new(FILMED.corner.x, 38.0), 30.0, Align::Left, colour::INK);
        let map = map.set("clip-path", "url(#map)");
        document(
            size,
            clip(&view),
            Group::new().add(paper).add(map).add(edge).add(crate::sheet::scale_bar(&view, &self.lettering)).add(legend).add(title),
        )
    }

    /// What frame `index` adds to the film's ground, as SVG text.
    pub fn film_page(&self, index: usize) -> String {
        let view = self.film_view();
        let map = Group::new().add(self.axle_paths(&view, index)).add(self.rays(&view, index)).add(self.truck(&view, index, 0.8));
        let size = DVec2::new(WIDTH, view.point(view.low).y);
        document(size, clip(&view), Group::new().add(map.set("clip-path", "url(#map)")).add(self.caption(index)))
    }

    fn ground<'b>(&'b self, view: &'b View) -> Ground<'b> {
        let straights = Straights { approach: APPROACH, departure: DEPARTURE };
        Ground::new(view, &self.lettering, self.roundabout, &self.routes, straights, self.gutter)
    }

    fn film_view(&self) -> View {
        View::laid_out(self.shown(), &FILMED)
    }

    /// The ring, and what was driven and was to be driven not too far from it.
    fn shown(&self) -> impl Iterator<Item = DVec2> {
        let radius = self.roundabout.outer_radius();
        let driven = self.recording.frames.iter().flat_map(|frame| [point(frame.position), point(frame.trailer_position)]);
        let planned = self.route.waypoints.iter().map(|waypoint| waypoint.position);
        let near = driven.chain(planned).filter(move |p| p.length() < radius + SHOWN);
        near.chain([DVec2::splat(-radius), DVec2::splat(radius)])
    }

    fn route_line(&self, view: &View) -> Path {
        let line = Path::new().set("d", view.curve(&self.route.centre_line)).set("fill", "none");
        line.set("stroke", colour::ROUTE).set("stroke-width", 2.4)
    }

    /// Paths of the drive axle and of the trailer's axles up to frame `last`.
    fn axle_paths(&self, view: &View, last: usize) -> Group {
        let line = |place: fn(&Frame) -> [f32; 2], colour: &str| {
            let points: Vec<DVec2> = self.recording.frames[..=last].iter().map(|frame| point(place(frame))).collect();
            Path::new().set("d", view.line(&points)).set("fill", "none").set("stroke", colour).set("stroke-width", 2.0)
        };
        let drive = line(|frame| frame.position, colour::DRIVE_AXLE).set("stroke-dasharray", DASHES);
        Group::new().add(line(|frame| frame.trailer_position, colour::TRAILER_AXLES)).add(drive)
    }

    /// Both units at frame `index`, the trailer over the tractor's rear, with the front wheels as they are steered.
    fn truck(&self, view: &View, index: usize, opacity: f64) -> Group {
        let frame = &self.recording.frames[index];
        let body = |corners: &[DVec2; 4], colour: &str| {
            let path = Path::new().set("d", view.polygon(corners)).set("fill", colour).set("fill-opacity", opacity);
            path.set("stroke", colour).set("stroke-width", 1.5)
        };
        let ahead = DVec2::from_angle(frame.heading.into());
        let front = point(frame.position) + f64::from(self.recording.vehicle.wheelbase) * ahead;
        let half = 0.5 * WHEEL * DVec2::from_angle(f64::from(frame.heading) + f64::from(frame.steering));
        let wheel = |side: f64| front + 0.5 * side * GAUGE * ahead.perp();
        let wheels: String = [1.0, -1.0].map(|side| view.line(&[wheel(side) - half, wheel(side) + half])).concat();
        let wheels = Path::new().set("d", wheels).set("stroke", colour::INK).set("stroke-width", number(0.3 * view.scale));
        Group::new().add(body(&self.tractor[index], colour::TRACTOR)).add(wheels).add(body(&self.trailer[index], colour::TRAILER))
    }

    /// Trucks about equally far apart, the first and the last frame's among them.
    fn trucks_at_intervals(&self, view: &View) -> Group {
        let places: Vec<DVec2> = self.recording.frames.iter().map(|frame| point(frame.position)).collect();
        let mut driven = vec![0.0];
        driven.extend(places.windows(2).scan(0.0, |sum, pair| {
            *sum += pair[0].distance(pair[1]);
            Some(*sum)
        }));
        let length = driven[driven.len() - 1];
        let n = (length / BETWEEN_TRUCKS).round().max(1.0);
        let stations = (0..=n as usize).map(|part| driven.partition_point(|&s| s < length * part as f64 / n).min(places.len() - 1));
        stations.fold(Group::new(), |group, index| group.add(self.truck(view, index, 0.3)))
    }

    /// The drive axle's first and last place, and a ring where a unit touched a kerb.
    fn ends(&self, view: &View) -> Group {
        let last = self.recording.frames.len() - 1;
        let mut group = Group::new();
        for (words, index) in [("start", 0), ("end", last)] {
            let place = point(self.recording.frames[index].position);
            // Beyond the map's edge the mark stands where the truck comes in or leaves.
            let within = place.clamp(view.low + 2.5, view.high - 2.5);
            let at = view.point(within);
            let dot = Circle::new().set("cx", number(at.x)).set("cy", number(at.y)).set("r", 6).set("fill", colour::INK);
            let dot = dot.set("stroke", "white").set("stroke-width", 1.5);
            group = group.add(dot).add(self.lettering.text_on_map(words, at + DVec2::new(12.0, 6.0), 18.0, Align::Left, colour::INK));
        }
        if let Some(touched) = self.touched() {
            let at = view.point(touched);
            let ring = Circle::new().set("cx", number(at.x)).set("cy", number(at.y)).set("r", 13).set("fill", "none");
            group = group.add(ring.set("stroke", colour::OVERLAP).set("stroke-width", 2.6));
        }
        group
    }

    /// Where a unit touched a kerb, when that ended the episode.
    fn touched(&self) -> Option<DVec2> {
        let units = [(Ended::TractorCollided, &self.tractor), (Ended::TrailerCollided, &self.trailer)];
        let (_, corners) = units.into_iter().find(|(ended, _)| ended.name() == self.recording.ended)?;
        Some(nearest(corners.last()?, &self.roundabout.kerbs(self.gutter)).0)
    }

    /// The distance sensors at frame `index`, with a dot where one meets a kerb.
    fn rays(&self, view: &View, index: usize) -> Group {
        let (frame, vehicle) = (&self.recording.frames[index], &self.recording.vehicle);
        let on = |place: [f32; 2], heading: f32| move |ray: &[f32; 4]| (point(place), DVec2::from_angle(heading.into()), *ray);
        let trailer = vehicle.trailer_rays.iter().map(on(frame.trailer_position, frame.trailer_heading));
        let tractor = vehicle.tractor_rays.iter().map(on(frame.position, frame.heading));
        let mut lines = String::new();
        let mut dots = Group::new();
        for ((place, ahead, [x, y, dx, dy]), &range) in trailer.chain(tractor).zip(&frame.ranges) {
            let from = place + ahead.rotate(point([x, y]));
            let to = from + f64::from(range) * ahead.rotate(point([dx, dy]));
            lines += &view.line(&[from, to]);
            if range < vehicle.sensor_range {
                let at = view.point(to);
                dots = dots.add(Circle::new().set("cx", number(at.x)).set("cy", number(at.y)).set("r", 2.8).set("fill", colour::RAY));
            }
        }
        let lines = Path::new().set("d", lines).set("stroke", colour::RAY).set("stroke-width", 1.0).set("stroke-opacity", 0.6);
        Group::new().add(lines).add(dots)
    }

    /// A line of figures in columns that stand still while their numbers change.
    fn caption(&self, index: usize) -> Group {
        let frame = &self.recording.frames[index];
        let ratio = frame.tractor_load_transfer_ratio.abs().max(frame.trailer_load_transfer_ratio.abs());
        let [tractor, trailer] = [frame.tractor_clearance, frame.trailer_clearance].map(|clearance| signed(clearance, 2));
        let figures = [
            (0.0, format!("{:.1} s", index as f64 * self.recording.step)),
            (84.0, format!("{:.1} km/h", 3.6 * frame.speed)),
            (206.0, format!("articulation {}\u{b0}", signed(frame.articulation.to_degrees(), 0))),
            (398.0, format!("LTR {ratio:.2}")),
            (508.0, format!("clearance: tractor {tractor} m, trailer {trailer} m")),
        ];
        let place = |x: f64| FILMED.corner + DVec2::new(x, -18.0);
        let text =
            |group: Group, (x, words): (f64, String)| group.add(self.lettering.text(&words, place(x), 22.0, Align::Left, colour::INK));
        let group = figures.into_iter().fold(Group::new(), text);
        if index + 1 < self.recording.frames.len() {
            return group;
        }
        let right = DVec2::new(WIDTH - FILMED.corner.x, 38.0);
        group.add(self.lettering.text(&self.end(), right, 30.0, Align::Right, self.end_colour()))
    }

    fn title(&self) -> String {
        let time = (self.recording.frames.len() - 1) as f64 * self.recording.step;
        format!("{}, {}: {} after {time:.1} s", self.recording.route, self.driver(), self.end())
    }

    /// Where the episode began and what it came to.
    fn summary(&self) -> String {
        let frames = &self.recording.frames;
        let most = |value: fn(&Frame) -> f32| frames.iter().map(value).fold(f32::NEG_INFINITY, f32::max);
        let least = |value: fn(&Frame) -> f32| signed(frames.iter().map(value).fold(f32::INFINITY, f32::min), 2);
        let ratio = most(|frame| frame.tractor_load_transfer_ratio.abs().max(frame.trailer_load_transfer_ratio.abs()));
        format!(
            "Start {} of seed {}. Least clearance: tractor {} m, trailer {} m. Articulation up to {:.0}\u{b0}, load transfer ratio up to {ratio:.2}.",
            self.recording.episode,
            self.recording.seed,
            least(|frame| frame.tractor_clearance),
            least(|frame| frame.trailer_clearance),
            most(|frame| frame.articulation.abs()).to_degrees(),
        )
    }

    fn driver(&self) -> &'static str {
        match self.recording.policy.as_str() {
            "pursuit" => "pure pursuit",
            "random" => "random actions",
            _ => "learned policy",
        }
    }

    /// The end code in words.
    fn end(&self) -> String {
        self.recording.ended.replace('_', " ")
    }

    fn end_colour(&self) -> &'static str {
        if self.recording.ended == Ended::Arrived.name() { colour::ROUTE } else { colour::OVERLAP }
    }
}

/// The legend's lines for the paths of the axles.
fn path_legend() -> [Entry; 2] {
    [
        Entry::new(Swatch::Line(colour::DRIVE_AXLE, 2.0, DASHES), "drive axle"),
        Entry::new(Swatch::Line(colour::TRAILER_AXLES, 2.0, ""), "trailer axles"),
    ]
}

fn clip(view: &View) -> Definitions {
    Definitions::new().add(ClipPath::new().set("id", "map").add(Path::new().set("d", view.frame())))
}

fn document(size: DVec2, definitions: Definitions, contents: Group) -> String {
    let document = Document::new().set("viewBox", (0.0, 0.0, size.x, size.y)).set("width", size.x).set("height", size.y);
    format!("{}\n", document.add(definitions).add(contents))
}

/// With a minus sign where there is one.
fn signed(value: f32, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    // What is rounded to nothing has no sign.
    if value < 0.0 && text.contains(|digit| ('1'..='9').contains(&digit)) { format!("\u{2212}{text}") } else { text }
}

fn point([x, y]: [f32; 2]) -> DVec2 {
    DVec2::new(x.into(), y.into())
}
