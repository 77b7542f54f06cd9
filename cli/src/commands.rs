//! The commands that learn, or that measure learning, a file each; the others are the crate `offtrack-commands`.

pub mod bench;
pub mod scale;
pub mod train;
