//! Buses, rigid trucks and tractor-trailers: what is different about vehicles that need more than their lane.
//!
//! Their front axle drives the lane's middle, or as far to the outside of a bend as their rear cuts in to the inside,
//! and what is behind follows it as a tractrix: where all of it is remains a function of the path and of the station,
//! so they have no more state than a car ([`trail`]). The room that they sweep is more than a lane in places; where it
//! reaches other lanes, zones are baked for them, so that all keep the rules of cars ([`bake`]).

mod bake; // zones of the room that they sweep
mod tables; // what a road's tables have more for them
mod trail; // where their parts are along a path

pub use tables::LargeTables;
pub(super) use tables::{printed_constants as printed_tables, taken};

use super::units::{length, time};
use crate::layout::shared::constants;

constants! {
    /// Bit of a style at which the kind of a large vehicle stands: 0 is a car or a van, 1 a bus, 2 a rigid truck, 3 a
    /// tractor-trailer.
    pub(super) const LARGE: u32 = 8;
    /// Kinds of large vehicles.
    pub(super) const N_LARGE: usize = 3;
    /// Classes of vehicles by the room that they need: cars and vans, vehicles of one unit, tractor-trailers.
    pub(super) const N_CLASSES: usize = 3;
    /// Length of path that a bus takes: in bends its rear lags behind the path, which is longer than its own way (2^-10
    /// m).
    const BUS_LENGTH: i32 = length(BUS.length + 2.0);
    /// The same of a rigid truck (2^-10 m).
    const RIGID_LENGTH: i32 = length(RIGID.length + 2.0);
    /// The same of a tractor-trailer (2^-10 m).
    const COMBINATION_LENGTH: i32 = length(COMBINATION.length + 3.0);
    /// Half the width of a bus and of a rigid truck (m).
    const LARGE_HALF_WIDTH: f32 = BUS.half_width;
    /// Half the width of a tractor-trailer (m).
    const COMBINATION_HALF_WIDTH: f32 = COMBINATION.half_width;
    /// Front axle of a bus behind its front (m).
    const BUS_HINGE: f32 = BUS.hinge;
    /// Front axle of a rigid truck behind its front (m).
    const RIGID_HINGE: f32 = RIGID.hinge;
    /// Kingpin of a tractor-trailer behind its front (m).
    const COMBINATION_HINGE: f32 = COMBINATION.hinge;
    /// Length of a bus (m).
    const BUS_BODY: f32 = BUS.body();
    /// Length of a rigid truck (m).
    const RIGID_BODY: f32 = RIGID.body();
    /// Front of a trailer ahead of its kingpin (m).
    const TRAILER_AHEAD: f32 = COMBINATION.ahead;
    /// Length of a trailer (m).
    const TRAILER_LENGTH: f32 = COMBINATION.body();
    /// Front axle of a tractor behind its front (m).
    const TRACTOR_FRONT_AXLE: f32 = TRACTOR[0];
    /// Its drive axle behind its front (m).
    const TRACTOR_DRIVE_AXLE: f32 = TRACTOR[1];
    /// Its length (m).
    const TRACTOR_LENGTH: f32 = TRACTOR[2];
    /// How much longer a large vehicle waits for a gap than a car does (1/256 step).
    pub(super) const LAG_OF_LARGE: i32 = time(0.5);
    /// The largest acceleration of a large vehicle: 1.3 m/s² (2^-19 m a step²).
    pub(super) const MOST_OF_LARGE: i32 = 6816;
    /// Its speed, in sixteenths of a car's at that place.
    pub(super) const PACE_OF_LARGE: i32 = 13;
}

/// A kind of large vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Large {
    /// 12 m long, on two axles.
    Bus = 1,
    /// A truck of 10 m without a trailer.
    RigidTruck = 2,
    /// That of `attard2023`, 16.1 m long.
    TractorTrailer = 3,
}

/// What is where on a large vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shape {
    /// Length (m).
    pub length: f32,
    /// Half the width (m).
    pub half_width: f32,
    /// The point of the last unit that follows the path, behind the vehicle's front: front axle or kingpin (m).
    pub hinge: f32,
    /// From there to the last unit's rear axle (m).
    pub wheelbase: f32,
    /// Front of the last unit ahead of that point (m).
    pub ahead: f32,
    /// Whether a tractor is before the last unit.
    pub has_tractor: bool,
}

impl Shape {
    /// Length of the last unit (m).
    pub(super) const fn body(&self) -> f32 {
        self.length - self.hinge + self.ahead
    }
}

/// Bus of 12 m with the axles of a common one; 2.55 m is the width that EU Directive 96/53/EC allows.
const BUS: Shape =
    Shape { length: 12.0, half_width: 1.275, hinge: 2.7, wheelbase: 5.9, ahead: 2.7, has_tractor: false };
/// Distribution truck of 10 m.
const RIGID: Shape =
    Shape { length: 10.0, half_width: 1.275, hinge: 1.4, wheelbase: 5.6, ahead: 1.4, has_tractor: false };
/// The truck of `attard2023`.
const COMBINATION: Shape =
    Shape { length: 16.118, half_width: 1.25, hinge: 4.498, wheelbase: 7.756, ahead: 2.09, has_tractor: true };
/// Its tractor: both axles behind its front, and its length (m).
pub(super) const TRACTOR: [f32; 3] = [1.363, 4.906, 5.864];

impl Large {
    /// Every kind, in the order of their codes.
    pub const ALL: [Large; N_LARGE] = [Large::Bus, Large::RigidTruck, Large::TractorTrailer];

    pub(super) const fn shape(self) -> Shape {
        match self {
            Large::Bus => BUS,
            Large::RigidTruck => RIGID,
            Large::TractorTrailer => COMBINATION,
        }
    }

    /// The class of vehicles that need as much room: 1 or 2.
    pub(super) const fn class(self) -> usize {
        match self {
            Large::Bus | Large::RigidTruck => 1,
            Large::TractorTrailer => 2,
        }
    }

    /// Length of path that it takes (2^-10 m).
    pub(super) const fn extent(self) -> i32 {
        match self {
            Large::Bus => BUS_LENGTH,
            Large::RigidTruck => RIGID_LENGTH,
            Large::TractorTrailer => COMBINATION_LENGTH,
        }
    }
}
