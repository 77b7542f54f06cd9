//! Training by the library alone: what a caller is told, how a run is stopped and continued, and what is refused.

#![expect(clippy::unwrap_used, reason = "a failure of a test's helper fails the test")]

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use offtrack_learner::config::{Config, Rule};
use offtrack_learner::train::{Event, Watcher, resume, train};

/// A benchmark of one training route and two test routes.
const BENCHMARK: &str = r#"
vehicle = "SCENARIOS/vehicles/daf_xf.toml"
load = "empty"
gutter = "drivable"
actions = { steer_levels = [-0.8, 0.0, 0.8], speeds_kmh = [30.0] }
sensors = { range = 20.0 }
reward = { waypoint = 100.0, lane_distance = -1.5, lane_distance_limit = 4.0, failure = -500.0 }

[[roundabout]]
file = "SCENARIOS/roundabouts/16m.toml"
train = ["E-right-1"]

[[roundabout]]
file = "SCENARIOS/roundabouts/20m.toml"
test = ["E-right-1", "W-left-3"]
"#;

/// What makes a run of the default training file small.
const SMALL: [&str; 13] = [
    "training_benchmark=",
    "also_evaluate=",
    "validation=",
    "n_envs=8",
    "steps=4000",
    "replay_buffer={capacity=2000, warmup=400}",
    "learning.hidden=[16]",
    "learning.batch=32",
    "learning.updates_per_step=1",
    "learning.n_steps=3",
    "learning.layer_norm=false",
    "learning.mirror_augmentation=false",
    "level_replay=",
];

fn scenarios() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("scenarios")
}

/// A small config whose benchmark is written into `folder`.
fn small(folder: &Path) -> Config {
    let file = folder.join("short.toml");
    std::fs::write(&file, BENCHMARK.replace("SCENARIOS", scenarios().to_str().unwrap())).unwrap();
    let benchmark = format!("benchmark={}", file.display());
    let settings: Vec<String> = SMALL.iter().map(|&setting| setting.to_owned()).chain([benchmark]).collect();
    Config::read_with(Path::new("default"), &settings).unwrap()
}

/// The same among other vehicles, under a rule.
fn under_a_rule(folder: &Path) -> Config {
    let config = small(folder);
    let text = BENCHMARK
        .replace("[30.0]", "[0.0, 10.0, 30.0]")
        .replace("reward =", "traffic = { demand = [900.0] }\nreward =");
    std::fs::write(&config.benchmark, text.replace("SCENARIOS", scenarios().to_str().unwrap())).unwrap();
    Config { rule: Some(Rule::Yields), ..config }
}

const DEAF: &Watcher = &|_| {};

#[test]
fn a_caller_is_told_how_far_a_run_is_and_finds_its_files_and_its_report() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("runs/mine");
    let told: Mutex<Vec<String>> = Mutex::default();
    let (fractions, episodes) = (Mutex::<Vec<f64>>::default(), Mutex::<Vec<usize>>::default());
    let watcher = |event: Event| {
        let name = match event {
            Event::Begun(begun) => {
                assert_eq!((begun.folder, begun.resumed, begun.benchmark), (folder.as_path(), None, "short"));
                assert_eq!((begun.n_routes, begun.device), (1, "cpu"));
                "begun"
            }
            Event::Training(status) => {
                fractions.lock().unwrap().push(status.fraction);
                "training"
            }
            Event::Trained => "trained",
            Event::Evaluating { done, .. } => {
                episodes.lock().unwrap().push(done);
                "evaluating"
            }
            Event::Finished { .. } => "finished",
            _ => return,
        };
        let mut told = told.lock().unwrap();
        if told.last().is_none_or(|last| last != name) {
            told.push(name.to_owned());
        }
    };
    let outcome = train(&small(place.path()), &folder, &watcher, &AtomicBool::new(false)).unwrap();
    assert_eq!(told.into_inner().unwrap(), ["begun", "training", "trained", "evaluating", "finished"]);
    let (fractions, episodes) = (fractions.into_inner().unwrap(), episodes.into_inner().unwrap());
    assert!(fractions.is_sorted() && fractions.last() == Some(&1.0), "{fractions:?}");
    let report = outcome.evaluation.unwrap();
    assert!(episodes.is_sorted() && episodes.last() == Some(&report.summary.episodes), "{episodes:?}");
    assert_eq!((outcome.interrupted, outcome.env_steps, report.routes.len()), (false, 4000, 2));
    for file in ["config.toml", "metrics.csv", "policy.safetensors", "checkpoint.safetensors", "report.html"] {
        assert!(folder.join(file).is_file(), "{file}");
    }
    let written: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.join("report.json")).unwrap()).unwrap();
    assert_eq!(written["evaluation"]["success"], report.summary.success);
}

#[test]
fn a_run_that_a_caller_stops_and_continues_equals_one_never_stopped() {
    let place = tempfile::tempdir().unwrap();
    check_continued(&small(place.path()), place.path());
}

