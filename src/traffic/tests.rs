//! The model's acceptance: nobody overlaps or stands for ever, platoons follow the closed form, orders change nothing,
//! and entries have the capacities of the Highway Capacity Manual.

mod capacity;
mod large;
mod orders;
mod platoon;
mod roads;
mod safety;

use std::path::Path;

use super::{Demand, Mix, Network};
use crate::map::Road;

/// A shipped map's road.
fn map(name: &str) -> Road {
    let maps = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/maps");
    Road::read(&maps.join(name).with_extension("outline.toml")).unwrap()
}

fn baked(name: &str) -> Network {
    Network::bake(&Road::named(name).unwrap()).unwrap()
}

fn even(network: &Network, total: f64) -> Demand {
    Demand::new(network, &Demand::even(network, total), Mix { vans: 0.25, rude: 0.1, ..Mix::default() }).unwrap()
}
