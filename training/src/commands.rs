//! The commands, one file each.

pub mod bench;
pub mod certify;
pub mod deviations;
pub mod devices;
pub mod draw;
pub mod evaluate;
pub mod record;
pub mod scale;
pub mod trace;
pub mod train;
