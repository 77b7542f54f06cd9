//! Which routes of a benchmark can be completed: action sequences are searched for, written to a file, and driven again
//! when it is read.

pub mod attempt; // searches from one start until one arrives, and from many at once
pub mod beam; // a search
pub mod file; // what it found
pub mod line; // the paths that it drove, as lines to follow
pub mod verify; // driving it again

use std::path::Path;
use std::sync::Arc;

use offtrack::scenario::Scenario;
use offtrack::world::World;

use crate::error::Error;
use file::Certificate;

/// The certified ones among `routes`, as indices of the world: those completed from every start. Their sequences are
/// driven again first.
pub fn certified(path: &Path, scenario: &Scenario, world: &Arc<World>, routes: &[u32]) -> Result<Vec<u32>, Error> {
    let certificate = Certificate::read(path)?;
    certificate.check(scenario, world, path)?;
    let names: Vec<&str> = routes.iter().map(|&route| world.route_names[route as usize].as_str()).collect();
    verify::verify(&certificate, world, path, |name| names.contains(&name))?;
    let mut certified = Vec::new();
    for (&route, name) in routes.iter().zip(names) {
        let searched = certificate.routes.iter().find(|searched| searched.name == name);
        let message = || format!("has no route {name}; make one with `offtrack certify --benchmark {} --json FILE`", scenario.name);
        if searched.ok_or_else(|| Error::Contents { file: path.to_owned(), message: message() })?.certified() {
            certified.push(route);
        }
    }
    Ok(certified)
}
