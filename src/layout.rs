//! The rows and constants that both engines share: defined here and nowhere else.
//!
//! Each struct is plain data without padding (vectors first, then scalars), so that a column of them can be copied to a
//! device as it is. SI units and radians throughout; headings lie in (-pi, pi].

pub mod shared; // macros for what Rust and WGSL share
pub mod angle; // angles in plain f32
pub mod random; // numbers from (seed, env, episode, draw)
pub mod buffers;
pub(crate) mod columns;
mod ended;
mod extras;
mod observation;
mod observation_layout;
mod rows; // a truck's rows of the columns
mod tables; // what trucks share
mod truck;
mod vehicles; // what is observed of other vehicles

use crate::layout::shared::{Struct, constants};
pub use columns::{Column, N_COLUMNS};
pub use ended::Ended;
pub(crate) use ended::printed_codes;
pub use extras::{EXTRAS, Extra, ObservedExtras};
pub(crate) use observation::first_of;
pub use observation::{OBSERVATION, Values};
pub use observation_layout::ObservationLayout;
pub use rows::{BeginRow, Clearance, Command, Control, Pose, Progress, RewardTerms, Start, Stream, Truck};
pub use tables::{
    Action, BatchFacts, Body, Disturbances, FieldRow, Lag, Params, PreviewRow, Ray, Reward, Rig, Roll, RouteRow,
    VehicleRow, WaypointRow,
};
pub use vehicles::VEHICLE_VALUES;
pub(crate) use vehicles::first_of_vehicles;

/// Most trucks that share a road and its vehicles.
pub const MOST_IN_GROUP: usize = 8;

constants! {
    /// Trucks of a workgroup, and its threads where none are said.
    pub const WORKGROUP: u32 = 64;
    /// Threads of a workgroup that writes observations: its memory lets few workgroups in, so each has more threads.
    pub const WRITERS: u32 = 256;
    /// Trucks whose rays a workgroup shares, at most.
    pub const TEAM_MAX: u32 = 32;
    /// Values in an observation.
    pub const N_VALUES: usize = 69;
    /// Distance sensors on the trailer, left and right alternating, front to rear.
    pub const N_TRAILER_RAYS: usize = 16;
    /// Distance sensors on the tractor, from left 90 deg to right 90 deg.
    pub const N_TRACTOR_RAYS: usize = 13;
    /// Distance sensors in all: the trailer's first, then the tractor's, as the observation has them.
    pub const N_RAYS: usize = N_TRAILER_RAYS + N_TRACTOR_RAYS;
    /// Values of an observation that depend on the waypoint alone: future and current curvature, radius ahead.
    pub const N_PREVIEW: usize = 18;
    /// Values that may be observed beside those.
    pub const N_EXTRAS: usize = 12;
    /// Other vehicles that are observed one by one, at most.
    pub const N_NEAREST: usize = 6;
    /// Values that may be observed of other vehicles.
    pub const N_AROUND: usize = 12 + 5 * N_NEAREST;
    /// Poses of a truck that are kept where what is observed is disturbed: the one that is observed, and those of the
    /// last three steps, the latest first.
    pub const N_POSES: usize = 4;
    /// Cars on a truck's road, at most: slots of a row.
    pub const N_CARS: usize = 24;
    /// Words of the column of cars: four a slot, and what is counted of them all.
    pub const N_CAR_WORDS: usize = 4 * N_CARS + 6;
    /// Rows of four words that a route takes in the table of roads: its own, and its roundabout's field.
    pub const ROUTE_ROWS: usize = 4;
    /// Rows of four words that a waypoint's preview takes there.
    pub const PREVIEW_ROWS: usize = (1 + N_PREVIEW).div_ceil(4);
    /// Bit of [`BeginRow::what`]: the truck begins an episode.
    pub const BEGINS: u32 = 1;
    /// Bit: the episode is the first of the truck's stream, not the next one.
    pub const IS_FIRST: u32 = 2;
    /// Bit: its route is stated.
    pub const HAS_ROUTE: u32 = 4;
    /// Bit: its start is stated.
    pub const HAS_START: u32 = 8;
    /// Bit: its start is drawn, but for offset and heading, which are the lane's.
    pub const IS_CENTRED: u32 = 16;
}

/// Every shared struct.
pub fn structs() -> Vec<Struct> {
    [rows::structs(), tables::structs()].concat()
}

/// The structs in WGSL.
pub(crate) fn printed_structs() -> String {
    [rows::printed_structs(), tables::printed_structs()].concat()
}
