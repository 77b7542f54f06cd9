//! What all trucks share: the roundabouts baked into fields, the routes as a table of waypoints, vehicle and weights.
//!
//! A `World` can be stepped as it was baked: what is wrong with a scenario is found when it is read or baked. The
//! tables are public, to be read and to be changed by who compares what a change does; a change is not checked.

mod fingerprint;
mod step_limits;
mod traffic;

use std::f64::consts::PI;
use std::sync::Mutex;

use glam::{DVec2, Vec2};
use rayon::prelude::*;

use crate::field::Field;
use crate::files::cache::{Loading, Stopped};
use crate::geometry::Outline;
use crate::layout::{
    Action, Disturbances, N_PREVIEW, N_RAYS, ObservationLayout, Params, PreviewRow, Ray, Reward, Rig, RouteRow, Truck,
    WaypointRow,
};
use crate::map::Frame;
use crate::map::route::Waypoint;
use crate::scenario::{ActionKind, Class, Entry, Invalid, Place, Scenario};
use step_limits::step_limits;
pub use traffic::{Level, Traffic, TrafficRoad, TrafficRoute};

/// Waypoints to the corner of each observed curvature.
const CURVATURE_STEPS: [usize; 4] = [5, 7, 10, 12];
/// Waypoints in each chord of the observed radii.
const CHORD: usize = 5;
/// Radius that is observed as 1 (m).
const RADIUS_SCALE: f64 = 100.0;

/// The shared, unchanging part of a batch.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct World {
    /// Time and limits.
    pub params: Params,
    /// What the reward weighs.
    pub reward: Reward,
    /// What the world does to a policy.
    pub disturbances: Disturbances,
    /// The vehicles that episodes draw from, at least one.
    pub rigs: Vec<Rig>,
    /// What each `class` of theirs is.
    pub classes: Vec<Class>,
    /// The distance sensors of each `chassis` of theirs, trailer's first.
    pub rays: Vec<[Ray; N_RAYS]>,
    /// The action table.
    pub actions: Vec<Action>,
    /// One field a roundabout: of the kerbs that its tractors keep to and distance sensors see.
    pub fields: Vec<Field>,
    /// One a roundabout with an apron, in the same order: of what its trailers keep to.
    pub trailer_fields: Vec<Option<Field>>,
    /// Where each roundabout lies in its map, in the same order.
    pub frames: Vec<Frame>,
    /// Every route's waypoints, one route after the other.
    pub waypoints: Vec<WaypointRow>,
    /// What is observed at each of them, in the same order.
    pub previews: Vec<PreviewRow>,
    /// Other vehicles.
    pub traffic: Option<Traffic>,
    /// Every route, in the order of `route_names`.
    pub routes: Vec<RouteRow>,
    /// `20m/N-left-3` and the like.
    pub route_names: Vec<String>,
    /// Steps after which an episode is timed out, in the next one, `[n_routes, n_classes]`.
    pub step_limits: Vec<u32>,
}

