//! A board of policies: each entry is a file with what its policy came to, and is simulated again to the last bit, so
//! that nobody has to be believed.

mod entry;
mod table;

pub use entry::{Claim, Drive, Entry, Training};
pub use table::{Board, Row, Stretch};
