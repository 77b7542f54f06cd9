//! The results of a folder: written as they are found, and continued by a later call that asks the same.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use offtrack::files::reader;
use offtrack::map::{Gutter, Road};
use offtrack::vehicle::Vehicle;
use serde::{Deserialize, Serialize};

use super::row::Row;
use super::table::Units;
use crate::error::Error;
use crate::{files, provenance};

/// Version of the format.
const VERSION: u32 = 1;
/// Most bytes of a file that is continued: that of 100,000 rows.
const FILE_LIMIT: u64 = 256 << 20;

/// What is asked of every vehicle on every road.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Asked {
    /// Name of the vehicles' load.
    pub load: String,
    /// Speed of the truck, from its start on (km/h).
    pub speed_kmh: f64,
    /// Distance that both units must keep from the kerbs (m).
    pub clearance: f64,
    /// Whether the gutter may be driven on.
    pub gutter: Gutter,
    /// Beam widths of the search, tried in turn until a way is found.
    pub widths: Vec<usize>,
}

/// The results, as `fits.json` has them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Results {
    /// Version of the format.
    pub version: u32,
    /// Version of the program.
    pub program: String,
    /// Commit that the program was built from.
    pub commit: String,
    /// When the file was written, in UTC.
    pub date: String,
    /// The machine that searched.
    pub machine: String,
    /// What is asked.
    pub asked: Asked,
    /// What the figures assume, in words.
    pub assumptions: Vec<String>,
    /// Checksums of the roads and vehicles, by their names.
    pub inputs: BTreeMap<String, String>,
    /// The answers, a route and a vehicle each.
    pub rows: Vec<Row>,
}

impl Results {
    /// No results yet.
    pub fn new(asked: Asked, date: String) -> Results {
        Results {
            version: VERSION,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            commit: provenance::commit(),
            date,
            machine: provenance::machine(),
            assumptions: assumptions(&asked, Units::Metric),
            asked,
            inputs: BTreeMap::new(),
            rows: Vec::new(),
        }
    }

    /// What the figures assume, in these units.
    pub fn assumptions_in(&self, units: Units) -> Vec<String> {
        let general = assumptions(&self.asked, units);
        let of_roads = self.assumptions.get(general.len()..).unwrap_or_default();
        [general, of_roads.to_vec()].concat()
    }

    /// Notes a road, whose results another shape of it would not have.
    pub fn add_road(&mut self, road: &Road) {
        let of_aprons = "trailers may drive on aprons, tractors may not";
        if road.has_apron() && !self.assumptions.iter().any(|assumption| assumption == of_aprons) {
            self.assumptions.push(of_aprons.to_owned());
        }
        let text = road.ground().text(&[]);
        self.inputs.insert(format!("road {}", road.name), format!("{:08x}", crc32fast::hash(text.as_bytes())));
    }

    /// Notes a vehicle, whose results other dimensions of it would not have.
    pub fn add_vehicle(&mut self, name: &str, vehicle: &Vehicle) {
        let text = format!("{vehicle:?}");
        self.inputs.insert(format!("vehicle {name}"), format!("{:08x}", crc32fast::hash(text.as_bytes())));
    }

