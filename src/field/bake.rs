//! Fills a field: every cell gets the smallest blocks whose interpolation is close enough to the exact distance.

use glam::{DVec2, Vec2};
use rayon::prelude::*;

use super::{Field, Kind, STORED_UNIT, TILE_COLUMNS, TILE_ROWS, cell_index, elsewhere};
use crate::geometry::{Nearby, Outline};

/// Solid ground kept around the outline (m).
const MARGIN: f64 = 1.0;
/// Finest sub-cell (m). A kink in the middle of one is off by half of it: 1.6 cm.
const FINEST: f64 = 1.0 / 32.0;
/// Cells a side of a region that is skipped as a whole where it is deep in a solid.
const REGION: usize = 16;
/// Up to this distance from a kerb a ray may end, and a grazing ray multiplies the error by 11 (m).
const SURFACE: f64 = 0.4;
/// Largest error there (m).
const SURFACE_TOLERANCE: f64 = 6e-4;
/// Up to this distance from a kerb the stated accuracy holds (m).
const PROMISED: f64 = 6.0;
/// Largest error there except at kinks (m).
const TOLERANCE: f64 = 8e-3;
/// Deepest value stored in a solid: cells that are deeper share one block (m).
const DEEP: f64 = 7.5;
/// Largest value stored. It is a lower bound of the distance, and longer than any step of a march (m).
const FAR: f64 = 15.9;

/// In sub-cells up to this width an error above [`TOLERANCE`] is that of a kink: a kerb bend of 0.2 m radius is
/// interpolated better (m).
const KINK: f64 = 0.125;
/// Largest error there at the sampled points, so that between them it stays below 3 cm (m).
const KINK_TOLERANCE: f64 = 0.018;
/// Two kerbs whose gradients have a smaller product than this make a kink.
const APART: f64 = 0.95;
/// Levels up to which two blocks are tried in place of one.
const PAIRED_LEVELS: u32 = 4;

/// A bilinear block: 2^level sub-cells a side.
#[derive(Debug, Clone, PartialEq)]
struct Block {
    level: u32,
    /// Distances at the corners in units of the field, row by row from the south-west.
    nodes: Vec<i16>,
}

/// The blocks of one cell.
#[derive(Debug, Clone)]
enum Cell {
    /// Deeper in a solid than any value that is stored.
    Deep,
    /// One block.
    Single(Block),
    /// A coarse block that does not exceed the distance, for marching; the distance is the lesser of the two others.
    Ridge(Block, [Block; 2]),
    /// The lesser of two blocks.
    Lesser([Block; 2]),
    /// The greater of two blocks.
    Greater([Block; 2]),
}

impl Field {
    /// The field of `outline` in cells of `cell` metres a side, computed on all cores. The cell width changes the
    /// layout, not the accuracy.
    pub fn bake(outline: &Outline, cell: f64) -> Field {
        let (low, high) = outline.bounds();
        let origin = low - MARGIN;
        let count = |extent: f64, tile: u32| {
            (((extent + 2.0 * MARGIN) / cell).ceil().max(1.0) as usize).next_multiple_of(tile as usize)
        };
        let (columns, rows) = (count(high.x - low.x, TILE_COLUMNS), count(high.y - low.y, TILE_ROWS));
        let (across, up) = (columns.div_ceil(REGION), rows.div_ceil(REGION));
        let grid = Grid { origin, cell, columns, rows };
        let regions: Vec<Vec<(usize, Cell)>> = (0..across * up)
            .into_par_iter()
            .map(|region| {
                let (column, row) = (region % across * REGION, region / across * REGION);
                let (centre, radius) = grid.circle(column, row, REGION);
                let mut cells = Vec::new();
                grid.fill(&outline.near(centre, radius), column, row, REGION, &mut cells);
                cells
            })
            .collect();
        let deep = Block { level: 0, nodes: vec![stored(-DEEP); 4] };
        let mut values = Vec::new();
        placed(&mut values, &deep);
        let mut cells = vec![deep.as_cell(); columns * rows];
        for (index, found) in regions.iter().flatten() {
            cells[*index] = match found {
                Cell::Deep => continue,
                Cell::Single(block) if block.level == 0 => block.as_cell(),
                Cell::Single(block) => elsewhere(Kind::Single, block.level, 0, placed(&mut values, block)),
                Cell::Ridge(march, [one, other]) => {
                    let first = placed(&mut values, march);
                    placed(&mut values, one);
                    placed(&mut values, other);
                    elsewhere(Kind::Ridge, march.level, one.level, first)
                }
                Cell::Lesser([one, other]) | Cell::Greater([one, other]) => {
                    let first = placed(&mut values, one);
                    placed(&mut values, other);
                    let kind = if matches!(found, Cell::Lesser(_)) { Kind::Lesser } else { Kind::Greater };
                    elsewhere(kind, one.level, 0, first)
                }
            };
        }
        Field {
            origin: Vec2::new(origin.x as f32, origin.y as f32),
            cells_per_metre: (1.0 / cell) as f32,
            columns: columns as u32,
            rows: rows as u32,
            cells,
            values,
        }
    }
}

