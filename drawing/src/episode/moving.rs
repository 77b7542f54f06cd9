//! The pictures of a film: a background that is the same for all of them, and what each frame adds.

use glam::DVec2;
use offtrack::layout::Ended;
use svg::Document;
use svg::node::element::{Circle, ClipPath, Definitions, Group, Path, Rectangle};

use super::{Scene, path_legend, point, signed};
use crate::figure;
use crate::legend::{self, Entry, Swatch};
use crate::lettering::Align;
use crate::view::{Layout, View, WIDTH, colour, number};
use offtrack_evaluation::recording::Recording;

/// The map of a film.
const FILMED: Layout = Layout { corner: DVec2::new(16.0, 96.0), width: WIDTH - 32.0, margin: 5.0, ratio: 1.0 };
/// Text size of a film's legend relative to that of a still: films are shown smaller.
const LEGEND_SCALE: f64 = 1.3;
/// Text size of a film's title and of the end of its episode in words, on the same line (px).
const TITLE: f64 = 30.0;

impl Scene<'_> {
    /// The background of all pictures of the film, as SVG text.
    pub(crate) fn film_background(&self) -> String {
        let view = self.film_view();
        let road = self.road(&view);
        let map = Group::new()
            .add(road.surface())
            .add(road.lanes())
            .add(road.kerbs())
            .add(self.route_line(&view))
            .add(road.arm_names());
        let mut entries = vec![Entry::new(Swatch::Line(colour::ROUTE, 2.4, ""), "route")];
        entries.extend(path_legend());
        entries.push(Entry::new(Swatch::Line(colour::RAY, 1.2, ""), "distance sensors"));
        entries.extend(self.vehicle_legend(""));
        let below = view.point(view.low).y + 10.0;
        let width = FILMED.width / LEGEND_SCALE;
        let (legend, height) = legend::drawn(&self.lettering, &entries, DVec2::ZERO, width);
        let legend =
            legend.set("transform", format!("translate({} {}) scale({LEGEND_SCALE})", FILMED.corner.x, number(below)));
        let edge =
            Path::new().set("d", view.frame()).set("fill", "none").set("stroke", colour::INK).set("stroke-width", 1.2);
        let size = DVec2::new(WIDTH, (below + height * LEGEND_SCALE + 8.0).ceil());
        let paper = Rectangle::new().set("width", size.x).set("height", size.y).set("fill", "white");
        let Recording { route, episode, seed, .. } = self.recording;
        let title = format!("{route}, {}{}, start {episode} of seed {seed}", self.policy(), self.class());
        let room = FILMED.width - self.lettering.width(&self.end(), TITLE) - TITLE;
        let letters = self.lettering.fitting(&title, TITLE, room);
        let title = self.lettering.text(&title, DVec2::new(FILMED.corner.x, 38.0), letters, Align::Left, colour::INK);
        let map = map.set("clip-path", "url(#map)");
        document(
            size,
            clip(&view),
            Group::new()
                .add(paper)
                .add(map)
                .add(edge)
                .add(figure::scale_bar(&view, &self.lettering))
                .add(legend)
                .add(title),
        )
    }

    /// The parts that frame `index` adds to the background, as SVG text.
    pub(crate) fn film_picture(&self, index: usize) -> String {
        let view = self.film_view();
        let map = Group::new()
            .add(self.axle_paths(&view, index))
            .add(self.rays(&view, index))
            .add(self.vehicles(&view, index))
            .add(self.truck(&view, index, 0.8));
        let size = DVec2::new(WIDTH, view.point(view.low).y);
        document(size, clip(&view), Group::new().add(map.set("clip-path", "url(#map)")).add(self.caption(index)))
    }

    fn film_view(&self) -> View {
        View::laid_out(self.shown(), &FILMED)
    }

    /// The distance sensors at frame `index`, with a dot where one meets a kerb.
    fn rays(&self, view: &View, index: usize) -> Group {
        let (frame, vehicle) = (&self.recording.frames[index], &self.recording.vehicle);
        let on = |position: [f32; 2], heading: f32| {
            move |ray: &[f32; 4]| (point(position), DVec2::from_angle(heading.into()), *ray)
        };
        let trailer = vehicle.trailer_rays.iter().map(on(frame.trailer_position, frame.trailer_heading));
        let tractor = vehicle.tractor_rays.iter().map(on(frame.position, frame.heading));
        let mut lines = String::new();
        let mut dots = Group::new();
        for ((position, ahead, [x, y, dx, dy]), &range) in trailer.chain(tractor).zip(&frame.ranges) {
            let from = position + ahead.rotate(point([x, y]));
            let to = from + f64::from(range) * ahead.rotate(point([dx, dy]));
            lines += &view.line(&[from, to]);
            if range < vehicle.sensor_range {
                let at = view.point(to);
                dots = dots.add(
                    Circle::new()
                        .set("cx", number(at.x))
                        .set("cy", number(at.y))
                        .set("r", 2.8)
                        .set("fill", colour::RAY),
                );
            }
        }
        let lines =
            Path::new().set("d", lines).set("stroke", colour::RAY).set("stroke-width", 1.0).set("stroke-opacity", 0.6);
        Group::new().add(lines).add(dots)
    }

    /// A line of figures in fixed columns.
    fn caption(&self, index: usize) -> Group {
        let frame = &self.recording.frames[index];
        let ratio = frame.load_transfer_ratio();
        let [tractor, trailer] =
            [frame.tractor_clearance, frame.trailer_clearance].map(|clearance| signed(clearance, 2));
        let figures = [
            (0.0, format!("{:.1} s", index as f64 * self.recording.step)),
            (84.0, format!("{:.1} km/h", 3.6 * frame.speed)),
            (206.0, format!("articulation {}\u{b0}", signed(frame.articulation.to_degrees(), 0))),
            (398.0, format!("LTR {ratio:.2}")),
            (508.0, format!("clearance: tractor {tractor} m, trailer {trailer} m")),
        ];
        let at = |x: f64| FILMED.corner + DVec2::new(x, -18.0);
        let text = |group: Group, (x, words): (f64, String)| {
            group.add(self.lettering.text(&words, at(x), 22.0, Align::Left, colour::INK))
        };
        let group = figures.into_iter().fold(Group::new(), text);
        if index + 1 < self.recording.frames.len() {
            return group;
        }
        let right = DVec2::new(WIDTH - FILMED.corner.x, 38.0);
        group.add(self.lettering.text(&self.end(), right, TITLE, Align::Right, self.end_colour()))
    }

    fn end_colour(&self) -> &'static str {
        if self.recording.ended == Ended::Arrived.name() { colour::ROUTE } else { colour::OVERLAP }
    }
}

