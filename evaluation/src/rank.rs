//! Percentiles by the nearest rank: always one of the values.

/// The value that a fraction of all lies at or below; `None` if there are none. Sorts the values.
pub(crate) fn nearest_rank(values: &mut [f64], fraction: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let rank = (fraction * values.len() as f64).ceil() as usize;
    values.get(rank.clamp(1, values.len().max(1)) - 1).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentile_is_the_value_of_its_rank_rounded_up() {
        let mut values = [4.0, 1.0, 3.0, 2.0];
        let found = [0.0, 0.25, 0.26, 0.5, 0.99, 1.0].map(|fraction| nearest_rank(&mut values, fraction));
        assert_eq!(found, [1.0, 1.0, 2.0, 2.0, 4.0, 4.0].map(Some));
        assert_eq!(nearest_rank(&mut [], 0.5), None);
    }
}
