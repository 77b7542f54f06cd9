//! What a caller asks of a batch, checked before it is touched: stages use indices and numbers without a check.

use crate::engine::{Error, RouteChoice};
use crate::layout::Start;
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
    Ok(())
}

/// An error if the start lies beyond the benchmark's largest errors or not on the route, or its vehicle is not in the
/// world.
pub(super) fn check_start(world: &World, env: usize, start: &Start) -> Result<(), Error> {
    let n_vehicles = world.rigs.len();
    if n_vehicles <= start.vehicle as usize {
        return Err(Error::UnknownVehicle { vehicle: start.vehicle, n_vehicles });
    }
    let outside =
        [start.offset, start.heading, start.speed].into_iter().find(|fraction| !(-1.0..=1.0).contains(fraction));
    if let Some(fraction) = outside {
        return Err(Error::UnknownStart { env, fraction: fraction.to_string() });
    }
    if !(0.0..=1.0).contains(&start.along) {
        return Err(Error::BeyondRoute { env, fraction: start.along.to_string() });
    }
    Ok(())
}

/// An error if the world does not have one of the routes.
pub(super) fn check_known(world: &World, routes: &[u32]) -> Result<(), Error> {
    let n_routes = world.routes.len();
    let unknown = routes.iter().find(|&&route| n_routes <= route as usize);
    unknown.map_or(Ok(()), |&route| Err(Error::UnknownRoute { route, n_routes }))
}
