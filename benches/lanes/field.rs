//! A thread's look-ups of the field, as `common/field.wgsl` does them, and the way that each took through its code.

use glam::Vec2;
use offtrack::engine::stages::SHADERS;
use offtrack::field::Field;

/// A way through the code of a look-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Path {
    /// The cell is its own block.
    Own,
    /// It has a block elsewhere.
    Block,
    /// It has two.
    Two,
}

/// The samples of one thread, in order.
pub type Trace = Vec<Path>;

/// The field at a point.
pub struct Sample {
    /// Signed distance (m).
    pub distance: f32,
    /// Its slope to the east and to the north.
    pub slope: Vec2,
}

/// A number that the shaders share with Rust, as `layout.wgsl` has it.
pub fn constant(name: &str) -> Result<f32, String> {
    let head = format!("const {name}: ");
    let line = SHADERS[0].1.lines().find_map(|line| line.strip_prefix(&head));
    let value = line.and_then(|line| line.split_once(" = ")?.1.trim_end_matches(['f', 'u', ';']).parse().ok());
    value.ok_or_else(|| format!("layout.wgsl has no number {name}"))
}

/// What the shader's look-up needs beside the field.
pub struct Lookup {
    elsewhere: u32,
    level_mask: u32,
    ridge_shift: u32,
    kind_shift: u32,
    ridge: u32,
    lesser: u32,
    greater: u32,
    tile: [u32; 2],
    unit: f32,
}

impl Lookup {
    pub fn new() -> Result<Lookup, String> {
        let whole = |name| constant(name).map(|value| value as u32);
        Ok(Lookup {
            elsewhere: whole("ELSEWHERE")?,
            level_mask: whole("LEVEL_MASK")?,
            ridge_shift: whole("RIDGE_SHIFT")?,
            kind_shift: whole("KIND_SHIFT")?,
            ridge: whole("RIDGE")?,
            lesser: whole("LESSER")?,
            greater: whole("GREATER")?,
            tile: [whole("TILE_COLUMNS")?, whole("TILE_ROWS")?],
            unit: constant("STORED_UNIT")?,
        })
    }

    /// The field at a point; its way is added to the trace.
    pub fn sample(&self, field: &Field, exact: bool, p: Vec2, trace: &mut Trace) -> Sample {
        let extent = Vec2::new(field.columns as f32, field.rows as f32);
        let at = ((p - field.origin) * field.cells_per_metre).max(Vec2::ZERO).min(extent);
        let cell = whole_part(at, extent - 1.0);
        let own = field.cells[self.index(field.columns, cell.x as u32, cell.y as u32) as usize];
        if own[0] & 0xffff != self.elsewhere {
            trace.push(Path::Own);
            return self.interpolated(field, own, 1.0, at - cell);
        }
        let form = own[0] >> 16;
        let kind = form >> self.kind_shift;
        let march_size = 1 << (form & self.level_mask);
        let skipped = exact && kind == self.ridge;
        let size = if skipped { 1 << (form >> self.ridge_shift & self.level_mask) } else { march_size };
        let n_pairs = |size: u32| size * (size + 1);
        let first = own[1] + if skipped { n_pairs(march_size) } else { 0 };
        let sample = self.block(field, first, size as f32, at - cell);
        if kind < if exact { self.ridge } else { self.lesser } {
            trace.push(Path::Block);
            return sample;
        }
        trace.push(Path::Two);
        let other = self.block(field, first + n_pairs(size), size as f32, at - cell);
        if (sample.distance < other.distance) == (kind == self.greater) { other } else { sample }
    }

    fn index(&self, columns: u32, column: u32, row: u32) -> u32 {
        let [tile_columns, tile_rows] = self.tile;
        (row / tile_rows * columns + column / tile_columns * tile_columns) * tile_rows
            + row % tile_rows * tile_columns
            + column % tile_columns
    }

    fn block(&self, field: &Field, first: u32, size: f32, at: Vec2) -> Sample {
        let within = at * size;
        let sub_cell = whole_part(within, Vec2::splat(size - 1.0));
        let pair = (first + (sub_cell.y * (size + 1.0) + sub_cell.x) as u32) as usize;
        self.interpolated(field, [field.values[pair], field.values[pair + 1]], size, within - sub_cell)
    }

    fn interpolated(&self, field: &Field, pairs: [u32; 2], size: f32, fraction: Vec2) -> Sample {
        let [west, east] = pairs.map(|pair| Vec2::new(f32::from(pair as i16), f32::from((pair >> 16) as i16)));
        let scale = size * field.cells_per_metre * self.unit;
        let south_rise = east.x - west.x;
        let west_rise = west.y - west.x;
        let twist = (east.y - west.y) - south_rise;
        let height = west.x + fraction.x * south_rise + fraction.y * (west_rise + fraction.x * twist);
        Sample {
            distance: self.unit * height,
            slope: Vec2::new((south_rise + fraction.y * twist) * scale, (west_rise + fraction.x * twist) * scale),
        }
    }
}

/// The whole part of 0 <= x <= last + 1, at most `last`.
fn whole_part(x: Vec2, last: Vec2) -> Vec2 {
    let rounded = Vec2::new((x.x - 0.5).round_ties_even(), (x.y - 0.5).round_ties_even());
    rounded.max(Vec2::ZERO).min(last)
}
