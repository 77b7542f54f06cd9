//! `offtrack train`: what a run leaves behind, and what it refuses to begin.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// A benchmark of one route to learn on and one to be examined on.
const BENCHMARK: &str = r#"
vehicle = "vehicles/daf_xf.toml"
load = "empty"
gutter = "drivable"
actions = { steer_levels = [-0.8, -0.4, 0.0, 0.4, 0.8], speeds_kmh = [30.0] }
sensors = { range = 20.0 }
reward = { waypoint = 100.0, lane_distance = -1.5, lane_distance_limit = 4.0, failure = -500.0 }

[[roundabout]]
file = "roundabouts/16m.toml"
train = ["E-right-1"]

[[roundabout]]
file = "roundabouts/20m.toml"
test = ["E-right-1"]
"#;

/// A learner small enough that a run takes a second.
const TRAINING: &str = r#"
benchmark = "BENCHMARK"
seed = 5
n_envs = 8
steps = 1600
memory = { capacity = 2000, warmup = 400 }

[learning]
hidden = [16]
batch = 32
updates_per_step = 1
n_steps = 3
discount = 0.97
reward_scale = 0.01
actor_rate = 3e-4
critic_rate = 3e-4
critics = "average"
target_rate = 0.005
target_every = 1
average_rate = 0.005
entropy = { share = 0.25, weight = 0.05, rate = 3e-4 }
"#;

/// A folder with a benchmark, a training file for it, and room for runs.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Place {
        let place = Place(tempfile::tempdir().unwrap());
        let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("scenarios");
        let written = ["vehicles/", "roundabouts/"].iter().fold(BENCHMARK.to_owned(), |text, folder| {
            text.replace(&format!("\"{folder}"), &format!("\"{}/{folder}", scenarios.display()))
        });
        std::fs::write(place.file("short.toml"), written).unwrap();
        std::fs::write(place.file("tiny.toml"), TRAINING.replace("BENCHMARK", place.file("short.toml").to_str().unwrap())).unwrap();
        place
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn train(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_offtrack"));
        command.arg("train").arg(self.file("tiny.toml")).arg("--out").arg(self.file("runs")).args(arguments);
        command.output().unwrap()
    }

    fn policy(&self, run: &str) -> Vec<u8> {
        std::fs::read(self.file("runs").join(run).join("policy.safetensors")).unwrap()
    }
}

/// The one line that a refused run says.
fn refusal(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(2));
    String::from_utf8(output.stderr.clone()).unwrap()
}

#[test]
fn the_same_seed_and_steps_give_the_same_policy_byte_for_byte_and_another_seed_another() {
    let place = Place::new();
    for (run, seed) in [("one", "5"), ("two", "5"), ("three", "6")] {
        let output = place.train(&["--name", run, "--seed", seed]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert!(place.policy("one") == place.policy("two"));
    assert!(place.policy("one") != place.policy("three"));
}

#[test]
fn a_run_leaves_its_config_figures_policy_and_report() {
    let place = Place::new();
    let output = place.train(&["--steps", "2400"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let run = place.file("runs").join("tiny-1");
    let config = std::fs::read_to_string(run.join("config.toml")).unwrap();
    assert!(config.contains("steps = 2400"), "{config}");
    let metrics = std::fs::read_to_string(run.join("metrics.csv")).unwrap();
    let rows: Vec<usize> = metrics.lines().map(|row| row.split(',').count()).collect();
    assert!(2 <= rows.len() && rows.iter().all(|&columns| columns == rows[0]), "{metrics}");
    let report: Value = serde_json::from_str(&std::fs::read_to_string(run.join("report.json")).unwrap()).unwrap();
    assert_eq!(report["interrupted"], false);
    assert_eq!(report["env_steps"], 2400);
    assert_eq!(report["evaluation"]["split"], "test");
    // The config that was written begins the same run again.
    let again = Command::new(env!("CARGO_BIN_EXE_offtrack"))
        .args(["train", run.join("config.toml").to_str().unwrap(), "--name", "again", "--out", place.file("runs").to_str().unwrap()])
        .output()
        .unwrap();
    assert!(again.status.success(), "{}", String::from_utf8_lossy(&again.stderr));
    assert!(place.policy("again") == place.policy("tiny-1"));
}

#[test]
fn a_run_is_never_written_over() {
    let place = Place::new();
    std::fs::create_dir_all(place.file("runs").join("kept")).unwrap();
    let message = refusal(&place.train(&["--name", "kept"]));
    assert!(message.contains("--name: kept") && message.contains("never overwritten"), "{message}");
    assert_eq!(std::fs::read_dir(place.file("runs").join("kept")).unwrap().count(), 0);
    std::fs::create_dir_all(place.file("runs").join("tiny-1")).unwrap();
    assert!(place.train(&["--steps", "800"]).status.success());
    assert!(place.file("runs").join("tiny-2").join("policy.safetensors").is_file());
    let message = refusal(&place.train(&["--name", "../elsewhere"]));
    assert!(message.contains("--name"), "{message}");
}

#[test]
fn a_run_that_cannot_be_is_refused_before_a_folder_is_made() {
    let place = Place::new();
    for (arguments, expected) in [
        (&["--envs", "0"][..], "n_envs: 0; must lie in 1..65536"),
        (&["--minutes", "-1"][..], "minutes"),
        (&["--steps", "0"][..], "steps: 0; must lie in"),
    ] {
        let message = refusal(&place.train(arguments));
        assert!(message.contains(expected), "{message}");
    }
    let text = std::fs::read_to_string(place.file("tiny.toml")).unwrap();
    std::fs::write(place.file("tiny.toml"), text.replace("short.toml", "missing.toml")).unwrap();
    let message = refusal(&place.train(&[]));
    assert!(message.contains("missing.toml"), "{message}");
    assert!(!place.file("runs").exists());
}
