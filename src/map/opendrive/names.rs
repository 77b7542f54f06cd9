//! Names of arms: those that the user gives, or points of the compass.

use std::f64::consts::{PI, TAU};

use crate::map::ground::Arm;

/// The arms at these bearings (rad) with their names, or what is wrong with those that are given, which follow each
/// other counter-clockwise from east as the road is seen; none is given where they are to be found.
pub(in crate::map) fn named(bearings: &[f64], given: &[String], mirrored: bool) -> Result<Vec<Arm>, String> {
    let bearings: Vec<f64> = bearings.iter().map(|bearing| bearing.rem_euclid(TAU)).collect();
    // In the mirror image of a map its arms follow each other clockwise.
    let in_map = |bearing: f64| if mirrored { (-bearing).rem_euclid(TAU) } else { bearing };
    let mut order: Vec<usize> = (0..bearings.len()).collect();
    let from_east = |&arm: &usize| (in_map(bearings[arm]) + PI / 8.0).rem_euclid(TAU);
    order.sort_by(|one, other| from_east(one).total_cmp(&from_east(other)));
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
        if name.is_empty()
            || 20 < name.len()
            || !name.chars().all(|c| c.is_ascii_alphanumeric())
            || names[..i].contains(name)
        {
            return Err(
                "names must differ and be 1 to 20 letters and digits, because they are part of route names".into()
            );
        }
    }
    Ok(names.into_iter().zip(bearings).map(|(name, bearing)| Arm { name, bearing }).collect())
}
