//! The values that a policy reads of those that are observed, by their names.

use offtrack::layout::{EXTRAS, N_VALUES, OBSERVATION, ObservationLayout, VEHICLE_VALUES, Values};

/// Index of the first value of other vehicles, behind all extras.
pub(crate) const VEHICLES_AT: usize = ObservationLayout::ALL.vehicles_at();

/// Some of the values that are observed, in an order of their own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Selection {
    names: Vec<String>,
    indices: Vec<usize>,
}

impl Selection {
    /// The values of these names. A name is an extra's, a group's of [`OBSERVATION`] or [`VEHICLE_VALUES`], which
    /// stands for all of its values, or `group[2]`, which stands for the third of them.
    ///
    /// # Errors
    ///
    /// No name at all, one that nothing has, and one whose value was named before: what is wrong and what would do.
    pub fn of(names: &[String]) -> Result<Selection, String> {
        let mut indices: Vec<usize> = Vec::new();
        for name in names {
            let found = indices_of(name).ok_or_else(|| {
                let groups = |groups: &'static [Values]| groups.iter().map(|group| group.name);
                let extras = EXTRAS.iter().map(|extra| extra.name);
                let known: Vec<&str> = groups(&OBSERVATION).chain(extras).chain(groups(&VEHICLE_VALUES)).collect();
                format!("{name:?}; must be one of {}, or one value of several, as {:?}", known.join(", "), "bearing[0]")
            })?;
            if found.iter().any(|index| indices.contains(index)) {
                return Err(format!("{name:?}; a value that stands before it is among these: each is read once"));
            }
            indices.extend(found);
        }
        if indices.is_empty() {
            return Err("none; at least one is needed, or leave the key out to read all".to_owned());
        }
        Ok(Selection { names: names.to_vec(), indices })
    }

    /// The names, as they were given.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The indices of the values, of which the first [`N_VALUES`] are an observation's, those behind are extras, and
    /// the last ones are of other vehicles.
    pub fn indices(&self) -> &[usize] {
        &self.indices
    }

    /// The names of the extras among the values.
    pub fn extras(&self) -> impl Iterator<Item = &'static str> {
        self.indices.iter().filter_map(|index| EXTRAS.get(index.checked_sub(N_VALUES)?).map(|extra| extra.name))
    }

    /// The least that is observed where all of the values are.
    pub fn observation_layout(&self) -> ObservationLayout {
        let extras = self.indices.iter().filter(|index| (N_VALUES..VEHICLES_AT).contains(*index));
        ObservationLayout {
            n_extras: extras.map(|index| index + 1 - N_VALUES).max().unwrap_or_default(),
            has_vehicles: self.indices.iter().any(|&index| VEHICLES_AT <= index),
        }
    }
}

/// The indices of a name's values.
fn indices_of(name: &str) -> Option<Vec<usize>> {
    if let Some(extra) = EXTRAS.iter().position(|extra| extra.name == name) {
        return Some(vec![N_VALUES + extra]);
    }
    let (group, at) = match name.strip_suffix(']') {
        None => (name, None),
        Some(inside) => {
            let (group, digits) = inside.split_once('[')?;
            // As it is printed: neither `+1` nor `01`.
            let at: usize = digits.parse().ok().filter(|at: &usize| at.to_string() == digits)?;
            (group, Some(at))
        }
    };
    let first_of = |groups: &'static [Values], from: usize| {
        groups.iter().find(|values| values.name == group).map(|values| (from + values.first, values.n))
    };
    let (first, n) = first_of(&OBSERVATION, 0).or_else(|| first_of(&VEHICLE_VALUES, VEHICLES_AT))?;
    match at {
        None => Some((first..first + n).collect()),
        Some(at) => (at < n).then(|| vec![first + at]),
    }
}

#[cfg(test)]
mod tests {
    use offtrack::layout::N_AROUND;

    use super::*;

    fn selected(names: &[&str]) -> Result<Vec<usize>, String> {
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        Selection::of(&names).map(|selection| selection.indices().to_vec())
    }

    #[test]
    fn a_group_stands_for_all_of_its_values_an_index_for_one_and_extras_follow_the_69() {
        assert_eq!(selected(&["bearing[3]", "articulation", "bearing[0]", "steering"]).unwrap(), [9, 21, 6, 69]);
        let rays = selected(&["trailer_range", "tractor_range"]).unwrap();
        assert_eq!(rays, (30..59).collect::<Vec<usize>>());
        let extras = EXTRAS.map(|extra| extra.name);
        let groups = |groups: &'static [Values]| groups.iter().map(|group| group.name);
        let all: Vec<&str> = groups(&OBSERVATION).chain(extras).chain(groups(&VEHICLE_VALUES)).collect();
        assert_eq!(selected(&all).unwrap(), (0..VEHICLES_AT + N_AROUND).collect::<Vec<usize>>());
        assert_eq!(selected(&["entry_gone[1]", "gap"]).unwrap(), [81 + 5, 81 + 8]);
        let layout = |names: [&str; 2]| Selection::of(&names.map(str::to_owned)).unwrap().observation_layout();
        assert_eq!(layout(["steering", "friction"]), ObservationLayout { n_extras: 10, has_vehicles: false });
        assert_eq!(layout(["vehicle_left", "speed"]), ObservationLayout { n_extras: 0, has_vehicles: true });
        let names = ["friction".to_owned(), "speed".to_owned(), "steering".to_owned()];
        assert_eq!(Selection::of(&names).unwrap().extras().collect::<Vec<_>>(), ["friction", "steering"]);
    }

    #[test]
    fn a_name_that_nothing_has_or_that_came_before_is_refused_with_those_that_would_do() {
        for name in ["spede", "bearing[5]", "bearing[-1]", "bearing[+1]", "bearing[01]", "bearing[]", "bearing]", ""] {
            let message = selected(&["speed", name]).unwrap_err();
            let expected = format!("{name:?}; must be one of speed, waypoint_distance, ");
            assert!(message.starts_with(&expected) && message.ends_with("as \"bearing[0]\""), "{message}");
        }
        for names in [["bearing", "bearing[4]"], ["speed", "speed[0]"], ["friction", "friction"]] {
            let message = selected(&names).unwrap_err();
            assert!(message.starts_with(&format!("{:?}; a value that stands before it", names[1])), "{message}");
        }
        assert!(selected(&[]).unwrap_err().starts_with("none; at least one is needed"));
    }
}
