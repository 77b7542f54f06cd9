//! One route and vehicle on a sheet: what both units sweep, the paths of the axles, the worst place.

use glam::DVec2;
use offtrack::map::route::Route;
use offtrack::vehicle::swept::{front_path, swept_area};
use offtrack_evaluation::fits::{Path as Driven, Row};
use svg::node::element::{Circle, Group, Path, Use};

use crate::lettering::{Align, Lettering};
use crate::road::RoadLayers;
use crate::view::{View, colour, number};

/// Size of the letters on a panel (px).
const SIZE: f64 = 11.0;
/// Distance between the outlines that are drawn (m).
const BETWEEN_TRUCKS: f64 = 18.0;
/// Distance between the points of a line on the sheet (px).
const APART: f64 = 0.6;
const DASHES: &str = "5 3";

/// A route and vehicle that a sheet shows.
pub struct Shown {
    /// The answer.
    pub row: Row,
    /// The route as it lies in the world.
    pub route: Route,
    /// The path that [`Row::shown`] has the figures of.
    pub path: Driven,
    /// What the tractor and the trailer sweep, as polygons (m).
    areas: [Vec<Vec<DVec2>>; 2],
}

impl Shown {
    /// The answer for a route, with the path that is shown.
    pub fn new(row: Row, route: Route, path: Driven) -> Shown {
        let areas = path.corners().map(|unit| swept_area(&unit));
        Shown { row, route, path, areas }
    }

    /// What the tractor and the trailer sweep, as polygons (m).
    pub(super) fn areas(&self) -> &[Vec<Vec<DVec2>>; 2] {
        &self.areas
    }

    /// The panel in the frame of `view`, whose upper left corner is 0; `origin` is that of the road in its map.
    pub(super) fn drawn(
        &self,
        view: &View,
        lettering: &Lettering,
        road: &RoadLayers,
        origin: DVec2,
        asked: f64,
    ) -> Group {
        let [tractor, trailer] = self.path.corners();
        let [tractor_area, trailer_area] = self
            .areas
            .each_ref()
            .map(|polygons| polygons.iter().map(|polygon| view.polygon(&thinned(view, polygon))).collect::<String>());
        let area = |data: &str, fill: &str| Path::new().set("d", data).set("fill", fill).set("fill-rule", "evenodd");
        let overlaps =
            road.clipped([&tractor_area, &trailer_area].map(|data| Group::new().add(area(data, colour::OVERLAP))));
        let mut group = Group::new()
            .add(Use::new().set("href", "#road"))
            .add(area(&trailer_area, colour::SWEPT_BY_TRAILER))
            .add(area(&tractor_area, colour::SWEPT_BY_TRACTOR))
            .add(overlaps)
            .add(Use::new().set("href", "#kerbs"));
        let poses = &self.path.poses;
        let line = |points: &[DVec2], colour: &str| {
            Path::new()
                .set("d", view.line(&thinned(view, points)))
                .set("fill", "none")
                .set("stroke", colour)
                .set("stroke-width", 0.9)
        };
        let points = |of: fn(&offtrack::vehicle::swept::Pose) -> DVec2| poses.iter().map(of).collect::<Vec<_>>();
        group = group
            .add(line(&points(|pose| pose.trailer_position), colour::TRAILER_AXLES))
            .add(line(&points(|pose| pose.position), colour::DRIVE_AXLE).set("stroke-dasharray", DASHES))
            .add(line(&front_path(&self.path.rig, poses), colour::INK));
        let step = poses.get(1).map_or(1.0, |pose| pose.position.distance(poses[0].position).max(1e-3));
        let every = ((BETWEEN_TRUCKS / step) as usize).max(1);
        for (unit, colour) in [(&trailer, colour::TRAILER), (&tractor, colour::TRACTOR)] {
            for corners in unit.iter().step_by(every) {
                let body = Path::new().set("d", view.polygon(corners)).set("fill", "none").set("stroke", colour);
                group = group.add(body.set("stroke-width", 0.9));
            }
        }
        group.add(self.worst(view, lettering, origin, asked))
    }

    /// A ring around the place where the truck comes nearest to a kerb, with the clearance there.
    fn worst(&self, view: &View, lettering: &Lettering, origin: DVec2, asked: f64) -> Group {
        let (unit, nearest) = self.row.shown().nearest();
        let place = DVec2::new(nearest.x, nearest.y) - origin;
        let at = view.point(place);
        let colour = if self.row.shown().fits || asked <= nearest.clearance { colour::INK } else { colour::OVERLAP };
        let ring = Circle::new().set("cx", number(at.x)).set("cy", number(at.y)).set("r", 6).set("fill", "none");
        let words = format!("{unit} {}", signed(nearest.clearance));
        let is_east = view.low.x + view.high.x < 2.0 * place.x;
        let (aside, align) = if is_east { (-9.0, Align::Right) } else { (9.0, Align::Left) };
        let corner = at + DVec2::new(aside, 4.0);
        Group::new()
            .add(ring.set("stroke", colour).set("stroke-width", 1.6))
            .add(lettering.text_on_map(&words, corner, SIZE, align, colour))
    }

    /// The two lines below the panel.
    pub(super) fn caption(&self) -> [String; 2] {
        let Row { vehicle, lane_centre, way, .. } = &self.row;
        let found = way.as_ref().map_or("none found".to_owned(), |way| signed(way.clearance()));
        let shown = self.row.shown();
        let apron = match shown.apron_use() {
            Some(0.0) => ", apron not used".to_owned(),
            Some(by) => format!(", {by:.2} m on the apron"),
            None => String::new(),
        };
        let verdict = self.row.verdict();
        let verdict = if self.row.fits { format!("fits, {verdict}") } else { verdict.to_owned() };
        [
            format!("{}  {vehicle}: {verdict}", self.row.movement()),
            format!(
                "centre line {}, other way {found}; swept {:.2} m, off-tracking {:.2} m, steer {:.0}\u{b0}{apron}",
                signed(lane_centre.clearance()),
                shown.swept_width,
                shown.off_tracking,
                shown.steer_angle_deg
            ),
        ]
    }
}

/// Points of a line that are far enough from each other to be told apart on the sheet.
fn thinned(view: &View, points: &[DVec2]) -> Vec<DVec2> {
    let mut kept: Vec<DVec2> = Vec::new();
    for (index, &p) in points.iter().enumerate() {
        let is_far = kept.last().is_none_or(|last| APART <= view.scale * last.distance(p));
        if is_far || index + 1 == points.len() {
            kept.push(p);
        }
    }
    kept
}

/// A clearance in metres with a typographic minus sign.
fn signed(clearance: f64) -> String {
    if clearance < 0.0 { format!("\u{2212}{:.2} m", -clearance) } else { format!("{clearance:.2} m") }
}
