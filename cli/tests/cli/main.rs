//! The command line, run as its users run it.

#![expect(clippy::unwrap_used, reason = "a failure of a test's helper fails the test")]

mod bench;
mod benchmark;
mod board;
#[cfg(feature = "browser")]
mod browser;
mod budget;
mod certify;
mod checkpoint;
mod compare;
mod continuous;
mod device;
mod documented_flags;
mod draw;
mod evaluate;
mod export;
mod fits;
mod flags;
mod generate;
mod import;
mod input;
mod interruption;
#[cfg(feature = "browser")]
mod live;
mod lost;
mod memory;
mod output;
mod page;
mod pictures;
mod place;
mod record;
mod resume;
mod seeds;
mod tensorboard;
mod threads;
mod train;
mod unwritten;
mod web;

// The states of the simulator's tests look for them here.
#[cfg(feature = "browser")]
use live::{benchmark, fleet};