/// Where the cells lie.
struct Grid {
    origin: DVec2,
    cell: f64,
    columns: usize,
    rows: usize,
}

impl Grid {
    /// South-western corner of a cell.
    fn corner(&self, column: usize, row: usize) -> DVec2 {
        self.origin + DVec2::new(column as f64, row as f64) * self.cell
    }

    /// A circle around `size` by `size` cells.
    fn circle(&self, column: usize, row: usize, size: usize) -> (DVec2, f64) {
        let half = size as f64 * self.cell / 2.0;
        (self.corner(column, row) + half, half * std::f64::consts::SQRT_2 + 1e-9)
    }

    /// Appends the cells of a square region that are not deep in a solid, with their indices. The square is halved down
    /// to single cells, and the outline culled with it.
    fn fill(&self, nearby: &Nearby, column: usize, row: usize, size: usize, cells: &mut Vec<(usize, Cell)>) {
        if self.columns <= column || self.rows <= row {
            return;
        }
        let (centre, radius) = self.circle(column, row, size);
        if nearby.signed_distance(centre) + radius < -DEEP {
            return;
        }
        if size == 1 {
            cells.push((
                cell_index(self.columns as u32, column as u32, row as u32) as usize,
                found(nearby, self.corner(column, row), self.cell),
            ));
            return;
        }
        let half = size / 2;
        for (right, above) in [(0, 0), (half, 0), (0, half), (half, half)] {
            let (column, row) = (column + right, row + above);
            let (centre, radius) = self.circle(column, row, half);
            self.fill(&nearby.near(centre, radius), column, row, half, cells);
        }
    }
}

impl Block {
    /// Pairs of a southern and a northern value, row by row.
    fn pairs(&self) -> impl Iterator<Item = u32> {
        let lines = (1 << self.level) + 1;
        let half = |index: usize| u32::from(self.nodes[index] as u16);
        (0..lines * (lines - 1)).map(move |index| half(index) | half(index + lines) << 16)
    }

    /// A block of one sub-cell as a cell.
    fn as_cell(&self) -> [u32; 2] {
        let mut pairs = self.pairs();
        [pairs.next().unwrap_or_default(), pairs.next().unwrap_or_default()]
    }
}

/// Appends a block's values and returns the index of its first pair.
fn placed(values: &mut Vec<u32>, block: &Block) -> u32 {
    let first = values.len() as u32;
    values.extend(block.pairs());
    first
}

/// A distance as it is stored.
fn stored(distance: f64) -> i16 {
    (distance.clamp(-DEEP, FAR) / f64::from(STORED_UNIT)).round() as i16
}

