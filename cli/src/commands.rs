//! The commands, one file each, and what several of them share.

pub mod bench;
pub mod board;
pub mod certify;
pub mod compare;
pub mod deviations;
pub mod devices;
pub mod draw;
pub mod evaluate;
pub mod fits;
pub mod generate;
pub mod import;
mod outputs; // files to write: each its own
mod policies; // flags: which policy
mod progress; // the bar on a terminal
pub mod record;
mod roads; // benchmarks and roads by name
pub mod scale;
mod terminal; // how wide a table may be
pub mod trace;
pub mod train;
pub mod vehicles;
