//! One vehicle on one road: the scenario that is driven, and the answer for each of its routes.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec2;
use offtrack::layout::{Rig, Start, Truck};
use offtrack::map::route::Route;
use offtrack::map::{Road, UnitKerbs};
use offtrack::scenario::{APPROACH, DEPARTURE, Scenario};
use offtrack::vehicle::Vehicle;
use offtrack::vehicle::profile::Profile;
use offtrack::vehicle::swept::{Demand, Limit, Pose, demands, swept_path};
use offtrack::world::World;

use super::results::Asked;
use super::row::Row;
use super::search::grown;
use super::way::{Asks, Path, Refusal, Way};
use crate::certificate::attempt::{attempts, passes};
use crate::certificate::beam::Pass;
use crate::certificate::file::{self, Found};
use crate::certificate::verify::{Sequence, follow};
use crate::error::Error;
use crate::polygons::to;

/// Distance between the poses of a path on the lane's centre line (m).
const SPACING: f64 = 0.25;
/// Largest distance that a truck drives in a step, and about the distance between two choices of the search (m).
const STEP: f64 = 0.42;
const CHOICE: f64 = 1.25;
/// Steer angles that the search chooses from, as fractions of the lock.
const STEER_LEVELS: [f64; 9] = [-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0];
/// Shortest approach and departure that say something (m).
const SHORTEST: f64 = 10.0;
/// The fastest speed that is looked for (m/s).
const FASTEST: f64 = 90.0 / 3.6;
/// The benchmark whose reward and sensors stand for those that no search asks for.
const BASE: &str = "attard2023-full";

/// A vehicle on a road.
pub struct Case {
    /// Stem of the vehicle's file.
    pub vehicle: String,
    /// The road as it lies in the world.
    pub road: Road,
    /// The routes as they lie in the world, in the order of the scenario's.
    pub routes: Vec<Route>,
    /// The kerbs of the road, its arms prolonged.
    pub kerbs: UnitKerbs,
    /// Lengths of the routes before and after the ring (m).
    pub straights: [f64; 2],
    pub(super) asked: Asked,
    pub(super) world: Arc<World>,
    /// The same with the truck's outline grown by the clearance asked for, and without sensors.
    grown: Arc<World>,
    /// The truck with its roll discretised for the time from one pose to the next.
    rig: Rig,
    step: f64,
}

impl Case {
    /// What is driven: the road with all its routes, the vehicle at one speed. Approach and departure are shorter than
    /// usual where the arms are.
    ///
    /// # Errors
    ///
    /// An arm too short for the vehicle.
    pub fn scenario(asked: &Asked, road: &Road, vehicle: &Vehicle) -> Result<Scenario, Error> {
        let speed = asked.speed_kmh / 3.6;
        let (approach, departure) = straights(road, vehicle)?;
        let mut scenario = Scenario::named(BASE)?;
        scenario.vehicle = vehicle.clone();
        // A delay moves what is asked of the steering, not what can be driven, and may be longer than a step allows.
        scenario.vehicle.model.steer_delay = 0.0;
        scenario.load = asked.load.clone();
        scenario.gutter = asked.gutter;
        scenario.steer_levels = STEER_LEVELS.to_vec();
        scenario.speeds = vec![speed];
        scenario.step = (STEP / speed).min(0.1);
        (scenario.start_offset, scenario.start_heading) = (0.0, 0.0);
        (scenario.approach, scenario.departure) = (approach, departure);
        Ok(scenario.on(road.clone())?)
    }

    /// The vehicle on the road of [`Case::scenario`], which `world` was baked from.
    pub fn new(asked: &Asked, name: &str, scenario: &Scenario, world: Arc<World>) -> Case {
        let place = &scenario.places[0];
        let road = place.roundabout.seen();
        let speed = asked.speed_kmh / 3.6;
        // The lane's centre line is followed as it lies.
        let vehicle = scenario.vehicle.seen_on(&place.roundabout);
        Case {
            vehicle: name.to_owned(),
            kerbs: road.unit_kerbs_beyond_ends(asked.gutter),
            routes: place.routes.iter().map(|route| place.roundabout.seen_route(route)).collect(),
            straights: [scenario.approach, scenario.departure],
            road,
            asked: asked.clone(),
            grown: grown(&world, asked.clearance),
            world,
            rig: vehicle.rig(&asked.load, (SPACING / speed) as f32, None),
            step: scenario.step,
        }
    }

