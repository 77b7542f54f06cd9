//! The signed distance to the kerbs as a table: positive on the drivable surface, negative in the solid area.
//!
//! A grid of square cells. A cell has a bilinear block of 1, 2, 4, ... sub-cells a side, as its part of the distance
//! requires. Where two kerbs are about equally near, the distance has a kink: there a cell has a block for each kerb,
//! and the lesser value counts. The blocks are stored in one flat array, in 16 bits a value.

mod bake;
mod kept;

use glam::Vec2;

use crate::layout::shared::constants;

constants! {
    /// Southern half of a cell's western pair where the cell has blocks elsewhere: no stored distance is as small.
    const ELSEWHERE: u32 = 0x8000;
    /// Lowest bits of what the northern half says then: the logarithm of the sub-cells a side of its first block.
    const LEVEL_MASK: u32 = 7;
    /// Shift of the logarithm of the sub-cells a side of a ridge's other two blocks.
    const RIDGE_SHIFT: u32 = 3;
    /// Shift of a cell's kind.
    const KIND_SHIFT: u32 = 6;
    /// [`Kind::Ridge`].
    const RIDGE: u32 = Kind::Ridge as u32;
    /// [`Kind::Lesser`].
    const LESSER: u32 = Kind::Lesser as u32;
    /// [`Kind::Greater`].
    const GREATER: u32 = Kind::Greater as u32;
    /// Cells a side of the tiles that lie together in memory, west to east.
    const TILE_COLUMNS: u32 = 4;
    /// Cells a side of the tiles that lie together in memory, south to north.
    const TILE_ROWS: u32 = 2;
    /// What a stored value of 1 means: 0.5 mm. Exact in f32 (m).
    pub(crate) const STORED_UNIT: f32 = 1.0 / 2048.0;
}
/// How a cell's blocks make the distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
enum Kind {
    /// One block.
    Single,
    /// A block for marching, then two whose lesser value is the distance.
    Ridge,
    /// Two blocks whose lesser value is the distance.
    Lesser,
    /// Two blocks whose greater value is the distance.
    Greater,
}

/// The cell whose blocks begin at pair `first`.
fn elsewhere(kind: Kind, level: u32, ridge_level: u32, first: u32) -> [u32; 2] {
    [((kind as u32) << KIND_SHIFT | ridge_level << RIDGE_SHIFT | level) << 16 | ELSEWHERE, first]
}

/// The pairs that a cell refers to: the first, and one past the last. None of a cell that is a block itself.
fn pairs([west, first]: [u32; 2]) -> Option<(usize, usize)> {
    let size = |shift: u32| {
        let size = 1usize << (west >> (16 + shift) & LEVEL_MASK);
        size * (size + 1)
    };
    let n_pairs = match west >> (16 + KIND_SHIFT) {
        RIDGE => size(0) + 2 * size(RIDGE_SHIFT),
        LESSER | GREATER => 2 * size(0),
        _ => size(0),
    };
    (west & 0xffff == ELSEWHERE).then_some((first as usize, first as usize + n_pairs))
}

/// Index of a cell: tiles lie row by row, and in a tile its cells do, so that cells near each other share a cache line.
#[inline(always)]
fn cell_index(columns: u32, column: u32, row: u32) -> u32 {
    let (tile_column, tile_row) = (column / TILE_COLUMNS, row / TILE_ROWS);
    (tile_row * columns + tile_column * TILE_COLUMNS) * TILE_ROWS
        + row % TILE_ROWS * TILE_COLUMNS
        + column % TILE_COLUMNS
}

/// 2^23. An f32 of this size has no fraction, so adding it to a smaller number leaves the integer part in the lower
/// bits.
const WHOLE: f32 = 8_388_608.0;
const WHOLE_BITS: u32 = 0x7f_ffff;

