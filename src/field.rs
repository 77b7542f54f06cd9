//! The signed distance to the kerbs as a table: positive on the drivable surface, negative in the solid area.
//!
//! A grid of square cells. A cell has a bilinear block of 1, 2, 4, ... sub-cells a side, as its part of the distance
//! requires. Where two kerbs are about equally near, the distance has a kink: there a cell has a block for each kerb,
//! and the lesser value counts. The blocks are stored in one flat array, in 16 bits a value.

mod bake;
mod kept;

use glam::Vec2;

use crate::shared::constants;

constants! {
    /// Bits of a cell's word below its block's index.
    const LEVEL_BITS: u32 = 8;
    /// Lowest bits of a word: the logarithm of the sub-cells a side of its first block.
    const LEVEL_MASK: u32 = 7;
    /// Shift of the same of a ridge's other two blocks.
    const RIDGE_SHIFT: u32 = 3;
    /// Shift of a cell's kind.
    const KIND_SHIFT: u32 = 6;
    /// Bits of a kind.
    const KIND_MASK: u32 = 3;
    /// [`Kind::Ridge`].
    const RIDGE: u32 = Kind::Ridge as u32;
    /// [`Kind::Lesser`].
    const LESSER: u32 = Kind::Lesser as u32;
    /// [`Kind::Greater`].
    const GREATER: u32 = Kind::Greater as u32;
    /// Pairs that an index of a word counts: every block has an even number.
    const PAIRS_PER_UNIT: u32 = 2;
    /// What a stored value of 1 means: 0.5 mm. Exact in f32 \[m].
    const UNIT: f32 = 1.0 / 2048.0;
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

/// A cell's word: kind, levels of the first block and of a ridge's others, and the index of the first pair.
fn word(kind: Kind, level: u32, ridge_level: u32, first: u32) -> u32 {
    (first / PAIRS_PER_UNIT) << LEVEL_BITS | (kind as u32) << KIND_SHIFT | ridge_level << RIDGE_SHIFT | level
}

/// 2^23. An f32 of this size has no fraction, so adding it to a smaller number leaves the integer part in the lower
/// bits.
const WHOLE: f32 = 8_388_608.0;
const WHOLE_BITS: u32 = 0x7f_ffff;

/// One past the last pair that a cell's word refers to.
fn end(word: u32) -> usize {
    let pairs = |shift: u32| {
        let size = 1usize << (word >> shift & LEVEL_MASK);
        size * (size + 1)
    };
    let blocks = match word >> KIND_SHIFT & KIND_MASK {
        RIDGE => pairs(0) + 2 * pairs(RIDGE_SHIFT),
        LESSER | GREATER => 2 * pairs(0),
        _ => pairs(0),
    };
    ((word >> LEVEL_BITS) * PAIRS_PER_UNIT) as usize + blocks
}

/// Signed distance to the kerbs of one roundabout.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// South-west corner of the grid \[m].
    pub origin: Vec2,
    /// Cells in a metre [1/m].
    pub cells_per_metre: f32,
    /// Cells from west to east.
    pub columns: u32,
    /// Cells from south to north.
    pub rows: u32,
    /// One word per cell, `[rows, columns]`: `index << 8 | kind << 6 | ridge_level << 3 | level`. The cell's blocks
    /// begin at pair 2 `index` of `values`, one after the other; the first has 2^level sub-cells a side. Of a kind 1 (a
    /// ridge) the first block is for marching: it is coarse and does not exceed the distance. It is followed by two of
    /// 2^ridge_level sub-cells a side, whose lesser value is the distance. Kinds 2 and 3 have two blocks of one level,
    /// whose lesser or greater value is the distance. A cell deep in a solid refers to the first block of all.
    pub cells: Vec<u32>,
    /// Blocks of distances at the sub-cells' corners, in units of 1/2048 m, two to a word: the southern one in the
    /// lower 16 bits, signed, the northern one in the upper. A block has one row of pairs per row of sub-cells, from
    /// the south, and in it one pair per line of corners, from the west. So the four corners of a sub-cell are
    /// adjacent.
    pub values: Vec<u32>,
}

