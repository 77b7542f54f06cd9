//! Prioritised sampling: rows are sampled in proportion to their priorities, by a sum tree.
//!
//! T. Schaul and others, "Prioritized Experience Replay" (2016). Its twin on a device is
//! learner/shaders/priorities.wgsl.

use rand::Rng;

use crate::config::Priority;

/// Added to a TD error, so that a row without one can still be sampled.
pub(crate) const LEAST_ERROR: f32 = 1e-6;

/// Priorities of rows, and their sums in a binary tree.
#[derive(Debug, Clone)]
pub(super) struct Priorities {
    settings: Priority,
    /// Leaves, a power of 2.
    n_leaves: usize,
    n_rows: usize,
    /// Node 1 is the sum of all; node i that of nodes 2 i and 2 i + 1; the leaves come last.
    sums: Vec<f64>,
    /// The largest priority that a row ever had: that of a new row.
    largest: f64,
}

impl Priorities {
    /// Room for `n_rows` rows, none of which can be sampled yet.
    pub(super) fn new(settings: Priority, n_rows: usize) -> Priorities {
        let n_leaves = n_rows.next_power_of_two();
        Priorities { settings, n_leaves, n_rows, sums: vec![0.0; 2 * n_leaves], largest: 1.0 }
    }

    /// Priorities of all rows as [`Priorities::rows`] gave them.
    pub(super) fn restored(settings: Priority, rows: &[f64], largest: f64) -> Priorities {
        let mut priorities = Priorities { largest, ..Priorities::new(settings, rows.len()) };
        let n_leaves = priorities.n_leaves;
        priorities.sums[n_leaves..n_leaves + rows.len()].copy_from_slice(rows);
        // Every sum is that of its two halves, whatever the order in which they came about.
        for node in (1..n_leaves).rev() {
            priorities.sums[node] = priorities.sums[2 * node] + priorities.sums[2 * node + 1];
        }
        priorities
    }

    /// The settings.
    pub(super) fn settings(&self) -> Priority {
        self.settings
    }

    /// The priority of each row, `(rows)`.
    pub(super) fn rows(&self) -> &[f64] {
        &self.sums[self.n_leaves..self.n_leaves + self.n_rows]
    }

    /// The priority of a new row.
    pub(super) fn largest(&self) -> f64 {
        self.largest
    }

    /// Gives a row the largest priority.
    pub(super) fn include(&mut self, row: usize) {
        self.set(row, self.largest);
    }

    /// Excludes a row from sampling.
    pub(super) fn exclude(&mut self, row: usize) {
        self.set(row, 0.0);
    }

    /// Sets the priority of a row that can be sampled from its TD error.
    pub(super) fn set_td_error(&mut self, row: usize, error: f32) {
        let priority = f64::from(error + LEAST_ERROR).powf(self.settings.exponent);
        if 0.0 < self.sums[self.n_leaves + row] && priority.is_finite() {
            self.largest = self.largest.max(priority);
            self.set(row, priority);
        }
    }

    /// Samples a row from stratum `index` of `of` equal strata of the sum.
    pub(super) fn sample(&self, index: usize, of: usize, rng: &mut impl Rng) -> usize {
        let mut left = self.sums[1] * (index as f64 + rng.random::<f64>()) / of as f64;
        let mut node = 1;
        while node < self.n_leaves {
            node *= 2;
            // Rounding must not lead into an empty half.
            if self.sums[node] <= left && 0.0 < self.sums[node + 1] {
                left -= self.sums[node];
                node += 1;
            }
        }
        node - self.n_leaves
    }

    /// Importance-sampling weights of `rows`, `(n p) ^ -correction` over the largest of them; `n_rows` can be sampled.
    pub(super) fn weights(&self, rows: &[usize], n_rows: usize) -> Vec<f32> {
        let probability = |&row: &usize| self.sums[self.n_leaves + row] / self.sums[1];
        let weights: Vec<f64> =
            rows.iter().map(|row| (n_rows as f64 * probability(row)).powf(-self.settings.correction)).collect();
        let largest = weights.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        weights.iter().map(|weight| (weight / largest) as f32).collect()
    }

    fn set(&mut self, row: usize, priority: f64) {
        let mut node = self.n_leaves + row;
        self.sums[node] = priority;
        while 1 < node {
            node /= 2;
            self.sums[node] = self.sums[2 * node] + self.sums[2 * node + 1];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand::rngs::SmallRng;

    fn with_errors(errors: &[f32], exponent: f64, correction: f64) -> Priorities {
        let mut priorities = Priorities::new(Priority { exponent, correction }, errors.len());
        for (row, &error) in errors.iter().enumerate() {
            priorities.include(row);
            priorities.set_td_error(row, error);
        }
        priorities
    }

    #[test]
    fn rows_are_sampled_in_proportion_to_a_power_of_their_td_errors() {
        let errors = [0.0, 1.0, 4.0, 9.0, 16.0];
        let mut priorities = with_errors(&errors, 0.5, 0.4);
        priorities.exclude(3);
        let rng = &mut SmallRng::seed_from_u64(1);
        let mut counts = [0.0f64; 5];
        for draw in 0..70_000 {
            counts[priorities.sample(draw % 100, 100, rng)] += 1.0;
        }
        // Roots 0.001, 1, 2, 4 of the rows that are left; stratified sampling scatters by less than a per cent.
        for (count, expected) in counts.iter().zip([10.0, 10_000.0, 20_000.0, 0.0, 40_000.0]) {
            assert!((count - expected).abs() < 100.0 + 0.01 * expected, "{counts:?}");
        }
        assert_eq!(counts[3], 0.0);
    }

    #[test]
    fn importance_weights_are_inverse_to_the_sampling_probabilities() {
        let weights = with_errors(&[1.0, 4.0, 9.0, 16.0], 1.0, 1.0).weights(&[0, 1, 3], 4);
        for (weight, expected) in weights.iter().zip([1.0, 0.25, 1.0 / 16.0]) {
            assert!((weight - expected).abs() < 1e-5, "{weights:?}");
        }
    }

    #[test]
    fn a_new_row_has_the_largest_priority_and_an_excluded_one_stays_out() {
        let mut priorities = with_errors(&[4.0, 1.0, 1.0], 1.0, 0.0);
        priorities.exclude(2);
        priorities.set_td_error(2, 9.0);
        assert_eq!(priorities.sums[priorities.n_leaves + 2], 0.0);
        priorities.include(1);
        assert_eq!(priorities.sums[priorities.n_leaves + 1], priorities.largest);
        assert!((priorities.largest - 4.0).abs() < 1e-5);
    }
}
