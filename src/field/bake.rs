//! Fills a field: every cell gets the fewest sub-cells whose interpolation is close enough to the exact distance.

use glam::{DVec2, Vec2};
use rayon::prelude::*;

use super::{Field, LEVEL_BITS};
use crate::geometry::{Nearby, Outline};

/// Solid ground kept around the outline \[m].
const MARGIN: f64 = 1.0;
/// Finest sub-cell \[m]. A kink in the middle of one is off by half of it: 1.6 cm.
const FINEST: f64 = 1.0 / 32.0;
/// Cells a side of a tile; its cells use one culled outline.
const TILE: usize = 4;
/// Up to this distance from a kerb a ray may end, and a grazing ray multiplies the error by 11 \[m].
const SURFACE: f64 = 0.4;
/// Largest error there \[m].
const SURFACE_TOLERANCE: f64 = 5e-4;
/// Up to this distance from a kerb the stated accuracy holds \[m].
const PROMISED: f64 = 6.0;
/// Largest error there except at kinks \[m].
const TOLERANCE: f64 = 8e-3;

/// In sub-cells up to this width an error above [`TOLERANCE`] is that of a kink: a kerb bend of 0.2 m radius is
/// interpolated better \[m].
const KINK: f64 = 0.125;
/// Largest error there at the sampled points, so that between them it stays below 3 cm \[m].
const KINK_TOLERANCE: f64 = 0.018;

/// One cell's block.
struct Block {
    level: u32,
    values: Vec<[f32; 2]>,
}

/// A cell's blocks: an exact one, and a coarser one for marching where that suffices.
struct Blocks {
    exact: Block,
    march: Option<Block>,
}

impl Field {
    /// The field of `outline` in cells of `cell` metres a side, computed on all cores. The cell width changes the
    /// layout, not the accuracy.
    pub fn bake(outline: &Outline, cell: f64) -> Field {
        let (low, high) = outline.bounds();
        let origin = low - MARGIN;
        let count = |extent: f64| ((extent + 2.0 * MARGIN) / cell).ceil().max(1.0) as usize;
        let (columns, rows) = (count(high.x - low.x), count(high.y - low.y));
        let (across, up) = (columns.div_ceil(TILE), rows.div_ceil(TILE));
        let tiles: Vec<Vec<(usize, Blocks)>> = (0..across * up)
            .into_par_iter()
            .map(|tile| {
                let (left, bottom) = (tile % across * TILE, tile / across * TILE);
                let half = TILE as f64 * cell / 2.0;
                let centre = origin + DVec2::new(left as f64, bottom as f64) * cell + half;
                let nearby = outline.near(centre, half * std::f64::consts::SQRT_2 + 1e-9);
                let inside =
                    (bottom..rows.min(bottom + TILE)).flat_map(|row| (left..columns.min(left + TILE)).map(move |column| (row, column)));
                inside
                    .map(|(row, column)| {
                        (row * columns + column, blocks(&nearby, origin + DVec2::new(column as f64, row as f64) * cell, cell))
                    })
                    .collect()
            })
            .collect();
        let (mut cells, mut march_cells, mut values) = (vec![0; columns * rows], vec![0; columns * rows], Vec::new());
        // The blocks that marches read come first, for locality.
        for (index, blocks) in tiles.iter().flatten() {
            march_cells[*index] = placed(&mut values, blocks.march.as_ref().unwrap_or(&blocks.exact));
        }
        for (index, blocks) in tiles.iter().flatten() {
            cells[*index] = if blocks.march.is_some() { placed(&mut values, &blocks.exact) } else { march_cells[*index] };
        }
        Field {
            origin: Vec2::new(origin.x as f32, origin.y as f32),
            cells_per_metre: (1.0 / cell) as f32,
            columns: columns as u32,
            rows: rows as u32,
            cells,
            march_cells,
            values,
        }
    }
}

/// Appends a block's values and returns the cell's word.
fn placed(values: &mut Vec<[f32; 2]>, block: &Block) -> u32 {
    let word = (values.len() as u32) << LEVEL_BITS | block.level;
    values.extend_from_slice(&block.values);
    word
}

/// The blocks of the cell with its south-western corner at `corner`.
fn blocks(nearby: &Nearby, corner: DVec2, cell: f64) -> Blocks {
    let middle = nearby.signed_distance(corner + cell / 2.0);
    let promised = middle.abs() < PROMISED + cell;
    let exact = block(nearby, corner, cell, |error, exact, step| !promised || error.abs() <= tolerance(exact, step));
    // Beyond the zone around a kerb in every point of the cell.
    let free = SURFACE + cell < middle;
    let march = (free && 0 < exact.level).then(|| block(nearby, corner, cell, |error, _, _| error <= TOLERANCE));
    Blocks { march: march.filter(|march| march.level < exact.level), exact }
}

/// Largest error where the distance is `exact` and sub-cells are `step` wide \[m].
fn tolerance(exact: f64, step: f64) -> f64 {
    if exact.abs() < SURFACE {
        SURFACE_TOLERANCE
    } else if step <= KINK {
        KINK_TOLERANCE
    } else {
        TOLERANCE
    }
}

/// The coarsest block whose errors are all allowed, else the finest. The arguments of `allowed` are the interpolation's
/// error, the exact distance and the sub-cells' width \[m].
fn block(nearby: &Nearby, corner: DVec2, cell: f64, allowed: impl Fn(f64, f64, f64) -> bool) -> Block {
    let finest = (cell / FINEST).log2().ceil().clamp(0.0, f64::from((1 << LEVEL_BITS) - 1)) as u32;
    let mut level = 0;
    loop {
        let size = 1 << level;
        let step = cell / f64::from(size);
        let lines = size as usize + 1;
        let at = |index: usize| corner + DVec2::new((index % lines) as f64, (index / lines) as f64) * step;
        let nodes: Vec<f64> = (0..lines * lines).map(|index| nearby.signed_distance(at(index))).collect();
        let sub_cells = || (0..lines - 1).flat_map(|row| (0..lines - 1).map(move |column| row * lines + column));
        let close = |first: usize| {
            let corners = [nodes[first], nodes[first + 1], nodes[first + lines], nodes[first + lines + 1]];
            errors(nearby, at(first), step, corners).all(|(error, exact)| allowed(error, exact, step))
        };
        if level == finest || sub_cells().all(close) {
            let pairs = (0..lines * (lines - 1)).map(|index| [nodes[index] as f32, nodes[index + lines] as f32]);
            return Block { level, values: pairs.collect() };
        }
        level += 1;
    }
}

/// The error of interpolation between the corners of a sub-cell, and the exact distance, at points all over it \[m].
fn errors(
    nearby: &Nearby,
    corner: DVec2,
    step: f64,
    [south_west, south_east, north_west, north_east]: [f64; 4],
) -> impl Iterator<Item = (f64, f64)> {
    // In smooth parts the error is largest in the middle or on an edge; a kink across a corner shows at the point near
    // that corner.
    const POINTS: [(f64, f64); 9] =
        [(0.5, 0.5), (0.2, 0.2), (0.8, 0.8), (0.2, 0.8), (0.8, 0.2), (0.5, 0.0), (0.0, 0.5), (0.5, 1.0), (1.0, 0.5)];
    POINTS.into_iter().map(move |(u, v)| {
        let exact = nearby.signed_distance(corner + DVec2::new(u, v) * step);
        let (south, north) = (south_west + u * (south_east - south_west), north_west + u * (north_east - north_west));
        (south + v * (north - south) - exact, exact)
    })
}
