//! What an observation consists of, and where each part stands.

use super::{EXTRAS, Extra, N_AROUND, N_EXTRAS, N_VALUES};

/// What an observation consists of, in this order: the [`N_VALUES`] values, the first extras, and the values of other
/// vehicles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ObservationLayout {
    /// Number of extras: the first so many of [`EXTRAS`].
    pub n_extras: usize,
    /// Whether the [`N_AROUND`] values of other vehicles stand behind them.
    pub has_vehicles: bool,
}

impl ObservationLayout {
    /// Everything that may be observed.
    pub const ALL: ObservationLayout = ObservationLayout { n_extras: N_EXTRAS, has_vehicles: true };

    /// The layout of so many values in all: all extras together are fewer than the values of other vehicles. None where
    /// no observation has so many values.
    pub const fn of_width(n_values: usize) -> Option<ObservationLayout> {
        let has_vehicles = N_VALUES + N_AROUND <= n_values;
        let without_extras = ObservationLayout { n_extras: 0, has_vehicles }.n_values();
        match n_values.checked_sub(without_extras) {
            Some(n_extras) if n_extras <= N_EXTRAS => Some(ObservationLayout { n_extras, has_vehicles }),
            _ => None,
        }
    }

    /// Values in all.
    pub const fn n_values(self) -> usize {
        self.vehicles_at() + if self.has_vehicles { N_AROUND } else { 0 }
    }

    /// Index of the first value of other vehicles.
    pub const fn vehicles_at(self) -> usize {
        N_VALUES + self.n_extras
    }

    /// Whether there are the [`N_VALUES`] values alone.
    pub const fn is_plain(self) -> bool {
        self.n_extras == 0 && !self.has_vehicles
    }

    /// The extras.
    pub const fn extras(self) -> &'static [Extra] {
        let (extras, _) = (&EXTRAS as &'static [Extra]).split_at(self.n_extras);
        extras
    }

    /// Names of the extras.
    pub fn extra_names(self) -> Vec<&'static str> {
        self.extras().iter().map(|extra| extra.name).collect()
    }

    /// Writes the observation of a row of the three columns, `[n_values]`. A column that is not in the layout may be
    /// empty.
    ///
    /// # Panics
    ///
    /// Where `observation` has another length, or a column of the layout has no such row.
    pub fn join(
        self,
        observation: &mut [f32],
        row: usize,
        values: &[[f32; N_VALUES]],
        extras: &[[f32; N_EXTRAS]],
        around: &[[f32; N_AROUND]],
    ) {
        let (own, beside) = observation.split_at_mut(N_VALUES);
        let (beside, others) = beside.split_at_mut(self.n_extras);
        own.copy_from_slice(&values[row]);
        if 0 < self.n_extras {
            beside.copy_from_slice(&extras[row][..self.n_extras]);
        }
        if self.has_vehicles {
            others.copy_from_slice(&around[row]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_values_says_which_they_are() {
        for n_extras in 0..=N_EXTRAS {
            for has_vehicles in [false, true] {
                let layout = ObservationLayout { n_extras, has_vehicles };
                assert_eq!(ObservationLayout::of_width(layout.n_values()), Some(layout));
            }
        }
        assert_eq!(ObservationLayout::ALL.n_values(), N_VALUES + N_EXTRAS + N_AROUND);
        for n_values in [0, N_VALUES - 1, N_VALUES + N_EXTRAS + 1, ObservationLayout::ALL.n_values() + 1] {
            assert_eq!(ObservationLayout::of_width(n_values), None);
        }
    }

    #[test]
    fn parts_stand_in_their_order_and_the_rest_is_left_out() {
        let values: [f32; N_VALUES] = std::array::from_fn(|index| index as f32);
        let extras: [f32; N_EXTRAS] = std::array::from_fn(|index| 100.0 + index as f32);
        let around: [f32; N_AROUND] = std::array::from_fn(|index| 200.0 + index as f32);
        let joined = |n_extras: usize, has_vehicles: bool, extras: &[_], around: &[_]| {
            let layout = ObservationLayout { n_extras, has_vehicles };
            let mut observation = vec![f32::NAN; layout.n_values()];
            layout.join(&mut observation, 1, &[[0.0; N_VALUES], values], extras, around);
            observation
        };
        let expected =
            |n_extras: usize, n_around: usize| [&values[..], &extras[..n_extras], &around[..n_around]].concat();
        let (all_extras, all_around) = ([[0.0; N_EXTRAS], extras], [[0.0; N_AROUND], around]);
        assert_eq!(joined(0, false, &[], &[]), expected(0, 0));
        assert_eq!(joined(5, false, &all_extras, &all_around), expected(5, 0));
        assert_eq!(joined(0, true, &[], &all_around), expected(0, N_AROUND));
        assert_eq!(joined(8, true, &all_extras, &all_around), expected(8, N_AROUND));
    }
}
