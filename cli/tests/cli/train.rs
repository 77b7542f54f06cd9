//! `offtrack train`: what a run leaves behind, and what it refuses to begin.

use std::path::Path;

use offtrack_policy::{Activation, Frames, Policy};

use crate::place::{Place, offtrack, refusal, succeed};

fn policy(place: &Place, run: &str) -> Vec<u8> {
    std::fs::read(place.file("runs").join(run).join("policy.safetensors")).unwrap()
}

#[test]
fn the_same_seed_and_steps_give_the_same_policy_byte_for_byte_and_another_seed_another() {
    let place = Place::new();
    for (run, seed) in [("one", "5"), ("two", "5"), ("three", "6")] {
        succeed(&place.train(&["--name", run, "--seed", seed]));
    }
    assert!(policy(&place, "one") == policy(&place, "two"));
    assert!(policy(&place, "one") != policy(&place, "three"));
}

#[test]
fn a_run_leaves_its_config_metrics_policy_and_report() {
    let place = Place::new();
    succeed(&place.train(&["--steps", "2400"]));
    let run = place.file("runs").join("tiny-1");
    let config = std::fs::read_to_string(run.join("config.toml")).unwrap();
    assert!(config.contains("steps = 2400"), "{config}");
    let metrics = std::fs::read_to_string(run.join("metrics.csv")).unwrap();
    let rows: Vec<usize> = metrics.lines().map(|row| row.split(',').count()).collect();
    assert!(2 <= rows.len() && rows.iter().all(|&columns| columns == rows[0]), "{metrics}");
    let report = place.json("runs/tiny-1/report.json");
    assert_eq!(report["interrupted"], false);
    assert_eq!(report["env_steps"], 2400);
    assert_eq!(report["evaluation"]["split"], "test");
    // The config that was written begins the same run again.
    succeed(&offtrack(&[
        "train",
        run.join("config.toml").to_str().unwrap(),
        "--name",
        "again",
        "--out",
        &place.text("runs"),
    ]));
    assert!(policy(&place, "again") == policy(&place, "tiny-1"));
}

#[test]
fn a_run_is_never_written_over() {
    let place = Place::new();
    std::fs::create_dir_all(place.file("runs").join("kept")).unwrap();
    let message = refusal(&place.train(&["--name", "kept"]), 2);
    assert!(message.contains("--name: kept") && message.contains("never overwritten"), "{message}");
    assert_eq!(std::fs::read_dir(place.file("runs").join("kept")).unwrap().count(), 0);
    std::fs::create_dir_all(place.file("runs").join("tiny-1")).unwrap();
    assert!(place.train(&["--steps", "800"]).status.success());
    assert!(place.file("runs").join("tiny-2").join("policy.safetensors").is_file());
    for name in ["../elsewhere", "", ".hidden", "two words", &"n".repeat(201)] {
        let message = refusal(&place.train(&["--name", name]), 2);
        assert!(message.contains("--name: ") && message.contains("a name of 1 to 200 letters"), "{name}: {message}");
    }
}

#[test]
fn a_run_that_cannot_be_is_refused_before_a_folder_is_made() {
    let place = Place::new();
    for (arguments, expected) in [
        (&["--envs", "0"][..], "n_envs: 0; must lie in 1..1048576"),
        (&["--minutes", "-1"][..], "minutes"),
        (&["--steps", "0"][..], "steps: 0; must lie in"),
        (&["--steps", "5000", "--set", "steps=6000"][..], "--set: steps=6000; --steps is given, too: leave one of"),
        (&["--set", "seed=1", "--set", "seed=2"][..], "--set: seed=2; seed=1 is given, too: leave one of them out"),
        (
            &["--benchmark", "laden2026", "--set", "benchmark=random2026"][..],
            "--set: benchmark=random2026; --benchmark is given, too: leave one of them out",
        ),
        (&["--seeds", "1,2", "--set", "seed=7"][..], "--set: seed=7; --seeds is given, too: leave one of them out"),
    ] {
        let message = refusal(&place.train(arguments), 2);
        assert!(message.contains(expected), "{message}");
    }
    let text = std::fs::read_to_string(place.file("tiny.toml")).unwrap();
    std::fs::write(place.file("tiny.toml"), text.replace("short.toml", "missing.toml")).unwrap();
    let message = refusal(&place.train(&[]), 2);
    assert!(message.contains("missing.toml"), "{message}");
    assert!(!place.file("runs").exists());
}