    /// The answers for the routes with these indices, which are searched on all cores. `done` is given each as it is
    /// found, from any thread.
    ///
    /// # Errors
    ///
    /// Threads that cannot be started, and the errors of the simulator.
    pub fn answer(&self, routes: &[usize], done: &(dyn Fn(Result<Row, Error>) + Sync)) -> Result<(), Error> {
        let passes = self.passes()?;
        let starts: Vec<(u32, Start)> = routes.iter().map(|&route| (route as u32, Start::default())).collect();
        attempts(&self.grown, &starts, &passes, &|index, found| done(self.row(routes[index], found, &passes)))?;
        Ok(())
    }

    /// The path of a row that was answered: with the front axle on the lane's centre line, or the way found.
    ///
    /// # Errors
    ///
    /// A sequence of actions that is none, and the errors of the simulator.
    pub fn path(&self, route: usize, row: &Row) -> Result<Path, Error> {
        if row.shows_way() { Ok(self.driven(route, &row.search)?.0) } else { Ok(self.on_centre(route).0) }
    }

    /// The lowest speed of the route's feasible profile (m/s): of its waypoints, which lie as the truck drives them.
    fn fastest(&self, route: usize) -> f64 {
        let waypoints = self.world.route_waypoints(route as u32);
        Profile::of(&self.world.rigs[0], waypoints, FASTEST).speeds.into_iter().fold(FASTEST, f64::min)
    }

    fn passes(&self) -> Result<Vec<Pass>, Error> {
        let hold = (CHOICE / (self.asked.speed_kmh / 3.6 * self.step)).round().max(1.0);
        passes(&self.asked.widths, hold as usize)
    }

    fn row(&self, route: usize, found: &Found, passes: &[Pass]) -> Result<Row, Error> {
        let (path, asks) = self.on_centre(route);
        let (lock, grip) = (Limit::Lock.of(&self.rig).to_radians(), f64::from(self.rig.lateral_acceleration_max));
        let refused = |clearance: f64| {
            let limits = [
                (Refusal::Kerb, self.keeps(clearance)),
                (Refusal::Lock, asks.steering <= lock),
                (Refusal::Tyres, asks.lateral_acceleration <= grip),
                (Refusal::Rollover, asks.load_transfer_ratio < 1.0),
            ];
            limits.into_iter().find(|(_, holds)| !holds).map(|(refusal, _)| refusal)
        };
        let lane_centre = self.way(route, &path, &asks, refused);
        let (search, searched_clearance, way) = self.searched(route, found, passes)?;
        Ok(Row {
            route: self.routes[route].name.clone(),
            vehicle: self.vehicle.clone(),
            fits: lane_centre.fits || way.as_ref().is_some_and(|way| way.fits),
            lane_centre,
            way,
            fastest_kmh: to(100.0, 3.6 * self.fastest(route)),
            search,
            searched_clearance,
        })
    }

    pub(super) fn way(
        &self,
        route: usize,
        path: &Path,
        asks: &Asks,
        refused: impl FnOnce(f64) -> Option<Refusal>,
    ) -> Way {
        Way::of(path, asks, &self.road, &self.routes[route], &self.kerbs, self.straights, refused)
    }

    /// The path with the front axle on the lane's centre line, and what it asks.
    fn on_centre(&self, route: usize) -> (Path, Asks) {
        let (line, speed) = (&self.routes[route].centre_line, self.asked.speed_kmh / 3.6);
        let poses = swept_path(&self.rig, line, speed, SPACING);
        let demands = demands(&self.rig, line, &poses, speed, SPACING);
        let most = |of: fn(&Demand) -> f64| demands.iter().map(|demand| of(demand).abs()).fold(0.0, f64::max);
        let asks = Asks {
            lowest_radius: line.least_radius(),
            steering: most(|demand| demand.steering),
            steer_rate: most(|demand| demand.steer_rate),
            lateral_acceleration: most(|demand| demand.lateral_acceleration),
            load_transfer_ratio: most(|demand| demand.load_transfer_ratio),
        };
        (Path { poses, rig: self.rig }, asks)
    }