/// Signed distance to the kerbs of one roundabout.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// South-west corner of the grid (m).
    pub origin: Vec2,
    /// Cells in a metre (1/m).
    pub cells_per_metre: f32,
    /// Cells from west to east, a multiple of 4.
    pub columns: u32,
    /// Cells from south to north, a multiple of 2.
    pub rows: u32,
    /// Two words per cell, in tiles of 4 by 2 cells. Most cells are a block of one sub-cell: the western and the
    /// eastern pair of distances. Where the lower half of the first word is 0x8000, the cell has other blocks in
    /// `values`. They begin at the pair that the second word says, one after the other, and the first word's upper half
    /// says what they are: `kind << 6 | ridge_level << 3 | level`. The first block has 2^level sub-cells a side. Of
    /// kind 1 (a ridge) the first block is for marching: it is coarse and does not exceed the distance. It is followed
    /// by two of 2^ridge_level sub-cells a side, whose lesser value is the distance. Kinds 2 and 3 have two blocks of
    /// one level, whose lesser or greater value is the distance.
    pub cells: Vec<[u32; 2]>,
    /// Blocks of distances at the sub-cells' corners, in units of 1/2048 m, two to a word: the southern one in the
    /// lower 16 bits, signed, the northern one in the upper. A block has one row of pairs per row of sub-cells, from
    /// the south, and in it one pair per line of corners, from the west. So the four corners of a sub-cell are
    /// adjacent. The first two pairs belong to no cell.
    pub values: Vec<u32>,
}

/// The field at several points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Samples<const N: usize> {
    /// Signed distance (m).
    pub distance: [f32; N],
    /// Derivative to the east.
    pub east: [f32; N],
    /// Derivative to the north.
    pub north: [f32; N],
}

/// The blocks of `N` points.
struct Blocks<const N: usize> {
    /// 1 where the block is the cell itself, `own_west` and `own_east`; else it begins at pair `first`.
    own: [u32; N],
    own_west: [u32; N],
    own_east: [u32; N],
    first: [u32; N],
    /// Sub-cells a side.
    size: [f32; N],
}

/// What a sample is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// The distance itself.
    Exact,
    /// Sphere tracing: far from kerbs the value may be less than the distance.
    March,
}

impl Field {
    /// Signed distance at `p`. Outside the grid everything is solid and the value keeps falling (m).
    ///
    /// Up to 5 m from a kerb the error is at most 1 cm, or 3 cm within 0.5 m of a kink of the distance; on a smooth
    /// kerb it is at most 1 mm. Beyond 7.5 m inside a solid, and beyond 15.9 m from all kerbs, the value stays.
    #[inline]
    pub fn distance(&self, p: Vec2) -> f32 {
        let extent = Vec2::new(self.columns as f32, self.rows as f32) / self.cells_per_metre;
        let outside = (self.origin - p).max(p - self.origin - extent).max(Vec2::ZERO);
        self.sample(Purpose::Exact, &[p.x], &[p.y]).distance[0] - outside.length()
    }

