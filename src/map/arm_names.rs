//! Names of arms: those that the user gives, or points of the compass.

use std::f64::consts::{PI, TAU};

use super::ground::{Arm, Ground};

/// A bearing as the road is seen: in the mirror image of a map its arms follow each other clockwise (rad).
fn in_map(bearing: f64, mirrored: bool) -> f64 {
    if mirrored { (-bearing).rem_euclid(TAU) } else { bearing.rem_euclid(TAU) }
}

/// A bearing counted from where east begins, so that one just below 360 deg comes first (rad).
pub(super) fn from_east(bearing: f64) -> f64 {
    (bearing + PI / 8.0).rem_euclid(TAU)
}

/// Indices of the arms at these bearings (rad), counter-clockwise from east as the road is seen.
fn order(bearings: &[f64], mirrored: bool) -> Vec<usize> {
    let mut order: Vec<usize> = (0..bearings.len()).collect();
    let place = |arm: &usize| from_east(in_map(bearings[*arm], mirrored));
    order.sort_by(|one, other| place(one).total_cmp(&place(other)));
    order
}

impl Ground {
    /// Names of its arms in the order in which they are given: counter-clockwise from east as the road is seen.
    pub fn arm_names(&self) -> Vec<&str> {
        let arms = &self.arms;
        let bearings: Vec<f64> = arms.iter().map(|arm| arm.bearing).collect();
        order(&bearings, self.mirrored).into_iter().map(|arm| arms[arm].name.as_str()).collect()
    }
}

/// The arms at these bearings (rad) with their names, or what is wrong with those that are given, which follow each
/// other counter-clockwise from east as the road is seen; none is given where they are to be found.
pub(super) fn named(bearings: &[f64], given: &[String], mirrored: bool) -> Result<Vec<Arm>, String> {
    let bearings: Vec<f64> = bearings.iter().map(|bearing| bearing.rem_euclid(TAU)).collect();
    let in_map = |bearing: f64| in_map(bearing, mirrored);
    let order = order(&bearings, mirrored);
    let mut names = given.to_vec();
    if given.len() == bearings.len() {
        order.iter().zip(given).for_each(|(&arm, name)| names[arm].clone_from(name));
    }
    if names.is_empty() {
        for &bearing in &bearings {
            let point = (in_map(bearing) / TAU * 8.0).round() as usize % 8;
            let name = ["E", "NE", "N", "NW", "W", "SW", "S", "SE"][point];
            let same =
                names.iter().filter(|other| other.trim_end_matches(|c: char| c.is_ascii_digit()) == name).count();
            names.push(if same == 0 { name.to_owned() } else { format!("{name}{}", same + 1) });
        }
    }
    if names.len() != bearings.len() {
        return Err(format!(
            "the ring has {} arms, at {} deg",
            bearings.len(),
            order
                .iter()
                .map(|&arm| (in_map(bearings[arm]).to_degrees().round() % 360.0).to_string())
                .collect::<Vec<_>>()
                .join(", ")
        ));
    }
    for (i, name) in names.iter().enumerate() {
        if !Arm::may_be_named(name) || names[..i].contains(name) {
            return Err(format!("names must differ and be {}", Arm::NAMES));
        }
    }
    Ok(names.into_iter().zip(bearings).map(|(name, bearing)| Arm { name, bearing }).collect())
}
