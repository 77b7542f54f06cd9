//! Whether a truck fits through a road: along its lane's centre line, and by some way that a search finds.
//!
//! The same tools as everywhere: the [path that the front axle's line asks for](offtrack::vehicle::swept), and the
//! search of [certificates](crate::certificate). Here they answer a road designer: clearance, swept width, steering.

pub mod case; // one vehicle on one road
pub mod results; // the file, which a later call continues
mod search; // the way of a route
pub mod row; // the figures of a route and a vehicle
pub mod table; // rows as text and as CSV
pub mod way; // the figures of a path

pub use case::Case;
pub use results::{Asked, Results};
pub use row::Row;
pub use way::{Path, Way};