#[test]
fn training_with_continuous_actions_is_refused_by_key_before_a_folder_is_made() {
    let place = Place::new();
    let benchmark = std::fs::read_to_string(place.file("short.toml")).unwrap();
    let levels = "steer_levels = [-0.8, -0.4, 0.0, 0.4, 0.8]";
    assert!(benchmark.contains(levels));
    let continuous = benchmark.replace(levels, "kind = \"continuous\"");
    std::fs::write(place.file("training.toml"), &continuous).unwrap();
    let training = format!("training_benchmark={}", place.text("training.toml"));
    let expected = "its actions.kind is \"continuous\", and training learns to choose among levels";
    let message = refusal(&place.train(&["--set", &training]), 2);
    assert!(message.contains("training_benchmark: training;") && message.contains(expected), "{message}");
    std::fs::write(place.file("short.toml"), &continuous).unwrap();
    let message = refusal(&place.train(&[]), 2);
    assert!(message.contains(": benchmark: short;") && message.contains(expected), "{message}");
    assert!(!place.file("runs").exists());
}

#[test]
fn training_on_a_test_route_or_with_other_actions_is_refused_before_a_folder_is_made() {
    let place = Place::new();
    let training = std::fs::read_to_string(place.file("tiny.toml")).unwrap();
    std::fs::write(
        place.file("tiny.toml"),
        format!("training_benchmark = \"{}\"\n{training}", place.text("training.toml")),
    )
    .unwrap();
    let benchmark = std::fs::read_to_string(place.file("short.toml")).unwrap();
    for (from, to, expected) in [
        ("test = ", "train = ", "20m/E-right-1 is a test route of short"),
        (
            "-0.8, -0.4,",
            "-0.8, -0.5,",
            "short, on which the policy is evaluated, differs in actions and vehicle lock: --benchmark",
        ),
        ("load =", "steer_max_deg = 30.0\nload =", "differs in actions and vehicle lock"),
        ("load = \"empty\"", "load = \"half\"", "differs in vehicle and load (empty)"),
        ("range = 20.0", "range = 19.0", "differs in sensors.range (20 m in place of 19 m)"),
    ] {
        assert!(benchmark.contains(from), "{from}");
        std::fs::write(place.file("training.toml"), benchmark.replacen(from, to, 1)).unwrap();
        let message = refusal(&place.train(&[]), 2);
        assert!(message.contains("training_benchmark: training") && message.contains(expected), "{message}");
        assert!(!place.file("runs").exists());
    }
    std::fs::write(place.file("training.toml"), &benchmark).unwrap();
    succeed(&place.train(&["--steps", "800"]));
}

#[test]
fn a_training_file_is_found_by_its_name() {
    let place = Place::new();
    let message = refusal(&offtrack(&["train", "papre", "--out", &place.text("runs")]), 2);
    assert!(
        message.contains(
            "papre: is no training file: the program comes with default, best, lane, attard, gpu, as-run, laden, \
            laden-50, transfer, transfer-refined, traffic, traffic-refined, laden-gpu, paper"
        ),
        "{message}"
    );
    let arguments = [
        "train",
        "paper",
        "--steps",
        "12000",
        "--set",
        "learning.hidden=[8]",
        "--set",
        "device=cpu",
        "--out",
        &place.text("runs"),
    ];
    let message = refusal(&offtrack(&[&arguments[..], &["--set", "benchmark=nowhere"]].concat()), 2);
    assert!(message.contains("nowhere"), "{message}");
}

#[test]
fn the_policy_kept_is_the_best_of_the_validations_and_the_last_of_equals() {
    let place = Place::new();
    place.validate(5, 3);
    succeed(&place.train(&["--name", "run"]));
    let report = place.json("runs/run/report.json");
    let validation = &report["validation"];
    assert_eq!(
        (&validation["routes"], &validation["episodes"], &validation["times"]),
        (&1.into(), &3.into(), &5.into())
    );
    // A learner so small arrives nowhere, so all validations are equal.
    assert_eq!(validation["best"], validation["last"]);
    assert_eq!(validation["last"]["env_steps"], report["env_steps"]);
    let metrics = std::fs::read_to_string(place.file("runs/run/metrics.csv")).unwrap();
    let (head, rows) = metrics.split_once('\n').unwrap();
    let column = head.split(',').position(|name| name == "validation_success").unwrap();
    let validated: Vec<&str> =
        rows.lines().filter_map(|row| row.split(',').nth(column)).filter(|text| !text.is_empty()).collect();
    assert_eq!(validated, ["0.0000"; 5]);
    // Validation changes nothing that is learned.
    succeed(&place.train(&["--name", "without", "--set", "validation="]));
    assert!(policy(&place, "run") == policy(&place, "without"));
}

