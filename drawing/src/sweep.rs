//! The swept path of a truck whose front axle follows a route's centre line, where it leaves the road, and where the
//! truck cannot follow.

use glam::DVec2;
use offtrack::files::reader::shown;
use offtrack::geometry::Outline;
use offtrack::layout::Rig;
use offtrack::map::UnitKerbs;
use offtrack::map::route::Route;
use offtrack::vehicle::Vehicle;
use offtrack::vehicle::swept::{
    self, Demand, Limit, Pose, UnitClearance, demands, front_path, own_lane_suffices, swept_path,
};
use offtrack_evaluation::polygons::{Polygon, rounded as polygon};
use serde::Serialize;
use svg::node::element::{Circle, Definitions, Group, Path, Use};

use crate::legend::{Entry, Swatch};
use crate::lettering::{Align, Lettering};
use crate::limits::{self, Need, WrittenNeed};
use crate::view::{View, colour, number};

/// Distance between poses (m).
const SPACING: f64 = 0.25;
/// Distance between the trucks that are drawn (m).
const BETWEEN_TRUCKS: f64 = 22.0;

/// A truck's swept path along a route.
pub struct Sweep<'a> {
    /// The route.
    pub route: &'a Route,
    driven: Driven,
    /// Whether no pose touches solid ground.
    clears: bool,
    demands: Vec<Demand>,
    needs: Vec<Need>,
    poses: Vec<Pose>,
    rig: Rig,
    units: [Unit; 2],
    /// The trailer's least distance from an apron's outer edge, if there is an apron, negative on it (m).
    apron_clearance: Option<f64>,
}

/// What is driven.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Driven {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of the vehicle's load.
    pub load: String,
    /// Speed of the front axle (km/h).
    pub speed_kmh: f64,
}

/// A swept path as JSON has it.
#[derive(Serialize)]
pub(crate) struct Written<'a> {
    #[serde(flatten)]
    driven: &'a Driven,
    own_lane_suffices: bool,
    tractor_clearance: f64,
    trailer_clearance: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    apron_clearance: Option<f64>,
    tractor_area: Vec<Polygon>,
    trailer_area: Vec<Polygon>,
    limits: Vec<WrittenNeed>,
    demands: Vec<[f64; 5]>,
}

/// The swept path of one unit.
struct Unit {
    name: &'static str,
    colour: &'static str,
    light: &'static str,
    corners: Vec<[DVec2; 4]>,
    clearance: UnitClearance,
}

