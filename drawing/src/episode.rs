//! A recorded episode on the map, as a still with the swept paths of both units. `episode/moving.rs` draws the pictures
//! of a film.

mod moving;
pub(crate) mod vehicles;

use glam::DVec2;
use offtrack::layout::Ended;
use offtrack::map::route::Route;
use offtrack::map::{Gutter, Road};
use offtrack::scenario::{APPROACH, DEPARTURE, WAYPOINT_SPACING};
use offtrack::vehicle::swept::{corners, nearest};
use svg::node::element::{Circle, Definitions, Group, Path};

use crate::Error;
use crate::legend::{Entry, Swatch};
use crate::lettering::{Align, Lettering};
use crate::road::RoadLayers;
use crate::sweep::swept_area;
use crate::view::{Straights, View, colour, number};
use offtrack_evaluation::policies::rule;
use offtrack_evaluation::recording::{Frame, Recording};

/// Length of the route shown before and after the ring: all of it at a benchmark's usual lengths (m).
const SHOWN: f64 = 45.0;
/// Approximate distance between the trucks of a still (m).
const BETWEEN_TRUCKS: f64 = 20.0;
/// Length and gauge of the drawn front wheels (m).
pub(crate) const WHEEL: f64 = 1.0;
pub(crate) const GAUGE: f64 = 2.04;
const DASHES: &str = "7 4";

/// An episode with its roundabout and route.
pub struct Scene<'a> {
    pub(crate) recording: &'a Recording,
    pub(crate) roundabout: &'a Road,
    gutter: Gutter,
    route: &'a Route,
    /// All routes of the roundabout: they say where the names of the arms stand.
    routes: Vec<Route>,
    lettering: Lettering,
    tractor: Vec<[DVec2; 4]>,
    trailer: Vec<[DVec2; 4]>,
}