#[test]
fn validation_routes_that_are_missing_or_trained_on_are_refused_before_a_folder_is_made() {
    let place = Place::new();
    let benchmark = std::fs::read_to_string(place.file("short.toml")).unwrap();
    std::fs::write(place.file("same.toml"), benchmark.replace("train = ", "validation = ")).unwrap();
    for (file, expected) in
        [("short.toml", "it has no validation routes"), ("same.toml", "16m/E-right-1 is a training route of short")]
    {
        let setting = format!("validation.benchmark={}", place.text(file));
        let arguments = ["--set", &setting, "--set", "validation.times=2", "--set", "validation.episodes=1"];
        let message = refusal(&place.train(&arguments), 2);
        assert!(message.contains("validation.benchmark") && message.contains(expected), "{message}");
    }
    assert!(!place.file("runs").exists());
}

#[test]
fn a_run_that_begins_with_a_policy_keeps_it_until_the_actor_learns() {
    let place = Place::new();
    succeed(&place.train(&["--name", "first"]));
    let first = place.text("runs/first/policy.safetensors");
    succeed(&place.train(&[
        "--name",
        "kept",
        "--seed",
        "6",
        "--from",
        &first,
        "--minutes",
        "0.02",
        "--set",
        "learning.actor_delay=1000000",
    ]));
    assert!(policy(&place, "kept") == policy(&place, "first"));
    succeed(&place.train(&["--name", "changed", "--seed", "6", "--from", &first]));
    assert!(policy(&place, "changed") != policy(&place, "first"));
    // It needs layers and actions of its own size, rectifiers between them, and to be there.
    let tanh = place.text("tanh.safetensors");
    let policy = Policy { activation: Activation::Tanh, ..Policy::load(Path::new(&first)).unwrap() };
    std::fs::write(&tanh, policy.to_bytes()).unwrap();
    let frames = place.text("frames.safetensors");
    let mut policy =
        Policy { frames: Frames { n: 2, ..Frames::default() }, ..Policy::load(Path::new(&first)).unwrap() };
    policy.layers[0].weights = policy.layers[0].weights.repeat(2);
    std::fs::write(&frames, policy.to_bytes()).unwrap();
    for (arguments, expected) in [
        (
            vec!["--from", &first, "--set", "learning.hidden=[8]"],
            "has hidden layers of [16]: learning.hidden must be equal, not [8]",
        ),
        (vec!["--from", "attard2023"], "learned with another action table"),
        (vec!["--from", "nowhere.safetensors"], "nowhere.safetensors"),
        (vec!["--from", "nosuch"], "from: \"nosuch\"; must be the path of a policy file or one of attard2023, "),
        (vec!["--set", "from=\"\""], "from: \"\"; must be the path of a policy file or one of attard2023, "),
        (vec!["--from", &frames], "has a memory, several frames, values of its own or commands: the learner continues"),
        (vec!["--from", &tanh], "has the activation tanh: the learner continues with relu alone"),
    ] {
        let message = refusal(&place.train(&[&["--name", "refused"], &arguments[..]].concat()), 2);
        assert!(message.contains(expected), "{message}");
    }
    assert!(!place.file("runs/refused").exists());
}

#[test]
fn level_replay_changes_what_is_learned_and_keeps_every_byte_the_same_for_a_seed() {
    let place = Place::new();
    let benchmark = std::fs::read_to_string(place.file("short.toml")).unwrap();
    std::fs::write(
        place.file("short.toml"),
        benchmark.replace("train = [\"E-right-1\"]", "train = [\"E-right-1\", \"E-left-3\"]"),
    )
    .unwrap();
    let replay = ["--set", "level_replay.fraction=0.5", "--set", "level_replay.rate=0.2"];
    for (run, settings) in [("uniform", &[][..]), ("one", &replay[..]), ("two", &replay[..])] {
        succeed(&place.train(&[&["--name", run], settings].concat()));
    }
    assert!(policy(&place, "one") == policy(&place, "two"));
    assert!(policy(&place, "one") != policy(&place, "uniform"));
    let message = refusal(
        &place.train(&["--name", "none", "--set", "level_replay.fraction=1.0", "--set", "level_replay.rate=0.2"]),
        2,
    );
    assert!(message.contains("level_replay.fraction: 1; must lie in 0..0.95"), "{message}");
}

/// The short benchmark with other splits, as `other.toml`: `short` is trained on 16m/E-right-1.
fn other_benchmark(place: &Place) -> String {
    let benchmark = std::fs::read_to_string(place.file("short.toml")).unwrap();
    let other =
        benchmark.replace("test = [\"E-right-1\", \"W-left-3\"]", "train = [\"E-right-1\"]\ntest = [\"W-left-3\"]");
    assert_ne!(other, benchmark);
    std::fs::write(place.file("other.toml"), other).unwrap();
    place.text("other.toml")
}

