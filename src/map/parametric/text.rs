//! A roundabout as the text of a file, in the form of the shipped ones.

use std::fmt::{self, Display, Formatter, Write};

use crate::map::ground::Hand;

use super::corner::{CornerLane, WrittenCorner};
use super::roundabout_keys::{
    Written, WrittenAlignment, WrittenArm, WrittenDirection, WrittenPoint, WrittenRing, WrittenStation, WrittenWay,
};

/// TOML. Numbers are written so that reading them gives the same bits.
impl Display for Written {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let Written {
            hand,
            ring: WrittenRing { island_radius, gutter, lane_width, lanes, apron, island_gutter, mouth_gutter },
            arm,
        } = self;
        if *hand == Hand::Left {
            writeln!(f, "hand = \"left\"\n")?;
        }
        writeln!(f, "[ring]\nisland_radius = {island_radius:?}\ngutter = {gutter:?}\nlane_width = {lane_width:?}")?;
        lanes.iter().try_for_each(|lanes| writeln!(f, "lanes = {lanes}"))?;
        apron.iter().try_for_each(|apron| writeln!(f, "apron = {apron:?}"))?;
        for (name, gutter) in [("island_gutter", island_gutter), ("mouth_gutter", mouth_gutter)] {
            let Some(gutter) = gutter else { continue };
            let point =
                |&WrittenDirection { bearing_deg, width }: &WrittenDirection| ("bearing_deg", bearing_deg, width);
            writeln!(f, "{name} = [{}\n]", widths(gutter.iter().map(point))?)?;
        }
        arm.iter().try_for_each(|arm| arm.fmt(f))
    }
}

impl Display for WrittenArm {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let WrittenArm {
            name,
            bearing_deg,
            length,
            lane_width,
            entry,
            exit,
            corner,
            splitter,
            splitter_gutter,
            kerb_gutter,
        } = self;
        writeln!(f, "\n[[arm]]\nname = {name:?}\nbearing_deg = {bearing_deg:?}\nlength = {length:?}")?;
        lane_width.iter().try_for_each(|width| writeln!(f, "lane_width = {width:?}"))?;
        let WrittenCorner { kerb_radius, lane_radius, lane } = corner;
        let radius = |name: &str, radius: &Option<f64>| radius.map(|radius| format!("{name} = {radius:?}"));
        let lane = lane.map(|CornerLane::Ring| "lane = \"ring\"".to_owned());
        let radii = [radius("kerb_radius", kerb_radius), radius("lane_radius", lane_radius), lane];
        let radii: Vec<String> = radii.into_iter().flatten().collect();
        if !radii.is_empty() {
            writeln!(f, "corner = {{ {} }}", radii.join(", "))?;
        }
        if !splitter.is_empty() {
            writeln!(f, "splitter = [{}\n]", points(splitter)?)?;
        }
        splitter_gutter.iter().try_for_each(|width| writeln!(f, "splitter_gutter = {width:?}"))?;
        if let Some(gutter) = kerb_gutter {
            let point = |&WrittenStation { station, width }: &WrittenStation| ("station", station, width);
            writeln!(f, "kerb_gutter = [{}\n]", widths(gutter.iter().map(point))?)?;
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

fn widths(points: impl Iterator<Item = (&'static str, f64, f64)>) -> Result<String, fmt::Error> {
    let mut text = String::new();
    for (name, x, width) in points {
        write!(text, "\n    {{ {name} = {x:?}, width = {width:?} }},")?;
    }
    Ok(text)
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
        let shipped = crate::files::shipped::FILES.iter().filter(|(path, _)| path.starts_with("roundabouts/"));
        let mut seen = 0;
        for (path, text) in shipped {
            let written: Written = toml::from_str(text).unwrap();
            assert_eq!(toml::from_str::<Written>(&written.to_string()).unwrap(), written, "{path}");
            seen += 1;
        }
        assert!(5 <= seen);
    }
}