    /// The field at `N` points. A point outside the grid, or a NaN, reads the border.
    #[inline(always)]
    pub(crate) fn sample<const N: usize>(&self, purpose: Purpose, x: &[f32; N], y: &[f32; N]) -> Samples<N> {
        let (last_column, last_row) = (self.columns as f32 - 1.0, self.rows as f32 - 1.0);
        let mut cell = [0; N];
        let (mut across, mut up) = ([0.0; N], [0.0; N]);
        for n in 0..N {
            let u = clamped((x[n] - self.origin.x) * self.cells_per_metre, self.columns as f32);
            let v = clamped((y[n] - self.origin.y) * self.cells_per_metre, self.rows as f32);
            let (i, j) = (whole_part(u, last_column), whole_part(v, last_row));
            (across[n], up[n]) = (u - i, v - j);
            cell[n] = cell_index(self.columns, as_index(i), as_index(j));
        }
        let (mut own_west, mut own_east) = ([0; N], [0; N]);
        for n in 0..N {
            [own_west[n], own_east[n]] = self.cells[cell[n] as usize];
        }
        let mut blocks = Blocks { own: [0; N], own_west, own_east, first: [0; N], size: [0.0; N] };
        let (mut second, mut kind) = ([0; N], [0; N]);
        let mut paired = 0;
        for n in 0..N {
            let own = own_west[n] & 0xffff != ELSEWHERE;
            let form = if own { 0 } else { own_west[n] >> 16 };
            kind[n] = form >> KIND_SHIFT;
            let march_size = power_of_two(form & LEVEL_MASK);
            // Of a ridge the exact distance has its blocks behind the one for marching.
            let skipped = purpose == Purpose::Exact && kind[n] == RIDGE;
            let size = if skipped { power_of_two(form >> RIDGE_SHIFT & LEVEL_MASK) } else { march_size };
            let begin = if own { 0 } else { own_east[n] };
            let first = if skipped { begin + n_pairs(march_size) } else { begin };
            let two = if purpose == Purpose::Exact { RIDGE <= kind[n] } else { LESSER <= kind[n] };
            second[n] = if two { first + n_pairs(size) } else { 0 };
            paired |= second[n];
            (blocks.own[n], blocks.first[n], blocks.size[n]) = (u32::from(own), first, size);
        }
        let mut samples = self.interpolated(&blocks, &across, &up);
        if 0 < paired {
            for n in 0..N {
                if 0 < second[n] {
                    let block =
                        Blocks { own: [0], own_west: [0], own_east: [0], first: [second[n]], size: [blocks.size[n]] };
                    let other = self.interpolated(&block, &[across[n]], &[up[n]]);
                    if (samples.distance[n] < other.distance[0]) == (kind[n] == GREATER) {
                        (samples.distance[n], samples.east[n], samples.north[n]) =
                            (other.distance[0], other.east[0], other.north[0]);
                    }
                }
            }
        }
        samples
    }

    /// Blocks at `N` points, given as fractions of the cell across and up.
    #[inline(always)]
    fn interpolated<const N: usize>(&self, blocks: &Blocks<N>, across: &[f32; N], up: &[f32; N]) -> Samples<N> {
        let mut pair = [0; N];
        let (mut u, mut v) = ([0.0; N], [0.0; N]);
        for n in 0..N {
            let size = blocks.size[n];
            let (x, y) = (across[n] * size, up[n] * size);
            let (i, j) = (whole_part(x, size - 1.0), whole_part(y, size - 1.0));
            (u[n], v[n]) = (x - i, y - j);
            pair[n] = blocks.first[n] + as_index(j * (size + 1.0) + i);
        }
        let west_pair = read(&self.values, &pair);
        let east_pair = read(&self.values[1..], &pair);
        let (mut distance, mut east, mut north) = ([0.0; N], [0.0; N], [0.0; N]);
        for n in 0..N {
            let west_pair = if blocks.own[n] == 1 { blocks.own_west[n] } else { west_pair[n] };
            let east_pair = if blocks.own[n] == 1 { blocks.own_east[n] } else { east_pair[n] };
            let scale = blocks.size[n] * self.cells_per_metre * STORED_UNIT;
            let (south_west, south_east) = (southern(west_pair), southern(east_pair));
            let (south_rise, north_rise) = (south_east - south_west, northern(east_pair) - northern(west_pair));
            let west_rise = northern(west_pair) - south_west;
            let twist = north_rise - south_rise;
            distance[n] = STORED_UNIT * (south_west + u[n] * south_rise + v[n] * (west_rise + u[n] * twist));
            east[n] = (south_rise + v[n] * twist) * scale;
            north[n] = (west_rise + u[n] * twist) * scale;
        }
        Samples { distance, east, north }
    }

    /// Size of the tables (bytes).
    pub fn bytes(&self) -> usize {
        size_of_val(self.cells.as_slice()) + size_of_val(self.values.as_slice())
    }
}

/// Entries of a table. A loop of its own, so that the indices before it and the values after it are vectors.
#[inline(always)]
fn read<const N: usize>(table: &[u32], index: &[u32; N]) -> [u32; N] {
    let mut found = [0; N];
    for n in 0..N {
        found[n] = table[index[n] as usize];
    }
    found
}

/// The southern value of a pair, in units.
#[inline(always)]
fn southern(pair: u32) -> f32 {
    ((pair << 16) as i32 >> 16) as f32
}