#[test]
fn a_run_that_is_stopped_before_it_learns_leaves_nothing_that_one_never_stopped_would_not() {
    let place = tempfile::tempdir().unwrap();
    let config = small(place.path());
    let text = std::fs::read_to_string(&config.benchmark).unwrap();
    let validating = text.replace("test = [\"E-right-1\", ", "validation = [\"E-right-1\"]\ntest = [");
    std::fs::write(&config.benchmark, validating).unwrap();
    // A validation is due after the fifth step of all trucks, and the learner begins long after that.
    let settings = ["validation={times=10000, episodes=1}", "replay_buffer={capacity=200000, warmup=200000}"];
    let settings: Vec<String> = SMALL.iter().chain(&settings).map(|&setting| setting.to_owned()).collect();
    let other = Config::read_with(Path::new("default"), &settings).unwrap();
    let (validation, replay_buffer) = (other.validation, other.replay_buffer);
    let config = Config { validation, replay_buffer, steps: Some(400_000), ..config };
    let (stop, folder) = (AtomicBool::new(false), place.path().join("run"));
    let outcome = std::thread::scope(|scope| {
        let watcher = |event: Event| {
            if matches!(event, Event::Begun(_)) {
                scope.spawn(|| {
                    std::thread::sleep(std::time::Duration::from_millis(50));
                    stop.store(true, Ordering::Relaxed);
                });
            }
        };
        train(&config, &folder, &watcher, &stop).unwrap()
    });
    assert!(outcome.interrupted && 40 < outcome.env_steps && outcome.updates == 0, "{outcome:?}");
    assert!(outcome.validation.is_none(), "{:?}", outcome.validation);
    assert_eq!(std::fs::read_to_string(folder.join("metrics.csv")).unwrap().lines().count(), 2);
    assert!(!folder.join("policies").exists());
}

#[test]
fn nobody_continues_a_run_that_is_still_evaluating_nor_touches_what_it_writes() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("runs/mine");
    let part = folder.join("checkpoint.part");
    let refused: Mutex<Option<String>> = Mutex::default();
    let was_told = AtomicBool::new(false);
    let watcher = |event: Event| {
        if matches!(event, Event::Evaluating { .. }) && !was_told.swap(true, Ordering::Relaxed) {
            std::fs::write(&part, b"being written").unwrap();
            let error = resume(&folder, None, Some(8000), DEAF, &AtomicBool::new(false)).unwrap_err();
            *refused.lock().unwrap() = Some(error.to_string());
        }
    };
    train(&small(place.path()), &folder, &watcher, &AtomicBool::new(false)).unwrap();
    let message = refused.into_inner().unwrap().unwrap();
    assert!(message.contains("metrics.csv: another run is writing it"), "{message}");
    assert!(part.is_file());
    let outcome = resume(&folder, None, Some(8000), DEAF, &AtomicBool::new(false)).unwrap();
    assert_eq!(outcome.env_steps, 8000);
    assert!(!part.exists());
}

#[test]
fn a_run_under_a_rule_continues_under_it_and_its_report_names_it() {
    let place = tempfile::tempdir().unwrap();
    let report = check_continued(&under_a_rule(place.path()), place.path());
    let policy = report["evaluation"]["policy"].as_str().unwrap();
    assert!(policy.starts_with("yields:") && policy.ends_with("policy.safetensors"), "{policy}");
}

/// Trains with this config, once stopped on the way and once not, and compares. Returns the report.
fn check_continued(config: &Config, place: &Path) -> serde_json::Value {
    let config = Config { checkpoint_minutes: 0.0001, steps: Some(24_000), ..config.clone() };
    let [stopped, never] = ["stopped", "never"].map(|name| place.join(name));
    let stop = AtomicBool::new(false);
    // With three rows the learner is on its way; far more follow.
    let rows = |folder: &Path| std::fs::read_to_string(folder.join("metrics.csv")).unwrap_or_default().lines().count();
    let outcome = std::thread::scope(|scope| {
        scope.spawn(|| {
            while rows(&stopped) < 3 {
                std::thread::yield_now();
            }
            stop.store(true, Ordering::Relaxed);
        });
        train(&config, &stopped, DEAF, &stop).unwrap()
    });
    assert!(outcome.interrupted && outcome.evaluation.is_none() && outcome.env_steps < 24_000, "{}", outcome.env_steps);
    let resumed = Mutex::new(None);
    let watcher = |event: Event| {
        if let Event::Begun(begun) = event {
            *resumed.lock().unwrap() = begun.resumed.map(|(env_steps, _)| env_steps);
        }
    };
    let go_on = AtomicBool::new(false);
    let continued = offtrack_learner::resume(&stopped, None, None, &watcher, &go_on).unwrap();
    assert_eq!(resumed.into_inner().unwrap(), Some(outcome.env_steps));
    let whole = train(&config, &never, DEAF, &go_on).unwrap();
    assert_eq!((continued.env_steps, continued.updates), (whole.env_steps, whole.updates));
    let policy = |folder: &Path| std::fs::read(folder.join("policy.safetensors")).unwrap();
    assert!(policy(&stopped) == policy(&never));
    let error = offtrack_learner::resume(&never, None, None, DEAF, &go_on).unwrap_err();
    assert!(error.is_wrong_input() && error.to_string().contains("it has finished"), "{error}");
    serde_json::from_slice(&std::fs::read(never.join("report.json")).unwrap()).unwrap()
}

