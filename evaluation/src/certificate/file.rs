//! A certificate: which routes of a benchmark were completed from which starts, and the action sequences that completed
//! them.
//!
//! A sequence is run-length encoded, `4x12 5x3`: action 4 twelve times, then action 5 three times. Vehicle, clock and
//! action table are stated beside them, so that a file made under other conditions is refused by the condition that
//! differs.

use std::collections::{BTreeMap, HashSet};
use std::fmt::Write;
use std::path::Path;

use offtrack::files::reader::{self, shortened};
use offtrack::layout::{Rig, Start};
use offtrack::map::Gutter;
use offtrack::scenario::{Clock, Scenario};
use offtrack::vehicle::Model;
use offtrack::world::World;
use serde::{Deserialize, Serialize};

use super::beam::Pass;
use crate::error::Error;
use crate::files;

/// Version of the format.
const VERSION: u32 = 1;
/// Most bytes of a certificate: a hundred times that of all routes of attard2023.
const FILE_LIMIT: u64 = 64 << 20;
/// Most starts of every route.
const MOST_STARTS: usize = 1000;
/// Most steps of a sequence.
const MOST_STEPS: usize = 1_000_000;

/// A whole certificate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Certificate {
    /// Version of the format.
    pub version: u32,
    /// The benchmark's name.
    pub benchmark: String,
    /// `test`, `train`, `validation` or `all`.
    pub split: String,
    /// The routes and roads that were asked for, as they were given; empty where all of the split were.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub asked: Vec<String>,
    /// The policy whose actions were among the candidates.
    pub policy: Option<String>,
    /// Conditions that must be equal where the file is used, by name.
    pub conditions: BTreeMap<String, String>,
    /// Searches made in turn from each start until one arrived.
    pub passes: Vec<Pass>,
    /// The starts of every route: lateral offset and heading error as fractions of the largest ones.
    pub starts: Vec<[f32; 2]>,
    /// The machine that searched.
    pub machine: String,
    /// The commit that the program was built from.
    pub commit: String,
    /// Time of the search so far (s).
    pub seconds: f64,
    /// Env steps of the search so far.
    pub env_steps: u64,
    /// Every route searched so far.
    pub routes: Vec<CertifiedRoute>,
}

/// One route.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CertifiedRoute {
    /// `20m/N-left-3` and the like.
    pub name: String,
    /// The result of the search from each start, in the order of the starts.
    pub found: Vec<Found>,
}

/// The result of the search from one start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Found {
    /// `arrived`, or the end of the candidate with the most progress.
    pub ended: String,
    /// Fraction of the waypoints that the candidate passed.
    pub progress: f64,
    /// The candidate's number of steps.
    pub steps: u32,
    /// Beam width of the search that found it.
    pub width: usize,
    /// Steps that it held each action for.
    pub hold: usize,
    /// Env steps of all searches from this start.
    pub env_steps: u64,
    /// Run-length encoded actions to the arrival; empty where none was found.
    pub actions: String,
}

impl Found {
    /// A sequence was found.
    pub fn arrived(&self) -> bool {
        self.ended == offtrack::layout::Ended::Arrived.name()
    }
}

impl CertifiedRoute {
    /// A sequence was found from every start.
    pub fn certified(&self) -> bool {
        self.found.iter().all(Found::arrived)
    }
}

impl Certificate {
    /// A certificate without routes.
    pub fn new(
        scenario: &Scenario,
        world: &World,
        split: &str,
        policy: Option<String>,
        passes: Vec<Pass>,
        starts: &[Start],
    ) -> Certificate {
        Certificate {
            version: VERSION,
            benchmark: scenario.name.clone(),
            split: split.to_owned(),
            asked: Vec::new(),
            policy,
            conditions: conditions(scenario, world),
            passes,
            starts: starts.iter().map(|start| [start.offset, start.heading]).collect(),
            machine: crate::provenance::machine(),
            commit: crate::provenance::commit(),
            seconds: 0.0,
            env_steps: 0,
            routes: Vec::new(),
        }
    }

