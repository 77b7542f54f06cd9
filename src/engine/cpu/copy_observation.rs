//! Copies the observation after the action to the observation before the next action.
//!
//! The reset stage then replaces it where another episode begins.

use crate::engine::Row;
use crate::world::World;

/// Copies the row's observation.
pub fn copy_observation(_: &World, row: &mut Row) {
    *row.observation = *row.next_observation;
    *row.extras = *row.next_extras;
    if let (Some(around), Some(next)) = (&mut row.around, &row.next_around) {
        **around = **next;
    }
}