/// The blocks of the cell with its south-western corner at `corner`.
fn found(nearby: &Nearby, corner: DVec2, cell: f64) -> Cell {
    let exact = |p: DVec2| nearby.signed_distance(p);
    let middle = exact(corner + cell / 2.0);
    if middle < -DEEP - cell {
        return Cell::Deep;
    }
    let square = Square { corner, cell };
    if PROMISED + cell <= middle.abs() {
        return Cell::Single(square.block(0, exact));
    }
    let close = |block: &Block| {
        let step = square.step(block.level);
        square.errors(block, exact).all(|(error, exact)| error.abs() <= tolerance(exact, step))
    };
    let finest = (cell / FINEST).log2().ceil().clamp(0.0, 7.0) as u32;
    // Two blocks take 16 bytes and more: where 24 suffice for one, they are not searched for.
    let simple = finest.min(1);
    let coarsest =
        |mut levels: std::ops::Range<u32>| levels.find_map(|level| Some(square.block(level, exact)).filter(close));
    if let Some(block) = coarsest(0..simple + 1) {
        return Cell::Single(block);
    }
    if let Some(cell) = kinked(nearby, &square, SURFACE + cell < middle) {
        return cell;
    }
    // The finest one is as close as it gets.
    Cell::Single(coarsest(simple + 1..finest).unwrap_or_else(|| square.block(finest, exact)))
}

/// Largest error where the distance is `exact` and sub-cells are `step` wide (m).
fn tolerance(exact: f64, step: f64) -> f64 {
    if exact.abs() < SURFACE {
        SURFACE_TOLERANCE
    } else if step <= KINK {
        KINK_TOLERANCE
    } else {
        TOLERANCE
    }
}

/// Two blocks for a cell that two kerbs are near to, where they are close enough. `free` says that no ray ends in it.
fn kinked(nearby: &Nearby, square: &Square, free: bool) -> Option<Cell> {
    let sides = sides(nearby, square)?;
    let exact = |p: DVec2| nearby.signed_distance(p);
    (0..=PAIRED_LEVELS).find_map(|level| {
        let blocks = [0, 1].map(|side| square.block(level, |p| extended(nearby, &sides[side], p)));
        let allowed = |exact: f64| if exact.abs() < SURFACE { SURFACE_TOLERANCE } else { TOLERANCE };
        let close = |joined: fn(f64, f64) -> f64| {
            let values =
                square.values(&blocks[0]).zip(square.values(&blocks[1])).map(|(one, other)| joined(one, other));
            values.zip(square.sampled(level, exact)).all(|(value, exact)| (value - exact).abs() <= allowed(exact))
        };
        if close(f64::min) {
            Some(if free { Cell::Ridge(marched(square, exact), blocks) } else { Cell::Lesser(blocks) })
        } else if close(f64::max) {
            Some(Cell::Greater(blocks))
        } else {
            None
        }
    })
}

/// The coarsest block that does not exceed the distance.
fn marched(square: &Square, exact: impl Fn(DVec2) -> f64 + Copy) -> Block {
    let mut level = 0;
    loop {
        let block = square.block(level, exact);
        if level == PAIRED_LEVELS || square.errors(&block, exact).all(|(error, _)| error <= TOLERANCE) {
            return block;
        }
        level += 1;
    }
}

/// The pieces that are nearest somewhere in the square, in two groups by the direction away from them; `None` where all
/// directions are alike.
fn sides(nearby: &Nearby, square: &Square) -> Option<[Vec<usize>; 2]> {
    const LINES: usize = 7;
    let points = (0..LINES * LINES).map(|index| {
        let (u, v) = ((index % LINES) as f64, (index / LINES) as f64);
        square.corner + DVec2::new(u, v) * (square.cell / (LINES - 1) as f64)
    });
    let seen: Vec<(usize, DVec2)> = points
        .map(|p| {
            let piece = nearby.nearest_piece(p);
            (piece, nearby.extended(piece, p).1)
        })
        .collect();
    let pairs = (0..seen.len()).flat_map(|one| (0..one).map(move |other| (one, other)));
    let product = |&(one, other): &(usize, usize)| seen[one].1.dot(seen[other].1);
    let (one, other) = pairs.min_by(|a, b| product(a).total_cmp(&product(b)))?;
    if APART < product(&(one, other)) {
        return None;
    }
    let mut sides = [Vec::new(), Vec::new()];
    let mut pieces: Vec<usize> = seen.iter().map(|(piece, _)| *piece).collect();
    pieces.sort_unstable();
    pieces.dedup();
    for piece in pieces {
        let away: DVec2 = seen.iter().filter(|(other, _)| *other == piece).map(|(_, away)| *away).sum();
        sides[usize::from(away.dot(seen[one].1) < away.dot(seen[other].1))].push(piece);
    }
    sides.iter().all(|side| !side.is_empty()).then_some(sides)
}

