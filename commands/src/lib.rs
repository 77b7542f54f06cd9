//! The commands of `offtrack` that need no learner, one file each, and what several of them share. The program adds
//! those that train and measure; the Python package has these alone.

pub mod board;
pub mod certify;
pub mod compare;
pub mod deviations;
pub mod devices;
pub mod draw;
pub mod evaluate;
pub mod export;
pub mod fits;
pub mod generate;
pub mod import;
mod once; // flags: each time another value
pub mod outputs; // files to write: each its own
pub mod plot; // pictures by the names of their files
mod policies; // flags: which policy
pub mod program; // arguments read, a command run, its exit code
pub mod progress; // the bar on a terminal
pub mod record;
pub mod roads; // benchmarks and roads by name
pub mod signals; // Ctrl-C and others
pub mod terminal; // how wide a table may be
pub mod trace;
pub mod traffic;
pub mod vehicles;
pub mod web;
