//! A roundabout of one's own, from text as a file has it: its routes, and whether a vehicle sweeps over a kerb on them.
//!
//! `cargo run --release --example own_road`

use std::error::Error;
use std::fmt::Write;

use offtrack::map::{Gutter, Road};
use offtrack::vehicle::Vehicle;
use offtrack::vehicle::swept::{own_lane_suffices, swept_path};

/// Four arms at right angles, an entry and an exit of one lane each.
fn text() -> String {
    let mut text = "[ring]\nisland_radius = 15.0\ngutter = 0.5\nlane_width = 3.7\n".to_owned();
    for (name, bearing) in [("E", 0.0), ("N", 90.0), ("W", 180.0), ("S", 270.0)] {
        // Writing to a string cannot fail.
        let _ = write!(text, "\n[[arm]]\nname = \"{name}\"\nbearing_deg = {bearing:.1}\nlength = 100.0\n");
        for (way, offset) in [("entry", 8.5), ("exit", -8.5)] {
            let point = format!("points = [{{ along = 30.0, offset = {offset:.1} }}]");
            let _ = write!(text, "[arm.{way}.kerb]\n{point}\nring_radius = 15.0\n");
        }
    }
    text
}

fn main() -> Result<(), Box<dyn Error>> {
    let road = Road::from_toml("mine", &text())?;
    let rig = Vehicle::named("eu_4x2_13m6")?.rig("laden", 0.05, None);
    let kerbs = road.unit_kerbs_beyond_ends(Gutter::Drivable);
    for route in road.routes(40.0, 35.0, 2.0)? {
        let path = swept_path(&rig, &route.centre_line, 20.0 / 3.6, 0.25);
        let suffices = own_lane_suffices(&rig, kerbs.both(), &path);
        println!("{:<16} {}", route.name, if suffices { "keeps its lane" } else { "has to leave its lane" });
    }
    Ok(())
}