/// The northern value of a pair, in units.
#[inline(always)]
fn northern(pair: u32) -> f32 {
    (pair as i32 >> 16) as f32
}

/// 2^level, from its exponent bits.
#[inline(always)]
fn power_of_two(level: u32) -> f32 {
    f32::from_bits((level << 23) + 1.0f32.to_bits())
}

/// Pairs of a block with `size` sub-cells a side.
#[inline(always)]
fn n_pairs(size: f32) -> u32 {
    as_index(size * (size + 1.0))
}

/// `x` clamped to 0..limit; 0 for NaN, which `clamp` would keep.
#[inline(always)]
fn clamped(x: f32, limit: f32) -> f32 {
    let x = if 0.0 < x { x } else { 0.0 };
    if x < limit { x } else { limit }
}

/// The integer part of 0 <= x <= last + 1, at most `last`. An integer x may count as the end of the cell before it:
/// interpolation agrees.
#[inline(always)]
fn whole_part(x: f32, last: f32) -> f32 {
    // Without SSE4.1, `floor` is a call for each lane; rounding by addition is two instructions everywhere.
    let shifted = x + (WHOLE - 0.5);
    let shifted = if WHOLE < shifted { shifted } else { WHOLE };
    let whole = shifted - WHOLE;
    if whole < last { whole } else { last }
}

/// An integer below 2^23 as an index.
#[inline(always)]
fn as_index(whole: f32) -> u32 {
    (whole + WHOLE).to_bits() & WHOLE_BITS
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::geometry::{Curve, Outline};

    fn disc(radius: f64) -> Field {
        Field::bake(&Outline::new(vec![Curve::circle(DVec2::ZERO, radius)]), 0.5)
    }

    #[test]
    fn a_point_reads_the_same_alone_and_among_others() {
        let field = disc(9.0);
        let x: [f32; 16] = std::array::from_fn(|n| 1.3 * n as f32 - 9.7);
        let y: [f32; 16] = std::array::from_fn(|n| 0.7 * n as f32 - 5.1);
        let together = field.sample(Purpose::Exact, &x, &y).distance;
        for n in 0..16 {
            assert_eq!(field.sample(Purpose::Exact, &[x[n]], &[y[n]]).distance[0].to_bits(), together[n].to_bits());
        }
    }

    #[test]
    fn the_slope_points_away_from_the_kerb_and_is_one() {
        let field = disc(9.0);
        for direction in (0..100).map(|n| Vec2::from_angle(0.063 * n as f32)) {
            for radius in [3.0, 8.0, 8.95, 9.05] {
                let p = radius * direction;
                let Samples { east, north, .. } = field.sample(Purpose::Exact, &[p.x], &[p.y]);
                // A bilinear cell of 0.5 m, 3 m from the centre of curvature, turns by up to 5 deg where the exact
                // slope does not.
                assert!((Vec2::new(east[0], north[0]) + direction).length() < 0.1, "{p}: {east:?} {north:?}");
            }
        }
    }

    #[test]
    fn every_block_has_the_position_and_size_of_its_cells_word() {
        // The disc's centre is a kink, in the range of the stated accuracy: the coarsest and the finest blocks occur.
        let field = disc(4.0);
        let mut ends: Vec<(usize, usize)> = field.cells.iter().filter_map(|&cell| pairs(cell)).collect();
        ends.sort_unstable();
        assert!(ends.windows(2).all(|pair| pair[0].1 == pair[1].0));
        assert_eq!((ends[0].0, ends[ends.len() - 1].1), (2, field.values.len()));
        assert!(ends.len() < field.cells.len() && ends.iter().any(|(begin, end)| 50 < end - begin));
    }

    #[test]
    fn every_cell_has_an_index_of_its_own() {
        let mut indices: Vec<u32> =
            (0..6).flat_map(|row| (0..8).map(move |column| cell_index(8, column, row))).collect();
        indices.sort_unstable();
        assert_eq!(indices, (0..48).collect::<Vec<u32>>());
    }
}