/// Signed distance from `p` to a group of pieces, extended beyond the group's ends (m).
fn extended(nearby: &Nearby, pieces: &[usize], p: DVec2) -> f64 {
    let nearest =
        pieces.iter().copied().min_by(|&a, &b| nearby.piece_distance(a, p).total_cmp(&nearby.piece_distance(b, p)));
    nearest.map_or(0.0, |piece| nearby.extended(piece, p).0)
}

/// A cell's place.
struct Square {
    corner: DVec2,
    cell: f64,
}

impl Square {
    /// The block of `distance` at a level.
    fn block(&self, level: u32, distance: impl Fn(DVec2) -> f64) -> Block {
        let lines = (1 << level) + 1;
        let step = self.step(level);
        let at = |index: usize| self.corner + DVec2::new((index % lines) as f64, (index / lines) as f64) * step;
        Block { level, nodes: (0..lines * lines).map(|index| stored(distance(at(index)))).collect() }
    }

    /// What a block interpolates to at points all over it (m).
    fn values(&self, block: &Block) -> impl Iterator<Item = f64> {
        points(block.level).map(move |(column, row, u, v)| {
            let lines = (1 << block.level) + 1;
            let node = |right: usize, above: usize| {
                f64::from(block.nodes[(row + above) * lines + column + right]) * f64::from(STORED_UNIT)
            };
            let (south, north) =
                (node(0, 0) + u * (node(1, 0) - node(0, 0)), node(0, 1) + u * (node(1, 1) - node(0, 1)));
            south + v * (north - south)
        })
    }

    /// `distance` there, as far as it is stored (m).
    fn sampled(&self, level: u32, distance: impl Fn(DVec2) -> f64) -> impl Iterator<Item = f64> {
        let step = self.step(level);
        points(level).map(move |(column, row, u, v)| {
            distance(self.corner + DVec2::new(column as f64 + u, row as f64 + v) * step).clamp(-DEEP, FAR)
        })
    }

    /// The error of a block there, and the exact distance (m).
    fn errors(&self, block: &Block, exact: impl Fn(DVec2) -> f64) -> impl Iterator<Item = (f64, f64)> {
        self.values(block).zip(self.sampled(block.level, exact)).map(|(value, exact)| (value - exact, exact))
    }

    /// Width of a level's sub-cells (m).
    fn step(&self, level: u32) -> f64 {
        self.cell / f64::from(1 << level)
    }
}

/// Points all over the sub-cells of a block: column, row, and fractions of the sub-cell.
fn points(level: u32) -> impl Iterator<Item = (usize, usize, f64, f64)> {
    // In smooth parts the error is largest in the middle or on an edge; a kink across a corner shows at the point near
    // that corner.
    const POINTS: [(f64, f64); 9] =
        [(0.5, 0.5), (0.2, 0.2), (0.8, 0.8), (0.2, 0.8), (0.8, 0.2), (0.5, 0.0), (0.0, 0.5), (0.5, 1.0), (1.0, 0.5)];
    // A cell that is one sub-cell is sampled as if it were four: it is large beside what may lie in it.
    let parts = if level == 0 { 2 } else { 1 };
    let size = (1usize << level) * parts;
    (0..size * size).flat_map(move |index| {
        POINTS.into_iter().map(move |(u, v)| {
            let (column, row) = (index % size, index / size);
            let within = |part: usize, fraction: f64| ((part % parts) as f64 + fraction) / parts as f64;
            (column / parts, row / parts, within(column, u), within(row, v))
        })
    })
}
