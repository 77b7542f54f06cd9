//! 95 % intervals of a mean over routes by bootstrap: routes are drawn with replacement, each with all its episodes.
//!
//! Episodes of one route have nearly the same start and end alike, so that 30 of them are not 30 samples, as Wilson's
//! interval takes them. Whole routes are drawn, since episodes drawn anew within them would be counted twice in the
//! variance (A. Davison and D. Hinkley, "Bootstrap Methods and their Application", 1997, section 3.8). Where there are
//! several training seeds they are drawn too, and every seed drawn has the same routes (A. Owen, "The pigeonhole
//! bootstrap", 2007). Percentiles lie as far out as Student's t asks for so few routes and seeds (T. Hesterberg, "What
//! Teachers Should Know About the Bootstrap", 2015). Draws are a function of their counters: equal figures have equal
//! intervals, on any number of threads.

use std::collections::HashMap;

use offtrack::layout::random;
use rayon::prelude::*;

use crate::seeds::student_t;

/// Resamples, but of so many routes that they would take [`MOST_DRAWS`] draws.
const RESAMPLES: usize = 10_000;
/// Resamples of any number of routes.
const FEWEST_RESAMPLES: usize = 1000;
/// Draws of all resamples, about.
const MOST_DRAWS: usize = 20_000_000;
/// Seed of the draws.
const SEED: u32 = 0;

/// A figure's sum over some episodes, and their number.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Cell {
    sum: f64,
    n: f64,
}

/// A figure of the episodes of each training seed on each route.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    n_routes: usize,
    /// `[n_seeds][n_routes]`
    cells: Vec<Cell>,
    /// The least and the greatest figure of an episode.
    range: [f64; 2],
}

/// The range of no episode.
const NO_RANGE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

fn widened([least, greatest]: [f64; 2], value: f64) -> [f64; 2] {
    [least.min(value), greatest.max(value)]
}

impl Cells {
    /// No episode yet, of `n_seeds` seeds on `n_routes` routes.
    pub fn new(n_seeds: usize, n_routes: usize) -> Cells {
        Cells { n_routes, cells: vec![Cell::default(); n_seeds * n_routes], range: NO_RANGE }
    }

    /// Of one seed: a route, by any number of its own, and the figure of each episode.
    pub fn of_routes(episodes: impl Iterator<Item = (u32, f64)>) -> Cells {
        let (mut indices, mut cells, mut range) = (HashMap::new(), Vec::new(), NO_RANGE);
        for (route, value) in episodes {
            range = widened(range, value);
            let index = *indices.entry(route).or_insert_with(|| {
                cells.push(Cell::default());
                cells.len() - 1
            });
            cells[index] = plus(cells[index], Cell { sum: value, n: 1.0 });
        }
        Cells { n_routes: cells.len(), cells, range }
    }

    /// Adds an episode.
    pub fn add(&mut self, seed: usize, route: usize, value: f64) {
        let cell = &mut self.cells[seed * self.n_routes + route];
        *cell = plus(*cell, Cell { sum: value, n: 1.0 });
        self.range = widened(self.range, value);
    }

    /// Number of routes.
    pub fn n_routes(&self) -> usize {
        self.n_routes
    }

    /// Episodes of all seeds.
    pub fn episodes(&self) -> usize {
        self.total().n as usize
    }

    /// Mean of all episodes; `None` without one.
    pub fn mean(&self) -> Option<f64> {
        let Cell { sum, n } = self.total();
        (0.0 < n).then(|| sum / n)
    }

    /// The 95 % interval of the mean. `None` without an episode, and of one seed on one route.
    pub fn interval(&self) -> Option<(f64, f64)> {
        interval(&[(1.0, self)])
    }

    /// The 95 % interval of this mean less that of `other` on the same routes, drawn together.
    pub fn interval_of_difference(&self, other: &Cells) -> Option<(f64, f64)> {
        interval(&[(1.0, self), (-1.0, other)])
    }

    fn n_seeds(&self) -> usize {
        self.cells.len() / self.n_routes.max(1)
    }

    fn total(&self) -> Cell {
        self.cells.iter().copied().fold(Cell::default(), plus)
    }

    /// How far each of `n` parts of the cells moves the mean, from the mean's own place: `part` is that of a cell by
    /// seed and route.
    fn moves(&self, n: usize, part: impl Fn(usize, usize) -> usize) -> Vec<f64> {
        let Cell { sum, n: total } = self.total();
        let mut moves = vec![0.0; n];
        for (index, cell) in self.cells.iter().enumerate() {
            moves[part(index / self.n_routes, index % self.n_routes)] +=
                (cell.sum - sum / total * cell.n) * n as f64 / total;
        }
        moves
    }

    /// The mean of a resample: `routes` by index, and seeds drawn by themselves.
    fn resampled(&self, routes: &[usize], resample: u32, stream: u32) -> f64 {
        let mut total = Cell::default();
        for seed in drawn(self.n_seeds(), resample, stream) {
            let row = &self.cells[seed * self.n_routes..][..self.n_routes];
            total = routes.iter().fold(total, |total, &route| plus(total, row[route]));
        }
        total.sum / total.n
    }
}

