//! `offtrack trace`: drives the trajectory cases of a file with the simulator's equations of motion and prints the
//! states asked for.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use offtrack::files::reader::{read_text, shortened, shown_path};
use offtrack_reference::FILE_LIMIT;
use offtrack_reference::trace::{Case, Traced, trace};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;

use crate::outputs;

/// Drive the trajectory cases of a file of reference vectors and print the truck's state at the times they ask for.
///
/// A case has a vehicle, `dt`, `init`, `commands` and `t_end`; its times are `times` or those of `expected`. A sub-step
/// is `dt` long; a time between two sub-steps is reached with a shorter one. Cases of another kind are named on
/// standard error and skipped.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// JSON file with `cases`, in the format of tests/data/physics_vectors.json
    cases: PathBuf,
    /// Where to write the states instead of to standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Serialize)]
struct Report {
    cases: Vec<Traced>,
    skipped: Vec<Skipped>,
    /// Keys of vehicles that no trajectory uses.
    #[serde(skip)]
    ignored: BTreeSet<String>,
}

/// A case of a kind that is not a truck's trajectory.
#[derive(Serialize)]
struct Skipped {
    id: String,
    kind: String,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Error> {
    outputs::distinct(&[("--output", args.output.as_deref())], &[("CASES", Some(&args.cases))])?;
    let report = report(&args.cases)?;
    for Skipped { id, kind } in &report.skipped {
        let [id, kind] = [id, kind].map(|text| shortened(&format!("{text:?}"), 100));
        files::say(&format!(
            "{}: case {id} is skipped: its kind is {kind}, not \"trajectory\"",
            shown_path(&args.cases)
        ));
    }
    if !report.ignored.is_empty() {
        let keys: Vec<&str> = report.ignored.iter().map(String::as_str).collect();
        let keys = shortened(&keys.join(", "), 400);
        files::say(&format!("{}: keys of `vehicle` that no trajectory uses: {keys}", shown_path(&args.cases)));
    }
    match &args.output {
        Some(file) => files::write_json(file, &report),
        None => {
            let standard_output = Path::new("standard output");
            let text =
                serde_json::to_string_pretty(&report).map_err(|error| Error::write(standard_output)(error.into()))?;
            files::print_json(&text)
        }
    }
}

fn report(file: &Path) -> Result<Report, Error> {
    let wrong = |message: String| Error::contents(file, message);
    let text = read_text(file, FILE_LIMIT)?;
    let written: Value = serde_json::from_str(&text).map_err(|error| wrong(format!("is not JSON: {error}")))?;
    let cases = written["cases"]
        .as_array()
        .ok_or_else(|| wrong("cases: missing or not a list; a list of cases is needed".to_owned()))?;
    let mut report = Report { cases: Vec::new(), skipped: Vec::new(), ignored: BTreeSet::new() };
    for (index, case) in cases.iter().enumerate() {
        let text = |key: &str| {
            let text = case[key].as_str().map(str::to_owned);
            text.ok_or_else(|| {
                wrong(format!("cases[{index}].{key}: {}; must be text", shortened(&case[key].to_string(), 100)))
            })
        };
        let (id, kind) = (text("id")?, text("kind")?);
        if kind == "trajectory" {
            let case = Case::deserialize(case).map_err(|error| wrong(format!("case {id:?}: {error}")))?;
            report.ignored.extend(case.vehicle.ignored.keys().cloned());
            report.cases.push(trace(&case).map_err(|error| wrong(error.to_string()))?);
        } else {
            report.skipped.push(Skipped { id, kind });
        }
    }
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vectors() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/physics_vectors.json")
    }

    #[test]
    fn trajectories_are_driven_and_other_cases_are_named() {
        let report = report(&vectors()).unwrap();
        assert_eq!((report.cases.len(), report.skipped.len()), (22, 8));
        assert_eq!(report.skipped[0].kind, "closed_form");
        assert!(report.ignored.contains("v_max") && !report.ignored.contains("L1"), "{:?}", report.ignored);
        let printed = serde_json::to_value(&report).unwrap();
        let state = printed["cases"][0]["states"][1].as_object().unwrap();
        let keys = "t x y psi1 psi2 gamma v delta hitch trailer_axle ay1 ay2 ltr1_qs ltr2_qs ltr2_dyn";
        assert!(keys.split(' ').all(|key| state.contains_key(key)));
    }

    /// The error for the vectors with `from` replaced by `to`.
    fn refusal(from: &str, to: &str) -> String {
        let text = std::fs::read_to_string(vectors()).unwrap();
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text);
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("cases.json");
        std::fs::write(&file, changed).unwrap();
        let Err(error) = report(&file) else { panic!("{from} -> {to} was accepted") };
        assert!(error.is_wrong_input());
        error.to_string()
    }

    #[test]
    fn an_error_names_case_key_and_value() {
        for (from, to, expected) in [
            ("\"cases\"", "\"cassettes\"", "cases: missing or not a list"),
            ("{", "[", "is not JSON"),
            ("\"L1\"", "\"l1\"", "case \"straight_30\": missing field `L1`"),
            ("\"dt\": 0.05", "\"dt\": -1", "case \"straight_30\": dt: -1 s; must lie in 0.0001..0.2 s"),
            ("\"t_end\": 10", "\"t_end\": 4", "case \"straight_30\": expected[1].t: 5 s; must lie in 0..4 s"),
            ("\"kind\": \"trajectory\"", "\"kind\": 3", "cases[0].kind: 3; must be text"),
        ] {
            let message = refusal(from, to);
            assert!(message.contains("cases.json") && message.contains(expected), "{message}");
        }
    }
}
