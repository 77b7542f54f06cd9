// The signed distance to the nearest kerb: positive where trucks drive, negative in what is solid.
//
// A grid of square cells, each with bilinear blocks of 1, 2, 4, ... sub-cells a side. See src/field.rs.

// The field at a point.
struct Sample {
    // Signed distance (m).
    distance: f32,
    // Its slope to the east and to the north.
    slope: vec2<f32>,
}

// The field at a point; a point outside the grid reads the border. For a march (`exact` is false) the value may be less
// than the distance far from kerbs.
fn field_sample(field: FieldRow, exact: bool, p: vec2<f32>) -> Sample {
    let extent = vec2<f32>(f32(field.columns), f32(field.rows));
    let at = clamp((p - field.origin) * field.cells_per_metre, vec2<f32>(0.0), extent);
    let cell = whole_part(at, extent - 1.0);
    let own = cells[field.first_cell + cell_index(field.columns, u32(cell.x), u32(cell.y))];
    if (own.x & 0xffffu) != ELSEWHERE { return interpolated(field, own, 1.0, at - cell); }

    let form = own.x >> 16u;
    let kind = form >> KIND_SHIFT;
    let skipped = exact && kind == RIDGE;
    let march_size = 1u << (form & LEVEL_MASK);
    let size = select(march_size, 1u << ((form >> RIDGE_SHIFT) & LEVEL_MASK), skipped);
    let first = field.first_pair + own.y + select(0u, n_pairs(march_size), skipped);
    let sample = block_sample(field, first, f32(size), at - cell);
    if kind < select(LESSER, RIDGE, exact) { return sample; }
    let other = block_sample(field, first + n_pairs(size), f32(size), at - cell);
    if (sample.distance < other.distance) == (kind == GREATER) { return other; }
    return sample;
}

// Index of a cell: tiles lie row by row, and in a tile its cells do.
fn cell_index(columns: u32, column: u32, row: u32) -> u32 {
    let tile_column = column / TILE_COLUMNS;
    let tile_row = row / TILE_ROWS;
    return (tile_row * columns + tile_column * TILE_COLUMNS) * TILE_ROWS
        + row % TILE_ROWS * TILE_COLUMNS
        + column % TILE_COLUMNS;
}

// A block of `size` sub-cells a side whose pairs begin at `first`, at fractions of the cell.
fn block_sample(field: FieldRow, first: u32, size: f32, at: vec2<f32>) -> Sample {
    let within = at * size;
    let sub_cell = whole_part(within, vec2<f32>(size - 1.0));
    let pair = first + u32(sub_cell.y * (size + 1.0) + sub_cell.x);
    return interpolated(field, vec2<u32>(corners[pair], corners[pair + 1u]), size, within - sub_cell);
}

// Between the western and the eastern pair of a sub-cell, at fractions of it.
fn interpolated(field: FieldRow, pairs: vec2<u32>, size: f32, fraction: vec2<f32>) -> Sample {
    let west = unpacked(pairs.x);
    let east = unpacked(pairs.y);

    let scale = size * field.slope;
    let south_rise = east.x - west.x;
    let west_rise = west.y - west.x;
    let twist = (east.y - west.y) - south_rise;
    return Sample(
        STORED_UNIT * (west.x + fraction.x * south_rise + fraction.y * (west_rise + fraction.x * twist)),
        vec2<f32>((south_rise + fraction.y * twist) * scale, (west_rise + fraction.x * twist) * scale),
    );
}

// The southern and the northern value of a pair, in units.
fn unpacked(pair: u32) -> vec2<f32> {
    return vec2<f32>(f32(extractBits(i32(pair), 0u, 16u)), f32(extractBits(i32(pair), 16u, 16u)));
}

// Pairs of a block with `size` sub-cells a side.
fn n_pairs(size: u32) -> u32 {
    return size * (size + 1u);
}

// The whole part of 0 <= x <= last + 1, at most `last`. A whole x may count as the end of the part before it:
// interpolation agrees.
fn whole_part(x: vec2<f32>, last: vec2<f32>) -> vec2<f32> {
    return min(max(round(x - 0.5), vec2<f32>(0.0)), last);
}
