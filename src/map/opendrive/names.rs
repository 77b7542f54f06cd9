//! Names of arms: those that the user gives, or points of the compass.

use std::f64::consts::TAU;

use super::crossings::ArmLanes;
use crate::map::ground::Arm;

/// The arms with their names, or what is wrong with those that are given; none is given where they are to be found.
pub(super) fn named(lanes: &[ArmLanes], given: &[String], mirrored: bool) -> Result<Vec<Arm>, String> {
    let bearings: Vec<f64> = lanes.iter().map(|arm| arm.bearing().rem_euclid(TAU)).collect();
    let mut names = given.to_vec();
    if names.is_empty() {
        for bearing in &bearings {
            let bearing = if mirrored { -bearing } else { *bearing };
            let point = (bearing / TAU * 8.0).round().rem_euclid(8.0) as usize % 8;
            let name = ["E", "NE", "N", "NW", "W", "SW", "S", "SE"][point];
            let same =
                names.iter().filter(|other| other.trim_end_matches(|c: char| c.is_ascii_digit()) == name).count();
            names.push(if same == 0 { name.to_owned() } else { format!("{name}{}", same + 1) });
        }
    }
    if names.len() != lanes.len() {
        return Err(format!(
            "the ring has {} arms, at {} deg",
            lanes.len(),
            bearings.iter().map(|b| format!("{:.0}", b.to_degrees())).collect::<Vec<_>>().join(", ")
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