impl<'a> Scene<'a> {
    /// The scene of a recording that was made on this route of the roundabout; `gutter` says whether gutters are
    /// drivable.
    ///
    /// # Errors
    ///
    /// [`Error::Typeface`].
    pub fn new(
        recording: &'a Recording,
        roundabout: &'a Road,
        gutter: Gutter,
        route: &'a Route,
    ) -> Result<Scene<'a>, Error> {
        let vehicle = &recording.vehicle;
        let tractor =
            |frame: &Frame| corners(&vehicle.tractor_body.into(), point(frame.position), frame.heading.into());
        let trailer = |frame: &Frame| {
            corners(&vehicle.trailer_body.into(), point(frame.trailer_position), frame.trailer_heading.into())
        };
        Ok(Scene {
            recording,
            roundabout,
            gutter,
            route,
            // A roundabout too small for the usual lengths is drawn without the names of its arms.
            routes: roundabout.routes(APPROACH, DEPARTURE, WAYPOINT_SPACING).unwrap_or_default(),
            lettering: Lettering::new()?,
            tractor: recording.frames.iter().map(tractor).collect(),
            trailer: recording.frames.iter().map(trailer).collect(),
        })
    }

    /// The whole episode in one picture, as SVG text.
    pub fn still(&self) -> String {
        let view = View::around(self.shown());
        let (map, entries) = (self.map(&view), self.legend(&view));
        crate::figure::composed(
            &view,
            &self.lettering,
            &self.title(),
            &[&self.summary()],
            Definitions::new(),
            map,
            &entries,
        )
    }

    /// The whole episode on the map.
    pub(crate) fn map(&self, view: &View) -> Group {
        let road = self.road(view);
        let area =
            |corners: &[[DVec2; 4]], colour: &str| Path::new().set("d", swept_area(view, corners)).set("fill", colour);
        Group::new()
            .add(road.surface())
            .add(area(&self.trailer, colour::SWEPT_BY_TRAILER))
            .add(area(&self.tractor, colour::SWEPT_BY_TRACTOR))
            .add(road.lanes())
            .add(road.kerbs())
            .add(self.route_line(view))
            .add(self.vehicles(view, self.recording.frames.len() - 1))
            .add(self.trucks_at_intervals(view))
            .add(self.axle_paths(view, self.recording.frames.len() - 1))
            .add(self.ends(view))
            .add(road.arm_names())
    }

    /// What is on that map.
    pub(crate) fn legend(&self, view: &View) -> Vec<Entry> {
        let mut entries = vec![
            Entry::new(Swatch::Area(colour::SWEPT_BY_TRACTOR), "swept by the tractor"),
            Entry::new(Swatch::Area(colour::SWEPT_BY_TRAILER), "swept by the trailer alone"),
            Entry::new(Swatch::Line(colour::ROUTE, 2.4, ""), "route"),
        ];
        entries.extend(path_legend());
        entries.extend(self.vehicle_legend(" at the end"));
        entries.extend(self.road(view).surface_legend());
        if self.touched().is_some() {
            entries.push(Entry::new(Swatch::Ring(colour::OVERLAP), "a kerb was touched here"));
        }
        entries
    }

    fn road<'b>(&'b self, view: &'b View) -> RoadLayers<'b> {
        let straights = Straights { approach: APPROACH, departure: DEPARTURE };
        RoadLayers::new(view, &self.lettering, self.roundabout, &self.routes, straights, self.gutter)
    }

    /// The ring, and the points of the path and of the route near it.
    pub(crate) fn shown(&self) -> impl Iterator<Item = DVec2> {
        let radius = self.roundabout.outer_radius();
        let driven =
            self.recording.frames.iter().flat_map(|frame| [point(frame.position), point(frame.trailer_position)]);
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
        let line = |position: fn(&Frame) -> [f32; 2], colour: &str| {
            let points: Vec<DVec2> =
                self.recording.frames[..=last].iter().map(|frame| point(position(frame))).collect();
            Path::new().set("d", view.line(&points)).set("fill", "none").set("stroke", colour).set("stroke-width", 2.0)
        };
        let drive = line(|frame| frame.position, colour::DRIVE_AXLE).set("stroke-dasharray", DASHES);
        Group::new().add(line(|frame| frame.trailer_position, colour::TRAILER_AXLES)).add(drive)
    }

    /// Both units at frame `index`, the trailer above the tractor, with the steered front wheels.
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
        let wheels =
            Path::new().set("d", wheels).set("stroke", colour::INK).set("stroke-width", number(0.3 * view.scale));
        Group::new()
            .add(body(&self.tractor[index], colour::TRACTOR))
            .add(wheels)
            .add(body(&self.trailer[index], colour::TRAILER))
    }

    /// Trucks at nearly equal distances, with those of the first and the last frame.
    fn trucks_at_intervals(&self, view: &View) -> Group {
        let positions: Vec<DVec2> = self.recording.frames.iter().map(|frame| point(frame.position)).collect();
        let mut driven = vec![0.0];
        driven.extend(positions.windows(2).scan(0.0, |sum, pair| {
            *sum += pair[0].distance(pair[1]);
            Some(*sum)
        }));
        let length = driven[driven.len() - 1];
        let n = (length / BETWEEN_TRUCKS).round().max(1.0);
        let stations = (0..=n as usize)
            .map(|part| driven.partition_point(|&s| s < length * part as f64 / n).min(positions.len() - 1));
        stations.fold(Group::new(), |group, index| group.add(self.truck(view, index, 0.3)))
    }

    /// The drive axle's first and last position, and a ring where a unit touched a kerb.
    fn ends(&self, view: &View) -> Group {
        let last = self.recording.frames.len() - 1;
        let mut group = Group::new();
        for (words, index) in [("start", 0), ("end", last)] {
            let position = point(self.recording.frames[index].position);
            // A position outside the map is marked at its edge.
            let within = position.clamp(view.low + 2.5, view.high - 2.5);
            let at = view.point(within);
            let dot =
                Circle::new().set("cx", number(at.x)).set("cy", number(at.y)).set("r", 6).set("fill", colour::INK);
            let dot = dot.set("stroke", "white").set("stroke-width", 1.5);
            // Words that would leave the map on the right stand on the left.
            let leaves = view.point(view.high).x < at.x + 12.0 + self.lettering.width(words, 18.0);
            let (beside, align) = if leaves { (-12.0, Align::Right) } else { (12.0, Align::Left) };
            group = group.add(dot).add(self.lettering.text_on_map(
                words,
                at + DVec2::new(beside, 6.0),
                18.0,
                align,
                colour::INK,
            ));
        }
        if let Some(touched) = self.touched() {
            let at = view.point(touched);
            let ring = Circle::new().set("cx", number(at.x)).set("cy", number(at.y)).set("r", 13).set("fill", "none");
            group = group.add(ring.set("stroke", colour::OVERLAP).set("stroke-width", 2.6));
        }
        group
    }

    /// Where a unit touched a kerb, if that ended the episode.
    fn touched(&self) -> Option<DVec2> {
        let kerbs = self.roundabout.unit_kerbs(self.gutter);
        let units = [
            (Ended::TractorCollided, &self.tractor, &kerbs.tractor),
            (Ended::TrailerCollided, &self.trailer, kerbs.trailer()),
        ];
        let (_, corners, kerbs) = units.into_iter().find(|(ended, ..)| ended.name() == self.recording.ended)?;
        Some(nearest(corners.last()?, kerbs).0)
    }

    fn title(&self) -> String {
        let time = (self.recording.frames.len() - 1) as f64 * self.recording.step;
        format!("{}, {}{}: {} after {time:.1} s", self.recording.route, self.policy(), self.class(), self.end())
    }

    /// The names of vehicle and load after a comma, where the benchmark has several.
    fn class(&self) -> String {
        self.recording.class.as_ref().map(|class| format!(", {class}")).unwrap_or_default()
    }

    /// The start pose and the extremes of the episode.
    fn summary(&self) -> String {
        let frames = &self.recording.frames;
        let most = |value: fn(&Frame) -> f32| frames.iter().map(value).fold(f32::NEG_INFINITY, f32::max);
        let least = |value: fn(&Frame) -> f32| signed(frames.iter().map(value).fold(f32::INFINITY, f32::min), 2);
        let ratio = most(Frame::load_transfer_ratio);
        format!(
            "Start {} of seed {}. Least clearance: tractor {} m, trailer {} m. Articulation up to {:.0}\u{b0}, load \
             transfer ratio up to {ratio:.2}.",
            self.recording.episode,
            self.recording.seed,
            least(|frame| frame.tractor_clearance),
            least(|frame| frame.trailer_clearance),
            most(|frame| frame.articulation.abs()).to_degrees(),
        )
    }

    pub(crate) fn policy(&self) -> &'static str {
        match self.recording.policy.as_str() {
            "pursuit" => "pure pursuit",
            planned if planned.starts_with("pursuit of ") => "pure pursuit of a planned line",
            "random" => "random actions",
            "yields" => "rule that follows and yields",
            "follows" => "rule that follows",
            capped if rule::under(capped).is_some() => "learned policy under the rule",
            _ => "learned policy",
        }
    }

    /// The end code in words.
    pub(crate) fn end(&self) -> String {
        self.recording.ended.replace('_', " ")
    }
}

/// Legend entries of the paths of the axles.
fn path_legend() -> [Entry; 2] {
    [
        Entry::new(Swatch::Line(colour::DRIVE_AXLE, 2.0, DASHES), "drive axle"),
        Entry::new(Swatch::Line(colour::TRAILER_AXLES, 2.0, ""), "trailer axles"),
    ]
}

/// A number with a typographic minus sign.
fn signed(value: f32, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    // A value rounded to zero has no sign.
    if value < 0.0 && text.contains(|digit| ('1'..='9').contains(&digit)) { format!("\u{2212}{text}") } else { text }
}

fn point([x, y]: [f32; 2]) -> DVec2 {
    DVec2::new(x.into(), y.into())
}