/// Why there is no world.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// No truck could be stepped in the scenario.
    #[error(transparent)]
    Invalid(#[from] Invalid),
    /// The caller stopped the baking, see [`Loading::stop`].
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl World {
    /// Computes everything that does not change while trucks drive.
    ///
    /// Fails on a scenario that was changed after it was read so that no truck could be stepped.
    pub fn bake(scenario: &Scenario) -> Result<World, Invalid> {
        World::bake_with(scenario, &Loading::PLAIN).map_err(|error| match error {
            Error::Invalid(invalid) => invalid,
            Error::Stopped(_) => unreachable!("nobody stops a plain loading"),
        })
    }

    /// Bakes a world with fields from a cache and a watcher who is told of each roundabout. All cores work at it.
    ///
    /// # Errors
    ///
    /// The errors of [`World::bake`], and [`Error::Stopped`].
    pub fn bake_with(scenario: &Scenario, loading: &Loading) -> Result<World, Error> {
        scenario.check()?;
        let substep = (scenario.step / f64::from(scenario.n_substeps)) as f32;
        let (rigs, rays) = rigs(scenario, substep);
        let actions = scenario.actions();
        let mut waypoints = Vec::new();
        let mut previews = Vec::new();
        let mut routes = Vec::new();
        let mut route_names = Vec::new();
        for (roundabout, route) in scenario.routes() {
            routes.push(RouteRow {
                first: waypoints.len() as u32,
                n_waypoints: route.waypoints.len() as u32,
                roundabout: roundabout as u32,
                crossing_left: route.crossing.0 as f32,
                crossing_right: route.crossing.1 as f32,
            });
            route_names.push(route.name.clone());
            waypoints.extend(route.waypoints.iter().map(waypoint_row));
            previews.extend((0..route.waypoints.len()).map(|index| preview_row(&route.waypoints, index)));
        }
        let classes = scenario.classes();
        let [slowest, fastest] = scenario.speed_range();
        let [start_least, start_most] = scenario.start_speed.unwrap_or([scenario.cruising_speed(); 2]);
        let step_limits = step_limits(scenario, substep, &waypoints, &routes, loading)?;
        let (fields, trailer_fields) = fields(scenario, loading)?;
        Ok(World {
            params: Params {
                substep,
                n_substeps: scenario.n_substeps,
                n_actions: if scenario.action_kind == ActionKind::Continuous { 0 } else { actions.len() as u32 },
                n_vehicles: rigs.len() as u32,
                sensor_range: scenario.sensor_range as f32,
                start_offset: scenario.start_offset as f32,
                start_heading: scenario.start_heading as f32,
                start_speed: (0.5 * (start_least + start_most)) as f32,
                start_speed_range: (0.5 * (start_most - start_least)) as f32,
                start_along: scenario.start_along as f32,
                target_speed_min: slowest as f32,
                target_speed_max: fastest as f32,
                changes_speed: u32::from(!scenario.speed_changes.is_empty()),
                n_classes: classes.len() as u32,
                n_extras: scenario.extras.n_extras() as u32,
                stray_distance: scenario.stray_distance as f32,
                jackknife_angle: scenario.jackknife_angle as f32,
                rollover_ratio: scenario.rollover_ratio as f32,
            },
            reward: (&scenario.reward).into(),
            disturbances: (&scenario.disturbances).into(),
            rigs,
            classes,
            rays,
            actions,
            fields,
            trailer_fields,
            frames: scenario.places.iter().map(|place| place.roundabout.ground().frame()).collect(),
            waypoints,
            previews,
            traffic: Traffic::baked(scenario, loading)?,
            routes,
            route_names,
            step_limits,
        })
    }

    /// Memory that its tables take, whatever the number of trucks (bytes).
    pub fn bytes(&self) -> usize {
        let routes = size_of_val(self.waypoints.as_slice())
            + size_of_val(self.previews.as_slice())
            + size_of_val(self.routes.as_slice());
        let routes = routes + size_of_val(self.step_limits.as_slice());
        let vehicles = size_of_val(self.rigs.as_slice()) + size_of_val(self.rays.as_slice());
        let shared = size_of_val(&self.params) + size_of_val(&self.reward) + size_of_val(&self.disturbances);
        let shared = shared + size_of_val(self.actions.as_slice());
        let traffic = self.traffic.iter().flat_map(Traffic::words).map(|words| size_of_val(words.as_slice()));
        self.all_fields().map(Field::bytes).sum::<usize>() + routes + vehicles + shared + traffic.sum::<usize>()
    }

    /// Whether an action is a command, and no index into the action table: the table then has two entries, what
    /// commands of -1 and of 1 ask for.
    #[inline]
    pub fn is_continuous(&self) -> bool {
        self.params.n_actions == 0
    }

    /// Values of a command that count: the steer angle, and the speed where there are several. 0 where actions are
    /// indices.
    pub fn n_commands(&self) -> usize {
        if self.is_continuous() { 1 + usize::from(self.actions[0].speed != self.actions[1].speed) } else { 0 }
    }

    /// Whether trucks observe other vehicles.
    pub fn observes_vehicles(&self) -> bool {
        self.traffic.as_ref().is_some_and(|traffic| traffic.is_observed)
    }

    /// What a truck's observation consists of.
    pub fn observation_layout(&self) -> ObservationLayout {
        ObservationLayout { n_extras: self.params.n_extras as usize, has_vehicles: self.observes_vehicles() }
    }

    /// The vehicle of a truck of this world.
    #[inline]
    pub fn rig(&self, truck: &Truck) -> &Rig {
        &self.rigs[truck.vehicle as usize]
    }

    /// Steps after which a truck's episode is timed out, in the next one.
    #[inline]
    pub fn step_limit(&self, truck: &Truck) -> u32 {
        self.step_limits[(truck.route * self.params.n_classes + self.rig(truck).class_index) as usize]
    }

    /// Most steps of a truck's episode: those of its limit, and the one that times out or arrives.
    #[inline]
    pub fn most_steps(&self, truck: &Truck) -> usize {
        self.step_limit(truck) as usize + 1
    }

    /// Most steps of any episode.
    pub fn most_steps_of_all(&self) -> usize {
        self.step_limits.iter().copied().max().map_or(0, |limit| limit as usize + 1)
    }

    /// A rig's distance sensors, trailer's first.
    #[inline]
    pub fn rays_of(&self, rig: &Rig) -> &[Ray; N_RAYS] {
        &self.rays[rig.chassis as usize]
    }

    /// The waypoints of a route of this world.
    #[inline]
    pub fn route_waypoints(&self, route: u32) -> &[WaypointRow] {
        let route = &self.routes[route as usize];
        &self.waypoints[route.first as usize..][..route.n_waypoints as usize]
    }

    /// What is observed at each of them.
    #[inline]
    pub fn route_previews(&self, route: u32) -> &[PreviewRow] {
        let route = &self.routes[route as usize];
        &self.previews[route.first as usize..][..route.n_waypoints as usize]
    }

    /// Where the frame that a route is driven in lies in the map that its road is from.
    #[inline]
    pub fn frame(&self, route: u32) -> Frame {
        self.frames[self.routes[route as usize].roundabout as usize]
    }

    /// Duration of a step (s).
    #[inline]
    pub fn step(&self) -> f32 {
        self.params.n_substeps as f32 * self.params.substep
    }

    /// The field that a route runs through: of the kerbs that tractors keep to and distance sensors see.
    #[inline]
    pub fn route_field(&self, route: u32) -> &Field {
        &self.fields[self.routes[route as usize].roundabout as usize]
    }

    /// The fields of what a tractor and a trailer keep to on a route: the same where there is no apron.
    #[inline]
    pub fn unit_fields(&self, route: u32) -> [&Field; 2] {
        let tractor = self.route_field(route);
        let own = self.trailer_fields[self.routes[route as usize].roundabout as usize].as_ref();
        [tractor, own.unwrap_or(tractor)]
    }

    /// Whether a route's roundabout has an apron.
    #[inline]
    pub fn has_apron(&self, route: u32) -> bool {
        self.trailer_fields[self.routes[route as usize].roundabout as usize].is_some()
    }

    /// Every field: one a roundabout, then those of trailers.
    pub fn all_fields(&self) -> impl Iterator<Item = &Field> {
        self.fields.iter().chain(self.trailer_fields.iter().flatten())
    }
}

/// Every vehicle, and the distance sensors of every chassis among them.
fn rigs(scenario: &Scenario, substep: f32) -> (Vec<Rig>, Vec<[Ray; N_RAYS]>) {
    let classes = scenario.classes();
    let mut rays: Vec<[Ray; N_RAYS]> = Vec::new();
    let rig = |entry: Entry| {
        let own = entry.vehicle.rays();
        // Rows of one chassis stand together.
        if rays.last() != Some(&own) {
            rays.push(own);
        }
        let (chassis, class_index) = (rays.len() as u32 - 1, entry.class as u32);
        Rig { chassis, class_index, ..entry.vehicle.rig(&classes[entry.class].load, substep, scenario.steer_max) }
    };
    let rigs = scenario.vehicles().into_iter().map(rig).collect();
    (rigs, rays)
}

/// The field of every roundabout, and that of its trailers where it has an apron.
fn fields(scenario: &Scenario, loading: &Loading) -> Result<(Vec<Field>, Vec<Option<Field>>), Stopped> {
    let done = Mutex::new(0);
    let field = |place: &Place| {
        loading.check()?;
        let kerbs = place.roundabout.unit_kerbs(scenario.gutter);
        let baked = |kerbs: &Outline| match loading.cache {
            Some(cache) => Field::cached(kerbs, scenario.cell, cache),
            None => Field::bake(kerbs, scenario.cell),
        };
        let fields = (baked(&kerbs.tractor), kerbs.behind_aprons().map(baked));
        loading.count("baking roads", &done, scenario.places.len());
        Ok(fields)
    };
    let fields = scenario.places.par_iter().map(field).collect::<Result<Vec<_>, Stopped>>();
    loading.cache.inspect(|cache| cache.prune());
    Ok(fields?.into_iter().unzip())
}

fn waypoint_row(waypoint: &Waypoint) -> WaypointRow {
    WaypointRow { position: waypoint.position.as_vec2(), direction: Vec2::from_angle(waypoint.heading as f32) }
}

/// What is observed of the route around a waypoint. Beyond either end of the route the end waypoint repeats.
fn preview_row(waypoints: &[Waypoint], index: usize) -> PreviewRow {
    let at = |ahead: usize| waypoints[(index + ahead).min(waypoints.len() - 1)].position;
    let back = |behind: usize| waypoints[index.saturating_sub(behind)].position;
    let mut values = [0.0; N_PREVIEW];
    for (n, steps) in CURVATURE_STEPS.into_iter().enumerate() {
        values[n] = (corner(at(0), at(steps), at(2 * steps)) / PI) as f32;
        values[4 + n] = (corner(back(steps), at(0), at(steps)) / PI) as f32;
    }
    for (n, value) in values[8..].iter_mut().enumerate() {
        let [from, middle, to] = [n, n + 1, n + 2].map(|chord| at(CHORD * chord));
        *value = (turning_radius(from, middle, to) / RADIUS_SCALE).min(1.0) as f32;
    }
    PreviewRow { heading: waypoints[index].heading as f32, values }
}

/// Angle at `corner` between `from` and `to`: pi when the three lie in line, and when two of them coincide (rad).
fn corner(from: DVec2, corner: DVec2, to: DVec2) -> f64 {
    let (back, ahead) = (from - corner, to - corner);
    if back == DVec2::ZERO || ahead == DVec2::ZERO { PI } else { back.angle_to(ahead).abs() }
}

/// Distance from `middle` to the intersection of the bisectors of the two chords that join there; infinite when they
/// are parallel (m).
fn turning_radius(from: DVec2, middle: DVec2, to: DVec2) -> f64 {
    let (first, second) = (middle - from, to - middle);
    // Radius of the circle through three points: the product of the sides over four times the area.
    let area = 0.5 * first.perp_dot(second).abs();
    let sides = first.length() * second.length() * (to - from).length();
    if area < 1e-9 { f64::INFINITY } else { sides / (4.0 * area) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_points_of_a_circle_give_its_radius() {
        let at = |angle: f64| 17.0 * DVec2::from_angle(angle);
        assert!((turning_radius(at(0.1), at(0.5), at(1.0)) - 17.0).abs() < 1e-9);
        assert_eq!(turning_radius(DVec2::ZERO, DVec2::X, 2.0 * DVec2::X), f64::INFINITY);
    }

    #[test]
    fn a_corner_of_a_square_is_a_right_angle_and_a_straight_line_is_pi() {
        assert!((corner(DVec2::X, DVec2::ZERO, DVec2::Y) - PI / 2.0).abs() < 1e-12);
        assert!((corner(-DVec2::X, DVec2::ZERO, DVec2::X) - PI).abs() < 1e-12);
        assert_eq!(corner(DVec2::X, DVec2::X, DVec2::Y), PI);
    }
}