    /// The way that a search found, driven again, and what it asks.
    pub(super) fn driven(&self, route: usize, found: &Found) -> Result<(Path, Asks), Error> {
        let route = route as u32;
        let limit = self.world.most_steps(&Truck { route, ..Truck::default() });
        let actions = file::actions(&found.actions, self.world.params.n_actions, limit)
            .map_err(|message| Error::contents(std::path::Path::new("fits.json"), message))?;
        let mut trucks: Vec<Truck> = Vec::new();
        let sequence = Sequence { route, start: Start::default(), actions };
        follow(&self.world, &[sequence], |_, batch| trucks.push(batch.truck[0]))?;
        let rig = self.world.rigs[0];
        let most = |of: &dyn Fn(&[Truck]) -> f64| trucks.windows(2).map(of).fold(0.0, f64::max);
        let steering = trucks.iter().map(|truck| f64::from(truck.steering.abs())).fold(0.0, f64::max);
        let turned = |pair: &[Truck]| {
            let turn = f64::from(pair[1].heading) - f64::from(pair[0].heading);
            ((turn + PI).rem_euclid(2.0 * PI) - PI).abs() / self.step
        };
        let asks = Asks {
            lowest_radius: f64::from(rig.wheelbase) / steering.sin(),
            steering,
            steer_rate: most(&|pair| f64::from((pair[1].steering - pair[0].steering).abs()) / self.step),
            lateral_acceleration: most(&|pair| f64::from(pair[1].speed) * turned(pair)),
            load_transfer_ratio: trucks.iter().map(|truck| f64::from(truck.load_transfer_ratio())).fold(0.0, f64::max),
        };
        let mirrored = self.world.frames[0].mirrored;
        let poses = trucks.iter().map(|truck| pose(truck, &rig, mirrored)).collect();
        Ok((Path { poses, rig }, asks))
    }
}

/// A truck's pose in the world as it is seen.
fn pose(truck: &Truck, rig: &Rig, mirrored: bool) -> Pose {
    let side = if mirrored { -1.0 } else { 1.0 };
    let seen = |p: glam::Vec2| DVec2::new(p.x.into(), side * f64::from(p.y));
    Pose {
        position: seen(truck.position),
        heading: side * f64::from(truck.heading),
        trailer_position: seen(truck.trailer_position(rig)),
        trailer_heading: side * f64::from(truck.trailer_heading),
    }
}

/// Lengths of the routes before and after the ring: the usual ones, or what the arms have room for (m).
fn straights(road: &Road, vehicle: &Vehicle) -> Result<(f64, f64), Error> {
    let (behind, ahead) = vehicle.reach(0.0);
    let too_short = |what: String| Error::Setting {
        name: "ROAD",
        value: road.name.clone(),
        expected: format!("{what}; prolong the arm, or leave the vehicle out"),
    };
    let routes = road.routes(0.0, 0.0, STEP).map_err(|leaves| too_short(leaves.to_string()))?;
    let room = |of: fn(&Route) -> f64, reach: f64, usual: f64| {
        let longest = routes.iter().map(of).fold(f64::INFINITY, f64::min) - reach;
        // Rounded down, so that it fits.
        let length = ((longest * 100.0).floor() / 100.0).min(usual);
        if length < SHORTEST {
            let least = SHORTEST + reach;
            return Err(too_short(format!("its arms leave {:.1} m; the truck needs {least:.1} m", length + reach)));
        }
        Ok(length)
    };
    Ok((room(|route| route.before, behind, APPROACH)?, room(|route| route.after, ahead, DEPARTURE)?))
}

/// Whether a list of names asks for a route: by its name, or by the part after the road's. An empty list asks for all.
pub fn is_asked(route: &str, names: &[String]) -> bool {
    let short = route.rsplit('/').next();
    names.is_empty() || names.iter().any(|name| name == route || Some(name.as_str()) == short)
}

/// Indices of the routes that a list of names asks for.
pub fn wanted(routes: &[Route], names: &[String]) -> Vec<usize> {
    (0..routes.len()).filter(|&index| is_asked(&routes[index].name, names)).collect()
}