#[test]
fn further_evaluations_are_reported_with_the_number_of_routes_trained_on() {
    let place = Place::new();
    let other = other_benchmark(&place);
    let also = format!("also_evaluate=[\"{}/train\", \"{other}/train\", \"{other}\"]", place.text("short.toml"));
    let output = place.train(&["--name", "run", "--set", &also]);
    succeed(&output);
    let report = place.json("runs/run/report.json");
    let also: Vec<_> = report["also"]
        .as_array()
        .unwrap()
        .iter()
        .map(|also| (&also["benchmark"], &also["split"], &also["trained_on"]))
        .collect();
    assert_eq!(
        serde_json::json!(also),
        serde_json::json!([["short", "train", 1], ["other", "train", 1], ["other", "test", 0]])
    );
    let said = String::from_utf8(output.stdout).unwrap();
    // The same seed, start poses and routes: the same episodes as in the evaluation on `benchmark`.
    let route = |report: &serde_json::Value| {
        let routes = report["routes"].as_array().unwrap();
        routes.iter().find(|route| route["name"] == "20m/W-left-3").unwrap()["episodes"].clone()
    };
    assert_eq!(route(&report["also"][2]), route(&report["evaluation"]));
    for (name, familiarity) in [
        ("short test", "(zero-shot)"),
        ("short train", "(trained on)"),
        ("other train", "(1 of 2 routes trained on)"),
        ("other test", "(zero-shot)"),
    ] {
        let line = said.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{said}"));
        assert!(line.ends_with(familiarity) && line.contains("% ("), "{line}");
    }
    let page = std::fs::read_to_string(place.file("runs/run/report.html")).unwrap();
    assert!(page.contains(r#""trained_on":1"#));
}

#[test]
fn a_further_evaluation_that_cannot_be_is_refused_before_a_folder_is_made() {
    let place = Place::new();
    let other = other_benchmark(&place);
    let short = std::fs::read_to_string(place.file("short.toml")).unwrap();
    std::fs::write(place.file("tested.toml"), short.replace("train = ", "test = ")).unwrap();
    let tested = place.text("tested.toml");
    let missing = place.text("missing.toml");
    for (named, expected) in [
        ("nowhere", "also_evaluate: nowhere/test; benchmark: nowhere; must be"),
        (missing.as_str(), "missing.toml: cannot be read"),
        (&format!("{other}/validation"), "other has no routes under `validation`"),
        (
            "attard2023/train",
            "also_evaluate: attard2023/train; it differs from short, which is trained on, in actions and vehicle lock: \
            leave",
        ),
        (&tested, "16m/E-right-1 is trained on, so no test route may be"),
        (&format!("{other}/all"), "also_evaluate[0]"),
    ] {
        let message = refusal(&place.train(&["--set", &format!("also_evaluate=[\"{named}\"]")]), 2);
        assert!(message.contains("also_evaluate") && message.contains(expected), "{message}");
        assert!(!place.file("runs").exists());
    }
}

#[test]
fn a_wrong_benchmark_is_refused_with_the_file_and_the_key() {
    let place = Place::new();
    place.validate(2, 1);
    for key in ["benchmark", "training_benchmark", "validation.benchmark"] {
        for name in ["nowhere".to_owned(), place.text("nowhere.toml")] {
            let message = refusal(&place.train(&["--set", &format!("{key}={name}")]), 2);
            let expected = format!("tiny.toml with --set {key}={name}: {key}: ");
            assert!(message.contains(&expected) && message.contains("nowhere"), "{message}");
        }
    }
    let message = refusal(&place.train(&["--benchmark", "nowhere"]), 2);
    assert!(message.contains("tiny.toml with --benchmark nowhere: benchmark: nowhere; "), "{message}");
    let tested = std::fs::read_to_string(place.file("short.toml")).unwrap().replace("train = ", "test = ");
    std::fs::write(place.file("tested.toml"), tested).unwrap();
    let message = refusal(&place.train(&["--set", &format!("training_benchmark={}", place.text("tested.toml"))]), 2);
    assert!(message.contains("training_benchmark: tested; it has no routes under `train`"), "{message}");
    assert!(!place.file("runs").exists());
}

#[test]
fn a_run_says_first_what_it_will_do_and_last_what_its_checkpoint_is_for() {
    let place = Place::new();
    let output = place.train(&["--name", "run", "--steps", "800"]);
    succeed(&output);
    let said = String::from_utf8(output.stdout).unwrap();
    let first = said.lines().next().unwrap();
    assert!(
        first.contains(
            "tiny.toml: trains for 800 env steps of 8 trucks; while it trains a line says how long is left; then"
        ),
        "{said}"
    );
    let last = said.lines().last().unwrap();
    assert!(
        last.contains("checkpoint.safetensors (1 MB) is for train --resume") && last.ends_with("it may be deleted"),
        "{said}"
    );
}
