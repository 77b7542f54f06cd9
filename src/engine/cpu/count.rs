//! Adds the step to the tally: its end code and its reward.

use crate::engine::Row;
use crate::world::World;

/// Counts the row's step.
pub fn count(_: &World, row: &mut Row) {
    row.tally.add_step(*row.ended, *row.reward);
}
