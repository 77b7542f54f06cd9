//! Which routes of a benchmark can be completed: action sequences are searched for, written to a file, and driven again
//! when it is read.

pub mod attempt; // searches from one start until one arrives, and from many at once
pub mod avoidance; // a search from before a contact with another vehicle
pub mod beam; // a search
pub mod file; // what it found
pub mod line; // the paths that it drove, as lines to follow
mod pending; // what a truck that answers late was asked for
pub mod verify; // driving it again

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use offtrack::layout::Disturbances;
use offtrack::scenario::Scenario;
use offtrack::world::World;

use crate::error::Error;
use file::Certificate;
use verify::Sequence;

/// An error for a world that no search from a start can drive in: one with other vehicles or with continuous actions.
pub fn check_levels(world: &World) -> Result<(), Error> {
    if world.traffic.is_some() {
        let expected = "a search drives on an empty road: the same benchmark without that table is needed; `evaluate \
                        --avoidable` searches from before each contact"
            .to_owned();
        return Err(Error::Setting { name: "[traffic]", value: "vehicles around each truck".to_owned(), expected });
    }
    check_table(world)?;
    check_delay(world)
}

/// An error for a world in which actions come late by a number of steps that differs between trucks: what one candidate
/// did would not do for another.
pub fn check_delay(world: &World) -> Result<(), Error> {
    let Disturbances { action_delay, n_action_delays, .. } = world.disturbances;
    if n_action_delays == 1 {
        return Ok(());
    }
    let expected = "a search needs actions that come equally late everywhere: the same benchmark with one number twice";
    let value = format!("[{action_delay}, {}]", action_delay + n_action_delays - 1);
    Err(Error::Setting { name: "disturbances.action_delay", value, expected: expected.to_owned() })
}

/// An error for a world whose actions are continuous: a search tries every action of a table.
pub fn check_table(world: &World) -> Result<(), Error> {
    if world.is_continuous() { Err(needs_levels()) } else { Ok(()) }
}

/// The error for a world whose actions are continuous.
pub(crate) fn needs_levels() -> Error {
    let expected = "a search tries levels: the same benchmark with actions.steer_levels is needed".to_owned();
    Error::Setting { name: "actions.kind", value: "continuous".to_owned(), expected }
}

/// The world without its other vehicles: certificates are of empty roads.
pub(crate) fn emptied(world: &Arc<World>) -> Arc<World> {
    if world.traffic.is_none() {
        return world.clone();
    }
    let mut emptied = World::clone(world);
    emptied.traffic = None;
    Arc::new(emptied)
}

/// The certified ones among `routes`, as indices of the world: those completed from every start. Their sequences are
/// driven again first.
pub fn certified(path: &Path, scenario: &Scenario, world: &Arc<World>, routes: &[u32]) -> Result<Vec<u32>, Error> {
    let (certificate, _) = verified(path, scenario, world, routes)?;
    let names: HashSet<&str> = certificate
        .routes
        .iter()
        .filter(|searched| searched.certified())
        .map(|searched| searched.name.as_str())
        .collect();
    Ok(routes.iter().copied().filter(|&route| names.contains(world.route_names[route as usize].as_str())).collect())
}

/// A certificate that was made for these conditions and has all of `routes`, and the sequences that completed them,
/// driven again.
fn verified(
    path: &Path,
    scenario: &Scenario,
    world: &Arc<World>,
    routes: &[u32],
) -> Result<(Certificate, Vec<Sequence>), Error> {
    check_delay(world)?;
    let certificate = Certificate::read(path)?;
    certificate.check(scenario, world, path)?;
    let names: HashSet<&str> = routes.iter().map(|&route| world.route_names[route as usize].as_str()).collect();
    let sequences = verify::verify(&certificate, &emptied(world), path, |name| names.contains(name))?;
    let searched: HashSet<&str> = certificate.routes.iter().map(|route| route.name.as_str()).collect();
    if let Some(&route) = routes.iter().find(|&&route| !searched.contains(world.route_names[route as usize].as_str())) {
        let (name, benchmark) = (&world.route_names[route as usize], &scenario.name);
        let message = format!(
            "has no route {name} of {benchmark}; make one with `offtrack certify --benchmark BENCHMARK --json FILE`"
        );
        return Err(Error::contents(path, message));
    }
    Ok((certificate, sequences))
}

#[cfg(test)]
mod tests {
    use offtrack::layout::{Start, Truck};

    use super::attempt::{attempt, passes};
    use super::file::CertifiedRoute;
    use super::*;

    #[test]
    fn a_sequence_that_arrives_in_the_step_after_the_limit_is_verified() {
        let mut scenario = Scenario::named("attard2023").unwrap();
        scenario.retain(|_, route| route.name == "20m/E-right-1");
        let world = World::bake(&scenario).unwrap();
        let passes = passes(&[16], 2).unwrap();
        let certified = |world: &Arc<World>| attempt(world, 0, &Start::default(), &passes, None).unwrap();
        let found = certified(&Arc::new(world.clone()));
        assert!(found.arrived() && found.steps < world.step_limit(&Truck::default()));
        let mut shorter = world;
        shorter.step_limits.fill(found.steps - 1);
        let shorter = Arc::new(shorter);
        let mut certificate = Certificate::new(&scenario, &shorter, "all", None, passes, &[Start::default()]);
        certificate.routes = vec![CertifiedRoute { name: shorter.route_names[0].clone(), found: vec![found] }];
        let sequences = verify::verify(&certificate, &shorter, Path::new("its file"), |_| true).unwrap();
        assert_eq!(sequences[0].actions.len() as u32, shorter.step_limits[0] + 1);
    }

    #[test]
    fn a_search_is_refused_where_trucks_answer_by_different_delays() {
        let mut scenario = Scenario::named("attard2023").unwrap();
        scenario.retain(|_, route| route.name == "20m/E-right-1");
        let mut delayed = |least: u32, greatest: u32| {
            scenario.disturbances.action_delay = [least, greatest];
            World::bake(&scenario).unwrap()
        };
        check_levels(&delayed(2, 2)).unwrap();
        let error = check_levels(&delayed(0, 3)).unwrap_err().to_string();
        assert!(error.starts_with("disturbances.action_delay: [0, 3]; "), "{error}");
        assert!(check_delay(&delayed(1, 2)).is_err());
    }
}