#[test]
fn what_is_wrong_with_a_config_or_a_folder_is_named_and_nothing_is_made_or_replaced() {
    let place = tempfile::tempdir().unwrap();
    let (config, go_on) = (small(place.path()), AtomicBool::new(false));
    let folder = place.path().join("runs/mine");
    let missing = place.path().join("missing.toml").display().to_string();
    for (wrong, expected) in [
        (Config { n_envs: 0, ..config.clone() }, "config: n_envs: 0; must lie in"),
        (Config { steps: Some(400), ..config.clone() }, "config: steps: 400; must be above 400"),
        (Config { benchmark: missing.clone(), ..config.clone() }, "config: benchmark: "),
        (
            Config { rule: Some(Rule::Yields), ..config.clone() },
            "config: benchmark: short; it has no [traffic], and rule = \"yields\" caps target speeds",
        ),
        (Config { from: Some(missing), ..config.clone() }, "missing.toml"),
    ] {
        let error = train(&wrong, &folder, DEAF, &go_on).unwrap_err();
        assert!(error.is_wrong_input() && error.to_string().contains(expected), "{error}");
    }
    let error = train(&config, &folder, DEAF, &AtomicBool::new(true)).unwrap_err();
    assert!(error.to_string().contains("stopped before all roads were done"), "{error}");
    assert!(!folder.exists());
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("kept"), "").unwrap();
    let error = train(&config, &folder, DEAF, &go_on).unwrap_err();
    assert!(error.to_string().contains("folder: ") && error.to_string().contains("never overwritten"), "{error}");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
}

#[test]
fn an_evaluation_stands_until_a_run_that_continues_has_learned_more() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("run");
    train(&small(place.path()), &folder, DEAF, &AtomicBool::new(false)).unwrap();
    let (report, page) = (std::fs::read(folder.join("report.json")).unwrap(), folder.join("report.html"));
    let stands = || std::fs::read(folder.join("report.json")).unwrap() == report && page.is_file();
    // What is refused changes nothing.
    let list = folder.join("policies/policies.json");
    let whole = std::fs::read(&list).unwrap();
    std::fs::write(&list, "[{").unwrap();
    resume(&folder, None, Some(6000), DEAF, &AtomicBool::new(false)).unwrap_err();
    assert!(stands());
    std::fs::write(&list, whole).unwrap();
    // Nor does what is stopped before its first step.
    let stop = AtomicBool::new(false);
    let stopping = |event: Event| {
        if matches!(event, Event::Begun(_)) {
            stop.store(true, Ordering::Relaxed);
        }
    };
    assert!(resume(&folder, None, Some(6000), &stopping, &stop).unwrap().interrupted);
    assert!(stands());
    let outcome = resume(&folder, None, Some(6000), DEAF, &AtomicBool::new(false)).unwrap();
    assert!(!outcome.interrupted && !stands() && page.is_file());
    // An evaluation that was lost is made up for without a larger budget.
    std::fs::remove_file(folder.join("report.json")).unwrap();
    let again = resume(&folder, None, Some(6000), DEAF, &AtomicBool::new(false)).unwrap();
    assert!(again.evaluation.is_some());
    resume(&folder, None, Some(6000), DEAF, &AtomicBool::new(false)).unwrap_err();
}

#[test]
fn a_run_continues_without_the_policy_that_it_began_with_and_without_its_rows() {
    let place = tempfile::tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| place.path().join(name));
    train(&small(place.path()), &first, DEAF, &AtomicBool::new(false)).unwrap();
    let policy = first.join("policy.safetensors");
    let config = Config { from: Some(policy.display().to_string()), ..small(place.path()) };
    train(&config, &second, DEAF, &AtomicBool::new(false)).unwrap();
    std::fs::remove_file(policy).unwrap();
    std::fs::remove_file(second.join("metrics.csv")).unwrap();
    let warnings = Mutex::<Vec<String>>::default();
    let watcher = |event: Event| {
        if let Event::Warning(line) = event {
            warnings.lock().unwrap().push(line.to_owned());
        }
    };
    let outcome = resume(&second, None, Some(6000), &watcher, &AtomicBool::new(false)).unwrap();
    assert!(outcome.evaluation.is_some());
    let warnings = warnings.into_inner().unwrap();
    assert!(warnings.len() == 1 && warnings[0].contains("metrics.csv: was missing"), "{warnings:?}");
    let metrics = std::fs::read_to_string(second.join("metrics.csv")).unwrap();
    let env_steps = metrics.lines().nth(1).and_then(|row| row.split(',').nth(1)).map(str::parse::<u64>);
    assert!(env_steps.is_some_and(|steps| 4000 < steps.unwrap()), "{metrics}");
}
