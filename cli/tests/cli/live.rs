//! The page of `offtrack web` in a browser: its shaders compile there, and its trucks drive as those of the CPU engine.

#[path = "../../../tests/simulator/parity/compare.rs"]
mod compare;
mod devtools;
mod hand;
mod learned;
#[path = "../../../tests/simulator/left_hand/text.rs"]
mod left_hand;
mod page;
mod policies;
mod roads;
mod runs;
mod served;
mod stages;
mod starts;
#[path = "../../../tests/simulator/parity/states.rs"]
#[expect(dead_code, reason = "the simulator's own tests look at more of the states")]
mod states;
mod vehicles;
mod visitor;

use offtrack::scenario::Scenario;
use offtrack::world::World;

/// A benchmark, read and baked.
pub fn benchmark(name: &str) -> (Scenario, World) {
    let scenario = Scenario::named(name).unwrap();
    let world = World::bake(&scenario).unwrap();
    (scenario, world)
}

/// Trucks of several kinds and loads.
pub mod fleet {
    use offtrack::scenario::{Fleet, Scenario};

    /// A fleet of 512 vehicles whose dimensions are drawn.
    pub fn all_drawn() -> Fleet {
        let fleet = Scenario::named("laden2026").unwrap().fleet.unwrap();
        Fleet { n_vehicles: 512, ..fleet }
    }
}
