//! The program from outside, as its users run it.

#![expect(clippy::unwrap_used, reason = "what a helper of a test cannot do fails the test")]

mod bench;
mod certify;
mod device;
mod draw;
mod evaluate;
mod input;
mod interruption;
mod page;
mod place;
mod record;
mod resume;
mod train;
