//! The signed distance to the kerbs as a table: positive on the drivable surface, negative in the solid area.
//!
//! A grid of square cells, each subdivided into a bilinear block of 1, 2, 4, ... sub-cells a side as its part of the
//! distance requires: one on a plain road, many where the nearest kerb changes or bends sharply. The blocks are stored
//! in flat arrays.

mod bake;

use glam::Vec2;

use crate::shared::constants;

constants! {
    /// Bits of a cell's word that hold the logarithm of its sub-cells a side; the rest is where its block begins.
    const LEVEL_BITS: u32 = 3;
}
/// 2^23. An f32 of this size has no fraction, so adding it to a smaller number leaves the integer part in the lower
/// bits.
const WHOLE: f32 = 8_388_608.0;
const WHOLE_BITS: u32 = 0x7f_ffff;

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
    /// One word per cell, `[rows, columns]`: `block << 3 | level`. `block` is the index of its first pair in `values`;
    /// the cell has 2^level sub-cells a side.
    pub cells: Vec<u32>,
    /// The same for sphere tracing through free space. Away from the kerbs a coarser block is used wherever it does not
    /// exceed the distance, because a march may underestimate it. So the finest blocks, at kinks between two kerbs, are
    /// not read there.
    pub march_cells: Vec<u32>,
    /// Blocks of distances at the sub-cells' corners \[m]. A block has one row of pairs per row of sub-cells, from the
    /// south, and in it one pair per line of corners, from the west: the distances at the row's southern and northern
    /// edge. So the four corners of a sub-cell are adjacent.
    pub values: Vec<[f32; 2]>,
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

impl Field {
    /// Signed distance at `p`. Outside the grid everything is solid and the value keeps falling \[m].
    ///
    /// Up to 5 m from a kerb the error is at most 1 cm, or 3 cm within 0.5 m of a kink of the distance; on a smooth
    /// kerb it is at most 1 mm.
    #[inline]
    pub fn distance(&self, p: Vec2) -> f32 {
        let extent = Vec2::new(self.columns as f32, self.rows as f32) / self.cells_per_metre;
        let outside = (self.origin - p).max(p - self.origin - extent).max(Vec2::ZERO);
        self.sample(&self.cells, &[p.x], &[p.y]).distance[0] - outside.length()
    }

    /// The field at `N` points, by `cells` or `march_cells`. A point outside the grid, or a NaN, reads the border.
    #[inline(always)]
    pub(crate) fn sample<const N: usize>(&self, cells: &[u32], x: &[f32; N], y: &[f32; N]) -> Samples<N> {
        let (last_column, last_row) = (self.columns as f32 - 1.0, self.rows as f32 - 1.0);
        let (mut column, mut row) = ([0; N], [0; N]);
        let (mut across, mut up) = ([0.0; N], [0.0; N]);
        for n in 0..N {
            let u = clamped((x[n] - self.origin.x) * self.cells_per_metre, self.columns as f32);
            let v = clamped((y[n] - self.origin.y) * self.cells_per_metre, self.rows as f32);
            let (i, j) = (whole_part(u, last_column), whole_part(v, last_row));
            (across[n], up[n]) = (u - i, v - j);
            (column[n], row[n]) = (as_index(i), as_index(j));
        }
        let mut word = [0; N];
        for n in 0..N {
            word[n] = cells[(row[n] * self.columns + column[n]) as usize];
        }
        let (mut pair, mut size) = ([0; N], [0.0; N]);
        for n in 0..N {
            // 2^level, from its exponent bits.
            size[n] = f32::from_bits(((word[n] & ((1 << LEVEL_BITS) - 1)) << 23) + 1.0f32.to_bits());
            let (u, v) = (across[n] * size[n], up[n] * size[n]);
            let (i, j) = (whole_part(u, size[n] - 1.0), whole_part(v, size[n] - 1.0));
            (across[n], up[n]) = (u - i, v - j);
            pair[n] = (word[n] >> LEVEL_BITS) + as_index(j * (size[n] + 1.0) + i);
        }
        let (mut south_west, mut north_west, mut south_east, mut north_east) = ([0.0; N], [0.0; N], [0.0; N], [0.0; N]);
        for n in 0..N {
            let corners = &self.values[pair[n] as usize..][..2];
            [south_west[n], north_west[n]] = corners[0];
            [south_east[n], north_east[n]] = corners[1];
        }
        let (mut distance, mut east, mut north) = ([0.0; N], [0.0; N], [0.0; N]);
        for n in 0..N {
            let scale = size[n] * self.cells_per_metre;
            let (south_rise, north_rise) = (south_east[n] - south_west[n], north_east[n] - north_west[n]);
            let west_rise = north_west[n] - south_west[n];
            let twist = north_rise - south_rise;
            distance[n] = south_west[n] + across[n] * south_rise + up[n] * (west_rise + across[n] * twist);
            east[n] = (south_rise + up[n] * twist) * scale;
            north[n] = (west_rise + across[n] * twist) * scale;
        }
        Samples { distance, east, north }
    }

    /// Size of the tables \[bytes].
    pub fn bytes(&self) -> usize {
        size_of_val(self.cells.as_slice()) + size_of_val(self.march_cells.as_slice()) + size_of_val(self.values.as_slice())
    }
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
        let together = field.sample(&field.cells, &x, &y).distance;
        for n in 0..16 {
            assert_eq!(field.sample(&field.cells, &[x[n]], &[y[n]]).distance[0].to_bits(), together[n].to_bits());
        }
    }

    #[test]
    fn the_slope_points_away_from_the_kerb_and_is_one() {
        let field = disc(9.0);
        for direction in (0..100).map(|n| Vec2::from_angle(0.063 * n as f32)) {
            for radius in [3.0, 8.0, 8.95, 9.05] {
                let p = radius * direction;
                let Samples { east, north, .. } = field.sample(&field.cells, &[p.x], &[p.y]);
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
        let mut ends: Vec<(u32, u32)> = field
            .cells
            .iter()
            .chain(&field.march_cells)
            .map(|word| {
                let size = 1 << (word & ((1 << LEVEL_BITS) - 1));
                (word >> LEVEL_BITS, (word >> LEVEL_BITS) + size * (size + 1))
            })
            .collect();
        ends.sort_unstable();
        // Where marching needs no other block both tables have the same one.
        ends.dedup();
        assert!(ends.windows(2).all(|pair| pair[0].1 == pair[1].0));
        assert_eq!((ends[0].0, ends[ends.len() - 1].1), (0, field.values.len() as u32));
        assert!(ends.iter().any(|(begin, end)| end - begin == 2) && ends.iter().any(|(begin, end)| 50 < end - begin));
    }
}
