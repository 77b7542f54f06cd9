//! Things in square cells of the plane, to find those near a point.

use std::collections::HashMap;

use glam::DVec2;

/// Things in square cells.
#[derive(Debug)]
pub(super) struct Cells<T> {
    /// Width of a cell (m).
    width: f64,
    cells: HashMap<(i64, i64), Vec<T>>,
}

impl<T> Cells<T> {
    /// Empty cells of a width (m).
    pub(super) fn new(width: f64) -> Cells<T> {
        Cells { width, cells: HashMap::new() }
    }

    /// Column and row of the cell that a point lies in.
    pub(super) fn cell(&self, p: DVec2) -> (i64, i64) {
        ((p.x / self.width).floor() as i64, (p.y / self.width).floor() as i64)
    }

    /// Adds a thing to the cell of a point.
    pub(super) fn insert(&mut self, p: DVec2, thing: T) {
        self.insert_at(self.cell(p), thing);
    }

    /// Adds a thing to a cell.
    pub(super) fn insert_at(&mut self, cell: (i64, i64), thing: T) {
        self.cells.entry(cell).or_default().push(thing);
    }

    /// The things in a cell.
    pub(super) fn at(&self, cell: (i64, i64)) -> impl Iterator<Item = &T> {
        self.cells.get(&cell).into_iter().flatten()
    }

    /// The things in the cell of a point and in the eight around it: all those within a cell's width of it.
    pub(super) fn around(&self, p: DVec2) -> impl Iterator<Item = &T> {
        let (column, row) = self.cell(p);
        let near = (-1..=1).flat_map(move |x| (-1..=1).map(move |y| (column.saturating_add(x), row.saturating_add(y))));
        near.flat_map(|cell| self.at(cell))
    }

    /// The things in the cells that a rectangle touches, given by its corners.
    pub(super) fn within(&self, low: DVec2, high: DVec2) -> impl Iterator<Item = &T> {
        let (low, high) = (self.cell(low), self.cell(high));
        (low.0..=high.0).flat_map(move |column| (low.1..=high.1).flat_map(move |row| self.at((column, row))))
    }
}
