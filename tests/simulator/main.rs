//! The simulator from outside, as one test binary.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails as the test itself does")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use offtrack::scenario::Scenario;
use offtrack::simulator::{Engine, RouteChoice, Simulator};
use offtrack::world::World;

mod along;
mod apron;
mod autoreset;
mod bad_input;
mod collide;
mod continuous;
mod disturbances;
mod documented_keys;
mod episodes;
mod extras;
mod field;
mod fit;
mod fleet;
mod groups;
mod kinds;
mod left_hand;
#[cfg(all(feature = "gpu", target_os = "linux"))]
mod machine_code;
mod map_bypass;
mod map_drawing;
mod map_export;
mod map_gaps;
mod map_junctions;
mod map_kinds;
mod map_lanes;
mod map_objects;
mod map_records;
mod maps;
mod modules;
mod observe;
mod observer;
#[cfg(feature = "gpu")]
mod on_device;
#[cfg(feature = "gpu")]
mod parity;
mod physics;
mod pinned;
mod procedural;
mod refused;
mod repository;
mod restarts;
mod sense;
mod shaders;
mod shipped;
mod speeds;
mod states;
mod traffic;

/// The folder of the repository's benchmarks.
fn scenarios() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios")
}

/// A benchmark of the repository, read and baked.
fn benchmark(name: &str) -> (Scenario, World) {
    let path = scenarios().join(name).with_extension("toml");
    let scenario = Scenario::read(&path).unwrap();
    let world = World::bake(&scenario).unwrap();
    (scenario, world)
}

/// Every engine of the build with its name: the tests of a batch run on each of them.
fn engines() -> Vec<(&'static str, Engine)> {
    Vec::from([
        ("CPU", Engine::Cpu),
        #[cfg(feature = "gpu")]
        ("device", on_device::engine()),
    ])
}

/// A batch on an engine.
fn batch_on(engine: &Engine, world: &Arc<World>, n_envs: usize, seed: u32, choice: RouteChoice) -> Simulator {
    Simulator::on(engine.clone(), world.clone(), n_envs, seed, choice).unwrap()
}
