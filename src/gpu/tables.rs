//! A world as the bytes that shaders read.

use bytemuck::{bytes_of, cast_slice};

use crate::layout::FieldRow;
use crate::world::World;

/// The world's tables in the order of their bindings: params, actions, rays, fields, cells, corners, waypoints, previews, routes.
pub(super) fn tables(world: &World) -> [Vec<u8>; 9] {
    let (mut rows, mut cells, mut corners) = (Vec::new(), Vec::<u32>::new(), Vec::<[f32; 2]>::new());
    for field in &world.fields {
        let first_cell = cells.len() as u32;
        cells.extend(&field.cells);
        let first_march_cell = cells.len() as u32;
        cells.extend(&field.march_cells);
        rows.push(FieldRow {
            origin: field.origin,
            cells_per_metre: field.cells_per_metre,
            columns: field.columns,
            rows: field.rows,
            first_cell,
            first_march_cell,
            first_pair: corners.len() as u32,
        });
        corners.extend(&field.values);
    }
    [
        bytes_of(&world.params).to_vec(),
        cast_slice(&world.actions).to_vec(),
        cast_slice(&world.rays).to_vec(),
        cast_slice(&rows).to_vec(),
        cast_slice(&cells).to_vec(),
        cast_slice(&corners).to_vec(),
        cast_slice(&world.waypoints).to_vec(),
        cast_slice(&world.previews).to_vec(),
        cast_slice(&world.routes).to_vec(),
    ]
}