fn clip(view: &View) -> Definitions {
    Definitions::new().add(ClipPath::new().set("id", "map").add(Path::new().set("d", view.frame())))
}

fn document(size: DVec2, definitions: Definitions, contents: Group) -> String {
    let document =
        Document::new().set("viewBox", (0.0, 0.0, size.x, size.y)).set("width", size.x).set("height", size.y);
    format!("{}\n", document.add(definitions).add(contents))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use offtrack::scenario::{Scenario, Split};
    use offtrack::simulator::{RouteChoice, Simulator};
    use offtrack::world::World;
    use resvg::usvg;

    use super::*;
    use crate::painted;
    use offtrack_evaluation::recording::{Of, Recorder};

    /// First and last column of these pixels with ink in the line of the title.
    fn inked(svg: &str) -> (u32, u32) {
        let pixels =
            painted(&usvg::Tree::from_str(svg, &usvg::Options::default()).unwrap(), WIDTH as u32, None).unwrap();
        let ink = |x: &u32| {
            (14..48).any(|y| {
                let pixel = pixels.pixel(*x, y).unwrap();
                pixel.alpha() != 0 && pixel.red() < 200
            })
        };
        ((0..pixels.width()).find(ink).unwrap(), (0..pixels.width()).rev().find(ink).unwrap())
    }

    #[test]
    fn the_end_of_an_episode_is_written_beside_the_title_however_long_the_routes_name_is() {
        let scenario = Scenario::named("attard2023").unwrap();
        let world = Arc::new(World::bake(&scenario).unwrap());
        let (roundabout, route) = scenario.routes().nth(scenario.split(Split::Test)[0] as usize).unwrap();
        let simulator =
            Simulator::new(world.clone(), 1, 3, RouteChoice::Fixed(vec![scenario.split(Split::Test)[0]])).unwrap();
        let track = Recorder::new(&world, simulator.batch(), [0]).finish().remove(0);
        let roundabout = &scenario.places[roundabout].roundabout;
        let of = Of { scenario: &scenario, world: &world, roundabout, route, policy: "pursuit", seed: 3 };
        let mut recording = of.recording(0, 1, track);
        for (name, ended) in
            [("20m/E-left-2", "arrived"), ("an-imported-map-with-a-long-name/12345/SW-right-11", "tractor_collided")]
        {
            (recording.route, recording.ended) = (name.into(), ended.into());
            let scene = Scene::new(&recording, roundabout, scenario.gutter, route).unwrap();
            let (title, end) = (inked(&scene.film_background()), inked(&scene.film_picture(0)));
            assert!(title.0 < 20 && title.1 + 10 < end.0, "{name}: {title:?}, {end:?}");
            assert!(WIDTH - 20.0 < f64::from(end.1), "{end:?}");
        }
    }
}
