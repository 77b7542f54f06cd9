//! The vehicles around one truck: a row of the column of a batch.

use std::mem::offset_of;

use bytemuck::{Pod, Zeroable, cast_mut, cast_ref};

use super::Car;
use crate::layout::shared::constants;
use crate::layout::{N_CAR_WORDS, N_CARS};

constants! {
    /// Words of a car.
    const CAR_WORDS: usize = size_of::<Car>() / 4;
    /// Word of a row at which the cars begin that wait outside.
    const BACKLOG_AT: usize = offset_of!(Row, backlog) / 4;
    /// Word of the demand that the episode has.
    const LEVEL_AT: usize = offset_of!(Row, level) / 4;
    /// Word of the step in which the truck entered.
    const ENTERED_AT: usize = offset_of!(Row, entered) / 4;
    /// Word of the contact.
    const MET_AT: usize = offset_of!(Row, met) / 4;
    /// Word of the cars that slow for the truck.
    const HINDERED_AT: usize = offset_of!(Row, hindered) / 4;
}

/// The vehicles on one truck's road, and what is counted of them.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Row {
    /// The slots, of which some have a car.
    pub cars: [Car; N_CARS],
    /// Cars that wait outside: four bits a source.
    pub backlog: [u32; 2],
    /// Which of the benchmark's demands the episode has.
    pub level: u32,
    /// The step of the episode in which the truck entered, plus 1; 0 before; [`super::ENTERED_BEFORE`] if it began
    /// beyond its line.
    pub entered: u32,
    /// Slot, plus 1, of the car that the truck met, 64 more where the truck is at fault; 0 if it met none.
    pub met: u32,
    /// A bit for each slot whose car brakes for the truck more than for anything else.
    pub hindered: u32,
}

impl Row {
    /// A road without cars.
    pub const EMPTY: Row =
        Row { cars: [Car::NONE; N_CARS], backlog: [0; 2], level: 0, entered: 0, met: 0, hindered: 0 };

    /// The row of a column's words.
    pub fn of(words: &[u32; N_CAR_WORDS]) -> &Row {
        cast_ref(words)
    }

    /// The same, to be written to.
    pub fn of_mut(words: &mut [u32; N_CAR_WORDS]) -> &mut Row {
        cast_mut(words)
    }
}