impl<'a> Sweep<'a> {
    /// The path of `vehicle`, which `driven` names, on a road with these kerbs. Those of
    /// [`Road::unit_kerbs_beyond_ends`](offtrack::map::Road::unit_kerbs_beyond_ends) do not take the road's end
    /// for one.
    ///
    /// # Panics
    ///
    /// If the vehicle does not have the load.
    pub fn new(vehicle: &Vehicle, driven: Driven, kerbs: &UnitKerbs, route: &'a Route) -> Sweep<'a> {
        let speed = driven.speed_kmh / 3.6;
        // A sub-step lasts from one pose to the next.
        let rig = vehicle.rig(&driven.load, (SPACING / speed) as f32, None);
        let poses = swept_path(&rig, &route.centre_line, speed, SPACING);
        let demands = demands(&rig, &route.centre_line, &poses, speed, SPACING);
        let tractor = poses.iter().map(|pose| pose.tractor_corners(&rig)).collect();
        let trailer: Vec<[DVec2; 4]> = poses.iter().map(|pose| pose.trailer_corners(&rig)).collect();
        Sweep {
            route,
            driven,
            clears: own_lane_suffices(&rig, kerbs.both(), &poses),
            needs: Need::of_all(&rig, &demands),
            demands,
            apron_clearance: kerbs.apron_edges().map(|edges| UnitClearance::of(&trailer, edges).least),
            units: [
                Unit::new("tractor", colour::TRACTOR, colour::SWEPT_BY_TRACTOR, tractor, &kerbs.tractor),
                Unit::new("trailer", colour::TRAILER, colour::SWEPT_BY_TRAILER, trailer, kerbs.trailer()),
            ],
            poses,
            rig,
        }
    }

    /// Whether a truck need not leave its lane: no pose touches solid ground, and the lock allows the path.
    pub fn own_lane_suffices(&self) -> bool {
        self.clears && !self.exceeds(|limit| limit == Limit::Lock)
    }

    /// What the path needs of each limit of the truck.
    pub fn needs(&self) -> &[Need] {
        &self.needs
    }

    fn exceeds(&self, counts: impl Fn(Limit) -> bool) -> bool {
        self.needs.iter().any(|need| need.is_exceeded() && counts(need.limit))
    }

    /// Whether the own lane suffices, in words, with the route's name.
    pub fn verdict(&self) -> String {
        let speed = shown(self.driven.speed_kmh);
        let too_fast = self.exceeds(|limit| limit != Limit::Lock);
        let verdict = match (self.exceeds(|limit| limit == Limit::Lock), self.clears, too_fast) {
            (true, ..) => "the lock does not suffice for its own lane".to_owned(),
            (_, true, false) => "its own lane suffices".to_owned(),
            (_, true, true) => format!("its own lane suffices, but not at {speed} km/h"),
            (_, false, false) => "its own lane does not suffice".to_owned(),
            (_, false, true) => format!("its own lane does not suffice, and {speed} km/h is too fast for it"),
        };
        format!("{}: {verdict}", self.route.name)
    }

    /// What is driven and where it sweeps, then what it needs of the truck: two lines of words.
    pub fn lines(&self) -> [String; 2] {
        let Driven { vehicle, load, speed_kmh } = &self.driven;
        let driven = format!("{vehicle}, {load}, {} km/h", shown(*speed_kmh));
        [
            format!("Swept path of {driven}, front axle on the lane's centre: {}.", self.summary()),
            limits::words(&self.needs),
        ]
    }

    pub(crate) fn written(&self) -> Written<'_> {
        let [tractor, trailer] = &self.units;
        let area = |unit: &Unit| swept::swept_area(&unit.corners).iter().map(|ring| polygon(ring)).collect();
        let rounded = |least: f64| (least * 1e4).round() / 1e4;
        Written {
            driven: &self.driven,
            own_lane_suffices: self.own_lane_suffices(),
            tractor_clearance: rounded(tractor.clearance.least),
            trailer_clearance: rounded(trailer.clearance.least),
            apron_clearance: self.apron_clearance.map(rounded),
            tractor_area: area(tractor),
            trailer_area: area(trailer),
            limits: self.needs.iter().map(|need| need.written(&self.demands)).collect(),
            demands: limits::rows(&self.demands),
        }
    }

    /// The least clearance of both units, or how far each overlaps a kerb, in words.
    pub fn summary(&self) -> String {
        let [tractor, trailer] = self.units.each_ref().map(|unit| {
            if unit.clearance.overlaps.is_empty() {
                format!("{} clear by {:.2} m", unit.name, unit.clearance.least)
            } else {
                format!("{} {:.2} m over a kerb", unit.name, -unit.clearance.least.min(0.0))
            }
        });
        match self.apron_clearance.filter(|clearance| *clearance < 0.0) {
            Some(clearance) => format!("{tractor}, {trailer}, {:.2} m past an apron edge", -clearance),
            None => format!("{tractor}, {trailer}"),
        }
    }

    /// Definitions of the swept areas, which are used twice.
    pub(crate) fn shapes(&self, view: &View) -> Definitions {
        // Half of the poses are dense enough.
        let drawn =
            |unit: &Unit| unit.corners.iter().step_by(2).chain(unit.corners.last()).copied().collect::<Vec<_>>();
        let area = |unit: &Unit| swept_area(view, &drawn(unit));
        self.units
            .iter()
            .fold(Definitions::new(), |all, unit| all.add(Path::new().set("id", unit.name).set("d", area(unit))))
    }

    /// The swept areas, to be drawn below the kerbs. The tractor's hides the trailer's: what remains of it is the
    /// off-tracking.
    pub(crate) fn areas(&self) -> Group {
        self.units.iter().rev().fold(Group::new(), |group, unit| group.add(unit.area(unit.light)))
    }

