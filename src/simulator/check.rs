//! What a caller asks of a batch, checked before it is touched: stages use indices and numbers without a check.

use std::collections::BTreeMap;

use crate::engine::group::{begins_in, exceed_arms, n_lanes};
use crate::engine::{Error, RouteChoice};
use crate::layout::{BEGINS, BeginRow, HAS_ROUTE, IS_CENTRED, IS_FIRST, Start};
use crate::world::World;

/// An error if the routes do not fit the world or the number of trucks.
pub(super) fn check_routes(world: &World, n_envs: usize, choice: &RouteChoice) -> Result<(), Error> {
    let routes = choice.routes();
    if n_envs == 0 {
        return Err(Error::EmptyBatch);
    }
    if routes.is_empty() {
        return Err(Error::NoRoutes);
    }
    check_known(world, routes)?;
    if matches!(choice, RouteChoice::Fixed(_)) && routes.len() != n_envs {
        return Err(Error::RouteCount { n_routes: routes.len(), n_envs });
    }
    let group = world.group();
    if !n_envs.is_multiple_of(group) {
        return Err(Error::SplitGroup { n_envs, group });
    }
    match choice {
        RouteChoice::Drawn(routes) => check_drawn(world, routes),
        RouteChoice::Fixed(routes) => {
            let first_trucks = (0..).step_by(group);
            routes.chunks(group).zip(first_trucks).try_for_each(|(routes, env)| check_group(world, env, routes))
        }
    }
}

/// An error if a road of routes that groups draw from has fewer lanes to begin in than they have trucks.
pub(super) fn check_drawn(world: &World, routes: &[u32]) -> Result<(), Error> {
    let group = world.group();
    if group == 1 {
        return Ok(());
    }
    let mut on_roads: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &route in routes {
        on_roads.entry(world.routes[route as usize].roundabout).or_default().push(route);
    }
    for routes in on_roads.into_values() {
        let name = road_name(world, routes[0]);
        let n_lanes = n_lanes(world, routes);
        if n_lanes < group {
            return Err(Error::NarrowGroup { road: name.to_owned(), n_lanes, group });
        }
    }
    Ok(())
}

/// An error if the routes of a group's trucks, the first of which is `env`, are not on one road or begin in one lane.
pub(super) fn check_group(world: &World, env: usize, routes: &[u32]) -> Result<(), Error> {
    let road = |route: u32| world.routes[route as usize].roundabout;
    if let Some(other) = routes.iter().position(|&route| road(route) != road(routes[0])) {
        let roads = [routes[0], routes[other]].map(|route| road_name(world, route).to_owned());
        return Err(Error::SplitRoads { first: env, other: env + other, roads });
    }
    for (other, &route) in routes.iter().enumerate() {
        let lane = begins_in(world, route);
        if let Some(first) = routes[..other].iter().position(|&before| begins_in(world, before) == lane) {
            return Err(Error::SharedLane { first: env + first, other: env + other });
        }
    }
    Ok(())
}

/// The name of a route's road.
fn road_name(world: &World, route: u32) -> &str {
    world.route_names[route as usize].rsplit_once('/').map_or("the road", |(road, _)| road)
}

/// An error if some trucks of a group begin an episode and others do not, or on routes that do not go together.
pub(super) fn check_begins(world: &World, begins: &[BeginRow]) -> Result<(), Error> {
    let group = world.group();
    if group == 1 {
        return Ok(());
    }
    for (index, begins) in begins.chunks(group).enumerate() {
        let env = index * group;
        let all_or_none = |bit: u32| begins.iter().all(|begin| (begin.what ^ begins[0].what) & bit == 0);
        // Episodes are counted alike, since vehicles are drawn by them.
        if ![BEGINS, HAS_ROUTE, IS_FIRST].into_iter().all(all_or_none) {
            return Err(Error::PartOfGroup { env, group });
        }
        if begins[0].what & HAS_ROUTE != 0 {
            check_group(world, env, &begins.iter().map(|begin| begin.route).collect::<Vec<u32>>())?;
        }
    }
    Ok(())
}

/// Has trucks of a group that are to begin on one arm begin on their lanes' centres: off them they may stand in each
/// other.
pub(super) fn centre_beside(world: &World, begins: &mut [BeginRow]) {
    let group = world.group();
    for begins in begins.chunks_mut(group).filter(|begins| 1 < group && begins[0].what & HAS_ROUTE != 0) {
        if exceed_arms(world, group, begins.iter().map(|begin| begin.route)) {
            begins.iter_mut().for_each(|begin| begin.what |= IS_CENTRED);
        }
    }
}

/// An error where trucks share roads.
pub(super) fn check_alone(world: &World, what: &'static str) -> Result<(), Error> {
    let group = world.group();
    if group == 1 { Ok(()) } else { Err(Error::NotInGroups { what, group }) }
}

/// An error if the start lies beyond the benchmark's largest errors or not on the route, or its vehicle is not in the
/// world.
pub(super) fn check_start(world: &World, env: usize, start: &Start) -> Result<(), Error> {
    let n_vehicles = world.rigs.len();
    if n_vehicles <= start.vehicle as usize {
        return Err(Error::UnknownVehicle { vehicle: start.vehicle, n_vehicles });
    }
    let parts = [("offset", start.offset), ("heading", start.heading), ("speed", start.speed)];
    if let Some((part, fraction)) = parts.into_iter().find(|(_, fraction)| !(-1.0..=1.0).contains(fraction)) {
        return Err(Error::UnknownStart { env, part, fraction: fraction.to_string() });
    }
    if !(0.0..=1.0).contains(&start.along) {
        return Err(Error::BeyondRoute { env, fraction: start.along.to_string() });
    }
    if start.along != 0.0 {
        // Trucks of a group would stand in each other.
        check_alone(world, "starts.along")?;
    }
    Ok(())
}

/// An error if the world does not have one of the routes.
pub(super) fn check_known(world: &World, routes: &[u32]) -> Result<(), Error> {
    let n_routes = world.routes.len();
    let unknown = routes.iter().find(|&&route| n_routes <= route as usize);
    unknown.map_or(Ok(()), |&route| Err(Error::UnknownRoute { route, n_routes }))
}