#[cfg(test)]
mod tests {
    use offtrack::geometry::Curve;
    use offtrack::map::Gutter;
    use offtrack::map::ground::Ground;

    use super::*;

    /// The answer for a route of 16m, or of its mirror image, with this clearance.
    fn answered(route: &str, vehicle: &str, clearance: f64, is_mirrored: bool) -> Row {
        answered_on(Road::named("16m").unwrap(), route, vehicle, clearance, is_mirrored)
    }

    fn answered_on(road: Road, route: &str, vehicle: &str, clearance: f64, is_mirrored: bool) -> Row {
        let ground = Ground { mirrored: is_mirrored, ..road.ground().clone() };
        let road = Road::on("16m".into(), ground);
        let (load, gutter) = ("empty".into(), Gutter::Drivable);
        let asked = Asked { load, speed_kmh: 15.0, clearance, gutter, widths: vec![64, 256] };
        let scenario = Case::scenario(&asked, &road, &Vehicle::named(vehicle).unwrap()).unwrap();
        let world = Arc::new(World::bake(&scenario).unwrap());
        let case = Case::new(&asked, vehicle, &scenario, world);
        let routes = wanted(&case.routes, &[route.to_owned()]);
        let rows = std::sync::Mutex::new(Vec::new());
        case.answer(&routes, &|row| rows.lock().unwrap().push(row.unwrap())).unwrap();
        let row = rows.into_inner().unwrap().swap_remove(0);
        let path = case.path(routes[0], &row).unwrap();
        let [tractor, trailer] = path.clearances(&case.kerbs);
        assert!((row.shown().clearance() - tractor.least.min(trailer.least)).abs() < 1e-3);
        row
    }

    #[test]
    fn a_search_without_sensors_finds_the_way_that_one_with_them_finds() {
        let (load, gutter) = ("empty".into(), Gutter::Drivable);
        let asked = Asked { load, speed_kmh: 15.0, clearance: 0.0, gutter, widths: vec![64] };
        let road = Road::named("16m").unwrap();
        let scenario = Case::scenario(&asked, &road, &Vehicle::named("eu_4x2_13m6").unwrap()).unwrap();
        let case = Case::new(&asked, "eu_4x2_13m6", &scenario, Arc::new(World::bake(&scenario).unwrap()));
        let starts: Vec<(u32, Start)> = [0, 7].map(|route| (route, Start::default())).into();
        let passes = case.passes().unwrap();
        let found = |world: &Arc<World>| attempts(world, &starts, &passes, &|_, _| {}).unwrap();
        assert!(case.grown.params.sensor_range < case.world.params.sensor_range);
        let (blind, seeing) = (found(&case.grown), found(&case.world));
        assert!(blind.iter().all(Found::arrived) && blind == seeing, "{blind:?} {seeing:?}");
    }

    #[test]
    fn a_way_keeps_the_clearance_that_is_asked_for_and_leaves_the_lane_where_the_centre_line_does_not_do() {
        let row = answered("E-left-2", "eu_4x2_13m6", 0.1, false);
        let way = row.way.as_ref().unwrap();
        assert!(row.fits && !row.lane_centre.fits && way.fits && 0.099 <= way.clearance(), "{row:?}");
        assert!(row.lane_centre.clearance() < 0.0 && row.verdict() == "other way");
        assert!(0.1 < way.leaves_lane_left.max(way.leaves_lane_right), "{way:?}");
        // The steering is what the vehicle has.
        assert!(way.steer_angle_deg <= 40.01 && way.steer_rate_deg <= 20.1, "{way:?}");
        assert!(2.55 < way.swept_width && 0.0 < way.off_tracking && way.load_transfer_ratio < 0.5, "{way:?}");
    }

    #[test]
    fn the_mirror_image_of_a_road_has_the_same_answer_at_the_mirrored_place() {
        let one = answered("E-left-2", "eu_4x2_13m6", 0.0, false);
        let other = answered("E-right-2", "eu_4x2_13m6", 0.0, true);
        for (one, other) in [(&one.lane_centre, &other.lane_centre), (one.shown(), other.shown())] {
            assert!((one.clearance() - other.clearance()).abs() < 1e-3, "{one:?} {other:?}");
            assert!((one.swept_width - other.swept_width).abs() < 1e-3, "{one:?} {other:?}");
            assert!((one.trailer.x - other.trailer.x).abs() < 0.01 && (one.trailer.y + other.trailer.y).abs() < 0.01);
            assert!((one.leaves_lane_left - other.leaves_lane_right).abs() < 1e-2, "{one:?} {other:?}");
        }
    }

