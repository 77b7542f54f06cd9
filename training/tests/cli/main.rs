//! The program from outside, as its users run it.

mod draw;
mod train;
