//! Many trucks through many roundabouts at once.
//!
//! A [`scenario::Scenario`] is read from a file and baked into a [`world::World`]. A [`simulator::Simulator`] steps a
//! batch of trucks through it on the CPU or on a GPU, every step the same [stages](engine::stages) in the same order.

// In reading order: a module uses only those above it.
pub mod files; // what is read: errors with file, key and value; the cache; shipped files
pub mod layout; // rows, constants, columns and buffers; what Rust and WGSL share
pub mod geometry; // arcs, segments, outlines; exact distances
pub mod map; // roads: routes on a ring with arms, from parameters, maps or at random
pub mod traffic; // cars: their paths, where these meet, who goes first
pub mod field; // the signed distance to the kerbs, baked
pub mod vehicle; // tractor, trailer, load; how fast and over which ground they can drive
pub mod scenario; // what to drive
pub mod world; // what trucks share, baked
pub mod engine; // one step in order, on the two engines
pub mod simulator; // many trucks, many steps, on either engine
pub mod observer; // a truck that something else drives

// Types of wgpu are public in `gpu`: a caller needs this very version.
#[cfg(feature = "gpu")]
pub use {engine::gpu, wgpu};

/// What a program that steps trucks names: `use offtrack::prelude::*`.
pub mod prelude {
    pub use crate::layout::{Command, Ended, Start, Stream};
    pub use crate::scenario::{Scenario, Split};
    pub use crate::simulator::{Actions, Autoreset, Begin, Engine, RouteChoice, Simulator};
    pub use crate::world::World;
}

/// The formulas of a step, each for one truck, as the CPU engine computes them.
pub mod physics {
    pub use crate::engine::cpu::collide::clearance;
    pub use crate::engine::cpu::draw::{drawn as drawn_action, drawn_command};
    pub use crate::engine::cpu::drive::{Motion, Moving, drive_max, driven, load_transfer_ratio, motion_of, moved};
    pub use crate::engine::cpu::follow::{distance_to_segment, reference_point};
    pub use crate::engine::cpu::judge::{closeness, depth_on_apron, rewarded};
    pub use crate::engine::cpu::observe::{SPEED_SCALE, observed};
    pub use crate::engine::cpu::reset::drawn_start;
    pub use crate::engine::cpu::sense::ranges;
    pub use crate::engine::cpu::steer::{commanded, controlled};
    pub use crate::engine::cpu::traffic::seen_by_vehicles;
}
