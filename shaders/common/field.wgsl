// The signed distance to the nearest kerb: positive where trucks drive, negative in what is solid.
//
// A grid of square cells, each with bilinear blocks of 1, 2, 4, ... sub-cells a side. See src/field.rs.

// The field at a point.
struct Sample {
    // Signed distance [m].
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
    let word = cells[field.first_cell + u32(cell.y) * field.columns + u32(cell.x)];

    let kind = (word >> KIND_SHIFT) & KIND_MASK;
    let skipped = exact && kind == RIDGE;
    let march_size = 1u << (word & LEVEL_MASK);
    let size = select(march_size, 1u << ((word >> RIDGE_SHIFT) & LEVEL_MASK), skipped);
    let block = field.first_pair + (word >> LEVEL_BITS) * PAIRS_PER_UNIT;
    let first = select(block, block + n_pairs(march_size), skipped);
    let sample = interpolated(field, first, f32(size), at - cell);
    if kind < select(LESSER, RIDGE, exact) { return sample; }
    let other = interpolated(field, first + n_pairs(size), f32(size), at - cell);
    if (sample.distance < other.distance) == (kind == GREATER) { return other; }
    return sample;
}

// A block of `size` sub-cells a side whose pairs begin at `first`, at fractions of the cell.
fn interpolated(field: FieldRow, first: u32, size: f32, at: vec2<f32>) -> Sample {
    let within = at * size;
    let sub_cell = whole_part(within, vec2<f32>(size - 1.0));
    let fraction = within - sub_cell;
    let pair = first + u32(sub_cell.y * (size + 1.0) + sub_cell.x);
    let west = unpacked(corners[pair]);
    let east = unpacked(corners[pair + 1u]);

    let scale = size * field.cells_per_metre * UNIT;
    let south_rise = east.x - west.x;
    let west_rise = west.y - west.x;
    let twist = (east.y - west.y) - south_rise;
    return Sample(
        UNIT * (west.x + fraction.x * south_rise + fraction.y * (west_rise + fraction.x * twist)),
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
