//! Many trucks through many roundabouts at once.
//!
//! A [`scenario::Scenario`] is read from a file and baked into a [`world::World`]. A [`simulator::Simulator`] steps a batch of trucks
//! through it, every step the same [`stages`] in the same order.

pub mod angle; // angles in plain f32
pub mod cpu; // the CPU engine
pub mod field; // the signed distance to the kerbs, baked
pub mod geometry; // arcs, segments, outlines; exact distances
#[cfg(feature = "gpu")]
pub mod gpu; // the engine of compute shaders
pub mod layout; // rows and constants that engines share
pub mod random; // numbers from (seed, env, episode, draw)
pub mod reader; // files: errors with file, key, value and what would do
pub mod roundabout; // parameters -> kerbs and lanes
pub mod route; // lane centre lines -> waypoints
pub mod scenario; // what to drive
pub mod shipped; // the scenario files that come with the library
pub mod simulator; // many trucks, many steps
pub mod stages; // one step, in order
pub mod swept; // the path of a truck that never leaves its line
pub mod vehicle; // tractor, trailer, load
pub mod world; // what trucks share, baked

/// The README's example, compiled and run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