    /// The areas again, the tractor's and the trailer's, to be clipped to what is solid to each.
    pub(crate) fn overlaps(&self) -> [Group; 2] {
        self.units.each_ref().map(|unit| Group::new().add(unit.area(colour::OVERLAP)))
    }

    /// Trucks, paths of the axles, and a ring with its depth around each overlap.
    pub(crate) fn marks(&self, view: &View, lettering: &Lettering) -> Group {
        let mut group = Group::new();
        let every = (BETWEEN_TRUCKS / SPACING) as usize;
        for unit in self.units.iter().rev() {
            for corners in unit.corners.iter().step_by(every) {
                let body =
                    Path::new().set("d", view.polygon(corners)).set("fill", unit.colour).set("fill-opacity", 0.22);
                group = group.add(body.set("stroke", unit.colour).set("stroke-width", 1.5));
            }
        }
        let drive = |pose: &Pose| pose.position;
        let trailer = |pose: &Pose| pose.trailer_position;
        let line = |points: Vec<DVec2>, colour: &str, dashes: &str| {
            let path = Path::new()
                .set("d", view.line(&points))
                .set("fill", "none")
                .set("stroke", colour)
                .set("stroke-width", 1.6);
            if dashes.is_empty() { path } else { path.set("stroke-dasharray", dashes) }
        };
        group = group.add(line(self.poses.iter().map(trailer).collect(), colour::TRAILER_AXLES, ""));
        group = group.add(line(self.poses.iter().map(drive).collect(), colour::DRIVE_AXLE, DASHES));
        let front = front_path(&self.rig, &self.poses);
        group = group.add(limits::lines(view, &self.needs, &front)).add(line(front, colour::INK, ""));
        for (unit, below) in self.units.iter().zip([false, true]) {
            for &(deepest, depth) in &unit.clearance.overlaps {
                let at = view.point(deepest);
                let ring =
                    Circle::new().set("cx", number(at.x)).set("cy", number(at.y)).set("r", 11).set("fill", "none");
                group = group.add(ring.set("stroke", colour::OVERLAP).set("stroke-width", 2.2));
                let words = format!("{} {depth:.2} m", unit.name);
                let corner = at + DVec2::new(16.0, if below { 18.0 } else { -8.0 });
                group = group.add(lettering.text_on_map(&words, corner, 15.0, Align::Left, colour::OVERLAP));
            }
        }
        group
    }

    /// The lines of the legend.
    pub(crate) fn legend(&self) -> Vec<Entry> {
        let mut entries = vec![
            Entry::new(Swatch::Area(colour::SWEPT_BY_TRACTOR), "swept by the tractor"),
            Entry::new(Swatch::Area(colour::SWEPT_BY_TRAILER), "swept by the trailer alone"),
            Entry::new(Swatch::Line(colour::INK, 1.6, ""), "front axle = lane centre"),
            Entry::new(Swatch::Line(colour::DRIVE_AXLE, 1.6, DASHES), "drive axle"),
            Entry::new(Swatch::Line(colour::TRAILER_AXLES, 1.6, ""), "trailer axles"),
        ];
        if !self.clears {
            entries.push(Entry::new(Swatch::Ring(colour::OVERLAP), "swept beyond a kerb, deepest there"));
        }
        entries.extend(limits::legend(&self.needs));
        entries
    }
}

const DASHES: &str = "7 4";

impl Unit {
    fn new(
        name: &'static str,
        colour: &'static str,
        light: &'static str,
        corners: Vec<[DVec2; 4]>,
        kerbs: &Outline,
    ) -> Unit {
        Unit { name, colour, light, clearance: UnitClearance::of(&corners, kerbs), corners }
    }

    fn area(&self, colour: &str) -> Use {
        Use::new().set("href", format!("#{}", self.name)).set("fill", colour)
    }
}

/// Path data of the area that a rectangle sweeps through the poses `corners`, for the non-zero fill rule.
pub(crate) fn swept_area(view: &View, corners: &[[DVec2; 4]]) -> String {
    swept::swept_area(corners).iter().map(|ring| view.polygon(ring)).collect()
}