    /// Takes over the rows of `file`, if it is there.
    ///
    /// # Errors
    ///
    /// A file that is none of these, or one that answers another question.
    pub fn continue_from(&mut self, file: &Path) -> Result<(), Error> {
        if !file.exists() {
            return Ok(());
        }
        let bytes = reader::read_bytes(file, FILE_LIMIT)?;
        let other = "name another folder, or remove the file";
        let found: Results = serde_json::from_slice(&bytes)
            .map_err(|error| Error::contents(file, format!("is not a file of `offtrack fits`: {error}; {other}")))?;
        let differs = [
            ("version", found.version.to_string(), self.version.to_string()),
            ("commit", found.commit.clone(), self.commit.clone()),
            ("load", found.asked.load.clone(), self.asked.load.clone()),
            ("speed_kmh", found.asked.speed_kmh.to_string(), self.asked.speed_kmh.to_string()),
            ("clearance", found.asked.clearance.to_string(), self.asked.clearance.to_string()),
            ("gutter", format!("{:?}", found.asked.gutter), format!("{:?}", self.asked.gutter)),
            ("widths", format!("{:?}", found.asked.widths), format!("{:?}", self.asked.widths)),
        ]
        .map(|(key, there, here)| (key.to_owned(), there, here));
        let names: BTreeSet<&String> = found.inputs.keys().chain(self.inputs.keys()).collect();
        let input = |inputs: &BTreeMap<String, String>, name| inputs.get(name).cloned().unwrap_or("none".to_owned());
        let inputs =
            names.into_iter().map(|name| (name.clone(), input(&found.inputs, name), input(&self.inputs, name)));
        if let Some((key, there, here)) = differs.into_iter().chain(inputs).find(|(_, there, here)| there != here) {
            let message = format!("has results of another question: {key}: {there} there, {here} here; {other}");
            return Err(Error::contents(file, message));
        }
        self.rows = found.rows;
        Ok(())
    }

    /// The answer for a route and a vehicle.
    pub fn row(&self, route: &str, vehicle: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.route == route && row.vehicle == vehicle)
    }

    /// Writes the results, a line for each row, whole or not at all.
    ///
    /// # Errors
    ///
    /// A disk that is full, or a folder that may not be written.
    pub fn write(&self, file: &Path) -> Result<(), Error> {
        let head = serde_json::to_string_pretty(&Results { rows: Vec::new(), ..self.clone() });
        let lines = head.and_then(|head| files::json_lines(&head, &self.rows));
        let text = lines.map_err(|error| Error::write(file)(error.into()))? + "\n";
        files::write_whole(file, text.as_bytes())
    }
}

/// What the figures assume, in a road designer's words.
fn assumptions(asked: &Asked, units: Units) -> Vec<String> {
    let gutter = match asked.gutter {
        Gutter::Drivable => "gutters may be driven on",
        Gutter::Solid => "gutters may not be driven on",
    };
    let [speed, clearance] = match units {
        Units::Metric => [format!("{} km/h", asked.speed_kmh), format!("{} m", asked.clearance)],
        Units::Feet => [
            format!("{} {}", units.speed(asked.speed_kmh), units.of_speed()),
            format!("{} {}", units.length(asked.clearance), units.of_length()),
        ],
    };
    vec![
        format!("constant speed {speed}, from the start on"),
        format!("load {}; the trailer starts in line with the tractor", asked.load),
        format!("both units keep {clearance} from every kerb; {gutter}"),
        "wheels turn while driving, at the vehicle's steering rate and up to its lock".to_owned(),
        "on the lane's centre line the front axle follows it exactly, whatever the steering rate".to_owned(),
        "level road, no other traffic; the vehicle's outline is two rectangles at any height".to_owned(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked() -> Asked {
        Asked { load: "empty".into(), speed_kmh: 15.0, clearance: 0.3, gutter: Gutter::Drivable, widths: vec![64] }
    }

    #[test]
    fn results_without_rows_are_read_back_and_another_question_is_refused_by_what_differs() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("fits.json");
        let mut results = Results::new(asked(), "today".into());
        results.add_road(&Road::named("16m").unwrap());
        results.write(&file).unwrap();
        results.continue_from(&file).unwrap();
        let refused = |asked: Asked, road: &str| {
            let mut other = Results::new(asked, "tomorrow".into());
            other.add_road(&Road::named(road).unwrap());
            other.continue_from(&file).unwrap_err().to_string()
        };
        let said = refused(Asked { clearance: 0.5, ..asked() }, "16m");
        assert!(said.contains("clearance: 0.3 there, 0.5 here"), "{said}");
        let said = refused(asked(), "20m");
        assert!(said.contains("road 16m: ") && said.contains(" there, none here; "), "{said}");
        std::fs::write(&file, "{}").unwrap();
        assert!(refused(asked(), "16m").contains("is not a file of `offtrack fits`"));
    }
}