fn plus(a: Cell, b: Cell) -> Cell {
    Cell { sum: a.sum + b.sum, n: a.n + b.n }
}

/// `n` indices below `n`, with replacement.
fn drawn(n: usize, resample: u32, stream: u32) -> impl Iterator<Item = usize> {
    let words = move |block: usize| random::words(SEED, resample, block as u32, stream);
    (0..n.div_ceil(4)).flat_map(words).take(n).map(move |word| random::index_below(word, n as u32) as usize)
}

/// The sum of means, each times its factor, in every resample that has an episode of each.
fn resamples(sides: &[(f64, &Cells)]) -> Vec<f64> {
    let n_routes = sides[0].1.n_routes;
    let draws: usize = sides.iter().map(|(_, cells)| cells.cells.len()).sum();
    let n = (MOST_DRAWS / draws.max(1)).clamp(FEWEST_RESAMPLES, RESAMPLES);
    let one = |routes: &mut Vec<usize>, resample: u32| {
        routes.clear();
        routes.extend(drawn(n_routes, resample, 0));
        sides.iter().zip(1..).map(|((factor, cells), stream)| factor * cells.resampled(routes, resample, stream)).sum()
    };
    let all = (0..n as u32).into_par_iter().with_min_len(64).map_init(Vec::new, one);
    all.filter(|value: &f64| value.is_finite()).collect()
}

/// The 95 % interval of the sum of means, each times its factor.
fn interval(sides: &[(f64, &Cells)]) -> Option<(f64, f64)> {
    let means: Option<Vec<f64>> = sides.iter().map(|(factor, cells)| Some(factor * cells.mean()?)).collect();
    let value: f64 = means?.iter().sum();
    let Spread { tail, half } = spread(sides)?;
    if half == 0.0 {
        return Some((value, value));
    }
    let mut found = resamples(sides);
    found.sort_by(f64::total_cmp);
    let n_left_out = (tail * found.len() as f64) as usize;
    if n_left_out == 0 {
        // So few seeds or routes that no resample lies as far out: Student's, within what there can be.
        let end = |of: usize| -> f64 {
            sides.iter().map(|(factor, cells)| factor * cells.range[if *factor < 0.0 { 1 - of } else { of }]).sum()
        };
        return Some(((value - half).max(end(0)), (value + half).min(end(1))));
    }
    let last = found.len().checked_sub(1)?;
    let (low, high) = (found[n_left_out], found[last - n_left_out]);
    // Of few resamples the quantiles must not exclude the value itself.
    Some((low.min(value), high.max(value)))
}

/// How widely means are spread.
struct Spread {
    /// The fraction of resamples to leave out at each end.
    tail: f64,
    /// Half of Student's 95 % interval; 0 where no route and no seed differs from another.
    half: f64,
}

/// The spread of the sum of means. `None` where there is nothing to draw: one seed on one route.
///
/// Variances of the parts that are drawn add up, with the degrees of freedom of F. Satterthwaite (1946). A bootstrap's
/// own variance of `n` parts is too small by (n - 1) / n.
fn spread(sides: &[(f64, &Cells)]) -> Option<Spread> {
    let n_routes = sides[0].1.n_routes;
    let mut by_route = vec![0.0; n_routes];
    let mut parts: Vec<Vec<f64>> = Vec::new();
    for (factor, cells) in sides {
        let of_routes = cells.moves(n_routes, |_, route| route);
        by_route.iter_mut().zip(&of_routes).for_each(|(sum, moved)| *sum += factor * moved);
        parts.push(cells.moves(cells.n_seeds(), |seed, _| seed));
    }
    parts.push(by_route);
    parts.retain(|part| 1 < part.len());
    if parts.is_empty() {
        return None;
    }
    let (mut variance, mut of_resamples, mut squares) = (0.0, 0.0, 0.0);
    for part in &parts {
        let n = part.len() as f64;
        let own = part.iter().map(|moved| moved * moved).sum::<f64>() / (n * (n - 1.0));
        variance += own;
        of_resamples += own * (n - 1.0) / n;
        squares += own * own / (n - 1.0);
    }
    // Sums of equal fractions differ in their last bits.
    if variance < 1e-24 {
        return Some(Spread { tail: 0.5, half: 0.0 });
    }
    // Of a single part it is a whole number, but for the last bits.
    let freedom = (variance * variance / squares + 1e-9) as usize;
    let t = student_t(freedom.max(1));
    Some(Spread { tail: normal_tail(t * (variance / of_resamples).sqrt()), half: t * variance.sqrt() })
}

/// The probability that a normal number lies above `x`, which is not negative: formula 26.2.17 of M. Abramowitz and
/// I. Stegun, "Handbook of Mathematical Functions" (1964), to 1e-7.
fn normal_tail(x: f64) -> f64 {
    const FACTORS: [f64; 5] = [0.319_381_530, -0.356_563_782, 1.781_477_937, -1.821_255_978, 1.330_274_429];
    let t = 1.0 / (1.0 + 0.231_641_9 * x);
    let polynomial = FACTORS.iter().rev().fold(0.0, |sum, factor| t * (factor + sum));
    (polynomial * (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt()).max(0.0)
}

#[cfg(test)]
mod tests;
