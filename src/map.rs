//! Roads: a ring with its arms, kerbs, lanes and routes, from parameters, from a map, from a drawing, or at random.
//!
//! Each of them gives a [`ground::Ground`], and all that follows knows that alone.

pub mod frame; // where a road lies in its map
pub mod route; // lane centre lines -> waypoints
pub mod ground; // a ring with its arms: kerb faces, lane edges, routes
pub mod opendrive; // maps -> rings
pub mod drawing; // drawings -> rings
mod arm_names; // names of arms, given or found
mod kerbs; // whose they are, and what is free between them
pub mod parametric; // parameters -> kerbs and lanes
mod road; // a name and its ground
mod apron; // strips of islands for trailers alone
pub mod chosen; // which ring of a map
pub mod procedural; // random roundabouts, by seed and index

pub use apron::UnitKerbs;
pub use frame::Frame;
pub use ground::Kerb;
pub use road::{Gutter, Road};
