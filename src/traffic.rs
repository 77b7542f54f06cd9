//! Cars on a road: where they drive, where their ways meet, and how each decides what to do about the others.
//!
//! A [`Network`] is baked from a road: every route as a path of samples, and for every pair of paths the zones in which
//! they meet. Nothing about priority is read from a map: the line before which an entering car waits follows from the
//! zones, so that rings from parameters, rings from maps and junctions are the same tables. A [`Run`] drives cars alone
//! through it, step by step of 0.1 s: every car decides from the state of the step before, and all move at once, so no
//! result depends on an order. A [`Survey`] counts what passes the entries, for comparison with the [`hcm`].
//!
//! A road with left-hand traffic is driven as its mirror image, as everywhere: its tables and its cars are those of the
//! mirrored right-hand road to the last bit.

mod arrivals; // cars come, wait outside, and leave
mod bake; // a road's tables
pub mod car; // the state of one car, and its outline
pub mod clock; // random numbers by step and purpose
pub mod decide; // the acceleration of each car
pub mod demand; // how many cars want to go where
mod drivers; // other kinds of drivers
pub mod hcm; // the Highway Capacity Manual's equations
mod kept; // tables from the cache
mod large; // buses and trucks
mod meetings; // where two lines are near each other
mod model; // the intelligent driver model in integers
mod network; // the tables
mod others; // what cars mind besides each other
mod paths; // lines that cars drive, and how fast
pub mod rules; // the numbers of the driver model
mod row; // a truck's row of the column of cars
mod run; // cars alone on a road
mod snapshots; // states that episodes begin in
mod step; // a step of a row of cars
pub mod survey; // what passes the entries
mod truck; // a truck among the cars
pub mod units; // the integers that cars are counted in
#[cfg(test)]
mod tests;

pub use arrivals::{Backlog, Event, arrive};
pub use car::Car;
pub use clock::Clock;
pub use decide::Driver;
pub use demand::{Demand, Mix, together};
pub use drivers::Drivers;
pub use large::{Large, LargeTables};
pub use network::{Kind, Network, Pair, Path, SPACING, Sample, Source, Stretch, Zone};
pub use others::{Nobody, Others};
pub use paths::{begins, speed_limit};
pub use row::Row;
pub use rules::Rules;
pub use run::{Run, overlaps};
pub use snapshots::{N_SNAPSHOTS, Snapshots};
pub use step::{N_TURNS, Setting, advance, decide, step};
pub use survey::Survey;
pub use truck::{
    Contact, ENTERED_BEFORE, Entry, Met, Trucks, View, may_be_within, outlines, stretched, touched, touched_by,
};

use crate::files::reader::shown;

/// What shaders share of the numbers of cars, in WGSL.
pub(crate) fn printed_constants() -> String {
    [
        units::printed_constants(),
        model::printed_constants(),
        rules::printed_constants(),
        network::printed_constants(),
        large::printed_constants(),
        large::printed_tables(),
        clock::printed_constants(),
        car::printed_constants(),
        decide::printed_constants(),
        decide::printed_entry(),
        arrivals::printed_constants(),
        step::printed_constants(),
        row::printed_constants(),
        snapshots::printed_constants(),
        truck::printed_constants(),
        truck::printed_view(),
        truck::printed_line(),
        truck::printed_corridor(),
        truck::printed_contact(),
    ]
    .concat()
}

/// Time of a step (s).
pub const STEP: f32 = 0.1;

/// Why a road or a demand suits no traffic.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The road has more of something than the tables hold.
    #[error("{road}: {value} {of}; traffic takes at most {most}: a smaller road would do")]
    TooLarge {
        /// The road's name.
        road: String,
        /// What there is too much of, with its unit.
        of: &'static str,
        /// How much there is.
        value: usize,
        /// How much would do.
        most: usize,
    },
    /// A flow is negative, not finite, or larger than one car a step.
    #[error("{} veh/h cannot arrive; must lie in 0..{most} veh/h", shown(*flow))]
    Flow {
        /// The flow asked for (veh/h).
        flow: f64,
        /// The largest flow (veh/h).
        most: f64,
    },
    /// A junction without a ring has no priority rule that keeps it from locking under so many cars.
    #[error(
        "{} veh/h on a road without a ring, whose junction locks under that many; must lie in 0..{most} veh/h",
        shown(*flow)
    )]
    NoRing {
        /// The flow asked for (veh/h).
        flow: f64,
        /// The largest flow (veh/h).
        most: f64,
    },
}
