//! A folder with a small benchmark and a small training file, and helpers that run the program on them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// A benchmark of one training route and two test routes.
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
test = ["E-right-1", "W-left-3"]
"#;

/// Where the tests keep baked fields.
pub const CACHE: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/offtrack-cache");

/// A learner so small that a run takes a second.
const TRAINING: &str = r#"
benchmark = "BENCHMARK"
seed = 5
n_envs = 8
steps = 1600
replay_buffer = { capacity = 2000, warmup = 400 }

[learning]
hidden = [16]
batch = 32
updates_per_step = 1
n_steps = 3
gamma = 0.97
reward_scale = 0.01
normalise_observations = true
actor_learning_rate = 3e-4
critic_learning_rate = 3e-4
final_learning_rate_fraction = 0.1
layer_norm = false
critics = "mean"
tau = 0.005
target_interval = 1
actor_ema_rate = 0.005
entropy = { in_target = true, target_fraction = 0.25, coefficient = 0.05, learning_rate = 3e-4 }
"#;

/// A temporary folder with the benchmark `short.toml` and the training file `tiny.toml`; runs go to `runs`.
pub struct Place(tempfile::TempDir);

impl Place {
    pub fn new() -> Place {
        let place = Place(tempfile::tempdir().unwrap());
        let scenarios = repository().join("scenarios");
        let written = ["vehicles/", "roundabouts/"].iter().fold(BENCHMARK.to_owned(), |text, folder| {
            text.replace(&format!("\"{folder}"), &format!("\"{}/{folder}", scenarios.display()))
        });
        std::fs::write(place.file("short.toml"), written).unwrap();
        std::fs::write(place.file("tiny.toml"), TRAINING.replace("BENCHMARK", &place.text("short.toml"))).unwrap();
        place
    }

    /// Lets the training file choose the policy on a validation route, that of `validated.toml`, which is written too.
    pub fn validate(&self, times: usize, episodes: usize) {
        let benchmark = std::fs::read_to_string(self.file("short.toml")).unwrap();
        let [train, validation] = ["train = [\"E-right-1\"]", "validation = [\"N-right-1\"]"];
        assert!(benchmark.contains(train));
        std::fs::write(self.file("validated.toml"), benchmark.replace(train, validation)).unwrap();
        let training = std::fs::read_to_string(self.file("tiny.toml")).unwrap();
        let file = self.text("validated.toml");
        let table = format!("validation = {{ benchmark = \"{file}\", times = {times}, episodes = {episodes} }}");
        std::fs::write(self.file("tiny.toml"), format!("{table}\n{training}")).unwrap();
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A file's path as an argument.
    pub fn text(&self, name: &str) -> String {
        self.file(name).to_str().unwrap().to_owned()
    }

    pub fn train(&self, arguments: &[&str]) -> Output {
        self.training(arguments).output().unwrap()
    }

    /// A training command that has not been started.
    pub fn training(&self, arguments: &[&str]) -> Command {
        let mut command = program();
        command.args(["train", &self.text("tiny.toml"), "--out", &self.text("runs")]).args(arguments);
        command
    }

    /// `evaluate` on the short benchmark.
    pub fn evaluate(&self, arguments: &[&str]) -> Output {
        offtrack(&[&["evaluate", "--benchmark", &self.text("short.toml")], arguments].concat())
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&std::fs::read(self.file(name)).unwrap()).unwrap()
    }
}

pub fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// The program with a cache of the tests' own, so that they neither need nor fill that of the user.
pub fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_offtrack"));
    command.env("OFFTRACK_CACHE", CACHE);
    command
}

/// The program, run in the repository.
pub fn offtrack(arguments: &[&str]) -> Output {
    program().current_dir(repository()).args(arguments).output().unwrap()
}

pub fn succeed(output: &Output) {
    assert!(output.status.success(), "{}", said(output));
}

/// Standard error of a command that must end with exit code `code`.
pub fn refusal(output: &Output, code: i32) -> String {
    let said = said(output);
    assert_eq!(output.status.code(), Some(code), "{said}");
    assert!(!said.contains("panicked"), "{said}");
    said
}

pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