    /// Reads a certificate. A file that is truncated, of another format, or contradicts itself is refused.
    pub fn read(file: &Path) -> Result<Certificate, Error> {
        let bytes = reader::read_bytes(file, FILE_LIMIT)?;
        let wrong = |message: String| Error::contents(file, message);
        let certificate: Certificate = serde_json::from_slice(&bytes).map_err(|error| {
            wrong(format!("is not a certificate, or is damaged: {error}; `offtrack certify --json` writes one"))
        })?;
        if certificate.version != VERSION {
            return Err(wrong(format!(
                "is a certificate of version {}; this program reads version {VERSION}",
                certificate.version
            )));
        }
        if certificate.starts.is_empty() {
            return Err(wrong("is a damaged certificate: starts: empty; at least 1 is needed".into()));
        }
        if MOST_STARTS < certificate.starts.len() {
            let n = certificate.starts.len();
            return Err(wrong(format!(
                "is a damaged certificate: starts: {n} entries; at most {MOST_STARTS} are read"
            )));
        }
        let mut names = HashSet::new();
        if let Some(twice) = certificate.routes.iter().find(|route| !names.insert(&route.name)) {
            return Err(wrong(format!(
                "is a damaged certificate: {}: is there twice; a route has one entry",
                twice.name
            )));
        }
        for route in &certificate.routes {
            let (found, starts) = (route.found.len(), certificate.starts.len());
            if found != starts {
                return Err(wrong(format!(
                    "is a damaged certificate: {}: found: {found} entries; {starts} are needed, one a start",
                    route.name
                )));
            }
        }
        Ok(certificate)
    }

    /// Writes the certificate, a line for each route, whole or not at all.
    pub fn write(&self, file: &Path) -> Result<(), Error> {
        let head = serde_json::to_string(&Certificate { routes: Vec::new(), ..self.clone() });
        let lines = head.and_then(|head| files::json_lines(&head, &self.routes));
        let text = lines.map_err(|error| Error::write(file)(error.into()))? + "\n";
        files::write_whole(file, text.as_bytes())
    }

    /// Whether the sequences of this certificate are valid in `scenario`: whatever moves a truck or ends its episode
    /// must be equal. `file` is for the error.
    pub fn check(&self, scenario: &Scenario, world: &World, file: &Path) -> Result<(), Error> {
        let here = conditions(scenario, world);
        let keys = self.conditions.keys().chain(here.keys());
        let value = |conditions: &BTreeMap<String, String>, key: &String| {
            conditions.get(key).cloned().unwrap_or_else(|| "nothing".into())
        };
        for key in keys {
            let (there, here) = (value(&self.conditions, key), value(&here, key));
            if there != here {
                let (benchmark, made_for) = (&scenario.name, &self.benchmark);
                let message = format!(
                    "was made for {made_for} with another {key}: {there} there, {here} in {benchmark}; make one with \
                     `offtrack certify --benchmark BENCHMARK --json FILE`"
                );
                return Err(Error::contents(file, message));
            }
        }
        Ok(())
    }
}

