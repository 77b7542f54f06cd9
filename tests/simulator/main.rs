//! The simulator from outside, as one test binary.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails as the test itself does")]

use std::path::Path;

use offtrack::scenario::Scenario;
use offtrack::world::World;

mod bad_input;
mod collide;
#[cfg(feature = "gpu")]
mod device;
mod episodes;
mod field;
mod fit;
mod observe;
mod physics;
mod sense;
mod shaders;

/// A benchmark of the repository, read and baked.
fn benchmark(name: &str) -> (Scenario, World) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios").join(name).with_extension("toml");
    let scenario = Scenario::read(&path).unwrap();
    let world = World::bake(&scenario);
    (scenario, world)
}
