//! A roundabout as the text of a file, in the form of the shipped ones.

use std::fmt::{self, Display, Formatter, Write};

use super::roundabout_keys::{Written, WrittenAlignment, WrittenArm, WrittenCorner, WrittenPoint, WrittenRing, WrittenWay};

/// TOML. Numbers are written so that reading them gives the same bits.
impl Display for Written {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let Written { ring: WrittenRing { island_radius, gutter, lane_width, lanes }, arm } = self;
        writeln!(f, "[ring]\nisland_radius = {island_radius:?}\ngutter = {gutter:?}\nlane_width = {lane_width:?}")?;
        lanes.iter().try_for_each(|lanes| writeln!(f, "lanes = {lanes}"))?;
        arm.iter().try_for_each(|arm| arm.fmt(f))
    }
}

impl Display for WrittenArm {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let WrittenArm { name, bearing_deg, length, lane_width, entry, exit, corner, splitter } = self;
        writeln!(f, "\n[[arm]]\nname = {name:?}\nbearing_deg = {bearing_deg:?}\nlength = {length:?}")?;
        lane_width.iter().try_for_each(|width| writeln!(f, "lane_width = {width:?}"))?;
        let WrittenCorner { kerb_radius, lane_radius } = corner;
        let radius = |name: &str, radius: &Option<f64>| radius.map(|radius| format!("{name} = {radius:?}"));
        let radii: Vec<String> = [radius("kerb_radius", kerb_radius), radius("lane_radius", lane_radius)].into_iter().flatten().collect();
        if !radii.is_empty() {
            writeln!(f, "corner = {{ {} }}", radii.join(", "))?;
        }
        if !splitter.is_empty() {
            writeln!(f, "splitter = [{}\n]", points(splitter)?)?;
        }
        for (way, WrittenWay { lanes, kerb, left, right }) in [("entry", entry), ("exit", exit)] {
            lanes.iter().try_for_each(|lanes| writeln!(f, "\n[arm.{way}]\nlanes = {lanes}"))?;
            for (part, alignment) in [("kerb", Some(kerb)), ("right", right.as_ref()), ("left", left.as_ref())] {
                let Some(WrittenAlignment { points: of, ring_radius }) = alignment else { continue };
                writeln!(f, "\n[arm.{way}.{part}]\npoints = [{}\n]\nring_radius = {ring_radius:?}", points(of)?)?;
            }
        }
        Ok(())
    }
}

fn points(points: &[WrittenPoint]) -> Result<String, fmt::Error> {
    let mut text = String::new();
    for WrittenPoint { along, offset, radius } in points {
        write!(text, "\n    {{ along = {along:?}, offset = {offset:?}")?;
        if let Some(radius) = radius {
            write!(text, ", radius = {radius:?}")?;
        }
        text.push_str(" },");
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_roundabouts_are_the_same_once_written_and_read_again() {
        let shipped = crate::shipped::FILES.iter().filter(|(path, _)| path.starts_with("roundabouts/"));
        let mut seen = 0;
        for (path, text) in shipped {
            let written: Written = toml::from_str(text).unwrap();
            assert_eq!(toml::from_str::<Written>(&written.to_string()).unwrap(), written, "{path}");
            seen += 1;
        }
        assert!(5 <= seen);
    }
}
