//! One route and vehicle on a sheet: what both units sweep, the paths of the axles, the worst place.

use glam::DVec2;
use offtrack::map::route::Route;
use offtrack::vehicle::swept::{front_path, swept_area};
use offtrack_evaluation::fits::table::Units;
use offtrack_evaluation::fits::{Path as Driven, Row, Way};
use svg::node::element::{Circle, Group, Path, Use};

use super::letters::Letters;
use super::sheet::Head;
use crate::lettering::Align;
use crate::road::RoadLayers;
use crate::view::{View, colour, number};

/// Size of the letters on a panel (px).
const SIZE: f64 = 11.0;
/// Distance between the outlines that are drawn (m).
const BETWEEN_TRUCKS: f64 = 18.0;
/// Farthest that a line on the sheet may be from where it should be (px).
const OFF: f64 = 0.04;
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
    pub(super) fn drawn(&self, view: &View, letters: &Letters, road: &RoadLayers, origin: DVec2, head: &Head) -> Group {
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
        group.add(self.worst(view, letters, origin, head))
    }

    /// A ring around the place where the truck comes nearest to a kerb, with the clearance there.
    fn worst(&self, view: &View, letters: &Letters, origin: DVec2, head: &Head) -> Group {
        let (unit, nearest) = self.row.shown().nearest();
        let place = DVec2::new(nearest.x, nearest.y) - origin;
        let at = view.point(place);
        let colour =
            if self.row.shown().fits || head.clearance <= nearest.clearance { colour::INK } else { colour::OVERLAP };
        let ring = Circle::new().set("cx", number(at.x)).set("cy", number(at.y)).set("r", 6).set("fill", "none");
        let words = format!("{unit} {}", clearance(head.units, self.row.shown()));
        let is_east = view.low.x + view.high.x < 2.0 * place.x;
        let (aside, align) = if is_east { (-9.0, Align::Right) } else { (9.0, Align::Left) };
        let corner = at + DVec2::new(aside, 4.0);
        Group::new()
            .add(ring.set("stroke", colour).set("stroke-width", 1.6))
            .add(letters.text_on_map(&words, corner, SIZE, align, colour))
    }

    /// The two lines below the panel.
    pub(super) fn caption(&self, units: Units) -> [String; 2] {
        let Row { vehicle, lane_centre, way, .. } = &self.row;
        let found = way.as_ref().map_or("none found".to_owned(), |way| clearance(units, way));
        let shown = self.row.shown();
        let apron = match shown.apron_use() {
            Some(0.0) => ", apron not used".to_owned(),
            Some(by) => format!(", {} past the apron edge", said(units, by)),
            None => String::new(),
        };
        let verdict = self.row.verdict();
        let verdict = match self.row.limit() {
            Some(limit) => format!("{verdict}, {}", limit.name()),
            None if self.row.fits => format!("fits, {verdict}"),
            None => verdict.to_owned(),
        };
        [
            format!("{}  {vehicle}: {verdict}", self.row.movement()),
            format!(
                "centre line {}, other way {found}; swept {}, off-tracking {}, steer {:.0}\u{b0}{apron}",
                clearance(units, lane_centre),
                said(units, shown.swept_width),
                said(units, shown.off_tracking),
                shown.steer_angle_deg
            ),
        ]
    }
}

/// The points of a line that it needs on the sheet: between two of them it is straight, nearly.
fn thinned(view: &View, points: &[DVec2]) -> Vec<DVec2> {
    let placed: Vec<DVec2> = points.iter().map(|&p| view.point(p)).collect();
    let mut kept = vec![false; points.len()];
    let mut parts = Vec::new();
    if let Some(last) = points.len().checked_sub(1) {
        (kept[0], kept[last]) = (true, true);
        parts.push((0, last));
    }
    while let Some((from, to)) = parts.pop() {
        let off = |index: &usize| distance(placed[*index], placed[from], placed[to]);
        let Some(farthest) = (from + 1..to).max_by(|a, b| off(a).total_cmp(&off(b))) else { continue };
        if OFF < off(&farthest) {
            kept[farthest] = true;
            parts.extend([(from, farthest), (farthest, to)]);
        }
    }
    points.iter().zip(kept).filter(|(_, kept)| *kept).map(|(&p, _)| p).collect()
}

/// Distance of a point from a segment.
fn distance(p: DVec2, from: DVec2, to: DVec2) -> f64 {
    let along = to - from;
    let part = ((p - from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    p.distance(from + part * along)
}

/// A length with its unit and a typographic minus sign (m).
pub(super) fn said(units: Units, length: f64) -> String {
    with_unit(units, &units.length(length))
}

fn clearance(units: Units, way: &Way) -> String {
    with_unit(units, &units.clearance(way))
}

fn with_unit(units: Units, number: &str) -> String {
    format!("{} {}", number.replace('-', "\u{2212}"), units.of_length())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Layout;

    #[test]
    fn a_line_on_a_sheet_has_the_points_that_it_needs_and_no_other() {
        let layout = Layout { corner: DVec2::ZERO, width: 500.0, margin: 0.0, ratio: 1.0 };
        let view = View::laid_out([DVec2::splat(-50.0), DVec2::splat(50.0)].into_iter(), &layout);
        let straight: Vec<DVec2> = (0..400).map(|i| DVec2::new(0.1 * f64::from(i) - 40.0, 3.0)).collect();
        assert_eq!(thinned(&view, &straight), [straight[0], straight[399]]);
        let circle: Vec<DVec2> = (0..=720).map(|i| 20.0 * DVec2::from_angle(f64::from(i).to_radians() / 2.0)).collect();
        let kept = thinned(&view, &circle);
        assert!((20..200).contains(&kept.len()), "{}", kept.len());
        for p in circle {
            let off = kept.windows(2).map(|pair| distance(p, pair[0], pair[1])).fold(f64::INFINITY, f64::min);
            assert!(view.scale * off <= OFF + 1e-9, "{p}: {off} m");
        }
        assert_eq!(thinned(&view, &[]), []);
        assert_eq!(thinned(&view, &[DVec2::X]), [DVec2::X]);
    }
}
