//! What trucks share, as the bytes that shaders read.

use std::borrow::Cow;

use bytemuck::{bytes_of, cast_slice};

use crate::engine::{Batch, RouteChoice};
use crate::field::STORED_UNIT;
use crate::layout::buffers::Table;
use crate::layout::{BatchFacts, BeginRow, FieldRow};
use crate::world::World;

/// The contents of every [`Table`].
pub(super) struct Tables<'a> {
    world: &'a World,
    batch: &'a Batch,
    facts: BatchFacts,
    // All fields, one after the other.
    fields: Vec<FieldRow>,
    cells: Vec<[u32; 2]>,
    corners: Vec<u32>,
}

impl<'a> Tables<'a> {
    pub(super) fn new(world: &'a World, batch: &'a Batch) -> Tables<'a> {
        let mut tables = Tables {
            world,
            batch,
            facts: BatchFacts::of(batch),
            fields: Vec::new(),
            cells: Vec::new(),
            corners: Vec::new(),
        };
        for field in &world.fields {
            let first_cell = tables.cells.len() as u32;
            tables.cells.extend(&field.cells);
            tables.fields.push(FieldRow {
                origin: field.origin,
                cells_per_metre: field.cells_per_metre,
                slope: field.cells_per_metre * STORED_UNIT,
                columns: field.columns,
                rows: field.rows,
                first_cell,
                first_pair: tables.corners.len() as u32,
            });
            tables.corners.extend(&field.values);
        }
        tables
    }

    /// A table's bytes.
    pub(super) fn bytes(&self, table: Table) -> Cow<'_, [u8]> {
        Cow::Borrowed(match table {
            Table::Params => bytes_of(&self.world.params),
            Table::Rigs => cast_slice(&self.world.rigs),
            Table::Actions => cast_slice(&self.world.actions),
            Table::Rays => cast_slice(&self.world.rays),
            Table::Fields => cast_slice(&self.fields),
            Table::Cells => cast_slice(&self.cells),
            Table::Corners => cast_slice(&self.corners),
            Table::Waypoints => cast_slice(&self.world.waypoints),
            Table::Previews => cast_slice(&self.world.previews),
            Table::Routes => cast_slice(&self.world.routes),
            Table::StepLimits => cast_slice(&self.world.step_limits),
            Table::Batch => bytes_of(&self.facts),
            Table::Choice => cast_slice(self.batch.choice().routes()),
            Table::Streams => cast_slice(self.batch.streams()),
            Table::Begins => return Cow::Owned(vec![0; self.batch.n_envs() * size_of::<BeginRow>()]),
        })
    }
}

impl BatchFacts {
    /// Facts of a batch.
    pub(super) fn of(batch: &Batch) -> BatchFacts {
        BatchFacts {
            n_envs: batch.n_envs() as u32,
            n_routes: batch.choice().routes().len() as u32,
            fixed: matches!(batch.choice(), RouteChoice::Fixed(_)).into(),
            autoreset: batch.autoreset() as u32,
        }
    }
}