/// Whatever moves a truck or ends its episode, apart from the roads. Numbers are rounded, so that they are equal on all
/// machines.
fn conditions(scenario: &Scenario, world: &World) -> BTreeMap<String, String> {
    let list =
        |values: &mut dyn Iterator<Item = f32>| values.map(|value| format!("{value:.4}")).collect::<Vec<_>>().join(" ");
    let params = &world.params;
    let mut rig: Vec<String> =
        bytemuck::cast_slice(&world.rigs).iter().map(|value: &f32| format!("{value:.4e}")).collect();
    // What a vehicle without a `model` has in the fields that came with it changes no certificate.
    if scenario.fleet.is_none() && scenario.vehicle.model == Model::default() {
        rig.truncate(std::mem::offset_of!(Rig, slip_lever_max) / size_of::<f32>());
    }
    let gutter = match scenario.gutter {
        Gutter::Drivable => "drivable",
        Gutter::Solid => "solid",
    };
    let entries = [
        ("vehicle", format!("{:08x}", crc32fast::hash(rig.join(" ").as_bytes()))),
        ("gutter", gutter.to_owned()),
        ("action table", list(&mut world.actions.iter().flat_map(|action| [action.steering, action.speed]))),
        ("step", format!("{:.4} s in {}", scenario.step, scenario.n_substeps)),
        ("largest start errors", list(&mut [params.start_offset, params.start_heading].into_iter())),
        (
            "ending",
            list(
                &mut [params.stray_distance, params.jackknife_angle, params.rollover_ratio, scenario.time_limit as f32]
                    .into_iter(),
            ),
        ),
    ];
    // A search drives the first vehicle; a benchmark of one vehicle and one speed has had none of these entries.
    let first = &world.classes[world.rigs[0].class_index as usize];
    let fleet = scenario.fleet.is_some().then(|| ("load", format!("{} {}", first.vehicle, first.load)));
    let clock = (scenario.clock != Clock::default()).then(|| ("clock", "feasible".to_owned()));
    let start =
        scenario.start_speed.map(|[least, greatest]| ("start speed", format!("{least:.4} to {greatest:.4} m/s")));
    let changes = (!scenario.speed_changes.is_empty())
        .then(|| ("target speeds", list(&mut [params.target_speed_min, params.target_speed_max].into_iter())));
    let delay =
        (world.disturbances.of_action == 1).then(|| ("action delay", world.disturbances.action_delay.to_string()));
    let later = [fleet, clock, start, changes, delay].into_iter().flatten();
    entries.into_iter().chain(later).map(|(key, value)| (key.to_owned(), value)).collect()
}

/// Run-length encodes actions.
pub fn runs(actions: &[u32]) -> String {
    let mut text = String::new();
    for run in actions.chunk_by(|a, b| a == b) {
        let gap = if text.is_empty() { "" } else { " " };
        let _ = write!(text, "{gap}{}x{}", run[0], run.len());
    }
    text
}

/// Decodes the first `limit` actions of [`runs`]. Each action must be below `n_actions`; the error says what is wrong.
pub fn actions(text: &str, n_actions: u32, limit: usize) -> Result<Vec<u32>, String> {
    let mut actions = Vec::new();
    let mut total = 0;
    for run in text.split_whitespace() {
        let numbers = run
            .split_once('x')
            .and_then(|(action, count)| Some((action.parse::<u32>().ok()?, count.parse::<usize>().ok()?)));
        match numbers {
            Some((action, count)) if action < n_actions && count <= MOST_STEPS - total => {
                total += count;
                actions.extend(std::iter::repeat_n(action, count.min(limit - actions.len())));
            }
            _ => {
                return Err(format!(
                    "actions: {}; runs like 4x12 are needed, of actions 0..{}, {MOST_STEPS} steps at most",
                    shortened(&format!("{run:?}"), 40),
                    n_actions - 1
                ));
            }
        }
    }
    Ok(actions)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn run_length_encoded_actions_are_decoded() {
        for sequence in [vec![], vec![4], vec![4, 4, 4, 0, 8, 8, 4]] {
            assert_eq!(actions(&runs(&sequence), 9, 100), Ok(sequence));
        }
        assert_eq!(runs(&[4, 4, 4, 0]), "4x3 0x1");
        assert_eq!(actions("4x3 0x1", 9, 2), Ok(vec![4, 4]));
    }

    #[test]
    fn a_wrong_run_of_actions_is_named() {
        for wrong in ["9x1", "4", "4x", "x4", "-1x2", "4x1000001", "4x1000000 4x1", "4x99999999999999999999"] {
            let said = actions(wrong, 9, 10).unwrap_err();
            assert!(
                said.contains(wrong.split(' ').next_back().unwrap()) && said.contains("of actions 0..8, "),
                "{said}"
            );
        }
    }
}
