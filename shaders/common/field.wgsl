// The signed distance to the nearest kerb: positive where trucks drive, negative in what is solid.
//
// A grid of square cells, each with its own bilinear block of 1, 2, 4, ... sub-cells a side. See src/field.rs.

// The field at a point.
struct Sample {
    // Signed distance [m].
    distance: f32,
    // Its slope to the east and to the north.
    slope: vec2<f32>,
}

// The field at a point, by the cells that begin at `first_cell`; a point outside the grid reads the border.
fn field_sample(field: FieldRow, first_cell: u32, p: vec2<f32>) -> Sample {
    let extent = vec2<f32>(f32(field.columns), f32(field.rows));
    let at = clamp((p - field.origin) * field.cells_per_metre, vec2<f32>(0.0), extent);
    let cell = whole_part(at, extent - 1.0);
    let word = cells[first_cell + u32(cell.y) * field.columns + u32(cell.x)];

    let size = f32(1u << (word & ((1u << LEVEL_BITS) - 1u)));
    let within = (at - cell) * size;
    let sub_cell = whole_part(within, vec2<f32>(size - 1.0));
    let fraction = within - sub_cell;
    let pair = field.first_pair + (word >> LEVEL_BITS) + u32(sub_cell.y * (size + 1.0) + sub_cell.x);
    let west = corners[pair];
    let east = corners[pair + 1u];

    let scale = size * field.cells_per_metre;
    let south_rise = east.x - west.x;
    let west_rise = west.y - west.x;
    let twist = (east.y - west.y) - south_rise;
    return Sample(
        west.x + fraction.x * south_rise + fraction.y * (west_rise + fraction.x * twist),
        vec2<f32>((south_rise + fraction.y * twist) * scale, (west_rise + fraction.x * twist) * scale),
    );
}

// The whole part of 0 <= x <= last + 1, at most `last`. A whole x may count as the end of the part before it:
// interpolation agrees.
fn whole_part(x: vec2<f32>, last: vec2<f32>) -> vec2<f32> {
    return min(max(round(x - 0.5), vec2<f32>(0.0)), last);
}
