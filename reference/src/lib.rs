//! The simulator against data of others: published trajectories and measured roundabouts.
//!
//! Tests and the command line use it; the simulator itself needs none of it.

pub mod deviation; // a roundabout against measured lines
pub mod trace; // one truck, open loop, against reference trajectories

/// Maximum size of a file of cases or of measured lines: ten times the largest that comes with the project (bytes).
pub const FILE_LIMIT: u64 = 1 << 20;
