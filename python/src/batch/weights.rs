//! Weights of routes: how often each is drawn.

use offtrack::map::route::is_of;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::worlds::Place;

/// Least entries of a table of routes: weights count to one in so many.
const ENTRIES: usize = 4096;

/// A table in which each of a place's routes stands as often as its weight says, the place's order kept. A route has
/// the weight of its own name, else that of its road, else 1; the table is as long for any weights.
pub(super) fn table(place: &Place, weights: &[(String, f64)]) -> PyResult<Vec<u32>> {
    let weights: Vec<_> = weights.iter().map(|(name, weight)| (place.name_here(name), *weight)).collect();
    let names: Vec<&str> = place.routes.iter().map(|&route| place.world.route_names[route as usize].as_str()).collect();
    for (name, weight) in &weights {
        if !(weight.is_finite() && 0.0 <= *weight && *weight <= 1e6) {
            return Err(PyValueError::new_err(format!("weights[{name:?}]: {weight}; must lie in 0..1e6")));
        }
        if !names.iter().any(|route| is_of(route, name)) {
            let list = offtrack::files::reader::shortened(&names.join(", "), 600);
            return Err(PyValueError::new_err(format!("weights: {name:?}; the batch draws from {list}")));
        }
    }
    let weight = |route: &&str| {
        let own = weights.iter().find(|(name, _)| name == route);
        own.or_else(|| weights.iter().find(|(name, _)| is_of(route, name))).map_or(1.0, |(_, weight)| *weight)
    };
    let shares: Vec<f64> = names.iter().map(weight).collect();
    let sum: f64 = shares.iter().sum();
    if sum <= 0.0 {
        return Err(PyValueError::new_err("weights: 0 for every route; one must be greater"));
    }
    let mut entries = entries(&shares, sum);
    // A route with a weight too small for an entry has one of those of the route that has most.
    for route in 0..shares.len() {
        if entries[route] == 0 && 0.0 < shares[route] {
            let most = (0..entries.len()).max_by_key(|&other| entries[other]).unwrap_or(route);
            entries[most] -= 1;
            entries[route] = 1;
        }
    }
    let mut table: Vec<u32> =
        place.routes.iter().zip(entries).flat_map(|(&route, n)| std::iter::repeat_n(route, n)).collect();
    table.sort_unstable();
    Ok(table)
}

/// How many entries of a table fall to each share of the sum.
fn entries(shares: &[f64], sum: f64) -> Vec<usize> {
    let n = ENTRIES.max(4 * shares.len());
    let mut entries = vec![0; shares.len()];
    let (mut index, mut reached) = (0, shares[0]);
    for entry in 0..n {
        let place_in_sum = (entry as f64 + 0.5) / n as f64 * sum;
        while reached <= place_in_sum && index + 1 < shares.len() {
            index += 1;
            reached += shares[index];
        }
        entries[index] += 1;
    }
    entries
}