    #[test]
    fn a_trailer_that_runs_over_the_island_on_its_lanes_centre_line_fits_by_an_apron_of_that_width() {
        let with_apron = |width: f64| {
            let road = Road::named("16m").unwrap();
            let apron = Curve::circle(DVec2::ZERO, road.island_radius() - width);
            Road::on("16m".into(), Ground { aprons: vec![apron], ..road.ground().clone() })
        };
        let without = answered("E-left-2", "eu_4x2_13m6", 0.0, false).lane_centre;
        let over = -without.trailer.clearance;
        assert!(0.1 < over && 0.2 < without.tractor.clearance && without.apron_clearance.is_none(), "{without:?}");
        for is_mirrored in [false, true] {
            let route = if is_mirrored { "E-right-2" } else { "E-left-2" };
            let on = |width: f64| answered_on(with_apron(width), route, "eu_4x2_13m6", 0.2, is_mirrored);
            let row = on(over + 0.3);
            let way = &row.lane_centre;
            assert!(row.verdict() == "lane centre" && (way.trailer.clearance - 0.3).abs() < 0.01, "{row:?}");
            assert!((way.apron_use().unwrap() - over).abs() < 2e-3, "{way:?}");
            assert_eq!(way.tractor.clearance, without.tractor.clearance);
            // The clearance that is asked for is kept from the apron's inner edge.
            assert!(!on(over + 0.1).lane_centre.fits);
        }
        let unused = answered_on(with_apron(0.5), "E-right-1", "daf_xf", 0.0, false);
        assert_eq!(unused.shown().apron_use(), Some(0.0));
    }

    #[test]
    fn a_road_that_tilts_and_its_mirror_image_ask_for_the_same_and_a_delay_of_the_steering_for_nothing() {
        let asks = |is_mirrored: bool, route: &str, crossfall: f64, steer_delay: f64| {
            let ground = Ground { mirrored: is_mirrored, ..Road::named("16m").unwrap().ground().clone() };
            let road = Road::on("16m".into(), ground);
            let mut vehicle = Vehicle::named("daf_xf").unwrap();
            (vehicle.model.crossfall, vehicle.model.steer_delay) = (crossfall, steer_delay);
            let (load, gutter) = ("laden".into(), Gutter::Drivable);
            let asked = Asked { load, speed_kmh: 30.0, clearance: 0.0, gutter, widths: vec![8] };
            let scenario = Case::scenario(&asked, &road, &vehicle).unwrap();
            let case = Case::new(&asked, "daf_xf", &scenario, Arc::new(World::bake(&scenario).unwrap()));
            let route = wanted(&case.routes, &[route.to_owned()])[0];
            [case.on_centre(route).1.load_transfer_ratio, case.fastest(route)]
        };
        let all =
            [asks(false, "E-left-2", 0.1, 0.0), asks(true, "E-right-2", 0.1, 0.3), asks(false, "E-left-2", 0.0, 0.0)];
        for [one, other, level] in [0, 1].map(|figure| all.map(|asks| asks[figure])) {
            assert!((one - other).abs() < 1e-6 && 1e-2 < (one - level).abs(), "{one} {other} {level}");
        }
    }

    #[test]
    fn an_arm_too_short_for_the_truck_is_refused_by_the_road_and_what_the_truck_needs() {
        let road = Road::named("16m").unwrap();
        let lines = road.ground().lines.iter().map(|line| {
            let mut line = line.clone();
            let (enters, length) = (line.line.station(DVec2::ZERO), line.line.length());
            line.line = line.line.part(enters - 40.0, length);
            line
        });
        let ground = Ground { lines: lines.collect(), ..road.ground().clone() };
        let road = Road::on("short".into(), ground);
        let said = straights(&road, &Vehicle::named("us_wb67").unwrap()).unwrap_err().to_string();
        assert!(said.contains("ROAD: short") && said.contains("the truck needs"), "{said}");
    }
}
