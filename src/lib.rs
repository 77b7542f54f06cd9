//! Many trucks through many roundabouts at once.
//!
//! A [`scenario::Scenario`] is read from a file and baked into a [`world::World`]. A [`simulator::Simulator`] steps a
//! batch of trucks through it on the CPU or on a GPU, every step the same [`stages`] in the same order.

// In reading order: a module uses only those above it.
pub mod reader; // files: errors with file, key, value and what would do
pub mod writer; // files written whole or not at all
pub mod loading; // results kept for the next time, and progress
pub mod shipped; // the scenario files that come with the library
pub mod shared; // macros for what Rust and WGSL share
pub mod angle; // angles in plain f32
pub mod random; // numbers from (seed, env, episode, draw)
pub mod layout; // rows, constants, columns and buffers
pub mod geometry; // arcs, segments, outlines; exact distances
pub mod route; // lane centre lines -> waypoints
pub mod ground; // a ring with its arms: kerb faces, lane edges, routes
pub mod opendrive; // maps -> rings
pub mod roundabout; // parameters -> kerbs and lanes
pub mod procedural; // random roundabouts, by seed and index
pub mod field; // the signed distance to the kerbs, baked
pub mod vehicle; // tractor, trailer, load
pub mod profile; // how fast a vehicle can drive a route
pub mod scenario; // what to drive
pub mod world; // what trucks share, baked
pub mod stages; // one step, in order
pub mod engine; // the two engines
pub mod wgsl; // what shaders share with Rust, printed
pub mod simulator; // many trucks, many steps, on either engine
pub mod swept; // the path of a truck that never leaves its line

pub use engine::cpu;
#[cfg(feature = "gpu")]
pub use engine::gpu;