/// The field at several points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Samples<const N: usize> {
    /// Signed distance \[m].
    pub distance: [f32; N],
    /// Derivative to the east.
    pub east: [f32; N],
    /// Derivative to the north.
    pub north: [f32; N],
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
    /// Signed distance at `p`. Outside the grid everything is solid and the value keeps falling \[m].
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
            cell[n] = as_index(j) * self.columns + as_index(i);
        }
        let word = read(&self.cells, &cell);
        let (mut first, mut size, mut second) = ([0; N], [0.0; N], [0; N]);
        let mut paired = 0;
        for n in 0..N {
            let kind = word[n] >> KIND_SHIFT & KIND_MASK;
            let march_size = power_of_two(word[n] & LEVEL_MASK);
            let block = (word[n] >> LEVEL_BITS) * PAIRS_PER_UNIT;
            // Of a ridge the exact distance has its blocks behind the one for marching.
            let skipped = purpose == Purpose::Exact && kind == RIDGE;
            size[n] = if skipped { power_of_two(word[n] >> RIDGE_SHIFT & LEVEL_MASK) } else { march_size };
            first[n] = if skipped { block + n_pairs(march_size) } else { block };
            let two = if purpose == Purpose::Exact { RIDGE <= kind } else { LESSER <= kind };
            second[n] = if two { first[n] + n_pairs(size[n]) } else { 0 };
            paired |= second[n];
        }
        let mut samples = self.interpolated(&first, &size, &across, &up);
        if 0 < paired {
            for n in 0..N {
                if 0 < second[n] {
                    let other = self.interpolated(&[second[n]], &[size[n]], &[across[n]], &[up[n]]);
                    let greater = word[n] >> KIND_SHIFT & KIND_MASK == GREATER;
                    if (samples.distance[n] < other.distance[0]) == greater {
                        (samples.distance[n], samples.east[n], samples.north[n]) = (other.distance[0], other.east[0], other.north[0]);
                    }
                }
            }
        }
        samples
    }

    /// Blocks at `N` points: their first pairs, sub-cells a side, and fractions of the cell across and up.
    #[inline(always)]
    fn interpolated<const N: usize>(&self, first: &[u32; N], size: &[f32; N], across: &[f32; N], up: &[f32; N]) -> Samples<N> {
        let mut pair = [0; N];
        let (mut u, mut v) = ([0.0; N], [0.0; N]);
        for n in 0..N {
            let (x, y) = (across[n] * size[n], up[n] * size[n]);
            let (i, j) = (whole_part(x, size[n] - 1.0), whole_part(y, size[n] - 1.0));
            (u[n], v[n]) = (x - i, y - j);
            pair[n] = first[n] + as_index(j * (size[n] + 1.0) + i);
        }
        let west_pair = read(&self.values, &pair);
        let east_pair = read(&self.values[1..], &pair);
        let (mut distance, mut east, mut north) = ([0.0; N], [0.0; N], [0.0; N]);
        for n in 0..N {
            let scale = size[n] * self.cells_per_metre * UNIT;
            let (south_west, south_east) = (southern(west_pair[n]), southern(east_pair[n]));
            let (south_rise, north_rise) = (south_east - south_west, northern(east_pair[n]) - northern(west_pair[n]));
            let west_rise = northern(west_pair[n]) - south_west;
            let twist = north_rise - south_rise;
            distance[n] = UNIT * (south_west + u[n] * south_rise + v[n] * (west_rise + u[n] * twist));
            east[n] = (south_rise + v[n] * twist) * scale;
            north[n] = (west_rise + u[n] * twist) * scale;
        }
        Samples { distance, east, north }
    }

    /// Size of the tables \[bytes].
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
        // Its centre is a kink, within the range of the stated accuracy: both the coarsest and the finest blocks occur.
        let field = disc(4.0);
        let mut ends: Vec<(usize, usize)> = field
            .cells
            .iter()
            .map(|&word| (((word >> LEVEL_BITS) * PAIRS_PER_UNIT) as usize, end(word)))
            // The block of cells deep in a solid, if there are such cells or not.
            .chain([(0, 2)])
            .collect();
        ends.sort_unstable();
        ends.dedup();
        assert!(ends.windows(2).all(|pair| pair[0].1 == pair[1].0));
        assert_eq!((ends[0].0, ends[ends.len() - 1].1), (0, field.values.len()));
        assert!(ends.iter().any(|(begin, end)| end - begin == 2) && ends.iter().any(|(begin, end)| 50 < end - begin));
    }
}
