//! The other vehicles of a recorded episode.

use offtrack_evaluation::recording::Vehicle;
use svg::node::element::{Group, Path};

use super::{Scene, point};
use crate::legend::{Entry, Swatch};
use crate::view::{View, colour};

/// Brake lights by parts of a vehicle's length ahead of its middle and of its width to the left: corners of both.
const LIGHTS: [[[f32; 2]; 4]; 2] = [lights(1.0), lights(-1.0)];

const fn lights(side: f32) -> [[f32; 2]; 4] {
    [[-0.5, side * 0.46], [-0.42, side * 0.46], [-0.42, side * 0.22], [-0.5, side * 0.22]]
}

/// The corners of a vehicle's brake lights, if they are lit (m).
pub(crate) fn brake_lights(vehicle: &Vehicle) -> impl Iterator<Item = [[f32; 2]; 4]> {
    LIGHTS.iter().filter(|_| vehicle.brakes()).map(|light| vehicle.at(*light))
}

/// The colour of a kind of vehicle.
pub(crate) fn kind(vehicle: &Vehicle) -> &'static str {
    if vehicle.is_van() || vehicle.is_large() { colour::VAN } else { colour::CAR }
}

impl Scene<'_> {
    /// Those of a frame.
    pub(super) fn vehicles(&self, view: &View, index: usize) -> Group {
        let others = self.recording.vehicles.get(index).map_or(&[][..], Vec::as_slice);
        others.iter().fold(Group::new(), |group, vehicle| {
            let area = |corners: [[f32; 2]; 4]| Path::new().set("d", view.polygon(&corners.map(point)));
            let edge = if vehicle.is_rude { (colour::RUDE, 3.0) } else { (colour::INK, 1.0) };
            let body = area(vehicle.corners()).set("fill", kind(vehicle)).set("stroke", edge.0);
            let group = group.add(body.set("stroke-width", edge.1));
            brake_lights(vehicle).fold(group, |group, light| group.add(area(light).set("fill", colour::BRAKES)))
        })
    }

    /// What is said of them; `when` follows the words.
    pub(super) fn vehicle_legend(&self, when: &str) -> Vec<Entry> {
        let mut all = self.recording.vehicles.iter().flatten();
        let Some(_) = all.next() else { return Vec::new() };
        let mut entries = vec![Entry::new(Swatch::Area(colour::CAR), format!("car{when}"))];
        let has = |is: fn(&Vehicle) -> bool| self.recording.vehicles.iter().flatten().any(is);
        let larger = match (has(Vehicle::is_van), has(Vehicle::is_large)) {
            (false, false) => None,
            (true, false) => Some("van"),
            (false, true) => Some("bus or truck"),
            (true, true) => Some("van, bus or truck"),
        };
        entries.extend(larger.map(|kinds| Entry::new(Swatch::Area(colour::VAN), format!("{kinds}{when}"))));
        if self.recording.vehicles.iter().flatten().any(|vehicle| vehicle.is_rude) {
            entries.push(Entry::new(Swatch::Line(colour::RUDE, 3.0, ""), "edge of who is rude"));
        }
        entries
    }
}
